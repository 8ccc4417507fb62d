// SPDX-License-Identifier: MIT
#include "base/settings_check.h"
#include "base/simd_level.h"
#include "source/fractal/amplitude_field.h"
#include "source/fractal/fractal_bounds.h"
#include "source/fractal/fractal_surface.h"
#include "source/fractal/noise.h"
#include "source/mesh_bounds.h"

#include <terrane/base/result.h>
#include <terrane/base/text.h>
#include <terrane/terrain/fractal_heights.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

namespace terrane {

AmplitudeField::AmplitudeField(const DetailField& field)
    : origin_x_(field.node_origin_x),
      origin_y_(field.node_origin_y),
      spacing_x_(field.node_spacing_x),
      spacing_y_(field.node_spacing_y),
      columns_(field.columns),
      rows_(field.rows),
      nodes_(field.amplitude) {
    Level cells{std::max(columns_ - 1, 1), std::max(rows_ - 1, 1), {}};
    for (int row = 0; row < cells.rows; ++row) {
        for (int column = 0; column < cells.columns; ++column) {
            cells.blocks.push_back(make_cell(column, row));
        }
    }
    levels_.push_back(std::move(cells));
    while (levels_.back().blocks.size() > 1) {
        const Level& fine = levels_.back();
        Level coarse{(fine.columns + 1) / 2, (fine.rows + 1) / 2, {}};
        coarse.blocks.resize(static_cast<std::size_t>(coarse.columns) *
                             static_cast<std::size_t>(coarse.rows));
        for (int row = 0; row < fine.rows; ++row) {
            for (int column = 0; column < fine.columns; ++column) {
                coarse
                    .blocks[static_cast<std::size_t>(row / 2) *
                                static_cast<std::size_t>(coarse.columns) +
                            static_cast<std::size_t>(column / 2)]
                    .include(fine.blocks[static_cast<std::size_t>(row) *
                                             static_cast<std::size_t>(fine.columns) +
                                         static_cast<std::size_t>(column)]);
            }
        }
        levels_.push_back(std::move(coarse));
    }
}

double AmplitudeField::amplitude(const Place& x, const Place& y) const {
    const double south_west = node(x.low, y.low), south_east = node(x.high, y.low);
    const double north_west = node(x.low, y.high), north_east = node(x.high, y.high);
    const double south = south_west + x.fraction * (south_east - south_west);
    const double north = north_west + x.fraction * (north_east - north_west);
    return south + y.fraction * (north - south);
}

AmplitudeBounds AmplitudeField::over(const WorldRect& rect) const {
    const Stretch x = stretch(place_x(rect.west), place_x(rect.east), levels_[0].columns);
    const Stretch y = stretch(place_y(rect.south), place_y(rect.north), levels_[0].rows);
    // A larger rectangle uses the same level or a coarser one, whose blocks are unions of finer blocks. The blocks of a
    // larger rectangle therefore contain the blocks of this one.
    const int longest = std::max(x.last - x.first, y.last - y.first);
    std::size_t level = 0;
    while ((longest >> level) > 3) ++level;
    const Level& blocks = levels_[level];
    Block most;
    for (int row = y.first >> level; row <= y.last >> level; ++row) {
        for (int column = x.first >> level; column <= x.last >> level; ++column) {
            most.include(blocks.blocks[static_cast<std::size_t>(row) *
                                           static_cast<std::size_t>(blocks.columns) +
                                       static_cast<std::size_t>(column)]);
        }
    }
    const double slope_x = most.slope_x, slope_y = most.slope_y;
    return {most.most, std::sqrt(slope_x * slope_x + slope_y * slope_y) * (1.0 + 0x1p-40)};
}

AmplitudeBounds AmplitudeField::everywhere() const {
    const Block& all = levels_.back().blocks.front();
    const double slope_x = all.slope_x, slope_y = all.slope_y;
    return {all.most, std::sqrt(slope_x * slope_x + slope_y * slope_y) * (1.0 + 0x1p-40)};
}

void AmplitudeField::Block::include(const Block& other) {
    most = std::max(most, other.most);
    slope_x = std::max(slope_x, other.slope_x);
    slope_y = std::max(slope_y, other.slope_y);
}

AmplitudeField::Place AmplitudeField::place(double coordinate, double origin, double spacing,
                                            int nodes) {
    const double position = (coordinate - origin) / spacing;
    if (!(position > 0.0)) return {0, 0, 0.0};
    if (position >= nodes - 1) return {nodes - 1, nodes - 1, 0.0};
    const double low = std::floor(position);
    return {static_cast<int>(low), static_cast<int>(low) + 1, position - low};
}

AmplitudeField::Stretch AmplitudeField::stretch(const Place& from, const Place& to, int cells) {
    return {std::min(from.low, cells - 1), std::min(to.low, cells - 1)};
}

double AmplitudeField::node(int column, int row) const {
    return static_cast<double>(
        nodes_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
               static_cast<std::size_t>(column)]);
}

