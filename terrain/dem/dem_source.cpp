// SPDX-License-Identifier: MIT
#include "dem_source.h"

#include "bounds/level_bounds.h"
#include "bounds/raster_lattice.h"
#include "raster/plane_map.h"
#include "raster/raster_checks.h"
#include "raster/resampled_raster.h"
#include "raster/voids.h"

#include <terrane/base/result.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <system_error>
#include <utility>

namespace terrane::internal {
namespace {

/// Ratio of the number of points on all levels to that on the finest one; each level has half the resolution.
constexpr double kAllLevels = 4.0 / 3.0;
constexpr double kMebibyte = 1024.0 * 1024.0;

}  // namespace

OpeningBytes OpeningBytes::of(const BilinearGrid& grid, double held_bytes) {
    // Bytes per sample of a strip: as read, twice as a height, packed, and its validity.
    constexpr double kStripSample = 3 * sizeof(double) + sizeof(std::uint32_t) + 1;
    // Bytes per block: intervals on all levels, flags of nodata, fill of voids, amplitude of detail.
    constexpr double kBlock = kAllLevels * 2 * sizeof(double) + 1 + 24 + sizeof(float);
    // Bytes per point of the first tier: height, two bounds, two deviations, flags.
    constexpr double kTierPoint = kAllLevels * (sizeof(double) + 4 * sizeof(float) + 1);
    // Windows of samples and points, for all threads.
    constexpr double kWindows = 64.0 * kMebibyte;
    const double columns = grid.columns, rows = grid.rows;
    const double blocks =
        (columns / kBlockSide + 1.0) * (rows / kBlockSide + 1.0) + rows / kBlockSide;
    OpeningBytes bytes;
    bytes.arrays = kBlock * blocks + kTierPoint * BoundTiers::first_points(grid);
    bytes.others =
        held_bytes +
        kStripSample * columns * std::min(rows, static_cast<double>(strip_rows(grid.columns))) +
        sizeof(std::size_t) * rows + kWindows;
    return bytes;
}

namespace {

/// The raster's outer edges.
WorldRect extent_of(const DemInfo& info) {
    const double half_width = 0.5 * info.columns * info.cell_x;
    const double half_height = 0.5 * info.rows * info.cell_y;
    return {-half_width, -half_height, half_width, half_height};
}

/// As HeightSource::cell_flags(), from the samples.
Result<void> find_cell_flags(const RasterStore& store, const BilinearGrid& g,
                             const SampleGrid& grid, std::span<std::uint8_t> flags_out) {
    const DemInfo& raster = store.info();
    // The samples that determine the surface over a cell, and whether the cell lies entirely beyond the raster's outer
    // edges, which are half a raster cell beyond its outermost samples.
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
    const bool is_whole = store.is_whole();
    std::size_t at = 0;
    for (const Span& row : rows) {
        for (const Span& column : columns) {
            std::uint8_t& flags = flags_out[at++];
            flags = cell_outside;
            if (column.beyond || row.beyond) continue;
            flags = cell_ground;
            if (is_whole) continue;
            TERRANE_TRY(flags, store.flags(column.first, row.first, column.last, row.last));
        }
    }
    return {};
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
    TERRANE_TRY(auto reader, RasterReader::open(path, settings.patience_s, RasterNumbers::heights,
                                                settings.reading));
    OpeningProgress progress(path, std::move(report_progress));
    std::error_code absent;
    if (!settings.scan_file.empty() && !reader->is_resampled() &&
        std::filesystem::exists(settings.scan_file, absent)) {
        return reopen(std::move(reader), finest_spacing, settings, spacing_tolerance, progress);
    }
    const std::string file_versions = settings.scan_file.empty() ? "" : reader->file_versions();
    // A spacing out of range and a raster that is too large are refused before the samples are read.
    std::shared_ptr<const PlaneMap> map;
    if (reader->is_resampled()) {
        TERRANE_TRY(map, PlaneMap::create(*reader, settings.reading.cell));
    }
    const DemInfo& raster = map ? map->info() : reader->info();
    TERRANE_TRY(const auto first_grid, make_grid(raster, finest_spacing, spacing_tolerance));
    const auto held = [&settings](const DemInfo& info) {
        const double all_samples = sizeof(float) * static_cast<double>(info.columns) * info.rows;
        return all_samples <= static_cast<double>(settings.memory_bytes)
                   ? all_samples
                   : static_cast<double>(settings.cache_bytes);
    };
    const double held_bytes = held(raster) + (map ? held(reader->info()) : 0.0);
    const OpeningBytes opening = OpeningBytes::of(first_grid, held_bytes);
    const bool writes_scan = !settings.scan_file.empty() && !map;
    const bool has_scratch =
        writes_scan && opening.arrays > static_cast<double>(settings.scratch_above);
    const double needed_bytes = opening.others + (has_scratch ? 0.0 : opening.arrays);
    if (auto checked =
            check_memory(path, raster.columns, raster.rows, needed_bytes, settings.limit_bytes);
        !checked) {
        return tl::unexpected(checked.error());
    }
    std::shared_ptr<ScratchMemory> scratch;
    if (has_scratch) {
        TERRANE_TRY(scratch, ScratchMemory::create(settings.scan_file,
                                                   static_cast<std::size_t>(opening.arrays)));
    }
    StoreSettings own = settings;
    if (map) own.progress_share = 0.2;
    TERRANE_TRY(std::shared_ptr<const RasterStore> store,
                RasterStore::open(std::move(reader), own, needed_bytes, scratch, progress));
    if (map) {
        TERRANE_TRY(auto resampled, ResampledRaster::create(path, store, map, 0.35, progress));
        TERRANE_TRY(store, RasterStore::open(resampled, settings, needed_bytes, nullptr, progress));
    }
    TERRANE_TRY(const auto grid, make_grid(store->info(), finest_spacing, spacing_tolerance));

    const auto fine = std::make_shared<const FineSurface>(grid, store);
    const auto done = [&](OpeningBounds bounds,
                          CacheUse use) -> Result<std::shared_ptr<const DemSource>> {
        if (writes_scan) {
            const auto get_flags = [&](const SampleGrid& cells, std::span<std::uint8_t> flags_out) {
                return find_cell_flags(*store, grid, cells, flags_out);
            };
            TERRANE_TRY(RasterScan::write(settings.scan_file, file_versions, *store, grid, bounds,
                                          get_flags));
            TERRANE_TRY(const auto scan, RasterScan::open(settings.scan_file, path, grid));
            use.samples_hash = scan.samples()->hash().text();
        }
        return std::shared_ptr<const DemSource>(
            new DemSource(store, fine, std::move(bounds), std::move(use)));
    };
    // A scan has the bounds too.
    TERRANE_TRY(auto cache, OpeningCache::create(writes_scan ? DemCache{} : settings.bounds_cache,
                                                 path, *fine));
    if (std::optional<OpeningBounds> kept = cache.load(fine)) {
        progress.begin(1.0, 1);
        TERRANE_TRY(progress.step());
        return done(std::move(*kept), cache.use());
    }
    TERRANE_TRY(auto pyramid, HeightPyramid::create(grid, *store, progress));
    TERRANE_TRY(auto tiers, BoundTiers::create(fine, progress, store->memory()));
    OpeningBounds bounds{std::move(pyramid), std::move(tiers)};
    cache.save(bounds);
    return done(std::move(bounds), cache.use());
}

Result<std::shared_ptr<const DemSource>> DemSource::reopen(std::shared_ptr<RasterReader> reader,
                                                           double finest_spacing,
                                                           const StoreSettings& settings,
                                                           double spacing_tolerance,
                                                           OpeningProgress& progress) {
    TERRANE_TRY(const auto grid, make_grid(reader->info(), finest_spacing, spacing_tolerance));
    TERRANE_TRY(const auto scan, RasterScan::open(settings.scan_file, reader->path(), grid));
    const std::string file_versions = reader->file_versions();
    const std::shared_ptr<const RasterStore> store =
        RasterStore::reopen(std::move(reader), settings, scan.samples());
    // A copy of the files may have the same samples; later changes are found when samples are read.
    if (file_versions.empty() || file_versions != scan.file_versions()) {
        TERRANE_TRY(store->check_all(progress));
    }
    const auto fine = std::make_shared<const FineSurface>(grid, store);
    TERRANE_TRY(auto bounds, scan.bounds(fine));
    progress.begin(1.0, 1);
    TERRANE_TRY(progress.step());
    CacheUse use;
    use.samples_hash = scan.samples()->hash().text();
    return std::shared_ptr<const DemSource>(
        new DemSource(store, fine, std::move(bounds), std::move(use)));
}

double DemSource::height(double x, double y) const {
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    if (!std::isfinite(x) || !std::isfinite(y)) return kNaN;
    // The surface repeats the raster's edge, so coordinates may be clamped to slightly beyond it.
    const BilinearGrid& g = grid();
    const WorldRect& e = extent();
    const double near_x = std::clamp(x, e.west - g.cell_x, e.east + g.cell_x);
    const double near_y = std::clamp(y, e.south - g.cell_y, e.north + g.cell_y);
    return store_->base() + fine_->height(g.column_at(near_x), g.row_at(near_y)).value_or(kNaN);
}

void DemSource::add_base(std::span<double> heights) const {
    for (double& height : heights) height += store_->base();
}

double DemSource::store_error(LatticePoint low, LatticePoint high) const {
    if (!store_->is_resampled()) return store_->rounding();
    // Resampled cells are square, so the grid is aligned.
    const BilinearGrid& g = fine_->grid();
    const auto cell = [&g](std::int64_t index, std::int64_t first) {
        return (index - first) >> g.cell_log2;
    };
    return store_->rounding() + store_->error_over(cell(low.x, g.first.x), cell(low.y, g.first.y),
                                                   cell(high.x, g.first.x),
                                                   cell(high.y, g.first.y));
}

Result<void> DemSource::sample(const SampleGrid& grid, std::span<double> heights_out) const {
    if (tiers_->has_heights(grid)) {
        TERRANE_TRY(tiers_->sample(grid, heights_out));
        add_base(heights_out.first(grid.size()));
        return {};
    }
    // The points of a grid much coarser than the raster are evaluated one by one.
    constexpr std::int64_t kFewCells = 16;
    if (grid.step <= kFewCells * fine_->grid().base_step()) {
        TERRANE_TRY(const auto patch, fine_->patch(grid, 0));
        fine_->sample(patch, grid, heights_out);
        add_base(heights_out.first(grid.size()));
        return {};
    }
    std::size_t at = 0;
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column) {
            TERRANE_TRY(
                const auto z,
                fine_->height(fine_->grid().column_at_index(grid.corner.x + column * grid.step),
                              fine_->grid().row_at_index(grid.corner.y + row * grid.step)));
            heights_out[at++] = store_->base() + z;
        }
    }
    return {};
}

