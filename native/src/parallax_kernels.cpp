// The inner loops of the look for small things: plain ones, which the compiler turns into vectors.
// This file is compiled once per instruction set, like kernels.cpp.
#include "parallax_kernels.h"

#include "simd.h"

namespace bearcub::BEARCUB_LEVEL {
namespace {

BEARCUB_INLINE int mean(int a, int b) { return (a + b + ((a + b) >> 1 & 1)) >> 1; }  // half to even

// A row of an image, shrunk: means of two rows, of which means of 2 x 2.
void shrink(const Image& image, const Strip& strip, int v, uint8_t* __restrict to) {
    const int columns = strip.columns;
    const uint8_t* a = image.data + (strip.first + 2 * strip.step * v) * image.stride;
    const uint8_t* b = a + image.stride;
    if (strip.step == 1) {
        for (int u = 0; u < columns; ++u) to[u] = static_cast<uint8_t>(mean(a[u], b[u]));
        return;
    }
    const uint8_t *c = b + image.stride, *d = c + image.stride;
    for (int u = 0; u < columns; ++u) {
        const int i = 2 * u, j = i + 1;
        const int sum = mean(a[i], b[i]) + mean(a[j], b[j]) + mean(c[i], d[i]) + mean(c[j], d[j]);
        to[u] = static_cast<uint8_t>((sum + 2) >> 2);
    }
}

// Calls `fill` with the columns, first and beyond the last, between the middles of equal parts of a
// row, and with the line through what is told of these parts: its value in column 0, its slope.
template <class Fill>
BEARCUB_INLINE void between_middles(const float* told, int parts, int columns, const Fill& fill) {
    const float part = static_cast<float>(columns) / static_cast<float>(parts);
    for (int k = 0, first = 0, end = 0; k <= parts; ++k, first = end) {
        const float here = told[larger(k - 1, 0)];
        const float slope = (told[smaller(k, parts - 1)] - here) / part;
        const float middle = (static_cast<float>(k) - 0.5f) * part - 0.5f;  // of `here`
        end = k == parts ? columns : static_cast<int>(middle + part) + 1;
        if (first < end) fill(first, end, here - slope * middle, slope);
    }
}

// A row of what is told of its parts: cv2.resize.
void spread(const float* told, int parts, int columns, float* __restrict row) {
    between_middles(told, parts, columns, [=](int first, int end, float start, float slope) {
        for (int u = first; u < end; ++u) row[u] = start + slope * static_cast<float>(u);
    });
}

// What a row shows at the matches of some columns, whose disparity is a line.
BEARCUB_INLINE void match(const float* __restrict row, float last, int first, int end, float start,
                          float slope, float* __restrict to) {
    const auto at = [=](int u) {
        const float column = static_cast<float>(u);
        return column - (start + slope * column);
    };
    const float left = at(first), right = at(end - 1);
    const int shift = static_cast<int>(left) - first;
    if (left >= 0 && right < last && static_cast<int>(right) == end - 1 + shift) {
        const float* from = row + shift;
        for (int u = first; u < end; ++u) {  // in vectors: neighbours match neighbours
            const float share = at(u) - static_cast<float>(u + shift);
            to[u] = from[u] + share * (from[u + 1] - from[u]);
        }
        return;
    }
    for (int u = first; u < end; ++u) {
        const float inside = clamped(at(u), 0.0f, last);
        const int i = static_cast<int>(inside);
        to[u] = row[i] + (inside - static_cast<float>(i)) * (row[i + 1] - row[i]);
    }
}

void warp(const Look& look) {
    const int columns = look.strip.columns, step = look.strip.step;
    const float scale = 1.0f / static_cast<float>(step), last = static_cast<float>(columns - 1);
    float *__restrict grey = look.rows[0], *__restrict found = look.rows[1];
    for (int v = 0; v < look.strip.rows; ++v) {
        float* floor = look.floor + v * look.pitch;
        uint8_t* __restrict right = look.right + v * look.pitch;
        shrink(look.left_image, look.strip, v, look.left + v * look.pitch);
        shrink(look.right_image, look.strip, v, right);
        for (int u = 0; u < columns; ++u) grey[u] = right[u];
        grey[columns] = grey[columns - 1];
        const float row = static_cast<float>(look.strip.first + (2 * v + 1) * step) - 0.5f;
        const float level = look.b * row + look.c + look.a * 0.5f * static_cast<float>(step - 1);
        const float across = look.a * static_cast<float>(step);
        const auto fill = [=](int first, int end, float bend, float bend_slope) {
            const float start = level + bend, slope = across + bend_slope;
            for (int u = first; u < end; ++u) floor[u] = start + slope * static_cast<float>(u);
            match(grey, last, first, end, (start - look.offset) * scale, slope * scale, found);
        };
        between_middles(look.bend + v * look.parts_across, look.parts_across, columns, fill);
        for (int u = 0; u < columns; ++u) {
            right[u] = static_cast<uint8_t>(static_cast<int>(found[u] + 0.5f));
        }
    }
}

// Means over the parts in their j-th row: cv2.resize by areas.
template <class T>
void average(const T* image, const Look& look, int j, float* to) {
    const int columns = look.strip.columns;
    const float down = static_cast<float>(look.strip.rows) / static_cast<float>(look.parts_down);
    const float across = static_cast<float>(columns) / static_cast<float>(look.parts_across);
    const float top = static_cast<float>(j) * down, bottom = top + down;
    float* __restrict sums = look.rows[2];
    for (int u = 0; u <= columns; ++u) sums[u] = 0;
    for (int v = static_cast<int>(top); v < look.strip.rows; ++v) {
        const float row = static_cast<float>(v);
        const float share = smaller(row + 1, bottom) - larger(row, top);
        if (share <= 0) break;
        const T* from = image + v * look.pitch;
        for (int u = 0; u < columns; ++u) sums[u] += share * static_cast<float>(from[u]);
    }
    for (int k = 0; k < look.parts_across; ++k) {
        const float left = static_cast<float>(k) * across, right = left + across;
        const int first = static_cast<int>(left), end = smaller(static_cast<int>(right), columns);
        float sum = (right - static_cast<float>(end)) * sums[end] -
                    (left - static_cast<float>(first)) * sums[first];
        for (int u = first; u < end; ++u) sum += sums[u];
        to[k] = sum / (down * across);
    }
}

// Rows of what is told of the parts, linear between those above and below.
struct Between {
    const float *above, *below;
    float share;

