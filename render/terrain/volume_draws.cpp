// SPDX-License-Identifier: MIT
#include "terrain/volume_draws.h"

#include "gl/gl_object.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

namespace terrane::internal {
namespace {

using Corners = std::array<std::uint32_t, 3>;

GlVertexArray make_solid_layout() {
    GlVertexArray layout = make_vertex_array();
    const GLuint name = layout.name();
    for (GLuint attribute = 0; attribute < 4; ++attribute) {
        glEnableVertexArrayAttrib(name, attribute);
        glVertexArrayAttribBinding(name, attribute, 0);
    }
    glVertexArrayAttribIFormat(name, 0, 3, GL_INT, offsetof(SolidVertex, column));
    glVertexArrayAttribFormat(name, 1, 3, GL_FLOAT, GL_FALSE, offsetof(SolidVertex, offset));
    glVertexArrayAttribFormat(name, 2, 3, GL_FLOAT, GL_FALSE, offsetof(SolidVertex, normal));
    glVertexArrayAttribFormat(name, 3, 1, GL_FLOAT, GL_FALSE, offsetof(SolidVertex, depth));
    return layout;
}

/// Bilinear height of a chunk's samples at a position in cells, metres.
double height_over(const Lattice& lattice, const Chunk& chunk, double column, double row) {
    const int i = std::clamp(static_cast<int>(std::floor(column)), 0, kChunkCells - 1);
    const int j = std::clamp(static_cast<int>(std::floor(row)), 0, kChunkCells - 1);
    const double u = column - i, v = row - j;
    const auto at = [&](int x, int y) {
        return static_cast<double>(chunk.heights[sample_index(x, y)]);
    };
    const double south = (1.0 - u) * at(i, j) + u * at(i + 1, j);
    const double north = (1.0 - u) * at(i, j + 1) + u * at(i + 1, j + 1);
    return lattice.quantum * ((1.0 - v) * south + v * north);
}

}  // namespace

std::vector<SolidVertex> make_solid_vertices(const Lattice& lattice, const Chunk& chunk) {
    const SolidTriangles& solid = chunk.solid->triangles();
    const double spacing = lattice.level_spacing(chunk.key.level);
    std::vector<Eigen::Vector3d> normals(solid.vertices_world.size(), Eigen::Vector3d::Zero());
    // Normals come from walls only: adjacent triangles of the heightfield are shaded as heightfield.
    for (const auto& [a, b, c] : std::span(solid.triangles).subspan(solid.ground_count)) {
        const auto& v = solid.vertices_world;
        const Eigen::Vector3d across = (v[b] - v[a]).cross(v[c] - v[a]);
        for (const std::uint32_t corner : {a, b, c}) normals[corner] += across;
    }
    std::vector<SolidVertex> vertices(solid.vertices_world.size());
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        const Eigen::Vector3d& p = solid.vertices_world[i];
        SolidVertex& made = vertices[i];
        const double west = lattice.x(chunk.corner.x), south = lattice.y(chunk.corner.y);
        const double column = (p.x() - west) / spacing, row = (p.y() - south) / spacing;
        made.column = static_cast<std::int32_t>(std::lround(column));
        made.row = static_cast<std::int32_t>(std::lround(row));
        made.height = static_cast<std::int32_t>(std::lround(p.z() / lattice.quantum));
        made.offset[0] =
            static_cast<float>(p.x() - lattice.x(chunk.corner.x + made.column * chunk.step));
        made.offset[1] =
            static_cast<float>(p.y() - lattice.y(chunk.corner.y + made.row * chunk.step));
        made.offset[2] = static_cast<float>(p.z() - lattice.quantum * made.height);
        const double length = normals[i].norm();
        const Eigen::Vector3d normal =
            length > 0.0 ? Eigen::Vector3d(normals[i] / length) : Eigen::Vector3d::UnitZ();
        for (int axis = 0; axis < 3; ++axis) made.normal[axis] = static_cast<float>(normal[axis]);
        made.depth = static_cast<float>(height_over(lattice, chunk, column, row) - p.z());
    }
    return vertices;
}

