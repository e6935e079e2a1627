// What is passed has been checked by the modules that the kernels are twins of.
#include "after_bindings.h"

#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <array>

#include "fit.h"
#include "profile.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace bearcub {
namespace {

using Map = nb::ndarray<const float, nb::ndim<2>, nb::device::cpu>;
using Three = std::array<double, 3>;

Disparity disparity_of(const Map& map) {
    return {map.data(), static_cast<int>(map.shape(0)), static_cast<int>(map.shape(1)),
            static_cast<std::ptrdiff_t>(map.stride(0)), static_cast<std::ptrdiff_t>(map.stride(1))};
}

Lens lens_of(const std::array<double, 5>& lens) {
    return {lens[0], lens[1], lens[2], lens[3], lens[4]};
}

using FitAnswer = std::tuple<Three, double, std::array<Three, 3>, int, int, int, int>;

std::optional<FitAnswer> fit(const Map& map, const std::array<double, 5>& lens,
                             const std::array<double, 9>& expected, double unevenness,
                             const FitTuning& tuning) {
    const std::array<double, 9>& e = expected;
    const Expected prior{e[0], e[1], e[2], e[3], e[4], e[5], e[6], e[7], e[8]};
    std::optional<Fit> found;
    {
        const nb::gil_scoped_release release;
        found = fit_plane(disparity_of(map), lens_of(lens), prior, unevenness, tuning);
    }
    if (!found) return std::nullopt;
    std::array<Three, 3> normal;
    for (int j = 0; j < 3; ++j) {
        for (int k = 0; k < 3; ++k) normal[j][k] = found->normal[j][k];
    }
    const auto& [a, b, c] = found->plane;
    return FitAnswer{{a, b, c}, found->noise, normal, found->here, found->on, found->above,
                     found->stride};
}

std::tuple<std::vector<std::array<double, 4>>, std::vector<int>, double> follow(
    const Map& map, const std::array<double, 5>& lens, const Three& plane, double noise,
    double height, double pitch, double steepest, const ProfileTuning& tuning) {
    Followed followed;
    {
        const nb::gil_scoped_release release;
        const JustAhead start{{plane[0], plane[1], plane[2]}, noise, height, pitch, steepest};
        followed = follow_floor(disparity_of(map), lens_of(lens), start, tuning);
    }
    std::vector<std::array<double, 4>> bins;
    for (const Bin& bin : followed.bins) bins.push_back({bin.level, bin.bend, bin.spread, bin.error});
    return {bins, followed.parts, followed.end};
}

}  // namespace

void bind_after(nb::module_& m) {
    nb::class_<FitTuning>(m, "FitTuning")
        .def(nb::init<std::vector<double>, std::vector<double>, int, int, int, double, int, int,
                      double, int, double, double, double, double, double, double, double, double,
                      double>(),
             nb::kw_only(), "draws"_a, "steps"_a, "scored"_a, "finalists"_a, "refined"_a,
             "anneal"_a, "least_steps"_a, "most_steps"_a, "settled"_a, "few"_a, "least_noise"_a,
             "most_noise"_a, "remote"_a, "below"_a, "near"_a, "whole"_a, "half_width"_a, "close"_a,
             "biweight"_a);
    nb::class_<ProfileTuning>(m, "ProfileTuning")
        .def(nb::init<double, double, double, int, double, double, int, int, double, int, double,
                      double, double, double, int, double, double, double, double, double,
                      double>(),
             nb::kw_only(), "knee"_a, "near_bin"_a, "far_bin"_a, "near_bins"_a, "iqr"_a,
             "farthest"_a, "rows"_a, "columns"_a, "half_width"_a, "least"_a, "share"_a, "step"_a,
             "correlated"_a, "deep"_a, "again"_a, "highest_step"_a, "mixed"_a, "smallest"_a,
             "largest"_a, "rounding"_a, "most"_a);
    m.def("fit_plane", &fit);
    m.def("follow_floor", &follow);
}

}  // namespace bearcub
