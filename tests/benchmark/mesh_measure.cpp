// SPDX-License-Identifier: MIT
#include "benchmark/mesh_measure.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace terrane::bench {
namespace {

std::span<const std::uint16_t> indices_of(const TerrainMesh& mesh, const MeshChunk& part) {
    return mesh.indices.subspan(part.first_index, part.index_count);
}

std::string name(const ChunkKey& key) {
    return "chunk (" + std::to_string(key.x) + ", " + std::to_string(key.y) + ") of level " +
           std::to_string(key.level);
}

// Where nothing of a chunk morphs, "no offsets" says the same as offsets of zero.
float offset_of(const MeshChunk& part, std::uint16_t sample) {
    return part.offsets == nullptr ? 0.0f : part.offsets[sample];
}

}  // namespace

MeshCopy::MeshCopy(const TerrainMesh& mesh)
    : parts(mesh.chunks.begin(), mesh.chunks.end()),
      indices(mesh.indices.begin(), mesh.indices.end()),
      offsets(parts.size()),
      numbers_(mesh) {
    constexpr std::size_t kSamples = std::size_t{kChunkSamples} * kChunkSamples;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        MeshChunk& part = parts[i];
        if (part.offsets == nullptr) continue;
        offsets[i].assign(kSamples, 0.0f);
        for (const std::uint16_t sample : indices_of(mesh, part)) {
            offsets[i][sample] = part.offsets[sample];
        }
        part.offsets = offsets[i].data();
    }
}

TerrainMesh MeshCopy::view() const {
    TerrainMesh mesh = numbers_;
    mesh.chunks = parts;
    mesh.indices = indices;
    return mesh;
}

std::string find_difference(const TerrainMesh& a, const TerrainMesh& b) {
    if (a.triangle_count != b.triangle_count) {
        return std::to_string(a.triangle_count) + " and " + std::to_string(b.triangle_count) +
               " triangles";
    }
    if (a.status != b.status) return "two statuses";
    if (std::bit_cast<std::uint64_t>(a.error_px) != std::bit_cast<std::uint64_t>(b.error_px)) {
        return "error_px " + std::to_string(a.error_px) + " and " + std::to_string(b.error_px);
    }
    if (a.chunks.size() != b.chunks.size()) return "another number of chunks";
    for (std::size_t i = 0; i < a.chunks.size(); ++i) {
        const MeshChunk &from = a.chunks[i], &to = b.chunks[i];
        if (from.chunk != to.chunk) return "another order of chunks";
        const auto used = indices_of(a, from), others = indices_of(b, to);
        if (!std::ranges::equal(used, others)) return "other indices in " + name(from.chunk->key);
        for (const std::uint16_t sample : used) {
            if (std::bit_cast<std::uint32_t>(offset_of(from, sample)) !=
                std::bit_cast<std::uint32_t>(offset_of(to, sample))) {
                return "another offset of sample " + std::to_string(sample) + " in " +
                       name(from.chunk->key);
            }
        }
    }
    return "";
}

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

namespace {

constexpr int kMostCells = 8;   // of a triangle's width, with 4 x 4 points each
constexpr int kMostParts = 64;  // of a leg
constexpr int kFractalParts = 12;
constexpr std::size_t kRefined = 256;
constexpr int kRefinement = 4, kFractalRefinement = 8;

/// A displayed triangle; the parts of a table's triangle meet all samples inside it where they are
/// a multiple of twice its width.
struct Shown {
    std::array<Eigen::Vector3d, 3> corners;
    std::int64_t width = 0;  ///< of its longest side along an axis, finest spacings
};

template <class Visit>
void for_each_triangle(const TerrainMesh& mesh, const Visit& visit) {
    const Lattice& lattice = mesh.resident->lattice();
    for (const MeshChunk& part : mesh.chunks) {
        const Chunk& chunk = *part.chunk;
        for (std::uint32_t i = 0; i < part.index_count; i += 3) {
            Shown shown;
            std::array<std::int64_t, 3> xs{}, ys{};
            for (std::uint32_t k = 0; k < 3; ++k) {
                const std::uint16_t sample = mesh.indices[part.first_index + i + k];
                xs[k] = chunk.corner.x + (sample % kChunkSamples) * chunk.step;
                ys[k] = chunk.corner.y + (sample / kChunkSamples) * chunk.step;
                shown.corners[k] = {lattice.x(xs[k]), lattice.y(ys[k]),
                                    part.displayed_height(sample, lattice.quantum)};
            }
            const auto [west, east] = std::minmax_element(xs.begin(), xs.end());
            const auto [south, north] = std::minmax_element(ys.begin(), ys.end());
            shown.width = std::max(*east - *west, *north - *south);
            visit(shown);
        }
    }
}

class Eye {
public:
    Eye(const View& view, const HeightSource& source)
        : view_(view), source_(source), frustum_(make_frustum(view)) {}

