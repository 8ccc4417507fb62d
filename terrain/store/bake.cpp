// SPDX-License-Identifier: MIT
#include "bake.h"

#include "bilinear/fine_surface.h"
#include "bilinear/raster_samples.h"

#include <terrane/terrain/chunk.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace terrane::internal {
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

// Chunks are made in batches by any number of threads and written in the order of the directory, so that the file does
// not depend on the number of threads.

namespace {

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

}  // namespace

Baked bake_chunk(const Bakeable& bakeable, const ChunkKey& key) {
    Baked baked;
    const PartHeights& source = *bakeable.source;
    const Lattice& lattice = source.lattice();
    const ChunkContent kept = content_of(lattice, bakeable.world.raster, key.level);
    const auto chunk =
        kept == ChunkContent::all
            ? make_chunk(source, key)
            : make_chunk_without_reaches(source, key, kept == ChunkContent::vertex_bounds);
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
    if (!std::isfinite(heights.low) || !std::isfinite(heights.high)) {
        baked.error =
            Error{ErrorCode::io, "the range of heights over chunk " + std::to_string(key.x) + ", " +
                                     std::to_string(key.y) + " of level " +
                                     std::to_string(key.level) + " cannot be read"};
        return baked;
    }
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

ChunkKey repeated_chunk(const StoreWorld& world, const ChunkKey& key) {
    if (!world.raster) return key;
    const BilinearGrid& grid = world.raster->grid;
    const double spacing = world.lattice.level_spacing(key.level);
    // Heights and bounds of a chunk depend on samples within this distance.
    const double around = 16.0 * spacing + std::max(grid.cell_x, grid.cell_y);
    const auto nearest = [&](std::int32_t index, double origin, double first, double last) {
        const double side = kChunkCells * spacing;
        const double before = std::floor((first - around - origin) / side) - 1.0;
        const double after = std::ceil((last + around - origin) / side);
        if (index < before) return static_cast<std::int32_t>(before);
        if (index > after) return static_cast<std::int32_t>(after);
        return index;
    };
    ChunkKey repeated = key;
    repeated.x = nearest(key.x, world.lattice.origin_x, grid.west,
                         grid.west + (grid.columns - 1) * grid.cell_x);
    repeated.y = nearest(key.y, world.lattice.origin_y, grid.south,
                         grid.south + (grid.rows - 1) * grid.cell_y);
    return repeated;
}

namespace {

/// Chunks that others equal. Threads: any number at once.
class RepeatedChunks {
public:
    explicit RepeatedChunks(const Bakeable& bakeable) : bakeable_(bakeable) {}

    Baked bake(const ChunkKey& key) {
        const ChunkKey repeated = repeated_chunk(bakeable_.world, key);
        if (repeated == key) return bake_chunk(bakeable_, key);
        {
            const std::lock_guard lock(mutex_);
            if (const auto found = baked_.find(repeated); found != baked_.end()) {
                return found->second;
            }
        }
        Baked baked = bake_chunk(bakeable_, repeated);
        const std::lock_guard lock(mutex_);
        if (baked_.size() == kMost) baked_.clear();
        baked_.emplace(repeated, baked);
        return baked;
    }

private:
    static constexpr std::size_t kMost = 256;

    const Bakeable& bakeable_;
    std::mutex mutex_;
    std::map<ChunkKey, Baked> baked_;
};

/// Makes items on several threads, and hands them over in order on this one.
///
/// @param begin Result<void>(double share), before each batch
/// @param make  Item(std::size_t index)
/// @param take  Result<void>(Item&)
template <class Item, class Begin, class Make, class Take>
Result<void> in_batches(int worker_count, std::size_t count, const Begin& begin, const Make& make,
                        const Take& take) {
    std::vector<Item> batch;
    for (std::size_t first = 0; first < count; first += batch.size()) {
        TERRANE_TRY(begin(static_cast<double>(first) / static_cast<double>(count)));
        batch.assign(
            std::min<std::size_t>(8 * static_cast<std::size_t>(worker_count), count - first), {});
        {
            std::atomic<std::size_t> next{0};
            const auto run = [&] {
                for (std::size_t i = next++; i < batch.size(); i = next++)
                    batch[i] = make(first + i);
            };
            std::vector<std::jthread> helpers;
            while (static_cast<int>(helpers.size()) + 1 < worker_count) helpers.emplace_back(run);
            run();
        }
        for (Item& item : batch) {
            if (item.error) return tl::unexpected(*item.error);
            TERRANE_TRY(take(item));
        }
    }
    return {};
}

}  // namespace

int worker_count_of(const BakeSettings& settings) {
    if (settings.worker_count > 0) return settings.worker_count;
    return std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 64);
}

namespace {

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
    raster.squares =
        squares_around(raster.grid, {lattice.west(), lattice.south()},
                       {lattice.east(), lattice.north()}, kFineCells * raster.grid.base_step());
    return raster;
}

}  // namespace

