// SPDX-License-Identifier: MIT
#include "chunk/chunk_vertices.h"
#include "source/mesh_bounds.h"

#include <terrane/base/result.h>
#include <terrane/terrain/chunk.h>
#include <terrane/terrain/chunk_source.h>
#include <terrane/terrain/height_source.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <limits>
#include <span>
#include <string>

namespace terrane::internal {

/// Checks bounds of vertices against the source's own samples: the vertical distance of a vertex from the middle of the
/// edge that it splits must not exceed its bound. Skips vertices whose ends are not among the samples.
///
/// @param grid    of the bounds, as for HeightSource::vertex_bounds()
/// @param bounds  [grid.size()] metres
/// @param samples of the heights; its step divides that of `grid`
/// @param heights [samples.size()] metres
///
/// Fails: bad_data, naming position, bound and distance, for the first vertex beyond its bound
Result<void> check_rises(const Lattice& lattice, const SampleGrid& grid,
                         std::span<const float> bounds, const SampleGrid& samples,
                         std::span<const double> heights);

#if TERRANE_ASSERTS
/// Spot checks of a source while a chunk is made, in builds with asserts: its samples must lie in the source's interval
/// over the chunk, and height() at some points of its cells must be within the cells' bounds. Violations are reported
/// to the assert handler as one line with position and values.
///
/// @param grid        of the heights
/// @param heights     [grid.size()] metres
/// @param cell_bounds [(columns - 1) * (rows - 1)] metres
void assert_source_holds(const HeightSource& source, const SampleGrid& grid,
                         std::span<const double> heights, std::span<const float> cell_bounds);
#endif

}  // namespace terrane::internal

namespace terrane {
namespace {

SampleRange united(const SampleRange& a, const SampleRange& b) {
    return {std::min(a.low, b.low), std::max(a.high, b.high)};
}

}  // namespace

void SamplePyramid::fill(std::span<const std::int32_t> heights) {
    TERRANE_ASSERT(heights.size() == std::size_t{kChunkSamples} * kChunkSamples,
                   "a pyramid stands on all samples of a chunk");
    constexpr std::size_t kSide = std::size_t{1} << kFinest;
    for (std::size_t south = 0; south < kChunkCells; south += kSide) {
        // rows first: columns are contiguous, so that the loop vectorises
        std::array<std::int32_t, kChunkSamples> low;
        std::copy_n(&heights[south * kChunkSamples], kChunkSamples, low.begin());
        std::array<std::int32_t, kChunkSamples> high = low;
        for (std::size_t row = south + 1; row <= south + kSide; ++row) {
            const std::int32_t* const samples = &heights[row * kChunkSamples];
            for (std::size_t column = 0; column < kChunkSamples; ++column) {
                low[column] = std::min(low[column], samples[column]);
                high[column] = std::max(high[column], samples[column]);
            }
        }
        for (std::size_t west = 0; west < kChunkCells; west += kSide) {
            SampleRange range{low[west], high[west]};
            for (std::size_t column = west + 1; column <= west + kSide; ++column) {
                range = united(range, {low[column], high[column]});
            }
            ranges_[index(kFinest, static_cast<int>(west), static_cast<int>(south))] = range;
        }
    }
    for (int size = kFinest + 1; size <= kCoarsest; ++size) {
        const int side = 1 << size, half = side / 2;
        for (int row = 0; row < kChunkCells; row += side) {
            for (int column = 0; column < kChunkCells; column += side) {
                ranges_[index(size, column, row)] =
                    united(united(at(size - 1, column, row), at(size - 1, column + half, row)),
                           united(at(size - 1, column, row + half),
                                  at(size - 1, column + half, row + half)));
            }
        }
    }
}

}  // namespace terrane

