#include "fit.h"

#include <limits>

namespace bearcub {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNowhere = 1e9;  // above any plane: neither on it nor below
constexpr int kLanes = 8;  // sums that go on side by side

struct Pixel {
    double u, v, d;
    double aside, bumps;
};

struct Proposal {
    Plane plane;
    double belief;
    double score;
};

// Pixels that proposals are scored on, whole groups of them.
struct Scored {
    std::vector<float> u, v, d, per_noise, aside;

    void clear() {
        for (auto* each : {&u, &v, &d, &per_noise, &aside}) each->clear();
    }
    void add(double at_u, double at_v, double disparity, double precision, double weight) {
        u.push_back(static_cast<float>(at_u));
        v.push_back(static_cast<float>(at_v));
        d.push_back(static_cast<float>(disparity));
        per_noise.push_back(static_cast<float>(precision));
        aside.push_back(static_cast<float>(weight));
    }
};

struct Scratch {
    Scored scored;
    std::vector<Pixel> pixels;
    std::vector<int> candidates;  // pixels that climb with the row as a floor does
    std::vector<Proposal> proposals;
    std::vector<double> values, weight, histogram;
};

Plane plane_of(const Lens& lens, double height, double pitch, double roll) {
    const double scale = lens.baseline / height, across = std::cos(pitch);
    const double a = scale * std::sin(roll) * across;
    const double b = scale * std::cos(roll) * across * lens.fx / lens.fy;
    return {a, b, scale * std::sin(pitch) * lens.fx - a * lens.cx - b * lens.cy};
}

// The direction down to a plane in optical axes, as long as the baseline is over the height.
struct Down {
    double x, y, z;

