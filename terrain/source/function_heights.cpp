// SPDX-License-Identifier: MIT
#include "base/settings_check.h"
#include "source/mesh_bounds.h"

#include <terrane/base/text.h>
#include <terrane/terrain/function_heights.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <limits>
#include <string>
#include <utility>

namespace terrane::internal {

/// Wraps a caller's function, which may throw or return something that is not a height, and returns a Result.
class CheckedFunction {
public:
    /// @param range heights outside this range are refused; if it is absent, any finite height is accepted
    CheckedFunction(HeightFunction function, const std::optional<HeightInterval>& range)
        : function_(std::move(function)), range_(range) {}

    /// The height, metres.
    /// Fails: io if the function throws or returns NaN or infinity; bad_data for a height outside the range
    Result<double> at(double x, double y) const;
    /// As at(), but returns NaN instead of an error.
    double operator()(double x, double y) const;

private:
    HeightFunction function_;
    std::optional<HeightInterval> range_;
};

/// Known or estimated bounds of a function's heights; unknown ones are infinite.
struct FunctionBounds {
    double slope = 0.0;      ///< Lipschitz bound over the world and its surroundings
    double curvature = 0.0;  ///< 1/m
    double height = 0.0;     ///< range.high - range.low, metres
    double rounding = 0.0;   ///< rounding error of a computed deviation, metres
    double shift = 0.0;      ///< rounding error of coordinates, metres

