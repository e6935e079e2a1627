#include "walls.h"

#include <algorithm>
#include <vector>

namespace bearcub {
namespace {

float between(const FloorLines& part, float u, float v) {
    u = std::clamp(u, 0.0f, static_cast<float>(part.right_columns - 1));
    v = std::clamp(v, 0.0f, static_cast<float>(part.right_rows - 1));
    const int x = static_cast<int>(u), y = static_cast<int>(v);
    const int right = x + 1 < part.right_columns, below = y + 1 < part.right_rows;
    const float* at = part.right + static_cast<long>(y) * part.right_columns + x;
    const float* under = at + below * part.right_columns;
    const float across = u - static_cast<float>(x), down = v - static_cast<float>(y);
    const float upper = at[0] + across * (at[right] - at[0]);
    const float lower = under[0] + across * (under[right] - under[0]);
    return upper + down * (lower - upper);
}

// Adds a line's log-likelihood ratios of a wall with this disparity to the sums of its columns.
void add_line(const FloorLines& part, const Odds& odds, int line, float wall, float* sums) {
    for (int m = 0; m < part.columns; ++m) {
        const long i = static_cast<long>(line) * part.columns + m;
        float ratio = 0;
        if (part.known[i]) {
            const float difference = between(part, part.u[m] - wall, part.v[i]) - part.left[i];
            const float misfit = std::min(difference * difference * odds.scale, odds.largest);
            ratio = (part.misfit[i] - misfit) * odds.weight;
        }
        sums[m] += ratio - odds.price;
    }
}

// Columns in a row with the largest sum. J. Bentley: "Programming pearls: algorithm design
// techniques", Communications of the ACM 27(9), 1984.
void take_best(const std::vector<float>& sums, int far, int near, Wall& best) {
    float until = 0, least = 0;
    int left = 0;
    for (int m = 0; m < static_cast<int>(sums.size()); ++m) {
        if (until < least) {
            least = until;
            left = m;
        }
        until += sums[m];
        if (until - least > best.gain) best = {far, near, left, m, until - least};
    }
}

}  // namespace

Wall likeliest_wall(const FloorLines& part, const Odds& odds, int every, int least) {
    Wall best;
    std::vector<float> sums(part.columns);
    for (int far = 1; far < part.lines - least; far += every) {
        std::fill(sums.begin(), sums.end(), 0.0f);
        for (int line = far; line < part.lines; ++line) {
            add_line(part, odds, line, part.floor[far], sums.data());
            if (line + 1 >= far + least) take_best(sums, far, line, best);
        }
    }
    return best;
}

}  // namespace bearcub
