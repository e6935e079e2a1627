// Which of a matcher's answers to believe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "image.h"
#include "levels.h"
#include "memory.h"
#include "pool.h"
#include "speckles.h"

namespace bearcub {

class Gate {
public:
    // At least two rows and two columns. Patches of up to `speckle_area` pixels at half the size
    // are not believed.
    Gate(int height, int width, const Belief& belief, int speckle_area, int threads,
         const Level& level);
    ~Gate();

    // `gated` becomes `disparity`, NaN where that is not to be believed. Maps without gaps between
    // their rows; `left` and `right` of bytes.
    void gate(const Image& left, const Image& right, const float* disparity, float* gated);

    int height() const { return height_; }
    int width() const { return width_; }

private:
    struct Worker;

    void believe_stripe(int stripe, Worker& worker);
    void compare(int row, Worker& worker) const;
    void connect(int row, Worker& worker);
    void copy_stripe(int stripe) const;
    int first_row(int stripe) const { return stripe * half_height_ / stripes_; }
    int16_t* steps(int row) {
        return steps_.data() + static_cast<std::ptrdiff_t>(row) * half_width_;
    }

    const int height_, width_, half_height_, half_width_, stripes_;
    const Belief belief_;
    const GateKernels& kernels_;
    Buffer<int16_t> steps_;  // at half the size
    Speckles speckles_;
    std::vector<std::unique_ptr<Worker>> workers_;
    Pool pool_;
    std::mutex one_at_a_time_;
    Image left_{}, right_{};
    const float* disparity_ = nullptr;
    float* gated_ = nullptr;
};

}  // namespace bearcub
