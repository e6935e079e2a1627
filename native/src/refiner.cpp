#include "refiner.h"

#include <algorithm>
#include <cstring>

namespace bearcub {
namespace {

constexpr int kStripeHeight = 32;  // at least
constexpr int kMargin = 16;        // columns beside a row
constexpr int kRing = 16;          // rows that are kept: the window's nine and a few more

// How far ahead of the answer a row is needed: for its sums, their sums, and the slope.
constexpr int kSumsAhead = kHalfWindow, kDifferencesAhead = 2 * kHalfWindow;
constexpr int kGreyAhead = kDifferencesAhead + 1;

}  // namespace

// The rows being worked on, each quantity in a ring.
struct Refiner::Rings {
    explicit Rings(int width)
        : pitch(rounded_up(width + 2 * kMargin, kMargin)),
          floats(kQuantities * kRing * pitch),
          products(2 * pitch),
          left(kRing * pitch),
          right(pitch),
          words(pitch),
          scratch(pitch) {}

    enum Quantity { matched, slope, difference, difference_sums, cross_sums, square_sums,
                    kQuantities };

    float* row(Quantity quantity, int i) {
        return floats.data() + (quantity * kRing + i % kRing) * pitch + kMargin;
    }
    uint8_t* left_row(int i) { return left.data() + i % kRing * pitch + kMargin; }

    std::ptrdiff_t pitch;
    Buffer<float> floats, products;
    Buffer<uint8_t> left, right;
    Buffer<uint32_t> words;
    Buffer<float> scratch;
};

Refiner::Refiner(int height, int width, int threads, const RefineKernels& kernels)
    : height_(height),
      width_(width),
      stripes_(std::clamp(height / kStripeHeight, 1, threads)),
      kernels_(kernels),
      between_(static_cast<std::size_t>(height) * width),
      pool_(stripes_) {
    for (int i = 0; i < pool_.threads(); ++i) rings_.push_back(std::make_unique<Rings>(width));
}

Refiner::~Refiner() = default;

void Refiner::refine(const Image& left, const Image& right, const float* disparity,
                     float* refined) {
    const std::lock_guard lock(one_at_a_time_);
    left_ = left;
    right_ = right;
    auto first = [&](int i, int worker) {
        refine_stripe(i, disparity, between_.data(), nullptr, *rings_[worker]);
    };
    auto second = [&](int i, int worker) {
        refine_stripe(i, between_.data(), refined, disparity, *rings_[worker]);
    };
    pool_.run(stripes_, first);
    pool_.run(stripes_, second);
}

// One step of registration. Every quantity runs ahead of those that are summed from it. The last
// step is bounded by the disparity `before` the first.
void Refiner::refine_stripe(int stripe, const float* from, float* to, const float* before,
                            Rings& rings) const {
    const int first = first_row(stripe), end = first_row(stripe + 1);
    const auto wanted = [&](int row, int ahead) {
        return row >= std::max(first - ahead, 0) && row < std::min(end + ahead, height_);
    };
    for (int row = first - 2 * kGreyAhead; row < end; ++row) {
        if (wanted(row + kGreyAhead, kGreyAhead)) load(row + kGreyAhead, from, rings);
        if (wanted(row + kDifferencesAhead, kDifferencesAhead)) {
            differ(row + kDifferencesAhead, from, rings);
        }
        if (wanted(row + kSumsAhead, kSumsAhead)) multiply(row + kSumsAhead, rings);
        if (!wanted(row, 0)) continue;
        move(row, from, to, rings);
        if (before == nullptr) continue;
        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(row) * width_;
        kernels_.bounded(before + at, width_, to + at);
    }
}

void Refiner::load(int row, const float* from, Rings& rings) const {
    uint8_t *left = rings.left_row(row), *right = rings.right.data();
    std::memcpy(left, left_.row(row), width_);
    reflect(left, width_, kHalfWindow);
    std::memcpy(right, right_.row(row), width_);
    right[width_] = right[width_ - 1];
    float* matched = rings.row(Rings::matched, row);
    kernels_.matched(right, from + static_cast<std::ptrdiff_t>(row) * width_, width_,
                     rings.words.data(), matched);
    reflect(matched, width_, kHalfWindow);
}

void Refiner::differ(int row, const float* from, Rings& rings) const {
    const int above = reflected(row - 1, height_), below = reflected(row + 1, height_);
    const uint8_t* const left[] = {rings.left_row(above), rings.left_row(row),
                                   rings.left_row(below)};
    const float* const matched[] = {rings.row(Rings::matched, above),
                                    rings.row(Rings::matched, row),
                                    rings.row(Rings::matched, below)};
    float* difference = rings.row(Rings::difference, row);
    kernels_.differences(left, matched, from + static_cast<std::ptrdiff_t>(row) * width_, width_,
                         rings.row(Rings::slope, row), difference);
    reflect(difference, width_, kHalfWindow);
    kernels_.sums(difference, width_, rings.scratch.data(),
                  rings.row(Rings::difference_sums, row));
}

void Refiner::multiply(int row, Rings& rings) const {
    const float* sums[kWindow];
    for (int i = 0; i < kWindow; ++i) {
        sums[i] = rings.row(Rings::difference_sums, reflected(row - kHalfWindow + i, height_));
    }
    float* cross = rings.row(Rings::cross_sums, row);
    float* square = rings.row(Rings::square_sums, row);
    float* products[] = {rings.products.data() + kMargin,
                         rings.products.data() + rings.pitch + kMargin};
    kernels_.products(sums, rings.row(Rings::difference, row), rings.row(Rings::slope, row), width_,
                      products[0], products[1]);
    for (float* product : products) reflect(product, width_, kHalfWindow);
    kernels_.sums(products[0], width_, rings.scratch.data(), cross);
    kernels_.sums(products[1], width_, rings.scratch.data(), square);
}

void Refiner::move(int row, const float* from, float* to, Rings& rings) const {
    const float *cross[kWindow], *square[kWindow];
    for (int i = 0; i < kWindow; ++i) {
        const int near = reflected(row - kHalfWindow + i, height_);
        cross[i] = rings.row(Rings::cross_sums, near);
        square[i] = rings.row(Rings::square_sums, near);
    }
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(row) * width_;
    kernels_.moved(cross, square, from + at, width_, to + at);
}

}  // namespace bearcub
