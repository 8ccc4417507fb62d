// SPDX-License-Identifier: MIT
#include "base/aabb_tree.h"
#include "contour/tile_contour.h"
#include "level_set/placed_shape.h"
#include "level_set/tile_level_set.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <unordered_map>

namespace terrane::internal {
namespace {

/// Largest number of operations over a tile that are examined: with more, few boxes have a single part near them, and a
/// dig would take longer.
constexpr std::size_t kMostOperations = 64;
/// Cells along the side of a box.
constexpr int kBoxCells = 4;
/// Number of layers from the heightfield beyond which its slope does not make tetrahedra longer; includes a margin.
constexpr std::int32_t kLayersFromGround = 4;
/// Diameter of the tetrahedra beyond these layers, and squared radius of their smallest enclosing ball, in spacings.
constexpr double kDiameter = 1.7321, kBallSquared = 3.0 / 8.0 * kDiameter * kDiameter;
/// Largest error bound that is reported, in spacings: the bound does not examine the interpolant farther away.
constexpr double kMostError = 0.5;
/// Largest distance by which vertices are kept from the ends of their edges, plus the rounding of distances, spacings.
constexpr double kMoved = 0x1p-8 * kDiameter + 3e-4;
/// Largest distance of relevant nodes from the single part, in spacings: less than the level set's band.
constexpr double kNodeDistance = kDiameter + 2.0 * kMostError;
static_assert(kNodeDistance < kBandSpacings);
/// Cosine of the largest bend of a tube.
constexpr double kLeastBendCosine = 0.5;

/// A box of triangles of a contour.
struct Cluster {
    Aabb box = empty_box();
    bool is_near_ground = false;
};

/// Lowest and highest sample in the 5 x 5 lines around each line of a tile, in layers.
class GroundLayers {
public:
    explicit GroundLayers(const VolumeTile& tile)
        : column_(tile.key().column * kVolumeTileCells),
          row_(tile.key().row * kVolumeTileCells),
          lowest_(kTileLines),
          highest_(kTileLines) {
        std::vector<std::int32_t> surface(kTileLines);
        for (int line = 0; line < kTileLines; ++line) {
            const double z = tile.ground(line % kVolumeTileSamples, line / kVolumeTileSamples).z();
            surface[static_cast<std::size_t>(line)] =
                static_cast<std::int32_t>(std::floor(z / tile.spacing() + 0.5));
        }
        for (int line = 0; line < kTileLines; ++line) {
            const int column = line % kVolumeTileSamples, row = line / kVolumeTileSamples;
            const auto l = static_cast<std::size_t>(line);
            lowest_[l] = highest_[l] = surface[l];
            for (int y = std::max(row - 2, 0); y <= std::min(row + 2, kVolumeTileSamples - 1);
                 ++y) {
                for (int x = std::max(column - 2, 0);
                     x <= std::min(column + 2, kVolumeTileSamples - 1); ++x) {
                    const std::int32_t m = surface[static_cast<std::size_t>(line_index(x, y))];
                    lowest_[l] = std::min(lowest_[l], m);
                    highest_[l] = std::max(highest_[l], m);
                }
            }
        }
    }
    bool is_near(const VolumeNode& node) const {
        const auto line = static_cast<std::size_t>(
            line_index(static_cast<int>(node.column - column_), static_cast<int>(node.row - row_)));
        return node.k >= lowest_[line] - kLayersFromGround &&
               node.k <= highest_[line] + kLayersFromGround;
    }

private:
    std::int64_t column_, row_;
    std::vector<std::int32_t> lowest_, highest_;
};

/// Bounds the error in boxes that only a single part of a shape is near.
class PieceError {
public:
    /// @param around union of all boxes to be bounded
    PieceError(std::span<const PlacedVolume* const> operations, const Aabb& around, double spacing)
        : spacing_(spacing) {
        for (const PlacedVolume* operation : operations) {
            const PlacedShape& shape = operation->shape();
            ShapeTraversal& traversal = traversals_.emplace_back(shape, kBandSpacings * spacing);
            shapes_.push_back(std::get_if<ExactShape>(&shape.kind()));
            traversal.enter(widened(around));
        }
    }

