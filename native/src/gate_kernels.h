// What one instruction set offers the gate: functions of rows at half the size.
#pragma once

#include <cstdint>

namespace bearcub {

constexpr int kHalfPatch = 3;  // of the window whose texture is compared: 7 x 7
constexpr int kPatch = 2 * kHalfPatch + 1;
constexpr int kBeside = 16;    // columns beside a row of evidence: whole vectors

// Rows of numbers to be summed over windows: how much texture a pixel has in both images together
// and how much of that differs. Known pixels are counted in the lower bits of the texture.
struct Evidence {
    int32_t *texture, *difference;
};
constexpr int kCountBits = 6;  // a window has 49 pixels, and no more texture than the others hold

// What is asked of the sums.
struct Belief {
    float agreement;  // largest share of the texture that may differ
    float least;      // texture of a known pixel
};

// Disparities are given at full size, of which every other column is used.
struct GateKernels {
    // The means of two by two pixels.
    void (*halved)(const uint8_t* upper, const uint8_t* lower, int width, uint8_t* to);
    // What the right row shows at the match of every left pixel. It can be read one column beyond
    // its end; `scratch` holds a word a column.
    void (*shifted)(const uint8_t* right, const float* disparity, int width, uint32_t* scratch,
                    uint8_t* to);
    // Both images can be read one column beyond either end.
    void (*compared)(const uint8_t* left, const uint8_t* matched, const float* disparity,
                     int width, const Evidence& to);
    // The disparity in steps where the evidence around it suffices, and kNone elsewhere. Evidence
    // can be read, and `scratch` written, kBeside columns beyond either end.
    void (*believed)(const Evidence (&rows)[kPatch], const Belief& belief, const float* disparity,
                     int width, const Evidence& scratch, int16_t* steps);
};

}  // namespace bearcub