AmplitudeField::Block AmplitudeField::make_cell(int column, int row) const {
    const int east = std::min(column + 1, columns_ - 1), north = std::min(row + 1, rows_ - 1);
    const double a00 = node(column, row), a10 = node(east, row);
    const double a01 = node(column, north), a11 = node(east, north);
    // the slope of a bilinear cell along an axis lies between the slopes of its two sides
    const double rise_x = std::max(std::abs(a10 - a00), std::abs(a11 - a01));
    const double rise_y = std::max(std::abs(a01 - a00), std::abs(a11 - a10));
    return {round_up(std::max({a00, a10, a01, a11})), round_up(rise_x / spacing_x_ * kOutward),
            round_up(rise_y / spacing_y_ * kOutward)};
}

// The surface is base(x, y) + a(x, y) N(u, v). N is a sum of octaves of gradient noise without offsets, in grid
// coordinates u = (x - origin_x) / cell_x and v likewise, with wavelengths of 2^-octave cells. Every octave therefore
// has nodes at all integers (u, v) and vanishes there. a is the bilinear amplitude.
//
// Bounds. Over a right triangle with corners v_i, hypotenuse l and largest amplitude A, for p = sum w_i v_i:
//
//   |a N(p) - sum w_i a N(v_i)| <= a(p) |N(p) - sum w_i N(v_i)| + sum w_i |a(p) - a(v_i)| |N(v_i)|
//                               <= A B(l) + slope(a) l / 2 sup |N|,  and  <= 2 A sup |N|,
//
// where B is the interpolation bound of OctaveBounds for unit amplitude, with wavelengths in metres computed from the
// smaller side of the cell, and sum w_i |p - v_i| <= l / 2 as in function_heights.cpp. This deviation adds to that of
// the base, because both are interpolated linearly over the same triangles.
//
// Nesting. A and slope(a) are taken over a square around the vertex that contains the squares of its children, so that
// the bound does not increase from parent to child. The square has a half side of 3 s around a centre of spacing s, and
// of 2 s around a midpoint. A midpoint is a distance s from its parent, a centre, along an axis: 3 s = s + 2 s. A
// centre of spacing s / 2 is s / 2 from its parent, a midpoint, along both axes: 2 s = s / 2 + 3 s / 2. This also holds
// after rounding, because lattice integers are converted to coordinates and node indices by monotone operations.

namespace {

constexpr std::uint64_t kAllCells = ~std::uint64_t{0};

/// Conversion from lattice indices to grid coordinates along one axis.
struct GridAxis {
    double lattice_origin = 0.0;
    double lattice_spacing = 1.0;
    double offset = 0.0;  ///< grid coordinate of lattice index 0
    double ratio = 1.0;   ///< cells per spacing of the lattice

    /// Corrects rounding errors, because of which the noise would not be zero at the grid's points. A ratio of spacing
    /// to cell close to a power of two becomes that power. A grid point within a millionth of the spacing of a lattice
    /// point becomes that point.
    static GridAxis make(double lattice_origin, double lattice_spacing, double grid_origin,
                         double cell) {
        GridAxis axis{lattice_origin, lattice_spacing, (lattice_origin - grid_origin) / cell,
                      lattice_spacing / cell};
        int exponent = 0;
        const double mantissa = std::frexp(axis.ratio, &exponent);  // 1/2 to 1
        const double power = std::ldexp(1.0, mantissa < 0.75 ? exponent - 1 : exponent);
        if (std::abs(axis.ratio - power) > 1e-9 * power) return axis;
        axis.ratio = power;
        const double steps = std::floor(axis.offset / power + 0.5);
        if (std::abs(axis.offset / power - steps) < 1e-6) axis.offset = steps * power;
        return axis;
    }

