#include "face.h"

namespace bearcub {
namespace {

using Values = std::vector<double>;

// The middle one, the upper of two.
double middle_of(Values values) {
    std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
    return values[values.size() / 2];
}

// The running median of five, of three at the ends, where ranges are much nearer than that.
Values without_dents(const Values& ranges, double sharpest) {
    const int last = static_cast<int>(ranges.size()) - 1;
    if (last < 4) return ranges;
    Values mended(ranges);
    for (int k = 0; k <= last; ++k) {
        const int from = k < 2 ? 0 : k > last - 2 ? last - 2 : k - 2;
        const int to = k < 2 ? 2 : k > last - 2 ? last : k + 2;
        const double around = middle_of(Values(ranges.begin() + from, ranges.begin() + to + 1));
        if (ranges[k] < (1 - sharpest) * around) mended[k] = around;
    }
    return mended;
}

Values smoothed(const Values& ranges) {
    Values smooth(ranges);
    for (std::size_t k = 1; k + 1 < ranges.size(); ++k) {
        smooth[k] = 0.25 * ranges[k - 1] + 0.5 * ranges[k] + 0.25 * ranges[k + 1];
    }
    return smooth;
}

// How much nearer than its direction's smoothed range an edge turned towards us is.
double to_the_point(const Values& ranges, int nearest, double sharpest) {
    const int last = static_cast<int>(ranges.size()) - 1;
    double step, share;
    if (nearest >= 2 && nearest <= last - 2) {
        const double outer = ranges[nearest - 2] + ranges[nearest + 2];
        step = 0.5 * (outer - (ranges[nearest - 1] + ranges[nearest + 1])), share = 0.625;
    } else if (last >= 2 && (nearest == 0 || nearest == last)) {
        step = ranges[nearest == 0 ? 1 : last - 1] - ranges[nearest], share = 0.5;
    } else {
        return 0;
    }
    return std::min(share * std::max(step, 0.0), sharpest * ranges[nearest]);
}

// src/bearcub/robust.py, line.
struct Line {
    double start, slope;

    Line(const Values& x, const Values& y) {
        Values each;
        for (std::size_t i = 0; i < x.size(); ++i) {
            for (std::size_t k = i + 1; k < x.size(); ++k) {
                each.push_back((y[i] - y[k]) / (x[i] - x[k]));
            }
        }
        slope = middle_of(each);
        each.clear();
        for (std::size_t i = 0; i < x.size(); ++i) each.push_back(y[i] - slope * x[i]);
        start = middle_of(each);
    }
    double at(double x) const { return start + slope * x; }
};

// The ranges of the right and left end of a line that most directions lie on, or of the outermost.
std::pair<double, double> ends(const Values& ranges, const Values& bearings, double right,
                               double left, const FaceTuning& tuning) {
    const std::pair<double, double> outermost{ranges.front(), ranges.back()};
    if (static_cast<int>(ranges.size()) < tuning.straight) return outermost;
    Values across, inverse;  // seen from the middle, 1 / ahead grows evenly along a line
    for (std::size_t k = 0; k < ranges.size(); ++k) {
        const double turned = bearings[k] - 0.5 * (right + left);
        across.push_back(std::tan(turned));
        inverse.push_back(1 / (ranges[k] * std::cos(turned)));
    }
    const Line all(across, inverse);
    Values on_across, on_inverse;
    for (std::size_t k = 0; k < ranges.size(); ++k) {
        if (!(std::abs(all.at(across[k]) - inverse[k]) < tuning.on_line * inverse[k])) continue;
        on_across.push_back(across[k]);
        on_inverse.push_back(inverse[k]);
    }
    if (on_across.size() < tuning.most * ranges.size()) return outermost;
    const Line straight(on_across, on_inverse);
    const double half = 0.5 * (left - right);
    const double first = straight.at(std::tan(-half)) * std::cos(-half);
    const double last = straight.at(std::tan(half)) * std::cos(half);
    // seen along, it has no end to speak of
    if (std::min(first, last) < 0.5 / std::max(ranges.front(), ranges.back())) return outermost;
    return {1 / first, 1 / last};
}

// The range at an end, half a direction beyond the outermost one's middle; round things recede.
double at_the_end(double first, double second, double third, double grain, const FaceTuning& t) {
    const double growth = first - second, before = second - third;
    const double rounded = before > 0 ? growth - before - t.no_noise * grain : 0;
    const double more = 0.5 * growth + t.rounds * std::max(rounded, 0.0);
    return first + std::min(std::max(more, -t.sharpest * first), t.roundest * first);
}

// The extent across the line of sight between the two silhouettes.
double chord(const Values& ranges, double angle, double grain, const FaceTuning& tuning) {
    const std::size_t last = ranges.size() - 1;
    double both = ranges[0] + ranges[last];
    if (last >= 2) {
        both = at_the_end(ranges[0], ranges[1], ranges[2], grain, tuning) +
               at_the_end(ranges[last], ranges[last - 1], ranges[last - 2], grain, tuning);
    }
    return both * std::sin(0.5 * angle);
}

}  // namespace

Face face_of(const Cloud& cloud, double right, double left, double pixel, double blur,
             double alike, const FaceTuning& tuning) {
    const double columns = std::max(1.0, (left - right) / pixel);
    const int groups = std::min(std::max(static_cast<int>(std::floor(columns / 4)), 1), 13);
    const double step = (left - right) / groups;
    Values ranges, bearings, counts, all;
    const std::vector<Direction> each = cloud.directions(right, left, groups, tuning.near);
    for (const Direction& direction : each) all.push_back(direction.count);
    const double least = 0.25 * middle_of(all);
    for (int k = 0; k < groups; ++k) {
        const auto& [count, near, middle] = each[k];
        if (!(count > least)) continue;
        ranges.push_back(std::min(middle, near + tuning.leans * blur * near * near));
        bearings.push_back(right + (k + 0.5) * step);
        counts.push_back(count);
    }
    // where noise reaches farther than the next direction, wrong matches make dents
    if (blur * middle_of(ranges) > step) ranges = without_dents(ranges, tuning.sharpest);
    ranges = smoothed(ranges);
    const auto nearest =
        static_cast<int>(std::min_element(ranges.begin(), ranges.end()) - ranges.begin());
    const auto [range_right, range_left] = ends(ranges, bearings, right, left, tuning);
    const double distance = ranges[nearest] - to_the_point(ranges, nearest, tuning.sharpest);
    const double share = std::sqrt(alike / std::max(counts[nearest], alike));
    return {range_right,
            range_left,
            chord(ranges, left - right, blur * distance * distance * share, tuning),
            distance,
            bearings[nearest],
            counts[nearest]};
}

}  // namespace bearcub
