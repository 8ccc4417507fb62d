// SPDX-License-Identifier: MIT
#pragma once

#include "objects/frame_objects.h"
#include "objects/instance_device.h"
#include "objects/level_choice.h"
#include "objects/object_clusters.h"

#include <terrane/scene/culling.h>
#include <terrane/scene/object_model.h>
#include <terrane/scene/scene_draws.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

namespace terrane::internal {

/// Instances that a device culls, and whose levels it chooses: those of models with discrete levels. The CPU culls
/// clusters and groups, and tests which objects the ground hides.
class DeviceObjects {
public:
    /// @param device null: none
    void set_device(InstanceDevice* device, std::span<const ObjectModel> models,
                    std::span<const LevelChoice> choices);
    bool has_device() const { return device_ != nullptr; }

    /// Adds a model; models are numbered in the order in which they are added.
    void add_model(const ObjectModel& model, const LevelChoice& choice);
    /// Whether the instances of a model are on the device.
    bool takes(std::uint32_t model) const { return takes_[model]; }
    /// Removes a cluster, which ends the frame.
    void remove(const ObjectCluster& cluster);

    /// Begins a frame without objects.
    void clear();
    /// Adds the groups of a cluster that are in view; arguments as in FrameObjects::add(). Fails with
    /// device_unavailable if the device has no memory for the objects of a cluster that comes into view.
    ///
    /// @param objects counts the groups that are culled
    Result<void> add(const ObjectCluster& cluster, const LevelChoice& choice,
                     const ViewVolume& volume, const HorizonMap* horizon_map,
                     FrameObjects& objects);
    /// Culls the objects of the groups. Fails as InstanceDevice::cull()
    ///
    /// @param far_distance infinite without a far plane
    Result<void> cull(const View& view, const ViewVolume& volume, double far_distance,
                      const FrameObjects& objects);
    /// Adds the factors of each model's objects. @param counts [models]
    void count_factors(std::span<FactorCounts> counts);
    const InstanceDevice::Culled& culled() const { return culled_; }

    /// Chooses the levels, and lists their draws.
    void make(std::span<const ObjectModel> models, float log2_threshold);
    /// Draws of the last make(); none without objects.
    const DeviceInstances* instances() const { return instances_; }
    std::span<const MeshDraw> meshes() const { return meshes_; }
    std::span<const ImpostorDraw> impostors() const { return impostors_; }
    std::size_t object_count() const { return object_count_; }
    std::size_t triangle_count() const { return triangle_count_; }

private:
    /// Of a model, in a frame.
    struct Groups {
        std::vector<DeviceCluster> clusters;
        std::vector<DeviceGroup> groups;
    };
    Result<std::uint32_t> first_object(const ObjectCluster& cluster);

    InstanceDevice* device_ = nullptr;
    std::vector<bool> takes_;                                         // [models]
    std::unordered_map<const ObjectCluster*, std::uint32_t> firsts_;  // objects on the device
    std::vector<DeviceObject> staging_;

    // State of the current frame.
    std::vector<Groups> of_model_;  // [models]
    std::vector<DeviceCluster> clusters_;
    std::vector<DeviceGroup> groups_;
    std::vector<std::uint32_t> group_of_model_;
    InstanceDevice::Culled culled_;
    const DeviceInstances* instances_ = nullptr;
    std::vector<MeshDraw> meshes_;
    std::vector<ImpostorDraw> impostors_;
    std::size_t object_count_ = 0, triangle_count_ = 0;
};

}  // namespace terrane::internal