    double at_index(std::int64_t index) const {
        return offset + static_cast<double>(index) * ratio;
    }
    double at(double world) const {
        return offset + (world - lattice_origin) / lattice_spacing * ratio;
    }
};

/// A grid coordinate, in cells of an octave. Grid coordinates are clamped to +-2^38 cells.
NoiseCoordinate octave_coordinate(double grid, double frequency) {
    const double position = std::clamp(grid, -0x1p38, 0x1p38) * frequency;
    const double cell = std::floor(position);
    return {static_cast<std::uint64_t>(static_cast<std::int64_t>(cell)), position - cell};
}

struct Octave {
    double weight = 1.0;     ///< gain^octave
    double frequency = 1.0;  ///< 2^octave
    NoiseKeys keys;
};

std::vector<Octave> make_octaves(const DetailSettings& settings) {
    std::vector<Octave> octaves;
    double weight = 1.0;
    for (int index = 0; index < settings.octave_count; ++index) {
        octaves.push_back({weight, std::ldexp(1.0, index), NoiseKeys::make(settings.seed, index)});
        weight *= settings.gain;
    }
    return octaves;
}

std::vector<OctaveScale> make_scales(const std::vector<Octave>& octaves, double cell) {
    std::vector<OctaveScale> scales;
    for (const Octave& octave : octaves) scales.push_back({octave.weight, cell / octave.frequency});
    return scales;
}

class Detail final : public HeightSource {
public:
    Detail(std::shared_ptr<const HeightSource> base, const DetailField& field,
           const DetailSettings& settings)
        : HeightSource(base->lattice(), base->extent()),
          base_(std::move(base)),
          octaves_(make_octaves(settings)),
          unit_bounds_(make_scales(octaves_, std::min(field.cell_x, field.cell_y))),
          amplitude_(field),
          axis_x_(
              GridAxis::make(lattice().origin_x, lattice().spacing, field.origin_x, field.cell_x)),
          axis_y_(
              GridAxis::make(lattice().origin_y, lattice().spacing, field.origin_y, field.cell_y)) {
        // rounding in the conversion of a coordinate to (u, v) changes the noise by at most its slope times the error
        const double reach = std::max({std::abs(extent().west), std::abs(extent().east),
                                       std::abs(extent().south), std::abs(extent().north),
                                       std::abs(field.origin_x), std::abs(field.origin_y)});
        rounding_ = unit_bounds_.rise(0x1p-48 * reach);
    }

    double height(double x, double y) const override {
        const double u = axis_x_.at(x), v = axis_y_.at(y);
        double sum = 0.0;
        for (const Octave& octave : octaves_) {
            sum +=
                octave.weight *
                noise(
                    noise_place(octave.keys.x, kAllCells, octave_coordinate(u, octave.frequency)),
                    noise_place(octave.keys.y, kAllCells, octave_coordinate(v, octave.frequency)));
        }
        return base_->height(x, y) +
               amplitude_.amplitude(amplitude_.place_x(x), amplitude_.place_y(y)) * sum;
    }

    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        TERRANE_TRY(base_->sample(grid, heights_out));
        const std::vector<double> noise_sums = sample_noise(grid);
        std::vector<AmplitudeField::Place> places;
        for (int column = 0; column < grid.columns; ++column) {
            places.push_back(amplitude_.place_x(lattice().x(grid.corner.x + grid.step * column)));
        }
        std::size_t index = 0;
        for (int row = 0; row < grid.rows; ++row) {
            const AmplitudeField::Place place_y =
                amplitude_.place_y(lattice().y(grid.corner.y + grid.step * row));
            for (const AmplitudeField::Place& place_x : places) {
                heights_out[index] += amplitude_.amplitude(place_x, place_y) * noise_sums[index];
                ++index;
            }
        }
        return {};
    }

    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        TERRANE_TRY(base_->vertex_bounds(grid, bounds_out));
        add_to_vertices(grid, bounds_out);
        return {};
    }

    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        TERRANE_TRY(base_->cell_bounds(grid, bounds_out));
        add_to_cells(grid, bounds_out);
        return {};
    }

    Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                             std::span<float> cell_bounds_out) const override {
        TERRANE_TRY(base_->mesh_bounds(grid, vertex_bounds_out, cell_bounds_out));
        add_to_vertices(grid, vertex_bounds_out);
        add_to_cells(grid, cell_bounds_out);
        return {};
    }

    Result<void> cell_flags(const SampleGrid& grid,
                            std::span<std::uint8_t> flags_out) const override {
        return base_->cell_flags(grid, flags_out);
    }

    HeightInterval interval(const WorldRect& rect) const override {
        const HeightInterval base = base_->interval(rect);
        const double own = amplitude_.over(rect).most * unit_bounds_.sup() * kOutward;
        // for the rounding of the sum, which the outward rounding of `own` may be too small to cover
        const double slack = own > 0.0 ? 0x1p-50 * (std::abs(base.low) + std::abs(base.high)) : 0.0;
        return {base.low - own - slack, base.high + own + slack};
    }

    double rise_bound(double distance) const override {
        const AmplitudeBounds amplitude = amplitude_.everywhere();
        const double own = std::min(2.0 * amplitude.most * unit_bounds_.sup(),
                                    amplitude.most * (unit_bounds_.rise(distance) + rounding_) +
                                        amplitude.slope * distance * unit_bounds_.sup());
        return (base_->rise_bound(distance) + own) * kOutward;
    }

    bool is_certified() const override { return base_->is_certified(); }

