#include "profile.h"

#include <cstdint>
#include <cstring>
#include <limits>
#include <tuple>
#include <utility>

namespace bearcub {
namespace {

// Some of a bin's residuals, ascending.
struct Residuals {
    const float* first;
    int count;

    float operator[](int i) const { return first[i]; }
    int below(double x) const {  // how many are less
        return static_cast<int>(std::lower_bound(first, first + count, x) - first);
    }
    int up_to(double x) const {  // how many are not larger
        return static_cast<int>(std::upper_bound(first, first + count, x) - first);
    }
    // Those strictly between two values.
    std::pair<int, int> between(double low, double high) const { return {up_to(low), below(high)}; }
    std::pair<int, int> from_to(double low, double high) const { return {below(low), up_to(high)}; }
};

struct Entry {
    uint32_t key;  // the residual's bits, in the order of the numbers
    uint16_t bin;
    // on the way ahead; every second one; nearer with the row, as ground is
    uint8_t way, half, lying;
};

// The residuals of one bin after another.
struct Bins {
    std::vector<float> values;
    std::vector<int> ends;

    void clear(int count) {
        values.clear();
        ends.assign(count, 0);
    }
    void end(int bin) { ends[bin] = static_cast<int>(values.size()); }
    Residuals operator[](int bin) const {
        const int first = bin ? ends[bin - 1] : 0;
        return {values.data() + first, ends[bin] - first};
    }
};

struct Scratch {
    std::vector<double> levels;
    std::vector<float> residuals;
    std::vector<uint8_t> way, lying;
    std::vector<double> edges, sorted_levels;
    std::vector<int> starts;  // the first bin that a level can be in, by fractions of a pixel
    std::vector<Entry> entries, other;
    Bins here, ahead, lying_here, lying_ahead;
};

uint32_t to_key(float x) {
    uint32_t bits;
    std::memcpy(&bits, &x, sizeof bits);
    return bits & 0x80000000u ? ~bits : bits | 0x80000000u;
}

float from_key(uint32_t key) {
    const uint32_t bits = key & 0x80000000u ? key & 0x7fffffffu : ~key;
    float x;
    std::memcpy(&x, &bits, sizeof x);
    return x;
}

template <class Digit>
void pass(std::vector<Entry>& from, std::vector<Entry>& to, Digit digit) {
    uint32_t counts[2048] = {};
    for (const Entry& entry : from) ++counts[digit(entry)];
    uint32_t start = 0;
    for (uint32_t& count : counts) start += std::exchange(count, start);
    for (const Entry& entry : from) to[counts[digit(entry)]++] = entry;
    from.swap(to);
}

// Sorts by bin, then residual.
void sort(std::vector<Entry>& entries, std::vector<Entry>& other) {
    other.resize(entries.size());
    pass(entries, other, [](const Entry& e) { return e.key & 2047; });
    pass(entries, other, [](const Entry& e) { return e.key >> 11 & 2047; });
    pass(entries, other, [](const Entry& e) { return e.key >> 22; });
    pass(entries, other, [](const Entry& e) { return e.bin; });
}

// Tells where disparity grows with the row at least as it does on the steepest ground there.
// The pixel's own has no say: what errs to the far side would seem to grow.
class Climb {
public:
    Climb(const Disparity& map, const JustAhead& start, double depth, const ProfileTuning& tuning)
        : map_(map),
          reach_(std::max(4, map.rows / tuning.reach)),
          rate_(start.plane.b * start.height * std::hypot(1.0, start.steepest)),
          height_(start.height),
          rise_(start.steepest * depth) {}

    bool lies(int v, int u, double level) const {
        float upper = at(v - reach_, u), lower = at(v + reach_, u);
        const bool both = std::isfinite(upper) && std::isfinite(lower);
        if (!std::isfinite(upper)) {
            upper = lower;
            lower = at(v + 2 * reach_, u);
        } else if (!both) {
            lower = upper;
            upper = at(v - 2 * reach_, u);
        }
        return (lower - upper) * (height_ * level + rise_) > (both + 1) * reach_ * rate_ * level;
    }

private:
    float at(int v, int u) const {
        return v >= 0 && v < map_.rows ? map_.at(v, u) : std::numeric_limits<float>::quiet_NaN();
    }

