// What one instruction set offers the matcher: a table of functions, and what they work on.
#pragma once

#include <cstddef>
#include <cstdint>

namespace bearcub {

constexpr int kRows = 4;         // rows that are matched together
constexpr int kTogether = 8;     // columns that go on together; rows have room for whole groups
constexpr int kReach = 2;        // of the census window: 5 x 5
constexpr int kPlanes = 3;       // bytes of a pixel's census, 24 bits
constexpr int kMost = 256;       // disparities
constexpr int kSteps = 64;       // of a pixel of disparity
constexpr int16_t kNone = -0x8000;      // unmatched, in steps: far below any answer,
constexpr int16_t kNoneAbove = 0x7fff;  // or, until the median is taken, far above
constexpr uint8_t kOutside = 255;  // cost of a match outside the right image; no sum is as large

// How many vectors the kernels have instances for: at least as many as the disparities fill.
constexpr int vectors_for(int disparities, int lanes) {
    const int sizes[] = {1, 2, 3, 4, 6, 8, 12};
    for (const int size : sizes) {
        if (size * lanes >= disparities) return size;
    }
    return 16;
}

// The numbers that shape the answer; src/bearcub/stereo/native.py has their defaults.
struct Tuning {
    uint8_t small_step;     // P1: cost of a change by one disparity along a row
    uint8_t small_drop;     // P1 from one row to the next
    uint8_t large_step;     // P2: cost of any larger change, on even grey
    uint8_t least_step;     // P2 on a strong edge
    uint8_t edge_discount;  // how much less P2 is per four grey levels
    int uniqueness;         // margin of the best over the second best match [%]
    int left_right;         // largest disagreement of the right image's match [px]
    float texture;          // least mean absolute gradient around a pixel [grey levels]
    int speckle_area;       // largest connected patch that is taken back [px]
    float speckle_step;     // neighbours that differ by no more are connected [px]
};

// A few rows of the pair, ready to be matched, and what becomes of them. Rows are matched together
// and stand so in memory, [column][row], each pixel with all its disparities side by side in lanes:
// lane = disparity - smallest.
struct Block {
    int width;
    int lanes;  // disparities, rounded up to whole vectors
    int disparities;
    int smallest;
    Tuning tuning;
    const uint32_t* left[kRows][kPlanes];  // census, each byte four times
    const uint8_t* right[kRows][kPlanes];  // census from right to left: lane l of column x at l - x
    const uint8_t* outside;                // the same way: kOutside where there is no right image
    const uint8_t* padding;                // kOutside in lanes that are no disparity
    const uint32_t* across[kRows];         // P2 between a column and the one before, four times
    const uint32_t* down[kRows];           // P2 between a row and the one above
    uint8_t* paths;                        // [column][row][2][lane]: costs, path costs from the left
    uint8_t* vertical;                     // [column][lane]: path costs from above, of the last row
    uint8_t* sums;                         // [kTogether][row][lane], and 64 bytes around it
    // [column][row]: the best lane, its sum, the sums beside it, the least sum elsewhere.
    uint8_t *lane, *best, *before, *after;
    uint32_t* second;      // a byte for each row
    uint16_t* right_best;  // [lanes + right column][row]: sum << 8 | lane
    int16_t* steps;        // [column][row]: the answer,
    uint8_t* confidence;   // and how sure it is
};

// Rows of an image with at least kReach columns more on either side.
template <class Pixel>
using Window = const Pixel* const (&)[2 * kReach + 1];

struct Kernels {
    int lanes;  // bytes of a vector
    void (*census8)(Window<uint8_t> rows, int width, uint8_t* scratch, uint8_t* const* planes);
    void (*census16)(Window<uint16_t> rows, int width, uint16_t* scratch,
                     uint8_t* const* planes);
    void (*penalties)(const Tuning&, const uint8_t* here, const uint8_t* there, int width,
                      uint32_t* four_times);
    void (*four_times)(const uint8_t* from, int width, uint32_t* to);
    void (*reversed)(const uint8_t* from, int width, uint8_t* to);
    void (*warm_up)(const Block&, int rows);
    void (*forward)(const Block&);
    void (*backward)(const Block&);
    void (*decide)(const Block&, bool rated);  // rated: with confidence
    void (*take_row)(const Block&, int row, int16_t* steps, uint8_t* confidence);
    void (*without_texture)(Window<uint8_t> rows, int width, float least, int16_t* steps);
    void (*balance)(int16_t* steps, int width, bool odd);  // odd: the row
    void (*median)(const int16_t* above, const int16_t* row, const int16_t* below, int width,
                   int16_t* to);
    void (*smooth)(Window<int16_t> rows, int width, int16_t* to);
    void (*links_along)(const int16_t* row, int width, int step, uint8_t* scratch, uint64_t* known,
                        uint64_t* before);
    void (*links_up)(const int16_t* row, const int16_t* above, int width, int step,
                     uint8_t* scratch, uint64_t* up);
    void (*to_pixels)(const int16_t* steps, int width, int smallest, float* disparity);
    void (*quell)(const float* disparity, int width, uint8_t* confidence);
};

}  // namespace bearcub
