// SPDX-License-Identifier: MIT
#pragma once

#include "gl/frame_resources.h"
#include "light/shadow_maps.h"
#include "objects/object_draws.h"

#include <terrane/scene/scene_draws.h>

#include <array>
#include <memory>
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

    /// Selects the instances for each map and uploads them.
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
    // A range of selected_: the instances of a draw that are drawn into a map.
    struct Part {
        std::size_t draw = 0;  // index in solids_ or billboards_
        std::uint32_t first = 0, count = 0;
    };
    struct List {
        std::vector<Part> solids, billboards;
    };

    ObjectCasters() = default;
    void draw_mesh(const OpaqueDraw& draw, const Part& part, GLuint layout) const;
    // Appends the instances of a range that can cast a shadow into a map.
    Part select(std::span<const ObjectInstance> instances, double radius, const SunCascade& cascade,
                const WorldPos& eye_world);

    GlProgram meshes_;
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
};

}  // namespace terrane::internal