private:
    /// Terms of the bound of the detail's deviation over right triangles of one size.
    struct Triangles {
        double interpolation = 0.0;  ///< bound of the deviation for unit amplitude
        double radius = 0.0;         ///< half the hypotenuse
    };

    Triangles triangles(double hypotenuse) const {
        return {unit_bounds_.interpolation(hypotenuse) + rounding_, 0.5 * hypotenuse};
    }

    void add_to_vertices(const SampleGrid& grid, std::span<float> bounds) const {
        const double spacing = lattice().spacing * static_cast<double>(grid.step);
        const Triangles of_centre = triangles(kSqrt2 * (2.0 * spacing));
        const Triangles of_midpoint = triangles(2.0 * spacing);
        for (int row = 0; row < grid.rows; ++row) {
            for (int column = 0; column < grid.columns; ++column) {
                if (((row | column) & 1) == 0) continue;  // vertex of a coarser spacing
                const bool centre = (row & column & 1) != 0;
                const std::int64_t reach = (centre ? 3 : 2) * grid.step;
                const LatticePoint at = {grid.corner.x + grid.step * column,
                                         grid.corner.y + grid.step * row};
                const WorldRect around =
                    rect({at.x - reach, at.y - reach}, {at.x + reach, at.y + reach});
                add(own_bound(around, centre ? of_centre : of_midpoint),
                    bounds[static_cast<std::size_t>(row * grid.columns + column)]);
            }
        }
    }

    void add_to_cells(const SampleGrid& grid, std::span<float> bounds) const {
        const Triangles of_cell =
            triangles(kSqrt2 * (lattice().spacing * static_cast<double>(grid.step)));
        std::size_t index = 0;
        for (int row = 0; row + 1 < grid.rows; ++row) {
            for (int column = 0; column + 1 < grid.columns; ++column) {
                const LatticePoint low = {grid.corner.x + grid.step * column,
                                          grid.corner.y + grid.step * row};
                const WorldRect cell = rect(low, {low.x + grid.step, low.y + grid.step});
                add(own_bound(cell, of_cell), bounds[index++]);
            }
        }
    }

    double own_bound(const WorldRect& around, const Triangles& triangles) const {
        const AmplitudeBounds amplitude = amplitude_.over(around);
        return std::min(2.0 * amplitude.most * unit_bounds_.sup(),
                        amplitude.most * triangles.interpolation +
                            amplitude.slope * triangles.radius * unit_bounds_.sup());
    }

    static void add(double own, float& bound) {
        bound = round_up((static_cast<double>(bound) + own) * kOutward);
    }

    WorldRect rect(const LatticePoint& low, const LatticePoint& high) const {
        return {lattice().x(low.x), lattice().y(low.y), lattice().x(high.x), lattice().y(high.y)};
    }

    /// N at the points of a grid.
    std::vector<double> sample_noise(const SampleGrid& grid) const {
        std::vector<double> sums(grid.size());
        for (int west = 0; west < grid.columns; west += internal::kMaxNoiseColumns) {
            add_noise(grid, west, std::min(internal::kMaxNoiseColumns, grid.columns - west), sums);
        }
        return sums;
    }

    /// Adds N at `count` columns of the grid, starting at column `west`, to the sums.
    void add_noise(const SampleGrid& grid, int west, int count, std::vector<double>& sums) const {
        NoiseColumns columns(internal::noise_kernels(internal::best_simd_level()));
        internal::NoiseRow noise_row;
        std::array<NoiseCoordinate, internal::kMaxNoiseColumns> coordinates;
        alignas(64) std::array<double, internal::kMaxNoiseColumns> row_sums{};
        for (const Octave& octave : octaves_) {
            for (int column = 0; column < count; ++column) {
                const double u = axis_x_.at_index(grid.corner.x + grid.step * (west + column));
                coordinates[static_cast<std::size_t>(column)] =
                    octave_coordinate(u, octave.frequency);
            }
            columns.assign(octave.keys.x, kAllCells,
                           std::span(coordinates).first(static_cast<std::size_t>(count)));
            for (int row = 0; row < grid.rows; ++row) {
                const double v = axis_y_.at_index(grid.corner.y + grid.step * row);
                double* const out =
                    &sums[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) +
                          static_cast<std::size_t>(west)];
                columns.find_row(octave.keys.y, kAllCells, octave_coordinate(v, octave.frequency),
                                 noise_row);
                std::copy_n(out, count, row_sums.begin());
                columns.add(noise_row, octave.weight, row_sums.data());
                std::copy_n(row_sums.begin(), count, out);
            }
        }
    }

    std::shared_ptr<const HeightSource> base_;
    std::vector<Octave> octaves_;
    OctaveBounds unit_bounds_;
    AmplitudeField amplitude_;
    GridAxis axis_x_, axis_y_;
    double rounding_ = 0.0;  ///< rounding error of the noise for unit amplitude, metres
};

