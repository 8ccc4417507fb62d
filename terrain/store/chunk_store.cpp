// SPDX-License-Identifier: MIT
#include "bilinear/fine_surface.h"
#include "bilinear/raster_samples.h"
#include "chunk/chunk_vertices.h"
#include "store_format.h"
#include "store_records.h"

#include <terrane/base/result.h>
#include <terrane/store/chunk_store.h>
#include <terrane/terrain/chunk.h>
#include <terrane/terrain/chunk_source.h>
#include <terrane/terrain/height_source.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace terrane::internal {
namespace {

/// The stored rise bound of the shortest of rise_distances() that is not below a distance; absent if all are.
std::optional<double> rise_at(const std::vector<double>& rises,
                              const std::vector<double>& distances, double distance) {
    const auto longer = std::ranges::lower_bound(distances, std::max(distance, 0.0));
    if (longer == distances.end()) return std::nullopt;
    return rises[static_cast<std::size_t>(longer - distances.begin())];
}

}  // namespace

/// The samples of a store's raster. Threads: any number at once.
class StoredSamples final : public RasterSamples {
public:
    /// @param records must outlive the samples
    explicit StoredSamples(const StoreRecords& records)
        : records_(records),
          raster_(*records.world().raster),
          squares_(raster_.grid.columns, StoredRaster::kSquareSide,
                   records.is_slow() ? kMostSlowSquares : kMostSquares,
                   [this](int x, int y) { return read_square(x, y); }) {}

    const SamplePacking& packing() const override { return raster_.packing; }
    double rounding() const override { return raster_.rounding; }
    Result<void> read(std::int64_t column, std::int64_t row, int columns, int rows,
                      std::span<double> heights_out) const override;
    /// If records are slow, reads the squares that make_chunk() needs for a chunk, all at the same time.
    /// Fails: as StoreRecords::squares()
    Result<void> prefetch(const ChunkKey& key, const std::stop_token& stop) const;
    /// The squares that make_chunk() needs for a chunk, and that are not in memory.
    std::vector<SquareKey> missing_squares(const ChunkKey& key) const;

private:
    using Square = std::shared_ptr<const SquareCache::Square>;
    static constexpr std::size_t kMostSquares = 128;      ///< 8 MiB
    static constexpr std::size_t kMostSlowSquares = 512;  ///< 32 MiB
    Result<Square> read_square(int x, int y) const;
    Result<Square> decode(const SquareKey& key, const RecordContent& content) const;

    const StoreRecords& records_;
    const StoredRaster& raster_;
    SquareCache squares_;
};

/// Heights and bounds of a store's raster, from which make_chunk() computes one chunk. Of the source that was baked it
/// has only what make_chunk() asks for.
class RasterChunkSource final : public HeightSource {
public:
    /// @param flags [kChunkCells^2] of the chunk's cells; empty: all are ground
    RasterChunkSource(const StoreRecords& records, const FineSurface& surface,
                      std::span<const std::uint8_t> flags)
        : HeightSource(records.world().lattice, records.world().extent),
          raster_(*records.world().raster),
          distances_(rise_distances(lattice())),
          range_(records.range()),
          surface_(surface),
          flags_(flags) {}

    double height(double x, double y) const override;
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override;
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> mesh_bounds(const SampleGrid& grid, std::span<float> vertex_bounds_out,
                             std::span<float> cell_bounds_out) const override;
    Result<void> cell_flags(const SampleGrid& grid,
                            std::span<std::uint8_t> flags_out) const override;
    HeightInterval interval(const WorldRect&) const override { return range_; }
    double rise_bound(double distance) const override {
        return rise_at(raster_.rises, distances_, distance).value_or(range_.high - range_.low);
    }

private:
    void add_vertex_rounding(const SampleGrid& grid, std::span<float> bounds) const;
    void add_cell_rounding(const SampleGrid& grid, std::span<float> bounds) const;

    const StoredRaster& raster_;
    std::vector<double> distances_;
    HeightInterval range_;
    const FineSurface& surface_;
    std::span<const std::uint8_t> flags_;
};

