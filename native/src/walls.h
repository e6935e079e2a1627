// The likeliest far wall of a hole: the twin of _likeliest in src/bearcub/obstacles/sunken.py.
#pragma once

namespace bearcub {

// Lines of floor in both images, the far ones first, [line][column]. The right image is a map of its
// own, in which `u` less the floor's disparity and `v` lie.
struct FloorLines {
    const float* right;
    int right_rows, right_columns;
    const float *u, *floor;
    const float *v, *left, *misfit;
    const bool* known;
    int lines, columns;
};

// What misfits say: squares times `scale`, `largest` at most, differences times `weight`, each pixel
// at a `price`.
struct Odds {
    float scale, largest, weight, price;
};

// First and last lines and columns of a wall, and its log-likelihood ratio against the floor.
struct Wall {
    int far = 0, near = 0, left = 0, right = 0;
    float gain = 0;
};

// Tries walls down from each line but the first, `every` so many, that are of `least` lines.
Wall likeliest_wall(const FloorLines&, const Odds&, int every, int least);

}  // namespace bearcub