namespace terrane::internal {
Result<void> check_rises(const Lattice& lattice, const SampleGrid& grid,
                         std::span<const float> bounds, const SampleGrid& samples,
                         std::span<const double> heights) {
    const auto stride = static_cast<int>(grid.step / samples.step);
    const auto first_column = static_cast<int>((grid.corner.x - samples.corner.x) / samples.step);
    const auto first_row = static_cast<int>((grid.corner.y - samples.corner.y) / samples.step);
    // whether the index sum of the first square of side 2 s is odd
    const std::int64_t side = 2 * grid.step;
    const auto parity = static_cast<int>((grid.corner.x / side + grid.corner.y / side) & 1);
    const auto has = [&](int column, int row) {
        return column >= 0 && row >= 0 && column < samples.columns && row < samples.rows;
    };
    const auto at = [&](int column, int row) {
        return heights[static_cast<std::size_t>(row) * static_cast<std::size_t>(samples.columns) +
                       static_cast<std::size_t>(column)];
    };
    for (int row = 0; row < grid.rows; ++row) {
        for (int column = row % 2 == 0 ? 1 : 0; column < grid.columns;
             column += row % 2 == 0 ? 2 : 1) {
            // offset of one of the vertex's ends; the other end is opposite
            const bool is_centre = (column & row & 1) != 0;
            const bool rises = ((column / 2 + row / 2 + parity) & 1) == 0;
            const int to_x = column % 2 * stride;
            const int to_y = row % 2 * (is_centre && !rises ? -stride : stride);
            const int x = first_column + column * stride, y = first_row + row * stride;
            if (!has(x - to_x, y - to_y) || !has(x + to_x, y + to_y)) continue;
            const double height = at(x, y);
            const double rise =
                std::abs(height - 0.5 * (at(x - to_x, y - to_y) + at(x + to_x, y + to_y)));
            const auto bound = static_cast<double>(
                bounds[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) +
                       static_cast<std::size_t>(column)]);
            if (!(rise > bound + kHeightAccuracy + 0x1p-50 * std::abs(height))) continue;
            char text[192];
            std::snprintf(
                text, sizeof text,
                "the source's bound at (%.6g, %.6g) m, spacing %.6g m, is %.4g m, but its "
                "samples are %.4g m apart there",
                lattice.x(grid.corner.x + column * grid.step),
                lattice.y(grid.corner.y + row * grid.step),
                lattice.spacing * static_cast<double>(grid.step), bound, rise);
            return fail(ErrorCode::bad_data, text);
        }
    }
    return {};
}

#if TERRANE_ASSERTS
void assert_source_holds(const HeightSource& source, const SampleGrid& grid,
                         std::span<const double> heights, std::span<const float> cell_bounds) {
    constexpr int kSpots = 32;
    const Lattice& lattice = source.lattice();
    const auto refuse = [&](const char* what, double x, double y, double claimed, double measured) {
        char text[224];
        std::snprintf(text, sizeof text,
                      "the source's %s at (%.6g, %.6g) m, spacing %.6g m: claimed %.6g m, measured "
                      "%.6g m; check_source() tells more",
                      what, x, y, lattice.spacing * static_cast<double>(grid.step), claimed,
                      measured);
        assert_failed("HeightSource keeps its promises", text, __FILE__, __LINE__);
    };
    const double west = lattice.x(grid.corner.x), south = lattice.y(grid.corner.y);
    const double east = lattice.x(grid.corner.x + grid.step * (grid.columns - 1));
    const double north = lattice.y(grid.corner.y + grid.step * (grid.rows - 1));
    const HeightInterval held = source.interval({west, south, east, north});
    const auto [lowest, highest] = std::ranges::minmax_element(heights);
    const double slack = kHeightAccuracy + 0x1p-50 * (std::abs(*lowest) + std::abs(*highest));
    if (!(*lowest >= held.low - slack)) refuse("interval", west, south, held.low, *lowest);
    if (!(*highest <= held.high + slack)) refuse("interval", west, south, held.high, *highest);

    // integer hashing of the chunk's address chooses the points, so that they are always the same
    const WorldRect& extent = source.extent();
    std::uint64_t state = static_cast<std::uint64_t>(grid.corner.x) * 0x9e3779b97f4a7c15u ^
                          static_cast<std::uint64_t>(grid.corner.y) ^
                          static_cast<std::uint64_t>(grid.step) << 32;
    const auto draw = [&](int count) {
        state = state * 0x5851f42d4c957f2du + 0x14057b7ef767814fu;
        return static_cast<int>((state >> 33) % static_cast<std::uint64_t>(count));
    };
    for (int spot = 0; spot < kSpots; ++spot) {
        const int column = draw(grid.columns - 1), row = draw(grid.rows - 1);
        const LatticePoint corner{grid.corner.x + column * grid.step,
                                  grid.corner.y + row * grid.step};
        const LatticeTriangle triangle =
            cut_square(corner, grid.step)[static_cast<std::size_t>(draw(2))];
        double a = draw(1024) / 1024.0, b = draw(1024) / 1024.0;
        if (a + b > 1.0) {
            a = 1.0 - a;
            b = 1.0 - b;
        }
        const double weights[] = {1.0 - a - b, a, b};
        double x = 0.0, y = 0.0, plane = 0.0, low = *highest, high = *lowest;
        for (std::size_t i = 0; i < 3; ++i) {
            const auto at_column = (triangle[i].x - grid.corner.x) / grid.step;
            const auto at_row = (triangle[i].y - grid.corner.y) / grid.step;
            const double height =
                heights[static_cast<std::size_t>(at_row * grid.columns + at_column)];
            x += weights[i] * lattice.x(triangle[i].x);
            y += weights[i] * lattice.y(triangle[i].y);
            plane += weights[i] * height;
            low = std::min(low, height);
            high = std::max(high, height);
        }
        if (!extent.contains(x, y)) continue;
        const double off = std::abs(source.height(x, y) - plane);
        const auto bound = static_cast<double>(
            cell_bounds[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns - 1) +
                        static_cast<std::size_t>(column)]);
        // allowance for the rounding of the position, times the ground's slope
        const double slope =
            (high - low + off) / (lattice.spacing * static_cast<double>(grid.step));
        const double rounding =
            kHeightAccuracy + 0x1p-50 * (std::abs(plane) + slope * (std::abs(x) + std::abs(y)));
        // NaN means that the source could not be read, which violates nothing
        if (off > bound + rounding) refuse("cell bound", x, y, bound, off);
    }
}
#endif

}  // namespace terrane::internal

