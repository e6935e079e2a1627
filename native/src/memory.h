// Memory for vectors: aligned, zero at first, of one size for good.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstring>
#include <new>

namespace bearcub {

constexpr std::size_t kAlignment = 64;

// `count` rounded up to a multiple of `step`.
constexpr int rounded_up(int count, int step) { return (count + step - 1) / step * step; }

// What all buffers hold together [bytes].
inline std::atomic<std::size_t> held_bytes{0};

template <class T>
class Buffer {
public:
    Buffer() = default;
    explicit Buffer(std::size_t count)
        : count_(count),
          data_(static_cast<T*>(::operator new(count * sizeof(T), std::align_val_t{kAlignment}))) {
        std::memset(static_cast<void*>(data_), 0, bytes());
        held_bytes += bytes();
    }
    ~Buffer() {
        held_bytes -= bytes();
        ::operator delete(data_, std::align_val_t{kAlignment});
    }
    Buffer(const Buffer&) = delete;
    Buffer& operator=(const Buffer&) = delete;

    T* data() { return data_; }
    const T* data() const { return data_; }
    T& operator[](std::size_t i) { return data_[i]; }
    const T& operator[](std::size_t i) const { return data_[i]; }
    std::size_t bytes() const { return count_ * sizeof(T); }

private:
    std::size_t count_ = 0;
    T* data_ = nullptr;
};

}  // namespace bearcub
