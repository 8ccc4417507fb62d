// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>
#include <terrane/scene/scene_draws.h>
#include <terrane/terrain/view.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace terrane::internal {

/// An object as a device keeps it.
struct DeviceObject {
    std::array<float, 3> centre{};  ///< of the bounding sphere minus the cluster's origin, metres
    float radius = 0.0f;            ///< of the bounding sphere, metres
    std::array<float, 3> offset{};  ///< ObjectInstance::offset_eye, from the cluster's origin
    float scale = 1.0f;
    std::array<float, 4> rotation{};
    float log_scale = 0.0f;  ///< log2_of(scale)
    std::array<float, 3> tint{};
};
static_assert(sizeof(DeviceObject) == 64);

/// The levels of a model, as LevelChoice has them.
struct DeviceModel {
    /// A level, or after the last one the step at which nothing is drawn.
    struct Step {
        float log2_error = 0.0f;  ///< metres at scale 1
        bool morphs = false;
        std::optional<ImpostorId> impostor;  ///< of a level that is an impostor
    };
    std::vector<Step> steps;  ///< finest first
    float log2_ratio = 0.0f;  ///< of the fade ratio
};

/// A cluster of objects with groups in view.
struct DeviceCluster {
    std::array<double, 3> origin_world{};
    std::array<float, 3> origin_eye{};  ///< the same relative to the eye
    std::uint32_t model = 0;
};
static_assert(sizeof(DeviceCluster) == 40);

/// A group of at most 32 objects in view.
struct DeviceGroup {
    std::uint32_t first_object = 0;      ///< among those of InstanceDevice::add()
    std::uint32_t cluster = 0;           ///< in DeviceFrame::clusters
    std::uint32_t count_and_planes = 0;  ///< objects; from bit 8 on PlaneState::mask
    std::uint32_t hidden = 0;            ///< bit i: the ground hides object i
};
static_assert(sizeof(DeviceGroup) == 16);

/// What a device needs to know of a frame.
struct DeviceFrame {
    View view;
    std::span<const Eigen::Vector3d> normals;  ///< ViewVolume::normals()
    double far_distance = 0.0;                 ///< of the last of five planes; 0 if there are four
    /// Of FrameObjects: nearest distance; log2 of pixels per radian, and of the least threshold.
    float near_distance = 1.0f, log2_pixels = 0.0f, log2_least = 0.0f;
    std::span<const DeviceCluster> clusters;
    std::span<const DeviceGroup> groups;            ///< by model
    std::span<const std::uint32_t> group_of_model;  ///< [models + 1] first group of each model
};

/// Culls the objects of a scene and chooses their levels, as FrameObjects, FactorCounts and DrawList do, with the same
/// bits. Its instances stay on a device.
///
/// Threads: one at a time, the one that draws
class InstanceDevice {
public:
    /// Largest number of levels of a model, without that at which nothing is drawn.
    static constexpr std::size_t kMostLevels = 8;

    /// Counts of cull(): objects that are not culled; those that are not drawn at the least threshold; those that the
    /// ground hides.
    struct Culled {
        std::size_t taken = 0, left_out = 0, occluded = 0;
    };
    /// Result of choose(). Instances of a level are consecutive, in the order of models and levels.
    struct Chosen {
        const DeviceInstances* instances = nullptr;
        std::span<const std::uint32_t> counts;  ///< [models * kMostLevels] instances of each level
        std::size_t objects = 0;                ///< that are drawn
    };

    InstanceDevice() = default;
    InstanceDevice(const InstanceDevice&) = delete;
    InstanceDevice& operator=(const InstanceDevice&) = delete;
    virtual ~InstanceDevice() = default;

    /// Removes all objects and models.
    virtual void clear() = 0;
    /// Adds a model; models are numbered in the order in which they are added.
    virtual void add_model(const DeviceModel& model) = 0;
    /// Uploads objects. Returns the number of the first; the others follow.
    ///
    /// Fails: device_unavailable if the device's memory does not suffice
    virtual Result<std::uint32_t> add(std::span<const DeviceObject> objects) = 0;
    /// Removes objects that were added together.
    virtual void remove(std::uint32_t first, std::size_t count) = 0;

    /// Culls the objects of a frame. Waits for the device.
    ///
    /// Fails: device_unavailable if the device's memory does not suffice
    virtual Result<Culled> cull(const DeviceFrame& frame) = 0;
    /// The counts of factors of a model's objects after cull(), as FactorCounts has them. Valid until the next call.
    virtual std::span<const std::uint32_t> factor_counts(std::uint32_t model) = 0;
    /// Chooses the levels of the objects of the last cull(). Waits for the device.
    virtual Chosen choose(float log2_threshold) = 0;
};

}  // namespace terrane::internal