    /// Bound of the deviation of the function from its interpolation over right triangles, metres.
    double deviation(double hypotenuse) const;
    /// Bound of the difference of two heights, metres.
    double rise(double distance) const;
};

/// Estimates slope and curvature as twice the largest first and second differences of samples over the extent and in
/// patches of the finest spacing.
///
/// Fails: io if the function fails
Result<FunctionBounds> estimate_bounds(const CheckedFunction& function, const WorldRect& extent,
                                       double finest_spacing);

/// Bound of the slope at a position, from height differences over `distance` and the curvature; allows 1e-9 m of
/// rounding.
///
/// Fails: io if the function fails
Result<double> slope_at(const CheckedFunction& function, double x, double y, double distance,
                        double curvature);

namespace {

std::string at_place(double x, double y) {
    return " at x " + number_text(x) + " m, y " + number_text(y) + " m";
}

}  // namespace

Result<double> CheckedFunction::at(double x, double y) const {
    double height = 0.0;
    try {
        height = function_(x, y);
    } catch (const std::exception& thrown) {
        return fail(ErrorCode::io, "the height function threw \"" + std::string(thrown.what()) +
                                       "\"" + at_place(x, y));
    } catch (...) {
        return fail(ErrorCode::io,
                    "the height function threw what is no std::exception" + at_place(x, y));
    }
    if (!std::isfinite(height)) {
        return fail(ErrorCode::io,
                    "the height function gave " + number_text(height) + " m" + at_place(x, y));
    }
    if (range_ && !(height >= range_->low && height <= range_->high)) {
        return fail(ErrorCode::bad_data, "the height function gave " + number_text(height) + " m" +
                                             at_place(x, y) + ", outside its range of " +
                                             number_text(range_->low) + " to " +
                                             number_text(range_->high) + " m");
    }
    return height;
}

double CheckedFunction::operator()(double x, double y) const {
    try {
        const double height = function_(x, y);
        if (std::isfinite(height)) return height;
    } catch (...) {
        // returns NaN
    }
    return std::numeric_limits<double>::quiet_NaN();
}

// Interpolation error over a right triangle. A right triangle with hypotenuse l lies in the circle of radius r = l / 2
// around the middle O of its hypotenuse. For a point p = sum w_i v_i of its corners v_i, with w_i >= 0, sum w_i = 1,
//
//   sum w_i |p - v_i|^2 = r^2 - |p - O|^2 <= r^2,   and so   sum w_i |p - v_i| <= r.
//
// The deviation of h from its linear interpolation is h(p) - sum w_i h(v_i). With a Lipschitz bound L, each difference
// is at most L |p - v_i|, so their weighted mean is at most L r. With a curvature M, Taylor's theorem at p gives h(v_i)
// = h(p) + grad h(p) (v_i - p) + R_i, |R_i| <= M |p - v_i|^2 / 2. The gradient terms cancel, because sum w_i (v_i - p)
// = 0, and the remainder is at most M r^2 / 2. Both bounds are attained at O, by a cone and by a paraboloid.
//
// Source: S. Waldron. The error in linear interpolation at the vertices of a simplex. SIAM J. Numer. Anal. 35(3), 1998.
//         (the bound by the curvature, for triangles that contain their circumcentre)

namespace {

// Numbers of samples along a side of the extent's grid and of a patch; number of patches along the extent's side.
constexpr int kGridSamples = 65;
constexpr int kPatchSamples = 5;
constexpr int kPatches = 8;
// The function may be steeper between the samples.
constexpr double kEstimateFactor = 2.0;

// Raises the bounds to the largest differences within a square grid of samples.
Result<void> raise_to_differences(const CheckedFunction& function, double x, double y,
                                  double step_x, double step_y, int samples,
                                  FunctionBounds& bounds) {
    std::array<double, std::size_t{kGridSamples} * kGridSamples> heights{};
    const auto at = [samples](int column, int row) {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(samples) +
               static_cast<std::size_t>(column);
    };
    for (int row = 0; row < samples; ++row) {
        for (int column = 0; column < samples; ++column) {
            TERRANE_TRY(const double height, function.at(x + step_x * column, y + step_y * row));
            heights[at(column, row)] = height;
        }
    }
    const auto raise = [&](double before, double here, double after, double step) {
        const double first = std::max(std::abs(here - before), std::abs(after - here)) / step;
        const double second = std::abs(before - 2.0 * here + after) / (step * step);
        bounds.slope = std::max(bounds.slope, first);
        bounds.curvature = std::max(bounds.curvature, second);
    };
    for (int row = 1; row + 1 < samples; ++row) {
        for (int column = 1; column + 1 < samples; ++column) {
            const double here = heights[at(column, row)];
            raise(heights[at(column - 1, row)], here, heights[at(column + 1, row)], step_x);
            raise(heights[at(column, row - 1)], here, heights[at(column, row + 1)], step_y);
            raise(heights[at(column - 1, row - 1)], here, heights[at(column + 1, row + 1)],
                  std::sqrt(step_x * step_x + step_y * step_y));
        }
    }
    return {};
}

}  // namespace

double FunctionBounds::deviation(double hypotenuse) const {
    const double radius = 0.5 * hypotenuse + shift;
    return (std::min({slope * radius, 0.5 * curvature * radius * radius, height}) + rounding) *
           kOutward;
}

double FunctionBounds::rise(double distance) const {
    return (std::min(slope * (distance + shift), height) + rounding) * kOutward;
}

Result<FunctionBounds> estimate_bounds(const CheckedFunction& function, const WorldRect& extent,
                                       double finest_spacing) {
    FunctionBounds bounds;
    const double width = extent.east - extent.west, depth = extent.north - extent.south;
    if (auto done =
            raise_to_differences(function, extent.west, extent.south, width / (kGridSamples - 1),
                                 depth / (kGridSamples - 1), kGridSamples, bounds);
        !done) {
        return tl::unexpected(done.error());
    }
    for (int row = 0; row < kPatches; ++row) {
        for (int column = 0; column < kPatches; ++column) {
            if (auto done =
                    raise_to_differences(function, extent.west + width * (column + 0.4) / kPatches,
                                         extent.south + depth * (row + 0.4) / kPatches,
                                         finest_spacing, finest_spacing, kPatchSamples, bounds);
                !done) {
                return tl::unexpected(done.error());
            }
        }
    }
    bounds.slope *= kEstimateFactor;
    bounds.curvature *= kEstimateFactor;
    return bounds;
}

Result<double> slope_at(const CheckedFunction& function, double x, double y, double distance,
                        double curvature) {
    std::array<double, 4> heights{};
    constexpr std::array<std::array<int, 2>, 4> kSides = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
    for (std::size_t i = 0; i < kSides.size(); ++i) {
        TERRANE_TRY(const double height,
                    function.at(x + distance * kSides[i][0], y + distance * kSides[i][1]));
        heights[i] = height;
    }
    // a central difference is the mean of the derivative, which at distance t differs by at most M t from the middle's
    const double along_x = (heights[1] - heights[0]) / (2.0 * distance);
    const double along_y = (heights[3] - heights[2]) / (2.0 * distance);
    return std::sqrt(along_x * along_x + along_y * along_y) + 0.5 * kSqrt2 * curvature * distance +
           kHeightAccuracy / distance;
}

}  // namespace terrane::internal

