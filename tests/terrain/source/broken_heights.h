// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <cstdint>
#include <mutex>
#include <set>
#include <tuple>

namespace terrane::test {

/// The one promise that a BrokenHeights does not keep.
enum class Breach {
    none,
    vertex_bounds,      ///< all of them are `factor` times what they should be
    cell_bounds,        ///< so are these
    bounds_in_a_patch,  ///< both, but between 1000 and 3000 m east and north only
    midpoint_bounds,    ///< of midpoints: above those of the centres where the factor is above 2
    one_spacing,        ///< bounds of vertices of step 8 only
    corner_bounds,      ///< points that are no vertices have a bound
    interval,           ///< its upper end
    interval_upside_down,
    rise,
    rise_falls,     ///< a longer distance has a smaller bound
    neighbour,      ///< sample() gives the height of the next column
    wide_windows,   ///< grids with more than 12 columns have another last bit
    coarse_levels,  ///< samples of step 16 and more have another last bit
    mesh_bounds,    ///< mesh_bounds() rounds differently from vertex_bounds()
    second_time,    ///< a grid that was asked for before has another last bit
    other_threads,  ///< only the thread that made the source gets the right answer
    nan_sample,     ///< one of the samples beyond 30 km
    nan_bound,
    single_precision,  ///< beyond 50 km heights are rounded to float
    too_high,          ///< heights beyond what 32 bits of quanta hold
    read_error,        ///< grids beyond 30 km
    exception,         ///< so do these throw
    bad_quantum,
    no_extent,
};

/// A bowl, z = curvature / 2 (x^2 + y^2), whose bounds, intervals and rises are exact: so what is broken by a
/// percent is broken.
///
/// The world is 131 km wide around the origin, with 1 m between samples.
class BrokenHeights final : public HeightSource {
public:
    /// @param factor of what is broken, where that is a number
    explicit BrokenHeights(Breach breach, double factor = 1.0);

    double height(double x, double y) const override;
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override;
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                             std::span<float> cell_bounds_out) const override;
    HeightInterval interval(const WorldRect& rect) const override;
    double rise_bound(double distance) const override;

private:
    bool breaks(Breach breach) const { return breach_ == breach; }
    bool was_asked(const SampleGrid& grid) const;
    double factor_at(const SampleGrid& grid, int column, int row) const;

    Breach breach_;
    double factor_;
    std::uint64_t maker_;  // hash of the thread that made it
    mutable std::mutex mutex_;
    mutable std::set<std::tuple<std::int64_t, std::int64_t, std::int64_t, int>> asked_;
};

}  // namespace terrane::test
