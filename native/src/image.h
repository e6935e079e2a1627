// Images as they come.
#pragma once

#include <cstddef>
#include <cstdint>

namespace bearcub {

// An image of bytes or 16-bit words, rows `stride` bytes apart.
struct Image {
    const uint8_t* data;
    std::ptrdiff_t stride;

    const uint8_t* row(int i) const { return data + i * stride; }
};

// The row or column that stands for one up to `size` beyond the border: cb|abc|ba.
inline int reflected(int i, int size) {
    while (i < 0 || i >= size) {
        if (size == 1) return 0;
        i = i < 0 ? -i : 2 * (size - 1) - i;
    }
    return i;
}

// Beyond its ends a row goes back the way it came.
template <class T>
void reflect(T* row, int width, int margin) {
    for (int i = 1; i <= margin; ++i) {
        row[-i] = row[reflected(-i, width)];
        row[width - 1 + i] = row[reflected(width - 1 + i, width)];
    }
}

}  // namespace bearcub
