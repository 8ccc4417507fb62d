// SPDX-License-Identifier: MIT
#pragma once

#include "objects/continuous_levels.h"
#include "objects/level_choice.h"
#include "objects/object_clusters.h"

#include <terrane/scene/culling.h>
#include <terrane/scene/horizon_map.h>
#include <terrane/scene/object_model.h>
#include <terrane/scene/scene_draws.h>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace terrane::internal {

/// Bounding sphere of an object.
inline BoundingSphere sphere_of(const ObjectCluster& cluster, std::size_t object) {
    const Eigen::Vector3f offset(cluster.x[object], cluster.y[object], cluster.z[object]);
    return {cluster.origin_world + offset.cast<double>(), cluster.radius[object]};
}

/// The objects in the view of one frame, or the objects out of view that cast shadows into it.
class FrameObjects {
public:
    void clear();
    /// @param log2_least log2 of the least threshold in pixels: objects that are not drawn at it are omitted
    void begin(const View& view, float log2_least);

    /// Adds the objects of a cluster that are in view and not hidden by the ground.
    /// @param horizon_map null: no object is hidden
    void add(const ObjectCluster& cluster, const LevelChoice& choice, const ViewVolume& volume,
             const HorizonMap* horizon_map);

    /// Adds the objects of a cluster that are out of view (add() does not add them) and can cast shadows into the view.
    /// @param is_in_view whether add() has been called for the cluster
    void add_casters(const ObjectCluster& cluster, const LevelChoice& choice,
                     const ViewVolume& volume, const CasterVolume& casters, bool is_in_view);

    /// Visits the groups of a cluster that may have objects that add() adds, and counts the culled ones.
    ///
    /// @param visit void(std::size_t first, std::size_t end, std::uint8_t planes, std::uint32_t hidden): objects of the
    ///              cluster; the planes of the view that these may cross, PlaneState::mask; bits of those that the
    ///              ground hides
    template <class Visit>
    void visit_groups(const ObjectCluster& cluster, const LevelChoice& choice,
                      const ViewVolume& volume, const HorizonMap* horizon_map, const Visit& visit);

    /// What the factors are computed with.
    float near_distance() const { return near_; }
    float log2_pixels() const { return log2_pixels_; }
    float log2_least() const { return log2_least_; }

    std::size_t size() const { return object_count_; }
    /// Number of objects that are not drawn at the least threshold. If this holds for a whole group, all its objects
    /// count, in view or not.
    std::size_t left_out() const { return left_out_; }
    /// Number of objects hidden by the ground. All objects of a hidden group count, in view or not.
    std::size_t occluded() const { return occluded_; }

    /// Counts the factors of each model's objects. @param counts_out [models]
    void count_factors(std::span<FactorCounts> counts_out) const;

    /// Visits objects in the order in which they were added.
    /// @param visit void(const ObjectCluster&, const Eigen::Vector3f& origin_eye, std::size_t object, float
    ///              log2_factor)
    template <class Visit>
    void visit(const Visit& visit) const {
        for (const Range& range : ranges_) {
            for (std::size_t i = range.first; i < range.end; ++i)
                visit(*range.cluster, range.origin_eye, std::size_t{indices_[i]}, factors_[i]);
        }
    }

private:
    /// Objects of a cluster that were added.
    struct Range {
        const ObjectCluster* cluster = nullptr;
        Eigen::Vector3f origin_eye;  ///< metres
        std::size_t first = 0, end = 0;
    };

    float largest_factor(const ObjectBounds& bounds) const;
    void compute_factors(const ObjectCluster& cluster, std::size_t first, std::size_t end,
                         const Eigen::Vector3f& origin_eye);
    bool cull(const ObjectBounds& bounds, std::size_t count, const LevelChoice& choice,
              const HorizonMap* horizon_map);
    template <class MakeWanted, class Take>
    void take_groups(const ObjectCluster& cluster, const LevelChoice& choice,
                     const HorizonMap* horizon_map, const MakeWanted& make_wanted,
                     const Take& take);
    template <class MakeWanted>
    void add_where(const ObjectCluster& cluster, const LevelChoice& choice,
                   const HorizonMap* horizon_map, const MakeWanted& make_wanted);

    WorldPos eye_ = WorldPos::Zero();
    float near_ = 1.0f;
    float log2_pixels_ = 0.0f;  // per radian
    float log2_least_ = 0.0f;
    std::size_t left_out_ = 0;
    std::size_t occluded_ = 0;
    std::vector<Range> ranges_;
    std::size_t object_count_ = 0;
    std::vector<std::uint16_t> indices_;  // [objects] index in the cluster
    std::vector<float> factors_;          // [objects] log2 of pixels per metre of error at scale 1
    std::array<float, kGroupObjects> group_factors_{};
};