void DemSource::add_vertex_errors(const SampleGrid& grid, std::span<float> bounds) const {
    if (store_->rounding() == 0.0 && !store_->is_resampled()) return;
    const auto error = [this](LatticePoint low, LatticePoint high) {
        return store_error(low, high);
    };
    add_vertex_error(grid, error, bounds);
}

void DemSource::add_cell_errors(const SampleGrid& grid, std::span<float> bounds) const {
    if (store_->rounding() == 0.0 && !store_->is_resampled()) return;
    const auto error = [this](LatticePoint low, LatticePoint high) {
        return store_error(low, high);
    };
    add_cell_error(grid, error, bounds);
}

Result<void> DemSource::vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    TERRANE_ASSERT(grid.corner.x % (2 * grid.step) == 0 && grid.corner.y % (2 * grid.step) == 0,
                   "the corner of a grid of vertices must be a multiple of twice its step");
    if (grid.step >= tiers_->first_step()) {
        TERRANE_TRY(tiers_->vertex_bounds(grid, bounds_out));
    } else
        TERRANE_TRY(fine_->vertex_bounds(grid, bounds_out));
    add_vertex_errors(grid, bounds_out);
    return {};
}

Result<void> DemSource::cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    TERRANE_ASSERT(grid.corner.x % grid.step == 0 && grid.corner.y % grid.step == 0,
                   "the corner of a grid of cells must be a multiple of its step");
    if (grid.step >= tiers_->first_step()) {
        TERRANE_TRY(tiers_->cell_bounds(grid, bounds_out));
    } else
        TERRANE_TRY(fine_->cell_bounds(grid, bounds_out));
    add_cell_errors(grid, bounds_out);
    return {};
}

