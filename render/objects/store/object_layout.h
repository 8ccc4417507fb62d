// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"
#include "objects/store/mesh_store.h"

#include <cstddef>

namespace terrane::internal {

/// Vertex array of ObjectVertex (attributes 0 to 2, binding 0), ObjectInstance (3 to 5, binding 1), and the vertices
/// that a level morphs to (6 to 8, binding 2).
GlVertexArray make_object_layout();

/// Binds a layout, and a mesh's buffers to it.
///
/// @param targets buffer of the vertices that the level morphs to; 0: none
void bind_mesh(GLuint layout, const StoredMesh& mesh, GLuint targets);
/// Replaces the vertices of the layout, without a morph.
void bind_own_vertices(GLuint layout, GLuint buffer, std::size_t byte);

}  // namespace terrane::internal
