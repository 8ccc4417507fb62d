// SPDX-License-Identifier: MIT
//
// Sources: NIST, Secure Hash Standard, FIPS 180-4, 2015: sections 4.1.2, 4.2.2, 5.1.1, 5.3.3, 6.2.
// Deviations: none. The constants are computed with integers from their definition: the first 32 bits of the fractional
//             parts of square and cube roots of primes.
#include "store_format.h"

#include "bilinear/fine_surface.h"

#include <terrane/store/bytes.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace terrane::internal {
namespace {

/// The first 32 bits of the fraction of a prime's square root (power 2) or cube root (power 3): the low 32 bits of the
/// largest integer r with r^power <= prime * 2^(32 * power).
constexpr std::uint32_t root_fraction(std::uint64_t prime, int power) {
    __extension__ using Wide = unsigned __int128;
    // At most 6.8 * 2^32 for the cube root of 311 (64th prime), and 4.4 * 2^32 for the square root of 19 (eighth).
    std::uint64_t root = 0;
    for (int bit = 34; bit >= 0; --bit) {
        const std::uint64_t tried = root | std::uint64_t{1} << bit;
        // Compares tried^power with prime << (32 * power), avoiding overflow.
        const Wide square = Wide{tried} * tried;
        const bool fits =
            power == 2 ? square <= Wide{prime} << 64 : square <= (Wide{prime} << 96) / tried;
        if (fits) root = tried;
    }
    return static_cast<std::uint32_t>(root);
}

template <std::size_t count>
constexpr std::array<std::uint32_t, count> root_fractions(int power) {
    std::array<std::uint32_t, count> fractions{};
    std::size_t found = 0;
    for (std::uint64_t n = 2; found < count; ++n) {
        bool is_prime = true;
        for (std::uint64_t d = 2; d * d <= n; ++d) is_prime = is_prime && n % d != 0;
        if (is_prime) fractions[found++] = root_fraction(n, power);
    }
    return fractions;
}

constexpr std::array<std::uint32_t, 64> kRound = root_fractions<64>(3);
constexpr std::array<std::uint32_t, 8> kStart = root_fractions<8>(2);
static_assert(kRound[0] == 0x428a2f98u && kRound[63] == 0xc67178f2u && kStart[0] == 0x6a09e667u);

void add_block(const std::uint8_t* block, std::array<std::uint32_t, 8>& state) {
    std::array<std::uint32_t, 64> w{};
    for (std::size_t t = 0; t < 16; ++t) {
        for (std::size_t k = 0; k < 4; ++k) w[t] = w[t] << 8 | block[4 * t + k];
    }
    for (std::size_t t = 16; t < 64; ++t) {
        const std::uint32_t a = w[t - 15], b = w[t - 2];
        w[t] = (std::rotr(b, 17) ^ std::rotr(b, 19) ^ (b >> 10)) + w[t - 7] +
               (std::rotr(a, 7) ^ std::rotr(a, 18) ^ (a >> 3)) + w[t - 16];
    }
    auto [a, b, c, d, e, f, g, h] = state;
    for (std::size_t t = 0; t < 64; ++t) {
        const std::uint32_t one = h + (std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25)) +
                                  ((e & f) ^ (~e & g)) + kRound[t] + w[t];
        const std::uint32_t two =
            (std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
        h = g;
        g = f;
        f = e;
        e = d + one;
        d = c;
        c = b;
        b = a;
        a = one + two;
    }
    const std::array<std::uint32_t, 8> sum{a, b, c, d, e, f, g, h};
    for (std::size_t i = 0; i < 8; ++i) state[i] += sum[i];
}

}  // namespace

std::string sha256(std::span<const std::uint8_t> bytes) {
    std::array<std::uint32_t, 8> state = kStart;
    std::size_t at = 0;
    for (; bytes.size() - at >= 64; at += 64) add_block(bytes.data() + at, state);
    std::vector<std::uint8_t> last(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.end());
    last.push_back(0x80);
    while (last.size() % 64 != 56) last.push_back(0);
    const std::uint64_t bits = std::uint64_t{8} * bytes.size();
    for (int shift = 56; shift >= 0; shift -= 8) {
        last.push_back(static_cast<std::uint8_t>(bits >> shift));
    }
    for (std::size_t i = 0; i < last.size(); i += 64) add_block(last.data() + i, state);
    std::string text;
    for (const std::uint32_t word : state) {
        char digits[9];
        std::snprintf(digits, sizeof(digits), "%08x", word);
        text += digits;
    }
    return text;
}

