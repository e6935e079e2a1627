// Pixels against the floor, and what follows for a whole grid of them: the twins of
// src/bearcub/obstacles/{sorting,segment,free_range}.py.
#pragma once

#include <cstdint>
#include <vector>

#include "cloud.h"
#include "floor.h"

namespace bearcub {

// src/bearcub/ground/surface.py, Surface: the floor by its level.
struct Surface {
    float a, b, c;  // of the level, a u + b v + c
    const float *bend, *tolerance;  // by sixteenths of a pixel of level
    int entries;

    float level(int u, float of_row) const { return (a * static_cast<float>(u) + c) + of_row; }
    float of_row(int v) const { return b * static_cast<float>(v); }
    int entry(float level) const {
        const int scaled = static_cast<int>(level * 16 + 0.5f), last = entries - 1;
        return scaled < 0 ? 0 : scaled > last ? last : scaled;
    }
};

// Every `down`-th row from `top` on, every `right`-th column from `left` on.
struct Part {
    int top, left, down, right, rows, columns;
};

// src/bearcub/obstacles/sorting.py, Sorting.
struct Sorted {
    float *disparity, *floor, *residual, *allowed;
    bool *standing, *on_floor, *below;
};

void sort_pixels(const Disparity&, const Surface&, float farthest_level, const Part&, const Sorted&);

// What of a sorted grid could be a thing; `nearest` and `farthest` are levels.
struct Standing {
    const float *disparity, *floor;
    const bool* standing;
    int rows, columns;
    float nearest, farthest;
};

// Returns how many pixels could, and their largest disparity.
struct Count {
    int pixels;
    float largest;
};
Count count_standing(const Standing&);

// Where pixels fall in the column histogram.
struct Histogram {
    const int32_t* shift;  // columns that an upright line has moved to the right, by row
    const int32_t* level;  // by sixteenths of a pixel of disparity
    int width;
    float tall, overhead;  // share of a pixel's disparity that the floor's is less than
};

// A pixel that stands, by its place in the grid.
struct Cells {
    int64_t* index;
    int32_t *column, *cell;
    bool *tall, *overhead;
};
void to_cells(const Standing&, const Histogram&, const Cells&);

// A grid of pixels and what they are: 0 floor or nothing, above 0 things, below 0 holes.
struct Labelled {
    const float *disparity, *floor;
    const bool* on_floor;
    std::ptrdiff_t down, right;  // steps of these three
    const int32_t* labels;
    const int64_t *u, *v;  // columns and rows of the image
    int rows, columns;
};

// Directions, and what ends the way.
struct Directions {
    double first, step;  // [rad]
    int count;
    const bool* blocks;  // by label: what is in the way
    double nearest, farthest;  // range that is told [m]
    int cells, gap, hits;  // of range; that end the way; pixels that make an end
};

// Ranges [m] by direction: to which floor is seen without a gap, NaN where none is; of the first
// things and holes, infinite where there are none.
struct Ends {
    std::vector<double> seen, thing, hole;
};
Ends find_ends(const Labelled&, const View&, const Directions&);

// src/bearcub/stereo/stage.py, _taken: how many disparities are from 0 on and finite, and how many
// are no numbers.
struct Valid {
    int64_t sound, unmatched;
};
Valid count_valid(const float* disparity, int64_t count);

}  // namespace bearcub