    const Disparity& map_;
    const int reach_;
    const double rate_, height_, rise_;
};

// Takes a grid of pixels on or about the floor; returns the share of them that is measured.
double sample(const Disparity& map, const Lens& lens, const JustAhead& start, double depth,
              const ProfileTuning& tuning, Scratch& scratch) {
    const Plane& plane = start.plane;
    const Climb climb(map, start, depth, tuning);
    const int down = std::max(1, map.rows / tuning.rows);
    const int right = std::max(1, map.columns / tuning.columns);
    scratch.levels.clear();
    scratch.residuals.clear();
    scratch.way.clear();
    scratch.lying.clear();
    int ahead = 0;
    for (int v = down / 2; v < map.rows; v += down) {
        for (int u = right / 2; u < map.columns; u += right) {
            const double level = plane.b * v + (plane.a * u + plane.c);
            if (!(level > tuning.farthest)) continue;
            ++ahead;
            const float d = map.at(v, u);
            if (!std::isfinite(d)) continue;
            const double lateral = (u - lens.cx) * lens.baseline / level;
            const double residual = std::min(std::max(d - level, -tuning.most), tuning.most);
            scratch.levels.push_back(level);
            scratch.residuals.push_back(static_cast<float>(residual));
            const bool way = std::abs(lateral) < tuning.half_width;
            const bool asked = way || scratch.levels.size() % 2 == 1;  // see sort_bins
            scratch.way.push_back(way);
            scratch.lying.push_back(asked && climb.lies(v, u, level));
        }
    }
    return std::max<double>(1, scratch.levels.size()) / std::max(1, ahead);
}

// The edges of the bins, ascending: narrow near ahead, where steps are seen.
void lay_bins(double nearest, const ProfileTuning& tuning, std::vector<double>& edges) {
    const double knee = std::min(tuning.knee, nearest / tuning.far_bin);
    const double to_knee = std::log(knee / tuning.farthest), beyond = std::log(nearest / knee);
    const int near = std::min(
        std::max(static_cast<int>(beyond / std::log(tuning.near_bin)), 4), tuning.near_bins);
    const int far =
        std::max(1, static_cast<int>(std::nearbyint(to_knee / std::log(tuning.far_bin))));
    edges.clear();
    for (int i = 0; i < far; ++i) edges.push_back(i * (to_knee / far));
    for (int i = 0; i <= near; ++i) edges.push_back(to_knee + i * (beyond / near));
    for (double& edge : edges) edge = tuning.farthest * std::exp(edge);
}

// Sorts the residuals of every bin: half of all for the noise, those of the way for the floor,
// and of these once more what lies.
void sort_bins(Scratch& scratch) {
    constexpr double kSteps = 8;
    const std::vector<double>& edges = scratch.edges;
    const int count = static_cast<int>(edges.size()) - 1;
    scratch.starts.clear();
    int bin = 0;
    for (int i = 0; i <= edges.back() * kSteps; ++i) {
        while (bin < count && edges[bin + 1] < i / kSteps) ++bin;
        scratch.starts.push_back(bin);
    }
    scratch.entries.clear();
    for (std::size_t i = 0; i < scratch.levels.size(); ++i) {
        const double level = scratch.levels[i];
        if (level > edges.back() || (i % 2 && !scratch.way[i])) continue;
        bin = scratch.starts[static_cast<int>(level * kSteps)];
        while (edges[bin + 1] < level) ++bin;
        scratch.entries.push_back({to_key(scratch.residuals[i]), static_cast<uint16_t>(bin),
                                   scratch.way[i], static_cast<uint8_t>(i % 2 == 0),
                                   scratch.lying[i]});
    }
    sort(scratch.entries, scratch.other);
    for (Bins* bins : {&scratch.here, &scratch.ahead, &scratch.lying_here, &scratch.lying_ahead}) {
        bins->clear(count);
    }
    std::size_t i = 0;
    for (bin = 0; bin < count; ++bin) {
        for (; i < scratch.entries.size() && scratch.entries[i].bin == bin; ++i) {
            const Entry& entry = scratch.entries[i];
            const float residual = from_key(entry.key);
            if (entry.half) scratch.here.values.push_back(residual);
            if (entry.way) scratch.ahead.values.push_back(residual);
            if (entry.half && entry.lying) scratch.lying_here.values.push_back(residual);
            if (entry.way && entry.lying) scratch.lying_ahead.values.push_back(residual);
        }
        scratch.here.end(bin);
        scratch.ahead.end(bin);
        scratch.lying_here.end(bin);
        scratch.lying_ahead.end(bin);
    }
}

// Where the profile is while it is followed outwards.
class Tracker {
public:
    Tracker(const JustAhead& start, double depth, const ProfileTuning& tuning)
        : tuning_(tuning),
          height_(start.height),
          depth_(depth),
          steepest_(start.steepest),
          noise_(start.noise),
          tail_(start.noise) {}

    bool ended = false;
    double share = 1.0;  // of the last bin's pixels that lay on the profile
    int regained = 0;  // bins that turned out to be ground beyond a step, the last one included
    int refused = 0;  // ... to be of a bank