// Lossless coding of chunks: the bits of numbers are taken as unsigned integers, whose differences wrap around.

namespace {

constexpr std::size_t kSamples = std::size_t{kChunkSamples} * kChunkSamples;
constexpr std::size_t kCells = std::size_t{kChunkCells} * kChunkCells;
constexpr std::size_t kCoarse = std::size_t{kChunkSquares + 1} * (kChunkSquares + 1);
constexpr std::size_t kAreas = std::size_t{kChunkAreas} * kChunkAreas;
constexpr std::size_t kVertices = kAreas * AreaVertices::kSquares;

enum Part : std::uint8_t { has_coarse_bounds = 1, has_cell_flags = 2 };

/// Maps small numbers of either sign to small unsigned ones.
constexpr std::uint32_t zigzag(std::uint32_t v) { return (v << 1) ^ (0u - (v >> 31)); }
constexpr std::uint32_t unzigzag(std::uint32_t v) { return (v >> 1) ^ (0u - (v & 1)); }
constexpr std::uint16_t zigzag(std::uint16_t v) {
    return static_cast<std::uint16_t>((v << 1) ^ (0 - (v >> 15)));
}
constexpr std::uint16_t unzigzag(std::uint16_t v) {
    return static_cast<std::uint16_t>((v >> 1) ^ (0 - (v & 1)));
}

/// Writes the least significant bytes of all values, then the next bytes of all values, and so on.
template <class T>
void put_planes(ByteWriter& out, std::span<const T> values) {
    std::vector<std::uint8_t> plane(values.size());
    for (unsigned shift = 0; shift < 8 * sizeof(T); shift += 8) {
        for (std::size_t i = 0; i < values.size(); ++i) {
            plane[i] = static_cast<std::uint8_t>(values[i] >> shift);
        }
        out.put_each(std::span<const std::uint8_t>(plane));
    }
}

template <class T>
void get_planes(ByteReader& in, std::span<T> values_out) {
    std::vector<std::uint8_t> plane(values_out.size());
    for (T& value : values_out) value = 0;
    for (unsigned shift = 0; shift < 8 * sizeof(T); shift += 8) {
        in.get_each(std::span<std::uint8_t>(plane));
        for (std::size_t i = 0; i < values_out.size(); ++i) {
            values_out[i] = static_cast<T>(values_out[i] | T{plane[i]} << shift);
        }
    }
}

/// Predicts a value by the plane through its western, southern and south-western neighbours.
template <class At>
std::uint32_t predicted(int column, int row, At&& at) {
    if (row == 0) return column == 0 ? 0u : at(column - 1, row);
    if (column == 0) return at(column, row - 1);
    return at(column - 1, row) + at(column, row - 1) - at(column - 1, row - 1);
}

void put_grid(ByteWriter& out, std::span<const std::uint32_t> bits, int columns) {
    const auto at = [&](int column, int row) {
        return bits[static_cast<std::size_t>(row * columns + column)];
    };
    const int rows = static_cast<int>(bits.size()) / columns;
    std::vector<std::uint32_t> rest(bits.size());
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            rest[static_cast<std::size_t>(row * columns + column)] =
                zigzag(at(column, row) - predicted(column, row, at));
        }
    }
    put_planes(out, std::span<const std::uint32_t>(rest));
}

std::vector<std::uint32_t> get_grid(ByteReader& in, int columns, int rows) {
    std::vector<std::uint32_t> bits(static_cast<std::size_t>(columns) *
                                    static_cast<std::size_t>(rows));
    get_planes(in, std::span<std::uint32_t>(bits));
    const auto at = [&](int column, int row) {
        return bits[static_cast<std::size_t>(row * columns + column)];
    };
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            std::uint32_t& value = bits[static_cast<std::size_t>(row * columns + column)];
            value = unzigzag(value) + predicted(column, row, at);
        }
    }
    return bits;
}

