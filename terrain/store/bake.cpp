// SPDX-License-Identifier: MIT
#include "bilinear/fine_surface.h"
#include "bilinear/raster_samples.h"
#include "store_format.h"

#include <terrane/store/chunk_store.h>
#include <terrane/terrain/chunk.h>
#include <terrane/terrain/height_source.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

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

namespace {

/// Chunk indices along one axis, `end` excluded. chunks_over() finds those over [low, high], clipped to the world.
struct ChunkRange {
    std::int32_t first = 0, end = 0;
};

ChunkRange chunks_over(double low, double high, double origin, double side, std::int64_t first,
                       std::int64_t end) {
    const auto index = [&](double place) {
        return static_cast<std::int64_t>(
            std::clamp(place, static_cast<double>(first) - 1.0, static_cast<double>(end) + 1.0));
    };
    const std::int64_t from = std::clamp(index(std::floor((low - origin) / side)), first, end - 1);
    const std::int64_t to = std::clamp(index(std::ceil((high - origin) / side)), from + 1, end);
    return {static_cast<std::int32_t>(from), static_cast<std::int32_t>(to)};
}

std::string text_of(const WorldRect& rect) {
    return std::to_string(rect.west) + ", " + std::to_string(rect.south) + ", " +
           std::to_string(rect.east) + ", " + std::to_string(rect.north);
}

}  // namespace

Result<std::unique_ptr<const PartHeights>> PartHeights::create(
    const HeightSource& base, int level_count, const std::optional<WorldRect>& region) {
    const Lattice& whole = base.lattice();
    if (level_count < 0 || level_count > whole.finest_level + 1) {
        return fail(ErrorCode::invalid_argument,
                    "level_count must be 1 to " + std::to_string(whole.finest_level + 1) +
                        ", or 0 for all, got " + std::to_string(level_count));
    }
    const int finest = level_count == 0 ? whole.finest_level : level_count - 1;
    const int shift = whole.finest_level - finest;
    Lattice lattice = whole;
    lattice.spacing = whole.level_spacing(finest);
    lattice.finest_level = finest;
    WorldRect extent = base.extent();
    if (region) {
        const bool is_rect = region->west < region->east && region->south < region->north;
        if (!is_rect || region->west >= extent.east || region->east <= extent.west ||
            region->south >= extent.north || region->north <= extent.south) {
            return fail(ErrorCode::invalid_argument,
                        "region must be west, south, east, north inside " + text_of(extent) +
                            " m, got " + text_of(*region));
        }
        // Chooses root squares of about the region's size, so that few of them cover it.
        const double side = std::max(region->east - region->west, region->north - region->south);
        int root = 0;
        while (root < finest && whole.level_spacing(root + 1) * kChunkCells >= side) ++root;
        const double root_side = whole.level_spacing(root) * kChunkCells;
        const std::int64_t per_root = std::int64_t{1} << root;
        const ChunkRange x = chunks_over(
            region->west, region->east, whole.origin_x, root_side, whole.first_root_x * per_root,
            (std::int64_t{whole.first_root_x} + whole.root_count_x) * per_root);
        const ChunkRange y = chunks_over(
            region->south, region->north, whole.origin_y, root_side, whole.first_root_y * per_root,
            (std::int64_t{whole.first_root_y} + whole.root_count_y) * per_root);
        lattice.finest_level = finest - root;
        lattice.first_root_x = x.first;
        lattice.first_root_y = y.first;
        lattice.root_count_x = x.end - x.first;
        lattice.root_count_y = y.end - y.first;
        extent.west = std::max(extent.west, lattice.x(lattice.west()));
        extent.south = std::max(extent.south, lattice.y(lattice.south()));
        extent.east = std::min(extent.east, lattice.x(lattice.east()));
        extent.north = std::min(extent.north, lattice.y(lattice.north()));
    }
    TERRANE_TRY(lattice.validate());
    return std::unique_ptr<const PartHeights>(new PartHeights(base, lattice, extent, shift));
}

}  // namespace terrane::internal

