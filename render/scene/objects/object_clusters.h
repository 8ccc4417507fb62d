// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/scene/culling.h>
#include <terrane/scene/scene_draws.h>
#include <terrane/scene/scene_nodes.h>

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

namespace terrane::internal {

/// Largest number of objects in a cluster, the unit of the bounding volume hierarchy.
inline constexpr std::size_t kClusterObjects = 256;

/// Bounds of objects, by which they are culled together.
struct ObjectBounds {
    Aabb box_world;
    float most_log_scale = 0.0f;  ///< largest of ObjectCluster::log_scale
    float most_radius = 0.0f;     ///< largest of ObjectCluster::radius
};

/// Largest number of objects in a group, the part of a cluster that is culled as a whole.
inline constexpr std::size_t kGroupObjects = 32;

/// Neighbouring objects of one model, as a structure of arrays.
struct ObjectCluster {
    /// Consecutive objects that are neighbours, up to `end`.
    struct Group {
        std::uint32_t end = 0;
        ObjectBounds bounds;
    };

    std::uint32_t model = 0;
    std::uint64_t order = 0;                   ///< order of insertion into the scene
    std::size_t tree_index = 0;                ///< index in the hierarchy that contains it
    WorldPos origin_world = WorldPos::Zero();  ///< origin of the offsets
    ObjectBounds bounds;
    std::vector<Group> groups;
    std::vector<float> x, y,
        z;  ///< [objects] centre of the bounding sphere minus the origin, metres
    std::vector<float> radius;                ///< [objects] of the bounding sphere, metres
    std::vector<float> log_scale;             ///< [objects] log2_of(scale)
    std::vector<std::uint32_t> object_index;  ///< [objects] in InstancesNode::objects
    std::vector<ObjectInstance> instances;    ///< [objects] offset_eye from the origin; coverage 1
    /// ObjectInstance::coverage of all objects while a switch above them fades; they then have one level. 1: no fade.
    float coverage = 1.0f;

    std::size_t size() const { return x.size(); }
};

/// Rotation matrix of a quaternion of any length near 1; orthonormal up to rounding.
Eigen::Matrix3d rotation_of(const std::array<float, 4>& quaternion);

/// Replaces a cluster by one object.
///
/// @param bounds of the model's mesh, in the object's frame
/// @param scale  of the object, 1e-12 to 1e12
/// Allocates: nothing if the cluster had an object
void set_single(std::uint32_t model, const Aabb& bounds, const Pose& world_from_object,
                double scale, const std::array<float, 3>& tint, ObjectCluster& cluster_out);

/// Splits objects in the world frame into clusters of neighbours. Deterministic.
///
/// @param bounds of the model's mesh, in the object's frame
std::vector<ObjectCluster> make_clusters(std::uint32_t model, const Aabb& bounds,
                                         std::span<const PlacedObject> objects);

/// The clusters of all nodes with instances, with a hierarchy over most of them. Changes are kept outside the hierarchy
/// until an eighth of the clusters has changed, so that adding or removing a node is cheap.
class ClusterSet {
public:
    /// Requires a node that is not in the set.
    void add(NodeId node, std::vector<ObjectCluster> clusters);
    /// No effect for a node that is not in the set.
    void remove(NodeId node);
    std::size_t object_count() const { return object_count_; }
    /// The clusters of a node; none for a node that is not in the set.
    std::span<const ObjectCluster> of_node(NodeId node) const {
        const auto found = nodes_.find(node);
        if (found == nodes_.end()) return {};
        return found->second;
    }

    /// Visits all clusters: void(NodeId, const ObjectCluster&), in the order of their nodes.
    template <class Visit>
    void visit(const Visit& take) const {
        for (const auto& [node, clusters] : nodes_) {
            for (const ObjectCluster& cluster : clusters) take(node, cluster);
        }
    }

    /// Replaces visible_out by the clusters in view, in the order in which they were added.
    void cull(const ViewVolume& volume, CullTest test,
              std::vector<const ObjectCluster*>& visible_out);

    /// Replaces casters_out by the clusters that meet the volume, in the same order. Call after cull() of the same
    /// frame.
    void find_casters(const CasterVolume& volume, std::vector<const ObjectCluster*>& casters_out);

private:
    void rebuild();

    std::map<NodeId, std::vector<ObjectCluster>> nodes_;
    std::size_t object_count_ = 0;
    std::uint64_t last_order_ = 0;
    std::vector<const ObjectCluster*> in_tree_;  // by index in the hierarchy; null: removed
    std::size_t gone_ = 0;
    std::vector<const ObjectCluster*> beside_;  // clusters outside the hierarchy
    std::optional<CullTree> tree_;
    CullMemory memory_;
    std::vector<std::uint32_t> visible_;  // scratch
};

}  // namespace terrane::internal
