// All pixels of one thing, without a matcher's fringe: the twin of Segments._all_of in
// src/bearcub/obstacles/segment.py and of Witness.trimmed in verify.py.
#pragma once

#include <cstdint>
#include <vector>

#include "grid.h"
#include "image.h"

namespace bearcub {

// A thing on the grid of every `step`-th pixel.
struct Labels {
    const uint16_t* data;
    int columns, step;
    int number;
};

// Pixels of that grid, ascending, which tell where all of it is; the disparities that are looked at,
// and how many times the sampled ones the others may be.
struct Sampled {
    const int64_t* index;
    int count;
    double nearest, farthest, within;
};

// The pair it was matched from, grey; `offset` is in the disparities, not in the images.
struct Pair {
    Image left, right;
    int columns;
    float offset;
};

// The numbers of verify.py that shape the answer, under its names.
struct TrimTuning {
    int narrow_columns, narrow_rows;
    float fringe;
    int widest_fringe, edge;
    float grows;
};

struct Pixels {
    std::vector<int64_t> u, v;
};

// `pair` may be none: nothing is trimmed then.
Pixels all_pixels(const Labels&, const Sampled&, const Disparity&, const Surface&, const Pair* pair,
                  const TrimTuning&);

// A place that is looked at beside a pixel.
struct Beside {
    int right, down;
};

// src/bearcub/obstacles/surroundings.py, _nearer_thing: which of a thing's pixels have one of another
// thing that is nearer at one of these places.
void find_nearer(const Labels&, const Disparity&, const int64_t* u, const int64_t* v, int count,
                 const std::vector<Beside>&, bool* found);

}  // namespace bearcub
