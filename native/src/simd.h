// Vectors of bytes: the compiler's vector extension, and intrinsics for what that lacks.
//
// This is the only file with intrinsics. The kernels are compiled once per level (see
// CMakeLists.txt), and the level follows from the compiler's flags. Every operation means the same
// on every level, and only the number of lanes differs, so that results are equal to the bit.
#pragma once

#include <cstddef>
#include <cstdint>

#if defined(__AVX512BITALG__) && defined(__AVX512VBMI__) && defined(__AVX512BW__)
#define BEARCUB_LEVEL avx512
#include <immintrin.h>
#elif defined(__AVX2__)
#define BEARCUB_LEVEL avx2
#include <immintrin.h>
#elif defined(__SSE4_1__)
#define BEARCUB_LEVEL sse41
#include <smmintrin.h>
#elif defined(__aarch64__)
#define BEARCUB_LEVEL neon
#include <arm_neon.h>
#else
#error "no instruction set that simd.h knows"
#endif

#define BEARCUB_INLINE inline __attribute__((always_inline))

namespace bearcub::BEARCUB_LEVEL {

// ---- Scalars, which the compiler turns into vectors

template <class T>
BEARCUB_INLINE T larger(T a, T b) {
    return a > b ? a : b;
}

template <class T>
BEARCUB_INLINE T smaller(T a, T b) {
    return a < b ? a : b;
}

template <class T>
BEARCUB_INLINE T clamped(T x, T low, T high) {
    x = x < low ? low : x;
    return x > high ? high : x;
}

// Neither infinite nor no number.
BEARCUB_INLINE bool finite(float x) { return x - x == 0.0f; }

// ---- Vectors

#if defined(__AVX512VBMI__)
using Register = __m512i;
#elif defined(__AVX2__)
using Register = __m256i;
#elif defined(__SSE4_1__)
using Register = __m128i;
#else
using Register = uint8x16_t;
#endif

struct Bytes {
    static constexpr int lanes = sizeof(Register);
    Register v;
};

// The compiler's own vectors, whose operators work lane by lane.
typedef uint8_t Lanes __attribute__((vector_size(Bytes::lanes)));
typedef uint32_t Words __attribute__((vector_size(Bytes::lanes)));
typedef Register Unaligned __attribute__((aligned(1), may_alias));
BEARCUB_INLINE Lanes lanes(Bytes a) { return (Lanes)a.v; }
BEARCUB_INLINE Bytes bytes(Lanes a) { return {(Register)a}; }

BEARCUB_INLINE Bytes load(const uint8_t* p) { return {*reinterpret_cast<const Register*>(p)}; }
BEARCUB_INLINE void store(uint8_t* p, Bytes a) { *reinterpret_cast<Register*>(p) = a.v; }
BEARCUB_INLINE Bytes load_unaligned(const uint8_t* p) {
    return {*reinterpret_cast<const Unaligned*>(p)};
}
BEARCUB_INLINE Bytes splat(uint8_t x) { return bytes(Lanes{} + x); }
BEARCUB_INLINE Bytes splat4(uint32_t x) { return bytes((Lanes)(Words{} + x)); }
BEARCUB_INLINE uint32_t first(Bytes a) { return ((Words)a.v)[0]; }
BEARCUB_INLINE Bytes differing(Bytes a, Bytes b) { return bytes(lanes(a) ^ lanes(b)); }
BEARCUB_INLINE Bytes subtract(Bytes a, Bytes b) { return bytes(lanes(a) - lanes(b)); }
BEARCUB_INLINE Lanes lower(Lanes a, Lanes b) { return a < b ? a : b; }
BEARCUB_INLINE Lanes higher(Lanes a, Lanes b) { return a > b ? a : b; }
BEARCUB_INLINE Bytes min(Bytes a, Bytes b) { return bytes(lower(lanes(a), lanes(b))); }
BEARCUB_INLINE Bytes max(Bytes a, Bytes b) { return bytes(higher(lanes(a), lanes(b))); }

// What that lacks, once per instruction set:
//   add           sums that end at 255
//   popcount      bits of each byte
//   equal_bits    a bit for every byte that is the same
//   from_before   each lane's neighbour before it, the first one's from the vector before
//   from_after    each lane's neighbour after it, the last one's from the vector after
//   min_across    the least byte, in all lanes
//   min_across4   the same of four vectors
//   min_each4     the same, packed into a word

#if defined(__AVX512VBMI__)

BEARCUB_INLINE Bytes add(Bytes a, Bytes b) { return {_mm512_adds_epu8(a.v, b.v)}; }
BEARCUB_INLINE Bytes popcount(Bytes a) { return {_mm512_popcnt_epi8(a.v)}; }
BEARCUB_INLINE uint64_t equal_bits(Bytes a, Bytes b) { return _mm512_cmpeq_epi8_mask(a.v, b.v); }

BEARCUB_INLINE Bytes from_before(Bytes before, Bytes a) {
    return {_mm512_alignr_epi8(a.v, _mm512_alignr_epi64(a.v, before.v, 6), 15)};
}
BEARCUB_INLINE Bytes from_after(Bytes a, Bytes after) {
    return {_mm512_alignr_epi8(_mm512_alignr_epi64(after.v, a.v, 2), a.v, 1)};
}

BEARCUB_INLINE Bytes min_across(Bytes a) {
    const __m256i half =
        _mm256_min_epu8(_mm512_castsi512_si256(a.v), _mm512_extracti64x4_epi64(a.v, 1));
    __m128i x = _mm_min_epu8(_mm256_castsi256_si128(half), _mm256_extracti128_si256(half, 1));
    x = _mm_minpos_epu16(_mm_min_epu8(x, _mm_srli_epi16(x, 8)));
    return {_mm512_broadcastb_epi8(x)};
}

// Four at once, a quarter of the vector for each: halves, quarters and words of different vectors
// share one instruction.
BEARCUB_INLINE __m512i quarters(const Bytes* a) {
    const auto pairs = [](__m512i x, __m512i y) {
        return _mm512_min_epu8(_mm512_shuffle_i64x2(x, y, 0x44), _mm512_shuffle_i64x2(x, y, 0xEE));
    };
    const __m512i low = pairs(a[0].v, a[1].v), high = pairs(a[2].v, a[3].v);
    __m512i x = _mm512_min_epu8(_mm512_shuffle_i64x2(low, high, 0x88),
                                _mm512_shuffle_i64x2(low, high, 0xDD));
    x = _mm512_min_epu8(x, _mm512_shuffle_epi32(x, _MM_PERM_BADC));
    x = _mm512_min_epu8(x, _mm512_shuffle_epi32(x, _MM_PERM_CDAB));
    x = _mm512_min_epu8(x, _mm512_rol_epi32(x, 16));
    const __m512i swap = _mm512_set4_epi32(0x0e0f0c0d, 0x0a0b0809, 0x06070405, 0x02030001);
    return _mm512_min_epu8(x, _mm512_shuffle_epi8(x, swap));
}
BEARCUB_INLINE void min_across4(const Bytes* a, Bytes* smallest) {
    const __m512i x = quarters(a);
    smallest[0].v = _mm512_shuffle_i64x2(x, x, 0x00);
    smallest[1].v = _mm512_shuffle_i64x2(x, x, 0x55);
    smallest[2].v = _mm512_shuffle_i64x2(x, x, 0xAA);
    smallest[3].v = _mm512_shuffle_i64x2(x, x, 0xFF);
}
BEARCUB_INLINE uint32_t min_each4(const Bytes* a) {
    const __m512i each = _mm512_set1_epi32(0x30201000);
    return first({_mm512_permutexvar_epi8(each, quarters(a))});
}

#elif defined(__AVX2__)

BEARCUB_INLINE Bytes add(Bytes a, Bytes b) { return {_mm256_adds_epu8(a.v, b.v)}; }
BEARCUB_INLINE uint64_t equal_bits(Bytes a, Bytes b) {
    return static_cast<uint32_t>(_mm256_movemask_epi8(_mm256_cmpeq_epi8(a.v, b.v)));
}

// Muła: a table look-up per half byte.
BEARCUB_INLINE Bytes popcount(Bytes a) {
    const __m256i low = _mm256_set1_epi8(15);
    const __m256i bits = _mm256_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4, 0, 1, 1,
                                          2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4);
    const __m256i high = _mm256_and_si256(_mm256_srli_epi16(a.v, 4), low);
    return {_mm256_add_epi8(_mm256_shuffle_epi8(bits, _mm256_and_si256(a.v, low)),
                            _mm256_shuffle_epi8(bits, high))};
}

