// SPDX-License-Identifier: MIT
#pragma once

#include "gl/device_array.h"
#include "gl/gl_object.h"
#include "objects/mesh_store.h"
#include "scene/objects/instance_device.h"

#include <terrane/base/result.h>
#include <terrane/scene/scene_draws.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace terrane {

/// The instances of a frame on the device, in the layout of ObjectInstance.
struct DeviceInstances {
    /// Instances of an impostor: the small ones first, see SceneObjects::sort_billboards().
    struct Billboards {
        std::uint32_t first = 0, small_count = 0;
    };

    GLuint buffer = 0;
    std::size_t count = 0;
    std::vector<Billboards> billboards;  ///< ascending

    /// The small ones among the instances from `first` on of an impostor.
    std::uint32_t small_count(std::uint32_t first) const;
};

}  // namespace terrane

namespace terrane::internal {

/// Scale over distance up to which an impostor shows a single view, squared.
///
/// @param radius of the impostor, metres
float most_small_squared(double pixels_per_radian, float radius);

/// Culls instances and chooses their levels by compute shaders: instances*.comp.
class GpuInstances final : public InstanceDevice {
public:
    /// Compiles the shaders, and probes the arithmetic of the device. Fails: device_unavailable if the device does not
    /// compile them or does not round as IEEE 754
    ///
    /// @param impostors must outlive the result
    /// @param is_hosted in a host's context
    static Result<std::unique_ptr<GpuInstances>> create(const ImpostorStore& impostors,
                                                        bool is_hosted);

    void clear() override;
    void add_model(const DeviceModel& model) override { models_.push_back(model); }
    Result<std::uint32_t> add(std::span<const DeviceObject> objects) override;
    void remove(std::uint32_t first, std::size_t count) override;
    Result<Culled> cull(const DeviceFrame& frame) override;
    std::span<const std::uint32_t> factor_counts(std::uint32_t model) override;
    Chosen choose(float log2_threshold) override;

    /// Memory on the device.
    std::size_t bytes() const;
    /// Bytes that the last frame has sent and read back. Objects that add() uploads do not count.
    std::size_t sent_bytes() const { return sent_bytes_; }
    std::size_t read_bytes() const { return read_bytes_; }

private:
    struct FrameBlock {
        std::array<double, 4> eye_far{};
        std::array<std::array<double, 4>, 5> normals{};
        std::array<float, 4> scalars{};
        std::array<std::uint32_t, 4> counts{};
    };
    static constexpr std::size_t kSizes = 8;  // of clusters, in steps of 32 objects

    GpuInstances(const ImpostorStore& impostors, bool is_hosted)
        : impostors_(&impostors), is_hosted_(is_hosted) {}
    Result<void> make_programs();
    void bind() const;
    void run(const GlProgram& program, std::size_t groups) const;
    void upload_block();
    template <class Value>
    void send(const DeviceArray& array, std::span<const Value> values);
    template <class Value>
    std::vector<Value> read(const DeviceArray& array, std::size_t first, std::size_t count);

    const ImpostorStore* impostors_;
    bool is_hosted_;
    GlProgram cull_, count_, scan_, place_, write_;
    std::vector<DeviceModel> models_;
    GlBuffer frame_;
    DeviceArray objects_, clusters_, groups_, model_words_, factors_, state_, slots_, instances_;
    std::size_t object_end_ = 0;                                // numbers from here on are free
    std::array<std::vector<std::uint32_t>, kSizes + 1> freed_;  // by size

    // State of the current frame.
    FrameBlock block_;
    std::size_t group_count_ = 0;
    std::size_t sent_bytes_ = 0, read_bytes_ = 0;
    std::vector<std::uint32_t> words_, factor_counts_, level_counts_;
    DeviceInstances drawn_;
};

}  // namespace terrane::internal
