// Where the images alone tell the foot of a small thing: the twin of
// src/bearcub/obstacles/parallax.py, which has the reasons.
#pragma once

#include <vector>

#include "grid.h"
#include "outline.h"
#include "parallax_kernels.h"

namespace bearcub {

// In pixels of the strip.
struct Foot {
    int u, v;
    float level, sure;
};

// What tells of parallax at every pixel of a strip, rows one after the other: the twin of
// evidence in parallax.py.
struct ParallaxEvidence {
    float *energy, *seen, *noise;
};

void look_for_parallax(const Pair&, const Surface&, const Strip&, const FeetTuning&,
                       const LookKernels&, const ParallaxEvidence& to);

std::vector<Foot> find_feet(const Pair&, const Surface&, const Strip&, const std::vector<Band>&,
                            const FeetTuning&, const LookKernels&);

}  // namespace bearcub
