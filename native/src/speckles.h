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
    Speckles(int height, int width);

    // Find the runs of one row; `scratch` as large as scratch() says, and 0 at first.
    void find_runs(const Kernels& kernels, int row, const int16_t* steps, int step,
                   uint8_t* scratch);
    // Connect one row's runs to those of the row above.
    void connect(const Kernels& kernels, int row, const int16_t* steps, const int16_t* above,
                 int step, uint8_t* scratch);
    // Take back the row's runs that belong to patches of up to `area` pixels.
    void erase(int row, int area, int16_t* steps) const;

    // Bytes: a row's links one by one, then packed.
    int scratch() const { return (64 + 8) * words_; }
    std::size_t bytes() const;

private:
    struct Run {
        uint16_t first, end;
    };

    int run_at(int row, int word, uint64_t up_to_bit) const;
    int root(int run);

    int width_, words_;
    Buffer<uint64_t> known_, before_;  // [row][word], see Kernels::links_along
    Buffer<int32_t> runs_before_;      // [row][word]: runs of the row that start before it
    Buffer<int32_t> count_;            // runs of a row
    Buffer<Run> runs_;                 // [row][run], room for a run per pixel
    Buffer<int32_t> parent_;           // the same way; of a root its size, negative
};

}  // namespace bearcub
