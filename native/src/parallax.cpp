#include "parallax.h"

#include "memory.h"

namespace bearcub {
namespace {

struct Memory {
    std::vector<uint8_t> left, right;
    std::vector<float> floor, energy, seen, sure, ratio, variance, bend, parallax, rows[4];
    std::vector<int> hits;
};

template <class T>
T* room(std::vector<T>& memory, std::size_t count) {
    if (memory.size() < count) memory.resize(count);
    return memory.data();
}

// A look at a strip, with the memory for windows of so many columns and rows.
Look look_at(const Pair& pair, const Surface& surface, const Strip& strip, int wide, int tall,
             const FeetTuning& tuning, Memory& memory) {
    Look look{};
    look.strip = strip;
    look.left_image = pair.left, look.right_image = pair.right;
    look.a = surface.a, look.b = surface.b, look.c = surface.c, look.offset = pair.offset;
    look.tuning = tuning;
    look.pitch = rounded_up(strip.columns, kSummed);
    look.parts_down = std::max(1, strip.rows / tuning.around_rows);
    look.parts_across = std::max(1, strip.columns / tuning.around_columns);
    const std::size_t pixels = static_cast<std::size_t>(strip.rows) * look.pitch;
    const std::size_t parts = static_cast<std::size_t>(look.parts_down) * look.pitch;
    look.left = room(memory.left, pixels);
    look.right = room(memory.right, pixels);
    look.floor = room(memory.floor, pixels);
    look.energy = room(memory.energy, pixels);
    look.seen = room(memory.seen, pixels);
    look.sure = room(memory.sure, pixels);
    look.ratio = room(memory.ratio, parts);
    look.variance = room(memory.variance, parts);
    for (int i = 0; i < 4; ++i) look.rows[i] = room(memory.rows[i], look.pitch + 2 * wide);
    look.parallax = room(memory.parallax, tall);
    look.hits = room(memory.hits, strip.rows);
    float* const bend = room(memory.bend, static_cast<std::size_t>(strip.rows) * look.parts_across);
    look.bend = bend;
    const float per_part = static_cast<float>(pair.columns) / look.parts_across;
    for (int v = 0; v < strip.rows; ++v) {
        const float row = strip.first + (2 * v + 1) * strip.step - 0.5f;
        for (int k = 0; k < look.parts_across; ++k) {
            const float level = surface.b * row + surface.c + surface.a * ((k + 0.5f) * per_part);
            bend[v * look.parts_across + k] = surface.bend[surface.entry(level)];
        }
    }
    return look;
}

// Whether nothing in the window around a pixel is surer.
bool is_peak(const Look& look, const Band& band, int v, int u) {
    const float here = look.sure[v * look.pitch + u];
    const int left = std::max(u - band.wide, 0);
    const int right = std::min(u + band.wide + 1, look.strip.columns);
    for (int i = std::max(v - 2, band.first); i < std::min(v + 3, band.end); ++i) {
        const float* const row = look.sure + i * look.pitch;
        if (std::any_of(row + left, row + right, [=](float other) { return other > here; })) {
            return false;
        }
    }
    return true;
}

}  // namespace

void look_for_parallax(const Pair& pair, const Surface& surface, const Strip& strip,
                       const FeetTuning& tuning, const LookKernels& kernels, const ParallaxEvidence& to) {
    const Look look = look_at(pair, surface, strip, 1, 1, tuning, of_this_thread<Memory>());
    kernels.warp(look);
    kernels.contrast(look);
    kernels.noise(look, to.noise);
    for (int v = 0; v < strip.rows; ++v) {
        const std::ptrdiff_t from = v * look.pitch, start = v * strip.columns;
        std::copy_n(look.energy + from, strip.columns, to.energy + start);
        std::copy_n(look.seen + from, strip.columns, to.seen + start);
    }
}

std::vector<Foot> find_feet(const Pair& pair, const Surface& surface, const Strip& strip,
                            const std::vector<Band>& bands, const FeetTuning& tuning,
                            const LookKernels& kernels) {
    int wide = 1, tall = 1;
    for (const Band& band : bands) {
        wide = std::max(wide, band.wide);
        tall = std::max(tall, band.tall);
    }
    const Look look = look_at(pair, surface, strip, wide, tall, tuning, of_this_thread<Memory>());
    for (int i = 0; i < tall; ++i) {
        look.parallax[i] = 2 * std::hypot(surface.a, surface.b) * (i + 0.5f);
    }
    kernels.warp(look);
    kernels.contrast(look);
    std::vector<Foot> found;
    for (const Band& band : bands) {
        kernels.judge(look, band);
        for (int v = band.first; v < band.end; ++v) {
            const std::ptrdiff_t row = v * look.pitch;
            for (int u = 0; look.hits[v] && u < strip.columns; ++u) {
                if (look.sure[row + u] > 0 && is_peak(look, band, v, u)) {
                    found.push_back({u, v, look.floor[row + u], std::sqrt(look.sure[row + u])});
                }
            }
        }
    }
    return found;
}

}  // namespace bearcub
