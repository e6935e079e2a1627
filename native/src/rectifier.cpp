#include "rectifier.h"

#include <algorithm>

#include "memory.h"

namespace bearcub {

// One of the two cameras: its map, and the words of the raw rows that a rectified row looks at.
class Rectifier::Side {
public:
    Side(int height, int width, const RawPixels& map, const RectifyKernels& kernels)
        : height_(height),
          width_(width),
          kernels_(kernels),
          ready_(height),
          ring_(find_rows(map)),
          from_(static_cast<std::size_t>(height) * width),
          shares_(static_cast<std::size_t>(height) * width),
          words_(static_cast<std::size_t>(ring_) * (width + 1) + 1),
          scratch_(width),
          black_(width) {
        for (std::size_t i = 0; i < static_cast<std::size_t>(height_) * width_; ++i) {
            const int x = map.whole[2 * i] + 1, y = map.whole[2 * i + 1] + 1;
            const int black = ring_ * (width_ + 1);
            from_[i] = seen(x, y) ? y % ring_ * (width_ + 1) + x : black;
            shares_[i] = map.shares[i];
        }
    }

    void rectify(const Image& raw, uint8_t* rectified) {
        int next = 0;
        for (int row = 0; row < height_; ++row) {
            for (; next < ready_[row]; ++next) {
                kernels_.join(row_of(raw, next - 1), row_of(raw, next), width_,
                              words_.data() + static_cast<std::ptrdiff_t>(next % ring_) * (width_ + 1));
            }
            const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(row) * width_;
            kernels_.blend(words_.data(), from_.data() + at, shares_.data() + at, width_,
                           scratch_.data(), rectified + at);
        }
    }

private:
    // A word's column and row count from -1, of which nothing shows but its neighbour.
    bool seen(int x, int y) const { return x >= 0 && x <= width_ && y >= 0 && y <= height_; }

    const uint8_t* row_of(const Image& raw, int i) const {
        return i >= 0 && i < height_ ? raw.row(i) : black_.data();
    }

    // How many rows of words every rectified row wants to be ready; return how many must be kept.
    int find_rows(const RawPixels& map) {
        int most = 1, ready = 0;
        for (int row = 0; row < height_; ++row) {
            int first = ready;
            for (int i = 0; i < width_; ++i) {
                const int16_t* whole = map.whole + 2 * (static_cast<std::ptrdiff_t>(row) * width_ + i);
                if (!seen(whole[0] + 1, whole[1] + 1)) continue;
                first = std::min(first, whole[1] + 1);
                ready = std::max(ready, whole[1] + 2);
            }
            ready_[row] = ready;
            most = std::max(most, ready - first);
        }
        return most;
    }

    const int height_, width_;
    const RectifyKernels& kernels_;
    Buffer<int32_t> ready_;    // [row]
    const int ring_;           // rows of words
    Buffer<int32_t> from_;     // [pixel]: its word
    Buffer<uint16_t> shares_;  // [pixel]
    Buffer<uint32_t> words_;   // [row][column], and one that is black
    Buffer<uint32_t> scratch_;
    Buffer<uint8_t> black_;  // a row
};

Rectifier::Rectifier(int height, int width, const RawPixels (&maps)[2], int threads,
                     const RectifyKernels& kernels)
    : height_(height), width_(width), pool_(std::min(threads, 2)) {
    for (int i = 0; i < 2; ++i) {
        sides_[i] = std::make_unique<Side>(height, width, maps[i], kernels);
    }
}

Rectifier::~Rectifier() = default;

void Rectifier::rectify(const Image (&raw)[2], uint8_t* const (&rectified)[2]) {
    const std::lock_guard lock(one_at_a_time_);
    auto side = [&](int i, int) { sides_[i]->rectify(raw[i], rectified[i]); };
    pool_.run(2, side);
}

}  // namespace bearcub
