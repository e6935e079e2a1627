#include "rows.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>

namespace bearcub {

Rows::Rows(const Shape& shape, const Tuning& tuning, const Kernels& kernels)
    : shape_(shape),
      tuning_(tuning),
      kernels_(kernels),
      lanes_(kernels.lanes * vectors_for(shape.disparities, kernels.lanes)),
      pitch_(rounded_up(shape.width + 2 * kMargin, 64)),
      mirror_pitch_(rounded_up(shape.width + std::abs(shape.smallest) + lanes_, 64)),
      mirror_start_(std::max(0, -shape.smallest)),
      cells_(static_cast<std::ptrdiff_t>(rounded_up(shape.width, kTogether)) * lanes_),
      left_(kLoaded * pitch_),
      right_(kLoaded * pitch_),
      left_words_(shape.bits > 8 ? kLoaded * pitch_ : 0),
      right_words_(shape.bits > 8 ? kLoaded * pitch_ : 0),
      thresholds_(pitch_),
      planes_(kPlanes * pitch_),
      mirrored_(kRows * kPlanes * mirror_pitch_),
      outside_(mirror_pitch_),
      padding_(lanes_),
      four_times_(kRows * (kPlanes + 2) * pitch_),
      paths_(2 * kRows * cells_),
      vertical_(cells_),
      sums_(static_cast<std::size_t>(kTogether * kRows) * lanes_ + 2 * kAlignment),
      winners_(5 * kRows * pitch_),
      second_(pitch_),
      right_best_(kRows * (pitch_ + lanes_)),
      steps_(kRows * pitch_) {
    std::memset(outside_.data(), kOutside, outside_.bytes());
    std::memset(outside_.data() + mirror_start_, 0, shape.width);
    std::memset(padding_.data() + shape.disparities, kOutside, lanes_ - shape.disparities);
    lay_out();
}

void Rows::lay_out() {
    block_.width = shape_.width;
    block_.lanes = lanes_;
    block_.disparities = shape_.disparities;
    block_.smallest = shape_.smallest;
    block_.tuning = tuning_;
    // Right column x - smallest - lane stands at width - 1 - x + smallest + lane.
    const std::ptrdiff_t origin = shape_.width - 1 + shape_.smallest;
    block_.outside = outside_.data() + mirror_start_ + origin;
    block_.padding = padding_.data();
    block_.paths = paths_.data();
    block_.vertical = vertical_.data();
    block_.sums = sums_.data() + kAlignment;
    block_.right_best = right_best_.data();
    block_.steps = steps_.data();
    uint8_t** const winners[] = {&block_.lane, &block_.best, &block_.before, &block_.after,
                                 &block_.confidence};
    for (int i = 0; i < 5; ++i) *winners[i] = winners_.data() + i * kRows * pitch_;
    block_.second = second_.data();
    for (int row = 0; row < kRows; ++row) {
        for (int i = 0; i < kPlanes; ++i) {
            block_.left[row][i] = four_times(row * kPlanes + i);
            block_.right[row][i] = mirrored(row * kPlanes + i) + origin;
        }
        block_.across[row] = four_times((kPlanes + 0) * kRows + row);
        block_.down[row] = four_times((kPlanes + 1) * kRows + row);
    }
}

void Rows::forget_above() { std::memset(vertical_.data(), 0, vertical_.bytes()); }

namespace {

// The outermost pixels go on beyond the border.
template <class Pixel>
void extend(Pixel* row, int width, int margin) {
    std::fill(row - margin, row, row[0]);
    std::fill(row + width, row + width + margin, row[width - 1]);
}

}  // namespace

void Rows::load(const Image& image, int row, Buffer<uint8_t>& grey,
                Buffer<uint16_t>& words) const {
    constexpr int beyond = 8;
    for (int i = 0; i < kLoaded; ++i) {
        const int from = std::clamp(row - kReach + i, 0, shape_.height - 1);
        const uint8_t* pixels = image.row(from);
        uint8_t* bytes = grey.data() + i * pitch_ + kMargin;
        if (shape_.bits > 8) {
            uint16_t* wide = words.data() + i * pitch_ + kMargin;
            std::memcpy(wide, pixels, sizeof(uint16_t) * shape_.width);
            extend(wide, shape_.width, beyond);
            for (int x = 0; x < shape_.width; ++x) {
                bytes[x] = static_cast<uint8_t>(std::min(wide[x] >> (shape_.bits - 8), 255));
            }
        } else {
            std::memcpy(bytes, pixels, shape_.width);
        }
        extend(bytes, shape_.width, beyond);
    }
}

void Rows::describe(const Buffer<uint8_t>& grey, const Buffer<uint16_t>& words, int row) {
    uint8_t* const planes[kPlanes] = {plane(0), plane(1), plane(2)};
    const auto window = [&](const auto& rows, auto census, auto* scratch) {
        const auto* first = rows.data() + row * pitch_ + kMargin;
        census({first, first + pitch_, first + 2 * pitch_, first + 3 * pitch_, first + 4 * pitch_},
               shape_.width, scratch, planes);
    };
    if (shape_.bits > 8) {
        window(words, kernels_.census16, thresholds_.data());
    } else {
        window(grey, kernels_.census8, reinterpret_cast<uint8_t*>(thresholds_.data()));
    }
}

void Rows::prepare(const Image& left, const Image& right, int first) {
    load(left, first, left_, left_words_);
    load(right, first, right_, right_words_);
    for (int row = 0; row < kRows; ++row) {
        describe(left_, left_words_, row);
        for (int i = 0; i < kPlanes; ++i) {
            kernels_.four_times(plane(i), shape_.width, four_times(row * kPlanes + i));
        }
        describe(right_, right_words_, row);
        for (int i = 0; i < kPlanes; ++i) {
            kernels_.reversed(plane(i), shape_.width, mirrored(row * kPlanes + i));
        }
        const uint8_t* here = around(row).rows[kReach];
        kernels_.penalties(tuning_, here, here - 1, shape_.width + 1,
                           four_times((kPlanes + 0) * kRows + row));
        kernels_.penalties(tuning_, here, here - pitch_, shape_.width,
                           four_times((kPlanes + 1) * kRows + row));
    }
    std::fill_n(right_best_.data(), right_best_.bytes() / sizeof(uint16_t), uint16_t{0xffff});
}

Rows::Around Rows::around(int row) const {
    Around around{};
    for (int i = 0; i <= 2 * kReach; ++i) {
        around.rows[i] = left_.data() + (row + i) * pitch_ + kMargin;
    }
    return around;
}

std::size_t Rows::bytes() const {
    return left_.bytes() + right_.bytes() + left_words_.bytes() + right_words_.bytes() +
           thresholds_.bytes() + planes_.bytes() + mirrored_.bytes() + outside_.bytes() +
           padding_.bytes() +
           four_times_.bytes() + paths_.bytes() + vertical_.bytes() + sums_.bytes() +
           winners_.bytes() + second_.bytes() + right_best_.bytes() + steps_.bytes();
}

}  // namespace bearcub
