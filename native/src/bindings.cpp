// The core as Python sees it. What is passed has been checked by bearcub.stereo.native.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "after_bindings.h"
#include "gate.h"
#include "levels.h"
#include "matcher.h"
#include "memory.h"
#include "rectifier.h"
#include "refiner.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace bearcub {
namespace {

template <class T>
using Map = nb::ndarray<T, nb::ndim<2>, nb::device::cpu>;
template <class T>
using Contiguous = nb::ndarray<T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

std::vector<std::string> names() {
    std::vector<std::string> found;
    for (const Level& level : levels()) found.emplace_back(level.name);
    return found;
}

template <class Array>
void require_shape(const Array& array, int height, int width, const char* name) {
    if (static_cast<int>(array.shape(0)) != height || static_cast<int>(array.shape(1)) != width) {
        throw std::invalid_argument(std::string(name) + ": not of the shape that was set up");
    }
}

template <class Pixel>
Image image(const Map<const Pixel>& array, int height, int width, const char* name) {
    require_shape(array, height, width, name);
    if (array.stride(1) != 1 && width > 1) {
        throw std::invalid_argument(std::string(name) + ": pixels of a row must lie side by side");
    }
    return {reinterpret_cast<const uint8_t*>(array.data()),
            static_cast<std::ptrdiff_t>(array.stride(0) * sizeof(Pixel))};
}

template <class Pixel>
void match(Matcher& matcher, const Map<const Pixel>& left, const Map<const Pixel>& right,
           const Contiguous<float>& disparity,
           const std::optional<Contiguous<uint8_t>>& confidence) {
    const auto [height, width, smallest, disparities, bits] = matcher.shape();
    if ((bits > 8) != (sizeof(Pixel) > 1)) {
        throw std::invalid_argument("left: not of the bits that were set up");
    }
    const Image images[] = {image(left, height, width, "left"),
                            image(right, height, width, "right")};
    require_shape(disparity, height, width, "disparity");
    if (confidence) require_shape(*confidence, height, width, "confidence");
    const nb::gil_scoped_release release;
    matcher.match(images[0], images[1], disparity.data(), confidence ? confidence->data() : nullptr);
}

// Passes a pair and its disparity through a stage of the same shape.
template <class Stage, void (Stage::*run)(const Image&, const Image&, const float*, float*)>
void pass(Stage& stage, const Map<const uint8_t>& left, const Map<const uint8_t>& right,
          const Contiguous<const float>& disparity, const Contiguous<float>& answer) {
    const int height = stage.height(), width = stage.width();
    const Image images[] = {image(left, height, width, "left"),
                            image(right, height, width, "right")};
    require_shape(disparity, height, width, "disparity");
    require_shape(answer, height, width, "answer");
    const nb::gil_scoped_release release;
    (stage.*run)(images[0], images[1], disparity.data(), answer.data());
}

using Whole = nb::ndarray<const int16_t, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
using Shares = Contiguous<const uint16_t>;

RawPixels raw_pixels(const Whole& whole, const Shares& shares, int height, int width) {
    require_shape(whole, height, width, "whole");
    require_shape(shares, height, width, "shares");
    if (whole.shape(2) != 2) throw std::invalid_argument("whole: not columns and rows");
    return {whole.data(), shares.data()};
}

void rectify(Rectifier& rectifier, const Map<const uint8_t>& left, const Map<const uint8_t>& right,
             const Contiguous<uint8_t>& rectified_left,
             const Contiguous<uint8_t>& rectified_right) {
    const int height = rectifier.height(), width = rectifier.width();
    const Image images[] = {image(left, height, width, "left"),
                            image(right, height, width, "right")};
    require_shape(rectified_left, height, width, "rectified_left");
    require_shape(rectified_right, height, width, "rectified_right");
    const nb::gil_scoped_release release;
    rectifier.rectify(images, {rectified_left.data(), rectified_right.data()});
}

void slide_rows(const Map<const uint8_t>& picture, float first, float across, float down,
                float twist, const Contiguous<uint8_t>& answer,
                const std::optional<std::string>& name) {
    const int height = static_cast<int>(answer.shape(0)), width = static_cast<int>(answer.shape(1));
    const Image from = image(picture, height, width, "image");
    const RectifyKernels& kernels = *level_of(name).rectify;
    const nb::gil_scoped_release release;
    kernels.slide(from, height, width, first, across, down, twist, answer.data());
}

}  // namespace

