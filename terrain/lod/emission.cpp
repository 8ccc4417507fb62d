// SPDX-License-Identifier: MIT
//
// Sources:
//   L. Velho, D. Gomes. Variable Resolution 4-k Meshes. Computer Graphics Forum 19(4), 2000. (the mesh)
// Deviations: a chunk draws the triangles between its own centres and the next finer ones. The square around a centre
//             has one of 256 configurations: each of its four sides is split or not, and each of its four quarters is
//             divided by a finer centre or not. A table contains the triangles of each configuration.
#include "lod/frame_mesh.h"
#include "lod/solid_pins.h"

#include <terrane/base/result.h>
#include <terrane/terrain/lattice.h>

#include <algorithm>
#include <array>
#include <bit>

namespace terrane::internal {
namespace {

constexpr std::size_t kMostIndices = 24;  // eight triangles per square

// Sides of a square, counter-clockwise from the south: first corner and midpoint, relative to the centre. Quarter k is
// at the first corner of side k.
struct SquareSide {
    int corner_x, corner_y;
    int middle_x, middle_y;
};
constexpr std::array<SquareSide, 4> kSides{SquareSide{-1, -1, 0, -1}, SquareSide{1, -1, 1, 0},
                                           SquareSide{1, 1, 0, 1}, SquareSide{-1, 1, -1, 0}};

/// Triangles as sample indices relative to the centre, modulo 2^16.
struct Shape {
    std::array<std::uint16_t, kMostIndices> steps{};
    std::uint32_t count = 0;
};

constexpr void add(Shape& shape, int x_a, int y_a, int x_b, int y_b) {
    const auto step = [](int x, int y) {
        return static_cast<std::uint16_t>(y * kChunkSamples + x);
    };
    shape.steps[shape.count++] = step(x_a, y_a);
    shape.steps[shape.count++] = step(x_b, y_b);
    shape.steps[shape.count++] = 0;
}

/// @param word bit k: side k is split; bit 4 + k: quarter k is divided
constexpr Shape make_shape(unsigned word) {
    Shape shape;
    for (std::size_t k = 0; k < 4; ++k) {
        const SquareSide& begin = kSides[k];
        const SquareSide& end = kSides[(k + 1) % 4];
        if ((word >> k & 1) == 0) {
            add(shape, begin.corner_x, begin.corner_y, end.corner_x, end.corner_y);
            continue;
        }
        if ((word >> (4 + k) & 1) == 0) {
            add(shape, begin.corner_x, begin.corner_y, begin.middle_x, begin.middle_y);
        }
        if ((word >> (4 + (k + 1) % 4) & 1) == 0) {
            add(shape, begin.middle_x, begin.middle_y, end.corner_x, end.corner_y);
        }
    }
    return shape;
}

constexpr std::array<Shape, 256> make_shapes() {
    std::array<Shape, 256> shapes{};
    for (unsigned word = 0; word < 256; ++word) shapes[word] = make_shape(word);
    return shapes;
}
constexpr std::array<Shape, 256> kShapes = make_shapes();

// Moves bit i of a byte to the lowest bit of byte i.
constexpr std::array<std::uint64_t, 256> make_spread() {
    std::array<std::uint64_t, 256> spread{};
    for (unsigned byte = 0; byte < 256; ++byte) {
        for (unsigned bit = 0; bit < 8; ++bit) {
            spread[byte] |= static_cast<std::uint64_t>(byte >> bit & 1) << (8 * bit);
        }
    }
    return spread;
}
constexpr std::array<std::uint64_t, 256> kSpread = make_spread();

class Writer {
public:
    Writer(std::uint16_t* out, std::size_t count) : out_(out), end_(out + count) {}

    void add(const Shape& shape, std::uint16_t centre) {
        // fixed length, so that the loop vectorises; the surplus is overwritten by the next square
        if (out_ + kMostIndices <= end_) {
            for (std::size_t i = 0; i < kMostIndices; ++i) {
                out_[i] = static_cast<std::uint16_t>(shape.steps[i] + centre);
            }
        } else {
            for (std::size_t i = 0; i < shape.count; ++i) {
                out_[i] = static_cast<std::uint16_t>(shape.steps[i] + centre);
            }
        }
        out_ += shape.count;
    }
    void add_triangle(std::uint16_t a, std::uint16_t b, std::uint16_t c) {
        out_[0] = a;
        out_[1] = b;
        out_[2] = c;
        out_ += 3;
    }

