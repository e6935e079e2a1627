// The inner loops of the refinement: plain ones, which the compiler turns into vectors. This file
// is compiled once per instruction set, like kernels.cpp. All sums are formed in one order, so that
// the answer is the same on every level and for any number of threads.
//
// B. D. Lucas, T. Kanade: An iterative image registration technique with an application to stereo
// vision, IJCAI 1981. src/bearcub/stereo/refine.py is the same in NumPy, with the reasons.
#include "refine_kernels.h"

#include <cstring>

#include "simd.h"

namespace bearcub::BEARCUB_LEVEL {
namespace {

constexpr float kFarthest = 0.5f;  // largest correction of a step [px]
constexpr float kNoise = 0.5f;     // gradient energy that noise alone has [grey levels squared]

void matched(const uint8_t* __restrict right, const float* __restrict disparity, int width,
             uint32_t* __restrict scratch, float* __restrict grey) {
    const float last = static_cast<float>(width - 1);
    const auto there = [&](int x) {
        const float d = finite(disparity[x]) ? disparity[x] : 0.0f;
        return clamped(static_cast<float>(x) - d, 0.0f, last);
    };
    for (int x = 0; x < width; ++x) scratch[x] = static_cast<uint32_t>(static_cast<int>(there(x)));
    for (int x = 0; x < width; ++x) {  // no vector operation fetches bytes from anywhere
        uint16_t both;  // the lower byte is the first one
        std::memcpy(&both, right + scratch[x], sizeof both);
        scratch[x] = both;
    }
    for (int x = 0; x < width; ++x) {
        const float at = there(x), share = at - static_cast<float>(static_cast<int>(at));
        const float here = static_cast<float>(static_cast<int>(scratch[x] & 255));
        const float next = static_cast<float>(static_cast<int>(scratch[x] >> 8));
        grey[x] = here + share * (next - here);
    }
}

void differences(const uint8_t* const (&left)[3], const float* const (&matched)[3],
                 const float* __restrict disparity, int width, float* __restrict slope,
                 float* __restrict difference) {
    const uint8_t *__restrict a = left[0], *__restrict b = left[1], *__restrict c = left[2];
    const float *__restrict p = matched[0], *__restrict q = matched[1], *__restrict r = matched[2];
    const auto sobel = [](auto above, auto row, auto below, int x) {
        return (above[x + 1] - above[x - 1]) + 2 * (row[x + 1] - row[x - 1]) +
               (below[x + 1] - below[x - 1]);
    };
    for (int x = 0; x < width; ++x) {
        const float both = static_cast<float>(sobel(a, b, c, x)) + sobel(p, q, r, x);
        slope[x] = finite(disparity[x]) ? both * (1.0f / 16) : 0.0f;
        difference[x] = static_cast<float>(b[x]) - q[x];
    }
}

void sums(const float* __restrict row, int width, float* __restrict scratch,
          float* __restrict to) {
    static_assert(kWindow == 9, "eight columns and one");
    const float* __restrict first = row - kHalfWindow;
    for (int x = 0; x < width + 6; ++x) scratch[x] = first[x] + first[x + 1];
    for (int x = 0; x < width; ++x) {
        to[x] = ((scratch[x] + scratch[x + 2]) + (scratch[x + 4] + scratch[x + 6])) + first[x + 8];
    }
}

BEARCUB_INLINE float sum_of(NineRows<float> rows, int x) {
    return (((rows[0][x] + rows[1][x]) + (rows[2][x] + rows[3][x])) +
            ((rows[4][x] + rows[5][x]) + (rows[6][x] + rows[7][x]))) + rows[8][x];
}

void products(NineRows<float> difference_sums, const float* __restrict difference,
              const float* __restrict slope, int width, float* __restrict cross,
              float* __restrict square) {
    for (int x = 0; x < width; ++x) {
        const float centred = difference[x] - sum_of(difference_sums, x) * (1.0f / (kWindow * kWindow));
        cross[x] = slope[x] * centred;
        square[x] = slope[x] * slope[x];
    }
}

void moved(NineRows<float> cross_sums, NineRows<float> square_sums,
           const float* __restrict disparity, int width, float* __restrict to) {
    for (int x = 0; x < width; ++x) {
        const float shift = sum_of(cross_sums, x) / (sum_of(square_sums, x) + kNoise * kWindow * kWindow);
        to[x] = disparity[x] - clamped(shift, -kFarthest, kFarthest);
    }
}

void bounded(const float* __restrict before, int width, float* __restrict found) {
    for (int x = 0; x < width; ++x) {
        const float least = before[x] < 0.0f ? before[x] : 0.0f;
        const bool whole = (x >= kHalfWindow) & (x < width - kHalfWindow);
        const float kept = found[x] < least ? least : found[x];
        found[x] = whole & finite(before[x]) ? kept : __builtin_nanf("");
    }
}

}  // namespace

extern const RefineKernels refine_kernels;
const RefineKernels refine_kernels = {matched, differences, sums, products, moved, bounded};

}  // namespace bearcub::BEARCUB_LEVEL
