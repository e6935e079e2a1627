// Disparity sharpened to a fraction of a pixel by image registration.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "image.h"
#include "memory.h"
#include "pool.h"
#include "refine_kernels.h"

namespace bearcub {

class Refiner {
public:
    Refiner(int height, int width, int threads, const RefineKernels& kernels);
    ~Refiner();

    // All maps without gaps between their rows; `left` and `right` of bytes.
    void refine(const Image& left, const Image& right, const float* disparity, float* refined);

    int height() const { return height_; }
    int width() const { return width_; }

private:
    struct Rings;

    int first_row(int stripe) const { return stripe * height_ / stripes_; }
    void refine_stripe(int stripe, const float* from, float* to, const float* before,
                       Rings& rings) const;
    void load(int row, const float* from, Rings& rings) const;
    void differ(int row, const float* from, Rings& rings) const;
    void multiply(int row, Rings& rings) const;
    void move(int row, const float* from, float* to, Rings& rings) const;

    const int height_, width_, stripes_;
    const RefineKernels& kernels_;
    Buffer<float> between_;  // the disparity after the first step
    Pool pool_;
    std::vector<std::unique_ptr<Rings>> rings_;
    std::mutex one_at_a_time_;
    Image left_{}, right_{};
};

}  // namespace bearcub
