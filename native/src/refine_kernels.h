// What one instruction set offers the refinement: functions of rows of floats.
#pragma once

#include <cstdint>

namespace bearcub {

constexpr int kHalfWindow = 4;  // of the window that is registered: 9 x 9
constexpr int kWindow = 2 * kHalfWindow + 1;

template <class T>
using NineRows = const T* const (&)[kWindow];

// Rows can be read and written kHalfWindow columns beyond either end where that is said.
struct RefineKernels {
    // What the right row shows at the match of every left pixel; `scratch` holds a word a column.
    void (*matched)(const uint8_t* right, const float* disparity, int width, uint32_t* scratch,
                    float* grey);
    // Left less matched, and the mean of both slopes along the row, 0 where nothing is known.
    // Matched rows reach one column beyond either end.
    void (*differences)(const uint8_t* const (&left)[3], const float* const (&matched)[3],
                        const float* disparity, int width, float* slope, float* difference);
    // Sums of nine columns; `row` reaches beyond the ends, `scratch` is as long.
    void (*sums)(const float* row, int width, float* scratch, float* to);
    // What a shift of the window explains: slope times difference, the window's mean taken off, and
    // slope squared.
    void (*products)(NineRows<float> difference_sums, const float* difference, const float* slope,
                     int width, float* cross, float* square);
    // The disparity, moved by the shift that explains most of the difference.
    void (*moved)(NineRows<float> cross_sums, NineRows<float> square_sums, const float* disparity,
                  int width, float* to);
    // Never below 0 where it was not, and none where the window leaves the image.
    void (*bounded)(const float* before, int width, float* found);
};

}  // namespace bearcub
