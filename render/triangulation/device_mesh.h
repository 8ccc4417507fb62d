// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"

#include <cstddef>
#include <cstdint>

namespace terrane {

/// Buffers of a frame's triangles, for terrain.vert with FROM_DEVICE.
///
/// A vertex is numbered 289 * area + sample, where `area` counts the open areas of the frame and `sample` the 17 x 17
/// samples of an area; or 2^31 + 16641 * root + sample, for triangles of spacings coarser than that of the root chunk.
struct DeviceMesh {
    GLuint indices = 0;            ///< uint32, three for each triangle
    GLuint commands = 0;           ///< has a DrawElementsIndirectCommand
    std::size_t command_byte = 0;  ///< its place
    GLuint places = 0;             ///< three ivec4 for each area and root: see lod_list.comp
    std::size_t places_byte = 0, places_bytes = 0;
    GLuint offsets = 0;                   ///< metres, by number of the vertex
    GLuint heights = 0;                   ///< quanta
    std::uint32_t first_root_place = 0;   ///< of the roots
    std::uint32_t first_root_offset = 0;  ///< likewise, of even samples
    bool morphs = false;                  ///< false: no vertex has an offset
};

}  // namespace terrane