namespace terrane {
namespace {

using internal::AreaVertices;
using internal::ChunkVertices;
using internal::kChunkSquares;
using internal::kReachCells;

constexpr std::size_t kSamples = std::size_t{kChunkSamples} * kChunkSamples;
constexpr std::size_t kCells = std::size_t{kChunkCells} * kChunkCells;
// Size of a chunk without the memory of its vectors. The 48 bytes that link and pad the two structures are excluded:
// simulated loads transfer max_bytes(), which must not depend on the layout.
constexpr std::size_t kOwnBytes = sizeof(Chunk) + sizeof(ChunkVertices) - 48;

// The sum bound + half_quantum, rounded up.
float add_up(float bound, double half_quantum) {
    const double sum = static_cast<double>(bound) + half_quantum;
    const auto rounded = static_cast<float>(sum);
    return static_cast<double>(rounded) < sum
               ? std::nextafter(rounded, std::numeric_limits<float>::infinity())
               : rounded;
}

// 1 / bound^2 rounded down, with a margin for the rounding of products in which it is used.
float inverse_square(float bound) {
    const double wide = static_cast<double>(bound);
    return static_cast<float>((1.0 - 0x1p-21) / (wide * wide));
}

// Samples and cell bounds of a chunk and a margin around it, in cells.
struct Surroundings {
    int margin = 0;
    SampleGrid grid;
    std::vector<double> heights;
    std::vector<float> bounds;
};

std::size_t cell_count(const SampleGrid& grid) {
    return static_cast<std::size_t>(grid.columns - 1) * static_cast<std::size_t>(grid.rows - 1);
}

// Called before each call of the source, which may take long.
Result<void> check_not_cancelled(const std::stop_token& stop) {
    if (stop.stop_requested()) return fail(ErrorCode::cancelled, "the chunk was given up");
    return {};
}

Result<void> height_error(const HeightSource& source, double metres, const SampleGrid& grid,
                          int column, int row) {
    const Lattice& lattice = source.lattice();
    std::array<char, 200> text{};
    std::snprintf(
        text.data(), text.size(),
        "the source gave a height of %.6g m at x %.6g m, y %.6g m; possible are %.3g m up or "
        "down for a quantum of %.3g m",
        metres, lattice.x(grid.corner.x + column * grid.step),
        lattice.y(grid.corner.y + row * grid.step),
        std::min(kMostHeight, kMostQuanta * lattice.quantum), lattice.quantum);
    return fail(ErrorCode::bad_data, text.data());
}

// Larger bounds are refused: their squares would overflow a float, and keys would be NaN.
constexpr double kMostBound = 4.0 * kMostHeight;

bool is_bound(float bound) { return static_cast<double>(bound) <= kMostBound && bound >= 0.0f; }

Result<void> refuse_bound(float bound) {
    std::array<char, 100> text{};
    std::snprintf(text.data(), text.size(),
                  "the source gave a bound of %.6g m, possible are 0 to %.3g m",
                  static_cast<double>(bound), kMostBound);
    return fail(ErrorCode::bad_data, text.data());
}

Result<void> fill_heights(const HeightSource& source, const std::stop_token& stop,
                          Surroundings& wide, Chunk& chunk) {
    TERRANE_TRY(check_not_cancelled(stop));
    wide.heights.resize(wide.grid.size());
    TERRANE_TRY(source.sample(wide.grid, wide.heights));
    const double per_quantum = 1.0 / source.lattice().quantum;
    const double most = std::min(kMostHeight, kMostQuanta * source.lattice().quantum);
    chunk.heights.resize(kSamples);
    for (int row = 0; row < wide.grid.rows; ++row) {
        for (int column = 0; column < wide.grid.columns; ++column) {
            const double metres =
                wide.heights[static_cast<std::size_t>(row * wide.grid.columns + column)];
            const double quanta = std::floor(metres * per_quantum + 0.5);
            // the comparison is false for NaN too
            if (!(std::abs(metres) <= most))
                return height_error(source, metres, wide.grid, column, row);
            const int x = column - wide.margin, y = row - wide.margin;
            if (x < 0 || y < 0 || x >= kChunkSamples || y >= kChunkSamples) continue;
            chunk.heights[sample_index(x, y)] = static_cast<std::int32_t>(quanta);
        }
    }
    return {};
}

// The stored bound of a vertex of the chunk's own spacing; works for const and non-const vertices.
template <typename AnyVertices>
auto& own_bound(AnyVertices& vertices, int column, int row) {
    const auto of_square = [](int sample) { return static_cast<std::size_t>(sample / 2); };
    if (column == kChunkCells) return vertices.east_side.inverse_square_bounds[of_square(row)];
    if (row == kChunkCells) return vertices.north_side.inverse_square_bounds[of_square(column)];
    const auto [area, kind, square] = AreaVertices::address_of(column, row);
    return vertices.areas[area].inverse_square_bounds[kind][square];
}

// Index of a sample with even column and row.
std::size_t coarse_index(int column, int row) {
    return static_cast<std::size_t>(row / 2) * (kChunkSquares + 1) +
           static_cast<std::size_t>(column / 2);
}

void store_bound(ChunkVertices& vertices, int column, int row, float bound) {
    if (((column | row) & 1) == 0) {
        vertices.coarse_bounds[coarse_index(column, row)] = inverse_square(bound);
    } else {
        own_bound(vertices, column, row) = internal::upper_half(inverse_square(bound));
    }
}

// Raises the bound of all areas that a vertex belongs to. A vertex between areas belongs to all of them.
void raise_areas(Chunk& chunk, int column, int row, float bound) {
    const int last = kChunkAreas - 1;
    for (int y = std::max(0, (row - 1) / kAreaCells); y <= std::min(last, row / kAreaCells); ++y) {
        for (int x = std::max(0, (column - 1) / kAreaCells);
             x <= std::min(last, column / kAreaCells); ++x) {
            Chunk::Area& area = chunk.areas[static_cast<std::size_t>(y * kChunkAreas + x)];
            area.max_vertex_bound = std::max(area.max_vertex_bound, bound);
        }
    }
}

// Stores the bounds of the vertices of one spacing, except vertices in the margin.
Result<void> store_vertex_bounds(const SampleGrid& grid, std::span<const float> bounds,
                                 double half_quantum, ChunkVertices& vertices, Chunk& chunk) {
    const auto stride = static_cast<int>(grid.step / chunk.step);
    const auto margin = static_cast<int>((chunk.corner.x - grid.corner.x) / grid.step);
    for (int row = 0; row < grid.rows - 2 * margin; ++row) {
        for (int column = 0; column < grid.columns - 2 * margin; ++column) {
            if (((row | column) & 1) == 0) continue;  // vertex of a coarser spacing
            const float given =
                bounds[static_cast<std::size_t>((row + margin) * grid.columns + column + margin)];
            if (!is_bound(given)) return refuse_bound(given);
            const float bound = add_up(given, half_quantum);
            store_bound(vertices, column * stride, row * stride, bound);
            raise_areas(chunk, column * stride, row * stride, bound);
            chunk.max_vertex_bound = std::max(chunk.max_vertex_bound, bound);
        }
    }
    return {};
}

// Reads and stores the bounds of the vertices of the chunk's own spacing, and for a root also those of coarser
// spacings. Also reads the bounds of cells.
Result<void> fill_vertex_bounds(const HeightSource& source, const std::stop_token& stop,
                                Surroundings& wide, ChunkVertices& vertices, Chunk& chunk) {
    TERRANE_TRY(check_not_cancelled(stop));
    const double half_quantum = 0.5 * source.lattice().quantum;
    std::vector<float> bounds(wide.grid.size());
    wide.bounds.resize(cell_count(wide.grid));
    TERRANE_TRY(source.mesh_bounds(wide.grid, bounds, wide.bounds));
    const auto check = [&](const SampleGrid& grid, std::span<const float> of_grid) {
        return internal::check_rises(source.lattice(), grid, of_grid, wide.grid, wide.heights);
    };
    TERRANE_TRY(check(wide.grid, bounds));
#if TERRANE_ASSERTS
    if (source.is_certified())
        internal::assert_source_holds(source, wide.grid, wide.heights, wide.bounds);
#endif
    if (const Result<void> kept =
            store_vertex_bounds(wide.grid, bounds, half_quantum, vertices, chunk);
        !kept || chunk.key.level > 0) {
        return kept;
    }
    vertices.coarse_bounds.assign(std::size_t{kChunkSquares + 1} * (kChunkSquares + 1),
                                  std::numeric_limits<float>::infinity());
    for (int stride = 2; stride <= kChunkSquares; stride *= 2) {
        TERRANE_TRY(check_not_cancelled(stop));
        SampleGrid sparse{chunk.corner, chunk.step * stride, kChunkCells / stride + 1,
                          kChunkCells / stride + 1};
        const std::span<float> out(bounds.data(), sparse.size());
        TERRANE_TRY(source.vertex_bounds(sparse, out));
        TERRANE_TRY(check(sparse, out));
        if (const Result<void> kept =
                store_vertex_bounds(sparse, out, half_quantum, vertices, chunk);
            !kept) {
            return kept;
        }
    }
    return {};
}

Result<void> fill_cells(const HeightSource& source, const std::stop_token& stop, Surroundings& wide,
                        Chunk& chunk) {
    TERRANE_TRY(check_not_cancelled(stop));
    const double half_quantum = 0.5 * source.lattice().quantum;
    chunk.cell_bounds.resize(kCells);
    const int columns = wide.grid.columns - 1, rows = wide.grid.rows - 1;
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            float& bound = wide.bounds[static_cast<std::size_t>(row * columns + column)];
            if (!is_bound(bound)) return refuse_bound(bound);
            bound = add_up(bound, half_quantum);
            const int x = column - wide.margin, y = row - wide.margin;
            if (x < 0 || y < 0 || x >= kChunkCells || y >= kChunkCells) continue;
            chunk.cell_bounds[cell_index(x, y)] = bound;
        }
    }
    const SampleGrid grid{chunk.corner, chunk.step, kChunkSamples, kChunkSamples};
    chunk.cell_flags.resize(kCells);
    TERRANE_TRY(source.cell_flags(grid, chunk.cell_flags));
    const auto is_ground = [](std::uint8_t flags) { return flags == cell_ground; };
    if (std::all_of(chunk.cell_flags.begin(), chunk.cell_flags.end(), is_ground)) {
        chunk.cell_flags = {};
    }
    return {};
}

