// SPDX-License-Identifier: MIT
// Keeps the parts of a MeshBuffers on an OpenGL 4.5 device, and draws them. A part that has not changed costs nothing.
#pragma once

#include <terrane/terrain/mesh_buffers.h>

#include <epoxy/gl.h>

#include <map>

class GlUploader {
public:
    // Call after each MeshBuffers::update(), with the context current.
    void upload(const terrane::MeshBuffers& buffers) {
        for (const terrane::ChunkKey& key : buffers.gone()) {
            release(parts_.at(key));
            parts_.erase(key);
        }
        for (const terrane::MeshPart& part : buffers.parts()) {
            if (part.change == terrane::PartChange::same) continue;
            Part& held = parts_[part.key];
            if (held.vertex_array == 0) create(held);
            glNamedBufferData(held.buffers[0], static_cast<GLsizeiptr>(part.vertices.size_bytes()),
                              part.vertices.data(), GL_DYNAMIC_DRAW);
            glNamedBufferData(held.buffers[1], static_cast<GLsizeiptr>(part.indices.size_bytes()),
                              part.indices.data(), GL_DYNAMIC_DRAW);
            held.index_count = static_cast<GLsizei>(part.indices.size());
        }
    }

    // Uses the current program: attribute 0 is the position, metres from MeshBuffers::origin_world(), 1 the normal.
    void draw() const {
        for (const auto& [key, part] : parts_) {
            glBindVertexArray(part.vertex_array);
            glDrawElements(GL_TRIANGLES, part.index_count, GL_UNSIGNED_INT, nullptr);
        }
        glBindVertexArray(0);
    }

    // Call while the context still exists.
    void clear() {
        for (auto& [key, part] : parts_) release(part);
        parts_.clear();
    }

private:
    struct Part {
        GLuint vertex_array = 0;
        GLuint buffers[2] = {};  // vertices, indices
        GLsizei index_count = 0;
    };

    static void create(Part& part) {
        glCreateVertexArrays(1, &part.vertex_array);
        glCreateBuffers(2, part.buffers);
        glVertexArrayVertexBuffer(part.vertex_array, 0, part.buffers[0], 0,
                                  sizeof(terrane::MeshVertex));
        glVertexArrayElementBuffer(part.vertex_array, part.buffers[1]);
        for (GLuint attribute = 0; attribute < 2; ++attribute) {  // position, normal
            glEnableVertexArrayAttrib(part.vertex_array, attribute);
            glVertexArrayAttribFormat(part.vertex_array, attribute, 3, GL_FLOAT, GL_FALSE,
                                      attribute * 3 * sizeof(float));
            glVertexArrayAttribBinding(part.vertex_array, attribute, 0);
        }
    }
    static void release(Part& part) {
        glDeleteVertexArrays(1, &part.vertex_array);
        glDeleteBuffers(2, part.buffers);
    }

    std::map<terrane::ChunkKey, Part> parts_;
};
