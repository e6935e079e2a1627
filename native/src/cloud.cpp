#include "cloud.h"

#include <limits>
#include <numeric>

namespace bearcub {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kHalfPi = 1.57079632679489661923;

// The arc tangent from 0 to 1, to 2e-12: its series, about 0 or, by the addition theorem, about 1.
double small_atan(double x) {
    constexpr double kTurn = 0.41421356237309504880;  // tangent of an eighth of a half turn
    const bool upper = x > kTurn;
    if (upper) x = (x - 1) / (x + 1);
    const double square = x * x;
    double sum = 0;
    for (int k = 12; k >= 0; --k) sum = sum * -square + 1.0 / (2 * k + 1);
    return x * sum + (upper ? kHalfPi / 2 : 0.0);
}

// The direction of (x, y), x ahead: several times faster than std::atan2, which takes what is behind.
double direction(double x, double y) {
    if (!(x > 0)) return std::atan2(y, x);
    const double across = std::abs(y);
    const double angle =
        across <= x ? small_atan(across / x) : kHalfPi - small_atan(x / across);
    return y < 0 ? -angle : angle;
}

// The count of the bin in which the median value lies: sparse bins have no say.
double typical_of(std::vector<int> counts) {
    std::sort(counts.begin(), counts.end());
    const int total = std::accumulate(counts.begin(), counts.end(), 0);
    int sum = 0;
    std::size_t i = 0;
    while (i + 1 < counts.size() && 2 * (sum += counts[i]) < total) ++i;
    return counts[i];
}

// The first and last bin of the fullest run of bins above a threshold; small gaps belong to it.
std::pair<int, int> main_run(const std::vector<int>& counts, double threshold) {
    std::vector<int> above;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        if (counts[i] >= threshold) above.push_back(static_cast<int>(i));
    }
    const int gap = std::max<int>(4, static_cast<int>(above.size()) / 4);
    std::pair<int, int> best{above[0], above[0]};
    int fullest = -1, first = above[0], sum = 0;
    for (std::size_t k = 0; k < above.size(); ++k) {
        sum += counts[above[k]];
        if (k + 1 < above.size() && above[k + 1] - above[k] <= gap) continue;
        if (sum > fullest) fullest = sum, best = {first, above[k]};
        if (k + 1 < above.size()) first = above[k + 1];
        sum = 0;
    }
    return best;
}

}  // namespace

Cloud::Cloud(const View& view, const double* u, const double* v, const float* disparity, int count)
    : bearing_(count), range_(count), height_(count) {
    const Lens& lens = view.lens;
    const double focal = lens.fx * lens.baseline, per_fx = 1 / lens.fx, per_fy = 1 / lens.fy;
    const auto& [ahead, left, up] = view.rotation;
    for (int i = 0; i < count; ++i) {
        const double across = (u[i] - lens.cx) * per_fx, down = (v[i] - lens.cy) * per_fy;
        const double depth = focal / disparity[i];
        const double x = (ahead[0] * across + ahead[1] * down + ahead[2]) * depth + view.origin[0];
        const double y = (left[0] * across + left[1] * down + left[2]) * depth + view.origin[1];
        height_[i] = (up[0] * across + up[1] * down + up[2]) * depth + view.origin[2];
        range_[i] = std::sqrt(x * x + y * y);
        bearing_[i] = direction(x, y);
    }
}

Cloud::Ends Cloud::ends(const std::vector<double>& values, double step, double share) const {
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    const double start = *least - 1.5 * step, per_step = 1 / step;
    std::vector<int> counts(static_cast<std::size_t>((*most - start) * per_step) + 2, 0);
    for (const double value : values) ++counts[static_cast<std::size_t>((value - start) * per_step)];
    const double typical = typical_of(counts);
    const auto [first, last] = main_run(counts, std::max(share * typical, 0.5));
    // the edge bin is partly covered: its share of the typical count is the covered part
    return {start + (first + 1 - std::min(1.0, counts[first] / typical)) * step,
            start + (last + std::min(1.0, counts[last] / typical)) * step};
}

std::vector<Direction> Cloud::directions(double right, double left, int count, int near) const {
    const double per_width = count / std::max(left - right, 1e-9);
    std::vector<int> group(range_.size()), ends(count + 1, 0);
    for (std::size_t i = 0; i < range_.size(); ++i) {
        const double position = (bearing_[i] - right) * per_width;
        group[i] = static_cast<int>(std::min(std::max(position, 0.0), count - 1.0));
        ++ends[group[i] + 1];
    }
    for (int k = 0; k < count; ++k) ends[k + 1] += ends[k];
    std::vector<int> next(ends);
    std::vector<double> ordered(range_.size());
    for (std::size_t i = 0; i < range_.size(); ++i) ordered[next[group[i]]++] = range_[i];
    std::vector<Direction> found;
    for (int k = 0; k < count; ++k) {
        const int size = ends[k + 1] - ends[k];
        if (size == 0) {
            found.push_back({0, kNan, kNan});
            continue;
        }
        const auto first = ordered.begin() + ends[k], last = ordered.begin() + ends[k + 1];
        const int middle = size - (size + 1) / 2, rank = size / near;
        std::nth_element(first, first + middle, last);
        if (rank < middle) std::nth_element(first, first + rank, first + middle);
        found.push_back({size, first[rank], first[middle]});
    }
    return found;
}

double Cloud::range(double share) const {
    std::vector<double> ranges(range_);
    return quantile(ranges, share);
}

double Cloud::height_before(double range, double share) const {
    std::vector<double> heights;
    for (std::size_t i = 0; i < range_.size(); ++i) {
        if (range_[i] < range) heights.push_back(height_[i]);
    }
    return heights.empty() ? kNan : quantile(heights, share);
}

double Cloud::squares() const {
    double sum = 0;
    for (const double range : range_) sum += range * range;
    return sum;
}

Cloud::Spread Cloud::spread() const {
    double range = 0, height = 0;
    for (std::size_t i = 0; i < range_.size(); ++i) range += range_[i], height += height_[i];
    range /= range_.size(), height /= range_.size();
    Spread sums{0, 0, 0};
    for (std::size_t i = 0; i < range_.size(); ++i) {
        const double r = range_[i] - range, h = height_[i] - height;
        sums.range += r * r, sums.together += r * h, sums.height += h * h;
    }
    return sums;
}

}  // namespace bearcub
