// The matcher's inner loops. This file is compiled once per instruction set.
//
// Nothing here may be shared between levels: functions of the standard library that the linker
// could take from another level's copy are avoided on purpose.
//
// [census] R. Zabih, J. Woodfill: Non-parametric local transforms for computing visual
//          correspondence, ECCV 1994.
// [sgm]    H. Hirschmüller: Stereo processing by semiglobal matching and mutual information, IEEE
//          TPAMI 30(2), 2008.
// [fit]    Q. Tian, M. N. Huhns: Algorithms for subpixel registration, Computer Vision, Graphics, and
//          Image Processing 35(2), 1986.
// [peak]   X. Hu, P. Mordohai: A quantitative evaluation of confidence measures for stereo vision,
//          IEEE TPAMI 34(11), 2012: the peak ratio.
#include "kernels.h"

#include <type_traits>

#include "simd.h"

namespace bearcub::BEARCUB_LEVEL {
namespace {

// ---- Preparing rows

// What a neighbour must exceed to count as brighter. Noise of a lone pixel would turn up in all its
// bits, and noise between equals in each: so this is the mean around the pixel, weighted 1 2 1
// either way, and one grey level more.
template <class Pixel>
void thresholds(Window<Pixel> rows, int width, Pixel* __restrict to) {
    constexpr int largest = static_cast<Pixel>(-1);
    const Pixel *__restrict above = rows[kReach - 1], *__restrict row = rows[kReach],
                *__restrict below = rows[kReach + 1];
    const auto column = [&](int x) { return above[x] + 2 * row[x] + below[x]; };
    for (int x = 0; x < width; ++x) {
        const int mean = (column(x - 1) + 2 * column(x) + column(x + 1)) / 16;
        to[x] = static_cast<Pixel>(smaller(mean + 1, largest));
    }
}

// [census]: bit by bit, is the neighbour brighter than the pixel's surroundings? Eight neighbours
// fill a plane. `scratch` holds a row.
template <class Pixel>
void census(Window<Pixel> rows, int width, Pixel* scratch, uint8_t* const* planes) {
    constexpr int side = 2 * kReach + 1, middle = side * side / 2;
    thresholds(rows, width, scratch);
    const Pixel* __restrict threshold = scratch;
    for (int plane = 0; plane < kPlanes; ++plane) {
        const Pixel* __restrict neighbour[8];
        for (int bit = 0; bit < 8; ++bit) {
            const int i = 8 * plane + bit, k = i + (i >= middle);
            neighbour[bit] = rows[k / side] + k % side - kReach;
        }
        uint8_t* __restrict to = planes[plane];
        for (int x = 0; x < width; ++x) {
            unsigned bits = 0;
            for (int bit = 0; bit < 8; ++bit) {
                bits |= static_cast<unsigned>(neighbour[bit][x] > threshold[x]) << bit;
            }
            to[x] = static_cast<uint8_t>(bits);
        }
    }
}

void four_times(const uint8_t* __restrict from, int width, uint32_t* __restrict to) {
    for (int x = 0; x < width; ++x) to[x] = from[x] * 0x01010101u;
}

void reversed(const uint8_t* __restrict from, int width, uint8_t* __restrict to) {
    for (int x = 0; x < width; ++x) to[x] = from[width - 1 - x];
}

// [sgm] (section 2.3): depth changes where grey does, so P2 is less there.
void penalties(const Tuning& tuning, const uint8_t* __restrict here,
               const uint8_t* __restrict there, int width, uint32_t* __restrict to) {
    const int large = tuning.large_step, least = tuning.least_step, slope = tuning.edge_discount;
    for (int x = 0; x < width; ++x) {
        const int change = here[x] > there[x] ? here[x] - there[x] : there[x] - here[x];
        to[x] = static_cast<uint32_t>(larger(least, large - (change * slope >> 2))) * 0x01010101u;
    }
}

// ---- Semi-global matching

// All disparities of a pixel.
template <int N>
struct Cell {
    Bytes v[N];
};

template <int N>
BEARCUB_INLINE Cell<N> load_cell(const uint8_t* p) {
    Cell<N> cell;
    for (int n = 0; n < N; ++n) cell.v[n] = load(p + n * Bytes::lanes);
    return cell;
}

template <int N>
BEARCUB_INLINE void store_cell(uint8_t* p, const Cell<N>& cell) {
    for (int n = 0; n < N; ++n) store(p + n * Bytes::lanes, cell.v[n]);
}

template <int N>
BEARCUB_INLINE Bytes lowest(const Cell<N>& cell) {
    Bytes low = cell.v[0];
    for (int n = 1; n < N; ++n) low = min(low, cell.v[n]);
    return low;
}

// Hamming distances of a left pixel's census from those of its candidates.
template <int N, bool edge>
BEARCUB_INLINE Cell<N> costs(const Block& block, int row, int x) {
    Cell<N> cost;
    for (int n = 0; n < N; ++n) {
        const ptrdiff_t from = ptrdiff_t{n} * Bytes::lanes - x;
        for (int plane = 0; plane < kPlanes; ++plane) {
            const Bytes bits = popcount(differing(splat4(block.left[row][plane][x]),
                                                  load_unaligned(block.right[row][plane] + from)));
            cost.v[n] = plane > 0 ? add(cost.v[n], bits) : bits;
        }
        if constexpr (edge) {
            const Bytes outside = load_unaligned(block.outside + from);
            cost.v[n] = max(cost.v[n], max(outside, load(block.padding + n * Bytes::lanes)));
        }
    }
    return cost;
}

// [sgm], equation 13: the cost of the best path that ends here, less its predecessor's least.
template <int N>
BEARCUB_INLINE Cell<N> step(const Cell<N>& from, Bytes least, const Cell<N>& cost, Bytes small_step,
                            Bytes large_step) {
    Cell<N> path;
    Bytes beside[N];
    lower_neighbour<N>(from.v, beside);
    for (int n = 0; n < N; ++n) {
        const Bytes near = min(from.v[n], add(beside[n], small_step));
        path.v[n] = add(min(subtract(near, least), large_step), cost.v[n]);
    }
    return path;
}

// The columns whose disparities all lie inside the right image.
struct Interior {
    int first, last;
};

Interior interior(const Block& block) {
    if (block.lanes != block.disparities) return {0, 0};
    const int first = clamped(block.smallest + block.lanes - 1, 0, block.width);
    return {first, larger(first, clamped(block.width + block.smallest, 0, block.width))};
}

// Call column(x, edge) for all, edge being a type that says whether x is outside that range.
template <class Column>
BEARCUB_INLINE void left_to_right(const Block& block, Column&& column) {
    const Interior inside = interior(block);
    for (int x = 0; x < inside.first; ++x) column(x, std::true_type{});
    for (int x = inside.first; x < inside.last; ++x) column(x, std::false_type{});
    for (int x = inside.last; x < block.width; ++x) column(x, std::true_type{});
}

template <int N>
void warm_up(const Block& block, int rows) {
    const Bytes small_step = splat(block.tuning.small_drop);
    for (int row = 0; row < rows; ++row) {
        left_to_right(block, [&](int x, auto edge) {
            uint8_t* at = block.vertical + ptrdiff_t{x} * block.lanes;
            const Cell<N> from = load_cell<N>(at);
            const Cell<N> cost = costs<N, decltype(edge)::value>(block, row, x);
            store_cell<N>(at, step<N>(from, min_across(lowest<N>(from)), cost, small_step,
                                      splat4(block.down[row][x])));
        });
    }
}

template <int N>
void forward(const Block& shared) {
    const Block block = shared;  // a copy, which no store of bytes can have changed
    const Bytes small_step = splat(block.tuning.small_step);
    Cell<N> path[kRows];
    for (auto& cell : path) {
        for (auto& bytes : cell.v) bytes = splat(0);
    }
    left_to_right(block, [&](int x, auto edge) {
        constexpr int cell = N * Bytes::lanes;
        uint8_t* to = block.paths + ptrdiff_t{x} * (2 * kRows * cell);
        Bytes least[kRows];
        for (int row = 0; row < kRows; ++row) least[row] = lowest<N>(path[row]);
        min_across4(least, least);
        for (int row = 0; row < kRows; ++row) {
            const Cell<N> cost = costs<N, decltype(edge)::value>(block, row, x);
            path[row] = step<N>(path[row], least[row], cost, small_step,
                                splat4(block.across[row][x]));
            store_cell<N>(to + 2 * row * cell, cost);
            store_cell<N>(to + (2 * row + 1) * cell, path[row]);
        }
    });
}

// 255 in the lanes around one, when read from `kMost - lane` on: on weak texture a minimum is broad.
constexpr int kBroad = 3;
struct Beside {
    alignas(64) uint8_t table[2 * kMost];
};
constexpr Beside kBeside = [] {
    Beside beside{};
    for (int i = -kBroad; i <= kBroad; ++i) beside.table[kMost + i] = 255;
    return beside;
}();

template <int N>
BEARCUB_INLINE int lane_of(const Cell<N>& sum, Bytes least) {
    constexpr int together = 64 / Bytes::lanes < N ? 64 / Bytes::lanes : N;
    for (int n = 0; n < N; n += together) {
        uint64_t bits = 0;
        for (int i = 0; i < together; ++i) {
            if (n + i < N) bits |= equal_bits(sum.v[n + i], least) << i * (Bytes::lanes % 64);
        }
        if (n + together >= N || bits != 0) return n * Bytes::lanes + __builtin_ctzll(bits);
    }
    return 0;  // never: some lane holds the least
}

// Winner takes all, in a few columns of all rows, and what the checks will ask for.
template <int N>
BEARCUB_INLINE void take_winners(const Block& block, int begin, int end) {
    constexpr int cell = N * Bytes::lanes;
    const uint8_t* sums = block.sums;
    uint8_t *__restrict lanes = block.lane, *__restrict bests = block.best,
            *__restrict before = block.before, *__restrict after = block.after;
    uint32_t* __restrict second = block.second;
    uint16_t* __restrict right_best = block.right_best + kRows * cell;
    for (int x = begin; x < end; ++x) {
        Bytes least[kRows], rest[kRows];
        for (int row = 0; row < kRows; ++row) {
            least[row] = lowest<N>(load_cell<N>(sums + row * cell));
        }
        min_across4(least, least);
        for (int row = 0; row < kRows; ++row, sums += cell) {
            const Cell<N> sum = load_cell<N>(sums);
            const int lane = lane_of<N>(sum, least[row]);
            Cell<N> others;
            for (int n = 0; n < N; ++n) {
                const uint8_t* beside = kBeside.table + kMost - lane + n * Bytes::lanes;
                others.v[n] = max(sum.v[n], load_unaligned(beside));
            }
            rest[row] = lowest<N>(others);
            const int best = sums[lane], at = kRows * x + row;
            lanes[at] = static_cast<uint8_t>(lane);
            bests[at] = static_cast<uint8_t>(best);
            before[at] = sums[lane - 1];
            after[at] = sums[lane + 1];
            uint16_t& right = right_best[at - kRows * lane];
            right = smaller(right, static_cast<uint16_t>(best << 8 | lane));
        }
        second[x] = min_each4(rest);
    }
}

// One column of paths from the right, added to those from the left.
template <int N>
BEARCUB_INLINE void step_left(const Block& block, int x, Bytes small_step, Cell<N>* path,
                              uint8_t* sums) {
    constexpr int cell = N * Bytes::lanes;
    const uint8_t* from = block.paths + ptrdiff_t{x} * (2 * kRows * cell);
    Bytes least[kRows];
    for (int row = 0; row < kRows; ++row) least[row] = lowest<N>(path[row]);
    min_across4(least, least);
    for (int row = 0; row < kRows; ++row) {
        path[row] = step<N>(path[row], least[row], load_cell<N>(from + 2 * row * cell), small_step,
                            splat4(block.across[row][x + 1]));
        Cell<N> sum = load_cell<N>(from + (2 * row + 1) * cell);
        for (int n = 0; n < N; ++n) sum.v[n] = add(sum.v[n], path[row].v[n]);
        store_cell<N>(sums + row * cell, sum);
    }
}

// All rows of four columns of paths from above, added to the others.
template <int N>
BEARCUB_INLINE void step_down(const Block& block, int x, Bytes small_step, uint8_t* sums) {
    constexpr int cell = N * Bytes::lanes;
    const uint8_t* cost = block.paths + ptrdiff_t{x} * (2 * kRows * cell);
    uint8_t* last = block.vertical + ptrdiff_t{x} * cell;
    Cell<N> path[4];
    for (int i = 0; i < 4; ++i) path[i] = load_cell<N>(last + i * cell);
    for (int row = 0; row < kRows; ++row) {
        Bytes least[4];
        for (int i = 0; i < 4; ++i) least[i] = lowest<N>(path[i]);
        min_across4(least, least);
        for (int i = 0; i < 4; ++i) {
            path[i] = step<N>(path[i], least[i], load_cell<N>(cost + 2 * (kRows * i + row) * cell),
                              small_step, splat4(block.down[row][x + i]));
            uint8_t* at = sums + (kRows * i + row) * cell;
            Cell<N> sum = load_cell<N>(at);
            for (int n = 0; n < N; ++n) sum.v[n] = add(sum.v[n], path[i].v[n]);
            store_cell<N>(at, sum);
        }
    }
    for (int i = 0; i < 4; ++i) store_cell<N>(last + i * cell, path[i]);
}

// Paths from the right and from above, the sum of all three, and its minimum, in one sweep: a few
// columns at a time, whose sums stay in the nearest cache. Of all path costs only those from the
// left are ever stored, and the row above's.
template <int N>
void backward(const Block& shared) {
    constexpr int column = kRows * N * Bytes::lanes;
    const Block block = shared;  // a copy, which no store of bytes can have changed
    const Bytes small_step = splat(block.tuning.small_step);
    const Bytes small_drop = splat(block.tuning.small_drop);
    Cell<N> path[kRows];
    for (auto& start : path) {
        for (auto& bytes : start.v) bytes = splat(0);
    }
    const int last = (block.width - 1) / kTogether * kTogether;
    for (int begin = last; begin >= 0; begin -= kTogether) {
        const int end = smaller(begin + kTogether, block.width);
        for (int x = end - 1; x >= begin; --x) {
            step_left<N>(block, x, small_step, path, block.sums + (x - begin) * column);
        }
        for (int x = begin; x < end; x += 4) {  // columns beyond the width are scratch
            step_down<N>(block, x, small_drop, block.sums + (x - begin) * column);
        }
        take_winners<N>(block, begin, end);
    }
}

// ---- From sums to disparity

// Which winners to believe, and where between two disparities they lie, in steps. At first `steps`
// are the lanes that the right image's pixels chose.
void judge(const Block& block, const uint8_t* __restrict lane, const uint8_t* __restrict best,
           const uint8_t* __restrict second, const uint8_t* __restrict before,
           const uint8_t* __restrict after, int16_t* __restrict steps) {
    const int width = block.width, count = kRows * width, last_lane = block.disparities - 1;
    const int left_right = block.tuning.left_right, unique = 100 + block.tuning.uniqueness;
    // What the right image does not show is best matched by the columns at its border, whose
    // windows reach beyond it.
    const int smallest = block.smallest;
    const int least_column = smallest + block.disparities > 1 ? kReach : 0;
    const int last_column = width - 1 - (smallest < 0 ? kReach : 0);
    for (int i = 0; i < count; ++i) {
        const int apart = steps[i] - lane[i], least = best[i], next = second[i];
        const int there = i / kRows - smallest - lane[i];
        const int sure = (least < kOutside) & (100 * next > unique * least) &
                         (apart <= left_right) & (-apart <= left_right) &
                         (there >= least_column) & (there <= last_column);
        // [fit]: the minimum of the parabola through the three sums.
        const int ahead = before[i], behind = after[i], rise = ahead + behind - 2 * least;
        const int between = (lane[i] > 0) & (lane[i] < last_lane) & (ahead < kOutside) &
                            (behind < kOutside) & (rise > 0);
        const float offset = static_cast<float>(ahead - behind) * (0.5f * kSteps) /
                             static_cast<float>(larger(rise, 1));
        const int fraction = static_cast<int>(offset + (kSteps + 0.5f)) - kSteps;
        const int found = larger(lane[i] * kSteps + (between ? fraction : 0), 0);
        steps[i] = static_cast<int16_t>(sure ? found : kNone);
    }
}

// [peak]: 0 where another match is as good, 255 where none is near.
void rate(const Block& block, const uint8_t* __restrict best, const uint8_t* __restrict second,
          const int16_t* __restrict steps, uint8_t* __restrict confidence) {
    const int count = kRows * block.width;
    for (int i = 0; i < count; ++i) {
        const int next = second[i];
        const float ratio = static_cast<float>(best[i]) / static_cast<float>(larger(next, 1));
        const int unlike = static_cast<int>(255.0f - 255.0f * ratio);
        confidence[i] = static_cast<uint8_t>(steps[i] != kNone ? unlike : 0);
    }
}

void decide(const Block& block, bool rated) {
    const uint8_t* lane = block.lane;
    const uint16_t* right = block.right_best + kRows * block.lanes;
    int16_t* steps = block.steps;
    for (int i = 0; i < kRows * block.width; ++i) steps[i] = right[i - kRows * lane[i]] & 255;
    const uint8_t* second = reinterpret_cast<const uint8_t*>(block.second);
    judge(block, lane, block.best, second, block.before, block.after, steps);
    if (rated) rate(block, block.best, second, steps, block.confidence);
}

void take_row(const Block& block, int row, int16_t* __restrict steps,
              uint8_t* __restrict confidence) {
    const int16_t* __restrict found = block.steps + row;
    const uint8_t* __restrict sure = block.confidence + row;
    const int width = block.width;
    for (int x = 0; x < width; ++x) steps[x] = found[kRows * x];
    if (confidence == nullptr) return;
    for (int x = 0; x < width; ++x) confidence[x] = sure[kRows * x];
}

// The row's answers less those where the image has no gradient along the row to be matched by.
void without_texture(Window<uint8_t> rows, int width, float least, int16_t* steps) {
    constexpr int half = 4, columns = 2 * half + 1;
    const auto change = [&](int column) {
        const int x = clamped(column, 0, width - 1);
        int sum = 0;
        for (const uint8_t* row : rows) {
            const int slope = row[x + 1] - row[x - 1];
            sum += slope < 0 ? -slope : slope;
        }
        return sum;
    };
    int sum = 0;
    for (int x = -half - 1; x < half; ++x) sum += change(x);
    for (int x = 0; x < width; ++x) {
        sum += change(x + half) - change(x - half - 1);
        const float mean = static_cast<float>(sum) / (2.0f * columns * (2 * kReach + 1));
        if (mean < least) steps[x] = kNone;
    }
}

BEARCUB_INLINE void sort(int16_t& a, int16_t& b) {
    const int16_t low = smaller(a, b);
    b = larger(a, b);
    a = low;
}

BEARCUB_INLINE bool known(int16_t steps) {
    return static_cast<uint16_t>(steps) < static_cast<uint16_t>(kNoneAbove);
}

// Every other unmatched pixel stands above all answers instead of below: so what is missing pulls a
// median to neither side. All below, they made floors with gaps a twentieth to a tenth of a pixel
// farther.
void balance(int16_t* steps, int width, bool odd) {
    for (int x = 0; x < width; ++x) {
        const bool above = (steps[x] == kNone) & ((x & 1) == odd);
        steps[x] = above ? kNoneAbove : steps[x];
    }
}

// Median of 3 x 3 by J. L. Smith's 19 exchanges (Implementing median filters in XC4000E FPGAs,
// Xcell 23, 1996), where most are known. Rows have a column more on either side.
void median(const int16_t* __restrict above, const int16_t* __restrict row,
            const int16_t* __restrict below, int width, int16_t* __restrict to) {
    for (int x = 0; x < width; ++x) {
        int16_t a = above[x - 1], b = above[x], c = above[x + 1];
        int16_t d = row[x - 1], e = row[x], f = row[x + 1];
        int16_t g = below[x - 1], h = below[x], i = below[x + 1];
        int16_t count = 0;
        const auto note = [&](int16_t steps) { count = static_cast<int16_t>(count + known(steps)); };
        note(a), note(b), note(c), note(d), note(e), note(f), note(g), note(h), note(i);
        sort(b, c), sort(e, f), sort(h, i);
        sort(a, b), sort(d, e), sort(g, h);
        sort(b, c), sort(e, f), sort(h, i);
        sort(a, d), sort(f, i), sort(e, h);
        sort(d, g), sort(b, e), sort(c, f);
        sort(e, h), sort(e, c), sort(g, e), sort(e, c);
        to[x] = count > 9 / 2 ? e : kNone;
    }
}

// Each answer's mean with those around it that differ little: less noise, and the same edges. An
// answer that fewer than half of them agree with is none. Rows have kReach columns more on either
// side.
void smooth(Window<int16_t> rows, int width, int16_t* __restrict to) {
    constexpr int16_t most = kSteps + kSteps / 2;  // so near to an answer kNone never is
    constexpr int agreeing = (2 * kReach + 1) * (2 * kReach + 1) / 2 + 1;
    const int16_t* __restrict row = rows[kReach];
    for (int x = 0; x < width; ++x) {
        const int16_t here = row[x];
        int16_t sum = 0, count = 0;
        const auto take = [&](const int16_t* other) {
            for (int k = -kReach; k <= kReach; ++k) {
                const int16_t there = other[x + k], apart = static_cast<int16_t>(there - here);
                const bool near = static_cast<uint16_t>(apart + most) <= 2 * most;
                sum = static_cast<int16_t>(sum + (near ? apart : 0));
                count = static_cast<int16_t>(count + near);
            }
        };
        take(rows[0]), take(rows[1]), take(rows[2]), take(rows[3]), take(rows[4]);
        const float mean = static_cast<float>(sum) / static_cast<float>(larger<int>(count, 1));
        const int found = here + static_cast<int>(mean + (most + 0.5f)) - most;
        to[x] = (here == kNone) | (count < agreeing) ? kNone : static_cast<int16_t>(found);
    }
}

// Sixty-four bytes to a word: which of them are set.
void pack(const uint8_t* bytes, int words, uint64_t* to) {
    for (int word = 0; word < words; ++word) {
        uint64_t bits = 0;
        for (int i = 0; i < 64; i += Bytes::lanes) {
            bits |= equal_bits(load(bytes + 64 * word + i), splat(1)) << i;
        }
        to[word] = bits;
    }
}

BEARCUB_INLINE uint8_t linked(int16_t a, int16_t b, int step) {
    const int apart = a > b ? a - b : b - a;
    return static_cast<uint8_t>((a != kNone) & (b != kNone) & (apart <= step));
}

// Which pixels are known, and connected to the one before: a bit each. `bytes` holds whole words
// and is 0 beyond the width.
void links_along(const int16_t* __restrict row, int width, int step, uint8_t* __restrict bytes,
                 uint64_t* known, uint64_t* before) {
    const int words = (width + 63) / 64;
    for (int x = 0; x < width; ++x) bytes[x] = row[x] != kNone;
    pack(bytes, words, known);
    bytes[0] = 0;
    for (int x = 1; x < width; ++x) bytes[x] = linked(row[x], row[x - 1], step);
    pack(bytes, words, before);
}

// Which pixels are connected to the one above.
void links_up(const int16_t* __restrict row, const int16_t* __restrict above, int width, int step,
              uint8_t* __restrict bytes, uint64_t* up) {
    for (int x = 0; x < width; ++x) bytes[x] = linked(row[x], above[x], step);
    pack(bytes, (width + 63) / 64, up);
}

// Steps to pixels; NaN where unmatched or matched beyond the right image's border.
void to_pixels(const int16_t* __restrict steps, int width, int smallest,
               float* __restrict disparity) {
    for (int x = 0; x < width; ++x) {
        const float found =
            static_cast<float>(smallest) + static_cast<float>(steps[x]) * (1.0f / kSteps);
        const float there = static_cast<float>(x) - found;
        const int seen =
            (steps[x] != kNone) & (there >= 0.0f) & (there <= static_cast<float>(width - 1));
        disparity[x] = seen ? found : __builtin_nanf("");
    }
}

// No confidence where there is no disparity.
void quell(const float* __restrict disparity, int width, uint8_t* __restrict confidence) {
    for (int x = 0; x < width; ++x) {
        confidence[x] = disparity[x] == disparity[x] ? confidence[x] : uint8_t{0};
    }
}

// ---- One instance per number of vectors that a pixel's disparities fill

template <int N>
using Vectors = std::integral_constant<int, N>;

template <class Kernel>
void instance(const Block& block, Kernel&& kernel) {
    switch (block.lanes / Bytes::lanes) {
        case 1: return kernel(Vectors<1>{});
        case 2: return kernel(Vectors<2>{});
        case 3: return kernel(Vectors<3>{});
        case 4: return kernel(Vectors<4>{});
#if !defined(__AVX512VBMI__)
        case 6: return kernel(Vectors<6>{});
        case 8: return kernel(Vectors<8>{});
#if !defined(__AVX2__)
        case 12: return kernel(Vectors<12>{});
        case 16: return kernel(Vectors<16>{});
#endif
#endif
    }
}

void warm_up_any(const Block& block, int rows) {
    instance(block, [&](auto n) { warm_up<n.value>(block, rows); });
}

void forward_any(const Block& block) {
    instance(block, [&](auto n) { forward<n.value>(block); });
}

void backward_any(const Block& block) {
    instance(block, [&](auto n) { backward<n.value>(block); });
}

}  // namespace

extern const Kernels kernels;
const Kernels kernels = {
    Bytes::lanes,
    census<uint8_t>,
    census<uint16_t>,
    penalties,
    four_times,
    reversed,
    warm_up_any,
    forward_any,
    backward_any,
    decide,
    take_row,
    without_texture,
    balance,
    median,
    smooth,
    links_along,
    links_up,
    to_pixels,
    quell,
};

}  // namespace bearcub::BEARCUB_LEVEL
