// SPDX-License-Identifier: MIT
#pragma once

#include "light/ground_shade.h"

#include <terrane/render/terrain_renderer.h>

#include <cstddef>

namespace terrane::test {

/// Reference for the renderer: the triangles of a mesh as one plain draw call, with 32-bit indices into one buffer of
/// precomputed vertices on the device.
///
/// Target, state, uniforms, shading pass and order of triangles are those of the renderer. The vertex shader only
/// multiplies by the matrix.
class PlainDraw {
public:
    /// Fails with invalid_argument for an eye too far away, device_unavailable for errors of OpenGL.
    static Result<PlainDraw> create(const TerrainMesh& mesh, const View& view,
                                    const RendererSettings& settings);
    void draw() const;
    Image read() const { return picture_.read(); }
    std::size_t vertex_count() const { return vertex_count_; }

private:
    PlainDraw(internal::Framebuffer picture, internal::GroundShade shade)
        : picture_(std::move(picture)), shade_(std::move(shade)) {}
    Result<void> upload(const TerrainMesh& mesh, const View& view);

    internal::Framebuffer picture_;
    internal::GroundShade shade_;
    internal::GlProgram ground_;
    internal::GlBuffer uniforms_, vertices_, indices_;
    internal::GlVertexArray layout_;
    GLsizei index_count_ = 0;
    std::size_t vertex_count_ = 0;
};

}  // namespace terrane::test
