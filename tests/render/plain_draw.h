// SPDX-License-Identifier: MIT
#pragma once

#include "chunk_pool.h"
#include "framebuffer.h"

#include <terrane/render/terrain_renderer.h>

#include <cstddef>

namespace terrane::test {

/// The triangles of a mesh as one plain draw, to compare the renderer with: 32-bit indices into one
/// buffer of finished vertices, both on the device already.
///
/// Target, state, uniforms, textures, fragment shader, sky and resolve are the renderer's; triangles
/// come in its order. The vertex shader only multiplies by the matrix.
class PlainDraw {
public:
    /// Of one mesh from one view. Fails with invalid_argument for an eye too far away or a mesh of
    /// more chunks than one page of a ChunkPool holds, device_unavailable for errors of OpenGL.
    static Result<PlainDraw> create(const TerrainMesh& mesh, const View& view,
                                    const RendererSettings& settings);
    void draw() const;
    Image read() const { return picture_.read(); }
    std::size_t vertex_count() const { return vertex_count_; }

private:
    explicit PlainDraw(internal::Framebuffer picture) : picture_(std::move(picture)) {}
    Result<void> upload(const TerrainMesh& mesh, const View& view);

    internal::Framebuffer picture_;
    internal::GlProgram ground_, sky_;
    internal::GlTexture noise_;
    internal::ChunkPool pool_{internal::ChunkPool::largest_page()};
    internal::GlBuffer uniforms_, vertices_, indices_;
    internal::GlVertexArray layout_, no_layout_;
    GLsizei index_count_ = 0;
    std::size_t vertex_count_ = 0;
};

}  // namespace terrane::test