// A source from a function. With a Lipschitz bound or a bound of the second derivative, the bounds are certified; they
// depend only on the spacing and are therefore nested. Otherwise they are estimates: the deviations of samples at a
// quarter of the spacing, plus what the estimated slope and curvature allow between the samples (mesh_bounds.h).

namespace terrane {
namespace {

using internal::CheckedFunction;
using internal::FunctionBounds;

constexpr double kUnknown = std::numeric_limits<double>::infinity();
constexpr std::int64_t kMostRootsAlong = 4;
constexpr int kFinestLevel = 24;

struct Known {
    FunctionBounds bounds;
    bool is_certified = true;
    bool has_slope =
        true;  // the slope is stated or estimated, not derived from the curvature over the world
};

class FunctionSource final : public HeightSource {
public:
    FunctionSource(const Lattice& lattice, const FunctionHeightsSettings& settings,
                   CheckedFunction function, const Known& known)
        : HeightSource(lattice, settings.extent),
          function_(std::move(function)),
          range_(settings.range.value_or(HeightInterval{-kUnknown, kUnknown})),
          known_(known) {}

    double height(double x, double y) const override { return function_(x, y); }
    bool is_certified() const override { return known_.is_certified; }

    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        std::size_t i = 0;
        for (int row = 0; row < grid.rows; ++row) {
            const double y = lattice().y(grid.corner.y + row * grid.step);
            for (int column = 0; column < grid.columns; ++column, ++i) {
                TERRANE_TRY(const auto height,
                            function_.at(lattice().x(grid.corner.x + column * grid.step), y));
                heights_out[i] = height;
            }
        }
        return {};
    }

    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        if (!known_.is_certified) return estimate(grid, bounds_out, {});
        const double spacing = lattice().spacing * static_cast<double>(grid.step);
        const float of_centre = round_up(known_.bounds.deviation(2.0 * kSqrt2 * spacing));
        const float of_midpoint = round_up(known_.bounds.deviation(2.0 * spacing));
        std::size_t i = 0;
        for (int row = 0; row < grid.rows; ++row) {
            for (int column = 0; column < grid.columns; ++column, ++i) {
                const bool is_vertex = ((row | column) & 1) != 0;
                const bool is_centre = (row & column & 1) != 0;
                bounds_out[i] = is_centre ? of_centre : is_vertex ? of_midpoint : 0.0f;
            }
        }
        return {};
    }

    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        if (!known_.is_certified) return estimate(grid, {}, bounds_out);
        const double spacing = lattice().spacing * static_cast<double>(grid.step);
        std::ranges::fill(bounds_out, round_up(known_.bounds.deviation(kSqrt2 * spacing)));
        return {};
    }

    Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                             std::span<float> cell_bounds_out) const override {
        if (!known_.is_certified) return estimate(grid, vertex_bounds_out, cell_bounds_out);
        return HeightSource::mesh_bounds(grid, vertex_bounds_out, cell_bounds_out);
    }

    HeightInterval interval(const WorldRect& rect) const override {
        const double x = 0.5 * (rect.west + rect.east), y = 0.5 * (rect.south + rect.north);
        const double width = rect.east - rect.west, depth = rect.north - rect.south;
        const double radius = 0.5 * std::sqrt(width * width + depth * depth);
        const double height = std::isfinite(radius) ? function_(x, y) : kUnknown;
        if (!std::isfinite(height)) return range_;
        double slope = known_.bounds.slope;
        if (!known_.has_slope && radius > 0.0) {
            // h(p) <= h(c) + |grad h(c)| r + M r^2 / 2
            const double curvature = known_.bounds.curvature;
            const auto local = internal::slope_at(function_, x, y, radius, curvature);
            if (!local) return range_;
            slope = std::min(slope, *local + 0.5 * curvature * radius);
        }
        const double reach =
            (slope * (radius + known_.bounds.shift) + known_.bounds.rounding) * kOutward +
            0x1p-50 * std::abs(height);
        return {std::max(range_.low, height - reach), std::min(range_.high, height + reach)};
    }

    double rise_bound(double distance) const override { return known_.bounds.rise(distance); }