    // Moves on to the next bin; returns the floor's disparity there less the plane's.
    double advance(double level, Residuals way, Residuals lying) {
        const double expected = bend_at(level);
        if (ended) {
            look_beyond(level, way);
            return bend_at(level);
        }
        ++bins_up_;
        const double x = depth_ / (level + expected);
        const double rise = started_ ? steepest_ * std::max(0.0, x - x_) : 0.0;
        const double reach = 3.0 * noise_;
        const double least = std::max<double>(tuning_.least / 2, tuning_.share * way.count);
        // what goes on as before is the floor, however much stands beside it
        auto [first, last] = way.between(expected - reach, expected + reach);
        if (last - first < least) {
            const double low = bend(level, lift_ - rise) - reach;
            const double high = bend(level, lift_ + rise) + reach;
            std::tie(first, last) = way.between(low, high);
            if (last - first < least) {
                // a step takes most of the way off the floor, to one side
                const double most = (1 - tuning_.share) * way.count;
                ended = way.below(high) < way.count - most || way.up_to(low) > most;
                share = std::max(0.1, static_cast<double>(last - first) / way.count);
                return expected;
            }
        }
        // what stands there is no ground, and where nothing lies nothing tells how it goes on
        std::tie(first, last) = lying.from_to(way[first], way[last - 1]);
        if (last - first < tuning_.least / 2) {
            share = std::max(0.1, static_cast<double>(last - first) / way.count);
            return expected;
        }
        for (int i = 0; i < 2; ++i) {  // to the middle of that surface
            const double middle = lying[(first + last) / 2];
            std::tie(first, last) = lying.between(middle - reach, middle + reach);
        }
        const int count = last - first;
        share = std::max(0.1, static_cast<double>(count) / way.count);
        const double spread = spread_of(lying, first, last);
        const auto [lift, there] = place(level, lying[(first + last) / 2]);
        settle(level, lift, there, spread, count, rise);
        return bend_at(level);
    }

    double bend_at(double level) const { return bend(level, lift_); }

    // The noise told by the pixels below the floor; the last one when few do.
    double spread(Residuals here, double bend) {
        if (ended) return tail_;  // what lies below is another floor, not noise
        // what lies many times the noise lower is a hole
        const double lowest =
            bend - std::min(std::max(tuning_.deep * noise_, 1.0), 3 * tuning_.largest);
        const int first = here.up_to(lowest), last = here.below(bend - tuning_.rounding);
        if (last - first >= std::max<double>(tuning_.least / 2, 0.1 * here.count)) {
            // matchers' errors have heavy tails
            const int rank = first + static_cast<int>(0.05 * (last - first - 1) + 0.5);
            const double tail = (bend - here[rank]) / 1.96;
            tail_ = std::min(std::max(tail, tuning_.smallest), tuning_.noisiest);
        }
        return tail_;
    }

private:
    // Takes a bin's surface for the floor, unless it is a step away.
    void settle(double level, double lift, double there, double spread, int count, double rise) {
        // a spread far beyond the noise so far is of several surfaces, and excuses no climb
        const double noise = std::min(spread, 1.5 * noise_);
        const double doubt = height_ * noise / level * std::sqrt(tuning_.correlated / count);
        double change = lift - lift_;
        if (started_) {
            const double climb = steepest_ * std::max(0.0, there - x_);
            // the same noise is of less height, and of less way, where ground is nearer
            const double flat = there * level / depth_;
            const double along = steepest_ * depth_ / (height_ * level);
            const double less = std::min(1.0, (1 + along) * (flat * flat));
            const double most = climb + 2 * doubt * less + tuning_.step;
            if (change < -most) {
                ended = true;
                return;
            }
            if (excess_ + change > most) {
                back_to_the_foot();
                return;
            }
            // what a few far pixels say is weighed against how much ground changes over the bin
            // ... where it falls, by how much height the noise is as far away as that
            const double farther = std::max(1.0, flat);
            const double ratio = doubt * farther * farther / (0.5 * (rise + tuning_.step));
            change *= 1 / (1 + ratio * ratio);
            excess_ += change - climb;
        }
        if (excess_ <= 0) {
            excess_ = 0;
            foot_ = lift_ + change;
            bins_up_ = 0;
        }
        noise_ = 0.7 * noise_ +
                 0.3 * std::min(std::max(spread, tuning_.smallest), tuning_.largest);
        lift_ += change;
        x_ = started_ ? std::max(x_, there) : there;
        started_ = true;
    }

    // Ends the floor where it began to climb more than it may, summed over the bins since: a bank
    // rises by no more in one of them than noise does.
    void back_to_the_foot() {
        ended = true;
        refused = bins_up_;
        lift_ = foot_;
    }