void fill_intervals(Chunk& chunk) {
    chunk.pyramid.fill(chunk.heights);
    const SampleRange& all = chunk.pyramid.at(SamplePyramid::kCoarsest, 0, 0);
    chunk.low = all.low;
    chunk.high = all.high;
}

void fill_areas(Chunk& chunk) {
    constexpr int kAreaLog2 = 4;
    static_assert(1 << kAreaLog2 == kAreaCells);
    for (int area = 0; area < kChunkAreas * kChunkAreas; ++area) {
        Chunk::Area& into = chunk.areas[static_cast<std::size_t>(area)];
        const int south = area / kChunkAreas * kAreaCells;
        const int west = area % kChunkAreas * kAreaCells;
        const SampleRange& samples = chunk.pyramid.at(kAreaLog2, west, south);
        into.low = samples.low;
        into.high = samples.high;
        for (int row = south; row < south + kAreaCells; ++row) {
            for (int column = west; column < west + kAreaCells; ++column) {
                into.max_cell_bound =
                    std::max(into.max_cell_bound, chunk.cell_bounds[cell_index(column, row)]);
            }
        }
        const bool is_east = west >= kChunkCells / 2, is_north = south >= kChunkCells / 2;
        float& quadrant =
            chunk.quadrant_bound[static_cast<std::size_t>((is_east ? 1 : 0) + (is_north ? 2 : 0))];
        quadrant = std::max(quadrant, into.max_cell_bound);
    }
}

}  // namespace