/// Writes differences of consecutive values.
void put_row(ByteWriter& out, std::span<const std::uint16_t> bits) {
    std::vector<std::uint16_t> rest;
    rest.reserve(bits.size());
    std::uint16_t before = 0;
    for (const std::uint16_t value : bits) {
        rest.push_back(zigzag(static_cast<std::uint16_t>(value - before)));
        before = value;
    }
    put_planes(out, std::span<const std::uint16_t>(rest));
}

void get_row(ByteReader& in, std::span<std::uint16_t> bits_out) {
    get_planes(in, bits_out);
    std::uint16_t before = 0;
    for (std::uint16_t& value : bits_out) {
        value = static_cast<std::uint16_t>(unzigzag(value) + before);
        before = value;
    }
}

template <class To, class From>
std::vector<To> bits_of(std::span<const From> values) {
    std::vector<To> bits;
    bits.reserve(values.size());
    for (const From value : values) bits.push_back(std::bit_cast<To>(value));
    return bits;
}

/// Visits every 16-bit number of a chunk's vertices in a fixed order, grouped by kind and meaning; without reaches,
/// only the bounds.
template <class AnyVertices, class Visit>
void for_each_vertex_number(AnyVertices& vertices, bool with_reaches, Visit&& visit) {
    const auto each = [&visit](auto& numbers) {
        for (auto& number : numbers) visit(number);
    };
    for (std::size_t kind = 0; kind < AreaVertices::kKinds; ++kind) {
        for (auto& area : vertices.areas) each(area.inverse_square_bounds[kind]);
        if (!with_reaches) continue;
        for (auto& area : vertices.areas) each(area.low[kind]);
        for (auto& area : vertices.areas) each(area.high[kind]);
    }
    for (auto* side : {&vertices.east_side, &vertices.north_side}) {
        each(side->inverse_square_bounds);
        if (!with_reaches) continue;
        each(side->low);
        each(side->high);
    }
}

constexpr std::size_t kVertexBounds = AreaVertices::kKinds * kVertices + 2 * kChunkSquares;
constexpr std::size_t kVertexNumbers = 3 * kVertexBounds;

void put_vertices(ByteWriter& out, const ChunkVertices& vertices, bool with_reaches) {
    std::vector<std::uint16_t> numbers;
    numbers.reserve(kVertexNumbers);
    for_each_vertex_number(vertices, with_reaches, [&](const auto& number) {
        numbers.push_back(std::bit_cast<std::uint16_t>(number));
    });
    put_row(out, numbers);
}

void get_vertices(ByteReader& in, bool with_reaches, ChunkVertices& vertices_out) {
    std::vector<std::uint16_t> numbers(with_reaches ? kVertexNumbers : kVertexBounds);
    get_row(in, numbers);
    auto next = numbers.begin();
    for_each_vertex_number(vertices_out, with_reaches, [&next](auto& number) {
        number = std::bit_cast<std::remove_reference_t<decltype(number)>>(*next++);
    });
}

void get_coarse_bounds(ByteReader& in, ChunkVertices& vertices_out) {
    std::vector<std::uint32_t> coarse(kCoarse);
    get_planes(in, std::span<std::uint32_t>(coarse));
    vertices_out.coarse_bounds.reserve(kCoarse);
    for (const std::uint32_t bits : coarse) {
        vertices_out.coarse_bounds.push_back(std::bit_cast<float>(bits));
    }
}

void put_most_bounds(ByteWriter& out, const Chunk& chunk) {
    out.put(chunk.max_vertex_bound);
    for (const Chunk::Area& area : chunk.areas) out.put(area.max_vertex_bound);
}

Error missing_parts(std::size_t bytes) {
    return {ErrorCode::bad_data,
            "a chunk of " + std::to_string(bytes) + " bytes has not all of its parts"};
}

}  // namespace

std::size_t max_encoded_bytes() {
    return 1 + 4 * kSamples + 2 * kVertexNumbers + 4 * kCells + 8 + 4 + 4 + 4 * kAreas +
           4 * kCoarse + kCells;
}