BEARCUB_INLINE Bytes from_before(Bytes before, Bytes a) {
    return {_mm256_alignr_epi8(a.v, _mm256_permute2x128_si256(before.v, a.v, 0x21), 15)};
}
BEARCUB_INLINE Bytes from_after(Bytes a, Bytes after) {
    return {_mm256_alignr_epi8(_mm256_permute2x128_si256(a.v, after.v, 0x21), a.v, 1)};
}

BEARCUB_INLINE Bytes min_across(Bytes a) {
    __m128i x = _mm_min_epu8(_mm256_castsi256_si128(a.v), _mm256_extracti128_si256(a.v, 1));
    x = _mm_minpos_epu16(_mm_min_epu8(x, _mm_srli_epi16(x, 8)));
    return {_mm256_broadcastb_epi8(x)};
}

#elif defined(__SSE4_1__)

BEARCUB_INLINE Bytes add(Bytes a, Bytes b) { return {_mm_adds_epu8(a.v, b.v)}; }
BEARCUB_INLINE uint64_t equal_bits(Bytes a, Bytes b) {
    return static_cast<uint32_t>(_mm_movemask_epi8(_mm_cmpeq_epi8(a.v, b.v)));
}

// Muła: a table look-up per half byte.
BEARCUB_INLINE Bytes popcount(Bytes a) {
    const __m128i low = _mm_set1_epi8(15);
    const __m128i bits = _mm_setr_epi8(0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4);
    const __m128i high = _mm_and_si128(_mm_srli_epi16(a.v, 4), low);
    return {_mm_add_epi8(_mm_shuffle_epi8(bits, _mm_and_si128(a.v, low)),
                         _mm_shuffle_epi8(bits, high))};
}

