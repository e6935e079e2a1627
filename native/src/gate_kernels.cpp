// The gate's inner loops: plain ones, which the compiler turns into vectors. This file is compiled
// once per instruction set, like kernels.cpp. All sums are of whole numbers, so that the answer is
// the same on every level and that of src/bearcub/stereo/gates.py, which has the reasons.
#include "gate_kernels.h"

#include "kernels.h"
#include "simd.h"

namespace bearcub::BEARCUB_LEVEL {
namespace {

constexpr unsigned kFraction = 32;   // parts of a column that a match is told to
constexpr int kStepsPerPixel = 8;    // of disparity at full size
constexpr int kMostSteps = 1 << 14;  // either way; farther matches are taken for this far

void halved(const uint8_t* __restrict upper, const uint8_t* __restrict lower, int width,
            uint8_t* __restrict to) {
    for (int x = 0; x < width; ++x) {
        const int sum = upper[2 * x] + upper[2 * x + 1] + lower[2 * x] + lower[2 * x + 1];
        to[x] = static_cast<uint8_t>((sum + 2) >> 2);
    }
}

// Rounded down from `parts` a pixel; 0 where unknown.
BEARCUB_INLINE int whole(float disparity, float parts, float offset, float most) {
    const float found = finite(disparity) ? disparity * parts + offset : 0.0f;
    return static_cast<int>(__builtin_floorf(clamped(found, -most, most)));
}

void shifted(const uint8_t* __restrict right, const float* __restrict disparity, int width,
             uint32_t* __restrict scratch, uint8_t* __restrict to) {
    constexpr int parts = kFraction;
    const int last = parts * (width - 1);
    for (int x = 0; x < width; ++x) {
        const int there = parts * x - whole(disparity[2 * x], parts / 2, 0.5f, 1 << 24);
        scratch[x] = static_cast<uint32_t>(clamped(there, 0, last));
    }
    for (int x = 0; x < width; ++x) {  // no vector operation fetches bytes from anywhere
        const uint8_t* at = right + scratch[x] / kFraction;
        scratch[x] = at[0] | at[1] << 8 | scratch[x] % kFraction << 16;
    }
    for (int x = 0; x < width; ++x) {
        const uint32_t here = scratch[x] & 255, next = scratch[x] >> 8 & 255;
        const uint32_t share = scratch[x] >> 16;
        const uint32_t sum = here * (kFraction - share) + next * share;
        to[x] = static_cast<uint8_t>((sum + kFraction / 2) / kFraction);
    }
}

void compared(const uint8_t* __restrict left, const uint8_t* __restrict matched,
              const float* __restrict disparity, int width, const Evidence& to) {
    int32_t *__restrict texture = to.texture, *__restrict difference = to.difference;
    for (int x = 0; x < width; ++x) {
        const int here = left[x + 1] - left[x - 1], there = matched[x + 1] - matched[x - 1];
        const bool known = finite(disparity[2 * x]);
        texture[x] = known ? (here * here + there * there) << kCountBits | 1 : 0;
        difference[x] = known ? (here - there) * (here - there) : 0;
    }
}

BEARCUB_INLINE int32_t sum_of(const int32_t* row, int x) {
    const int32_t* at = row + x;
    return ((at[-3] + at[-2]) + (at[-1] + at[0])) + ((at[1] + at[2]) + at[3]);
}

void believed(const Evidence (&rows)[kPatch], const Belief& belief,
              const float* __restrict disparity, int width, const Evidence& scratch,
              int16_t* __restrict steps) {
    static_assert(kPatch == 7, "seven rows, seven columns");
    const auto sum_rows = [&](int32_t* Evidence::* quantity) {
        const int32_t* row[kPatch];
        for (int i = 0; i < kPatch; ++i) row[i] = rows[i].*quantity;
        int32_t* __restrict to = scratch.*quantity;
        for (int x = -kBeside; x < width + kBeside; ++x) {
            to[x] = ((row[0][x] + row[1][x]) + (row[2][x] + row[3][x])) +
                    ((row[4][x] + row[5][x]) + row[6][x]);
        }
        return to;
    };
    const int32_t* texture = sum_rows(&Evidence::texture);
    const int32_t* difference = sum_rows(&Evidence::difference);
    const float agreement = belief.agreement, least = belief.least;
    for (int x = 0; x < width; ++x) {
        const int counted = sum_of(texture, x), known = counted & ((1 << kCountBits) - 1);
        const float found = static_cast<float>(counted >> kCountBits);
        const bool sure = (static_cast<float>(sum_of(difference, x)) < agreement * found) &
                          (found > least * static_cast<float>(known));
        const int step = whole(disparity[2 * x], kStepsPerPixel, 0.0f, kMostSteps - 1) + kMostSteps;
        steps[x] = static_cast<int16_t>(sure & finite(disparity[2 * x]) ? step : kNone);
    }
}

}  // namespace

extern const GateKernels gate_kernels;
const GateKernels gate_kernels = {halved, shifted, compared, believed};

}  // namespace bearcub::BEARCUB_LEVEL
