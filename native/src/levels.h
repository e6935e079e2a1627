// The instruction sets that there are kernels for.
#pragma once

#include <vector>

#include "gate_kernels.h"
#include "kernels.h"
#include "rectify_kernels.h"
#include "refine_kernels.h"

namespace bearcub {

struct Level {
    const char* name;
    const Kernels* match;
    const GateKernels* gate;
    const RefineKernels* refine;
    const RectifyKernels* rectify;
};

// Those that this machine runs, the best first.
std::vector<Level> levels();

}  // namespace bearcub
