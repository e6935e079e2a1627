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
        std::copy(from, from + columns, to);
        for (int k = 1; k <= std::min(reach, columns - 1); ++k) {
            for (int i = 0; i < columns - k; ++i) to[i] = pick(to[i], from[i + k]);
            for (int i = k; i < columns; ++i) to[i] = pick(to[i], from[i - k]);
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
            const T* const there = from + static_cast<std::ptrdiff_t>(other) * columns;
            for (int i = 0; i < columns; ++i) here[i] = pick(here[i], there[i]);
        }
    }
}

const auto larger = [](auto a, auto b) { return a > b ? a : b; };
const auto smaller = [](auto a, auto b) { return a < b ? a : b; };

}  // namespace

int mark_peaks(const Filled& filled, Which which, const uint16_t* number, const float* least_rows,
               int gap, uint8_t* closed) {
    constexpr int kLevels = 2;  // on either side that count together
    Scratch& scratch = of_this_thread<Scratch>();
    const int levels = filled.levels, columns = filled.columns;
    const std::size_t size = static_cast<std::size_t>(levels) * columns;
    scratch.counts.assign(size, 0);
    int looked = 0;
    for (int i = 0; i < filled.count; ++i) {
        if (!looked_at(filled, which, number, i)) continue;
        ++scratch.counts[filled.cell[i]];
        ++looked;
    }
    scratch.bytes.resize(size);
    scratch.around.resize(columns);
    for (int level = 0; level < levels; ++level) {
        int* const around = scratch.around.data();
        std::fill(around, around + columns, 0);
        const int last = std::min(levels - 1, level + kLevels);
        for (int other = std::max(0, level - kLevels); other <= last; ++other) {
            const int* const there = &scratch.counts[static_cast<std::size_t>(other) * columns];
            for (int i = 0; i < columns; ++i) around[i] += there[i];
        }
        const int* const here = &scratch.counts[static_cast<std::size_t>(level) * columns];
        uint8_t* const peak = &closed[static_cast<std::size_t>(level) * columns];
        for (int i = 0; i < columns; ++i) {
            peak[i] = (static_cast<float>(around[i]) >= least_rows[level]) & (here[i] > 0);
        }
    }
    uint8_t* const bytes = scratch.bytes.data();
    along_rows(closed, bytes, levels, columns, gap, larger);
    across_rows(bytes, closed, levels, columns, 1, larger);
    along_rows(closed, bytes, levels, columns, gap, smaller);
    across_rows(bytes, closed, levels, columns, 1, smaller);
    return looked;
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

}  // namespace bearcub
