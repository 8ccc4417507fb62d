// SPDX-License-Identifier: MIT
#include "mesh_checks.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <sstream>

namespace terrane::test {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

std::string name(const SoupVertex& v) {
    std::ostringstream out;
    out << "(" << v.point.x << ", " << v.point.y << ", " << v.height;
    if (v.offset != 0.0f) out << " + " << std::hexfloat << v.offset << " m";
    out << ")";
    return out.str();
}

std::uint64_t hash(const LatticePoint& point) {
    std::uint64_t h = static_cast<std::uint64_t>(point.x) * 0x9e3779b97f4a7c15u;
    h ^= (h >> 32) + static_cast<std::uint64_t>(point.y) * 0xc2b2ae3d27d4eb4fu;
    h *= 0xff51afd7ed558ccdu;
    return h ^ (h >> 32);
}

// Adding zero turns -0 into +0: both display the same.
std::uint32_t offset_bits(const SoupVertex& v) {
    return std::bit_cast<std::uint32_t>(v.offset + 0.0f);
}

SoupTriangle triangle_at(const TerrainMesh& mesh, const MeshChunk& part, std::size_t first) {
    SoupTriangle triangle;
    for (std::size_t corner = 0; corner < 3; ++corner) {
        const std::uint16_t index = mesh.indices[part.first_index + first + corner];
        const Chunk& chunk = *part.chunk;
        triangle[corner] = {{chunk.corner.x + (index % kChunkSamples) * chunk.step,
                             chunk.corner.y + (index / kChunkSamples) * chunk.step},
                            chunk.heights[index],
                            part.offsets == nullptr ? 0.0f : part.offsets[index]};
    }
    return triangle;
}

// A sum of areas that is exact beyond 64 bits, in halves of a squared finest spacing.
class ExactArea {
public:
    void add(std::uint64_t doubled, std::uint64_t times = 1) {
        low_ += (doubled & 0xffffffffu) * times;
        high_ += (doubled >> 32) * times + (low_ >> 32);
        low_ &= 0xffffffffu;
    }
    double value() const {
        return 0.5 * (static_cast<double>(high_) * 0x1p32 + static_cast<double>(low_));
    }
    friend bool operator==(const ExactArea&, const ExactArea&) = default;

private:
    std::uint64_t high_ = 0, low_ = 0;
};

// Takes the triangles of a mesh one by one.
class FlawFinder {
public:
    FlawFinder(const Lattice& lattice, std::size_t triangle_count) : lattice_(lattice) {
        vertices_.reserve(triangle_count / 2 + 16);
        triangles_.reserve(triangle_count);
        grow(std::bit_ceil(triangle_count + 16));
    }

    void add(const SoupTriangle& triangle) {
        if (!flaw_.empty()) return;
        check_shape(triangle);
        std::array<std::uint32_t, 3> numbers{};
        for (std::size_t i = 0; i < 3; ++i) numbers[i] = number_of(triangle[i]);
        triangles_.push_back(numbers);
    }

    std::string finish() {
        if (flaw_.empty()) check_edges();
        if (flaw_.empty()) check_area();
        return flaw_;
    }

private:
    void check_shape(const SoupTriangle& t) {
        for (const SoupVertex& v : t) {
            if (v.point.x < lattice_.west() || v.point.x > lattice_.east() ||
                v.point.y < lattice_.south() || v.point.y > lattice_.north()) {
                flaw_ = "vertex " + name(v) + " is outside the world";
                return;
            }
            if (!std::isfinite(v.offset)) {
                flaw_ = "the offset of vertex " + name(v) + " is not finite";
                return;
            }
        }
        const std::int64_t dx1 = t[1].point.x - t[0].point.x;
        const std::int64_t dy1 = t[1].point.y - t[0].point.y;
        const std::int64_t dx2 = t[2].point.x - t[0].point.x;
        const std::int64_t dy2 = t[2].point.y - t[0].point.y;
        const std::int64_t side = lattice_.chunk_side(0);
        for (const std::int64_t d : {dx1, dy1, dx2, dy2}) {
            if (d <= side && d >= -side) continue;
            flaw_ = "triangle at " + name(t[0]) + " is larger than a root square";
            return;
        }
        const std::int64_t doubled = dx1 * dy2 - dx2 * dy1;
        if (doubled > 0) {
            area_.add(static_cast<std::uint64_t>(doubled));
        } else {
            flaw_ = "triangle at " + name(t[0]) + " is not counter-clockwise";
        }
    }

    // The vertex at a lattice point, numbered in the order in which triangles name them.
    std::uint32_t number_of(const SoupVertex& v) {
        if (2 * vertices_.size() >= table_.size()) grow(2 * table_.size());
        std::uint32_t& slot = find(v.point);
        if (slot == kNone) {
            slot = static_cast<std::uint32_t>(vertices_.size());
            vertices_.push_back(v);
            return slot;
        }
        const SoupVertex& known = vertices_[slot];
        if (known.height != v.height) {
            flaw_ = "two heights at " + name(known) + " and " + name(v);
        } else if (offset_bits(known) != offset_bits(v)) {
            flaw_ = "two offsets at " + name(known) + " and " + name(v);
        }
        return slot;
    }

