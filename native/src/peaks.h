// Peaks of the column histogram: the twin of _PeakFinder in src/bearcub/obstacles/segment.py.
#pragma once

#include <cstdint>
#include <vector>

namespace bearcub {

// Pixels by their cell of the histogram, level * columns + column.
struct Filled {
    const int32_t* cell;
    const bool *tall, *overhead;
    int count;
    int levels, columns;
};

// Which pixels are looked at: the tall ones that are in the way; what has no number yet and is in
// the way, or is overhead.
enum class Which { tall, standing, hanging };

// The first level, and the one beyond the last.
struct Span {
    int first, end;
};

// Marks the peaks of some pixels, closed over small gaps; returns between which levels they can be, no
// level and nothing marked where the pixels are fewer than `least`.
Span mark_peaks(const Filled&, Which, int least, const uint16_t* number, const float* least_rows,
                int gap, uint8_t* closed);

// Numbers pixels by the peak in their cell or, of the tall ones, within a foot around it.
void number_pixels(const Filled&, Which, const uint16_t* peaks, int foot_levels, int foot_columns,
                   int numbered, uint16_t* number);

// Takes the number off a thing's overhead pixels where the lowest is farther above the others' top
// than a share of their height; `index` is a pixel's place in a grid of so many columns.
void let_go(const bool* overhead, const int64_t* index, int count, int columns, double share,
            uint16_t* number);

// Adds up how many pixels of each thing stand in each column, [number - 1][column].
void count_heights(const uint16_t* number, const int32_t* column, int count, int columns,
                   int32_t* heights);

// Where the columns of a thing change between high and low.
struct Strips {
    std::vector<int> bounds;  // from its first column to the one beyond its last
    bool first_high, last_high;
};
Strips find_strips(const int32_t* heights, int columns, int gap, double share);

}  // namespace bearcub
