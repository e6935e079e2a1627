// The face that a thing turns to the camera: the twin of src/bearcub/obstacles/face.py.
#pragma once

#include "cloud.h"

namespace bearcub {

// The numbers of face.py that shape the answer, under its names.
struct FaceTuning {
    int near;
    double leans, sharpest, rounds, no_noise, roundest;
    int straight;
    double on_line, most;
};

struct Face {
    double range_right, range_left, width, distance, nearest, count;
};

// Between two bearings; `pixel` is an angle, `blur` the 1-sigma of 1 / range that noise makes, and
// `alike` how many neighbouring pixels err together.
Face face_of(const Cloud&, double right, double left, double pixel, double blur, double alike,
             const FaceTuning&);

}  // namespace bearcub