BakedSquare bake_square(const Bakeable& bakeable, const SquareKey& key) {
    BakedSquare baked;
    const RasterSamples& samples = bakeable.source->raster_surface()->samples();
    const StoredRaster& raster = *bakeable.world.raster;
    const int columns = raster.columns_of(key.x), rows = raster.rows_of(key.y);
    std::vector<double> heights(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
    const auto read =
        samples.read(std::int64_t{key.x} * StoredRaster::kSquareSide,
                     std::int64_t{key.y} * StoredRaster::kSquareSide, columns, rows, heights);
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

Result<Extremes> bake_chunks(const Bakeable& bakeable, int worker_count, std::size_t count,
                             const std::function<ChunkKey(std::size_t)>& key_at,
                             const std::function<Result<void>(double)>& begin, SealedWriter& file,
                             std::vector<ChunkRecord>& records_out) {
    Extremes extremes;
    RepeatedChunks chunks(bakeable);
    const auto make = [&](std::size_t i) { return chunks.bake(key_at(i)); };
    const auto take = [&](Baked& baked) -> Result<void> {
        TERRANE_TRY(baked.record.offset, file.append(baked.stored));
        records_out.push_back(baked.record);
        extremes.max_error_m = std::max(extremes.max_error_m, baked.max_error_m);
        extremes.steepest = std::max(extremes.steepest, baked.steepest);
        return {};
    };
    TERRANE_TRY(in_batches<Baked>(worker_count, count, begin, make, take));
    return extremes;
}

Result<void> bake_squares(const Bakeable& bakeable, int worker_count, std::size_t count,
                          const std::function<SquareKey(std::size_t)>& key_at, SealedWriter& file,
                          std::vector<StoredRecord>& records_out) {
    const auto make = [&](std::size_t i) { return bake_square(bakeable, key_at(i)); };
    const auto take = [&](BakedSquare& square) -> Result<void> {
        TERRANE_TRY(const auto offset, file.append(square.stored));
        records_out.push_back(
            {offset, static_cast<std::uint32_t>(square.stored.size()), square.hash});
        return {};
    };
    const auto begin = [](double) -> Result<void> { return {}; };
    return in_batches<BakedSquare>(worker_count, count, begin, make, take);
}

namespace {

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

}  // namespace

std::vector<double> find_rises(const Lattice& lattice, std::vector<double> rises, double steepest) {
    const double slope = std::sqrt(steepest) * (1.0 + 1e-12);
    const std::vector<double> distances = rise_distances(lattice);
    for (std::size_t i = 0; i < rises.size(); ++i) {
        rises[i] = std::max(rises[i], slope * std::min(distances[i], lattice.spacing));
    }
    return rises;
}

Result<Bakeable> begin_bake(const HeightSource& whole, const std::string& path,
                            const BakeSettings& settings) {
    TERRANE_TRY(check_settings(settings));
    if (!whole.is_certified()) {
        return fail(ErrorCode::invalid_argument,
                    "cannot bake \"" + path +
                        "\": a store holds certified bounds, and the source has estimates");
    }
    Bakeable bakeable;
    TERRANE_TRY(bakeable.source, PartHeights::create(whole, settings.level_count, settings.region));
    StoreWorld& world = bakeable.world;
    world.lattice = bakeable.source->lattice();
    world.extent = bakeable.source->extent();
    world.note = settings.note;
    world.raster = raster_of(*bakeable.source);
    for (const double distance : rise_distances(world.lattice)) {
        world.rises.push_back(bakeable.source->rise_bound(distance));
    }
    return bakeable;
}

}  // namespace terrane::internal

namespace terrane {

using namespace internal;

Result<StoreInfo> ChunkStore::bake(const HeightSource& whole, const std::string& path,
                                   const BakeSettings& settings) {
    TERRANE_TRY(auto bakeable, begin_bake(whole, path, settings));
    const Lattice& lattice = bakeable.source->lattice();
    const std::int64_t count = count_chunks(lattice);
    if (count > kMostChunks) {
        return fail(ErrorCode::invalid_argument,
                    "a store in one file holds at most 67108864 chunks; " +
                        std::to_string(lattice.finest_level + 1) + " levels of " +
                        std::to_string(lattice.root_count_x) + " x " +
                        std::to_string(lattice.root_count_y) + " root squares have more");
    }
    TERRANE_TRY(auto file, SealedWriter::create(path, kStoreKind));
    StoreDirectory directory;
    const int worker_count = worker_count_of(settings);
    const auto begin = [&](double share) -> Result<void> {
        if (!settings.progress || settings.progress(share)) return {};
        return fail(ErrorCode::cancelled, "the store \"" + path + "\" was given up");
    };
    const auto chunk_at = [&](std::size_t i) {
        return key_at(lattice, static_cast<std::int64_t>(i));
    };
    TERRANE_TRY(const Extremes extremes,
                bake_chunks(bakeable, worker_count, static_cast<std::size_t>(count), chunk_at,
                            begin, file, directory.chunks));
    if (bakeable.world.raster) {
        const SquareRange& squares = bakeable.world.raster->squares;
        TERRANE_TRY(bake_squares(
            bakeable, worker_count, squares.count(),
            [&](std::size_t i) { return squares.key_at(i); }, file, directory.squares));
    }
    StoreWorld& world = directory;
    world = std::move(bakeable.world);
    world.max_error_m = extremes.max_error_m;
    world.rises = find_rises(world.lattice, std::move(world.rises), extremes.steepest);
    TERRANE_TRY(file.commit(encode(directory)));
    return StoreInfo{count, file.bytes(), directory.max_error_m, sha_of(directory), settings.note};
}

}  // namespace terrane