// Uploads a surface. Order of the indices: all levels from the finest on, then the caps of all sides.
const VolumeDraws::Uploaded& VolumeDraws::upload(const Lattice& lattice, const Chunk& chunk) {
    const auto [found, is_new] = uploaded_.try_emplace(chunk.solid.get());
    Uploaded& made = found->second;
    if (!is_new && !made.solid.expired()) return made;
    const SolidTriangles& solid = chunk.solid->triangles();
    const std::vector<SolidVertex> vertices = make_solid_vertices(lattice, chunk);
    std::vector<Corners> indices(solid.triangles);
    for (const SolidLevel& level : solid.levels)
        indices.insert(indices.end(), level.triangles.begin(), level.triangles.end());
    for (const auto& cap : solid.caps) indices.insert(indices.end(), cap.begin(), cap.end());
    made.solid = chunk.solid;
    made.vertices = make_buffer();
    made.indices = make_buffer();
    const std::size_t vertex_bytes = vertices.size() * sizeof(SolidVertex);
    const std::size_t index_bytes = indices.size() * sizeof(Corners);
    glNamedBufferStorage(made.vertices.name(), static_cast<GLsizeiptr>(vertex_bytes),
                         vertices.data(), 0);
    glNamedBufferStorage(made.indices.name(), static_cast<GLsizeiptr>(index_bytes), indices.data(),
                         0);
    made.bytes = vertex_bytes + index_bytes;
    return made;
}

Result<void> VolumeDraws::prepare(const TerrainMesh& mesh, const EyeFrame& eye) {
    draws_.clear();
    std::erase_if(uploaded_, [](const auto& entry) { return entry.second.solid.expired(); });
    if (mesh.solids.empty()) return {};
    if (layout_.name() == 0) layout_ = make_solid_layout();
    const Lattice& lattice = mesh.resident->lattice();
    for (const MeshSolid& shown : mesh.solids) {
        const Chunk& chunk = *shown.chunk;
        const SolidTriangles& solid = chunk.solid->triangles();
        Draw& draw = draws_.emplace_back();
        draw.uploaded = &upload(lattice, chunk);
        const SplitInteger x = split(chunk.corner.x - eye.x, kIndexBits);
        const SplitInteger y = split(chunk.corner.y - eye.y, kIndexBits);
        const SplitInteger stride = split(chunk.step, kIndexBits);
        draw.corner[0] = x.high;
        draw.corner[1] = x.low;
        draw.corner[2] = y.high;
        draw.corner[3] = y.low;
        draw.stride[0] = stride.high;
        draw.stride[1] = stride.low;
        std::size_t first = 0;
        const auto add = [&](const std::vector<Corners>& triangles) {
            if (triangles.data() == shown.triangles.data() && !triangles.empty()) {
                const std::size_t ground = 3 * solid.ground_count;
                draw.ground = {first, ground};
                draw.walls.push_back({first + ground, 3 * triangles.size() - ground});
            }
            first += 3 * triangles.size();
        };
        add(solid.triangles);
        for (const SolidLevel& level : solid.levels) add(level.triangles);
        for (std::size_t side = 0; side < 4; ++side) {
            if (!shown.caps[side].empty())
                draw.walls.push_back({first, 3 * shown.caps[side].size()});
            first += 3 * solid.caps[side].size();
        }
    }
    return check_gl("upload the triangles of volumes");
}

VolumeDraws::Program::Program(GlProgram made)
    : program(std::move(made)),
      corner(glGetUniformLocation(program.name(), "corner")),
      stride(glGetUniformLocation(program.name(), "stride")) {}

void VolumeDraws::draw(Part part, const Program& program) const {
    if (draws_.empty()) return;
    glUseProgram(program.program.name());
    glBindVertexArray(layout_.name());
    for (const Draw& draw : draws_) {
        glVertexArrayVertexBuffer(layout_.name(), 0, draw.uploaded->vertices.name(), 0,
                                  sizeof(SolidVertex));
        glVertexArrayElementBuffer(layout_.name(), draw.uploaded->indices.name());
        glUniform4iv(program.corner, 1, draw.corner);
        glUniform2iv(program.stride, 1, draw.stride);
        const auto draw_range = [](const Range& range) {
            if (range.count == 0) return;
            // OpenGL passes the offset in the index buffer as a pointer
            glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(range.count), GL_UNSIGNED_INT,
                           reinterpret_cast<const void*>(range.first * sizeof(std::uint32_t)));
        };
        if (part == Part::ground) {
            draw_range(draw.ground);
        } else {
            for (const Range& range : draw.walls) draw_range(range);
        }
    }
}

std::size_t VolumeDraws::bytes() const {
    std::size_t bytes = 0;
    for (const auto& [solid, uploaded] : uploaded_) bytes += uploaded.bytes;
    return bytes;
}

}  // namespace terrane::internal
