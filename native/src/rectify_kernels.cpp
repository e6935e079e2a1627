// The inner loops of rectification: plain ones, which the compiler turns into vectors. This file
// is compiled once per instruction set, like kernels.cpp.
#include "rectify_kernels.h"

#include <algorithm>
#include <cmath>

#include "simd.h"

namespace bearcub::BEARCUB_LEVEL {
namespace {

BEARCUB_INLINE uint32_t word(uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    return a | b << 8 | c << 16 | d << 24;
}

void join(const uint8_t* __restrict above, const uint8_t* __restrict below, int width,
          uint32_t* __restrict words) {
    words[0] = word(0, above[0], 0, below[0]);
    for (int x = 0; x < width - 1; ++x) {
        words[x + 1] = word(above[x], above[x + 1], below[x], below[x + 1]);
    }
    words[width] = word(above[width - 1], 0, below[width - 1], 0);
}

void blend(const uint32_t* __restrict words, const int32_t* __restrict from,
           const uint16_t* __restrict shares, int width, uint32_t* __restrict scratch,
           uint8_t* __restrict to) {
    constexpr uint32_t whole = 1 << kShareBits, half = 1 << (2 * kShareBits - 1);
    for (int x = 0; x < width; ++x) scratch[x] = words[from[x]];
    for (int x = 0; x < width; ++x) {
        const uint32_t right = shares[x] & (whole - 1), lower = shares[x] >> kShareBits;
        // Both rows at once: no sum outgrows its 16 bits.
        const uint32_t first = scratch[x] & 0x00ff00ff, second = scratch[x] >> 8 & 0x00ff00ff;
        const uint32_t rows = first * (whole - right) + second * right;
        const uint32_t sum = (rows & 0xffff) * (whole - lower) + (rows >> 16) * lower;
        to[x] = static_cast<uint8_t>((sum + half) >> (2 * kShareBits));
    }
}

// One row between four, at the fractions t0 + step x; Keys' weights with OpenCV's slope.
void between(const uint8_t* const (&rows)[4], float t0, float step, int width,
             uint8_t* __restrict to) {
    constexpr float a = -0.75f;
    const uint8_t* const __restrict r0 = rows[0];
    const uint8_t* const __restrict r1 = rows[1];
    const uint8_t* const __restrict r2 = rows[2];
    const uint8_t* const __restrict r3 = rows[3];
    for (int x = 0; x < width; ++x) {
        const float t = t0 + step * static_cast<float>(x), s = 1 - t;
        const float w0 = a * t * s * s, w3 = a * s * t * t;
        const float w1 = ((a + 2) * t - (a + 3)) * t * t + 1, w2 = 1 - w0 - w1 - w3;
        const float sum = w0 * r0[x] + w1 * r1[x] + w2 * r2[x] + w3 * r3[x] + 0.5f;
        to[x] = static_cast<uint8_t>(std::min(std::max(sum, 0.0f), 255.0f));
    }
}

void slide(const Image& image, int height, int width, float first, float along, float down,
           float twist, uint8_t* to) {
    for (int y = 0; y < height; ++y, to += width) {
        const float off = first + down * static_cast<float>(y);
        const float across = along + twist * static_cast<float>(y);
        for (int x = 0; x < width;) {
            // as far as it lies between the same rows
            const int base = static_cast<int>(std::floor(off + across * static_cast<float>(x)));
            int end = x + 1;
            if (across == 0) {
                end = width;
            } else {
                const float edge = (static_cast<float>(across > 0 ? base + 1 : base) - off) / across;
                end = std::min(width, std::max(end, static_cast<int>(std::min(edge, 1e6f))));
            }
            const uint8_t* rows[4];
            for (int k = 0; k < 4; ++k) {
                rows[k] = image.row(std::min(std::max(y + base - 1 + k, 0), height - 1)) + x;
            }
            const float t0 = off + across * static_cast<float>(x) - static_cast<float>(base);
            between(rows, t0, across, end - x, to + x);
            x = end;
        }
    }
}

}  // namespace

extern const RectifyKernels rectify_kernels;
const RectifyKernels rectify_kernels = {join, blend, slide};

}  // namespace bearcub::BEARCUB_LEVEL