    /// Bound over a box, metres; absent if none is known, such as if several parts or a sampled shape are near.
    std::optional<double> bound(const Aabb& box) {
        centre_ = 0.5 * (box.low + box.high);
        const Eigen::Vector3d half = 0.5 * (box.high - box.low);
        reach_ = std::sqrt(dot(half, half)) + (kDiameter + kMostError) * spacing_;
        const ExactShape* only = nullptr;
        parts_.clear();
        for (std::size_t i = 0; i < traversals_.size(); ++i) {
            const std::size_t before = parts_.size();
            const bool is_near = traversals_[i].enter(widened(box)) == BoxSide::near;
            const bool is_known = !is_near || visit_parts(i);
            traversals_[i].leave();
            if (!is_known) return std::nullopt;
            if (parts_.size() == before) continue;
            if (only != nullptr) return std::nullopt;
            only = shapes_[i];
        }
        if (only == nullptr) return std::nullopt;
        const std::optional<double> error =
            only->boxes.empty() ? of_tube(*only) : of_box(only->boxes.front());
        if (!error) return std::nullopt;
        const double with_moves = (*error + kMoved) * (1.0 + 1e-9);
        if (with_moves > kMostError) return std::nullopt;
        return with_moves * spacing_;
    }

private:
    // Centre and half extents of a box, widened to include all relevant nodes.
    NodeBox widened(const Aabb& box) const {
        const Eigen::Vector3d more = Eigen::Vector3d::Constant((kDiameter + kMostError) * spacing_);
        return {0.5 * (box.low + box.high), 0.5 * (box.high - box.low) + more};
    }

    // Appends the parts of a shape that may be near; false for a sampled shape.
    bool visit_parts(std::size_t i) {
        if (shapes_[i] == nullptr) return false;
        for (const std::uint32_t part : traversals_[i].parts()) {
            const double distance = shapes_[i]->part_distance(part, centre_);
            if (std::abs(distance) <= reach_ + kNodeDistance * spacing_) parts_.push_back(part);
        }
        return true;
    }

    // Bound for one capsule, or for two consecutive ones, in spacings.
    std::optional<double> of_tube(const ExactShape& shape) const {
        std::array<std::uint32_t, 2> pieces{};
        std::size_t count = 0;
        for (const std::uint32_t part : parts_) {
            if (is_beyond_joint(shape, part)) continue;
            if (count == 2) return std::nullopt;
            pieces[count++] = part;
        }
        if (count == 0) return std::nullopt;
        const CapsulePart& a = shape.capsules[pieces[0]];
        const double flatness = a.radius / spacing_ - kNodeDistance;
        if (!(flatness > 0.0)) return std::nullopt;
        const double curved = 0.5 * kBallSquared / flatness;
        if (count == 1) return curved;
        if (pieces[1] != pieces[0] + 1) return std::nullopt;
        const CapsulePart& b = shape.capsules[pieces[1]];
        const double length_a = std::sqrt(dot(a.along, a.along)),
                     length_b = std::sqrt(dot(b.along, b.along));
        const double cosine = dot(a.along, b.along) / (length_a * length_b);
        if (!(cosine >= kLeastBendCosine)) return std::nullopt;
        // With a shorter segment, its far end may be the nearest point, where the jump of the gradient is larger.
        const double sine = std::sqrt(std::max(1.0 - cosine * cosine, 0.0));
        const double farthest = a.radius + kNodeDistance * spacing_;
        if (!(std::min(length_a, length_b) > farthest * sine)) return std::nullopt;
        // In a tetrahedron across the crease, the value of one function at nodes on the other's side is too large by at
        // most j t + h t^2 at a distance t from the crease, where j is the jump of the gradient and h bounds the second
        // derivatives. The smaller of the two mean excesses is at most j e / 4 + 3/8 h e^2 / 3, for the diameter e.
        const double jump = 2.0 * std::sqrt(std::max(0.5 * (1.0 - cosine), 0.0));
        return (5.0 / 3.0 * curved + 0.25 * kDiameter * jump) / cosine;
    }

    // Position of the centre along a capsule, from its first end, metres; absent for a sphere.
    std::optional<double> along(const ExactShape& shape, std::uint32_t part) const {
        const CapsulePart& capsule = shape.capsules[part];
        const double length = std::sqrt(dot(capsule.along, capsule.along));
        if (!(length > 0.0)) return std::nullopt;
        return dot(centre_ - capsule.from_world, capsule.along) / length;
    }
    bool is_active(std::uint32_t part) const { return std::ranges::binary_search(parts_, part); }

