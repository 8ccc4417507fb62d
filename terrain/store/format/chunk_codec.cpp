// SPDX-License-Identifier: MIT
//
// Lossless: differences are of the numbers' bits as unsigned integers that wrap around.
#include "format/chunk_codec.h"

#include "chunks/chunk_vertices.h"

#include <terrane/store/bytes.h>

#include <array>
#include <bit>
#include <string>
#include <utility>

namespace terrane::internal {
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

/// The least significant bytes of all values, then the next ones, ...
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

/// Prediction of a value from its western, southern and south-western neighbours: their plane.
template <class At>
std::uint32_t predicted(int column, int row, At&& at) {
    if (row == 0) return column == 0 ? 0u : at(column - 1, row);
    if (column == 0) return at(column, row - 1);
    return at(column - 1, row) + at(column, row - 1) - at(column - 1, row - 1);
}

void put_grid(ByteWriter& out, std::span<const std::uint32_t> bits, int side) {
    const auto at = [&](int column, int row) {
        return bits[static_cast<std::size_t>(row * side + column)];
    };
    std::vector<std::uint32_t> rest(bits.size());
    for (int row = 0; row < side; ++row) {
        for (int column = 0; column < side; ++column) {
            rest[static_cast<std::size_t>(row * side + column)] =
                zigzag(at(column, row) - predicted(column, row, at));
        }
    }
    put_planes(out, std::span<const std::uint32_t>(rest));
}

std::vector<std::uint32_t> get_grid(ByteReader& in, int side) {
    std::vector<std::uint32_t> bits(static_cast<std::size_t>(side) *
                                    static_cast<std::size_t>(side));
    get_planes(in, std::span<std::uint32_t>(bits));
    const auto at = [&](int column, int row) {
        return bits[static_cast<std::size_t>(row * side + column)];
    };
    for (int row = 0; row < side; ++row) {
        for (int column = 0; column < side; ++column) {
            std::uint32_t& value = bits[static_cast<std::size_t>(row * side + column)];
            value = unzigzag(value) + predicted(column, row, at);
        }
    }
    return bits;
}

/// Differences of consecutive values.
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

/// Calls visit() for every 16-bit number of a chunk's vertices in a fixed order, grouped by kind and meaning.
template <class AnyVertices, class Visit>
void for_each_vertex_number(AnyVertices& vertices, Visit&& visit) {
    for (std::size_t kind = 0; kind < AreaVertices::kKinds; ++kind) {
        for (auto& area : vertices.areas) {
            for (auto& bound : area.inverse_square_bounds[kind]) visit(bound);
        }
        for (auto& area : vertices.areas) {
            for (auto& low : area.low[kind]) visit(low);
        }
        for (auto& area : vertices.areas) {
            for (auto& high : area.high[kind]) visit(high);
        }
    }
    for (auto* side : {&vertices.east_side, &vertices.north_side}) {
        for (auto& bound : side->inverse_square_bounds) visit(bound);
        for (auto& low : side->low) visit(low);
        for (auto& high : side->high) visit(high);
    }
}

constexpr std::size_t kVertexNumbers =
    3 * (AreaVertices::kKinds * kVertices + 2 * std::size_t{kChunkSquares});

}  // namespace

std::size_t max_encoded_bytes() {
    return 1 + 4 * kSamples + 2 * kVertexNumbers + 4 * kCells + 8 + 4 + 4 + 4 * kAreas +
           4 * kCoarse + kCells;
}

std::vector<std::uint8_t> encode_chunk(const Chunk& chunk) {
    const ChunkVertices& vertices = *chunk.vertices;
    ByteWriter out;
    out.put(static_cast<std::uint8_t>((vertices.coarse_bounds.empty() ? 0 : has_coarse_bounds) |
                                      (chunk.cell_flags.empty() ? 0 : has_cell_flags)));
    put_grid(out, bits_of<std::uint32_t, std::int32_t>(chunk.heights), kChunkSamples);
    std::vector<std::uint16_t> numbers;
    numbers.reserve(kVertexNumbers);
    for_each_vertex_number(vertices, [&](const auto& number) {
        numbers.push_back(std::bit_cast<std::uint16_t>(number));
    });
    put_row(out, numbers);
    put_grid(out, bits_of<std::uint32_t, float>(chunk.cell_bounds), kChunkCells);
    out.put(vertices.reach_base);
    out.put(vertices.reach_unit);
    out.put(chunk.max_vertex_bound);
    for (const Chunk::Area& area : chunk.areas) out.put(area.max_vertex_bound);
    if (!vertices.coarse_bounds.empty()) {
        put_planes(out, std::span<const std::uint32_t>(
                            bits_of<std::uint32_t, float>(vertices.coarse_bounds)));
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
    // reserved, so that the chunk has no more bytes than a load claims
    chunk->heights.reserve(std::size_t{kChunkSamples} * kChunkSamples);
    for (const std::uint32_t bits : get_grid(in, kChunkSamples)) {
        chunk->heights.push_back(std::bit_cast<std::int32_t>(bits));
    }
    std::vector<std::uint16_t> numbers(kVertexNumbers);
    get_row(in, numbers);
    auto next = numbers.begin();
    for_each_vertex_number(*vertices, [&next](auto& number) {
        number = std::bit_cast<std::remove_reference_t<decltype(number)>>(*next++);
    });
    chunk->cell_bounds.reserve(kCells);
    for (const std::uint32_t bits : get_grid(in, kChunkCells)) {
        chunk->cell_bounds.push_back(std::bit_cast<float>(bits));
    }
    vertices->reach_base = in.get<double>();
    vertices->reach_unit = in.get<float>();
    chunk->max_vertex_bound = in.get<float>();
    for (Chunk::Area& area : chunk->areas) area.max_vertex_bound = in.get<float>();
    if ((parts & has_coarse_bounds) != 0) {
        std::vector<std::uint32_t> coarse(kCoarse);
        get_planes(in, std::span<std::uint32_t>(coarse));
        vertices->coarse_bounds.reserve(kCoarse);
        for (const std::uint32_t bits : coarse) {
            vertices->coarse_bounds.push_back(std::bit_cast<float>(bits));
        }
    }
    if ((parts & has_cell_flags) != 0) {
        chunk->cell_flags.resize(kCells);
        in.get_each(std::span<std::uint8_t>(chunk->cell_flags));
    }
    if (!in.is_done() || ((parts & has_coarse_bounds) != 0) != (key.level == 0)) {
        return fail(ErrorCode::bad_data, "a chunk of " + std::to_string(bytes.size()) +
                                             " bytes has not all of its parts");
    }
    complete_chunk(lattice.quantum, std::move(vertices), *chunk);
    return std::shared_ptr<const Chunk>(std::move(chunk));
}

}  // namespace terrane::internal