    // Goes on where the way lies on one level again beyond a step up: stairs, a pavement.
    void look_beyond(double level, Residuals way) {
        const auto [lift, there] = place(level, way[way.count / 2]);
        const auto [last_lift, last_there] =
            upper_.empty() ? std::pair(lift, 0.0) : upper_.back();
        const double doubt =
            2 * height_ * noise_ / level * std::sqrt(tuning_.correlated / way.count);
        const bool above =
            lift_ + tuning_.step < lift && lift < tuning_.highest_step * height_;
        if (!above || spread_of(way, 0, way.count) > tuning_.mixed * noise_) {
            upper_.clear();
        } else {
            if (std::abs(lift - last_lift) > doubt + tuning_.step || there <= last_there) {
                upper_.clear();
            }
            upper_.emplace_back(lift, there);
        }
        if (static_cast<int>(upper_.size()) < tuning_.again) return;
        regained = static_cast<int>(upper_.size());
        double sum = 0;
        for (const auto& each : upper_) sum += each.first;
        lift_ = sum / regained;
        x_ = there;
        started_ = true;
        upper_.clear();
        ended = false;
    }

    // The height above the plane and the range of ground with this bend.
    std::pair<double, double> place(double level, double bend) const {
        const double disparity = std::max(level + bend, 0.1);
        return {height_ * bend / disparity, depth_ / disparity};
    }

    // The extra disparity of ground that lies `lift` above the plane.
    double bend(double level, double lift) const {
        return level * lift / std::max(height_ - lift, 0.05 * height_);
    }

    double spread_of(Residuals values, int first, int last) const {
        const int count = last - first;
        return tuning_.iqr * (values[first + 3 * count / 4] - values[first + count / 4]);
    }

    const ProfileTuning& tuning_;
    const double height_, depth_, steepest_;
    double noise_, tail_;
    double lift_ = 0.0;  // height of the profile above the plane [m]
    double x_ = 0.0;
    bool started_ = false;
    double foot_ = 0.0, excess_ = 0.0;  // height where it began to climb too steeply; so far
    int bins_up_ = 0;                   // since there
    std::vector<std::pair<double, double>> upper_;  // height and range of ground beyond a step up
};

}  // namespace

Followed follow_floor(const Disparity& map, const Lens& lens, const JustAhead& start,
                      const ProfileTuning& tuning) {
    Scratch& scratch = of_this_thread<Scratch>();
    Followed followed{{}, {0}, 0.0};
    const double depth = lens.fx * lens.baseline / std::cos(start.pitch);
    const double share = sample(map, lens, start, depth, tuning, scratch);
    if (static_cast<int>(scratch.levels.size()) < 10 * tuning.least) return followed;
    scratch.sorted_levels = scratch.levels;
    lay_bins(quantile(scratch.sorted_levels, 0.995) + 1e-6, tuning, scratch.edges);
    sort_bins(scratch);
    Tracker tracker(start, depth, tuning);
    std::vector<Bin>& bins = followed.bins;
    for (int bin = static_cast<int>(scratch.edges.size()) - 2; bin >= 0; --bin) {
        const Residuals here = scratch.here[bin], ahead = scratch.ahead[bin];
        if (here.count < tuning.least) continue;
        double centre = std::sqrt(scratch.edges[bin] * scratch.edges[bin + 1]);
        const double bend =
            ahead.count >= tuning.least
                ? tracker.advance(centre, ahead, scratch.lying_ahead[bin])
                : tracker.advance(centre, here, scratch.lying_here[bin]);
        const double spread = tracker.spread(here, bend);
        // where little of the floor is seen, what is seen errs together
        const double error = spread / (share * tracker.share * tracker.share) *
                             std::sqrt(tuning.correlated / here.count);
        bins.push_back({centre, bend, spread, error});
        if (tracker.regained) {
            followed.parts.push_back(static_cast<int>(bins.size()) - tracker.regained);
            for (std::size_t i = followed.parts.back(); i < bins.size(); ++i) {
                bins[i].bend = tracker.bend_at(bins[i].level);
                bins[i].spread = spread;
            }
            tracker.regained = 0;
        }
        if (tracker.refused) {
            const std::size_t foot = bins.size() - tracker.refused;
            for (std::size_t i = foot; i < bins.size(); ++i) {
                bins[i].bend = tracker.bend_at(bins[i].level);
            }
            centre = bins[foot].level;
            tracker.refused = 0;
        }
        followed.end = tracker.ended ? (followed.end > 0 ? followed.end : centre) : 0.0;
    }
    return followed;
}

}  // namespace bearcub
