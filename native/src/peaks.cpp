#include "peaks.h"

#include <algorithm>
#include <cstddef>

#include "floor.h"

namespace bearcub {
namespace {

struct Scratch {
    std::vector<int> counts, around;
    std::vector<uint8_t> bytes;
    std::vector<uint16_t> words, widened;
};

bool looked_at(const Filled& filled, Which which, const uint16_t* number, int i) {
    switch (which) {
        case Which::tall: return filled.tall[i] && !filled.overhead[i];
        case Which::standing: return number[i] == 0 && !filled.overhead[i];
        default: return number[i] == 0 && filled.overhead[i];
    }
}

// The largest (or least) within `reach` on either side, beyond the borders nothing counts.
template <class T, class Pick>
void along_rows(const T* from, T* to, int rows, int columns, int reach, Pick pick) {
    for (int row = 0; row < rows; ++row, from += columns, to += columns) {
        const T* __restrict const there = from;
        T* __restrict const here = to;
        std::copy(there, there + columns, here);
        for (int k = 1; k <= std::min(reach, columns - 1); ++k) {
            for (int i = 0; i < columns - k; ++i) here[i] = pick(here[i], there[i + k]);
            for (int i = k; i < columns; ++i) here[i] = pick(here[i], there[i - k]);
        }
    }
}

template <class T, class Pick>
void across_rows(const T* from, T* to, int rows, int columns, int reach, Pick pick) {
    std::copy(from, from + static_cast<std::ptrdiff_t>(rows) * columns, to);
    for (int row = 0; row < rows; ++row) {
        T* __restrict const here = to + static_cast<std::ptrdiff_t>(row) * columns;
        const int first = std::max(0, row - reach), last = std::min(rows - 1, row + reach);
        for (int other = first; other <= last; ++other) {
            const T* __restrict const there = from + static_cast<std::ptrdiff_t>(other) * columns;
            for (int i = 0; i < columns; ++i) here[i] = pick(here[i], there[i]);
        }
    }
}

const auto larger = [](auto a, auto b) { return a > b ? a : b; };
const auto smaller = [](auto a, auto b) { return a < b ? a : b; };

}  // namespace

Span mark_peaks(const Filled& filled, Which which, int least, const uint16_t* number,
                const float* least_rows, int gap, uint8_t* closed) {
    constexpr int kLevels = 2;  // on either side that count together
    Scratch& scratch = of_this_thread<Scratch>();
    const int columns = filled.columns;
    const std::size_t size = static_cast<std::size_t>(filled.levels) * columns;
    scratch.counts.assign(size, 0);
    int looked = 0, lowest = static_cast<int>(size), highest = 0;
    for (int i = 0; i < filled.count; ++i) {
        if (!looked_at(filled, which, number, i)) continue;
        const int cell = filled.cell[i];
        ++scratch.counts[cell];
        ++looked;
        lowest = std::min(lowest, cell);
        highest = std::max(highest, cell);
    }
    if (looked == 0 || looked < least) return {0, 0};
    // the levels in which a pixel lies, and those that are closed with them; even for cv2, whose
    // numbers go by pairs of rows
    const int from = std::max(0, lowest / columns - kLevels) / 2 * 2;
    const int to = std::min(filled.levels, highest / columns + kLevels + 1);
    const int levels = to - from;
    const std::ptrdiff_t start = static_cast<std::ptrdiff_t>(from) * columns;
    scratch.bytes.resize(size);
    scratch.around.assign(columns, 0);
    const auto row = [&](int level) {
        return &scratch.counts[start + static_cast<std::ptrdiff_t>(level) * columns];
    };
    int* __restrict const around = scratch.around.data();
    std::fill(closed, closed + size, uint8_t{0});
    closed += start;
    for (int level = -kLevels; level < levels; ++level) {
        if (level + kLevels < levels) {
            const int* __restrict const next = row(level + kLevels);
            for (int i = 0; i < columns; ++i) around[i] += next[i];
        }
        if (level < 0) continue;
        const int* __restrict const here = row(level);
        uint8_t* __restrict const peak = &closed[static_cast<std::ptrdiff_t>(level) * columns];
        const float rows = least_rows[from + level];
        for (int i = 0; i < columns; ++i) {
            peak[i] = (static_cast<float>(around[i]) >= rows) & (here[i] > 0);
        }
        if (level - kLevels >= 0) {
            const int* __restrict const past = row(level - kLevels);
            for (int i = 0; i < columns; ++i) around[i] -= past[i];
        }
    }
    uint8_t* const bytes = scratch.bytes.data();
    along_rows(closed, bytes, levels, columns, gap, larger);
    across_rows(bytes, closed, levels, columns, 1, larger);
    along_rows(closed, bytes, levels, columns, gap, smaller);
    across_rows(bytes, closed, levels, columns, 1, smaller);
    return {from, to};
}

void number_pixels(const Filled& filled, Which which, const uint16_t* peaks, int foot_levels,
                   int foot_columns, int numbered, uint16_t* number) {
    if (which != Which::tall) {
        for (int i = 0; i < filled.count; ++i) {
            if (!looked_at(filled, which, number, i)) continue;
            const uint16_t found = peaks[filled.cell[i]];
            if (found) number[i] = static_cast<uint16_t>(found + numbered);
        }
        return;
    }
    Scratch& scratch = of_this_thread<Scratch>();
    const std::size_t size = static_cast<std::size_t>(filled.levels) * filled.columns;
    scratch.words.resize(size);
    scratch.widened.resize(size);
    uint16_t* const words = scratch.words.data();
    uint16_t* const widened = scratch.widened.data();
    along_rows(peaks, words, filled.levels, filled.columns, foot_columns / 2, larger);
    across_rows(words, widened, filled.levels, filled.columns, foot_levels / 2, larger);
    for (int i = 0; i < filled.count; ++i) number[i] = widened[filled.cell[i]];
}

void let_go(const bool* overhead, const int64_t* index, int count, int columns, double share,
            uint16_t* number) {
    struct Places {
        int64_t lowest = -1, top = -1, foot = -1;  // of what is overhead; of the others
    };
    std::vector<Places> things;
    for (int i = 0; i < count; ++i) {
        if (number[i] >= things.size()) things.resize(number[i] + 1);
        Places& thing = things[number[i]];
        if (overhead[i]) {
            thing.lowest = index[i];
            continue;
        }
        if (thing.top < 0) thing.top = index[i];
        thing.foot = index[i];
    }
    std::vector<bool> goes;
    for (const auto& [lowest, top, foot] : things) {
        const int64_t from = lowest / columns, to = top / columns;
        goes.push_back(lowest >= 0 && top >= 0 && to - from > share * (foot / columns - to));
    }
    for (int i = 0; i < count; ++i) {
        if (overhead[i] && goes[number[i]]) number[i] = 0;
    }
}

void count_heights(const uint16_t* number, const int32_t* column, int count, int columns,
                   int32_t* heights) {
    for (int i = 0; i < count; ++i) {
        if (number[i]) ++heights[(number[i] - 1) * static_cast<std::ptrdiff_t>(columns) + column[i]];
    }
}

Strips find_strips(const int32_t* heights, int columns, int gap, double share) {
    std::vector<int32_t> closed(columns), tall(columns), high(columns);
    along_rows(heights, tall.data(), 1, columns, gap, larger);
    along_rows(tall.data(), closed.data(), 1, columns, gap, smaller);
    const double least = share * *std::max_element(closed.begin(), closed.end());
    for (int i = 0; i < columns; ++i) high[i] = closed[i] >= least;
    along_rows(high.data(), tall.data(), 1, columns, gap, smaller);
    along_rows(tall.data(), high.data(), 1, columns, gap, larger);
    int first = 0, last = columns - 1;
    while (first < last && heights[first] == 0) ++first;
    while (last > first && heights[last] == 0) --last;
    Strips strips{{first}, high[first] != 0, high[last] != 0};
    for (int i = first + 1; i <= last; ++i) {
        if (high[i] != high[i - 1]) strips.bounds.push_back(i);
    }
    strips.bounds.push_back(last + 1);
    return strips;
}

}  // namespace bearcub