/// Reads chunks of a store. Threads: any number at once.
class ChunkReader {
public:
    explicit ChunkReader(std::unique_ptr<const StoreRecords> records)
        : records_(std::move(records)) {
        if (!records_->world().raster) return;
        samples_ = std::make_shared<const StoredSamples>(*records_);
        surface_.emplace(records_->world().raster->grid, samples_);
    }

    const StoreRecords& records() const { return *records_; }

    /// Reads, checks and decodes a chunk. Locks only the cache of the raster's samples, for moments.
    /// Fails: io; timed_out; bad_data if it is damaged; cancelled
    Result<std::shared_ptr<const Chunk>> read(const ChunkKey& key,
                                              const std::stop_token& stop = {}) const;
    /// See ChunkSource::expect_chunks().
    void expect(std::span<const ChunkKey> keys) const;
    /// As read(), through a small cache, for queries of single points.
    Result<std::shared_ptr<const Chunk>> find(const ChunkKey& key) const;

private:
    struct CachedChunk {
        std::shared_ptr<const Chunk> chunk;
        std::uint64_t used = 0;
    };

    std::unique_ptr<const StoreRecords> records_;
    std::shared_ptr<const StoredSamples> samples_;  ///< of the raster; null if there is none
    std::optional<FineSurface> surface_;            ///< likewise
    mutable std::mutex mutex_;                      ///< guards the cache
    mutable std::array<CachedChunk, 32> cache_;
    mutable std::uint64_t clock_ = 0;
};

/// A store as a height source. Beyond the world, and for vertices with a spacing above half the side of a root square,
/// a bound is the whole range of heights.
class StoredHeights final : public HeightSource, public ChunkSource {
public:
    explicit StoredHeights(std::unique_ptr<const ChunkReader> reader);

    double height(double x, double y) const override;
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override;
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> cell_flags(const SampleGrid& grid,
                            std::span<std::uint8_t> flags_out) const override;
    HeightInterval interval(const WorldRect& rect) const override;
    double rise_bound(double distance) const override;
    Result<std::shared_ptr<const Chunk>> stored_chunk(const ChunkKey& key,
                                                      const std::stop_token& stop) const override;
    void expect_chunks(std::span<const ChunkKey> keys) const override { reader_->expect(keys); }

private:
    using ChunkResult = Result<std::shared_ptr<const Chunk>>;
    /// Address of a sample or cell in a chunk.
    struct SampleAddress {
        ChunkKey key;
        int column = 0, row = 0;
    };
    bool contains(LatticePoint point) const;
    LatticePoint nearest(LatticePoint point) const;
    SampleAddress find_sample(int level, LatticePoint point) const;
    SampleAddress find_cell(int level, LatticePoint corner) const;
    /// The level whose samples are `step` finest spacings apart; -1 if the step is coarser than the root squares'.
    int level_of(std::int64_t step) const;
    /// The range of heights, an upper bound of every deviation.
    float widest() const;
    Result<float> vertex_bound(LatticePoint point, std::int64_t step) const;

    std::unique_ptr<const ChunkReader> reader_;
    std::vector<double> distances_;
    HeightInterval range_;
};

Result<void> StoredSamples::read(std::int64_t column, std::int64_t row, int columns, int rows,
                                 std::span<double> heights_out) const {
    const auto run = [this](std::int64_t from, std::int64_t of_row, int count, double* out) {
        return squares_.read_run(raster_.packing, from, of_row, count, out);
    };
    return read_window(raster_.grid.columns, raster_.grid.rows, column, row, columns, rows,
                       heights_out, run);
}

Result<StoredSamples::Square> StoredSamples::decode(const SquareKey& key,
                                                    const RecordContent& content) const {
    if (content) {
        if (auto samples = decode_square(*content, raster_.packing.is_integer(),
                                         raster_.columns_of(key.x), raster_.rows_of(key.y))) {
            return std::make_shared<const SquareCache::Square>(std::move(*samples));
        }
    }
    // Whoever reads a chunk names the file.
    return fail(ErrorCode::bad_data, "square " + std::to_string(key.x) + ", " +
                                         std::to_string(key.y) + " of the raster is damaged");
}

