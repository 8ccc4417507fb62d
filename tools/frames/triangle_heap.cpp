// SPDX-License-Identifier: MIT
#include "frames/triangle_heap.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <utility>

namespace terrane::tools {
namespace {

std::uint64_t hash(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
    std::uint64_t h = a * 0x9e3779b97f4a7c15u;
    h = (h ^ (h >> 32) ^ b) * 0xc2b2ae3d27d4eb4fu;
    h = (h ^ (h >> 29) ^ c) * 0xff51afd7ed558ccdu;
    return h ^ (h >> 32);
}

std::int64_t cell_of(double value, double cell) {
    return static_cast<std::int64_t>(std::floor(value / cell));
}

// Index of the list of a cell of the grid of one size class. The cells of an 8 x 8 block are adjacent in memory,
// because queries are spatially coherent.
std::size_t list_of(std::size_t size, std::int64_t column, std::int64_t row, std::size_t mask) {
    const std::uint64_t square =
        hash(size, static_cast<std::uint64_t>(column >> 3), static_cast<std::uint64_t>(row >> 3));
    const auto cell = static_cast<std::uint64_t>(((row & 7) << 3) | (column & 7));
    return static_cast<std::size_t>((square << 6) | cell) & mask;
}

std::size_t hash_of(double x, double y) {
    return static_cast<std::size_t>(
        hash(std::bit_cast<std::uint64_t>(x), std::bit_cast<std::uint64_t>(y), 0));
}

// Size class: exponent of the least power of two above the sides of the triangle's bounding rectangle.
int size_of(const TriangleHeap::Triangle& t) {
    const auto [west, east] = std::minmax({t.a.x(), t.b.x(), t.c.x()});
    const auto [south, north] = std::minmax({t.a.y(), t.b.y(), t.c.y()});
    const double side = std::max(east - west, north - south);
    return side > 0.0 ? std::ilogb(side) + 1 : 0;
}

}  // namespace

TriangleHeap TriangleHeap::from(const TerrainMesh& mesh) {
    std::vector<Triangle> triangles;
    triangles.reserve(mesh.triangle_count);
    for (const MeshChunk& part : mesh.chunks) {
        const Chunk& chunk = *part.chunk;
        const Lattice& lattice = mesh.resident->lattice();
        const auto place = [&](std::uint16_t index) {
            const std::int64_t column = index % kChunkSamples;
            const std::int64_t row = index / kChunkSamples;
            return WorldPos(lattice.x(chunk.corner.x + column * chunk.step),
                            lattice.y(chunk.corner.y + row * chunk.step),
                            part.displayed_height(index, lattice.quantum));
        };
        for (std::uint32_t i = 0; i < part.index_count; i += 3) {
            const std::uint16_t* corner = mesh.indices.data() + part.first_index + i;
            triangles.push_back({place(corner[0]), place(corner[1]), place(corner[2])});
        }
    }
    return TriangleHeap(std::move(triangles));
}

TriangleHeap::TriangleHeap(std::vector<Triangle> triangles) : triangles_(std::move(triangles)) {
    list_triangles();
    list_vertices();
}

// Counts the entries of each list, then fills them.
void TriangleHeap::list_triangles() {
    std::vector<int> exponents;
    for (const Triangle& t : triangles_) {
        const int exponent = size_of(t);
        if (std::find(exponents.begin(), exponents.end(), exponent) == exponents.end()) {
            exponents.push_back(exponent);
        }
    }
    std::sort(exponents.begin(), exponents.end());
    for (const int exponent : exponents) cells_.push_back(std::ldexp(1.0, exponent));

    const std::size_t list_count = std::bit_ceil(2 * triangles_.size() + 1);
    const auto for_all_entries = [&](auto use) {
        for (std::size_t i = 0; i < triangles_.size(); ++i) {
            const Triangle& t = triangles_[i];
            const auto size = static_cast<std::size_t>(
                std::lower_bound(exponents.begin(), exponents.end(), size_of(t)) -
                exponents.begin());
            const double cell = cells_[size];
            const auto [west, east] = std::minmax({t.a.x(), t.b.x(), t.c.x()});
            const auto [south, north] = std::minmax({t.a.y(), t.b.y(), t.c.y()});
            for (std::int64_t row = cell_of(south, cell); row <= cell_of(north, cell); ++row) {
                for (std::int64_t column = cell_of(west, cell); column <= cell_of(east, cell);
                     ++column) {
                    use(list_of(size, column, row, list_count - 1), static_cast<std::uint32_t>(i));
                }
            }
        }
    };
    first_.assign(list_count + 2, 0);
    for_all_entries([&](std::size_t list, std::uint32_t) { ++first_[list + 2]; });
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    lists_.resize(first_.back());
    for_all_entries(
        [&](std::size_t list, std::uint32_t triangle) { lists_[first_[list + 1]++] = triangle; });
    first_.pop_back();
}

void TriangleHeap::list_vertices() {
    table_.assign(std::bit_ceil(6 * triangles_.size() + 1), kNone);
    for (const Triangle& t : triangles_) {
        for (const WorldPos* corner : {&t.a, &t.b, &t.c}) {
            const std::size_t at = find_slot(corner->x(), corner->y());
            if (table_[at] != kNone) continue;
            table_[at] = static_cast<std::uint32_t>(vertices_.size());
            vertices_.push_back(*corner);
        }
    }
}

std::size_t TriangleHeap::find_slot(double x, double y) const {
    const std::size_t mask = table_.size() - 1;
    for (std::size_t at = hash_of(x, y) & mask;; at = (at + 1) & mask) {
        if (table_[at] == kNone) return at;
        const WorldPos& known = vertices_[table_[at]];
        if (known.x() == x && known.y() == y) return at;
    }
}

std::optional<double> TriangleHeap::vertex_height(double x, double y) const {
    const std::uint32_t vertex = table_[find_slot(x, y)];
    return vertex == kNone ? std::nullopt : std::optional<double>(vertices_[vertex].z());
}

std::optional<double> TriangleHeap::height(double x, double y) const {
    std::optional<double> highest;
    const std::size_t mask = first_.size() - 2;
    for (std::size_t size = 0; size < cells_.size(); ++size) {
        const std::size_t list =
            list_of(size, cell_of(x, cells_[size]), cell_of(y, cells_[size]), mask);
        for (std::uint32_t i = first_[list]; i < first_[list + 1]; ++i) {
            const Triangle& t = triangles_[lists_[i]];
            const double bx = t.b.x() - t.a.x(), by = t.b.y() - t.a.y();
            const double cx = t.c.x() - t.a.x(), cy = t.c.y() - t.a.y();
            const double px = x - t.a.x(), py = y - t.a.y();
            const double area = bx * cy - by * cx;
            if (area == 0.0) continue;
            const double u = (px * cy - py * cx) / area;
            const double v = (bx * py - by * px) / area;
            constexpr double kSlack = 1e-9;  // relative: a point on an edge is in both triangles
            if (u < -kSlack || v < -kSlack || u + v > 1.0 + kSlack) continue;
            const double z = t.a.z() + u * (t.b.z() - t.a.z()) + v * (t.c.z() - t.a.z());
            highest = std::max(highest.value_or(z), z);
        }
    }
    return highest;
}

}  // namespace terrane::tools