    /// False where no ground over a triangle can be in view.
    bool may_see(const Shown& shown) const {
        const auto& [a, b, c] = shown.corners;
        const double size = (a - b).norm() + (b - c).norm();
        double low = std::min({a.z(), b.z(), c.z()}), high = std::max({a.z(), b.z(), c.z()});
        const WorldRect rect{std::min({a.x(), b.x(), c.x()}), std::min({a.y(), b.y(), c.y()}),
                             std::max({a.x(), b.x(), c.x()}), std::max({a.y(), b.y(), c.y()})};
        const HeightInterval truth = source_.interval(rect);
        low = std::min(low, truth.low);
        high = std::max(high, truth.high);
        const double slack = high - low + 1e-9 * size;
        return std::ranges::none_of(frustum_.normals, [&](const Eigen::Vector3d& normal) {
            return std::ranges::all_of(shown.corners, [&](const Eigen::Vector3d& corner) {
                return normal.dot(corner - view_.eye_world) < -slack;
            });
        });
    }

    /// Largest error over the corners of parts x parts of a triangle.
    double measure(const Shown& shown, int parts, std::size_t& points) const {
        const auto& [a, b, c] = shown.corners;
        double worst = 0.0;
        for (int i = 0; i <= parts; ++i) {
            for (int j = 0; i + j <= parts; ++j) {
                const double u = static_cast<double>(i) / parts, v = static_cast<double>(j) / parts;
                const Eigen::Vector3d at = a + u * (b - a) + v * (c - a);
                if (!source_.extent().contains(at.x(), at.y())) continue;
                const Eigen::Vector3d truth(at.x(), at.y(), source_.height(at.x(), at.y()));
                const Eigen::Vector3d from_eye = truth - view_.eye_world;
                bool is_inside = true;
                for (const Eigen::Vector3d& normal : frustum_.normals) {
                    is_inside = is_inside && normal.dot(from_eye) >= 0.0;
                }
                if (!is_inside) continue;
                ++points;
                worst = std::max(worst, std::abs(at.z() - truth.z()) * view_.pixels_per_radian() /
                                            std::max(view_.near_distance, from_eye.norm()));
            }
        }
        return worst;
    }

private:
    const View& view_;
    const HeightSource& source_;
    Frustum frustum_;
};

int parts_of(const Shown& shown, bool is_fractal) {
    if (is_fractal) return kFractalParts;
    if (shown.width <= kMostCells) return static_cast<int>(4 * shown.width);
    return static_cast<int>(std::min<std::int64_t>(2 * shown.width, kMostParts));
}

}  // namespace

Measured measure_densely(const TerrainMesh& mesh, const HeightSource& source, const View& view,
                         bool is_fractal) {
    struct Candidate {
        double error_px;
        Shown shown;
    };
    const Eye eye(view, source);
    Measured measured;
    std::vector<Candidate> worst;
    const auto is_worse = [](const Candidate& a, const Candidate& b) {
        return a.error_px > b.error_px;
    };
    for_each_triangle(mesh, [&](const Shown& shown) {
        if (!eye.may_see(shown)) return;
        const double error = eye.measure(shown, parts_of(shown, is_fractal), measured.points);
        measured.error_px = std::max(measured.error_px, error);
        if (worst.size() == kRefined && error <= worst.front().error_px) return;
        worst.push_back({error, shown});
        std::ranges::push_heap(worst, is_worse);
        if (worst.size() <= kRefined) return;
        std::ranges::pop_heap(worst, is_worse);
        worst.pop_back();
    });
    for (const Candidate& candidate : worst) {
        const int parts =
            (is_fractal ? kFractalRefinement : kRefinement) * parts_of(candidate.shown, is_fractal);
        measured.error_px =
            std::max(measured.error_px, eye.measure(candidate.shown, parts, measured.points));
    }
    return measured;
}

double measure_samples(const TerrainMesh& mesh, const test::TableHeights& source) {
    double worst = 0.0;
    const double spacing = source.padded().spacing;
    for_each_triangle(mesh, [&](const Shown& shown) {
        const auto& [a, b, c] = shown.corners;
        const auto parts = static_cast<int>(2 * shown.width);
        for (int i = 0; i <= parts; ++i) {
            for (int j = 0; i + j <= parts; ++j) {
                const double u = static_cast<double>(i) / parts, v = static_cast<double>(j) / parts;
                const Eigen::Vector3d at = a + u * (b - a) + v * (c - a);
                const double x = at.x() / spacing, y = at.y() / spacing;
                if (std::abs(x - std::round(x)) > 1e-6 || std::abs(y - std::round(y)) > 1e-6) {
                    continue;
                }
                worst = std::max(worst, std::abs(at.z() - source.height(at.x(), at.y())));
            }
        }
    });
    return worst;
}

}  // namespace terrane::bench
