// SPDX-License-Identifier: MIT
//
// Sampling of heads. The first octaves of a head are so smooth that they are sampled at twice the step and interpolated
// linearly. In the middle of a cell, the mean of its south-western and north-eastern corner is taken.
#include "base/settings_check.h"
#include "base/simd_level.h"
#include "source/fractal/fractal_bounds.h"
#include "source/fractal/fractal_surface.h"
#include "source/fractal/noise.h"
#include "source/mesh_bounds.h"

#include <terrane/base/result.h>
#include <terrane/base/text.h>
#include <terrane/terrain/fractal_heights.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace terrane {
namespace {

/// The grid with twice the step that contains another grid.
struct Coarse {
    UnitGrid grid;
    int column = 0, row = 0;  ///< of the fine grid's corner, in fine steps

    explicit Coarse(const UnitGrid& fine) {
        const std::uint64_t mask = 2 * fine.step - 1;
        grid = {fine.x & ~mask, fine.y & ~mask, 2 * fine.step};
        column = fine.x == grid.x ? 0 : 1;
        row = fine.y == grid.y ? 0 : 1;
        grid.columns = (column + fine.columns) / 2 + 1;
        grid.rows = (row + fine.rows) / 2 + 1;
    }
    std::size_t size() const {
        return static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(grid.rows);
    }
};

/// Interpolates a row between two coarse rows, which may be the same. A value at a coarse column is the mean of `low`
/// and `high` there; a value between two coarse columns is the mean of `low` to the west and `high` to the east.
void interpolate_row(const double* low, const double* high, int first, std::span<double> out) {
    std::size_t i = 0;
    if (first != 0) {
        out[i++] = 0.5 * (low[0] + high[1]);
        ++low;
        ++high;
    }
    for (; i + 1 < out.size(); i += 2, ++low, ++high) {
        out[i] = 0.5 * (low[0] + high[0]);
        out[i + 1] = 0.5 * (low[0] + high[1]);
    }
    if (i < out.size()) out[i] = 0.5 * (low[0] + high[0]);
}

void interpolate(const Coarse& coarse, std::span<const double> values, const UnitGrid& grid,
                 std::span<double> out) {
    const auto width = static_cast<std::size_t>(coarse.grid.columns);
    const auto columns = static_cast<std::size_t>(grid.columns);
    for (int row = 0; row < grid.rows; ++row) {
        const auto south = static_cast<std::size_t>((coarse.row + row) / 2);
        const auto north = static_cast<std::size_t>((coarse.row + row + 1) / 2);
        interpolate_row(&values[south * width], &values[north * width], coarse.column,
                        out.subspan(static_cast<std::size_t>(row) * columns, columns));
    }
}

}  // namespace

void HeadSamples::sample(const UnitGrid& grid, std::span<double> centres_out,
                         std::span<double> radii_out) {
    const Coarse coarse(grid);
    sums_.assign(coarse.size(), 0.0);
    weights_.assign(has_radii() ? coarse.size() : 0, 1.0);
    surface_.add_octaves(coarse.grid, 0, head_.coarse_count, level_, sums_, weights_);
    interpolate(coarse, sums_, grid, centres_out);
    if (has_radii()) interpolate(coarse, weights_, grid, radii_out);
    surface_.add_octaves(grid, head_.coarse_count, head_.octave_count, level_, centres_out,
                         radii_out);
    for (std::size_t i = 0; i < radii_out.size(); ++i) {
        const double weight = radii_out[i];
        centres_out[i] += head_.centre + head_.centre_slope * weight;
        radii_out[i] = head_.radius + head_.radius_slope * weight;
    }
}

// A head consists of the first m octaves of a fractal. The other octaves, the tail, are too fine for bounds by samples:
// they are bounded by their suprema.
//
//   sums:           |tail| <= sup |n| (a_m + a_(m+1) + ...): a constant radius.
//   multifractals:  v_i = w_i s_i with 0 <= s_min <= s_i <= 1, and w_(i+1) = 1 - k + k v_i increases with
//                   v_i. The tail therefore lies between its sums for s_i = s_min and for s_i = 1, which are
//                   both linear functions of w_m: centre +- radius.
//
// L + centre + radius and L + centre - radius are linear functions of L and w_m, with slopes in w_m between 0 and
// centre_slope + radius_slope. Over a triangle both deviate from their interpolation by at most bend(L) + (centre_slope
// + radius_slope) bend(w_m), and the height lies between them.
//
// The first octaves of a head may themselves be interpolated from samples at twice the step, the corners of right
// triangles with twice the hypotenuse. The error of their sum is at most the bend of the sum over such a triangle, and
// the error of the weight w after them at most the bend of w. Octave i then adds a_i v_i with an error of at most a_i
// times the error of w_i. The error of w_(i+1) is at most k times that of w_i, because 0 <= s_i <= 1.
//
// `rounding_` is added twice: once for the heights at a triangle's corners and once for the samples.

