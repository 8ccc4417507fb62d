// SPDX-License-Identifier: MIT
#include "objects/object_layout.h"

namespace terrane::internal {
namespace {

void add_floats(GLuint layout, GLuint attribute, GLint count, std::size_t byte, GLuint binding) {
    glEnableVertexArrayAttrib(layout, attribute);
    glVertexArrayAttribFormat(layout, attribute, count, GL_FLOAT, GL_FALSE,
                              static_cast<GLuint>(byte));
    glVertexArrayAttribBinding(layout, attribute, binding);
}

}  // namespace

GlVertexArray make_object_layout() {
    GlVertexArray layout = make_vertex_array();
    const GLuint name = layout.name();
    add_floats(name, 0, 3, offsetof(ObjectVertex, position), 0);
    add_floats(name, 1, 3, offsetof(ObjectVertex, normal), 0);
    glEnableVertexArrayAttrib(name, 2);
    glVertexArrayAttribFormat(name, 2, 4, GL_UNSIGNED_BYTE, GL_TRUE,
                              offsetof(ObjectVertex, colour));
    glVertexArrayAttribBinding(name, 2, 0);
    add_floats(name, 3, 4, offsetof(ObjectInstance, offset_eye), 1);  // and scale
    add_floats(name, 4, 4, offsetof(ObjectInstance, rotation), 1);
    add_floats(name, 5, 4, offsetof(ObjectInstance, coverage), 1);  // and tint
    glVertexArrayBindingDivisor(name, 1, 1);
    return layout;
}

void bind_mesh(GLuint layout, const StoredMesh& mesh) {
    glBindVertexArray(layout);
    glVertexArrayVertexBuffer(layout, 0, mesh.vertex_buffer.name(), 0, sizeof(ObjectVertex));
    glVertexArrayElementBuffer(layout, mesh.index_buffer.name());
}

}  // namespace terrane::internal
