#include "grid.h"

#include <limits>

namespace bearcub {
namespace {

constexpr float kSteps = 16;  // entries of the table of levels per pixel of disparity
constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool stands(const Standing& grid, std::ptrdiff_t i) {
    const float d = grid.disparity[i];
    return grid.standing[i] && d <= grid.nearest && d >= grid.farthest;
}

// The first of ascending limits that is above `x`, looked for from a guess on.
int place(const std::vector<float>& limits, float x, int guess) {
    const int last = static_cast<int>(limits.size());
    while (guess > 0 && x < limits[guess - 1]) --guess;
    while (guess < last && x >= limits[guess]) ++guess;
    return guess;
}

// The few nearest ranges of a direction.
void insert(float range, float* nearest, int hits) {
    if (!(range < nearest[hits - 1])) return;
    int k = hits - 1;
    for (; k > 0 && range < nearest[k - 1]; --k) nearest[k] = nearest[k - 1];
    nearest[k] = range;
}

// How far floor is seen without a gap; NaN where none is.
double seen_until(const char* seen, const Directions& way, double growth) {
    int first = 0, unseen = 0;
    while (first < way.cells && !seen[first]) ++first;
    if (first == way.cells) return std::numeric_limits<double>::quiet_NaN();
    int end = first;
    while (end < way.cells && unseen < way.gap) unseen = seen[end++] ? 0 : unseen + 1;
    return std::min(way.nearest * std::exp((end - unseen) * growth), way.farthest);
}

}  // namespace

BEARCUB_WIDE
void sort_pixels(const Disparity& map, const Surface& surface, float farthest_level,
                 const Part& part, const Sorted& to) {
    const int columns = part.columns;
    const Surface floor_at = surface;  // a copy, which no output can change
    const float* const bend = surface.bend;
    const float* const tolerance = surface.tolerance;
    std::vector<int> entries(columns);
    int* const entry = entries.data();
    for (int row = 0; row < part.rows; ++row) {
        const int v = part.top + row * part.down;
        const std::ptrdiff_t start = static_cast<std::ptrdiff_t>(row) * columns;
        const float of_row = floor_at.of_row(v);
        float* __restrict const d = to.disparity + start;
        float* __restrict const floor = to.floor + start;
        float* __restrict const residual = to.residual + start;
        float* __restrict const allowed = to.allowed + start;
        for (int i = 0; i < columns; ++i) {
            const float level = floor_at.level(part.left + i * part.right, of_row);
            floor[i] = level;
            entry[i] = floor_at.entry(level);
        }
        const float* const from = map.data + v * map.down + part.left * map.right;
        const std::ptrdiff_t right = part.right * map.right;
        for (int i = 0; i < columns; ++i) {
            d[i] = from[i * right];
            floor[i] += bend[entry[i]];
            allowed[i] = tolerance[entry[i]];
        }
        for (int i = 0; i < columns; ++i) residual[i] = d[i] - floor[i];
        bool* __restrict const standing = to.standing + start;
        bool* __restrict const on_floor = to.on_floor + start;
        bool* __restrict const below = to.below + start;
        for (int i = 0; i < columns; ++i) {  // NaN compares false
            const bool seen = floor[i] > farthest_level;
            standing[i] = residual[i] > allowed[i];
            on_floor[i] = seen & (std::abs(residual[i]) <= allowed[i]);
            below[i] = seen & (residual[i] < -allowed[i]);
        }
    }
}

Count count_standing(const Standing& grid) {
    Count found{0, 0};
    const std::ptrdiff_t size = static_cast<std::ptrdiff_t>(grid.rows) * grid.columns;
    for (std::ptrdiff_t i = 0; i < size; ++i) {
        if (!stands(grid, i)) continue;
        ++found.pixels;
        found.largest = std::max(found.largest, grid.disparity[i]);
    }
    return found;
}

void to_cells(const Standing& grid, const Histogram& histogram, const Cells& to) {
    std::ptrdiff_t i = 0, n = 0;
    int32_t most = std::numeric_limits<int32_t>::min();
    for (int v = 0; v < grid.rows; ++v) most = std::max(most, histogram.shift[v]);
    for (int v = 0; v < grid.rows; ++v) {
        const int32_t right = most - histogram.shift[v];
        for (int u = 0; u < grid.columns; ++u, ++i) {
            if (!stands(grid, i)) continue;
            const float d = grid.disparity[i], floor = grid.floor[i];
            to.index[n] = i;
            to.column[n] = u + right;
            to.cell[n] = histogram.level[static_cast<int>(d * kSteps)] * histogram.width + u + right;
            to.tall[n] = d * histogram.tall > floor;
            to.overhead[n] = d * histogram.overhead > floor;
            ++n;
        }
    }
}

Ends find_ends(const Labelled& grid, const View& view, const Directions& way) {
    const double growth = std::log(way.farthest / way.nearest) / way.cells;
    std::vector<float> sides, ranges;  // tangents between directions, ranges between cells
    for (int k = 0; k <= way.count; ++k) {
        sides.push_back(static_cast<float>(std::tan(way.first + (k - 0.5) * way.step)));
    }
    for (int k = 1; k < way.cells; ++k) {
        ranges.push_back(static_cast<float>(way.nearest * std::exp(k * growth)));
    }
    std::vector<char> seen(static_cast<std::size_t>(way.count) * way.cells, 0);
    const auto none = std::numeric_limits<float>::infinity();
    std::vector<float> things(static_cast<std::size_t>(way.count) * way.hits, none);
    std::vector<float> holes(things);
    float turn[3][3], at[3];
    for (int j = 0; j < 3; ++j) {
        at[j] = static_cast<float>(view.origin[j]);
        for (int k = 0; k < 3; ++k) turn[j][k] = static_cast<float>(view.rotation[j][k]);
    }
    const Lens& lens = view.lens;
    const auto focal = static_cast<float>(lens.fx * lens.baseline);
    const auto per_fx = static_cast<float>(1 / lens.fx), per_fy = static_cast<float>(1 / lens.fy);
    const auto cx = static_cast<float>(lens.cx), cy = static_cast<float>(lens.cy);
    int direction = 0, cell = 0;
    for (int row = 0; row < grid.rows; ++row) {
        const float down = (static_cast<float>(grid.v[row]) - cy) * per_fy;
        for (int column = 0; column < grid.columns; ++column) {
            const std::ptrdiff_t i = row * grid.down + column * grid.right;
            const int32_t label = grid.labels[static_cast<std::ptrdiff_t>(row) * grid.columns + column];
            const float measured = grid.disparity[i];
            if (!(grid.on_floor[i] || label != 0) || !(measured > 0)) continue;
            // a hole begins where its floor is missing, not where the line of sight ends in it
            const float depth = focal / (label < 0 ? grid.floor[i] : measured);
            const float across = (static_cast<float>(grid.u[column]) - cx) * per_fx;
            const float x = (turn[0][0] * across + turn[0][1] * down + turn[0][2]) * depth + at[0];
            const float y = (turn[1][0] * across + turn[1][1] * down + turn[1][2]) * depth + at[1];
            if (!(x > 0)) continue;
            direction = place(sides, y / x, direction);
            if (direction == 0 || direction > way.count) continue;
            const std::size_t k = direction - 1;
            const float reach = std::sqrt(x * x + y * y);
            if (label == 0) {
                if (!(reach < way.farthest)) continue;
                cell = place(ranges, reach, cell);
                seen[k * way.cells + cell] = 1;
            } else if (label < 0) {
                insert(reach, &holes[k * way.hits], way.hits);
            } else if (way.blocks[label]) {
                insert(reach, &things[k * way.hits], way.hits);
            }
        }
    }
    Ends ends;
    for (int k = 0; k < way.count; ++k) {
        const std::size_t first = static_cast<std::size_t>(k) * way.cells;
        ends.seen.push_back(seen_until(&seen[first], way, growth));
        const std::size_t last = static_cast<std::size_t>(k) * way.hits + way.hits - 1;
        ends.thing.push_back(things[last] < none ? things[last] : kInfinity);
        ends.hole.push_back(holes[last] < none ? holes[last] : kInfinity);
    }
    return ends;
}

BEARCUB_WIDE
Valid count_valid(const float* disparity, int64_t count) {
    constexpr uint32_t kInfinite = 0x7f800000;
    using Bits __attribute__((may_alias)) = uint32_t;
    const auto* const bits = reinterpret_cast<const Bits*>(disparity);
    Valid found{0, 0};
    // groups short enough for counters of 32 bits, which vectors hold
    for (int64_t start = 0; start < count; start += 1 << 20) {
        const int64_t end = std::min<int64_t>(count, start + (1 << 20));
        uint32_t sound = 0, unmatched = 0;
        for (int64_t i = start; i < end; ++i) {
            sound += bits[i] < kInfinite;
            unmatched += (bits[i] & 0x7fffffff) > kInfinite;
        }
        found.sound += sound;
        found.unmatched += unmatched;
    }
    return found;
}

}  // namespace bearcub
