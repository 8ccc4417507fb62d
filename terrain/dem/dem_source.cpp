// SPDX-License-Identifier: MIT
#include "dem_source.h"

#include "opening_memory.h"
#include "raster/raster_checks.h"

#include <terrane/terrain/assert.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace terrane::internal {
namespace {

/// The raster's outer edges.
WorldRect extent_of(const DemInfo& info) {
    const double half_width = 0.5 * info.columns * info.cell_x;
    const double half_height = 0.5 * info.rows * info.cell_y;
    return {-half_width, -half_height, half_width, half_height};
}

}  // namespace

DemSource::DemSource(std::shared_ptr<const RasterStore> store,
                     std::shared_ptr<const FineSurface> fine, OpeningBounds bounds,
                     CacheUse cache_use)
    : HeightSource(fine->grid().lattice, extent_of(store->info())),
      store_(std::move(store)),
      fine_(std::move(fine)),
      tiers_(std::move(bounds.tiers)),
      pyramid_(std::move(bounds.pyramid)),
      cache_use_(std::move(cache_use)) {}

Result<std::shared_ptr<const DemSource>> DemSource::create(
    const std::string& path, double finest_spacing, const StoreSettings& settings,
    std::function<bool(double)> report_progress, double spacing_tolerance) {
    auto reader = RasterReader::open(path, settings.patience_s);
    if (!reader) return tl::unexpected(reader.error());
    // A spacing out of range and a raster too large are refused before it is read.
    const DemInfo& raster = (*reader)->info();
    const auto first_grid = make_grid(raster, finest_spacing, spacing_tolerance);
    if (!first_grid) return tl::unexpected(first_grid.error());
    const double all_samples = sizeof(float) * static_cast<double>(raster.columns) * raster.rows;
    const double held_bytes = all_samples <= static_cast<double>(settings.memory_bytes)
                                  ? all_samples
                                  : static_cast<double>(settings.cache_bytes);
    const double needed_bytes = opening_bytes(*first_grid, held_bytes);
    if (auto checked =
            check_memory(path, raster.columns, raster.rows, needed_bytes, settings.limit_bytes);
        !checked) {
        return tl::unexpected(checked.error());
    }
    OpeningProgress progress(path, std::move(report_progress));
    auto opened = RasterStore::open(std::move(*reader), settings, needed_bytes, progress);
    if (!opened) return tl::unexpected(opened.error());
    std::shared_ptr<const RasterStore> store = std::move(*opened);
    const auto grid = make_grid(store->info(), finest_spacing, spacing_tolerance);
    if (!grid) return tl::unexpected(grid.error());

    const auto fine = std::make_shared<const FineSurface>(*grid, store);
    auto cache = OpeningCache::create(settings.bounds_cache, path, *fine);
    if (!cache) return tl::unexpected(cache.error());
    if (std::optional<OpeningBounds> kept = cache->load(fine)) {
        progress.begin(1.0, 1);
        if (auto wanted = progress.step(); !wanted) return tl::unexpected(wanted.error());
        return std::shared_ptr<const DemSource>(
            new DemSource(store, fine, std::move(*kept), cache->use()));
    }
    auto pyramid = HeightPyramid::create(*grid, *store, progress);
    if (!pyramid) return tl::unexpected(pyramid.error());
    auto tiers = BoundTiers::create(fine, progress);
    if (!tiers) return tl::unexpected(tiers.error());
    OpeningBounds bounds{std::move(*pyramid), std::move(*tiers)};
    cache->save(bounds);
    return std::shared_ptr<const DemSource>(
        new DemSource(store, fine, std::move(bounds), cache->use()));
}

double DemSource::height(double x, double y) const {
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    if (!std::isfinite(x) || !std::isfinite(y)) return kNaN;
    // Beyond the edge the surface repeats it, so coordinates are clamped to a little beyond.
    const BilinearGrid& g = grid();
    const WorldRect& e = extent();
    const double near_x = std::clamp(x, e.west - g.cell_x, e.east + g.cell_x);
    const double near_y = std::clamp(y, e.south - g.cell_y, e.north + g.cell_y);
    return store_->base() + fine_->height(g.column_at(near_x), g.row_at(near_y)).value_or(kNaN);
}

void DemSource::add_base(std::span<double> heights) const {
    for (double& height : heights) height += store_->base();
}

void DemSource::add_rounding(std::span<float> bounds) const {
    for (float& bound : bounds) {
        bound = round_outward(static_cast<double>(bound) + store_->rounding());
    }
}