    Down(const Plane& plane, const Lens& lens)
        : x(plane.a),
          y(plane.b * lens.fy / lens.fx),
          z((plane.c + plane.a * lens.cx + plane.b * lens.cy) / lens.fx) {}
    double length() const { return std::sqrt(std::max(x * x + y * y + z * z, 1e-24)); }
};

// How far a plane is from the expected one, z squared; negative beyond the gates.
double remoteness(const Plane& plane, const Lens& lens, const Expected& expected) {
    const Down down(plane, lens);
    const auto [x, y, z] = down;
    const double across = x * x + y * y, norm = down.length();
    const double log_height = std::log(lens.baseline / expected.height / norm);
    const double pitch = std::atan2(z, std::sqrt(across)) - expected.pitch;
    const double roll = std::atan2(x, y) - expected.roll;
    if (std::abs(log_height) >= std::log(expected.gate_height) ||
        std::abs(pitch) >= expected.gate_pitch || std::abs(roll) >= expected.gate_roll) {
        return -1.0;
    }
    const double share = std::max(expected.sigma_height / expected.height, 0.05);
    const double zs[] = {log_height / share, pitch / expected.sigma_pitch,
                         roll / expected.sigma_roll};
    return zs[0] * zs[0] + zs[1] * zs[1] + zs[2] * zs[2];
}

// Takes a regular grid of measured pixels; returns the area of the grid [px].
double sample(const Disparity& map, const Lens& lens, const Expected& expected,
              const FitTuning& tuning, int stride, Scratch& scratch) {
    const int reach = std::max(4, map.rows / 40), first = stride / 2;
    const auto per_row = static_cast<float>(0.5 / reach);
    const double climb = lens.baseline / expected.height;
    const auto least = static_cast<float>(0.3 * climb), most = static_cast<float>(3.0 * climb);
    scratch.pixels.clear();
    scratch.candidates.clear();
    int count = 0;
    for (int v = reach; v < map.rows - reach; v += stride) {
        for (int u = first; u < map.columns; u += stride) {
            ++count;
            const float d = map.at(v, u);
            if (!(d > 0)) continue;
            const float rise = (map.at(v + reach, u) - map.at(v - reach, u)) * per_row;
            if (rise > least && rise < most) {
                scratch.candidates.push_back(static_cast<int>(scratch.pixels.size()));
            }
            const double lateral = (u - lens.cx) * (lens.baseline / tuning.half_width) / d;
            scratch.pixels.push_back({double(u), double(v), d, 1 / (1 + lateral * lateral), 0});
        }
    }
    return static_cast<double>(count) * stride * stride;
}

void propose(const Plane& plane, const Lens& lens, const Expected& expected,
             const FitTuning& tuning, Scratch& scratch) {
    const double far = remoteness(plane, lens, expected);
    if (far >= 0) scratch.proposals.push_back({plane, 1 / (1 + tuning.remote * far), 0});
}

// Proposes the prior's plane, some inclined about it, and planes through triples of pixels.
void propose_all(double area, const Lens& lens, const Expected& expected, const FitTuning& tuning,
                 Scratch& scratch) {
    scratch.proposals.clear();
    for (const double pitch : tuning.steps) {
        for (const double roll : tuning.steps) {
            propose(plane_of(lens, expected.height, expected.pitch + pitch, expected.roll + roll),
                    lens, expected, tuning, scratch);
        }
    }
    const std::size_t count = scratch.candidates.size(), triples = tuning.draws.size() / 3;
    if (count < 30) return;
    for (std::size_t i = 0; i < triples; ++i) {
        const Pixel* p[3];
        for (int k = 0; k < 3; ++k) {
            const auto pick = static_cast<std::size_t>(tuning.draws[k * triples + i] * count);
            p[k] = &scratch.pixels[scratch.candidates[pick]];
        }
        const double u1 = p[1]->u - p[0]->u, v1 = p[1]->v - p[0]->v, d1 = p[1]->d - p[0]->d;
        const double u2 = p[2]->u - p[0]->u, v2 = p[2]->v - p[0]->v, d2 = p[2]->d - p[0]->d;
        const double twice = u1 * v2 - u2 * v1;
        if (!(std::abs(twice) > 0.02 * area)) continue;
        const double a = (d1 * v2 - d2 * v1) / twice, b = (u1 * d2 - u2 * d1) / twice;
        propose({a, b, p[0]->d - a * p[0]->u - b * p[0]->v}, lens, expected, tuning, scratch);
    }
}

// Counts the pixels on a plane, less a share of those below it; the floor just ahead counts most:
// what lies beyond or beside may be another one.
BEARCUB_WIDE
double support(const Plane& plane, const Scored& scored, double nearest, double below) {
    const auto a = static_cast<float>(plane.a), b = static_cast<float>(plane.b);
    const auto c = static_cast<float>(plane.c), cost = static_cast<float>(below);
    const auto closer = static_cast<float>(1 / nearest);
    float total[kLanes] = {};
    for (std::size_t i = 0; i < scored.d.size(); i += kLanes) {
        for (int k = 0; k < kLanes; ++k) {
            const float floor = a * scored.u[i + k] + b * scored.v[i + k] + c;
            const float residual = (scored.d[i + k] - floor) * scored.per_noise[i + k];
            const float close = std::min(std::max(floor * closer, 0.0f), 1.0f) * scored.aside[i + k];
            const float here = std::max(1.0f - residual * residual, 0.0f);
            total[k] += close * (here - (residual < -1.5f ? cost : 0.0f));
        }
    }
    double sum = 0;
    for (const float each : total) sum += each;
    return sum;
}

// Takes every `step`-th pixel, and fills the last group up with some that count for nothing.
void take(const std::vector<Pixel>& pixels, std::size_t step, double bump, Scored& scored) {
    scored.clear();
    for (std::size_t i = 0; i < pixels.size(); i += step) {
        const Pixel& p = pixels[i];
        scored.add(p.u, p.v, p.d, 1 / (0.6 + bump * p.d), p.aside);
    }
    while (scored.d.size() % kLanes) scored.add(0, 0, kNowhere, 1, 0);
}

// Returns the plane that most pixels and the prior support; all run on few pixels, the better ones
// again on many.
const Proposal* best(double bump, const FitTuning& tuning, Scratch& scratch) {
    std::vector<Proposal>& proposals = scratch.proposals;
    if (proposals.empty()) return nullptr;
    scratch.values.clear();
    for (const Pixel& pixel : scratch.pixels) scratch.values.push_back(pixel.d);
    const double nearest = quantile(scratch.values, 0.98);
    const auto higher = [](const Proposal& a, const Proposal& b) { return a.score > b.score; };
    const auto rate = [&](int count) {
        const std::size_t step = std::max<std::size_t>(1, scratch.pixels.size() / count);
        take(scratch.pixels, step, bump, scratch.scored);
        for (Proposal& p : proposals) {
            p.score = p.belief * support(p.plane, scratch.scored, nearest, tuning.below);
        }
    };
    rate(tuning.scored / 5);
    const auto finalists = static_cast<std::size_t>(tuning.finalists);
    if (proposals.size() > finalists) {
        std::nth_element(proposals.begin(), proposals.begin() + finalists, proposals.end(), higher);
        proposals.resize(finalists);
    }
    rate(tuning.scored);
    const auto first = std::min_element(proposals.begin(), proposals.end(), higher);
    return first->score > 0 ? &*first : nullptr;
}

// Solves a symmetric system of three; false where it is singular.
bool solve(double m[3][3], const double right[3], Plane& found) {
    const double c0 = m[1][1] * m[2][2] - m[1][2] * m[2][1];
    const double c1 = m[1][2] * m[2][0] - m[1][0] * m[2][2];
    const double c2 = m[1][0] * m[2][1] - m[1][1] * m[2][0];
    const double determinant = m[0][0] * c0 + m[0][1] * c1 + m[0][2] * c2;
    if (!(std::abs(determinant) > 0)) return false;
    const double by = 1 / determinant;
    found.a = by * (right[0] * c0 + right[1] * (m[0][2] * m[2][1] - m[0][1] * m[2][2]) +
                    right[2] * (m[0][1] * m[1][2] - m[0][2] * m[1][1]));
    found.b = by * (right[0] * c1 + right[1] * (m[0][0] * m[2][2] - m[0][2] * m[2][0]) +
                    right[2] * (m[0][2] * m[1][0] - m[0][0] * m[1][2]));
    found.c = by * (right[0] * c2 + right[1] * (m[0][1] * m[2][0] - m[0][0] * m[2][1]) +
                    right[2] * (m[0][0] * m[1][1] - m[0][1] * m[1][0]));
    return true;
}

// The weighted median of the values that were counted, to a hundredth.
double weighted_median(const std::vector<double>& histogram) {
    double total = 0;
    for (const double each : histogram) total += each;
    double sum = 0;
    std::size_t bin = 0;
    while (bin + 1 < histogram.size() && (sum += histogram[bin]) < 0.5 * total) ++bin;
    return 0.01 * (static_cast<double>(bin) + 0.5);
}

// Leaves the pixels near ahead; returns the nearest level at which floor is seen.
double keep_near(const Plane& plane, double scale, const FitTuning& tuning, Scratch& scratch) {
    scratch.values.clear();
    for (const Pixel& p : scratch.pixels) {
        const double floor = plane.at(p.u, p.v), residual = p.d - floor;
        const bool on = residual * residual < 9.0 * (p.bumps + scale * scale);
        if (on && floor > 0) scratch.values.push_back(floor);
    }
    const double nearest = scratch.values.empty() ? kInfinity : quantile(scratch.values, 0.98);
    const double least = tuning.whole * tuning.near * nearest;
    const auto far = [&](const Pixel& p) { return !(plane.at(p.u, p.v) > least); };
    auto& pixels = scratch.pixels;
    pixels.erase(std::remove_if(pixels.begin(), pixels.end(), far), pixels.end());
    return nearest;
}

// One step of re-weighted least squares: the weights of all pixels, the plane that they make, and how
// often which residual was there. False where there are too few or they lie on a line.
BEARCUB_WIDE
bool step(Plane& plane, double scale, double nearest, const FitTuning& tuning, Scratch& scratch) {
    const std::size_t count = scratch.pixels.size();
    scratch.weight.resize(count);
    double most = 0;
    for (const Pixel& p : scratch.pixels) most = std::max(most, p.bumps);
    most = tuning.biweight * std::sqrt(most + scale * scale);
    scratch.histogram.assign(static_cast<std::size_t>(100 * most) + 2, 0.0);
    const double widest = tuning.biweight * tuning.biweight;
    const double least = tuning.near * nearest, closer = 1 / (tuning.close * nearest);
    double m[3][3] = {}, right[3] = {};
    int inside = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const Pixel& p = scratch.pixels[i];
        const double floor = plane.at(p.u, p.v);
        const double residual = p.d - floor, precision = 1 / (p.bumps + scale * scale);
        const double off = residual * residual * precision;
        scratch.weight[i] = 0;
        if (!(off < widest && floor > least)) continue;
        ++inside;
        scratch.histogram[static_cast<std::size_t>(100 * std::abs(residual))] += p.aside;
        double weight = (1 - off * (1 / widest)) * std::min(floor * closer, 1.0);
        weight *= weight * p.aside;
        scratch.weight[i] = weight;
        weight *= precision;
        const double wu = weight * p.u, wv = weight * p.v;
        m[0][0] += wu * p.u;
        m[0][1] += wu * p.v;
        m[0][2] += wu;
        m[1][1] += wv * p.v;
        m[1][2] += wv;
        m[2][2] += weight;
        right[0] += wu * p.d;
        right[1] += wv * p.d;
        right[2] += weight * p.d;
    }
    m[1][0] = m[0][1], m[2][0] = m[0][2], m[2][1] = m[1][2];
    return inside >= 30 && solve(m, right, plane);
}