/// Adds the interval of the tail to the centre and radius of a head.
void FractalBounds::add_tail(FractalHead& head) const {
    const auto tail = std::span(octaves_).subspan(static_cast<std::size_t>(head.octave_count));
    if (is_sum()) {
        for (const OctaveScale& octave : tail) head.radius += kNoiseSup * octave.amplitude;
        return;
    }
    // least and largest weight of an octave, as linear functions of w
    double low = 0.0, low_slope = 1.0, high = 0.0, high_slope = 1.0;
    const double least = least_shaped();
    for (const OctaveScale& octave : tail) {
        const double half = 0.5 * octave.amplitude;
        head.centre += half * (high + least * low);
        head.centre_slope += half * (high_slope + least * low_slope);
        head.radius += half * (high - least * low);
        head.radius_slope += half * (high_slope - least * low_slope);
        low = 1.0 - heterogeneity_ + heterogeneity_ * least * low;
        low_slope *= heterogeneity_ * least;
        high = 1.0 - heterogeneity_ + heterogeneity_ * high;
        high_slope *= heterogeneity_;
    }
}

FractalHead FractalBounds::make_head(double hypotenuse, std::size_t octave_count) const {
    FractalHead head;
    head.octave_count = static_cast<int>(octave_count);
    add_tail(head);
    const double radius = 0.5 * hypotenuse;
    if (is_sum()) {
        head.bend = warped(radius, octave_count).bend;
    } else {
        const Multifractal own = multifractal(radius, octave_count);
        head.bend = own.sum.bend + (head.centre_slope + head.radius_slope) * own.weight.bend;
    }
    head.bend = (head.bend + 2.0 * rounding_) * kOutward;
    return head;
}

/// Bound of the error of centre + radius and of centre - radius if the first `coarse_count` octaves are interpolated.
double FractalBounds::coarse_error(double hypotenuse, const FractalHead& head,
                                   int coarse_count) const {
    const double radius = 0.5 * hypotenuse;
    const auto count = static_cast<std::size_t>(coarse_count);
    if (is_sum()) return warped(radius, count).bend * kOutward;
    const Multifractal coarse = multifractal(radius, count);
    double error = coarse.sum.bend, of_weight = coarse.weight.bend;
    for (int octave = coarse_count; octave < head.octave_count; ++octave) {
        error += octaves_[static_cast<std::size_t>(octave)].amplitude * of_weight;
        of_weight *= heterogeneity_;
    }
    return (error + (head.centre_slope + head.radius_slope) * of_weight) * kOutward;
}

FractalHead FractalBounds::head(double hypotenuse) const {
    // an octave joins the head if it raises the bend by at most this share of the radius that it removes
    constexpr double kWorthwhile = 0.75;
    const auto radius_of = [](const FractalHead& head) { return head.radius + head.radius_slope; };
    FractalHead best = make_head(hypotenuse, 0);
    while (best.octave_count < static_cast<int>(octaves_.size())) {
        const FractalHead longer =
            make_head(hypotenuse, static_cast<std::size_t>(best.octave_count) + 1);
        const double gain = radius_of(best) - radius_of(longer);
        if (longer.bend - best.bend > kWorthwhile * gain) break;
        best = longer;
    }
    constexpr double kShare = 0.125;  // share of the bound that fewer samples may add
    const double most = kShare * (best.bend + radius_of(best));
    double error = 0.0;
    while (best.coarse_count < best.octave_count) {
        const double longer = coarse_error(2.0 * hypotenuse, best, best.coarse_count + 1);
        if (longer > most) break;
        error = longer;
        ++best.coarse_count;
    }
    best.bend += error;
    return best;
}

namespace {

/// The world's edges lie within 2^38 m of the origin: half the range of 64-bit positions, to leave room for margins.
constexpr int kMaxExtentLog2 = 38;

class Fractal final : public HeightSource {
public:
    Fractal(const Lattice& lattice, const WorldRect& extent, FractalSurface surface,
            int spacing_log2)
        : HeightSource(lattice, extent),
          surface_(std::move(surface)),
          bounds_(surface_),
          spacing_shift_(spacing_log2 - kUnitLog2),
          origin_x_(to_units(lattice.origin_x)),
          origin_y_(to_units(lattice.origin_y)) {}

