// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/scene/scene.h>
#include <terrane/terrain/aabb.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// Most objects of a cluster: the unit of the hierarchy of bounding volumes.
inline constexpr std::size_t kClusterObjects = 256;

/// Neighbouring objects of one model, as arrays.
struct ObjectCluster {
    std::uint32_t model = 0;
    std::uint64_t order = 0;                   ///< among the clusters of a scene
    std::size_t tree_index = 0;                ///< in the hierarchy that has it
    WorldPos origin_world = WorldPos::Zero();  ///< of the offsets
    Aabb bounds_world;
    float most_log_scale = 0.0f;  ///< largest of log_scale
    float most_radius = 0.0f;     ///< largest of radius
    std::vector<float> x, y,
        z;  ///< [objects] centre of the bounding sphere minus the origin, metres
    std::vector<float> radius;               ///< [objects] of the bounding sphere, metres
    std::vector<float> log_scale;            ///< [objects] log2_of(scale)
    std::vector<std::uint32_t> group_index;  ///< [objects] in the group
    std::vector<ObjectInstance> instances;   ///< [objects] offset_eye from the origin; coverage 1

    std::size_t size() const { return x.size(); }
};

/// Rotation matrix of a quaternion of any length near 1; orthonormal up to rounding.
Eigen::Matrix3d rotation_of(const std::array<float, 4>& quaternion);

/// Splits objects into clusters of neighbours. Deterministic.
///
/// @param bounds of the model's mesh, in the object's frame
std::vector<ObjectCluster> make_clusters(std::uint32_t model, const Aabb& bounds,
                                         std::span<const PlacedObject> objects);

}  // namespace terrane::internal
