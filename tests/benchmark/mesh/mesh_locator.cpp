// SPDX-License-Identifier: MIT
#include "mesh_locator.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

namespace terrane::bench {
namespace {

// Twice the signed area of a, b and a place.
double cross(const LatticePoint& a, const LatticePoint& b, double x, double y) {
    return static_cast<double>(b.x - a.x) * (y - static_cast<double>(a.y)) -
           (x - static_cast<double>(a.x)) * static_cast<double>(b.y - a.y);
}

std::int64_t squared(const LatticePoint& a, const LatticePoint& b) {
    return (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y);
}

int sign(std::int64_t value) { return (value > 0 ? 1 : 0) - (value < 0 ? 1 : 0); }

}  // namespace

// The middle of the longest edge, twice, and where the apex lies from it: enough to name a triangle
// of a bisection. 28 bits hold coordinates below 2^26; the 4 low bits are never all 0.
std::uint64_t MeshLocator::key_of(const LatticePoint& apex, const LatticePoint& left,
                                  const LatticePoint& right) {
    constexpr std::uint64_t kMask = (std::uint64_t{1} << 28) - 1;
    const std::int64_t x = left.x + right.x, y = left.y + right.y;
    const int side = 3 * (sign(2 * apex.y - y) + 1) + sign(2 * apex.x - x) + 1;
    return ((static_cast<std::uint64_t>(x) & kMask) << 36) |
           ((static_cast<std::uint64_t>(y) & kMask) << 8) | static_cast<std::uint64_t>(side + 1);
}

MeshLocator::Corner MeshLocator::corner(const MeshChunk& part, std::uint32_t index) const {
    const std::uint16_t sample = mesh_.indices[index];
    const Chunk& chunk = *part.chunk;
    return {{chunk.corner.x + (sample % kChunkSamples) * chunk.step,
             chunk.corner.y + (sample / kChunkSamples) * chunk.step},
            part.displayed_height(sample, lattice_.quantum)};
}

MeshLocator::MeshLocator(const TerrainMesh& mesh, const Lattice& lattice)
    : mesh_(mesh), lattice_(lattice) {
    table_.resize(std::bit_ceil(2 * mesh.triangle_count + 2));
    for (std::uint32_t p = 0; p < mesh.chunks.size(); ++p) {
        const MeshChunk& part = mesh.chunks[p];
        for (std::uint32_t i = 0; i + 2 < part.index_count; i += 3) {
            const std::uint32_t first = part.first_index + i;
            std::array<LatticePoint, 3> at;
            for (std::uint32_t k = 0; k < 3; ++k) at[k] = corner(part, first + k).point;
            std::size_t apex = 0;  // across from the longest edge
            for (std::size_t k = 1; k < 3; ++k) {
                if (squared(at[(k + 1) % 3], at[(k + 2) % 3]) >
                    squared(at[(apex + 1) % 3], at[(apex + 2) % 3])) {
                    apex = k;
                }
            }
            const LatticePoint &left = at[(apex + 1) % 3], &right = at[(apex + 2) % 3];
            if (squared(at[apex], left) != squared(at[apex], right) ||
                2 * squared(at[apex], left) != squared(left, right)) {
                ++stray_count_;
                continue;
            }
            insert({key_of(at[apex], left, right), p, first});
        }
    }
}

void MeshLocator::insert(const Found& found) {
    std::size_t at = found.key * 0x9e3779b97f4a7c15u >> 20;
    for (;; ++at) {
        Found& slot = table_[at & (table_.size() - 1)];
        if (slot.key == found.key) ++stray_count_;
        if (slot.key != 0 && slot.key != found.key) continue;
        slot = found;
        return;
    }
}

const MeshLocator::Found* MeshLocator::find(std::uint64_t key) const {
    std::size_t at = key * 0x9e3779b97f4a7c15u >> 20;
    for (;; ++at) {
        const Found& slot = table_[at & (table_.size() - 1)];
        if (slot.key == key) return &slot;
        if (slot.key == 0) return nullptr;
    }
}

std::optional<double> MeshLocator::displayed_height(double x, double y) const {
    const double u = (x - lattice_.origin_x) / lattice_.spacing;
    const double v = (y - lattice_.origin_y) / lattice_.spacing;
    const std::int64_t side = lattice_.chunk_side(0);
    const auto root = [&](double place, std::int32_t first, std::int32_t count) {
        const auto at = static_cast<std::int64_t>(std::floor(place / static_cast<double>(side)));
        return std::clamp<std::int64_t>(at, first, first + count - 1);
    };
    const std::int64_t column = root(u, lattice_.first_root_x, lattice_.root_count_x);
    const std::int64_t row = root(v, lattice_.first_root_y, lattice_.root_count_y);
    const LatticePoint sw{column * side, row * side}, ne{sw.x + side, sw.y + side};
    const LatticePoint se{ne.x, sw.y}, nw{sw.x, ne.y};
    LatticePoint apex, left, right;  // clockwise
    if (cut_to_north_east(column, row)) {
        const bool is_south = cross(sw, ne, u, v) <= 0.0;
        apex = is_south ? se : nw;
        left = is_south ? sw : ne;
        right = is_south ? ne : sw;
    } else {
        const bool is_south = cross(se, nw, u, v) >= 0.0;
        apex = is_south ? sw : ne;
        left = is_south ? nw : se;
        right = is_south ? se : nw;
    }
    for (;;) {
        if (const Found* found = find(key_of(apex, left, right))) {
            const MeshChunk& part = mesh_.chunks[found->part];
            std::array<Corner, 3> at;
            for (std::uint32_t k = 0; k < 3; ++k) at[k] = corner(part, found->first_index + k);
            const double doubled =
                cross(at[0].point, at[1].point, static_cast<double>(at[2].point.x),
                      static_cast<double>(at[2].point.y));
            const double one = cross(at[2].point, at[0].point, u, v) / doubled;
            const double two = cross(at[0].point, at[1].point, u, v) / doubled;
            return at[0].height + one * (at[1].height - at[0].height) +
                   two * (at[2].height - at[0].height);
        }
        if (((left.x + right.x) & 1) != 0 || ((left.y + right.y) & 1) != 0) return std::nullopt;
        const LatticePoint middle{(left.x + right.x) / 2, (left.y + right.y) / 2};
        const bool is_left = cross(middle, apex, u, v) <= 0.0;
        (is_left ? right : left) = is_left ? left : right;
        (is_left ? left : right) = apex;
        apex = middle;
    }
}

}  // namespace terrane::bench