private:
    Result<void> estimate(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                          std::span<float> cell_bounds_out) const {
        Result<void> read;
        const auto fill = [&](const SampleGrid& part, double unit, std::span<double> out) {
            const double spacing = lattice().spacing * unit;
            const auto place = [&](double origin, std::int64_t first, int i) {
                return origin + spacing * static_cast<double>(first + i * part.step);
            };
            std::size_t at = 0;
            for (int row = 0; row < part.rows; ++row) {
                const double y = place(lattice().origin_y, part.corner.y, row);
                for (int column = 0; column < part.columns; ++column, ++at) {
                    const auto height =
                        function_.at(place(lattice().origin_x, part.corner.x, column), y);
                    if (!height && read) read = tl::unexpected(height.error());
                    out[at] = height.value_or(0.0);
                }
            }
        };
        MeshSamples samples;
        samples.heights = [&](const SampleGrid& part, std::span<double> out) {
            fill(part, 1.0, out);
        };
        samples.fine = [&](const SampleGrid& part, std::span<double> out, std::span<double>) {
            fill(part, 0.25, out);
        };
        const double spacing = lattice().spacing * static_cast<double>(grid.step);
        const double fine = known_.bounds.deviation(0.25 * kSqrt2 * spacing);
        compute_mesh_bounds(grid, samples, {kUnknown, kUnknown, kUnknown, fine}, vertex_bounds_out,
                            cell_bounds_out);
        return read;
    }

    CheckedFunction function_;
    HeightInterval range_;
    Known known_;
};

Result<void> check(const FunctionHeightsSettings& settings) {
    const WorldRect& extent = settings.extent;
    const double width = extent.east - extent.west, depth = extent.north - extent.south;
    if (!(width > 0.0) || !(depth > 0.0) || !std::isfinite(width) || !std::isfinite(depth)) {
        return fail(ErrorCode::invalid_argument,
                    "extent must be finite and not empty, got west " + number_text(extent.west) +
                        ", south " + number_text(extent.south) + ", east " +
                        number_text(extent.east) + ", north " + number_text(extent.north));
    }
    if (settings.slope) {
        TERRANE_TRY(check_range("slope", *settings.slope, 0.0, 1e6));
    }
    if (settings.curvature) {
        TERRANE_TRY(check_range("curvature", *settings.curvature, 0.0, 1e9));
    }
    if (settings.range) {
        const HeightInterval& range = *settings.range;
        TERRANE_TRY(check_range("range.low", range.low, -kMostHeight, kMostHeight));
        TERRANE_TRY(check_range("range.high", range.high, range.low, kMostHeight));
    }
    return {};
}

Result<Lattice> make_lattice(const FunctionHeightsSettings& settings) {
    if (settings.lattice) {
        if (auto ok = settings.lattice->validate(); !ok) {
            return fail(ok.error().code, "lattice." + ok.error().message);
        }
        return *settings.lattice;
    }
    const WorldRect& extent = settings.extent;
    Lattice lattice;
    lattice.spacing = settings.finest_spacing;
    lattice.quantum = settings.quantum;
    TERRANE_TRY(lattice.validate());
    const auto roots = [&](double low, double high) {
        return std::max(1.0, std::ceil((high - low) / lattice.root_size()));
    };
    while (std::max(roots(extent.west, extent.east), roots(extent.south, extent.north)) >
           static_cast<double>(kMostRootsAlong)) {
        if (++lattice.finest_level > kFinestLevel) {
            return fail(
                ErrorCode::invalid_argument,
                "finest_spacing is too small for the extent: it has more than 24 levels, got " +
                    number_text(settings.finest_spacing));
        }
    }
    lattice.root_count_x = static_cast<std::int32_t>(roots(extent.west, extent.east));
    lattice.root_count_y = static_cast<std::int32_t>(roots(extent.south, extent.north));
    lattice.origin_x = extent.west;
    lattice.origin_y = extent.south;
    if (auto ok = lattice.validate(); !ok) {
        return fail(ok.error().code,
                    "extent's south-western corner is the lattice's origin: " + ok.error().message);
    }
    return lattice;
}

