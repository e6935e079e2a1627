// The instruction sets that there are kernels for.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gate_kernels.h"
#include "kernels.h"
#include "parallax_kernels.h"
#include "rectify_kernels.h"
#include "refine_kernels.h"

namespace bearcub {

struct Level {
    const char* name;
    const Kernels* match;
    const GateKernels* gate;
    const RefineKernels* refine;
    const RectifyKernels* rectify;
    const LookKernels* look;
};

// Those that this machine runs, the best first.
std::vector<Level> levels();

// The one of that name; by itself the best.
Level level_of(const std::optional<std::string>& name);

}  // namespace bearcub