// Visits the groups of a cluster that are not culled as a whole.
//
// @param make_wanted for the box of a group: none if no object of it is wanted
// @param take        void(std::size_t first, std::size_t end, wanted, bool may_be_hidden): for the other groups
template <class MakeWanted, class Take>
void FrameObjects::take_groups(const ObjectCluster& cluster, const LevelChoice& choice,
                               const HorizonMap* horizon_map, const MakeWanted& make_wanted,
                               const Take& take) {
    if (cull(cluster.bounds, cluster.size(), choice, horizon_map)) return;
    std::size_t end = 0;
    for (const ObjectCluster::Group& group : cluster.groups) {
        const std::size_t first = end;
        end = group.end;
        const auto wanted = make_wanted(group.bounds.box_world);
        if (!wanted) continue;
        // a cluster with one group has been tested
        if (cluster.groups.size() > 1 && cull(group.bounds, end - first, choice, horizon_map))
            continue;
        take(first, end, *wanted,
             horizon_map != nullptr && horizon_map->may_hide_in(group.bounds.box_world));
    }
}

template <class Visit>
void FrameObjects::visit_groups(const ObjectCluster& cluster, const LevelChoice& choice,
                                const ViewVolume& volume, const HorizonMap* horizon_map,
                                const Visit& visit) {
    PlaneState around;
    volume.test_planes(cluster.bounds.box_world, around);
    const auto planes_of = [&](const Aabb& box) {
        PlaneState around_group = around;
        const Containment where = volume.test_planes(box, around_group);
        return where == Containment::outside ? std::nullopt : std::optional(around_group.mask);
    };
    take_groups(cluster, choice, horizon_map, planes_of,
                [&](std::size_t first, std::size_t end, std::uint8_t planes, bool may_be_hidden) {
                    std::uint32_t hidden = 0;
                    for (std::size_t i = first; may_be_hidden && i < end; ++i) {
                        const bool is_hidden = horizon_map->hides(sphere_of(cluster, i));
                        hidden |= std::uint32_t{is_hidden} << (i - first);
                    }
                    visit(first, end, planes, hidden);
                });
}

/// The draws of objects in a frame: one for each level of a model that is drawn.
class DrawList {
public:
    /// Adds a model; models are numbered in the order in which they are added.
    void add_model(const ObjectModel& model);

    /// Chooses the levels of the objects, and appends their instances.
    ///
    /// @param models, choices [models] that were added
    /// @param near objects whose meshes are drawn by StreamedList, in the order of their places
    void make(const FrameObjects& objects, std::span<const ObjectModel> models,
              std::span<const LevelChoice> choices, float log2_threshold,
              std::span<const NearObject> near, std::vector<ObjectInstance>& instances_out);

    /// Draws of the last make(). Objects that change levels have instances in two draws.
    std::span<const MeshDraw> meshes() const { return meshes_; }
    std::span<const ImpostorDraw> impostors() const { return impostors_; }
    /// The near objects that are drawn as meshes; meshes() and impostors() do not include their instances.
    std::span<const NearDraw> near() const { return near_; }
    std::size_t object_count() const { return object_count_; }
    std::size_t triangle_count() const { return triangle_count_; }

private:
    // Instances drawn with one call.
    struct Bucket {
        std::uint32_t model = 0, level = 0;
        std::uint32_t count = 0, first = 0;
    };

    // A near object that is drawn as a mesh.
    struct NearPlace {
        std::size_t place = 0;  // among the objects
        float coverage = 1.0f;
    };

    void choose(const FrameObjects& objects, std::span<const ObjectModel> models,
                std::span<const LevelChoice> choices, float log2_threshold,
                std::span<const NearObject> near);
    void lay_out(std::span<const ObjectModel> models, std::vector<ObjectInstance>& instances_out);
    void fill(const FrameObjects& objects, std::span<ObjectInstance> instances);

    std::vector<std::uint32_t> first_bucket_;  // [models]
    std::vector<Bucket> buckets_;              // [levels of all models]
    std::vector<ChosenLevels> chosen_;         // [objects]
    std::vector<MeshDraw> meshes_;
    std::vector<ImpostorDraw> impostors_;
    std::vector<NearDraw> near_;
    std::vector<NearPlace> near_places_;  // [near_]
    std::size_t object_count_ = 0, triangle_count_ = 0;
};

}  // namespace terrane::internal
