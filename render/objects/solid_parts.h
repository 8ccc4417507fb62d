// SPDX-License-Identifier: MIT
#pragma once

#include "objects/object_draws.h"

#include <terrane/scene/scene_draws.h>
#include <terrane/terrain/view.h>

#include <span>
#include <vector>

namespace terrane::internal {

/// A command of glMultiDrawElementsIndirect().
struct PartCommand {
    std::uint32_t index_count = 0, instance_count = 0, first_index = 0;
    std::int32_t base_vertex = 0;
    std::uint32_t first_instance = 0;
};
static_assert(sizeof(PartCommand) == 20);

/// Splits the draws of meshes with clusters into commands that leave out clusters which face away.
///
/// Triangles keep their order. An instance is drawn whole where it morphs, where the near plane may clip it, and where
/// few triangles would be left out.
class SolidParts {
public:
    /// Replaces the commands of the frame before; draws without clusters get none.
    ///
    /// @param solids        gets `has_parts`, `first_part` and `part_count`
    /// @param subpixel_bits of the device's window coordinates: GL_SUBPIXEL_BITS
    void prepare(std::span<SolidDraw> solids, std::span<const ObjectInstance> instances,
                 const View& view, int subpixel_bits);

    void clear();
    std::span<const PartCommand> commands() const { return commands_; }
    /// Triangles of draws that no command has.
    std::size_t culled_triangles() const { return culled_triangles_; }

private:
    void add_instance(const SolidDraw& draw, const ObjectInstance& instance, std::uint32_t number,
                      const View& view);
    void add_whole(const SolidDraw& draw, std::uint32_t number);

    double angle_error_ = 0.0;  // radians, of window coordinates
    std::size_t first_of_draw_ = 0;
    std::vector<PartCommand> commands_;
    std::vector<TriangleRun> runs_;
    std::size_t culled_triangles_ = 0;
};

}  // namespace terrane::internal
