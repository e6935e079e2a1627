// What is passed has been checked by the modules that the kernels are twins of.
#include "after_bindings.h"

#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <array>

#include "face.h"
#include "fit.h"
#include "grid.h"
#include "levels.h"
#include "outline.h"
#include "parallax.h"
#include "peaks.h"
#include "profile.h"
#include "walls.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace bearcub {
namespace {

using Map = nb::ndarray<const float, nb::ndim<2>, nb::device::cpu>;
using Three = std::array<double, 3>;

template <class T>
using Grid = nb::ndarray<T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
template <class T>
using Row = nb::ndarray<T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
template <class T>
using Steps = nb::ndarray<const T, nb::ndim<2>, nb::device::cpu>;

Disparity disparity_of(const Map& map) {
    return {map.data(), static_cast<int>(map.shape(0)), static_cast<int>(map.shape(1)),
            static_cast<std::ptrdiff_t>(map.stride(0)), static_cast<std::ptrdiff_t>(map.stride(1))};
}

Lens lens_of(const std::array<double, 5>& lens) {
    return {lens[0], lens[1], lens[2], lens[3], lens[4]};
}

View view_of(const std::array<double, 5>& lens, const std::array<Three, 3>& rotation,
             const Three& origin) {
    View view{lens_of(lens), {}, {}};
    for (int j = 0; j < 3; ++j) {
        view.origin[j] = origin[j];
        for (int k = 0; k < 3; ++k) view.rotation[j][k] = rotation[j][k];
    }
    return view;
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

Surface surface_of(const std::array<float, 3>& plane, const Row<const float>& bend,
                   const Row<const float>& tolerance) {
    return {plane[0], plane[1], plane[2], bend.data(), tolerance.data(),
            static_cast<int>(bend.shape(0))};
}

void sort(const Map& map, const std::array<float, 3>& plane, const Row<const float>& bend,
          const Row<const float>& tolerance, float farthest_level, const std::array<int, 6>& part,
          const Grid<float>& disparity, const Grid<float>& floor, const Grid<float>& residual,
          const Grid<float>& allowed, const Grid<bool>& standing, const Grid<bool>& on_floor,
          const Grid<bool>& below) {
    const auto& [top, left, down, right, rows, columns] = part;
    const Surface surface = surface_of(plane, bend, tolerance);
    const Sorted to{disparity.data(), floor.data(), residual.data(), allowed.data(),
                    standing.data(), on_floor.data(), below.data()};
    sort_pixels(disparity_of(map), surface, farthest_level, {top, left, down, right, rows, columns},
                to);
}

Standing standing_of(const Grid<const float>& disparity, const Grid<const float>& floor,
                     const Grid<const bool>& standing, float nearest, float farthest) {
    return {disparity.data(), floor.data(), standing.data(), static_cast<int>(floor.shape(0)),
            static_cast<int>(floor.shape(1)), nearest, farthest};
}

std::tuple<int, float> count(const Grid<const float>& disparity, const Grid<const float>& floor,
                             const Grid<const bool>& standing, float nearest, float farthest) {
    const Count found =
        count_standing(standing_of(disparity, floor, standing, nearest, farthest));
    return {found.pixels, found.largest};
}

void cells(const Grid<const float>& disparity, const Grid<const float>& floor,
           const Grid<const bool>& standing, float nearest, float farthest,
           const Row<const int32_t>& shift, const Row<const int32_t>& level, int width, float tall,
           float overhead, const Row<int64_t>& index, const Row<int32_t>& column,
           const Row<int32_t>& cell, const Row<bool>& is_tall, const Row<bool>& is_overhead) {
    to_cells(standing_of(disparity, floor, standing, nearest, farthest),
             {shift.data(), level.data(), width, tall, overhead},
             {index.data(), column.data(), cell.data(), is_tall.data(), is_overhead.data()});
}

std::tuple<std::vector<double>, std::vector<double>, std::vector<double>> ends(
    const Steps<float>& disparity, const Steps<float>& floor, const Steps<bool>& on_floor,
    const Grid<const int32_t>& labels, const Row<const int64_t>& u, const Row<const int64_t>& v,
    const std::array<double, 5>& lens, const std::array<Three, 3>& rotation, const Three& origin,
    double first, double step, int directions, const Row<const bool>& blocks, double nearest,
    double farthest, int cells, int gap, int hits) {
    const View view = view_of(lens, rotation, origin);
    const Labelled grid{disparity.data(),
                        floor.data(),
                        on_floor.data(),
                        static_cast<std::ptrdiff_t>(disparity.stride(0)),
                        static_cast<std::ptrdiff_t>(disparity.stride(1)),
                        labels.data(),
                        u.data(),
                        v.data(),
                        static_cast<int>(labels.shape(0)),
                        static_cast<int>(labels.shape(1))};
    Ends found = find_ends(
        grid, view,
        {first, step, directions, blocks.data(), nearest, farthest, cells, gap, hits});
    return {std::move(found.seen), std::move(found.thing), std::move(found.hole)};
}

// A row of numbers that Python owns from now on.
nb::ndarray<nb::numpy, int64_t, nb::ndim<1>> owned(std::vector<int64_t>&& values) {
    auto* const kept = new std::vector<int64_t>(std::move(values));
    const nb::capsule owner(kept, [](void* p) noexcept {
        delete static_cast<std::vector<int64_t>*>(p);
    });
    return {kept->data(), {kept->size()}, owner};
}

using Grey = Steps<uint8_t>;

Image image_of(const Grey& grey) {
    if (grey.stride(1) != 1) throw std::invalid_argument("pixels of a row must lie side by side");
    return {grey.data(), static_cast<std::ptrdiff_t>(grey.stride(0))};
}

Labels labels_of(const Grid<const uint16_t>& labels, int step, int number) {
    return {labels.data(), static_cast<int>(labels.shape(1)), step, number};
}

nb::tuple pixels(const Grid<const uint16_t>& labels, int step, int number,
                 const Row<const int64_t>& index, const Map& map, const std::array<float, 3>& plane,
                 const Row<const float>& bend, const Row<const float>& tolerance, double nearest,
                 double farthest, double within, const std::optional<Grey>& left,
                 const std::optional<Grey>& right, float offset, const TrimTuning& tuning) {
    const Sampled sampled{index.data(), static_cast<int>(index.shape(0)), nearest, farthest, within};
    Pair pair{};
    if (left && right) {
        pair = {image_of(*left), image_of(*right), static_cast<int>(right->shape(1)), offset};
    }
    Pixels found = all_pixels(labels_of(labels, step, number), sampled, disparity_of(map),
                              surface_of(plane, bend, tolerance), left && right ? &pair : nullptr,
                              tuning);
    return nb::make_tuple(owned(std::move(found.u)), owned(std::move(found.v)));
}

void nearer(const Grid<const uint16_t>& labels, int step, int number, const Map& map,
            const Row<const int64_t>& u, const Row<const int64_t>& v,
            const std::vector<std::array<int, 2>>& beside, const Row<bool>& found) {
    std::vector<Beside> places;
    for (const auto& [right, down] : beside) places.push_back({right, down});
    find_nearer(labels_of(labels, step, number), disparity_of(map), u.data(), v.data(),
                static_cast<int>(u.shape(0)), places, found.data());
}

// A cloud, and how to find its face.
struct Thing : Cloud {
    FaceTuning tuning;

    Thing(const Cloud& cloud, const FaceTuning& tuning) : Cloud(cloud), tuning(tuning) {}
};

std::vector<std::tuple<int, int, float, float>> feet(
    const Grey& left, const Grey& right, const std::array<float, 3>& plane,
    const Row<const float>& bend, float offset, const std::array<int, 4>& strip,
    const std::vector<std::tuple<float, float, int, int, int, int>>& bands,
    const FeetTuning& tuning, const std::optional<std::string>& level) {
    const auto& [step, first, rows, columns] = strip;
    std::vector<Band> windows;
    for (const auto& [far, near, wide, tall, top, end] : bands) {
        windows.push_back({far, near, wide, tall, top, end});
    }
    const Pair pair{image_of(left), image_of(right), static_cast<int>(right.shape(1)), offset};
    std::vector<Foot> found;
    {
        const nb::gil_scoped_release release;
        found = find_feet(pair, surface_of(plane, bend, bend), {step, first, rows, columns}, windows,
                          tuning, *level_of(level).look);
    }
    std::vector<std::tuple<int, int, float, float>> told;
    for (const Foot& foot : found) told.emplace_back(foot.u, foot.v, foot.level, foot.sure);
    return told;
}

void look(const Grey& left, const Grey& right, const std::array<float, 3>& plane,
          const Row<const float>& bend, float offset, const std::array<int, 2>& place,
          const FeetTuning& tuning, const Grid<float>& energy, const Grid<float>& seen,
          const Grid<float>& noise) {
    const Strip strip{place[0], place[1], static_cast<int>(noise.shape(0)),
                      static_cast<int>(noise.shape(1))};
    const Pair pair{image_of(left), image_of(right), static_cast<int>(right.shape(1)), offset};
    look_for_parallax(pair, surface_of(plane, bend, bend), strip, tuning,
                      *level_of(std::nullopt).look, {energy.data(), seen.data(), noise.data()});
}

Filled filled_of(const Row<const int32_t>& cell, const Row<const bool>& tall,
                 const Row<const bool>& overhead, int levels, int columns) {
    return {cell.data(), tall.data(), overhead.data(), static_cast<int>(cell.shape(0)), levels,
            columns};
}

std::tuple<int, int> mark(const Row<const int32_t>& cell, const Row<const bool>& tall,
                          const Row<const bool>& overhead, int levels, int columns, int which,
                          int least, const Row<const uint16_t>& number,
                          const Row<const float>& least_rows, int gap,
                          const Grid<uint8_t>& closed) {
    const Span rows =
        mark_peaks(filled_of(cell, tall, overhead, levels, columns), static_cast<Which>(which), least,
                   number.data(), least_rows.data(), gap, closed.data());
    return {rows.first, rows.end};
}

void assign(const Row<const int32_t>& cell, const Row<const bool>& tall,
            const Row<const bool>& overhead, int levels, int columns, int which,
            const Grid<const uint16_t>& peaks, int foot_levels, int foot_columns, int numbered,
            const Row<uint16_t>& number) {
    number_pixels(filled_of(cell, tall, overhead, levels, columns), static_cast<Which>(which),
                  peaks.data(), foot_levels, foot_columns, numbered, number.data());
}

std::tuple<int, int, int, int, float> wall(
    const Grid<const float>& right, const Row<const float>& u, const Row<const float>& floor,
    const Grid<const float>& v, const Grid<const float>& left, const Grid<const float>& misfit,
    const Grid<const bool>& known, const std::array<float, 4>& odds, int every, int least) {
    const FloorLines part{right.data(), static_cast<int>(right.shape(0)),
                          static_cast<int>(right.shape(1)), u.data(), floor.data(), v.data(),
                          left.data(), misfit.data(), known.data(), static_cast<int>(v.shape(0)),
                          static_cast<int>(v.shape(1))};
    const nb::gil_scoped_release release;
    const Wall found = likeliest_wall(part, {odds[0], odds[1], odds[2], odds[3]}, every, least);
    return {found.far, found.near, found.left, found.right, found.gain};
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
        .def(nb::init<double, double, double, int, double, double, int, int, int, double, int,
                      double, double, double, double, int, double, double, double, double, double,
                      double, double>(),
             nb::kw_only(), "knee"_a, "near_bin"_a, "far_bin"_a, "near_bins"_a, "iqr"_a,
             "farthest"_a, "rows"_a, "columns"_a, "reach"_a, "half_width"_a, "least"_a, "share"_a,
             "step"_a, "correlated"_a, "deep"_a, "again"_a, "highest_step"_a, "mixed"_a,
             "smallest"_a, "largest"_a, "noisiest"_a, "rounding"_a, "most"_a);
    m.def("fit_plane", &fit);
    m.def("follow_floor", &follow);
    m.def("sort_pixels", &sort);
    m.def("count_standing", &count);
    m.def("count_valid", [](const Grid<const float>& disparity) {
        const Valid found = count_valid(disparity.data(), static_cast<int64_t>(disparity.size()));
        return std::tuple(found.sound, found.unmatched);
    });
    m.def("to_cells", &cells);
    m.def("find_ends", &ends);
    m.def("mark_peaks", &mark);
    nb::class_<FaceTuning>(m, "FaceTuning")
        .def(nb::init<int, double, double, double, double, double, int, double, double>(),
             nb::kw_only(), "near"_a, "leans"_a, "sharpest"_a, "rounds"_a, "no_noise"_a, "roundest"_a,
             "straight"_a, "on_line"_a, "most"_a);
    nb::class_<Thing>(m, "Cloud")
        .def("__init__",
             [](Thing* self, const std::array<double, 5>& lens,
                const std::array<Three, 3>& rotation, const Three& origin,
                const Row<const double>& u, const Row<const double>& v,
                const Row<const float>& disparity, const FaceTuning& tuning) {
                 new (self) Thing(Cloud(view_of(lens, rotation, origin), u.data(), v.data(),
                                        disparity.data(), static_cast<int>(u.shape(0))),
                                  tuning);
             })
        .def("sides",
             [](const Thing& cloud, double step, double share) {
                 const Cloud::Ends ends = cloud.sides(step, share);
                 return std::tuple(ends.low, ends.high);
             })
        .def("heights",
             [](const Thing& cloud, double step, double share) {
                 const Cloud::Ends ends = cloud.heights(step, share);
                 return std::tuple(ends.low, ends.high);
             })
        .def("face",
             [](const Thing& thing, double right, double left, double pixel, double blur,
                double alike) {
                 const Face face = face_of(thing, right, left, pixel, blur, alike, thing.tuning);
                 return std::tuple(face.range_right, face.range_left, face.width, face.distance,
                                   face.nearest, face.count);
             })
        .def("range", &Cloud::range)
        .def("height_before", &Cloud::height_before)
        .def("squares", &Cloud::squares)
        .def("spread", [](const Thing& cloud) {
            const Cloud::Spread sums = cloud.spread();
            return std::tuple(sums.range, sums.together, sums.height);
        });
    m.def("number_pixels", &assign);
    nb::class_<TrimTuning>(m, "TrimTuning")
        .def(nb::init<int, int, float, int, int, float>(), nb::kw_only(), "narrow_columns"_a,
             "narrow_rows"_a, "fringe"_a, "widest_fringe"_a, "edge"_a, "grows"_a);
    m.def("all_pixels", &pixels, "labels"_a, "step"_a, "number"_a, "index"_a, "whole"_a, "plane"_a,
          "bend"_a, "tolerance"_a, "nearest"_a, "farthest"_a, "within"_a, "left"_a.none(),
          "right"_a.none(), "offset"_a, "tuning"_a);
    m.def("find_nearer", &nearer);
    nb::class_<FeetTuning>(m, "FeetTuning")
        .def(nb::init<float, float, float, float, int, int>(), nb::kw_only(), "sure"_a,
             "least_share"_a, "most_share"_a, "noise"_a, "around_columns"_a, "around_rows"_a);
    m.def("find_feet", &feet, "left"_a, "right"_a, "plane"_a, "bend"_a, "offset"_a, "strip"_a,
          "bands"_a, "tuning"_a, "level"_a = nb::none());
    m.def("look_for_parallax", &look);
    m.def("likeliest_wall", &wall);
    m.def("let_go",
          [](const Row<const bool>& overhead, const Row<const int64_t>& index, int columns,
             double share, const Row<uint16_t>& number) {
              let_go(overhead.data(), index.data(), static_cast<int>(number.shape(0)), columns, share,
                     number.data());
          });
    m.def("count_heights",
          [](const Row<const uint16_t>& number, const Row<const int32_t>& column,
             const Grid<int32_t>& heights) {
              count_heights(number.data(), column.data(), static_cast<int>(number.shape(0)),
                            static_cast<int>(heights.shape(1)), heights.data());
          });
    m.def("find_strips",
          [](const Row<const int32_t>& heights, int gap, double share) {
              Strips strips =
                  find_strips(heights.data(), static_cast<int>(heights.shape(0)), gap, share);
              return std::tuple(std::move(strips.bounds), strips.first_high, strips.last_high);
          });
}

}  // namespace bearcub