Result<StoredSamples::Square> StoredSamples::read_square(int x, int y) const {
    const SquareKey key{x, y};
    // Squares that no chunk of the store needs are not stored.
    if (!raster_.squares.contains(key)) return decode(key, std::nullopt);
    TERRANE_TRY(const auto contents, records_.squares({&key, 1}, {}));
    return decode(key, contents.front());
}

Result<void> StoredSamples::prefetch(const ChunkKey& key, const std::stop_token& stop) const {
    if (!records_.is_slow()) return {};  // each is read when it is needed
    const std::vector<SquareKey> missing = missing_squares(key);
    if (missing.empty()) return {};
    TERRANE_TRY(const auto contents, records_.squares(missing, stop));
    for (std::size_t i = 0; i < missing.size(); ++i) {
        TERRANE_TRY(auto square, decode(missing[i], contents[i]));
        squares_.add(missing[i].x, missing[i].y, std::move(square));
    }
    return {};
}

std::vector<SquareKey> StoredSamples::missing_squares(const ChunkKey& key) const {
    const Lattice& lattice = records_.world().lattice;
    const LatticePoint corner = lattice.corner(key);
    const std::int64_t side = lattice.chunk_side(key.level);
    const SquareRange range = squares_around(
        raster_.grid, corner, {corner.x + side, corner.y + side}, lattice.step(key.level));
    std::vector<SquareKey> missing;
    for (int y = range.first_row; y < range.first_row + range.row_count; ++y) {
        for (int x = range.first_column; x < range.first_column + range.column_count; ++x) {
            if (raster_.squares.contains({x, y}) && squares_.find(x, y) == nullptr)
                missing.push_back({x, y});
        }
    }
    return missing;
}

double RasterChunkSource::height(double x, double y) const {
    const BilinearGrid& grid = raster_.grid;
    return raster_.packing.base() + surface_.height(grid.column_at(x), grid.row_at(y))
                                        .value_or(std::numeric_limits<double>::quiet_NaN());
}

Result<void> RasterChunkSource::sample(const SampleGrid& grid,
                                       std::span<double> heights_out) const {
    TERRANE_TRY(const auto patch, surface_.patch(grid, 0));
    surface_.sample(patch, grid, heights_out);
    for (double& height : heights_out) height += raster_.packing.base();
    return {};
}

void RasterChunkSource::add_vertex_rounding(const SampleGrid& grid, std::span<float> bounds) const {
    if (raster_.rounding == 0.0) return;
    const auto error = [this](LatticePoint, LatticePoint) { return raster_.rounding; };
    add_vertex_error(grid, error, bounds);
}

void RasterChunkSource::add_cell_rounding(const SampleGrid& grid, std::span<float> bounds) const {
    if (raster_.rounding == 0.0) return;
    const auto error = [this](LatticePoint, LatticePoint) { return raster_.rounding; };
    add_cell_error(grid, error, bounds);
}

Result<void> RasterChunkSource::vertex_bounds(const SampleGrid& grid,
                                              std::span<float> bounds_out) const {
    TERRANE_TRY(surface_.vertex_bounds(grid, bounds_out));
    add_vertex_rounding(grid, bounds_out);
    return {};
}

Result<void> RasterChunkSource::cell_bounds(const SampleGrid& grid,
                                            std::span<float> bounds_out) const {
    TERRANE_TRY(surface_.cell_bounds(grid, bounds_out));
    add_cell_rounding(grid, bounds_out);
    return {};
}

Result<void> RasterChunkSource::mesh_bounds(const SampleGrid& grid,
                                            std::span<float> vertex_bounds_out,
                                            std::span<float> cell_bounds_out) const {
    TERRANE_TRY(surface_.mesh_bounds(grid, vertex_bounds_out, cell_bounds_out));
    add_vertex_rounding(grid, vertex_bounds_out);
    add_cell_rounding(grid, cell_bounds_out);
    return {};
}