    bool is_full() const { return out_ == end_; }

private:
    std::uint16_t* out_;
    std::uint16_t* end_;
};

// Emits those triangles of a square of the finest level that volumes do not replace.
void emit_remaining(const ReplacedTriangles::OfArea& replaced, int square, unsigned word,
                    std::uint16_t centre, Writer& writer) {
    const auto at = [&](int x, int y) {
        return static_cast<std::uint16_t>(centre + y * kChunkSamples + x);
    };
    for (std::size_t k = 0; k < 4; ++k) {
        const SquareSide& begin = kSides[k];
        const SquareSide& end = kSides[(k + 1) % 4];
        const std::uint16_t first = at(begin.corner_x, begin.corner_y);
        const std::uint16_t middle = at(begin.middle_x, begin.middle_y);
        const std::uint16_t last = at(end.corner_x, end.corner_y);
        if ((word >> k & 1) == 0) {
            writer.add_triangle(first, last, centre);
            continue;
        }
        if ((replaced.squares[2 * k] >> square & 1) == 0) {
            writer.add_triangle(first, middle, centre);
        }
        if ((replaced.squares[2 * k + 1] >> square & 1) == 0) {
            writer.add_triangle(middle, last, centre);
        }
    }
}

void emit_area(const OpenChunk& chunk, int area, Writer& writer) {
    const AreaBits bits = area_bits(chunk, area);
    const ReplacedTriangles::OfArea* const replaced =
        chunk.replaced != nullptr ? chunk.replaced->find(area) : nullptr;
    const std::uint64_t cut = replaced != nullptr ? replaced->any() : 0;
    // a byte for each square: which of its sides are split, and which of its quarters divided
    std::array<std::uint64_t, kAreaSquares> words;
    for (std::size_t row = 0; row < words.size(); ++row) {
        words[row] = 0;
        const auto of_row = [&](std::uint64_t word) {
            return kSpread[static_cast<std::size_t>(word >> (kAreaSquares * row) & 0xff)];
        };
        for (unsigned k = 0; k < 4; ++k) {
            words[row] |= of_row(bits.split[k]) << k | of_row(bits.divided[k]) << (4 + k);
        }
    }
    const int west = area % kChunkAreas * kAreaCells, south = area / kChunkAreas * kAreaCells;
    const std::size_t first = sample_index(west + 1, south + 1);
    for_each_bit(bits.centre, [&](int square) {
        const auto row = static_cast<std::size_t>(square / kAreaSquares);
        const auto column = static_cast<std::size_t>(square % kAreaSquares);
        const auto word = static_cast<unsigned>(words[row] >> (8 * column) & 0xff);
        const auto centre = static_cast<std::uint16_t>(first + 2 * (row * kChunkSamples + column));
        if ((cut >> square & 1) != 0) {
            emit_remaining(*replaced, square, word, centre, writer);
        } else {
            writer.add(kShapes[word], centre);
        }
    });
}

bool is_undivided(const OpenChunk& root, float threshold) {
    return !(root.coarse_key(kChunkSquares, kChunkSquares) < threshold);
}

void emit_root(const OpenChunk& root, float threshold, Writer& writer) {
    if (is_undivided(root, threshold)) {
        constexpr std::uint16_t south_west = 0;
        constexpr auto south_east = static_cast<std::uint16_t>(kChunkCells);
        constexpr auto north_west = static_cast<std::uint16_t>(kChunkCells * kChunkSamples);
        constexpr auto north_east = static_cast<std::uint16_t>(OpenChunk::kSamples - 1);
        if (cut_to_north_east(root.chunk->key.x, root.chunk->key.y)) {
            writer.add_triangle(south_west, south_east, north_east);
            writer.add_triangle(south_west, north_east, north_west);
        } else {
            writer.add_triangle(south_west, south_east, north_west);
            writer.add_triangle(south_east, north_east, north_west);
        }
        return;
    }
    for (const OpenChunk::CoarseSquare& square : root.coarse_squares) {
        const Shape& shape = kShapes[square.word];
        for (std::size_t i = 0; i < shape.count; i += 3) {
            const auto corner = [&](std::size_t k) {
                return static_cast<std::uint16_t>(shape.steps[i + k] * square.stride +
                                                  square.centre);
            };
            writer.add_triangle(corner(0), corner(1), corner(2));
        }
    }
}

// Finds the active centres of coarser spacings of a root.
void find_coarse_squares(OpenChunk& root, float threshold) {
    root.coarse_squares.clear();
    const auto is_active = [&](int column, int row) {
        return root.coarse_key(column, row) < threshold;
    };
    const auto is_centre_active = [&](int column, int row, int stride) {
        if (stride > 1) return is_active(column, row);
        const auto [area, kind, square] = AreaVertices::address_of(column, row);
        return (root.bits[area].centre >> square & 1) != 0;
    };
    for (int stride = kChunkSquares; stride > 1; stride /= 2) {
        for (int row = stride; row < kChunkCells; row += 2 * stride) {
            for (int column = stride; column < kChunkCells; column += 2 * stride) {
                if (!is_active(column, row)) continue;
                unsigned word = 0;
                for (unsigned k = 0; k < 4; ++k) {
                    const SquareSide& side = kSides[k];
                    if (is_active(column + side.middle_x * stride, row + side.middle_y * stride)) {
                        word |= 1u << k;
                    }
                    const int half = stride / 2;
                    if (is_centre_active(column + side.corner_x * half, row + side.corner_y * half,
                                         half)) {
                        word |= 1u << (4 + k);
                    }
                }
                root.coarse_squares.push_back(
                    {static_cast<std::uint16_t>(sample_index(column, row)),
                     static_cast<std::uint8_t>(stride), static_cast<std::uint8_t>(word)});
            }
        }
    }
}

// Numbers of active midpoints on the sides of a chunk.
struct SideMidpoints {
    std::size_t west = 0, east = 0, south = 0, north = 0;
};

SideMidpoints side_midpoints(const OpenChunk& chunk) {
    constexpr std::uint64_t kFirstColumn = 0x0101010101010101u, kFirstRow = 0xffu;
    std::uint64_t west = 0, east = 0, south = 0, north = 0;
    for (int i = 0; i < kChunkAreas; ++i) {
        const int last = kChunkAreas - 1;
        const int at_west = kChunkAreas * i, at_north = kChunkAreas * last + i;
        west |= (chunk.bits_of(at_west).along_y & kFirstColumn) << i;
        south |= (chunk.bits_of(i).along_x & kFirstRow) << (kAreaSquares * i);
        east |= east_side_bits(chunk, at_west + last) << i;
        north |= north_side_bits(chunk, at_north) << (kAreaSquares * i);
    }
    const auto count = [](std::uint64_t bits) {
        return static_cast<std::size_t>(std::popcount(bits));
    };
    return {count(west), count(east), count(south), count(north)};
}

}  // namespace

void mark_active(OpenChunk& chunk, const KeyKernels& kernels, float threshold) {
    chunk.active_areas = 0;
    for_each_bit(chunk.open_areas, [&](int area) {
        // midpoints need an active centre
        if (chunk.bits_of(area).centre == 0) return;
        chunk.active_areas |= std::uint64_t{1} << area;
    });
    const auto of_side = [&](Side side, const auto& keys) {
        return chunk.at_world_border[side] ? kernels.mask(keys.data(), threshold)
                                           : std::uint64_t{0};
    };
    chunk.east_bits = of_side(east, chunk.east_keys);
    chunk.north_bits = of_side(north, chunk.north_keys);
    if (chunk.is_root()) find_coarse_squares(chunk, threshold);
}

std::size_t count_triangles(const OpenChunk& chunk, float threshold) {
    std::size_t count = 0;
    if (chunk.is_root()) {
        if (is_undivided(chunk, threshold)) count += 2;
        for (const OpenChunk::CoarseSquare& square : chunk.coarse_squares) {
            count += kShapes[square.word].count / 3;
        }
    }
    // A square has four triangles, and one more for each active midpoint on its sides. An inner midpoint is on a side
    // of two squares of this chunk, a midpoint on the chunk's side of one. midpoint_count includes the midpoints on the
    // western and southern sides, but not those on the eastern and northern sides.
    const SideMidpoints sides = side_midpoints(chunk);
    count += 4 * chunk.centre_count + 2 * chunk.midpoint_count;
    count += sides.east + sides.north;
    count -= sides.west + sides.south;
    // a centre of a child divides a quarter of a square, which removes a triangle at each of its two sides
    for (const OpenChunk* const child : chunk.child) {
        if (child != nullptr) count -= 2 * child->centre_count;
    }
    return chunk.replaced != nullptr ? count - chunk.replaced->count : count;
}

void emit_triangles(const OpenChunk& chunk, float threshold, std::uint16_t* indices_out) {
    Writer writer(indices_out, 3 * chunk.triangle_count);
    if (chunk.is_root()) emit_root(chunk, threshold, writer);
    for_each_bit(chunk.active_areas, [&](int area) { emit_area(chunk, area, writer); });
    TERRANE_ASSERT(writer.is_full(), "the triangles must be those that were counted");
}

}  // namespace terrane::internal