// What the plane's uncertainty follows from.
void summarise(double nearest, const FitTuning& tuning, const Scratch& scratch, Fit& fit) {
    for (std::size_t i = 0; i < scratch.pixels.size(); ++i) {
        const Pixel& p = scratch.pixels[i];
        const double floor = fit.plane.at(p.u, p.v);
        const double residual = p.d - floor, variance = p.bumps + fit.noise * fit.noise;
        if (floor > tuning.near * nearest) {
            ++fit.here;
            if (residual * residual < 9.0 * variance) {
                ++fit.on;
            } else if (residual > 0) {
                ++fit.above;
            }
        }
        const double weight = scratch.weight[i] / variance;
        const double at[] = {p.u, p.v, 1.0};
        for (int j = 0; j < 3; ++j) {
            for (int k = 0; k < 3; ++k) fit.normal[j][k] += weight * at[j] * at[k];
        }
    }
}

// Sharpens a proposed plane on all pixels of the grid that lie near ahead.
std::optional<Fit> refine(Plane plane, const Lens& lens, const Expected& expected, double bump,
                          const FitTuning& tuning, Scratch& scratch) {
    for (Pixel& p : scratch.pixels) {
        p.bumps = (0.5 * bump * p.d) * (0.5 * bump * p.d);
    }
    double scale = tuning.anneal;
    const double nearest = keep_near(plane, scale, tuning, scratch);
    for (int number = 1; number <= tuning.most_steps; ++number) {
        const Plane before = plane;
        if (!step(plane, scale, nearest, tuning, scratch)) return std::nullopt;
        double moved = 0;
        for (std::size_t i = 0; i < scratch.pixels.size(); i += tuning.few) {
            const Pixel& p = scratch.pixels[i];
            moved = std::max(moved, std::abs(plane.at(p.u, p.v) - before.at(p.u, p.v)));
        }
        scale = 1.4826 * weighted_median(scratch.histogram);
        scale = std::min(std::max(scale, tuning.least_noise), tuning.most_noise);
        if (number >= tuning.least_steps && moved < tuning.settled) break;
    }
    if (remoteness(plane, lens, expected) < 0) return std::nullopt;
    Fit fit{};
    fit.plane = plane;
    fit.noise = scale;
    summarise(nearest, tuning, scratch, fit);
    return fit;
}

}  // namespace

std::optional<Fit> fit_plane(const Disparity& map, const Lens& lens, const Expected& expected,
                             double unevenness, const FitTuning& tuning) {
    Scratch& scratch = of_this_thread<Scratch>();
    const double each = static_cast<double>(map.rows) * map.columns / tuning.refined;
    const int stride = std::max(1, static_cast<int>(std::sqrt(each)));
    const double area = sample(map, lens, expected, tuning, stride, scratch);
    if (scratch.pixels.size() < 50) return std::nullopt;
    propose_all(area, lens, expected, tuning, scratch);
    const Proposal* const found = best(unevenness / expected.height, tuning, scratch);
    if (found == nullptr) return std::nullopt;
    const Plane plane = found->plane;
    const double bump = unevenness * Down(plane, lens).length() / lens.baseline;
    std::optional<Fit> fit = refine(plane, lens, expected, bump, tuning, scratch);
    if (fit) fit->stride = stride;
    return fit;
}

}  // namespace bearcub
