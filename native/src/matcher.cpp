#include "matcher.h"

#include <algorithm>

#include "rows.h"

namespace bearcub {
namespace {

// Paths from above forget where they began within a few rows, so that each stripe of rows can
// begin that many rows early instead of waiting for the one above.
constexpr int kWarmUp = 24;
constexpr int kStripeHeight = 80;  // at least
constexpr int kStripes = 4;        // at most

// How many stripes to cut follows from the image alone, and with it the answer: not from the
// number of threads.
int stripes_of(int height) {
    const int stripes = std::clamp(height / kStripeHeight, 1, kStripes);
    return stripes == 3 ? 2 : stripes;  // shared evenly by two and four threads
}

constexpr int kMedians = 2 * kReach + 1;  // rows that are smoothed to one

}  // namespace

struct Matcher::Worker {
    Worker(const Shape& shape, const Tuning& tuning, const Kernels& kernels, int scratch,
           std::ptrdiff_t pitch)
        : rows(shape, tuning, kernels), links(scratch), medians(kMedians * pitch) {}

    Rows rows;
    Buffer<uint8_t> links;
    Buffer<int16_t> medians;  // of the rows around one
};

Matcher::Matcher(const Shape& shape, const Tuning& tuning, int threads, const Kernels& kernels)
    : shape_(shape),
      tuning_(tuning),
      kernels_(kernels),
      stripes_(stripes_of(shape.height)),
      pitch_(rounded_up(shape.width + 2 * kMargin, 32)),
      raw_(shape.height * pitch_),
      filtered_(shape.height * pitch_),
      speckles_(kernels, shape.height, shape.width,
                static_cast<int>(tuning.speckle_step * kSteps), tuning.speckle_area),
      pool_(std::min(threads, stripes_)) {
    for (int i = 0; i < pool_.threads(); ++i) {
        workers_.push_back(
            std::make_unique<Worker>(shape, tuning, kernels, speckles_.scratch(), pitch_));
    }
}

Matcher::~Matcher() = default;

void Matcher::match(const Image& left, const Image& right, float* disparity, uint8_t* confidence) {
    const std::lock_guard lock(one_at_a_time_);
    left_ = left;
    right_ = right;
    disparity_ = disparity;
    confidence_ = confidence;
    auto match = [this](int i, int worker) { match_stripe(i, *workers_[worker]); };
    auto filter = [this](int i, int worker) { filter_stripe(i, *workers_[worker]); };
    auto finish = [this](int i, int) { finish_stripe(i); };
    pool_.run(stripes_, match);
    pool_.run(stripes_, filter);
    for (int i = 1; i < stripes_; ++i) connect(first_row(i), *workers_[0]);
    pool_.run(stripes_, finish);
}

void Matcher::match_stripe(int stripe, Worker& worker) {
    const int first = first_row(stripe), end = first_row(stripe + 1);
    Rows& rows = worker.rows;
    rows.forget_above();
    for (int row = std::max(first - kWarmUp, 0); row < first; row += kRows) {
        rows.prepare(left_, right_, row);
        kernels_.warm_up(rows.block(), std::min(kRows, first - row));
    }
    for (int row = first; row < end; row += kRows) {
        rows.prepare(left_, right_, row);
        kernels_.forward(rows.block());
        kernels_.backward(rows.block());
        kernels_.decide(rows.block(), confidence_ != nullptr);
        for (int i = 0; i < std::min(kRows, end - row); ++i) {
            int16_t* steps = raw(row + i);
            kernels_.take_row(rows.block(), i, steps, confidence(row + i));
            if (tuning_.texture > 0.0f) {
                kernels_.without_texture(rows.around(i).rows, shape_.width, tuning_.texture, steps);
            }
            kernels_.balance(steps, shape_.width, (row + i) % 2 != 0);
            steps[-1] = steps[0];
            steps[shape_.width] = steps[shape_.width - 1];
        }
    }
}

// The row's median of 3 x 3, with its outermost answers repeated beyond the border.
void Matcher::find_median(int row, Worker& worker) {
    const int width = shape_.width;
    int16_t* median = worker.medians.data() + row % kMedians * pitch_ + kMargin;
    kernels_.median(raw(std::max(row - 1, 0)), raw(row), raw(std::min(row + 1, shape_.height - 1)),
                    width, median);
    std::fill_n(median - kReach, kReach, median[0]);
    std::fill_n(median + width, kReach, median[width - 1]);
}

void Matcher::filter_stripe(int stripe, Worker& worker) {
    const int first = first_row(stripe), end = first_row(stripe + 1), last = shape_.height - 1;
    const auto median = [&](int row) {
        return worker.medians.data() + std::clamp(row, 0, last) % kMedians * pitch_ + kMargin;
    };
    int next = std::max(first - kReach, 0);
    for (int row = first; row < end; ++row) {
        for (; next <= std::min(row + kReach, last); ++next) find_median(next, worker);
        kernels_.smooth({median(row - 2), median(row - 1), median(row), median(row + 1),
                         median(row + 2)},
                        shape_.width, filtered(row));
        if (tuning_.speckle_area <= 0) continue;
        speckles_.find_runs(row, filtered(row), worker.links.data());
        if (row > first) connect(row, worker);
    }
}

void Matcher::connect(int row, Worker& worker) {
    if (tuning_.speckle_area <= 0) return;
    speckles_.connect(row, filtered(row), filtered(row - 1), worker.links.data());
}

void Matcher::finish_stripe(int stripe) {
    for (int row = first_row(stripe); row < first_row(stripe + 1); ++row) {
        int16_t* steps = filtered(row);
        if (tuning_.speckle_area > 0) {
            speckles_.each_run(row, [steps](int first, int end, bool small) {
                if (small) std::fill(steps + first, steps + end, kNone);
            });
        }
        float* disparity = disparity_ + static_cast<std::ptrdiff_t>(row) * shape_.width;
        kernels_.to_pixels(steps, shape_.width, shape_.smallest, disparity);
        if (confidence_ != nullptr) kernels_.quell(disparity, shape_.width, confidence(row));
    }
}

uint8_t* Matcher::confidence(int row) const {
    if (confidence_ == nullptr) return nullptr;
    return confidence_ + static_cast<std::ptrdiff_t>(row) * shape_.width;
}

std::size_t Matcher::bytes() const {
    std::size_t sum = raw_.bytes() + filtered_.bytes() + speckles_.bytes();
    for (const auto& worker : workers_) {
        sum += worker->rows.bytes() + worker->links.bytes() + worker->medians.bytes();
    }
    return sum;
}

}  // namespace bearcub