float internal::bound_of(float inverse_square_bound) {
    const double bound = 1.0 / std::sqrt(static_cast<double>(inverse_square_bound));
    return std::nextafter(static_cast<float>(bound), std::numeric_limits<float>::infinity());
}

float ChunkVertices::inverse_square_bound(int column, int row) const {
    if (((column | row) & 1) != 0) return internal::from_upper_half(own_bound(*this, column, row));
    return coarse_bounds.empty() ? std::numeric_limits<float>::infinity()
                                 : coarse_bounds[coarse_index(column, row)];
}

SampleRange Chunk::samples_in_small(int log2_side, int column, int row) const {
    const int side = 1 << log2_side;
    const int west = column & -side, south = row & -side;
    SampleRange range{std::numeric_limits<std::int32_t>::max(),
                      std::numeric_limits<std::int32_t>::min()};
    for (int j = south; j <= south + side; ++j) {
        for (int i = west; i <= west + side; ++i) {
            const std::int32_t height = heights[sample_index(i, j)];
            range.low = std::min(range.low, height);
            range.high = std::max(range.high, height);
        }
    }
    return range;
}

std::size_t Chunk::max_bytes() {
    return kOwnBytes + kSamples * sizeof(std::int32_t) +
           std::size_t{kChunkSquares + 1} * (kChunkSquares + 1) * sizeof(float) +
           kCells * (sizeof(float) + sizeof(std::uint8_t));
}