Result<void> RasterChunkSource::cell_flags(const SampleGrid& grid,
                                           std::span<std::uint8_t> flags_out) const {
    if (flags_.empty()) return HeightSource::cell_flags(grid, flags_out);
    std::ranges::copy(flags_, flags_out.begin());
    return {};
}

Result<std::shared_ptr<const Chunk>> ChunkReader::read(const ChunkKey& key,
                                                       const std::stop_token& stop) const {
    const auto damaged = [&] {
        return fail(ErrorCode::bad_data, "\"" + records_->place() + "\": chunk " +
                                             std::to_string(key.x) + ", " + std::to_string(key.y) +
                                             " of level " + std::to_string(key.level) +
                                             " is damaged");
    };
    TERRANE_TRY(const auto content, records_->chunk(key, stop));
    if (!content) return damaged();
    const StoreWorld& world = records_->world();
    const ChunkContent kind = content_of(world.lattice, world.raster, key.level);
    if (kind == ChunkContent::all) {
        auto chunk = decode_chunk(*content, world.lattice, key);
        if (!chunk) return damaged();
        return chunk;
    }
    auto partial = decode_partial(*content, kind, key.level == 0);
    if (!partial) return damaged();
    if (auto read = samples_->prefetch(key, stop); !read) {
        return read.error().code == ErrorCode::bad_data ? damaged()
                                                        : tl::unexpected(std::move(read.error()));
    }
    const RasterChunkSource source(*records_, *surface_, partial->cell_flags);
    auto chunk =
        partial->vertices == nullptr
            ? make_chunk(source, key, stop)
            : make_bounded_chunk(source, key, std::move(partial->vertices), partial->most, stop);
    if (!chunk && chunk.error().code == ErrorCode::bad_data) return damaged();
    return chunk;
}

void ChunkReader::expect(std::span<const ChunkKey> keys) const {
    if (!records_->is_slow()) return;
    const StoreWorld& world = records_->world();
    std::vector<StoreRecords::Expected> expected;
    for (const ChunkKey& key : keys) {
        StoreRecords::Expected& one = expected.emplace_back();
        one.chunk = key;
        const bool has_all =
            content_of(world.lattice, world.raster, key.level) == ChunkContent::all;
        if (!has_all) one.squares = samples_->missing_squares(key);
    }
    records_->expect(expected);
}

Result<std::shared_ptr<const Chunk>> ChunkReader::find(const ChunkKey& key) const {
    {
        const std::lock_guard lock(mutex_);
        for (CachedChunk& cached : cache_) {
            if (cached.chunk == nullptr || cached.chunk->key != key) continue;
            cached.used = ++clock_;
            return cached.chunk;
        }
    }
    TERRANE_TRY(auto chunk, read(key));
    const std::lock_guard lock(mutex_);
    CachedChunk& oldest = *std::ranges::min_element(cache_, {}, &CachedChunk::used);
    oldest = {chunk, ++clock_};
    return chunk;
}

// The bounds of the baked surface also hold for the triangulation of the finest level. Over each finest triangle, that
// triangulation and a triangle of any level are both linear, so that their difference is largest at a finest sample;
// there the baked surface equals the sample to half a quantum, which every stored bound includes.

StoredHeights::StoredHeights(std::unique_ptr<const ChunkReader> reader)
    : HeightSource(reader->records().world().lattice, reader->records().world().extent),
      reader_(std::move(reader)),
      distances_(rise_distances(lattice())),
      range_(reader_->records().range()) {}

bool StoredHeights::contains(LatticePoint point) const { return nearest(point) == point; }

LatticePoint StoredHeights::nearest(LatticePoint point) const {
    return {std::clamp(point.x, lattice().west(), lattice().east()),
            std::clamp(point.y, lattice().south(), lattice().north())};
}

