// SPDX-License-Identifier: MIT
#include "base/settings_check.h"
#include "base/simd_level.h"
#include "source/bounds/mesh_bounds.h"
#include "source/bounds/rounding.h"
#include "source/fractal/fractal_bounds.h"
#include "source/fractal/fractal_surface.h"
#include "source/fractal/head_samples.h"

#include <terrane/terrain/assert.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/number_text.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace terrane {
namespace {

/// The world's edges must lie within 2^38 m: half of what 64 bits hold, so that margins fit too.
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

    /// Samples more than a wavelength of the first octave apart do not limit the heights between them: the range of all
    /// heights bounds all of these spacings, so that bounds nest.
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

    /// @param finer_log2  how many times the finest spacing is halved to make the grid's unit
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
    std::uint64_t origin_x_, origin_y_;  ///< of the lattice, units
};

Result<void> check_origin(const char* name, double origin, const FractalSettings& settings) {
    const double most = std::ldexp(1.0, kMaxExtentLog2);
    if (auto ok = check_range(name, origin, -most, most); !ok) return ok;
    const double roots = std::ldexp(origin, -settings.root_size_log2);
    if (std::floor(roots) == roots) return {};
    return fail(ErrorCode::invalid_argument,
                std::string(name) + " must be a multiple of a root square's side, 2^" +
                    std::to_string(settings.root_size_log2) + " m, got " + number_text(origin));
}

Result<void> check(const FractalSettings& settings) {
    if (auto ok = check_octaves(settings.octave_count, settings.gain); !ok) return ok;
    if (auto ok = check_range("amplitude", settings.amplitude, 0.0, 1e5); !ok) return ok;
    if (auto ok = check_range("wavelength_log2", settings.wavelength_log2, 0, 24); !ok) return ok;
    if (settings.kind > FractalKind::warped) {
        return fail(ErrorCode::invalid_argument,
                    "kind must be fbm, ridged, hybrid or warped, got number " +
                        std::to_string(static_cast<int>(settings.kind)));
    }
    if (auto ok = check_range("heterogeneity", settings.heterogeneity, 0.0, 1.0); !ok) return ok;
    if (auto ok = check_range("crest_rounding", settings.crest_rounding, 1.0 / 64.0, 1.0); !ok) {
        return ok;
    }
    if (auto ok = check_range("warp", settings.warp, 0.0, 1.0); !ok) return ok;
    const int last_wavelength_log2 = settings.wavelength_log2 - settings.octave_count + 1;
    if (last_wavelength_log2 < -20) {
        return fail(ErrorCode::invalid_argument,
                    "octave_count must keep the last octave's wavelength at 2^-20 m or more, got " +
                        std::to_string(settings.octave_count) + " octaves below 2^" +
                        std::to_string(settings.wavelength_log2) + " m");
    }
    if (auto ok = check_range("finest_spacing_log2", settings.finest_spacing_log2, -16, 16); !ok) {
        return ok;
    }
    if (auto ok =
            check_range("root_size_log2", settings.root_size_log2, settings.finest_spacing_log2 + 7,
                        std::min(settings.finest_spacing_log2 + 31, kMaxExtentLog2));
        !ok) {
        return ok;
    }
    if (auto ok = check_origin("origin_x", settings.origin_x, settings); !ok) return ok;
    return check_origin("origin_y", settings.origin_y, settings);
}

/// Heights are 32-bit multiples of the quantum: the finest that leaves room above the fractal's
/// supremum, but no finer than a 4096th of the spacing or 2^-12 m, whichever is less.
double make_quantum(double sup, int spacing_log2) {
    double quantum = std::ldexp(1.0, std::min(spacing_log2, 0) - 12);
    while (sup > 0x1p30 * quantum) quantum *= 2.0;
    return quantum;
}

}  // namespace

Result<std::shared_ptr<const HeightSource>> FractalHeights::create(
    const FractalSettings& settings) {
    if (const auto ok = check(settings); !ok) return tl::unexpected(ok.error());
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
    if (const auto ok = terrane::check(lattice); !ok) return tl::unexpected(ok.error());

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