std::size_t Chunk::bytes() const {
    const std::size_t own = vertices
                                ? kOwnBytes + vertices->coarse_bounds.capacity() * sizeof(float)
                                : kOwnBytes - sizeof(ChunkVertices::areas);
    return own + heights.capacity() * sizeof(std::int32_t) +
           cell_bounds.capacity() * sizeof(float) + cell_flags.capacity() +
           (solid != nullptr ? solid->bytes() : 0);
}

namespace {

// Does nothing for chunks other than roots, which have no coarse bounds.
void fill_largest_coarse_bounds(ChunkVertices& vertices) {
    if (vertices.coarse_bounds.empty()) return;
    std::array<float, ChunkVertices::kCoarseStrides> least;
    least.fill(std::numeric_limits<float>::infinity());
    for (int row = 0; row <= kChunkSquares; ++row) {
        for (int column = 0; column <= kChunkSquares; ++column) {
            const auto both = static_cast<unsigned>(column | row);
            if (both % kChunkSquares == 0) continue;  // corners of the root square
            float& of_stride = least[static_cast<std::size_t>(std::countr_zero(both))];
            of_stride =
                std::min(of_stride, vertices.coarse_bounds[coarse_index(2 * column, 2 * row)]);
        }
    }
    std::transform(least.begin(), least.end(), vertices.largest_coarse_bounds.begin(),
                   internal::bound_of);
}

}  // namespace

void internal::complete_chunk(double quantum, std::shared_ptr<ChunkVertices> vertices,
                              Chunk& chunk) {
    fill_largest_coarse_bounds(*vertices);
    derive_reaches(quantum, *vertices, chunk);
    fill_intervals(chunk);
    fill_areas(chunk);
    chunk.vertices = std::move(vertices);
}

