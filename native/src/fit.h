// The robust fit of the floor's plane: the twin of src/bearcub/ground/fit.py.
#pragma once

#include <optional>
#include <vector>

#include "floor.h"

namespace bearcub {

// The numbers of fit.py that shape the answer, under its names.
struct FitTuning {
    std::vector<double> draws;  // from 0 to 1, three for each triple: all first ones, all second ones, ...
    std::vector<double> steps;  // of roll and pitch about the expected ones [rad]
    int scored, finalists, refined;
    double anneal;
    int least_steps, most_steps;
    double settled;
    int few;
    double least_noise, most_noise;
    double remote, below, near, whole, half_width, close, biweight;
};

// The prior, and how far from it a floor may lie.
struct Expected {
    double height, pitch, roll;
    double sigma_height, sigma_pitch, sigma_roll;
    double gate_height, gate_pitch, gate_roll;
};

// A fitted plane and what its uncertainty follows from.
struct Fit {
    Plane plane;
    double noise;
    double normal[3][3];
    int here, on, above;  // pixels just ahead, on the plane, above it
    int stride;
};

std::optional<Fit> fit_plane(const Disparity&, const Lens&, const Expected&, double unevenness,
                             const FitTuning&);

}  // namespace bearcub