    Between(const float* rows, const Look& look, int v) {
        const float parts = static_cast<float>(look.parts_down);
        const float part = static_cast<float>(look.strip.rows) / parts;
        const float at = clamped((static_cast<float>(v) + 0.5f) / part - 0.5f, 0.0f, parts - 1);
        const int j = static_cast<int>(at);
        above = rows + j * look.pitch;
        below = j + 1 < look.parts_down ? above + look.pitch : above;
        share = at - static_cast<float>(j);
    }
    BEARCUB_INLINE float operator[](int u) const {
        return above[u] + share * (below[u] - above[u]);
    }
};

void contrast(const Look& look) {
    const int columns = look.strip.columns;
    float *means = look.rows[0], *others = look.rows[1];
    for (int j = 0; j < look.parts_down; ++j) {
        average(look.left, look, j, means);
        average(look.right, look, j, others);
        for (int k = 0; k < look.parts_across; ++k) means[k] /= others[k] + 1;
        spread(means, look.parts_across, columns, look.ratio + j * look.pitch);
    }
    float* __restrict bright = look.rows[0] + 1;
    float* __restrict difference = look.rows[1];
    for (int v = 0; v < look.strip.rows; ++v) {
        const uint8_t *left = look.left + v * look.pitch, *right = look.right + v * look.pitch;
        float* __restrict energy = look.energy + v * look.pitch;
        float* __restrict seen = look.seen + v * look.pitch;
        float* __restrict square = look.sure + v * look.pitch;
        const Between ratio(look.ratio, look, v);
        for (int u = 0; u < columns; ++u) {
            const float one = left[u], other = right[u] * ratio[u];
            bright[u] = one + other;
            difference[u] = other - one;
        }
        bright[-1] = bright[1];
        bright[columns] = bright[columns - 2];
        for (int u = 0; u < columns; ++u) {
            const float g = 0.25f * (bright[u + 1] - bright[u - 1]);
            energy[u] = g * g;
            seen[u] = g * difference[u];
            square[u] = difference[u] * difference[u];
        }
    }
    for (int j = 0; j < look.parts_down; ++j) {
        average(look.sure, look, j, means);
        for (int k = 0; k < look.parts_across; ++k) means[k] += look.tuning.noise;
        spread(means, look.parts_across, columns, look.variance + j * look.pitch);
    }
}

// Sums of `wide` neighbours from a pixel on, put together from sums of 1, 2, 4 ...
void sum_across(float* __restrict row, int wide, int columns, float* __restrict to) {
    for (int size = 1, done = 0;; size *= 2) {
        if (wide & size) {
            if (done == 0) {
                for (int u = 0; u < columns; ++u) to[u] = row[u];
            } else {
                for (int u = 0; u < columns; ++u) to[u] += row[u + done];
            }
            done += size;
        }
        if (done == wide) return;
        for (int u = 0; u < columns + wide - size; ++u) row[u] += row[u + size];
    }
}

// Sums over windows in whose last row's middle the pixels of row v are; nothing is beside the image.
void sum(const Look& look, const Band& band, int v, float* expected, float* together) {
    const int columns = look.strip.columns, wide = band.wide, half = wide / 2;
    const int top = larger(band.first, v - band.tall + 1);
    float *__restrict row = look.rows[2], *__restrict other = look.rows[3];
    for (int u = 0; u < half; ++u) row[u] = other[u] = 0;
    for (int u = 0; u < columns; u += kSummed) {
        float first[kSummed] = {}, second[kSummed] = {};
        for (int i = top; i <= v; ++i) {
            const float* energy = look.energy + i * look.pitch + u;
            const float* seen = look.seen + i * look.pitch + u;
            const float parallax = look.parallax[v - i], square = parallax * parallax;
            for (int k = 0; k < kSummed; ++k) first[k] += square * energy[k];
            for (int k = 0; k < kSummed; ++k) second[k] += parallax * seen[k];
        }
        for (int k = 0; k < kSummed; ++k) row[half + u + k] = first[k];
        for (int k = 0; k < kSummed; ++k) other[half + u + k] = second[k];
    }
    for (int u = half + columns; u < columns + wide; ++u) row[u] = other[u] = 0;
    sum_across(row, wide, columns, expected);
    sum_across(other, wide, columns, together);
}

void judge(const Look& look, const Band& band) {
    const int columns = look.strip.columns, inner = columns - band.wide;
    const float scale = 1.0f / static_cast<float>(look.strip.step);
    const float inside = static_cast<float>(band.wide) - look.offset * scale;
    const float far = band.far, near = band.near;
    const float least = look.tuning.sure * look.tuning.sure;
    const float low = look.tuning.least_share, high = look.tuning.most_share;
    float *expected = look.rows[0], *together = look.rows[1];
    for (int v = band.first; v < band.end; ++v) {
        const float* floor = look.floor + v * look.pitch;
        float* __restrict sure = look.sure + v * look.pitch;
        sum(look, band, v, expected, together);
        const Between noise(look.variance, look, v);
        int hits = 0;
        for (int u = 0; u < columns; ++u) {
            const float square = together[u] * together[u] / (expected[u] * noise[u] + 1e-6f);
            const bool stands = (square > least) & (floor[u] >= far) & (floor[u] < near) &
                                (static_cast<float>(u) - floor[u] * scale > inside) &
                                (together[u] > low * expected[u]) &
                                (together[u] < high * expected[u]) & (u < inner);
            sure[u] = stands ? square : 0.0f;
            hits |= stands;
        }
        look.hits[v] = hits;
    }
}

void noise(const Look& look, float* __restrict variance) {
    const int columns = look.strip.columns;
    for (int v = 0; v < look.strip.rows; ++v) {
        const Between here(look.variance, look, v);
        for (int u = 0; u < columns; ++u) variance[v * columns + u] = here[u];
    }
}

}  // namespace

extern const LookKernels look_kernels;
const LookKernels look_kernels = {warp, contrast, judge, noise};

}  // namespace bearcub::BEARCUB_LEVEL