NB_MODULE(_native, m) {
    m.doc() = "Kernels of the stages, compiled.";
    m.def("levels", &names, "Instruction sets that this machine runs, the best first.");
    m.def("held_bytes", [] { return held_bytes.load(); }, "What all buffers hold together.");
    nb::class_<Matcher>(m, "Matcher", "Semi-global matching of pairs of one shape.")
        .def(
            "__init__",
            [](Matcher* self, int height, int width, int smallest, int disparities, int bits,
               int small_step, int small_drop, int large_step, int least_step, int edge_discount,
               int uniqueness, int left_right, float texture, int speckle_area, float speckle_step, int threads,
               const std::optional<std::string>& level) {
                const auto byte = [](int x) { return static_cast<uint8_t>(x); };
                const Tuning tuning{byte(small_step), byte(small_drop), byte(large_step),
                                    byte(least_step), byte(edge_discount), uniqueness, left_right,
                                    texture, speckle_area, speckle_step};
                new (self) Matcher({height, width, smallest, disparities, bits}, tuning, threads,
                                   *level_of(level).match);
            },
            nb::kw_only(), "height"_a, "width"_a, "smallest"_a, "disparities"_a, "bits"_a,
            "small_step"_a, "small_drop"_a, "large_step"_a, "least_step"_a, "edge_discount"_a, "uniqueness"_a,
            "left_right"_a, "texture"_a, "speckle_area"_a, "speckle_step"_a, "threads"_a,
            "level"_a.none())
        .def("match", &match<uint8_t>, "left"_a, "right"_a, "disparity"_a, "confidence"_a.none())
        .def("match", &match<uint16_t>, "left"_a, "right"_a, "disparity"_a, "confidence"_a.none())
        .def_prop_ro("bytes", &Matcher::bytes, "Working memory [bytes].");
    nb::class_<Refiner>(m, "Refiner", "Registration of the windows of pairs of one shape.")
        .def(
            "__init__",
            [](Refiner* self, int height, int width, int threads,
               const std::optional<std::string>& level) {
                new (self) Refiner(height, width, threads, *level_of(level).refine);
            },
            nb::kw_only(), "height"_a, "width"_a, "threads"_a, "level"_a.none())
        .def("run", &pass<Refiner, &Refiner::refine>, "left"_a, "right"_a, "disparity"_a,
             "answer"_a);
    nb::class_<Gate>(m, "Gate", "Which disparities of pairs of one shape are to be believed.")
        .def(
            "__init__",
            [](Gate* self, int height, int width, float agreement, float least, int speckle_area,
               int threads, const std::optional<std::string>& level) {
                if (height < 2 || width < 2) throw std::invalid_argument("less than 2 x 2 pixels");
                new (self) Gate(height, width, {agreement, least}, speckle_area, threads,
                                level_of(level));
            },
            nb::kw_only(), "height"_a, "width"_a, "agreement"_a, "least"_a, "speckle_area"_a,
            "threads"_a, "level"_a.none())
        .def("run", &pass<Gate, &Gate::gate>, "left"_a, "right"_a, "disparity"_a, "answer"_a);
    nb::class_<Rectifier>(m, "Rectifier", "Rectification of pairs of one shape.")
        .def(
            "__init__",
            [](Rectifier* self, const Whole& left, const Shares& left_shares, const Whole& right,
               const Shares& right_shares, int threads, const std::optional<std::string>& level) {
                const int height = static_cast<int>(left.shape(0));
                const int width = static_cast<int>(left.shape(1));
                const RawPixels maps[] = {raw_pixels(left, left_shares, height, width),
                                          raw_pixels(right, right_shares, height, width)};
                new (self) Rectifier(height, width, maps, threads, *level_of(level).rectify);
            },
            nb::kw_only(), "left"_a, "left_shares"_a, "right"_a, "right_shares"_a, "threads"_a,
            "level"_a.none())
        .def("rectify", &rectify, "left"_a, "right"_a, "rectified_left"_a, "rectified_right"_a);
    m.def("slide_rows", &slide_rows, "image"_a, "first"_a, "across"_a, "down"_a, "twist"_a,
          "answer"_a, "level"_a = nb::none(),
          "An image looked at some rows lower, by cubic convolution.");
    bind_after(m);
}

}  // namespace bearcub
