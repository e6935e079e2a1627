#include "outline.h"

#include <limits>

namespace bearcub {
namespace {

struct Scratch {
    std::vector<uint8_t> mask, left_bad, right_bad;
    std::vector<float> here, there, warped, balance, texture, edge;
    std::vector<double> columns;
};

struct Window {
    int top, left, rows, columns;

    std::size_t size() const { return static_cast<std::size_t>(rows) * columns; }
};

// Where a thing is on the grid, and between which disparities.
struct Bounds {
    int top, left, bottom, right;
    float nearest, farthest;
};

// What lies between the sampled columns and rows at its side may be of the thing beside it.
Bounds bounds_of(const Labels& labels, const Sampled& sampled, const Disparity& map) {
    const auto row_of = [&](int i) { return static_cast<int>(sampled.index[i] / labels.columns); };
    int left = labels.columns, right = 0;
    float least = std::numeric_limits<float>::infinity(), most = 0;
    for (int i = 0; i < sampled.count; ++i) {
        const int row = row_of(i);
        const int column =
            static_cast<int>(sampled.index[i] - static_cast<int64_t>(row) * labels.columns);
        const float d = map.at(labels.step * row, labels.step * column);
        left = std::min(left, column), right = std::max(right, column + 1);
        least = std::min(least, d), most = std::max(most, d);
    }
    const double nearest = std::min(sampled.nearest, most * sampled.within);
    const double farthest = std::max(sampled.farthest, least / sampled.within);
    return {row_of(0),
            left,
            row_of(sampled.count - 1) + 1,
            right,
            static_cast<float>(nearest),
            static_cast<float>(farthest)};
}

// Marks the pixels of a window that are the thing's: those that stand at or above and left of one
// that was sampled.
void mark(const Labels& labels, const Bounds& bounds, const Disparity& map, const Surface& surface,
          const Window& window, uint8_t* mask) {
    const auto own = [&](int row, int column) {
        return row < bounds.bottom && column < bounds.right &&
               labels.data[static_cast<std::ptrdiff_t>(row) * labels.columns + column] ==
                   labels.number;
    };
    const int step = labels.step;
    const bool more = step > 1;
    for (int i = 0; i < window.rows; ++i) {
        const int row = bounds.top + i / step;
        uint8_t* const to = mask + static_cast<std::size_t>(i) * window.columns;
        if (i % step) {
            std::copy(to - window.columns, to, to);
            continue;
        }
        for (int column = bounds.left; column < bounds.right; ++column) {
            const bool is_own =
                own(row, column) || (more && (own(row + 1, column) || own(row, column + 1) ||
                                              own(row + 1, column + 1)));
            const int first = (column - bounds.left) * step;
            std::fill(to + first, to + std::min(first + step, window.columns), is_own);
        }
    }
    for (int i = 0; i < window.rows; ++i) {
        const int v = window.top + i;
        const float of_row = surface.of_row(v);
        uint8_t* const to = mask + static_cast<std::size_t>(i) * window.columns;
        for (int j = 0; j < window.columns; ++j) {
            if (!to[j]) continue;
            const int u = window.left + j;
            const float level = surface.level(u, of_row);
            const int entry = surface.entry(level);
            const float d = map.at(v, u);
            to[j] = d - (level + surface.bend[entry]) > surface.tolerance[entry] &&
                    d <= bounds.nearest && d >= bounds.farthest;
        }
    }
}

// The right image at the claimed disparities, linear between columns, black beyond the border.
void warp(const Pair& pair, const Disparity& map, const Window& window, const uint8_t* mask,
          float* warped) {
    for (int i = 0; i < window.rows; ++i) {
        const int v = window.top + i;
        const uint8_t* const row = pair.right.row(v);
        const auto grey = [&](int u) { return u >= 0 && u < pair.columns ? row[u] : 0; };
        for (int j = 0; j < window.columns; ++j) {
            const std::size_t k = static_cast<std::size_t>(i) * window.columns + j;
            const int u = window.left + j;
            if (!mask[k]) {
                warped[k] = static_cast<float>(grey(u));
                continue;
            }
            const float at = static_cast<float>(u) - (map.at(v, u) - pair.offset);
            int whole = static_cast<int>(at);
            whole -= at < static_cast<float>(whole);  // std::floor, without a call
            const float part = at - static_cast<float>(whole);
            warped[k] = static_cast<float>(grey(whole)) * (1 - part) +
                        static_cast<float>(grey(whole + 1)) * part;
        }
    }
}

// Differences of a pixel's neighbours along the row; none at the window's sides.
template <class Value>
void gradient(const Window& window, Value value, float* to) {
    for (int i = 0; i < window.rows; ++i) {
        float* const row = to + static_cast<std::size_t>(i) * window.columns;
        row[0] = row[window.columns - 1] = 0.0f;
        for (int j = 1; j + 1 < window.columns; ++j) row[j] = value(i, j + 1) - value(i, j - 1);
    }
}

// Sums over boxes, mirrored at the borders.
void box_sums(const Window& window, int columns, int rows, const float* from,
              std::vector<double>& sums, float* to) {
    const int down = rows / 2, right = columns / 2;
    sums.assign(window.columns + 2 * right, 0.0);
    double* __restrict const sum = sums.data() + right;
    const auto row = [&](int i) {
        return from + static_cast<std::size_t>(reflected(i, window.rows)) * window.columns;
    };
    for (int i = -2 * down; i < window.rows; ++i) {
        const float* __restrict const next = row(i + down);
        for (int j = 0; j < window.columns; ++j) sum[j] += next[j];
        if (i < 0) continue;
        for (int k = 1; k <= right; ++k) {
            sum[-k] = sum[reflected(-k, window.columns)];
            sum[window.columns - 1 + k] = sum[reflected(window.columns - 1 + k, window.columns)];
        }
        float* __restrict const here = to + static_cast<std::size_t>(i) * window.columns;
        for (int j = 0; j < window.columns; ++j) {
            double all = 0;
            for (int k = -right; k <= right; ++k) all += sum[j + k];
            here[j] = static_cast<float>(all);
        }
        const float* __restrict const past = row(i - down);
        for (int j = 0; j < window.columns; ++j) sum[j] -= past[j];
    }
}

// Marks what cannot be a thing's leftmost and rightmost pixel in its row.
void mark_beside(const Pair& pair, const Disparity& map, const Window& window,
                 const TrimTuning& tuning, Scratch& scratch) {
    const std::size_t size = window.size();
    for (auto* each : {&scratch.here, &scratch.there, &scratch.warped, &scratch.balance,
                       &scratch.texture, &scratch.edge}) {
        each->resize(size);
    }
    warp(pair, map, window, scratch.mask.data(), scratch.warped.data());
    gradient(window,
             [&](int i, int j) {
                 return static_cast<float>(pair.left.row(window.top + i)[window.left + j]);
             },
             scratch.here.data());
    gradient(window,
             [&](int i, int j) {
                 return scratch.warped[static_cast<std::size_t>(i) * window.columns + j];
             },
             scratch.there.data());
    for (std::size_t k = 0; k < size; ++k) {
        const float here = scratch.here[k], there = scratch.there[k], off = here - there;
        scratch.balance[k] = off * off - tuning.fringe * (here * here + there * there);
        scratch.texture[k] = std::abs(here);
    }
    box_sums(window, tuning.narrow_columns, tuning.narrow_rows, scratch.balance.data(),
             scratch.columns, scratch.warped.data());
    box_sums(window, 1, tuning.narrow_rows, scratch.texture.data(), scratch.columns,
             scratch.edge.data());
    scratch.left_bad.resize(size);
    scratch.right_bad.resize(size);
    for (std::size_t k = 0; k < size; ++k) {
        scratch.left_bad[k] = scratch.right_bad[k] = scratch.warped[k] >= 0;
    }
    for (int i = 0; i < window.rows; ++i) {
        const std::size_t start = static_cast<std::size_t>(i) * window.columns;
        const float* __restrict const edge = &scratch.edge[start];
        uint8_t* __restrict const left = &scratch.left_bad[start];
        uint8_t* __restrict const right = &scratch.right_bad[start];
        const float grows = tuning.grows;
        for (int by = 1; by <= std::min(tuning.edge, window.columns - 1); ++by) {
            const int count = window.columns - by;
            for (int j = 0; j < count; ++j) left[j] |= edge[j + by] > grows * edge[j];
            for (int j = 0; j < count; ++j) right[j + by] |= edge[j] > grows * edge[j + by];
        }
    }
}

// Drops the fringe of every run of a row, from both sides inwards.
void trim(const Window& window, int widest, Scratch& scratch) {
    for (int i = 0; i < window.rows; ++i) {
        const std::size_t start = static_cast<std::size_t>(i) * window.columns;
        uint8_t* const mask = &scratch.mask[start];
        for (int j = 0; j < window.columns; ++j) {
            if (!mask[j]) continue;
            const int first = j;
            while (j + 1 < window.columns && mask[j + 1]) ++j;
            int left = first, right = j;
            while (left <= j && left < first + widest && scratch.left_bad[start + left]) ++left;
            while (right >= first && right > j - widest && scratch.right_bad[start + right]) --right;
            for (int k = first; k <= j; ++k) mask[k] = k >= left && k <= right;
        }
    }
}

}  // namespace

Pixels all_pixels(const Labels& labels, const Sampled& sampled, const Disparity& map,
                  const Surface& surface, const Pair* pair, const TrimTuning& tuning) {
    Scratch& scratch = of_this_thread<Scratch>();
    const Bounds bounds = bounds_of(labels, sampled, map);
    const int top = bounds.top * labels.step, left = bounds.left * labels.step;
    const Window window{top, left, std::min(map.rows, bounds.bottom * labels.step) - top,
                        std::min(map.columns, bounds.right * labels.step) - left};
    scratch.mask.resize(window.size());
    mark(labels, bounds, map, surface, window, scratch.mask.data());
    if (pair != nullptr) {
        mark_beside(*pair, map, window, tuning, scratch);
        trim(window, tuning.widest_fringe, scratch);
    }
    const auto count = std::count(scratch.mask.begin(), scratch.mask.end(), uint8_t{1});
    Pixels found;
    found.u.reserve(count);
    found.v.reserve(count);
    for (int i = 0; i < window.rows; ++i) {
        for (int j = 0; j < window.columns; ++j) {
            if (!scratch.mask[static_cast<std::size_t>(i) * window.columns + j]) continue;
            found.u.push_back(left + j);
            found.v.push_back(top + i);
        }
    }
    return found;
}

void find_nearer(const Labels& labels, const Disparity& map, const int64_t* u, const int64_t* v,
                 int count, const std::vector<Beside>& places, bool* found) {
    for (int i = 0; i < count; ++i) {
        const int column = static_cast<int>(u[i]), row = static_cast<int>(v[i]);
        const float own = map.at(row, column);
        found[i] = false;
        for (const auto& [right, down] : places) {
            const int x = std::min(std::max(column + right, 0), map.columns - 1);
            const int y = std::min(row + down, map.rows - 1);
            const int other = labels.data[static_cast<std::ptrdiff_t>(y / labels.step) *
                                              labels.columns + x / labels.step];
            found[i] |= other != 0 && other != labels.number && map.at(y, x) > own;
        }
    }
}

}  // namespace bearcub
