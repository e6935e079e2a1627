#include "speckles.h"

#include <algorithm>

namespace bearcub {

Speckles::Speckles(const Kernels& kernels, int height, int width, int step, int area)
    : kernels_(kernels),
      width_(width),
      words_((width + 63) / 64),
      step_(step),
      area_(area),
      known_(static_cast<std::size_t>(height) * words_),
      before_(static_cast<std::size_t>(height) * words_),
      runs_before_(static_cast<std::size_t>(height) * words_),
      count_(height),
      runs_(static_cast<std::size_t>(height) * width),
      parent_(static_cast<std::size_t>(height) * width) {}

std::size_t Speckles::bytes() const {
    return known_.bytes() + before_.bytes() + runs_before_.bytes() + count_.bytes() +
           runs_.bytes() + parent_.bytes();
}

void Speckles::find_runs(int row, const int16_t* steps, uint8_t* scratch) {
    const std::size_t at = static_cast<std::size_t>(row) * words_;
    uint64_t *known = &known_[at], *before = &before_[at];
    kernels_.links_along(steps, width_, step_, scratch, known, before);
    const int first = row * width_;
    int starts = 0, ends = 0;
    for (int word = 0; word < words_; ++word) {
        runs_before_[at + word] = starts;
        for (uint64_t bits = known[word] & ~before[word]; bits != 0; bits &= bits - 1) {
            runs_[first + starts++].first = static_cast<uint16_t>(64 * word + __builtin_ctzll(bits));
        }
        const uint64_t next = word + 1 < words_ ? before[word + 1] << 63 : 0;
        for (uint64_t bits = known[word] & ~(before[word] >> 1 | next); bits != 0; bits &= bits - 1) {
            runs_[first + ends++].end = static_cast<uint16_t>(64 * word + __builtin_ctzll(bits) + 1);
        }
    }
    count_[row] = starts;
    for (int i = first; i < first + starts; ++i) parent_[i] = runs_[i].first - runs_[i].end;
}

int Speckles::run_at(int row, int word, uint64_t up_to_bit) const {
    const std::size_t at = static_cast<std::size_t>(row) * words_ + word;
    const uint64_t starts = known_[at] & ~before_[at];
    return row * width_ + runs_before_[at] + __builtin_popcountll(starts & up_to_bit) - 1;
}

int Speckles::root(int run) {
    while (parent_[run] >= 0) {
        const int next = parent_[run];
        if (parent_[next] >= 0) parent_[run] = parent_[next];
        run = next;
    }
    return run;
}

void Speckles::connect(int row, const int16_t* steps, const int16_t* above, uint8_t* scratch) {
    uint64_t* links = reinterpret_cast<uint64_t*>(scratch + 64 * words_);
    kernels_.links_up(steps, above, width_, step_, scratch, links);
    const std::size_t at = static_cast<std::size_t>(row) * words_;
    uint64_t carried = 0;
    for (int word = 0; word < words_; ++word) {
        const uint64_t up = links[word];
        // A link whose left neighbour links the same two runs says nothing new.
        const uint64_t same = before_[at + word] & before_[at - words_ + word];
        uint64_t news = up & ~((up << 1 | carried) & same);
        carried = up >> 63;
        for (; news != 0; news &= news - 1) {
            const uint64_t up_to_bit = news ^ (news - 1);
            const int a = root(run_at(row, word, up_to_bit));
            const int b = root(run_at(row - 1, word, up_to_bit));
            if (a == b) continue;
            const int kept = std::min(a, b), joined = std::max(a, b);
            parent_[kept] += parent_[joined];
            parent_[joined] = kept;
        }
    }
}

}  // namespace bearcub
