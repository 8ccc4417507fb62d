// SPDX-License-Identifier: MIT
#pragma once

#include "bilinear/fine_surface.h"
#include "store_format.h"

#include <terrane/base/result.h>
#include <terrane/store/chunk_store.h>
#include <terrane/store/sealed_file.h>
#include <terrane/terrain/chunk.h>
#include <terrane/terrain/height_source.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

// Baking chunks and squares of samples into the records of a file.
namespace terrane::internal {

/// A world that consists of part of another source's world: its coarser levels, a region, or both. Positions, heights
/// and bounds are the other source's.
class PartHeights final : public HeightSource {
public:
    /// @param base        must outlive the part
    /// @param level_count levels from the root squares down; 0: all
    /// @param region      metres, extended to whole root squares of the part; absent: the whole world
    ///
    /// Fails: invalid_argument if the base has fewer levels, or the region is empty or outside the world
    static Result<std::unique_ptr<const PartHeights>> create(
        const HeightSource& base, int level_count, const std::optional<WorldRect>& region);

    double height(double x, double y) const override { return base_.height(x, y); }
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override {
        return base_.sample(widen(grid), heights_out);
    }
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        return base_.vertex_bounds(widen(grid), bounds_out);
    }
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override {
        return base_.cell_bounds(widen(grid), bounds_out);
    }
    Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                             std::span<float> cell_bounds_out) const override {
        return base_.mesh_bounds(widen(grid), vertex_bounds_out, cell_bounds_out);
    }
    Result<void> cell_flags(const SampleGrid& grid,
                            std::span<std::uint8_t> flags_out) const override {
        return base_.cell_flags(widen(grid), flags_out);
    }
    HeightInterval interval(const WorldRect& rect) const override { return base_.interval(rect); }
    double rise_bound(double distance) const override { return base_.rise_bound(distance); }

    /// The surface of the base's raster. Null if the base has none, or if part and base number lattice points
    /// differently.
    const FineSurface* raster_surface() const {
        const auto* bilinear = dynamic_cast<const BilinearSource*>(&base_);
        return bilinear != nullptr && shift_ == 0 ? bilinear->bilinear_surface() : nullptr;
    }

private:
    PartHeights(const HeightSource& base, const Lattice& lattice, const WorldRect& extent,
                int shift)
        : HeightSource(lattice, extent), base_(base), shift_(shift) {}
    /// Converts a grid from units of the part's finest spacing to units of the base's finest spacing.
    SampleGrid widen(const SampleGrid& grid) const {
        const std::int64_t factor = std::int64_t{1} << shift_;
        return {{grid.corner.x * factor, grid.corner.y * factor},
                grid.step * factor,
                grid.columns,
                grid.rows};
    }

    const HeightSource& base_;
    int shift_ = 0;  ///< number of the base's levels that are finer than the part's finest
};

/// A part of a source that can be baked, and what its store says about it but for max_error_m; rises are those of the
/// source.
struct Bakeable {
    std::unique_ptr<const PartHeights> source;
    StoreWorld world;
};

/// Checks settings, and begins to bake a source, which must outlive the result.
///
/// @param path for messages
///
/// Fails: invalid_argument
Result<Bakeable> begin_bake(const HeightSource& whole, const std::string& path,
                            const BakeSettings& settings);

/// Threads to bake with.
int worker_count_of(const BakeSettings& settings);

/// An encoded chunk and its contributions to the directory.
struct Baked {
    std::vector<std::uint8_t> stored;
    ChunkRecord record;
    double max_error_m = 0.0;  ///< finest level only: largest error over ground
    double steepest = 0.0;     ///< finest level only: square of the triangles' steepest slope
    std::optional<Error> error;
};

Baked bake_chunk(const Bakeable& bakeable, const ChunkKey& key);

/// A chunk with the same record as `key`, except for its place in a file. Beyond a raster the surface repeats the
/// raster's edge, so the chunks that lie far enough beyond an edge equal the nearest of them.
ChunkKey repeated_chunk(const StoreWorld& world, const ChunkKey& key);

/// An encoded square of a raster.
struct BakedSquare {
    std::vector<std::uint8_t> stored;
    ContentHash hash;
    std::optional<Error> error;
};

/// Requires a raster.
BakedSquare bake_square(const Bakeable& bakeable, const SquareKey& key);

/// What the records of the chunks of a file say together.
struct Extremes {
    double max_error_m = 0.0, steepest = 0.0;  ///< as in Baked
};

/// Bakes chunks on several threads, writes them in order, and adds their records.
///
/// @param begin called on this thread before each batch, with the share that is done; may fail
Result<Extremes> bake_chunks(const Bakeable& bakeable, int worker_count, std::size_t count,
                             const std::function<ChunkKey(std::size_t)>& key_at,
                             const std::function<Result<void>(double)>& begin, SealedWriter& file,
                             std::vector<ChunkRecord>& records_out);
/// The same for squares of the raster; requires one.
Result<void> bake_squares(const Bakeable& bakeable, int worker_count, std::size_t count,
                          const std::function<SquareKey(std::size_t)>& key_at, SealedWriter& file,
                          std::vector<StoredRecord>& records_out);

/// Computes StoreWorld::rises: bounds for the baked surface and, up to a distance of one spacing, also for the finest
/// triangles, whose slope may be up to 1.41 times that of the surface.
///
/// @param rises of the baked surface
std::vector<double> find_rises(const Lattice& lattice, std::vector<double> rises, double steepest);

}  // namespace terrane::internal