    double height(double x, double y) const override { return surface_.height(x, y); }

    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        TERRANE_ASSERT(heights_out.size() >= grid.size(), "room for every height");
        surface_.sample(units(grid, 0), internal::best_simd_level(), heights_out);
        return {};
    }

    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        return mesh_bounds(grid, bounds_out, {});
    }

    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        return mesh_bounds(grid, {}, bounds_out);
    }

    Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                             std::span<float> cell_bounds_out) const override {
        const double spacing = lattice().spacing * static_cast<double>(grid.step);
        if (spacing > bounds_.coarsest_wavelength()) {
            fill_coarse_bounds(grid, vertex_bounds_out, cell_bounds_out);
            return {};
        }
        const FractalHead head = bounds_.head(kSqrt2 * (0.25 * spacing));
        HeadSamples fine(surface_, head, internal::best_simd_level());
        MeshSamples samples;
        samples.heights = [&](const SampleGrid& wanted, std::span<double> heights_out) {
            surface_.sample(units(wanted, 0), internal::best_simd_level(), heights_out);
        };
        samples.has_radii = fine.has_radii();
        samples.fine = [&](const SampleGrid& wanted, std::span<double> centres_out,
                           std::span<double> radii_out) {
            fine.sample(units(wanted, 2), centres_out, radii_out);
        };
        const double error = fine.has_radii() ? head.bend : head.bend + head.radius;
        compute_mesh_bounds(grid, samples, spacing_bounds(spacing, error), vertex_bounds_out,
                            cell_bounds_out);
        return {};
    }

    HeightInterval interval(const WorldRect& rect) const override {
        const double middle_x = 0.5 * (rect.west + rect.east);
        const double middle_y = 0.5 * (rect.south + rect.north);
        const double half_x = std::max(middle_x - rect.west, rect.east - middle_x);
        const double half_y = std::max(middle_y - rect.south, rect.north - middle_y);
        const double middle = height(middle_x, middle_y);
        const double rise =
            rise_bound(std::sqrt(half_x * half_x + half_y * half_y) * (1.0 + 0x1p-50));
        return {std::max(middle - rise, bounds_.range().low),
                std::min(middle + rise, bounds_.range().high)};
    }

    double rise_bound(double distance) const override { return bounds_.rise(distance); }

private:
    /// @param fine  SpacingBounds::fine
    SpacingBounds spacing_bounds(double spacing, double fine) const {
        return {bounds_.interpolation(kSqrt2 * (2.0 * spacing)),
                bounds_.interpolation(2.0 * spacing), bounds_.interpolation(kSqrt2 * spacing),
                fine};
    }

    /// If samples are farther apart than the wavelength of the first octave, they do not limit the heights between
    /// them. The bound for all such spacings is the range of all heights, so that bounds are nested.
    void fill_coarse_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                            std::span<float> cell_bounds_out) const {
        const float bound = round_up(bounds_.range().high - bounds_.range().low);
        if (!vertex_bounds_out.empty()) {
            for (int row = 0; row < grid.rows; ++row) {
                for (int column = 0; column < grid.columns; ++column) {
                    const bool coarser = ((row | column) & 1) == 0;
                    vertex_bounds_out[static_cast<std::size_t>(row * grid.columns + column)] =
                        coarser ? 0.0f : bound;
                }
            }
        }
        if (cell_bounds_out.empty()) return;
        const std::size_t cell_count =
            static_cast<std::size_t>(grid.columns - 1) * static_cast<std::size_t>(grid.rows - 1);
        std::ranges::fill(cell_bounds_out.first(cell_count), bound);
    }

    static std::uint64_t to_units(double metres) {
        return static_cast<std::uint64_t>(
            static_cast<std::int64_t>(std::ldexp(metres, -kUnitLog2)));
    }

    /// @param finer_log2  number of times that the finest spacing is halved to give the grid's unit
    UnitGrid units(const SampleGrid& grid, int finer_log2) const {
        const int shift = spacing_shift_ - finer_log2;
        const auto shifted = [=](std::int64_t index) {
            return static_cast<std::uint64_t>(index) << shift;
        };
        return {origin_x_ + shifted(grid.corner.x), origin_y_ + shifted(grid.corner.y),
                shifted(grid.step), grid.columns, grid.rows};
    }

    FractalSurface surface_;
    FractalBounds bounds_;
    int spacing_shift_;
    std::uint64_t origin_x_, origin_y_;  ///< of the lattice's origin, units
};

