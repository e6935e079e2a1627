// The points of one thing: the twin of src/bearcub/obstacles/cloud.py.
#pragma once

#include <cstdint>
#include <vector>

#include "floor.h"

namespace bearcub {

// src/bearcub/obstacles/measure.py, View.
struct View {
    Lens lens;
    double rotation[3][3], origin[3];
};

// Ranges in directions of equal width: how many there are, those of two ranks; NaN where none is.
struct Direction {
    int count;
    double near, middle;
};

class Cloud {
public:
    // Of pixels (u, v) with these disparities.
    Cloud(const View&, const double* u, const double* v, const float* disparity, int count);

    struct Ends {
        double low, high;
    };
    // Where the histogram of bearings, or of heights, with bins of `step` rises and falls.
    Ends sides(double step, double share) const { return ends(bearing_, step, share); }
    Ends heights(double step, double share) const { return ends(height_, step, share); }

    std::vector<Direction> directions(double right, double left, int count, int near) const;

    double range(double share) const;  // a quantile
    double height_before(double range, double share) const;  // a quantile; NaN where none is nearer
    double squares() const;  // of the ranges, summed

    // Sums about the means: of squares of range, of its products with height, of squares of height.
    struct Spread {
        double range, together, height;
    };
    Spread spread() const;

private:
    Ends ends(const std::vector<double>& values, double step, double share) const;

    std::vector<double> bearing_, range_, height_;
};

}  // namespace bearcub
