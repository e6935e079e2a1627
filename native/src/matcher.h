// A rectified pair in, disparity out: census, semi-global matching, checks, filters.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "image.h"
#include "kernels.h"
#include "memory.h"
#include "pool.h"
#include "speckles.h"

namespace bearcub {

struct Shape {
    int height, width;
    int smallest, disparities;
    int bits;  // of a grey value: 8, or up to 16 in words
};

class Matcher {
public:
    Matcher(const Shape& shape, const Tuning& tuning, int threads, const Kernels& kernels);
    ~Matcher();

    // Fill `disparity` [px], NaN where unmatched, and, unless null, `confidence`, 0 there.
    void match(const Image& left, const Image& right, float* disparity, uint8_t* confidence);

    std::size_t bytes() const;  // of working memory
    const Shape& shape() const { return shape_; }

private:
    struct Worker;

    void match_stripe(int stripe, Worker& worker);
    void filter_stripe(int stripe, Worker& worker);
    void finish_stripe(int stripe);
    void find_median(int row, Worker& worker);
    void connect(int row, Worker& worker);
    uint8_t* confidence(int row) const;  // null where none is wanted
    int first_row(int stripe) const { return stripe * shape_.height / stripes_; }
    int16_t* raw(int row) { return raw_.data() + row * pitch_ + kMargin; }
    int16_t* filtered(int row) { return filtered_.data() + row * pitch_ + kMargin; }

    static constexpr int kMargin = 32;  // columns beside a row of steps

    const Shape shape_;
    const Tuning tuning_;
    const Kernels& kernels_;
    const int stripes_;
    const std::ptrdiff_t pitch_;  // of a row of steps
    Buffer<int16_t> raw_, filtered_;
    Speckles speckles_;
    std::vector<std::unique_ptr<Worker>> workers_;
    Pool pool_;
    std::mutex one_at_a_time_;
    Image left_{}, right_{};
    float* disparity_ = nullptr;
    uint8_t* confidence_ = nullptr;
};

}  // namespace bearcub
