// The inner loops of rectification: plain ones, which the compiler turns into vectors. This file
// is compiled once per instruction set, like kernels.cpp.
#include "rectify_kernels.h"

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

}  // namespace

extern const RectifyKernels rectify_kernels;
const RectifyKernels rectify_kernels = {join, blend};

}  // namespace bearcub::BEARCUB_LEVEL