// Chunks are made in batches by any number of threads and written in the order of the directory, so that the file does
// not depend on the number of threads.

namespace terrane {
namespace {

using namespace internal;

/// An encoded chunk and its contributions to the directory.
struct Baked {
    std::vector<std::uint8_t> stored;
    ChunkRecord record;
    double max_error_m = 0.0;  ///< finest level only: largest error over ground
    double steepest = 0.0;     ///< finest level only: square of the triangles' steepest slope
    std::optional<Error> error;
};

/// Square of the steepest slope of a chunk's triangles, each of which has one side along x and one along y.
double steepest_of(const Chunk& chunk, const Lattice& lattice) {
    const auto rise = [&chunk](int x0, int y0, int x1, int y1) {
        return std::int64_t{chunk.heights[sample_index(x1, y1)]} -
               chunk.heights[sample_index(x0, y0)];
    };
    double steepest = 0.0;
    for (int y = 0; y < kChunkCells; ++y) {
        for (int x = 0; x < kChunkCells; ++x) {
            const std::int64_t south = rise(x, y, x + 1, y), north = rise(x, y + 1, x + 1, y + 1);
            const std::int64_t west = rise(x, y, x, y + 1), east = rise(x + 1, y, x + 1, y + 1);
            const auto square = [](std::int64_t a, std::int64_t b) {
                const auto wide_a = static_cast<double>(a), wide_b = static_cast<double>(b);
                return wide_a * wide_a + wide_b * wide_b;
            };
            const bool rises =
                cut_to_north_east(chunk.corner.x / chunk.step + x, chunk.corner.y / chunk.step + y);
            steepest = std::max({steepest, rises ? square(south, east) : square(south, west),
                                 rises ? square(north, west) : square(north, east)});
        }
    }
    const double unit = lattice.quantum / lattice.spacing;
    return steepest * unit * unit;
}

Baked bake_chunk(const HeightSource& source, const ChunkKey& key, ChunkContent kept) {
    Baked baked;
    const Lattice& lattice = source.lattice();
    // If bounds of vertices are not stored, they need not be computed, which takes longer than all else.
    const auto chunk =
        kept == ChunkContent::flags
            ? make_bounded_chunk(source, key, std::make_shared<ChunkVertices>(), {}, {})
            : make_chunk(source, key);
    if (!chunk) {
        baked.error = chunk.error();
        return baked;
    }
    const std::vector<std::uint8_t> content = encode_chunk(**chunk, kept);
    baked.stored = compress(content);
    baked.record.bytes = static_cast<std::uint32_t>(baked.stored.size());
    baked.record.hash = hash_of(content);
    const LatticePoint corner = lattice.corner(key);
    const std::int64_t side = lattice.chunk_side(key.level);
    const HeightInterval heights =
        source.interval({lattice.x(corner.x), lattice.y(corner.y), lattice.x(corner.x + side),
                         lattice.y(corner.y + side)});
    // The interval must also contain the samples, which are rounded to quanta.
    baked.record.heights = {std::min(heights.low, lattice.quantum * (*chunk)->low),
                            std::max(heights.high, lattice.quantum * (*chunk)->high)};
    if (key.level < lattice.finest_level) return baked;
    baked.steepest = steepest_of(**chunk, lattice);
    for (int row = 0; row < kChunkCells; ++row) {
        for (int column = 0; column < kChunkCells; ++column) {
            if (((*chunk)->flags_at(column, row) & cell_outside) != 0) continue;
            baked.max_error_m =
                std::max(baked.max_error_m,
                         static_cast<double>((*chunk)->cell_bounds[cell_index(column, row)]));
        }
    }
    return baked;
}

/// Calls work(i) for i from 0 to count - 1 on several threads.
template <typename Work>
void on_threads(int worker_count, std::size_t count, Work&& work) {
    std::atomic<std::size_t> next{0};
    const auto run = [&] {
        for (std::size_t i = next++; i < count; i = next++) work(i);
    };
    std::vector<std::jthread> helpers;
    while (static_cast<int>(helpers.size()) + 1 < worker_count) helpers.emplace_back(run);
    run();
}

/// The raster of a source whose finest levels are computed from its samples, without the squares' records; absent if
/// the source has none, or no level is computed.
std::optional<StoredRaster> raster_of(const PartHeights& source) {
    const FineSurface* const surface = source.raster_surface();
    if (surface == nullptr) return std::nullopt;
    const Lattice& lattice = source.lattice();
    StoredRaster raster;
    raster.grid = surface->grid();
    raster.grid.lattice = lattice;
    raster.packing = surface->samples().packing();
    raster.rounding = surface->samples().rounding();
    if (content_of(lattice, raster, lattice.finest_level) == ChunkContent::all) return std::nullopt;
    for (const double distance : rise_distances(lattice)) {
        raster.rises.push_back(source.rise_bound(distance));
    }
    // Bounds depend on points within three steps around a chunk and its margin, and on kBoundsMargin samples more.
    const BilinearGrid& grid = raster.grid;
    const std::int64_t margin = kFineCells * (3 + kReachCells) * grid.base_step();
    const auto squares = [](SamplePlace first, SamplePlace last, int samples, int& first_out,
                            int& count_out) {
        const auto square_of = [samples](std::int64_t index) {
            return static_cast<int>(std::clamp<std::int64_t>(index, 0, samples - 1) /
                                    StoredRaster::kSquareSide);
        };
        first_out = square_of(first.index - kBoundsMargin);
        count_out = square_of(last.index + 2 + kBoundsMargin) - first_out + 1;
    };
    squares(grid.column_at_index(lattice.west() - margin),
            grid.column_at_index(lattice.east() + margin), grid.columns, raster.first_column,
            raster.column_count);
    squares(grid.row_at_index(lattice.south() - margin),
            grid.row_at_index(lattice.north() + margin), grid.rows, raster.first_row,
            raster.row_count);
    return raster;
}

/// An encoded square of a raster.
struct BakedSquare {
    std::vector<std::uint8_t> stored;
    ContentHash hash;
    std::optional<Error> error;
};

BakedSquare bake_square(const RasterSamples& samples, const StoredRaster& raster, int x, int y) {
    BakedSquare baked;
    const int columns = raster.columns_of(x), rows = raster.rows_of(y);
    std::vector<double> heights(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
    const auto read =
        samples.read(std::int64_t{x} * StoredRaster::kSquareSide,
                     std::int64_t{y} * StoredRaster::kSquareSide, columns, rows, heights);
    if (!read) {
        baked.error = read.error();
        return baked;
    }
    std::vector<std::uint32_t> packed;
    for (const double height : heights) packed.push_back(raster.packing.pack_relative(height));
    const auto content = encode_square(packed, raster.packing.is_integer(), columns);
    baked.stored = compress(content);
    baked.hash = hash_of(content);
    return baked;
}

/// Writes the squares of a raster in batches, and adds their records.
Result<void> bake_squares(const RasterSamples& samples, int worker_count, SealedWriter& file,
                          StoredRaster& raster) {
    const std::size_t count =
        static_cast<std::size_t>(raster.column_count) * static_cast<std::size_t>(raster.row_count);
    std::vector<BakedSquare> batch;
    while (raster.squares.size() < count) {
        const std::size_t first = raster.squares.size();
        batch.assign(
            std::min<std::size_t>(8 * static_cast<std::size_t>(worker_count), count - first), {});
        on_threads(worker_count, batch.size(), [&](std::size_t i) {
            const auto at = static_cast<int>(first + i);
            batch[i] = bake_square(samples, raster, raster.first_column + at % raster.column_count,
                                   raster.first_row + at / raster.column_count);
        });
        for (const BakedSquare& square : batch) {
            if (square.error) return tl::unexpected(*square.error);
            TERRANE_TRY(const auto offset, file.append(square.stored));
            raster.squares.push_back(
                {offset, static_cast<std::uint32_t>(square.stored.size()), square.hash});
        }
    }
    return {};
}

Result<void> check_settings(const BakeSettings& settings) {
    constexpr int kMostWorkers = 256;
    if (settings.worker_count < 0 || settings.worker_count > kMostWorkers) {
        return fail(ErrorCode::invalid_argument,
                    "worker_count must be 0 to 256, got " + std::to_string(settings.worker_count));
    }
    if (settings.note.size() > kLongestNote) {
        return fail(ErrorCode::invalid_argument, "note must have at most 1048576 bytes, got " +
                                                     std::to_string(settings.note.size()));
    }
    return {};
}

/// Computes StoreDirectory::rises: bounds for the baked surface and, up to a distance of one spacing, also for the
/// finest triangles, whose slope may be up to 1.41 times that of the surface.
std::vector<double> find_rises(const HeightSource& source, double steepest) {
    std::vector<double> rises;
    const double slope = std::sqrt(steepest) * (1.0 + 1e-12);
    for (const double distance : rise_distances(source.lattice())) {
        const double of_triangles = slope * std::min(distance, source.lattice().spacing);
        rises.push_back(std::max(source.rise_bound(distance), of_triangles));
    }
    return rises;
}

}  // namespace

Result<StoreInfo> ChunkStore::bake(const HeightSource& whole, const std::string& path,
                                   const BakeSettings& settings) {
    TERRANE_TRY(check_settings(settings));
    if (!whole.is_certified()) {
        return fail(ErrorCode::invalid_argument,
                    "cannot bake \"" + path +
                        "\": a store holds certified bounds, and the source has estimates");
    }
    TERRANE_TRY(const auto part, PartHeights::create(whole, settings.level_count, settings.region));
    const PartHeights& source = *part;
    const std::int64_t count = count_chunks(source.lattice());
    if (count > kMostChunks) {
        return fail(ErrorCode::invalid_argument,
                    "a store holds at most 67108864 chunks; " +
                        std::to_string(source.lattice().finest_level + 1) + " levels of " +
                        std::to_string(source.lattice().root_count_x) + " x " +
                        std::to_string(source.lattice().root_count_y) + " root squares have more");
    }
    TERRANE_TRY(auto file, SealedWriter::create(path, kStoreKind));

    StoreDirectory directory;
    directory.lattice = source.lattice();
    directory.extent = source.extent();
    directory.note = settings.note;
    directory.raster = raster_of(source);
    const int worker_count =
        settings.worker_count > 0
            ? settings.worker_count
            : std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 64);
    double steepest = 0.0;
    std::vector<Baked> batch;
    for (std::int64_t first = 0; first < count; first += static_cast<std::int64_t>(batch.size())) {
        const double share = static_cast<double>(first) / static_cast<double>(count);
        if (settings.progress && !settings.progress(share)) {
            return fail(ErrorCode::cancelled, "the store \"" + path + "\" was given up");
        }
        batch.assign(
            static_cast<std::size_t>(std::min<std::int64_t>(8 * worker_count, count - first)), {});
        on_threads(worker_count, batch.size(), [&](std::size_t i) {
            const ChunkKey key = key_at(source.lattice(), first + static_cast<std::int64_t>(i));
            batch[i] =
                bake_chunk(source, key, content_of(source.lattice(), directory.raster, key.level));
        });
        for (Baked& baked : batch) {
            if (baked.error) return tl::unexpected(*baked.error);
            TERRANE_TRY(const auto offset, file.append(baked.stored));
            baked.record.offset = offset;
            directory.chunks.push_back(baked.record);
            directory.max_error_m = std::max(directory.max_error_m, baked.max_error_m);
            steepest = std::max(steepest, baked.steepest);
        }
    }
    if (directory.raster) {
        TERRANE_TRY(bake_squares(source.raster_surface()->samples(), worker_count, file,
                                 *directory.raster));
    }
    directory.rises = find_rises(source, steepest);
    TERRANE_TRY(file.commit(encode(directory)));
    return StoreInfo{count, file.bytes(), directory.max_error_m, sha_of(directory), settings.note};
}

}  // namespace terrane
