// A checksum of the core's answers, to compare machines and instruction sets without Python.
//
// Builds with the sources alone; README.md has the commands. Every level must print the same sums.
#include <cstdio>
#include <cstring>
#include <vector>

#include "src/gate.h"
#include "src/levels.h"
#include "src/matcher.h"
#include "src/parallax.h"
#include "src/rectifier.h"
#include "src/refiner.h"

using namespace bearcub;

namespace {

struct Case {
    Shape shape;
    int threads;
};

// FNV-1a over the bits of the answer.
template <class T>
uint64_t checksum(const std::vector<T>& values, uint64_t sum = 0xcbf29ce484222325u) {
    std::vector<uint8_t> bytes(values.size() * sizeof(T));
    std::memcpy(bytes.data(), values.data(), bytes.size());
    for (const uint8_t byte : bytes) sum = (sum ^ byte) * 0x100000001b3u;
    return sum;
}

// Noise whose right view is shifted, differently above and below.
std::vector<uint8_t> noise(const Shape& shape, bool right) {
    const int bytes = shape.bits > 8 ? 2 : 1;
    std::vector<uint8_t> image;
    for (int v = 0; v < shape.height; ++v) {
        const int shift = right ? shape.smallest + (2 * v < shape.height ? 3 : 9) : 0;
        for (int i = 0; i < shape.width * bytes; ++i) {
            uint32_t x = v * 40503u + (i + shift * bytes + 4096) * 2654435u;
            x = (x ^ x >> 15) * 2246822519u;
            image.push_back(static_cast<uint8_t>((x ^ x >> 13) >> 8));
        }
    }
    return image;
}

uint64_t answer(const Case& given, const Level& level) {
    const Shape& shape = given.shape;
    const std::vector<uint8_t> left = noise(shape, false), right = noise(shape, true);
    const std::ptrdiff_t stride = static_cast<std::ptrdiff_t>(left.size()) / shape.height;
    const std::size_t size = static_cast<std::size_t>(shape.height) * shape.width;
    std::vector<float> disparity(size), refined(size);
    std::vector<uint8_t> confidence(size);
    Matcher matcher(shape, {12, 8, 60, 16, 10, 10, 2, 0.5f, 20, 2.0f}, given.threads,
                    *level.match);
    matcher.match({left.data(), stride}, {right.data(), stride}, disparity.data(),
                  confidence.data());
    Refiner refiner(shape.height, shape.width, given.threads, *level.refine);
    refiner.refine({left.data(), stride}, {right.data(), stride}, disparity.data(), refined.data());
    std::vector<float> gated(size);
    if (shape.height > 1 && shape.width > 1) {
        Gate gate(shape.height, shape.width, {0.65f, 0.5f}, 5, given.threads, level);
        gate.gate({left.data(), stride}, {right.data(), stride}, disparity.data(), gated.data());
    }
    uint64_t sum = checksum(confidence);
    for (std::vector<float>* map : {&disparity, &gated, &refined}) {
        for (float& d : *map) d = d == d ? d : -9999.0f;  // the bits of a NaN may differ
        sum = checksum(*map, sum);
    }
    return sum;
}

// The raw image bent, and moved beyond its border.
uint64_t rectified(const Level& level) {
    const Shape shape{70, 131, 0, 16, 8};
    std::vector<int16_t> whole;
    std::vector<uint16_t> shares;
    for (int v = 0; v < shape.height; ++v) {
        for (int u = 0; u < shape.width; ++u) {
            whole.push_back(static_cast<int16_t>(u - 3 + v / 9));
            whole.push_back(static_cast<int16_t>(v + 5 - u / 13));
            shares.push_back(static_cast<uint16_t>((u * 37 + v * 101) % 1024));
        }
    }
    const std::vector<uint8_t> left = noise(shape, false), right = noise(shape, true);
    std::vector<uint8_t> answers[] = {left, right};
    const RawPixels map{whole.data(), shares.data()};
    Rectifier rectifier(shape.height, shape.width, {map, map}, 2, *level.rectify);
    rectifier.rectify({{left.data(), shape.width}, {right.data(), shape.width}},
                      {answers[0].data(), answers[1].data()});
    return checksum(answers[1], checksum(answers[0]));
}

// What seems to stand on a floor that leans and is bent, shown by both steps, however unsure.
uint64_t feet(const Level& level) {
    const Shape shape{200, 231, 0, 16, 8};
    const std::vector<uint8_t> left = noise(shape, false), right = noise(shape, true);
    const Pair pair{{left.data(), shape.width}, {right.data(), shape.width}, shape.width, 1.5f};
    std::vector<float> bend;
    for (int i = 0; i < 400; ++i) bend.push_back(0.01f * static_cast<float>(i % 37));
    const Surface surface{0.01f, 0.1f, -2.0f, bend.data(), bend.data(), 400};
    const FeetTuning tuning{0.5f, 0.01f, 10.0f, 0.3f, 32, 8};
    std::vector<float> found;
    for (const Strip& strip : {Strip{1, 41, 70, 231}, Strip{2, 20, 45, 115}}) {
        const std::vector<Band> bands{{0, 9, 8, 4, 0, 33}, {9, 30, 13, 6, 20, strip.rows}};
        for (const Foot& foot : find_feet(pair, surface, strip, bands, tuning, *level.look)) {
            const float place = static_cast<float>(foot.v * strip.columns + foot.u);
            for (const float value : {place, foot.level, foot.sure}) found.push_back(value);
        }
    }
    return checksum(found);
}

}  // namespace

int main() {
    const Case cases[] = {
        {{1, 1, 0, 16, 8}, 1},     {{7, 33, -5, 48, 8}, 1},     {{90, 70, 3, 96, 8}, 2},
        {{350, 130, 0, 64, 16}, 3}, {{40, 50, -100, 256, 8}, 1}, {{170, 641, 0, 128, 8}, 4},
    };
    for (const Level& level : levels()) {
        std::printf("%-7s", level.name);
        for (const Case& given : cases) {
            std::printf(" %016llx", static_cast<unsigned long long>(answer(given, level)));
        }
        std::printf(" %016llx", static_cast<unsigned long long>(rectified(level)));
        std::printf(" %016llx\n", static_cast<unsigned long long>(feet(level)));
    }
}