std::vector<std::uint8_t> encode_chunk(const Chunk& chunk, ChunkContent content) {
    const bool is_all = content == ChunkContent::all;
    const bool has_vertices = content != ChunkContent::flags;
    const bool has_coarse = has_vertices && !chunk.vertices->coarse_bounds.empty();
    ByteWriter out;
    out.put(static_cast<std::uint8_t>((has_coarse ? has_coarse_bounds : 0) |
                                      (chunk.cell_flags.empty() ? 0 : has_cell_flags)));
    if (is_all) put_grid(out, bits_of<std::uint32_t, std::int32_t>(chunk.heights), kChunkSamples);
    if (has_vertices) put_vertices(out, *chunk.vertices, is_all);
    if (is_all) {
        put_grid(out, bits_of<std::uint32_t, float>(chunk.cell_bounds), kChunkCells);
        out.put(chunk.vertices->reach_base);
        out.put(chunk.vertices->reach_unit);
    }
    if (has_vertices) put_most_bounds(out, chunk);
    if (has_coarse) {
        put_planes(out, std::span<const std::uint32_t>(
                            bits_of<std::uint32_t, float>(chunk.vertices->coarse_bounds)));
    }
    out.put_each(std::span<const std::uint8_t>(chunk.cell_flags));
    return out.bytes();
}

Result<std::shared_ptr<const Chunk>> decode_chunk(std::span<const std::uint8_t> bytes,
                                                  const Lattice& lattice, const ChunkKey& key) {
    ByteReader in(bytes);
    auto chunk = std::make_shared<Chunk>();
    auto vertices = std::make_shared<ChunkVertices>();
    chunk->key = key;
    chunk->corner = lattice.corner(key);
    chunk->step = lattice.step(key.level);
    const auto parts = in.get<std::uint8_t>();
    // Reserves the exact size, so that the chunk is no larger than its load's claim.
    chunk->heights.reserve(std::size_t{kChunkSamples} * kChunkSamples);
    for (const std::uint32_t bits : get_grid(in, kChunkSamples, kChunkSamples)) {
        chunk->heights.push_back(std::bit_cast<std::int32_t>(bits));
    }
    get_vertices(in, true, *vertices);
    chunk->cell_bounds.reserve(kCells);
    for (const std::uint32_t bits : get_grid(in, kChunkCells, kChunkCells)) {
        chunk->cell_bounds.push_back(std::bit_cast<float>(bits));
    }
    vertices->reach_base = in.get<double>();
    vertices->reach_unit = in.get<float>();
    chunk->max_vertex_bound = in.get<float>();
    for (Chunk::Area& area : chunk->areas) area.max_vertex_bound = in.get<float>();
    if ((parts & has_coarse_bounds) != 0) get_coarse_bounds(in, *vertices);
    if ((parts & has_cell_flags) != 0) {
        chunk->cell_flags.resize(kCells);
        in.get_each(std::span<std::uint8_t>(chunk->cell_flags));
    }
    if (!in.is_done() || ((parts & has_coarse_bounds) != 0) != (key.level == 0)) {
        return tl::unexpected(missing_parts(bytes.size()));
    }
    complete_chunk(lattice.quantum, std::move(vertices), *chunk);
    return std::shared_ptr<const Chunk>(std::move(chunk));
}

Result<PartialChunk> decode_partial(std::span<const std::uint8_t> bytes, ChunkContent content,
                                    bool is_root) {
    ByteReader in(bytes);
    PartialChunk partial;
    const auto parts = in.get<std::uint8_t>();
    if (content == ChunkContent::vertex_bounds) {
        partial.vertices = std::make_shared<ChunkVertices>();
        get_vertices(in, false, *partial.vertices);
        partial.most.of_chunk = in.get<float>();
        in.get_each(std::span<float>(partial.most.of_areas));
        if ((parts & has_coarse_bounds) != 0) get_coarse_bounds(in, *partial.vertices);
    }
    if ((parts & has_cell_flags) != 0) {
        partial.cell_flags.resize(kCells);
        in.get_each(std::span<std::uint8_t>(partial.cell_flags));
    }
    if (!in.is_done() || ((parts & has_coarse_bounds) != 0) != is_root) {
        return tl::unexpected(missing_parts(bytes.size()));
    }
    return partial;
}

