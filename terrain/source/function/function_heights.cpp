// SPDX-License-Identifier: MIT
//
// A source from a function with a Lipschitz bound, a bound of its second derivative, or neither. Certified bounds
// depend on the spacing alone, and so are nested; estimates are the deviations of samples of a quarter of the spacing,
// and what the estimated slope and curvature allow between these (mesh_bounds.h).
#include "base/settings_check.h"
#include "source/bounds/mesh_bounds.h"
#include "source/bounds/rounding.h"
#include "source/function/function_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

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
        true;  // stated or estimated; else it follows from the curvature, over the whole world
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
                const auto height =
                    function_.at(lattice().x(grid.corner.x + column * grid.step), y);
                if (!height) return tl::unexpected(height.error());
                heights_out[i] = *height;
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
        if (auto ok = check_range("slope", *settings.slope, 0.0, 1e6); !ok) return ok;
    }
    if (settings.curvature) {
        if (auto ok = check_range("curvature", *settings.curvature, 0.0, 1e9); !ok) return ok;
    }
    if (settings.range) {
        const HeightInterval& range = *settings.range;
        if (auto ok = check_range("range.low", range.low, -kMostHeight, kMostHeight); !ok)
            return ok;
        if (auto ok = check_range("range.high", range.high, range.low, kMostHeight); !ok) return ok;
    }
    return {};
}

Result<Lattice> make_lattice(const FunctionHeightsSettings& settings) {
    if (settings.lattice) {
        if (auto ok = check(*settings.lattice); !ok) {
            return fail(ok.error().code, "lattice." + ok.error().message);
        }
        return *settings.lattice;
    }
    const WorldRect& extent = settings.extent;
    Lattice lattice;
    lattice.spacing = settings.finest_spacing;
    lattice.quantum = settings.quantum;
    if (auto ok = check(lattice); !ok) return tl::unexpected(ok.error());
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
    if (auto ok = check(lattice); !ok) {
        return fail(ok.error().code,
                    "extent's south-western corner is the lattice's origin: " + ok.error().message);
    }
    return lattice;
}

// Where the function is asked: the extent and the root squares, and as far as one of these beyond them.
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
        auto estimated = internal::estimate_bounds(function, extent, lattice.spacing);
        if (!estimated) return tl::unexpected(estimated.error());
        known.bounds = *estimated;
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
        const auto slope =
            internal::slope_at(function, middle_x, middle_y, lattice.spacing, *settings.curvature);
        if (!slope) return tl::unexpected(slope.error());
        known.bounds.slope = *slope + *settings.curvature * reach * kOutward;
    }
    // Chunks with heights beyond kMostHeight are not made.
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
    if (auto ok = check(settings); !ok) return tl::unexpected(ok.error());
    const auto lattice = make_lattice(settings);
    if (!lattice) return tl::unexpected(lattice.error());
    CheckedFunction checked(std::move(function), settings.range);
    const auto known = find_bounds(checked, *lattice, settings);
    if (!known) return tl::unexpected(known.error());
    return std::make_shared<const FunctionSource>(*lattice, settings, std::move(checked), *known);
}

}  // namespace terrane