    // Whether the first end of a capsule is its nearest point to the whole box, and the previous capsule, which shares
    // this end, is active.
    bool is_before(const ExactShape& shape, std::uint32_t part) const {
        const std::optional<double> at = along(shape, part);
        return at && *at < -reach_ && part > 0 && is_active(part - 1);
    }

    // The same for either end. The neighbour's distance is then nowhere larger, so the capsule is irrelevant. If this
    // holds for both capsules at a joint, the first one is kept.
    bool is_beyond_joint(const ExactShape& shape, std::uint32_t part) const {
        if (is_before(shape, part)) return true;
        const std::optional<double> at = along(shape, part);
        const CapsulePart& capsule = shape.capsules[part];
        const double length = std::sqrt(dot(capsule.along, capsule.along));
        return at && *at > length + reach_ && is_active(part + 1) && !is_before(shape, part + 1);
    }

    // Bound beside a single face of a box, in spacings; absent unless all relevant nodes are on that face's side of the
    // middle plane.
    std::optional<double> of_box(const BoxPart& box) const {
        const Eigen::Vector3d p = rotated_back(box.world_from_box, centre_ - box.centre_world);
        int near_count = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const double beyond = std::abs(p[axis]) - box.half_extents[axis];
            if (!(beyond > -(reach_ + kNodeDistance * spacing_))) continue;
            ++near_count;
            if (!(box.half_extents[axis] > kNodeDistance * spacing_)) return std::nullopt;
        }
        if (near_count != 1) return std::nullopt;
        return 0.0;
    }

    double spacing_;
    std::vector<ShapeTraversal> traversals_;
    std::vector<const ExactShape*> shapes_;  // null: sampled
    Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
    double reach_ = 0.0;                // from the centre to the relevant nodes, metres
    std::vector<std::uint32_t> parts_;  // near the box, ascending
};

}  // namespace

ContourErrors bound_errors(const VolumeContour& contour, const VolumeTile& tile,
                           std::span<const PlacedVolume* const> operations) {
    ContourErrors errors;
    if (contour.triangles.empty()) return errors;
    const GroundLayers ground(tile);
    std::vector<Cluster> clusters;
    std::unordered_map<std::uint64_t, std::uint32_t> cluster_of;  // never iterated
    errors.box_of.reserve(contour.triangles.size());
    std::uint64_t last_code = ~std::uint64_t{0};
    std::uint32_t last = 0;
    const std::int64_t west = tile.key().column * kVolumeTileCells,
                       south = tile.key().row * kVolumeTileCells;
    for (std::size_t t = 0; t < contour.triangles.size(); ++t) {
        const VolumeNode& node = contour.keys[contour.triangles[t][0]].first;
        const auto block = [](std::int64_t i) {
            return static_cast<std::uint64_t>(i + (std::int64_t{1} << 31)) / kBoxCells;
        };
        const std::uint64_t code = block(node.column - west) % 64 |
                                   block(node.row - south) % 64 << 6 | block(node.k) << 12;
        if (code != last_code) {
            last = cluster_of.try_emplace(code, static_cast<std::uint32_t>(clusters.size()))
                       .first->second;
            if (last == clusters.size()) clusters.emplace_back();
            last_code = code;
        }
        errors.box_of.push_back(last);
        Cluster& cluster = clusters[last];
        cluster.is_near_ground |= contour.surfaces[t] == SolidPart::ground;
        for (const std::uint32_t corner : contour.triangles[t]) {
            include(contour.positions_world[corner], 0.0, cluster.box);
            const VolumeVertexKey& key = contour.keys[corner];
            cluster.is_near_ground |= ground.is_near(key.first) || ground.is_near(key.second);
        }
    }
    Aabb around = empty_box();
    for (const Cluster& cluster : clusters) {
        include(cluster.box.low, 0.0, around);
        include(cluster.box.high, 0.0, around);
    }
    if (operations.size() > kMostOperations) operations = {};
    PieceError pieces(operations, around, tile.spacing());
    errors.boxes.reserve(clusters.size());
    for (const Cluster& cluster : clusters) {
        std::optional<double> bound;
        if (!cluster.is_near_ground) bound = pieces.bound(cluster.box);
        errors.boxes.push_back(
            {cluster.box, std::min(bound.value_or(contour.error_m), contour.error_m)});
    }
    return errors;
}

}  // namespace terrane::internal
