// A raw pair in, the rectified one out, by maps from rectified to raw pixels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>

#include "image.h"
#include "pool.h"
#include "rectify_kernels.h"

namespace bearcub {

// Where the pixels of a rectified image lie in the raw one of the same size, as OpenCV's maps of
// fixed point (CV_16SC2 and CV_16UC1) say it: column and row, and how far beyond them.
struct RawPixels {
    const int16_t* whole;
    const uint16_t* shares;
};

class Rectifier {
public:
    Rectifier(int height, int width, const RawPixels (&maps)[2], int threads,
              const RectifyKernels& kernels);
    ~Rectifier();

    // Left and right; what no raw pixel shows is black.
    void rectify(const Image (&raw)[2], uint8_t* const (&rectified)[2]);

    int height() const { return height_; }
    int width() const { return width_; }

private:
    class Side;

    const int height_, width_;
    Pool pool_;
    std::unique_ptr<Side> sides_[2];
    std::mutex one_at_a_time_;
};

}  // namespace bearcub