StoredHeights::SampleAddress StoredHeights::find_sample(int level, LatticePoint point) const {
    // A point on the world's eastern or northern border is the last sample of the last chunk.
    SampleAddress address = find_cell(
        level, {std::min(point.x, lattice().east() - 1), std::min(point.y, lattice().north() - 1)});
    if (point.x == lattice().east()) ++address.column;
    if (point.y == lattice().north()) ++address.row;
    return address;
}

StoredHeights::SampleAddress StoredHeights::find_cell(int level, LatticePoint corner) const {
    const int step_log2 = lattice().finest_level - level;
    const std::int64_t column = corner.x >> step_log2, row = corner.y >> step_log2;
    constexpr int kCellsLog2 = 7;
    static_assert(1 << kCellsLog2 == kChunkCells);
    return {{static_cast<std::int32_t>(column >> kCellsLog2),
             static_cast<std::int32_t>(row >> kCellsLog2), static_cast<std::uint8_t>(level)},
            static_cast<int>(column & (kChunkCells - 1)),
            static_cast<int>(row & (kChunkCells - 1))};
}

int StoredHeights::level_of(std::int64_t step) const {
    const int step_log2 = std::countr_zero(static_cast<std::uint64_t>(step));
    return std::max(lattice().finest_level - step_log2, -1);
}

double StoredHeights::height(double x, double y) const {
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    const Lattice& l = lattice();
    const auto index = [&l](double place, double origin, std::int64_t low, std::int64_t high) {
        return std::clamp((place - origin) / l.spacing, static_cast<double>(low),
                          static_cast<double>(high));
    };
    if (!std::isfinite(x) || !std::isfinite(y)) return kNaN;
    const double u = index(x, l.origin_x, l.west(), l.east());
    const double v = index(y, l.origin_y, l.south(), l.north());
    const LatticePoint corner{std::min(static_cast<std::int64_t>(std::floor(u)), l.east() - 1),
                              std::min(static_cast<std::int64_t>(std::floor(v)), l.north() - 1)};
    const SampleAddress address = find_cell(l.finest_level, corner);
    const ChunkResult chunk = reader_->find(address.key);
    if (!chunk) return kNaN;
    const auto at = [&](int dx, int dy) {
        return l.quantum * (*chunk)->heights[sample_index(address.column + dx, address.row + dy)];
    };
    const double fx = u - static_cast<double>(corner.x), fy = v - static_cast<double>(corner.y);
    const double sw = at(0, 0), se = at(1, 0), nw = at(0, 1), ne = at(1, 1);
    if (cut_to_north_east(corner.x, corner.y)) {
        return fx >= fy ? sw + fx * (se - sw) + fy * (ne - se)
                        : sw + fy * (nw - sw) + fx * (ne - nw);
    }
    return fx + fy <= 1.0 ? sw + fx * (se - sw) + fy * (nw - sw)
                          : ne + (1.0 - fx) * (nw - ne) + (1.0 - fy) * (se - ne);
}

Result<void> StoredHeights::sample(const SampleGrid& grid, std::span<double> heights_out) const {
    // The coarsest level that contains all these points.
    const std::uint64_t all = static_cast<std::uint64_t>(grid.step | grid.corner.x | grid.corner.y);
    const int level = std::max(lattice().finest_level - std::countr_zero(all), 0);
    std::shared_ptr<const Chunk> chunk;
    std::size_t at = 0;
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column) {
            const SampleAddress address = find_sample(
                level,
                nearest({grid.corner.x + column * grid.step, grid.corner.y + row * grid.step}));
            if (chunk == nullptr || chunk->key != address.key) {
                TERRANE_TRY(auto found, reader_->find(address.key));
                chunk = std::move(found);
            }
            heights_out[at++] =
                lattice().quantum * chunk->heights[sample_index(address.column, address.row)];
        }
    }
    return {};
}

float StoredHeights::widest() const {
    return std::nextafter(static_cast<float>(range_.high - range_.low),
                          std::numeric_limits<float>::infinity());
}