BEARCUB_INLINE Bytes from_before(Bytes before, Bytes a) {
    return {_mm_alignr_epi8(a.v, before.v, 15)};
}
BEARCUB_INLINE Bytes from_after(Bytes a, Bytes after) { return {_mm_alignr_epi8(after.v, a.v, 1)}; }

BEARCUB_INLINE Bytes min_across(Bytes a) {
    const __m128i x = _mm_minpos_epu16(_mm_min_epu8(a.v, _mm_srli_epi16(a.v, 8)));
    return {_mm_shuffle_epi8(x, _mm_setzero_si128())};
}

#else  // NEON

BEARCUB_INLINE Bytes add(Bytes a, Bytes b) { return {vqaddq_u8(a.v, b.v)}; }
BEARCUB_INLINE Bytes popcount(Bytes a) { return {vcntq_u8(a.v)}; }
BEARCUB_INLINE uint64_t equal_bits(Bytes a, Bytes b) {
    const uint8x16_t weights = {1, 2, 4, 8, 16, 32, 64, 128, 1, 2, 4, 8, 16, 32, 64, 128};
    const uint8x16_t bits = vandq_u8(vceqq_u8(a.v, b.v), weights);
    return vaddv_u8(vget_low_u8(bits)) | static_cast<uint64_t>(vaddv_u8(vget_high_u8(bits))) << 8;
}
BEARCUB_INLINE Bytes from_before(Bytes before, Bytes a) { return {vextq_u8(before.v, a.v, 15)}; }
BEARCUB_INLINE Bytes from_after(Bytes a, Bytes after) { return {vextq_u8(a.v, after.v, 1)}; }
BEARCUB_INLINE Bytes min_across(Bytes a) { return {vdupq_n_u8(vminvq_u8(a.v))}; }

#endif

#if !defined(__AVX512VBMI__)
BEARCUB_INLINE void min_across4(const Bytes* a, Bytes* smallest) {
    for (int i = 0; i < 4; ++i) smallest[i] = min_across(a[i]);
}
BEARCUB_INLINE uint32_t min_each4(const Bytes* a) {
    uint32_t each = 0;
    for (int i = 0; i < 4; ++i) each |= (first(min_across(a[i])) & 255) << 8 * i;
    return each;
}
#endif

// The smaller of each lane's two neighbours, in N vectors that go on in each other.
template <int N>
BEARCUB_INLINE void lower_neighbour(const Bytes* a, Bytes* lower) {
#if defined(__AVX512VBMI__)
    if constexpr (N == 1) {  // at the ends a lane is its own neighbour: one permutation each
        alignas(64) static constexpr auto index = [] {
            struct { int8_t up[64], down[64]; } to{};
            for (int8_t i = 0; i < 64; ++i) {
                to.up[i] = i > 0 ? static_cast<int8_t>(i - 1) : int8_t{0};
                to.down[i] = i < 63 ? static_cast<int8_t>(i + 1) : int8_t{63};
            }
            return to;
        }();
        const __m512i up = _mm512_load_si512(index.up), down = _mm512_load_si512(index.down);
        lower[0] = min({_mm512_permutexvar_epi8(up, a[0].v)},
                       {_mm512_permutexvar_epi8(down, a[0].v)});
        return;
    }
#endif
    const Bytes none = splat(255);
    for (int i = 0; i < N; ++i) {
        lower[i] = min(from_before(i > 0 ? a[i - 1] : none, a[i]),
                       from_after(a[i], i < N - 1 ? a[i + 1] : none));
    }
}

}  // namespace bearcub::BEARCUB_LEVEL
