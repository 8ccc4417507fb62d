// SPDX-License-Identifier: MIT
#include "conversions.h"
#include "terrain.h"

#include <terrane/terrain/fractal_heights.h>

#include <pybind11/stl.h>

#include <array>
#include <cmath>
#include <string>

namespace terrane::python {
namespace {

constexpr std::array<std::pair<const char*, FractalKind>, 4> kFractalKinds{
    {{"fbm", FractalKind::fbm},
     {"ridged", FractalKind::ridged},
     {"hybrid", FractalKind::hybrid},
     {"warped", FractalKind::warped}}};

Source make_fractal(std::uint64_t seed, const std::string& kind, int octave_count, double amplitude,
                    int wavelength_log2, double gain, double heterogeneity, double crest_rounding,
                    double warp, int finest_spacing_log2, int root_size_log2,
                    std::pair<std::int32_t, std::int32_t> first_root,
                    std::pair<std::int32_t, std::int32_t> root_count, std::int32_t root_window,
                    std::pair<double, double> origin) {
    const FractalSettings settings{.seed = seed,
                                   .kind = read_choice(kind, "kind", kFractalKinds),
                                   .octave_count = octave_count,
                                   .amplitude = amplitude,
                                   .wavelength_log2 = wavelength_log2,
                                   .gain = gain,
                                   .heterogeneity = heterogeneity,
                                   .crest_rounding = crest_rounding,
                                   .warp = warp,
                                   .finest_spacing_log2 = finest_spacing_log2,
                                   .root_size_log2 = root_size_log2,
                                   .first_root_x = first_root.first,
                                   .first_root_y = first_root.second,
                                   .root_count_x = root_count.first,
                                   .root_count_y = root_count.second,
                                   .root_window = root_window,
                                   .origin_x = origin.first,
                                   .origin_y = origin.second};
    return {value_or_raise(without_lock([&] { return FractalHeights::create(settings); })),
            py::none()};
}

void bind_fractal(py::module_& module) {
    const FractalSettings defaults;
    module.def(
        "fractal", &make_fractal, py::kw_only(), py::arg("seed") = defaults.seed,
        py::arg("kind") = "fbm", py::arg("octave_count") = defaults.octave_count,
        py::arg("amplitude") = defaults.amplitude,
        py::arg("wavelength_log2") = defaults.wavelength_log2, py::arg("gain") = defaults.gain,
        py::arg("heterogeneity") = defaults.heterogeneity,
        py::arg("crest_rounding") = defaults.crest_rounding, py::arg("warp") = defaults.warp,
        py::arg("finest_spacing_log2") = defaults.finest_spacing_log2,
        py::arg("root_size_log2") = defaults.root_size_log2,
        py::arg("first_root") = std::pair(defaults.first_root_x, defaults.first_root_y),
        py::arg("root_count") = std::pair(defaults.root_count_x, defaults.root_count_y),
        py::arg("root_window") = defaults.root_window,
        py::arg("origin") = std::pair(defaults.origin_x, defaults.origin_y),
        R"(Makes fractal ground: octaves of gradient noise, the same bits for a seed on every machine.

kind            "fbm", "ridged", "hybrid" or "warped"
octave_count    1 to 24
amplitude       of the first octave, metres, 0 to 1e5
wavelength_log2 the first octave's wavelength is 2**this metres, 0 to 24
gain            amplitude ratio of successive octaves, > 0 to 1
heterogeneity   ridged and hybrid, 0 to 1
crest_rounding  ridged, 1/64 to 1
warp            warped, 0 to 1
finest_spacing_log2  the lattice's spacing is 2**this metres, -16 to 16
root_size_log2  the side of a root square is 2**this metres, at least 7 above the spacing
first_root      column and row of the south-western root square
root_count      root squares to the east and to the north
root_window     root squares along the window around the camera that is resident, even, 4 to 64; 0: all
origin          world x, y of lattice point (0, 0), metres, multiples of a root square's side; changes no height

Raises ValueError for a setting out of range.)");
}

// Heights of the true surface at many points.
py::object heights_of(const Source& source, const py::object& x, const py::object& y) {
    const Doubles xs = read_doubles(x, "x");
    const Doubles ys = read_doubles(y, "y");
    check_same_shape(xs, "x", ys, "y");
    py::array_t<double> out(shape_of(xs));
    const double* from_x = xs.data();
    const double* from_y = ys.data();
    double* to = out.mutable_data();
    const py::ssize_t count = xs.size();
    without_lock([&] {
        for (py::ssize_t i = 0; i < count; ++i) {
            const bool is_finite = std::isfinite(from_x[i]) && std::isfinite(from_y[i]);
            to[i] = is_finite ? source.heights->height(from_x[i], from_y[i]) : std::nan("");
        }
    });
    return out;
}

// Heights at the lattice points of a rectangle.
py::object sample(const Source& source, std::pair<std::int64_t, std::int64_t> corner, int columns,
                  int rows, std::int64_t step) {
    constexpr int kMostSide = 1 << 16;
    constexpr std::int64_t kFarthest = std::int64_t{1} << 55;
    if (columns < 1 || rows < 1 || columns > kMostSide || rows > kMostSide)
        throw py::value_error("columns and rows must be 1 to 65536, got " +
                              std::to_string(columns) + " and " + std::to_string(rows));
    if (step < 1 || (step & (step - 1)) != 0 || step > (std::int64_t{1} << 24))
        throw py::value_error("step must be a power of two up to 2**24, got " +
                              std::to_string(step));
    if (std::abs(corner.first) > kFarthest || std::abs(corner.second) > kFarthest)
        throw py::value_error("corner must be within 2**55 of lattice point (0, 0)");
    const SampleGrid grid{
        .corner = {corner.first, corner.second}, .step = step, .columns = columns, .rows = rows};
    py::array_t<double> out({static_cast<py::ssize_t>(rows), static_cast<py::ssize_t>(columns)});
    const std::span<double> numbers(out.mutable_data(), grid.size());
    value_or_raise(without_lock([&] { return source.heights->sample(grid, numbers); }));
    return out;
}

py::object lattice_of(const Source& source) {
    const Lattice& lattice = source.heights->lattice();
    return make_answer("Lattice", py::make_tuple(lattice.origin_x, lattice.origin_y),
                       lattice.spacing, lattice.quantum, lattice.finest_level, lattice.root_size(),
                       py::make_tuple(lattice.first_root_x, lattice.first_root_y),
                       py::make_tuple(lattice.root_count_x, lattice.root_count_y));
}

py::object interval_of(const Source& source, double west, double south, double east, double north) {
    if (!(west <= east && south <= north) || !std::isfinite(east - west) ||
        !std::isfinite(north - south))
        throw py::value_error("the rectangle must be finite, with west <= east, south <= north");
    const HeightInterval interval = source.heights->interval({west, south, east, north});
    return py::make_tuple(interval.low, interval.high);
}

}  // namespace

void bind_sources(py::module_& module) {
    py::class_<Source, std::shared_ptr<Source>>(
        module, "HeightSource",
        "Where heights come from: a fractal, a raster, a baked store. Immutable; any thread.")
        .def(
            "heights", &heights_of, py::arg("x"), py::arg("y"),
            R"(The true surface at places: world z in metres, in the shape of x; NaN where x or y is not finite or the
source cannot be read. Continues smoothly beyond the extent.

x, y  world, metres, of one shape)")
        .def(
            "sample", &sample, py::arg("corner"), py::arg("columns"), py::arg("rows"),
            py::arg("step") = 1,
            R"(Heights of a grid of lattice points: float64 of shape (rows, columns), metres, row 0 south, column 0 west.

corner  column and row of the south-western one on the finest lattice
step    finest spacings between neighbours, a power of two

Raises OSError where the source cannot be read.)")
        .def("interval", &interval_of, py::arg("west"), py::arg("south"), py::arg("east"),
             py::arg("north"),
             "Lowest and highest height of the true surface over a rectangle, metres: certified, "
             "not always reached.")
        .def(
            "rise_bound",
            [](const Source& source, double distance) {
                if (!(distance >= 0.0))
                    throw py::value_error("distance must be at least 0, got " +
                                          std::to_string(distance));
                return source.heights->rise_bound(distance);
            },
            py::arg("distance"),
            "Upper bound of the height difference of two points at most `distance` metres apart in "
            "the plane, metres.")
        .def_property_readonly(
            "extent",
            [](const Source& source) {
                const WorldRect& rect = source.heights->extent();
                return py::make_tuple(rect.west, rect.south, rect.east, rect.north);
            },
            "The rectangle that has ground: west, south, east, north, metres.")
        .def_property_readonly("lattice", &lattice_of, "The addresses of samples: a Lattice.")
        .def_property_readonly(
            "info", [](const Source& source) { return source.info; },
            "A DemInfo of a raster, a StoreInfo of a store, else None.")
        .def(
            "georeference",
            [](const Source& source) {
                if (!source.make_georeference) throw py::value_error("this source is no raster");
                return source.make_georeference();
            },
            "The place of a raster on the Earth: a Georeference. ValueError without a CRS.")
        .def(
            "http_statistics",
            [](const Source& source) {
                if (!source.http_statistics)
                    throw py::value_error("this source was not opened by open_http()");
                return source.http_statistics();
            },
            "What was read from the server of open_http(), and what went wrong: HttpStatistics.");
    bind_fractal(module);
    bind_files(module);
}

}  // namespace terrane::python
