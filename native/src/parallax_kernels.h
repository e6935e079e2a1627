// What one instruction set offers the look for small things.
#pragma once

#include <cstdint>

#include "image.h"

namespace bearcub {

constexpr int kSummed = 32;  // columns that are summed together

// Rows of floor, shrunk: one pixel is `step` columns (1 or 2) and twice as many rows of the images.
struct Strip {
    int step, first, rows, columns;
};

// Rows of a strip whose levels, from `far` to `near`, one window fits.
struct Band {
    float far, near;
    int wide, tall, first, end;
};

// The numbers of parallax.py that shape the answer, under its names.
struct FeetTuning {
    float sure, least_share, most_share, noise;
    int around_columns, around_rows;
};

// A look at one strip. Rows of maps are `pitch` apart, at least so many columns as are summed
// together; so far beyond the image, and a window more, single rows can be written.
struct Look {
    Strip strip;
    Image left_image, right_image;
    float a, b, c, offset;  // the floor's plane, and what is in it, not in the images
    FeetTuning tuning;
    int parts_down, parts_across, pitch;  // neighbourhoods whose brightness and noise are one
    const float* bend;                    // of the floor in the middle of each part of each row
    uint8_t *left, *right;
    float *floor, *energy, *seen, *sure;
    float *ratio, *variance;  // rows of neighbourhoods
    float *rows[4];
    float* parallax;          // of a thing's top, up from its foot [px]
    int* hits;                // pixels of a row where something may stand
};

struct LookKernels {
    // The left image, the floor's disparity, and the right image warped to the left one by it.
    void (*warp)(const Look&);
    // Squares of the gradient, its products with the images' difference, and the variance of that
    // around a pixel. What differs in brightness over a neighbourhood is the cameras'.
    void (*contrast)(const Look&);
    // How surely something as large as a small box stands at every pixel, squared; 0 for not.
    void (*judge)(const Look&, const Band&);
    // That variance at every pixel.
    void (*noise)(const Look&, float* variance);
};

}  // namespace bearcub
