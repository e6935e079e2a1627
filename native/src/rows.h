// A few rows of a pair, made ready for the kernels: one thread's working memory.
#pragma once

#include "kernels.h"
#include "matcher.h"
#include "memory.h"

namespace bearcub {

class Rows {
public:
    Rows(const Shape& shape, const Tuning& tuning, const Kernels& kernels);

    // Load kRows rows from `row` on, and describe them by their census and penalties. Below the
    // image its last row goes on.
    void prepare(const Image& left, const Image& right, int row);
    // Paths from above begin anew.
    void forget_above();

    const Block& block() const { return block_; }
    // The grey values around a prepared row, as bytes.
    struct Around {
        const uint8_t* rows[2 * kReach + 1];
    };
    Around around(int row) const;
    std::size_t bytes() const;

private:
    void lay_out();
    void load(const Image& image, int row, Buffer<uint8_t>& grey, Buffer<uint16_t>& words) const;
    void describe(const Buffer<uint8_t>& grey, const Buffer<uint16_t>& words, int row);
    uint8_t* plane(int i) { return planes_.data() + static_cast<std::ptrdiff_t>(i) * pitch_; }
    uint32_t* four_times(int i) {
        return four_times_.data() + static_cast<std::ptrdiff_t>(i) * pitch_;
    }
    uint8_t* mirrored(int i) {
        return mirrored_.data() + static_cast<std::ptrdiff_t>(i) * mirror_pitch_ + mirror_start_;
    }

    static constexpr int kMargin = 64;                  // columns beside a row of grey values
    static constexpr int kLoaded = kRows + 2 * kReach;  // rows of grey values

    const Shape shape_;
    const Tuning tuning_;
    const Kernels& kernels_;
    const int lanes_;
    const std::ptrdiff_t pitch_;         // of grey values
    const std::ptrdiff_t mirror_pitch_;  // of the right census
    const int mirror_start_;             // where its first pixel stands
    const std::ptrdiff_t cells_;         // lanes of a row
    Buffer<uint8_t> left_, right_;       // grey values, as bytes
    Buffer<uint16_t> left_words_, right_words_;  // the same as they came, if that was in words
    Buffer<uint16_t> thresholds_;
    Buffer<uint8_t> planes_, mirrored_, outside_, padding_;
    Buffer<uint32_t> four_times_;
    Buffer<uint8_t> paths_, vertical_, sums_, winners_;
    Buffer<uint32_t> second_;
    Buffer<uint16_t> right_best_;
    Buffer<int16_t> steps_;
    Block block_{};
};

}  // namespace bearcub
