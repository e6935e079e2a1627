#include "gate.h"

#include <algorithm>
#include <limits>

namespace bearcub {
namespace {

constexpr int kStripeHeight = 32;  // at least
constexpr int kRing = 8;           // rows of evidence that are kept: the window's, and one more
constexpr int kStep = 8;           // neighbours that differ by more, a pixel, are not connected

}  // namespace

struct Gate::Worker {
    Worker(int width, int links)
        : pitch(rounded_up(width + 2 * kBeside, 64)),
          bytes_of_rows(3 * pitch),
          words(2 * (kRing + 1) * pitch),
          scratch(pitch),
          links(links) {}

    uint8_t* bytes(int i) { return bytes_of_rows.data() + i * pitch + kBeside; }
    Evidence evidence(int i) {
        int32_t* first = words.data() + 2 * i * pitch + kBeside;
        return {first, first + pitch};
    }

    std::ptrdiff_t pitch;
    Buffer<uint8_t> bytes_of_rows;
    Buffer<int32_t> words;
    Buffer<uint32_t> scratch;
    Buffer<uint8_t> links;
};

Gate::Gate(int height, int width, const Belief& belief, int speckle_area, int threads,
           const Level& level)
    : height_(height),
      width_(width),
      half_height_(height / 2),
      half_width_(width / 2),
      stripes_(std::clamp(half_height_ / kStripeHeight, 1, threads)),
      belief_(belief),
      kernels_(*level.gate),
      steps_(static_cast<std::size_t>(half_height_) * half_width_),
      speckles_(*level.match, half_height_, half_width_, kStep, speckle_area),
      pool_(stripes_) {
    for (int i = 0; i < stripes_; ++i) {
        workers_.push_back(std::make_unique<Worker>(half_width_, speckles_.scratch()));
    }
}

Gate::~Gate() = default;

void Gate::gate(const Image& left, const Image& right, const float* disparity, float* gated) {
    const std::lock_guard lock(one_at_a_time_);
    left_ = left;
    right_ = right;
    disparity_ = disparity;
    gated_ = gated;
    auto believe = [this](int i, int worker) { believe_stripe(i, *workers_[worker]); };
    auto copy = [this](int i, int) { copy_stripe(i); };
    pool_.run(stripes_, believe);
    for (int i = 1; i < stripes_; ++i) connect(first_row(i), *workers_[0]);
    pool_.run(stripes_, copy);
}

// The evidence runs ahead of the sums over it.
void Gate::believe_stripe(int stripe, Worker& worker) {
    const int first = first_row(stripe), end = first_row(stripe + 1);
    for (int row = first - 2 * kHalfPatch; row < end; ++row) {
        const int ahead = row + kHalfPatch;
        if (ahead >= 0 && ahead < half_height_) compare(ahead, worker);
        if (row < first) continue;
        Evidence rows[kPatch];
        for (int i = 0; i < kPatch; ++i) {
            rows[i] = worker.evidence(reflected(row - kHalfPatch + i, half_height_) % kRing);
        }
        const float* disparity = disparity_ + static_cast<std::ptrdiff_t>(2 * row) * width_;
        kernels_.believed(rows, belief_, disparity, half_width_, worker.evidence(kRing),
                          steps(row));
        speckles_.find_runs(row, steps(row), worker.links.data());
        if (row > first) connect(row, worker);
    }
}

void Gate::compare(int row, Worker& worker) const {
    uint8_t *left = worker.bytes(0), *right = worker.bytes(1), *matched = worker.bytes(2);
    kernels_.halved(left_.row(2 * row), left_.row(2 * row + 1), half_width_, left);
    kernels_.halved(right_.row(2 * row), right_.row(2 * row + 1), half_width_, right);
    const float* disparity = disparity_ + static_cast<std::ptrdiff_t>(2 * row) * width_;
    kernels_.shifted(right, disparity, half_width_, worker.scratch.data(), matched);
    reflect(left, half_width_, 1);
    reflect(matched, half_width_, 1);
    const Evidence evidence = worker.evidence(row % kRing);
    kernels_.compared(left, matched, disparity, half_width_, evidence);
    reflect(evidence.texture, half_width_, kHalfPatch);
    reflect(evidence.difference, half_width_, kHalfPatch);
}

void Gate::connect(int row, Worker& worker) {
    speckles_.connect(row, steps(row), steps(row - 1), worker.links.data());
}

// An odd last row or column does as its neighbour.
void Gate::copy_stripe(int stripe) const {
    for (int half = first_row(stripe); half < first_row(stripe + 1); ++half) {
        const int end_row = half + 1 < half_height_ ? 2 * half + 2 : height_;
        for (int row = 2 * half; row < end_row; ++row) {
            const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(row) * width_;
            std::fill_n(gated_ + at, width_, std::numeric_limits<float>::quiet_NaN());
            speckles_.each_run(half, [&](int first, int end, bool small) {
                const int last = end < half_width_ ? 2 * end : width_;
                if (small) return;
                std::copy(disparity_ + at + 2 * first, disparity_ + at + last,
                          gated_ + at + 2 * first);
            });
        }
    }
}

}  // namespace bearcub