    std::uint32_t& find(const LatticePoint& point) {
        const std::size_t mask = table_.size() - 1;
        std::size_t at = hash(point) & mask;
        while (table_[at] != kNone && vertices_[table_[at]].point != point) at = (at + 1) & mask;
        return table_[at];
    }

    void grow(std::size_t size) {
        table_.assign(size, kNone);
        for (std::uint32_t i = 0; i < vertices_.size(); ++i) find(vertices_[i].point) = i;
    }

    // Lists the edges by their lower vertex: each entry is the other one, and a bit for the direction.
    void check_edges() {
        std::vector<std::uint32_t> first(vertices_.size() + 2, 0);
        const auto for_all_edges = [&](auto use) {
            for (const std::array<std::uint32_t, 3>& t : triangles_) {
                for (std::size_t i = 0; i < 3; ++i) {
                    const std::uint32_t a = t[i], b = t[(i + 1) % 3];
                    use(std::min(a, b), std::max(a, b) << 1 | (a < b ? 0u : 1u));
                }
            }
        };
        for_all_edges([&](std::uint32_t lower, std::uint32_t) { ++first[lower + 2]; });
        std::partial_sum(first.begin(), first.end(), first.begin());
        std::vector<std::uint32_t> edges(3 * triangles_.size());
        for_all_edges(
            [&](std::uint32_t lower, std::uint32_t other) { edges[first[lower + 1]++] = other; });
        for (std::uint32_t v = 0; v < vertices_.size() && flaw_.empty(); ++v) {
            const auto begin = edges.begin() + first[v], end = edges.begin() + first[v + 1];
            std::sort(begin, end);
            for (auto edge = begin; edge != end && flaw_.empty();) {
                const auto next =
                    std::find_if(edge, end, [&](std::uint32_t e) { return e >> 1 != *edge >> 1; });
                check_edge(vertices_[v], vertices_[*edge >> 1], next - edge, *edge != *(next - 1));
                edge = next;
            }
        }
    }

    void check_edge(const SoupVertex& a, const SoupVertex& b, std::ptrdiff_t uses,
                    bool is_used_both_ways) {
        const bool on_border = (a.point.x == b.point.x &&
                                (a.point.x == lattice_.west() || a.point.x == lattice_.east())) ||
                               (a.point.y == b.point.y &&
                                (a.point.y == lattice_.south() || a.point.y == lattice_.north()));
        if (on_border ? uses == 1 : uses == 2 && is_used_both_ways) return;
        flaw_ = "edge " + name(a) + " - " + name(b) + " is used " + std::to_string(uses) +
                (uses == 2 && !is_used_both_ways ? " times in one direction" : " times");
    }

    void check_area() {
        const auto side = static_cast<std::uint64_t>(lattice_.chunk_side(0));
        ExactArea whole;
        whole.add(2 * side * side, static_cast<std::uint64_t>(lattice_.root_count_x) *
                                       static_cast<std::uint64_t>(lattice_.root_count_y));
        if (area_ == whole) return;
        flaw_ = "the triangles cover " + std::to_string(area_.value()) + " of " +
                std::to_string(whole.value());
    }

    Lattice lattice_;
    std::vector<SoupVertex> vertices_;
    std::vector<std::uint32_t> table_;  // into vertices_, open addressing
    std::vector<std::array<std::uint32_t, 3>> triangles_;
    ExactArea area_;
    std::string flaw_;
};

}  // namespace

WorldPos displayed(const SoupVertex& vertex, const Lattice& lattice) {
    return {
        lattice.x(vertex.point.x), lattice.y(vertex.point.y),
        lattice.quantum * static_cast<double>(vertex.height) + static_cast<double>(vertex.offset)};
}

std::vector<SoupTriangle> make_soup(const TerrainMesh& mesh) {
    std::vector<SoupTriangle> soup;
    soup.reserve(mesh.triangle_count);
    for (const MeshChunk& part : mesh.chunks) {
        for (std::size_t i = 0; i < part.index_count; i += 3) {
            soup.push_back(triangle_at(mesh, part, i));
        }
    }
    return soup;
}

std::string find_flaw(const std::vector<SoupTriangle>& soup, const Lattice& lattice) {
    FlawFinder finder(lattice, soup.size());
    for (const SoupTriangle& triangle : soup) finder.add(triangle);
    return finder.finish();
}

std::string find_flaw(const TerrainMesh& mesh) {
    FlawFinder finder(mesh.resident->window(), mesh.triangle_count);
    std::size_t index_count = 0;
    for (const MeshChunk& part : mesh.chunks) {
        if (part.index_count % 3 != 0 || part.first_index > mesh.indices.size() ||
            part.index_count > mesh.indices.size() - part.first_index) {
            return "a chunk's indices are no part of the mesh's";
        }
        index_count += part.index_count;
        for (std::size_t i = 0; i < part.index_count; ++i) {
            if (mesh.indices[part.first_index + i] >= kChunkSamples * kChunkSamples) {
                return "an index names no sample";
            }
        }
        for (std::size_t i = 0; i < part.index_count; i += 3) {
            finder.add(triangle_at(mesh, part, i));
        }
    }
    if (index_count != 3 * mesh.triangle_count) return "the mesh miscounts its triangles";
    return finder.finish();
}

}  // namespace terrane::test
