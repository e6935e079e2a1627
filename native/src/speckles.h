// Small connected patches of disparity, found by their runs along the rows.
#pragma once

#include <cstdint>

#include "kernels.h"
#include "memory.h"

namespace bearcub {

// Connected components by union-find over runs (A. Rosenfeld, J. L. Pfaltz: Sequential operations
// in digital picture processing, JACM 13(4), 1966). Ranges of rows may be labelled at once by
// several threads; their seams are joined afterwards. What goes does not depend on the ranges.
class Speckles {
public:
    // Neighbours that differ by up to `step` are connected; patches of up to `area` are small.
    Speckles(const Kernels& kernels, int height, int width, int step, int area);

    // Find the runs of one row; `scratch` as large as scratch() says, and 0 at first.
    void find_runs(int row, const int16_t* steps, uint8_t* scratch);
    // Connect one row's runs to those of the row above.
    void connect(int row, const int16_t* steps, const int16_t* above, uint8_t* scratch);
    // Call visit(first, end, small) for every run of the row.
    template <class Visit>
    void each_run(int row, Visit&& visit) const {
        for (int run = row * width_; run < row * width_ + count_[row]; ++run) {
            int root = run;
            while (parent_[root] >= 0) root = parent_[root];
            visit(runs_[run].first, runs_[run].end, -parent_[root] <= area_);
        }
    }

    // Bytes: a row's links one by one, then packed.
    int scratch() const { return (64 + 8) * words_; }
    std::size_t bytes() const;

private:
    struct Run {
        uint16_t first, end;
    };

    int run_at(int row, int word, uint64_t up_to_bit) const;
    int root(int run);

    const Kernels& kernels_;
    const int width_, words_, step_, area_;
    Buffer<uint64_t> known_, before_;  // [row][word], see Kernels::links_along
    Buffer<int32_t> runs_before_;      // [row][word]: runs of the row that start before it
    Buffer<int32_t> count_;            // runs of a row
    Buffer<Run> runs_;                 // [row][run], room for a run per pixel
    Buffer<int32_t> parent_;           // the same way; of a root its size, negative
};

}  // namespace bearcub
