// SPDX-License-Identifier: MIT
#pragma once

#include "draw/eye_frame.h"
#include "gl/gl_object.h"
#include "gl/stream_buffer.h"
#include "light/light_levels.h"
#include "light/slope_map.h"

#include <cstddef>
#include <memory>
#include <vector>

namespace terrane::internal {

/// Device data for shading the ground: slope maps and nodes of the chunks selected by LightLevels, one layer each of
/// two texture arrays, and a hash table from level and position of a chunk to its layer.
class GroundLight {
public:
    GroundLight();

    /// Call once a frame, before bind(). Fails with device_unavailable where the device is out of memory.
    Result<void> prepare(const std::shared_ptr<const ResidentSet>& resident, const View& view,
                         const EyeFrame& eye);

    /// Binds slopes to texture unit 0, nodes to unit 4, the table to unit 5, and its uniform block to 1.
    void bind() const;
    /// Call after the last command of a frame that reads them.
    void finish();

    /// Bytes of the slope maps of resident chunks.
    std::size_t bytes() const;
    const LightLevels& levels() const { return levels_; }

private:
    struct Layer {
        std::weak_ptr<const Chunk> chunk;
        SideLevels side_levels{};
        LightNodes nodes{};
    };

    void hold_layers(std::size_t count);
    void upload(const ResidentSet& resident);
    Result<void> write_table(const Lattice& lattice, const EyeFrame& eye);

    LightLevels levels_;
    std::vector<Layer> layers_;
    GlTexture slopes_, nodes_, table_;
    StreamBuffer stream_;
};

}  // namespace terrane::internal
