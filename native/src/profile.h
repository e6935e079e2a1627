// The longitudinal profile of the floor: the twin of src/bearcub/ground/profile.py.
#pragma once

#include <vector>

#include "floor.h"

namespace bearcub {

// The numbers of profile.py that shape the answer, under its names.
struct ProfileTuning {
    double knee, near_bin, far_bin;
    int near_bins;
    double iqr, farthest;
    int rows, columns, reach;
    double half_width;
    int least;
    double share, step, correlated, deep;
    int again;
    double highest_step, mixed, smallest, largest, noisiest, rounding;
    double most;  // residuals are no larger [px]
};

// What the floor is known to be before it is followed.
struct JustAhead {
    Plane plane;
    double noise, height, pitch;
    double steepest;  // tangent
};

// One bin in which the floor was looked for.
struct Bin {
    double level, bend, spread, error;
};

struct Followed {
    std::vector<Bin> bins;  // from the robot outwards
    std::vector<int> parts;  // where ground begins again beyond a step up
    double end;  // level to which the floor was followed; 0 where nothing ended it
};

Followed follow_floor(const Disparity&, const Lens&, const JustAhead&, const ProfileTuning&);

}  // namespace bearcub