Result<void> DemSource::mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                                    std::span<float> cell_bounds_out) const {
    if (grid.step >= tiers_->first_step()) {
        return HeightSource::mesh_bounds(grid, vertex_bounds_out, cell_bounds_out);
    }
    TERRANE_TRY(fine_->mesh_bounds(grid, vertex_bounds_out, cell_bounds_out));
    add_vertex_errors(grid, vertex_bounds_out);
    add_cell_errors(grid, cell_bounds_out);
    return {};
}

Result<void> DemSource::cell_flags(const SampleGrid& grid,
                                   std::span<std::uint8_t> flags_out) const {
    if (!tiers_->has_cell_flags(grid.step)) {
        return find_cell_flags(*store_, fine_->grid(), grid, flags_out);
    }
    return tiers_->cell_flags(grid, flags_out);
}

HeightInterval DemSource::interval(const WorldRect& rect) const {
    const HeightInterval relative = pyramid_.interval(rect);
    return {store_->base() + relative.low - store_->rounding(),
            store_->base() + relative.high + store_->rounding()};
}

double DemSource::rise_bound(double distance) const {
    return pyramid_.rise_bound(distance) + 2.0 * store_->rounding();
}

const FineSurface* DemSource::bilinear_surface() const {
    return store_->is_resampled() ? nullptr : fine_.get();
}

}  // namespace terrane::internal