namespace {

// A chunk without content, and the grid of its surroundings.
std::shared_ptr<Chunk> begin_chunk(const HeightSource& source, const ChunkKey& key, int margin,
                                   Surroundings& wide) {
    const Lattice& lattice = source.lattice();
    auto chunk = std::make_shared<Chunk>();
    chunk->key = key;
    chunk->corner = lattice.corner(key);
    chunk->step = lattice.step(key.level);
    chunk->is_certified = source.is_certified();
    const int side = kChunkSamples + 2 * margin;
    wide.margin = margin;
    wide.grid = {{chunk->corner.x - margin * chunk->step, chunk->corner.y - margin * chunk->step},
                 chunk->step,
                 side,
                 side};
    return chunk;
}

// Finishes a chunk that has heights and the bounds of vertices, from the cells of its surroundings.
Result<std::shared_ptr<const Chunk>> finish_chunk(const HeightSource& source,
                                                  const std::stop_token& stop, Surroundings& wide,
                                                  std::shared_ptr<ChunkVertices> vertices,
                                                  std::shared_ptr<Chunk> chunk) {
    TERRANE_TRY(fill_cells(source, stop, wide, *chunk));
    TERRANE_TRY(check_not_cancelled(stop));
    internal::fill_reaches(wide.heights, wide.bounds, source, *chunk, *vertices);
    internal::complete_chunk(source.lattice().quantum, std::move(vertices), *chunk);
    return std::shared_ptr<const Chunk>(std::move(chunk));
}

}  // namespace

Result<std::shared_ptr<const Chunk>> internal::make_bounded_chunk(
    const HeightSource& source, const ChunkKey& key, std::shared_ptr<ChunkVertices> vertices,
    const MostBounds& most, const std::stop_token& stop) {
    TERRANE_ASSERT(
        source.lattice().contains(key) && vertices->coarse_bounds.empty() == (key.level > 0),
        "the key must name a chunk, and roots have bounds of coarser vertices");
    Surroundings wide;
    const std::shared_ptr<Chunk> chunk = begin_chunk(source, key, kReachCells, wide);
    TERRANE_TRY(fill_heights(source, stop, wide, *chunk));
    chunk->max_vertex_bound = most.of_chunk;
    for (std::size_t i = 0; i < most.of_areas.size(); ++i) {
        chunk->areas[i].max_vertex_bound = most.of_areas[i];
    }
    TERRANE_TRY(check_not_cancelled(stop));
    wide.bounds.resize(cell_count(wide.grid));
    TERRANE_TRY(source.cell_bounds(wide.grid, wide.bounds));
    return finish_chunk(source, stop, wide, std::move(vertices), chunk);
}

Result<std::shared_ptr<const Chunk>> internal::make_chunk_without_reaches(
    const HeightSource& source, const ChunkKey& key, bool with_vertex_bounds) {
    Surroundings own;
    const std::shared_ptr<Chunk> chunk = begin_chunk(source, key, 0, own);
    TERRANE_TRY(fill_heights(source, {}, own, *chunk));
    if (with_vertex_bounds) {
        auto vertices = std::make_shared<ChunkVertices>();
        TERRANE_TRY(fill_vertex_bounds(source, {}, own, *vertices, *chunk));
        chunk->vertices = std::move(vertices);
    } else {
        own.bounds.resize(cell_count(own.grid));
        TERRANE_TRY(source.cell_bounds(own.grid, own.bounds));
    }
    TERRANE_TRY(fill_cells(source, {}, own, *chunk));
    const auto [lowest, highest] = std::ranges::minmax_element(chunk->heights);
    chunk->low = *lowest;
    chunk->high = *highest;
    return std::shared_ptr<const Chunk>(chunk);
}

Result<std::shared_ptr<const Chunk>> make_chunk(const HeightSource& source, const ChunkKey& key,
                                                const std::stop_token& stop) {
    TERRANE_ASSERT(source.lattice().contains(key),
                   "the key must name a chunk of the source's world");
    if (auto stored = chunks_of(source).stored_chunk(key, stop); !stored || *stored != nullptr)
        return stored;
    Surroundings wide;
    const std::shared_ptr<Chunk> chunk = begin_chunk(source, key, kReachCells, wide);
    auto vertices = std::make_shared<ChunkVertices>();
    TERRANE_TRY(fill_heights(source, stop, wide, *chunk));
    TERRANE_TRY(fill_vertex_bounds(source, stop, wide, *vertices, *chunk));
    return finish_chunk(source, stop, wide, std::move(vertices), chunk);
}

}  // namespace terrane
