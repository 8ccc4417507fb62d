// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"
#include "light/frame_uniforms.h"

#include <terrane/terrain/triangulator.h>

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

namespace terrane::internal {

/// A vertex of a solid surface on the device: attributes 0 to 3 of solid.vert. A vertex at a heightfield sample has
/// offset 0, and its position is bit-identical to the one that terrain.vert computes.
struct SolidVertex {
    std::int32_t column = 0, row = 0, height = 0;  ///< nearest sample of the chunk; quanta
    float offset[3] = {};                          ///< from that point, metres
    float normal[3] = {};                          ///< unit, out of the solid
    float depth = 0.0f;                            ///< below the heightfield, metres
};
static_assert(sizeof(SolidVertex) == 40);

/// The vertices of a chunk's solid surface.
std::vector<SolidVertex> make_solid_vertices(const Lattice& lattice, const Chunk& chunk);

/// Keeps the triangles of volumes on the device while their chunks are resident, and draws those of a mesh.
class VolumeDraws {
public:
    /// Uploads the surfaces that a mesh draws for the first time, and frees buffers whose surface no longer exists.
    ///
    /// Fails: device_unavailable if OpenGL reports an error
    Result<void> prepare(const TerrainMesh& mesh, const EyeFrame& eye);
    bool is_empty() const { return draws_.empty(); }

    /// A program with solid.vert, and its uniforms.
    struct Program {
        GlProgram program;
        GLint corner = -1, stride = -1;

        Program() = default;
        explicit Program(GlProgram made);
    };
    /// The triangles to draw: the remaining ones of the heightfield, shaded as ground, or the walls of volumes.
    enum class Part { ground, walls };
    /// Draws with a program, which becomes current.
    void draw(Part part, const Program& program) const;

    std::size_t bytes() const;

private:
    struct Uploaded {
        std::weak_ptr<const SolidSurface> solid;
        GlBuffer vertices, indices;
        std::size_t bytes = 0;
    };
    struct Range {
        std::size_t first = 0, count = 0;  // indices
    };
    struct Draw {
        const Uploaded* uploaded = nullptr;
        std::int32_t corner[4] = {};
        std::int32_t stride[2] = {};
        Range ground;
        std::vector<Range> walls;
    };
    const Uploaded& upload(const Lattice& lattice, const Chunk& chunk);

    std::map<const SolidSurface*, Uploaded> uploaded_;
    std::vector<Draw> draws_;
    GlVertexArray layout_;
};

}  // namespace terrane::internal
