// SPDX-License-Identifier: MIT
#include "objects/store/object_layout.h"

namespace terrane::internal {
namespace {

void add_floats(GLuint layout, GLuint attribute, GLint count, std::size_t byte, GLuint binding) {
    glEnableVertexArrayAttrib(layout, attribute);
    glVertexArrayAttribFormat(layout, attribute, count, GL_FLOAT, GL_FALSE,
                              static_cast<GLuint>(byte));
    glVertexArrayAttribBinding(layout, attribute, binding);
}

void add_vertex(GLuint layout, GLuint first_attribute, GLuint binding) {
    add_floats(layout, first_attribute, 3, offsetof(ObjectVertex, position), binding);
    add_floats(layout, first_attribute + 1, 3, offsetof(ObjectVertex, normal), binding);
    const GLuint colour = first_attribute + 2;
    glEnableVertexArrayAttrib(layout, colour);
    glVertexArrayAttribFormat(layout, colour, 4, GL_UNSIGNED_BYTE, GL_TRUE,
                              offsetof(ObjectVertex, colour));
    glVertexArrayAttribBinding(layout, colour, binding);
}

}  // namespace

GlVertexArray make_object_layout() {
    GlVertexArray layout = make_vertex_array();
    const GLuint name = layout.name();
    add_vertex(name, 0, 0);
    add_floats(name, 3, 4, offsetof(ObjectInstance, offset_eye), 1);  // and scale
    add_floats(name, 4, 4, offsetof(ObjectInstance, rotation), 1);
    add_floats(name, 5, 4, offsetof(ObjectInstance, coverage), 1);  // and tint
    glVertexArrayBindingDivisor(name, 1, 1);
    add_vertex(name, 6, 2);
    return layout;
}

void bind_mesh(GLuint layout, const StoredMesh& mesh, GLuint targets) {
    glBindVertexArray(layout);
    glVertexArrayVertexBuffer(layout, 0, mesh.vertex_buffer.name(), 0, sizeof(ObjectVertex));
    glVertexArrayVertexBuffer(layout, 2, targets != 0 ? targets : mesh.vertex_buffer.name(), 0,
                              sizeof(ObjectVertex));
    glVertexArrayElementBuffer(layout, mesh.index_buffer.name());
}

void bind_own_vertices(GLuint layout, GLuint buffer, std::size_t byte) {
    for (const GLuint binding : {0u, 2u}) {
        glVertexArrayVertexBuffer(layout, binding, buffer, static_cast<GLintptr>(byte),
                                  sizeof(ObjectVertex));
    }
}

}  // namespace terrane::internal