// Samples that are floats are often decimals, such as heights in centimetres, or multiples of a power of two. The
// differences of the integers are then smaller than those of the floats' bits.

namespace {

/// Floats are stored as integers divided by one of these numbers; 0: as their bits.
constexpr std::array<double, 8> kDivisors{0, 1, 10, 100, 1000, 16, 256, 4096};

/// The nearest float to a quotient of doubles: the same on every machine.
float divided(std::int32_t number, double divisor) {
    return static_cast<float>(static_cast<double>(number) / divisor);
}

/// Maps the bits of floats to integers in the order of the floats, and back.
std::uint32_t ordered(std::uint32_t bits) { return bits ^ ((0u - (bits >> 31)) >> 1); }

/// The samples as integers divided by a number; false if some are not such quotients.
bool multiply(std::span<const std::uint32_t> floats, double divisor,
              std::vector<std::uint32_t>& numbers_out) {
    constexpr double kMost = 0x1p30;
    numbers_out.clear();
    for (const std::uint32_t bits : floats) {
        const double nearest =
            std::floor(static_cast<double>(std::bit_cast<float>(bits)) * divisor + 0.5);
        if (!(std::abs(nearest) <= kMost)) return false;
        const auto number = static_cast<std::int32_t>(nearest);
        if (std::bit_cast<std::uint32_t>(divided(number, divisor)) != bits) return false;
        numbers_out.push_back(static_cast<std::uint32_t>(number));
    }
    return true;
}

}  // namespace

std::size_t max_square_bytes() {
    return 1 + sizeof(std::uint32_t) * StoredRaster::kSquareSide * StoredRaster::kSquareSide;
}

std::vector<std::uint8_t> encode_square(std::span<const std::uint32_t> packed, bool is_integer,
                                        int columns) {
    std::vector<std::uint32_t> numbers(packed.begin(), packed.end());
    std::size_t coding = 0;
    if (!is_integer) {
        for (coding = 1; coding < kDivisors.size(); ++coding) {
            if (multiply(packed, kDivisors[coding], numbers)) break;
        }
        if (coding == kDivisors.size()) {
            coding = 0;
            numbers.assign(packed.begin(), packed.end());
            for (std::uint32_t& number : numbers) number = ordered(number);
        }
    }
    ByteWriter out;
    out.put(static_cast<std::uint8_t>(coding));
    put_grid(out, numbers, columns);
    return out.bytes();
}

Result<std::vector<std::uint32_t>> decode_square(std::span<const std::uint8_t> bytes,
                                                 bool is_integer, int columns, int rows) {
    ByteReader in(bytes);
    const auto coding = in.get<std::uint8_t>();
    std::vector<std::uint32_t> numbers = get_grid(in, columns, rows);
    if (!in.is_done() || coding >= kDivisors.size() || (is_integer && coding != 0)) {
        return fail(ErrorCode::bad_data, "a square of " + std::to_string(bytes.size()) +
                                             " bytes has not all of its samples");
    }
    if (is_integer) return numbers;
    for (std::uint32_t& number : numbers) {
        number = coding == 0 ? ordered(number)
                             : std::bit_cast<std::uint32_t>(
                                   divided(static_cast<std::int32_t>(number), kDivisors[coding]));
    }
    return numbers;
}

void put_hash(ByteWriter& out, const ContentHash& hash) {
    out.put(hash.low);
    out.put(hash.high);
}

ContentHash get_hash(ByteReader& in) {
    const auto low = in.get<std::uint64_t>();
    return {low, in.get<std::uint64_t>()};
}

