// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"
#include "objects/mesh_store.h"

#include <cstddef>

namespace terrane::internal {

/// Vertex array of ObjectVertex (attributes 0 to 2, binding 0) and ObjectInstance (3 to 5, binding 1).
GlVertexArray make_object_layout();

/// Binds a layout, and a mesh's buffers to it.
void bind_mesh(GLuint layout, const StoredMesh& mesh);

}  // namespace terrane::internal