Result<void> DemSource::sample(const SampleGrid& grid, std::span<double> heights_out) const {
    if (tiers_->has_heights(grid)) {
        tiers_->sample(grid, heights_out);
        add_base(heights_out.first(grid.size()));
        return {};
    }
    // The points of a grid much coarser than the raster are evaluated one by one.
    constexpr std::int64_t kFewCells = 16;
    if (grid.step <= kFewCells * fine_->grid().base_step()) {
        const auto patch = fine_->patch(grid, 0);
        if (!patch) return tl::unexpected(patch.error());
        fine_->sample(*patch, grid, heights_out);
        add_base(heights_out.first(grid.size()));
        return {};
    }
    std::size_t at = 0;
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column) {
            const auto z =
                fine_->height(fine_->grid().column_at_index(grid.corner.x + column * grid.step),
                              fine_->grid().row_at_index(grid.corner.y + row * grid.step));
            if (!z) return tl::unexpected(z.error());
            heights_out[at++] = store_->base() + *z;
        }
    }
    return {};
}

Result<void> DemSource::vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    TERRANE_ASSERT(grid.corner.x % (2 * grid.step) == 0 && grid.corner.y % (2 * grid.step) == 0,
                   "the corner of a grid of vertices must be a multiple of twice its step");
    if (grid.step >= tiers_->first_step()) {
        tiers_->vertex_bounds(grid, bounds_out);
    } else if (auto done = fine_->vertex_bounds(grid, bounds_out); !done) {
        return done;
    }
    if (store_->rounding() == 0.0) return {};
    add_rounding(bounds_out.first(grid.size()));
    // Points of even column and row are no vertices: the corner is a multiple of twice the step.
    for (int row = 0; row < grid.rows; row += 2) {
        for (int column = 0; column < grid.columns; column += 2) {
            bounds_out[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) +
                       static_cast<std::size_t>(column)] = 0.0f;
        }
    }
    return {};
}

Result<void> DemSource::cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    TERRANE_ASSERT(grid.corner.x % grid.step == 0 && grid.corner.y % grid.step == 0,
                   "the corner of a grid of cells must be a multiple of its step");
    if (grid.step >= tiers_->first_step()) {
        tiers_->cell_bounds(grid, bounds_out);
    } else if (auto done = fine_->cell_bounds(grid, bounds_out); !done) {
        return done;
    }
    if (store_->rounding() == 0.0) return {};
    add_rounding(bounds_out.first(static_cast<std::size_t>(grid.columns - 1) *
                                  static_cast<std::size_t>(grid.rows - 1)));
    return {};
}

Result<void> DemSource::cell_flags(const SampleGrid& grid,
                                   std::span<std::uint8_t> flags_out) const {
    const BilinearGrid& g = fine_->grid();
    const DemInfo& raster = info();
    // The samples of the bilinear surface over a cell, and whether the cell lies entirely beyond the raster's
    // outer edges, half a cell from its outermost samples.
    struct Span {
        int first = 0, last = 0;
        bool beyond = false;
    };
    const auto spans = [](int count, int samples, auto&& place_of) {
        std::vector<Span> all;
        for (int i = 0; i + 1 < count; ++i) {
            const SamplePlace begin = place_of(i), end = place_of(i + 1);
            const double begin_u = static_cast<double>(begin.index) + begin.fraction;
            const double end_u = static_cast<double>(end.index) + end.fraction;
            const std::int64_t last = end.fraction > 0.0 ? end.index + 1 : end.index;
            Span span;
            span.first = static_cast<int>(std::clamp<std::int64_t>(begin.index, 0, samples - 1));
            span.last = static_cast<int>(std::clamp<std::int64_t>(last, 0, samples - 1));
            span.beyond = end_u <= -0.5 || begin_u >= samples - 0.5;
            all.push_back(span);
        }
        return all;
    };
    const auto columns = spans(grid.columns, raster.columns, [&](int i) {
        return g.column_at_index(grid.corner.x + i * grid.step);
    });
    const auto rows = spans(grid.rows, raster.rows,
                            [&](int i) { return g.row_at_index(grid.corner.y + i * grid.step); });
    std::size_t at = 0;
    for (const Span& row : rows) {
        for (const Span& column : columns) {
            flags_out[at++] =
                column.beyond || row.beyond
                    ? std::uint8_t{cell_outside}
                    : store_->voids().flags(column.first, row.first, column.last, row.last);
        }
    }
    return {};
}

HeightInterval DemSource::interval(const WorldRect& rect) const {
    const HeightInterval relative = pyramid_.interval(rect);
    return {store_->base() + relative.low - store_->rounding(),
            store_->base() + relative.high + store_->rounding()};
}

double DemSource::rise_bound(double distance) const {
    return pyramid_.rise_bound(distance) + 2.0 * store_->rounding();
}

}  // namespace terrane::internal