SquareRange squares_around(const BilinearGrid& grid, const LatticePoint& south_west,
                           const LatticePoint& north_east, std::int64_t step) {
    // Bounds depend on points within three steps around a chunk and its margin, and on kBoundsMargin samples more.
    const std::int64_t margin = (3 + kReachCells) * step;
    SquareRange range;
    const auto squares = [](SamplePlace first, SamplePlace last, int samples, int& first_out,
                            int& count_out) {
        const auto square_of = [samples](std::int64_t index) {
            return static_cast<int>(std::clamp<std::int64_t>(index, 0, samples - 1) /
                                    StoredRaster::kSquareSide);
        };
        first_out = square_of(first.index - kBoundsMargin);
        count_out = square_of(last.index + 2 + kBoundsMargin) - first_out + 1;
    };
    squares(grid.column_at_index(south_west.x - margin),
            grid.column_at_index(north_east.x + margin), grid.columns, range.first_column,
            range.column_count);
    squares(grid.row_at_index(south_west.y - margin), grid.row_at_index(north_east.y + margin),
            grid.rows, range.first_row, range.row_count);
    return range;
}

ChunkContent content_of(const Lattice& lattice, const std::optional<StoredRaster>& raster,
                        int level) {
    const std::int64_t base = raster ? raster->grid.base_step() : 0, step = lattice.step(level);
    if (step > kFineCells * base) return ChunkContent::all;
    return step > base || level == 0 ? ChunkContent::vertex_bounds : ChunkContent::flags;
}

namespace {

/// Number of chunks on all levels coarser than this.
std::int64_t chunks_before(const Lattice& lattice, int level) {
    const std::int64_t roots = std::int64_t{lattice.root_count_x} * lattice.root_count_y;
    return roots * (((std::int64_t{1} << (2 * level)) - 1) / 3);
}

void put_raster(ByteWriter& out, const StoredRaster& raster) {
    const BilinearGrid& grid = raster.grid;
    out.put(std::int32_t{grid.columns});
    out.put(std::int32_t{grid.rows});
    out.put(grid.cell_x);
    out.put(grid.cell_y);
    out.put(grid.west);
    out.put(grid.south);
    out.put(static_cast<std::uint8_t>(grid.aligned ? 1 : 0));
    out.put(std::int32_t{grid.cell_log2});
    out.put(grid.first.x);
    out.put(grid.first.y);
    out.put(raster.packing.base());
    out.put(raster.packing.step());
    out.put(static_cast<std::uint8_t>(raster.packing.is_integer() ? 1 : 0));
    out.put(raster.rounding);
    out.put_each(std::span<const double>(raster.rises));
    out.put(std::int32_t{raster.squares.first_column});
    out.put(std::int32_t{raster.squares.first_row});
    out.put(std::int32_t{raster.squares.column_count});
    out.put(std::int32_t{raster.squares.row_count});
}

}  // namespace

bool is_valid(const StoredRaster& raster) {
    constexpr double kMostCells = 0x1p31;
    const BilinearGrid& grid = raster.grid;
    const auto is_length = [](double metres) { return metres > 0.0 && std::isfinite(metres); };
    const auto is_near = [](double metres, double cell) {
        return std::abs(metres) <= kMostCells * cell;
    };
    const auto covers = [](int first, int count, int samples) {
        const int squares = (samples - 1) / StoredRaster::kSquareSide + 1;
        return first >= 0 && count > 0 && first < squares && count <= squares - first;
    };
    if (grid.columns < 2 || grid.rows < 2 || grid.cell_log2 < 0 || grid.cell_log2 > 32 ||
        !is_length(grid.cell_x) || !is_length(grid.cell_y)) {
        return false;
    }
    const double base = grid.base_spacing(), shorter = std::min(grid.cell_x, grid.cell_y);
    const auto is_index = [&grid](std::int64_t index) {
        constexpr std::int64_t kMost = std::int64_t{1} << 62;
        return index > -kMost && index < kMost && index % grid.base_step() == 0;
    };
    const bool is_placed = grid.aligned ? grid.cell_x == base && grid.cell_y == base &&
                                              is_index(grid.first.x) && is_index(grid.first.y)
                                        : base <= shorter && shorter < 2.0 * base &&
                                              is_near(grid.west, grid.cell_x) &&
                                              is_near(grid.south, grid.cell_y);
    const SamplePacking& packing = raster.packing;
    return is_placed && std::isfinite(packing.base()) && std::isfinite(packing.step()) &&
           packing.step() != 0.0 && raster.rounding >= 0.0 && std::isfinite(raster.rounding) &&
           covers(raster.squares.first_column, raster.squares.column_count, grid.columns) &&
           covers(raster.squares.first_row, raster.squares.row_count, grid.rows);
}

