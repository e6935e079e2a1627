// What the kernels of the ground stage share: the camera, planes in disparity space, order statistics.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

// Compiles a function once more for each wider instruction set, of which the loader takes the best
// that the machine has. Without contraction the answers are the same to the bit.
#if defined(__x86_64__) && defined(__GLIBC__) && __GNUC__ >= 12 && !defined(__clang__)
#define BEARCUB_WIDE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define BEARCUB_WIDE
#endif

namespace bearcub {

// src/bearcub/geometry.py, Projection.
struct Lens {
    double fx, fy, cx, cy, baseline;
};

// The floor's disparity, a u + b v + c.
struct Plane {
    double a, b, c;

    double at(double u, double v) const { return a * u + b * v + c; }
};

// A disparity map: `down` and `right` are steps in floats, negative ones turn it.
struct Disparity {
    const float* data;
    int rows, columns;
    std::ptrdiff_t down, right;

    float at(int v, int u) const { return data[v * down + u * right]; }
};

// src/bearcub/robust.py, quantile; reorders the values.
template <class T>
T quantile(std::vector<T>& values, double share) {
    const auto rank = static_cast<std::size_t>(share * (values.size() - 1) + 0.5);
    std::nth_element(values.begin(), values.begin() + rank, values.end());
    return values[rank];
}

// Memory that lasts from frame to frame. Not inlined: its address is asked for once.
template <class T>
__attribute__((noinline)) T& of_this_thread() {
    static thread_local T kept;
    return kept;
}

}  // namespace bearcub