Result<float> StoredHeights::vertex_bound(LatticePoint point, std::int64_t step) const {
    const std::int64_t coarsest = lattice().step(0) * kChunkSquares;
    if (!contains(point) || step > coarsest) return widest();
    const SampleAddress address = find_sample(std::max(level_of(step), 0), point);
    TERRANE_TRY(const auto chunk, reader_->find(address.key));
    return bound_of(chunk->vertices->inverse_square_bound(address.column, address.row));
}

Result<void> StoredHeights::vertex_bounds(const SampleGrid& grid,
                                          std::span<float> bounds_out) const {
    TERRANE_ASSERT(grid.corner.x % (2 * grid.step) == 0 && grid.corner.y % (2 * grid.step) == 0,
                   "the corner of a grid of vertices must be a multiple of twice its step");
    std::size_t at = 0;
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = 0; column < grid.columns; ++column, ++at) {
            bounds_out[at] = 0.0f;
            if (((row | column) & 1) == 0) continue;  // vertex of a coarser spacing
            TERRANE_TRY(const float bound, vertex_bound({grid.corner.x + column * grid.step,
                                                         grid.corner.y + row * grid.step},
                                                        grid.step));
            bounds_out[at] = bound;
        }
    }
    return {};
}

Result<void> StoredHeights::cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    TERRANE_ASSERT(grid.corner.x % grid.step == 0 && grid.corner.y % grid.step == 0,
                   "the corner of a grid of cells must be a multiple of its step");
    const int level = level_of(grid.step);
    std::size_t at = 0;
    for (int row = 0; row + 1 < grid.rows; ++row) {
        for (int column = 0; column + 1 < grid.columns; ++column, ++at) {
            const LatticePoint corner{grid.corner.x + column * grid.step,
                                      grid.corner.y + row * grid.step};
            const bool is_inside =
                contains(corner) && contains({corner.x + grid.step, corner.y + grid.step});
            if (level >= 0 && is_inside) {
                const SampleAddress address = find_cell(level, corner);
                TERRANE_TRY(const auto chunk, reader_->find(address.key));
                bounds_out[at] = chunk->cell_bounds[cell_index(address.column, address.row)];
                continue;
            }
            // The triangles of a cell form the diamond of the vertex in its middle.
            const std::int64_t half = grid.step / 2;
            TERRANE_TRY(
                const float bound,
                is_inside ? vertex_bound({corner.x + half, corner.y + half}, half) : widest());
            bounds_out[at] = bound;
        }
    }
    return {};
}

Result<void> StoredHeights::cell_flags(const SampleGrid& grid,
                                       std::span<std::uint8_t> flags_out) const {
    // The coarsest level whose cells subdivide the grid's cells.
    const std::uint64_t all = static_cast<std::uint64_t>(grid.step | grid.corner.x | grid.corner.y);
    const int level = std::max(lattice().finest_level - std::countr_zero(all), 0);
    const std::int64_t part = lattice().step(level);
    std::size_t at = 0;
    for (int row = 0; row + 1 < grid.rows; ++row) {
        for (int column = 0; column + 1 < grid.columns; ++column) {
            std::uint8_t flags = 0;
            for (std::int64_t dy = 0; dy < grid.step; dy += part) {
                for (std::int64_t dx = 0; dx < grid.step; dx += part) {
                    const LatticePoint corner{grid.corner.x + column * grid.step + dx,
                                              grid.corner.y + row * grid.step + dy};
                    if (!contains(corner) || !contains({corner.x + part, corner.y + part})) {
                        flags |= cell_outside;
                        continue;
                    }
                    const SampleAddress address = find_cell(level, corner);
                    TERRANE_TRY(const auto chunk, reader_->find(address.key));
                    flags |= chunk->flags_at(address.column, address.row);
                }
            }
            flags_out[at++] = flags;
        }
    }
    return {};
}

