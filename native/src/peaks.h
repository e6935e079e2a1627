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

// Marks the peaks of some pixels, closed over small gaps; returns how many pixels these are.
int mark_peaks(const Filled&, Which, const uint16_t* number, const float* least_rows, int gap,
               uint8_t* closed);

// Numbers pixels by the peak in their cell or, of the tall ones, within a foot around it.
void number_pixels(const Filled&, Which, const uint16_t* peaks, int foot_levels, int foot_columns,
                   int numbered, uint16_t* number);

}  // namespace bearcub