// The region where the function may be evaluated: the union of the extent and the rectangle of the root squares, which
// is extended by one root square on each side.
WorldRect asked_region(const Lattice& lattice, const WorldRect& extent) {
    const std::int64_t side = lattice.chunk_side(0);
    const auto root = [side](std::int32_t first, std::int32_t count) {
        return side * (std::int64_t{first} + count);
    };
    return {
        std::min(extent.west, lattice.x(root(lattice.first_root_x, -1))),
        std::min(extent.south, lattice.y(root(lattice.first_root_y, -1))),
        std::max(extent.east, lattice.x(root(lattice.first_root_x, lattice.root_count_x + 1))),
        std::max(extent.north, lattice.y(root(lattice.first_root_y, lattice.root_count_y + 1)))};
}

Result<Known> find_bounds(const CheckedFunction& function, const Lattice& lattice,
                          const FunctionHeightsSettings& settings) {
    const WorldRect& extent = settings.extent;
    Known known;
    if (!settings.slope && !settings.curvature) {
        known.is_certified = false;
        TERRANE_TRY(auto estimated, internal::estimate_bounds(function, extent, lattice.spacing));
        known.bounds = estimated;
    } else {
        known.bounds.slope = settings.slope.value_or(kUnknown);
        known.bounds.curvature = settings.curvature.value_or(kUnknown);
    }
    const WorldRect region = asked_region(lattice, extent);
    const double middle_x = 0.5 * (extent.west + extent.east);
    const double middle_y = 0.5 * (extent.south + extent.north);
    const double reach_x = std::max(region.east - middle_x, middle_x - region.west);
    const double reach_y = std::max(region.north - middle_y, middle_y - region.south);
    const double reach = std::sqrt(reach_x * reach_x + reach_y * reach_y) * kOutward;
    if (settings.curvature && !settings.slope) {
        known.has_slope = false;
        TERRANE_TRY(const auto slope, internal::slope_at(function, middle_x, middle_y,
                                                         lattice.spacing, *settings.curvature));
        known.bounds.slope = slope + *settings.curvature * reach * kOutward;
    }
    // no height exceeds kMostHeight: chunks with larger ones are rejected
    known.bounds.height =
        settings.range ? settings.range->high - settings.range->low : 2.0 * kMostHeight;
    const double farthest = std::max({std::abs(region.west), std::abs(region.east),
                                      std::abs(region.south), std::abs(region.north)});
    known.bounds.shift = 0x1p-51 * farthest;
    const double highest =
        settings.range ? std::max(std::abs(settings.range->low), std::abs(settings.range->high))
                       : known.bounds.slope * reach;
    known.bounds.rounding = 0x1p-50 * std::min(highest, kMostHeight);
    return known;
}

}  // namespace

Result<std::shared_ptr<const HeightSource>> heights_from_function(
    HeightFunction function, const FunctionHeightsSettings& settings) {
    if (!function) {
        return fail(ErrorCode::invalid_argument,
                    "function must be one that can be called, got an empty one");
    }
    TERRANE_TRY(check(settings));
    TERRANE_TRY(const auto lattice, make_lattice(settings));
    CheckedFunction checked(std::move(function), settings.range);
    TERRANE_TRY(const auto known, find_bounds(checked, lattice, settings));
    return std::make_shared<const FunctionSource>(lattice, settings, std::move(checked), known);
}

}  // namespace terrane