HeightInterval StoredHeights::interval(const WorldRect& rect) const {
    const Lattice& l = lattice();
    const auto index = [&l](double place, double origin, std::int64_t low, std::int64_t end) {
        const double u = std::floor((place - origin) / l.spacing);
        if (!(u > static_cast<double>(low))) return low;  // also for NaN
        return u < static_cast<double>(end) ? static_cast<std::int64_t>(u) : end - 1;
    };
    // A corner on the border of two chunks belongs to both.
    const double margin = 1e-9 * l.spacing;
    const std::int64_t west = index(rect.west - margin, l.origin_x, l.west(), l.east());
    const std::int64_t east = index(rect.east + margin, l.origin_x, l.west(), l.east());
    const std::int64_t south = index(rect.south - margin, l.origin_y, l.south(), l.north());
    const std::int64_t north = index(rect.north + margin, l.origin_y, l.south(), l.north());
    // The finest level on which the rectangle covers at most 8 x 8 chunks.
    int level = l.finest_level;
    while (level > 0 && (east - west) / l.chunk_side(level) + 1 > 8) --level;
    while (level > 0 && (north - south) / l.chunk_side(level) + 1 > 8) --level;
    const ChunkKey first = find_cell(level, {west, south}).key;
    const ChunkKey last = find_cell(level, {east, north}).key;
    HeightInterval found{range_.high, range_.low};
    for (std::int32_t y = first.y; y <= last.y; ++y) {
        for (std::int32_t x = first.x; x <= last.x; ++x) {
            const HeightInterval of_chunk =
                reader_->records().heights({x, y, static_cast<std::uint8_t>(level)});
            found = {std::min(found.low, of_chunk.low), std::max(found.high, of_chunk.high)};
        }
    }
    return found.low <= found.high ? found : range_;  // an empty rectangle
}

double StoredHeights::rise_bound(double distance) const {
    return rise_at(reader_->records().world().rises, distances_, distance)
        .value_or(range_.high - range_.low);
}

Result<std::shared_ptr<const Chunk>> StoredHeights::stored_chunk(
    const ChunkKey& key, const std::stop_token& stop) const {
    if (stop.stop_requested()) return fail(ErrorCode::cancelled, "the chunk was given up");
    return reader_->read(key, stop);
}

}  // namespace terrane::internal

namespace terrane {

using namespace internal;

namespace {

/// Whether a path names a folder.
bool is_folder(const std::string& path) {
    std::error_code ignored;
    return std::filesystem::is_directory(path, ignored);
}

/// The folder of a sharded store, whose path or that of whose `terrain.json` is given; absent if it is no such path.
std::optional<std::string> shard_folder(const std::string& path) {
    if (is_folder(path)) return path;
    const std::filesystem::path file(path);
    if (file.filename() != kManifestName) return std::nullopt;
    return file.has_parent_path() ? file.parent_path().string() : ".";
}

}  // namespace

Result<std::shared_ptr<const HeightSource>> ChunkStore::open(const std::string& path,
                                                             StoreInfo* info_out) {
    if (const auto folder = shard_folder(path)) {
        TERRANE_TRY(auto files, open_shard_folder(*folder));
        return open(std::move(files), info_out);
    }
    TERRANE_TRY(auto records, open_file(path, info_out));
    return std::make_shared<const StoredHeights>(
        std::make_unique<const ChunkReader>(std::move(records)));
}

Result<std::shared_ptr<const HeightSource>> ChunkStore::open(
    std::shared_ptr<const ShardFiles> files, StoreInfo* info_out) {
    TERRANE_TRY(auto records, open_shards(std::move(files), info_out));
    return std::make_shared<const StoredHeights>(
        std::make_unique<const ChunkReader>(std::move(records)));
}

bool ChunkStore::is_store(const std::string& path) {
    if (const auto folder = shard_folder(path)) {
        std::error_code ignored;
        return std::filesystem::is_regular_file(*folder + "/" + std::string(kManifestName),
                                                ignored);
    }
    return SealedReader::is_kind(path,
                                 std::string_view(kStoreKind.name.data(), kStoreKind.name.size()));
}

}  // namespace terrane