namespace {

/// Reads the output of put_raster(); absent if it makes no sense.
std::optional<StoredRaster> get_raster(ByteReader& in, const Lattice& lattice) {
    StoredRaster raster;
    BilinearGrid& grid = raster.grid;
    grid.lattice = lattice;
    grid.columns = in.get<std::int32_t>();
    grid.rows = in.get<std::int32_t>();
    grid.cell_x = in.get<double>();
    grid.cell_y = in.get<double>();
    grid.west = in.get<double>();
    grid.south = in.get<double>();
    const auto is_aligned = in.get<std::uint8_t>();
    grid.aligned = is_aligned == 1;
    grid.cell_log2 = in.get<std::int32_t>();
    grid.first.x = in.get<std::int64_t>();
    grid.first.y = in.get<std::int64_t>();
    const auto base = in.get<double>(), step = in.get<double>();
    const auto is_integer = in.get<std::uint8_t>();
    raster.packing = SamplePacking::of_parts(base, step, is_integer == 1);
    raster.rounding = in.get<double>();
    raster.rises.resize(rise_distances(lattice).size());
    in.get_each(std::span<double>(raster.rises));
    raster.squares.first_column = in.get<std::int32_t>();
    raster.squares.first_row = in.get<std::int32_t>();
    raster.squares.column_count = in.get<std::int32_t>();
    raster.squares.row_count = in.get<std::int32_t>();
    if (in.has_failed() || is_aligned > 1 || is_integer > 1 || !is_valid(raster)) {
        return std::nullopt;
    }
    return raster;
}

void put_world(ByteWriter& out, const StoreDirectory& directory) {
    const Lattice& lattice = directory.lattice;
    out.put(lattice.origin_x);
    out.put(lattice.origin_y);
    out.put(lattice.spacing);
    out.put(lattice.quantum);
    out.put(std::int32_t{lattice.finest_level});
    out.put(lattice.first_root_x);
    out.put(lattice.first_root_y);
    out.put(lattice.root_count_x);
    out.put(lattice.root_count_y);
    out.put(directory.extent.west);
    out.put(directory.extent.south);
    out.put(directory.extent.east);
    out.put(directory.extent.north);
    out.put(directory.max_error_m);
    out.put_each(std::span<const double>(directory.rises));
    out.put(static_cast<std::uint8_t>(directory.raster ? 1 : 0));
    if (directory.raster) {
        put_raster(out, *directory.raster);
        for (const StoredRecord& square : directory.squares) put_hash(out, square.hash);
    }
    for (const ChunkRecord& chunk : directory.chunks) {
        put_hash(out, chunk.hash);
        out.put(chunk.heights.low);
        out.put(chunk.heights.high);
    }
    out.put_text(directory.note);
}

}  // namespace

std::size_t StoreDirectory::index_of(const ChunkKey& key) const {
    const std::int64_t per_root = std::int64_t{1} << key.level;
    const std::int64_t x = key.x - lattice.first_root_x * per_root;
    const std::int64_t y = key.y - lattice.first_root_y * per_root;
    return static_cast<std::size_t>(chunks_before(lattice, key.level) +
                                    y * lattice.root_count_x * per_root + x);
}

std::int64_t count_chunks(const Lattice& lattice) {
    // The finest level is at most 24, and there are fewer than 2^62 root squares, so doubles do not overflow.
    const double count = static_cast<double>(lattice.root_count_x) * lattice.root_count_y *
                         std::ldexp(1.0, 2 * lattice.finest_level);
    if (count > static_cast<double>(kMostChunks)) return kMostChunks + 1;
    return std::min(chunks_before(lattice, lattice.finest_level + 1), kMostChunks + 1);
}