Result<void> check(const DetailField& field) {
    const auto refuse = [](const std::string& what, double value) -> Result<void> {
        return fail(ErrorCode::invalid_argument, what + ", got " + number_text(value));
    };
    const std::pair<const char*, double> places[] = {{"origin_x", field.origin_x},
                                                     {"origin_y", field.origin_y},
                                                     {"node_origin_x", field.node_origin_x},
                                                     {"node_origin_y", field.node_origin_y}};
    for (const auto& [name, value] : places) {
        if (!std::isfinite(value)) return refuse(std::string(name) + " must be finite", value);
    }
    const std::pair<const char*, double> sizes[] = {{"cell_x", field.cell_x},
                                                    {"cell_y", field.cell_y},
                                                    {"node_spacing_x", field.node_spacing_x},
                                                    {"node_spacing_y", field.node_spacing_y}};
    for (const auto& [name, value] : sizes) {
        if (!(value > 0.0) || !std::isfinite(value)) {
            return refuse(std::string(name) + " must be > 0 m", value);
        }
    }
    if (field.columns < 1) return refuse("columns must be at least 1", field.columns);
    if (field.rows < 1) return refuse("rows must be at least 1", field.rows);
    const std::size_t wanted =
        static_cast<std::size_t>(field.columns) * static_cast<std::size_t>(field.rows);
    if (field.amplitude.size() != wanted) {
        return refuse("amplitude must have " + std::to_string(wanted) + " nodes",
                      static_cast<double>(field.amplitude.size()));
    }
    for (std::size_t index = 0; index < wanted; ++index) {
        const float amplitude = field.amplitude[index];
        if (!(amplitude >= 0.0f) || !std::isfinite(amplitude)) {
            return refuse(
                "amplitude of node " + std::to_string(index) + " must be finite and >= 0 m",
                static_cast<double>(amplitude));
        }
    }
    return {};
}

}  // namespace

Result<std::shared_ptr<const HeightSource>> add_detail(std::shared_ptr<const HeightSource> base,
                                                       DetailField field,
                                                       const DetailSettings& settings) {
    TERRANE_ASSERT(base != nullptr, "detail lies on top of another source");
    TERRANE_TRY(check_octaves(settings.octave_count, settings.gain));
    TERRANE_TRY(check(field));
    return std::make_shared<const Detail>(std::move(base), field, settings);
}

}  // namespace terrane