Result<void> check_origin(const char* name, double origin, const FractalSettings& settings) {
    const double most = std::ldexp(1.0, kMaxExtentLog2);
    TERRANE_TRY(check_range(name, origin, -most, most));
    const double roots = std::ldexp(origin, -settings.root_size_log2);
    if (std::floor(roots) == roots) return {};
    return fail(ErrorCode::invalid_argument,
                std::string(name) + " must be a multiple of a root square's side, 2^" +
                    std::to_string(settings.root_size_log2) + " m, got " + number_text(origin));
}

Result<void> check(const FractalSettings& settings) {
    TERRANE_TRY(check_octaves(settings.octave_count, settings.gain));
    TERRANE_TRY(check_range("amplitude", settings.amplitude, 0.0, 1e5));
    TERRANE_TRY(check_range("wavelength_log2", settings.wavelength_log2, 0, 24));
    if (settings.kind > FractalKind::warped) {
        return fail(ErrorCode::invalid_argument,
                    "kind must be fbm, ridged, hybrid or warped, got number " +
                        std::to_string(static_cast<int>(settings.kind)));
    }
    TERRANE_TRY(check_range("heterogeneity", settings.heterogeneity, 0.0, 1.0));
    TERRANE_TRY(check_range("crest_rounding", settings.crest_rounding, 1.0 / 64.0, 1.0));
    TERRANE_TRY(check_range("warp", settings.warp, 0.0, 1.0));
    const int last_wavelength_log2 = settings.wavelength_log2 - settings.octave_count + 1;
    if (last_wavelength_log2 < -20) {
        return fail(ErrorCode::invalid_argument,
                    "octave_count must keep the last octave's wavelength at 2^-20 m or more, got " +
                        std::to_string(settings.octave_count) + " octaves below 2^" +
                        std::to_string(settings.wavelength_log2) + " m");
    }
    TERRANE_TRY(check_range("finest_spacing_log2", settings.finest_spacing_log2, -16, 16));
    if (auto ok =
            check_range("root_size_log2", settings.root_size_log2, settings.finest_spacing_log2 + 7,
                        std::min(settings.finest_spacing_log2 + 31, kMaxExtentLog2));
        !ok) {
        return ok;
    }
    TERRANE_TRY(check_origin("origin_x", settings.origin_x, settings));
    return check_origin("origin_y", settings.origin_y, settings);
}

/// The smallest quantum for which 32-bit multiples represent all heights of the fractal, but at least a 4096th of the
/// spacing or 2^-12 m, whichever is less.
double make_quantum(double sup, int spacing_log2) {
    double quantum = std::ldexp(1.0, std::min(spacing_log2, 0) - 12);
    while (sup > 0x1p30 * quantum) quantum *= 2.0;
    return quantum;
}

}  // namespace

Result<std::shared_ptr<const HeightSource>> FractalHeights::create(
    const FractalSettings& settings) {
    TERRANE_TRY(check(settings));
    FractalSurface surface(settings);

    Lattice lattice;
    lattice.spacing = std::ldexp(1.0, settings.finest_spacing_log2);
    const HeightInterval range = FractalBounds(surface).range();
    lattice.quantum = make_quantum(std::max(-range.low, range.high), settings.finest_spacing_log2);
    lattice.finest_level = settings.root_size_log2 - settings.finest_spacing_log2 - 7;
    lattice.origin_x = settings.origin_x;
    lattice.origin_y = settings.origin_y;
    lattice.first_root_x = settings.first_root_x;
    lattice.first_root_y = settings.first_root_y;
    lattice.root_count_x = settings.root_count_x;
    lattice.root_count_y = settings.root_count_y;
    lattice.root_window = settings.root_window;
    TERRANE_TRY(lattice.validate());

    const WorldRect extent = {lattice.x(lattice.west()), lattice.y(lattice.south()),
                              lattice.x(lattice.east()), lattice.y(lattice.north())};
    const double reach = std::max({std::abs(extent.west), std::abs(extent.south),
                                   std::abs(extent.east), std::abs(extent.north)});
    if (reach > std::ldexp(1.0, kMaxExtentLog2)) {
        return fail(ErrorCode::invalid_argument,
                    "root squares must lie within 2^" + std::to_string(kMaxExtentLog2) +
                        " m of the origin, got " + number_text(reach) + " m");
    }
    return std::make_shared<const Fractal>(lattice, extent, std::move(surface),
                                           settings.finest_spacing_log2);
}

}  // namespace terrane