ChunkKey key_at(const Lattice& lattice, std::int64_t index) {
    int level = 0;
    while (chunks_before(lattice, level + 1) <= index) ++level;
    const std::int64_t per_root = std::int64_t{1} << level;
    const std::int64_t across = lattice.root_count_x * per_root;
    const std::int64_t in_level = index - chunks_before(lattice, level);
    return {static_cast<std::int32_t>(lattice.first_root_x * per_root + in_level % across),
            static_cast<std::int32_t>(lattice.first_root_y * per_root + in_level / across),
            static_cast<std::uint8_t>(level)};
}

std::vector<double> rise_distances(const Lattice& lattice) {
    constexpr double kDiagonal = 0.70710678118654757;
    constexpr int kBelow = 24, kAbove = 9;
    std::vector<double> distances;
    for (int exponent = -kBelow; exponent < lattice.finest_level + kAbove; ++exponent) {
        const double spacing = std::ldexp(lattice.spacing, exponent);
        distances.push_back(kDiagonal * spacing);
        distances.push_back(spacing);
    }
    return distances;
}

std::vector<std::uint8_t> encode(const StoreDirectory& directory) {
    ByteWriter out;
    put_world(out, directory);
    for (const ChunkRecord& chunk : directory.chunks) {
        out.put(chunk.offset);
        out.put(chunk.bytes);
    }
    for (const StoredRecord& square : directory.squares) {
        out.put(square.offset);
        out.put(square.bytes);
    }
    return out.bytes();
}

Result<StoreDirectory> decode_directory(std::span<const std::uint8_t> bytes) {
    ByteReader in(bytes);
    StoreDirectory directory;
    Lattice& lattice = directory.lattice;
    lattice.origin_x = in.get<double>();
    lattice.origin_y = in.get<double>();
    lattice.spacing = in.get<double>();
    lattice.quantum = in.get<double>();
    lattice.finest_level = in.get<std::int32_t>();
    lattice.first_root_x = in.get<std::int32_t>();
    lattice.first_root_y = in.get<std::int32_t>();
    lattice.root_count_x = in.get<std::int32_t>();
    lattice.root_count_y = in.get<std::int32_t>();
    directory.extent.west = in.get<double>();
    directory.extent.south = in.get<double>();
    directory.extent.east = in.get<double>();
    directory.extent.north = in.get<double>();
    directory.max_error_m = in.get<double>();
    const auto senseless = [] { return fail(ErrorCode::bad_data, "the directory makes no sense"); };
    if (in.has_failed() || !lattice.validate()) return senseless();
    const std::int64_t count = count_chunks(lattice);
    constexpr std::size_t kRecordBytes = 44, kSquareBytes = 28;
    if (count > kMostChunks || static_cast<std::size_t>(count) > bytes.size() / kRecordBytes) {
        return senseless();
    }
    directory.rises.resize(rise_distances(lattice).size());
    in.get_each(std::span<double>(directory.rises));
    if (const auto has_raster = in.get<std::uint8_t>(); has_raster == 1) {
        directory.raster = get_raster(in, lattice);
        if (!directory.raster || directory.raster->squares.count() > bytes.size() / kSquareBytes) {
            return senseless();
        }
        directory.squares.resize(directory.raster->squares.count());
        for (StoredRecord& square : directory.squares) square.hash = get_hash(in);
    } else if (has_raster != 0) {
        return senseless();
    }
    directory.chunks.resize(static_cast<std::size_t>(count));
    for (ChunkRecord& chunk : directory.chunks) {
        chunk.hash = get_hash(in);
        chunk.heights.low = in.get<double>();
        chunk.heights.high = in.get<double>();
    }
    directory.note = in.get_text();
    for (ChunkRecord& chunk : directory.chunks) {
        chunk.offset = in.get<std::uint64_t>();
        chunk.bytes = in.get<std::uint32_t>();
    }
    for (StoredRecord& square : directory.squares) {
        square.offset = in.get<std::uint64_t>();
        square.bytes = in.get<std::uint32_t>();
    }
    if (!in.is_done()) return senseless();
    return directory;
}

std::string sha_of(const StoreDirectory& directory) {
    ByteWriter out;
    out.put_each(std::span<const char>(kStoreKind.name));
    out.put(kStoreKind.version);
    put_world(out, directory);
    return sha256(out.bytes());
}

}  // namespace terrane::internal
