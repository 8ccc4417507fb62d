// SPDX-License-Identifier: MIT
#pragma once

#include "gl/device_array.h"
#include "gl/frame_resources.h"
#include "light/shadow_maps.h"
#include "objects/object_draws.h"

#include <terrane/scene/scene_draws.h>

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace terrane::internal {

/// Programs that draw meshes with cut textures into a shadow map.
MaterialPrograms cut_shadow_programs();

/// Draws the objects of a frame into shadow maps: meshes as triangles, impostors as flat pictures that face the sun.
/// Casters that cannot cast a shadow into a map are culled.
class ObjectCasters {
public:
    /// Fails: device_unavailable if its shaders do not compile
    static Result<std::unique_ptr<ObjectCasters>> create();

    /// Selects the instances for each map and uploads them; those on the device are selected there.
    ///
    /// @param solids, billboards of the frame, valid until finish()
    /// @param frame_stream       contains the vertices and indices of streamed draws
    ///
    /// Fails: device_unavailable if the device is out of memory
    Result<void> prepare(std::span<const OpaqueDraw> solids,
                         std::span<const BillboardDraw> billboards,
                         std::span<const ObjectInstance> instances, GLuint frame_stream,
                         std::span<const SunCascade> cascades, const WorldPos& eye_world);
    /// Draws into the map of a cascade, which must be the bound target.
    void draw(std::size_t cascade) const;
    /// Call after the last draw of a frame.
    void finish();

private:
    // A range of selected_: the instances of a draw that are drawn into a map. On the device of copies_, with a command
    // that has their number.
    struct Part {
        std::size_t draw = 0;  // index in solids_ or billboards_
        std::uint32_t first = 0, count = 0;
        std::optional<std::size_t> command_byte = {};  // in commands_
    };
    // As in instances_casters.comp.
    struct Selection {
        std::array<std::uint32_t, 4> range{};
        std::array<std::array<float, 4>, 3> axes{};
        std::array<float, 4> sizes{};
    };
    struct List {
        std::vector<Part> solids, billboards;
    };

    ObjectCasters() = default;
    void draw_mesh(const OpaqueDraw& draw, const Part& part, GLuint layout) const;
    // Appends the instances of a range that can cast a shadow into a map.
    Part select(std::span<const ObjectInstance> instances, double radius, const SunCascade& cascade,
                const WorldPos& eye_world);

    Part select_on_device(std::uint32_t first, std::uint32_t count, double radius,
                          const SunCascade& cascade, const WorldPos& eye_world,
                          const PartCommand& command, bool has_indices);
    Result<void> run_selections(GLuint instances);
    GLuint instances_of(const Part& part) const {
        return part.command_byte ? copies_.name() : stream_.name();
    }

    GlProgram meshes_, selecting_;
    MaterialPrograms cut_meshes_ = cut_shadow_programs();
    ImpostorProgram impostors_;
    GlVertexArray object_layout_, textured_layout_, no_layout_;
    StreamBuffer stream_;

    // State of the current frame.
    std::span<const OpaqueDraw> solids_;
    std::span<const BillboardDraw> billboards_;
    GLuint frame_stream_ = 0;
    std::array<List, kCascades> lists_;
    std::vector<ObjectInstance> selected_;
    std::vector<Selection> selections_;  // of instances on the device
    std::vector<std::uint32_t> command_words_;
    std::uint32_t copy_count_ = 0, most_selected_ = 0;
    DeviceArray selection_words_, copies_, commands_;
};

}  // namespace terrane::internal
