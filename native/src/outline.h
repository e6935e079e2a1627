// All pixels of one thing, without a matcher's fringe: the twin of Segments._all_of in
// src/bearcub/obstacles/segment.py and of Witness.trimmed in verify.py.
#pragma once

#include <cstdint>
#include <vector>

#include "grid.h"
#include "image.h"

namespace bearcub {

// A thing on the grid of every `step`-th pixel, and the window of that grid that holds it.
struct Labels {
    const uint16_t* data;
    int columns, step;
    int number;
    int top, left, bottom, right;
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
Pixels all_pixels(const Labels&, const Disparity&, const Surface&, float nearest, float farthest,
                  const Pair* pair, const TrimTuning&);

}  // namespace bearcub
