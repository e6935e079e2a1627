// What one instruction set offers rectification: functions of rows.
#pragma once

#include <cstdint>

#include "image.h"

namespace bearcub {

constexpr int kShareBits = 5;  // of a pixel's fraction: OpenCV's maps hold thirty-seconds

struct RectifyKernels {
    // Two rows, the pixel at either end taken as black, to words of four neighbours each: those at
    // (x, y) and (x + 1, y), then those below, for x from -1 to width - 1.
    void (*join)(const uint8_t* above, const uint8_t* below, int width, uint32_t* words);
    // Bilinear: the word at `from` of every pixel, weighed by its shares of a column, the lower
    // bits, and of a row. `scratch` holds a word a column.
    void (*blend)(const uint32_t* words, const int32_t* from, const uint16_t* shares, int width,
                  uint32_t* scratch, uint8_t* to);
    // An image looked at `first` + `across` x + `down` y + `twist` x y rows lower: by cubic
    // convolution between four rows; beyond the border is the border.
    void (*slide)(const Image& image, int height, int width, float first, float across, float down,
                  float twist, uint8_t* to);
};

}  // namespace bearcub
