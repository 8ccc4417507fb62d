// SPDX-License-Identifier: MIT
#include "objects/object_casters.h"

#include "gl/gl_object.h"
#include "gl/shader.h"
#include "objects/mesh_store.h"

#include <terrane/base/text.h>

#include <cstring>
#include <limits>
#include <string>

namespace terrane::internal {
namespace {

// Radius of a sphere around the object's origin that contains the mesh.
double radius_of(const OpaqueDraw& draw) {
    // streamed vertices may be anywhere
    if (draw.has_own_vertices) return std::numeric_limits<double>::infinity();
    const Aabb& bounds = draw.mesh->bounds;
    return bounds.low.cwiseAbs().cwiseMax(bounds.high.cwiseAbs()).norm();
}
double radius_of(const StoredImpostor& impostor) {
    return static_cast<double>(impostor.centre.norm() + impostor.radius);
}

}  // namespace

namespace {

// a shadow map has one sample a texel
std::string covered_text() { return "#define SAMPLES 1\n" + std::string(coverage_glsl); }

}  // namespace

MaterialPrograms cut_shadow_programs() {
    return {"cut meshes' shadows", kColourTexture | kCut, std::string(instance_vert),
            covered_text(), std::string(mesh_shadow_frag)};
}

Result<std::unique_ptr<ObjectCasters>> ObjectCasters::create() {
    const std::string covered = covered_text();
    TERRANE_TRY(GlProgram meshes, make_program("meshes' shadows", instance_vert,
                                               covered + std::string(mesh_shadow_frag)));
    TERRANE_TRY(ImpostorProgram impostors,
                make_impostor_program("impostors' shadows", impostor_shadow_vert,
                                      covered + std::string(impostor_shadow_frag)));
    std::unique_ptr<ObjectCasters> made(new ObjectCasters);
    made->meshes_ = std::move(meshes);
    made->impostors_ = std::move(impostors);
    made->object_layout_ = make_object_layout();
    made->textured_layout_ = make_textured_layout();
    made->no_layout_ = make_vertex_array();
    return made;
}

ObjectCasters::Part ObjectCasters::select(std::span<const ObjectInstance> instances, double radius,
                                          const SunCascade& cascade, const WorldPos& eye_world) {
    Part part;
    part.first = static_cast<std::uint32_t>(selected_.size());
    for (const ObjectInstance& instance : instances) {
        const auto& [x, y, z] = instance.offset_eye;
        const Eigen::Vector3d origin_eye = Eigen::Vector3f(x, y, z).cast<double>();
        const double scale = static_cast<double>(instance.scale);
        if (cascade.meets(BoundingSphere{eye_world + origin_eye, scale * radius}))
            selected_.push_back(instance);
    }
    part.count = static_cast<std::uint32_t>(selected_.size()) - part.first;
    return part;
}

Result<void> ObjectCasters::prepare(std::span<const OpaqueDraw> solids,
                                    std::span<const BillboardDraw> billboards,
                                    std::span<const ObjectInstance> instances, GLuint frame_stream,
                                    std::span<const SunCascade> cascades,
                                    const WorldPos& eye_world) {
    solids_ = solids;
    billboards_ = billboards;
    frame_stream_ = frame_stream;
    selected_.clear();
    for (const OpaqueDraw& draw : solids) {
        if ((draw.material->features & kCut) == 0) continue;
        TERRANE_TRY(cut_meshes_.make(draw.material->features));
    }
    for (std::size_t i = 0; i < cascades.size(); ++i) {
        List& list = lists_[i];
        list.solids.clear();
        list.billboards.clear();
        const auto add = [&](const auto& draw, std::size_t number, double radius,
                             std::vector<Part>& parts) {
            Part part = select(instances.subspan(draw.first_instance, draw.instance_count), radius,
                               cascades[i], eye_world);
            part.draw = number;
            if (part.count > 0) parts.push_back(part);
        };
        for (std::size_t number = 0; number < solids.size(); ++number)
            add(solids[number], number, radius_of(solids[number]), list.solids);
        for (std::size_t number = 0; number < billboards.size(); ++number)
            add(billboards[number], number, radius_of(*billboards[number].impostor),
                list.billboards);
    }
    if (selected_.empty()) return {};
    const std::size_t bytes = selected_.size() * sizeof(ObjectInstance);
    std::byte* memory = stream_.begin(bytes);
    if (memory == nullptr) {
        selected_.clear();
        const std::string doing = "take " + number_text(bytes) + " bytes of the device for shadows";
        TERRANE_TRY(check_gl(doing));
        return fail(ErrorCode::device_unavailable, "OpenGL cannot " + doing);
    }
    std::memcpy(memory, selected_.data(), bytes);
    return {};
}

void ObjectCasters::draw_mesh(const OpaqueDraw& draw, const Part& part, GLuint layout) const {
    bind_mesh(layout, *draw.mesh, draw.targets);
    glVertexArrayVertexBuffer(layout, 1, stream_.name(), 0, sizeof(ObjectInstance));
    if (draw.has_own_vertices) {
        bind_own_vertices(layout, frame_stream_, draw.vertex_byte);
    }
    if (draw.has_own_indices) glVertexArrayElementBuffer(layout, frame_stream_);
    // OpenGL passes the offset in the index buffer as a pointer
    glDrawElementsInstancedBaseInstance(GL_TRIANGLES, static_cast<GLsizei>(draw.index_count),
                                        GL_UNSIGNED_INT,
                                        reinterpret_cast<const void*>(draw.index_byte),
                                        static_cast<GLsizei>(part.count), part.first);
}

void ObjectCasters::draw(std::size_t cascade) const {
    if (selected_.empty()) return;
    const List& list = lists_[cascade];
    glUseProgram(meshes_.name());
    bool has_cut = false;
    for (const Part& part : list.solids) {
        const OpaqueDraw& draw = solids_[part.draw];
        const bool is_cut = (draw.material->features & kCut) != 0;
        has_cut = has_cut || is_cut;
        if (!is_cut) draw_mesh(draw, part, object_layout_.name());
    }
    for (const Part& part : list.solids) {
        const OpaqueDraw& draw = solids_[part.draw];
        if (!has_cut || (draw.material->features & kCut) == 0) continue;
        cut_meshes_.of(draw.material->features).use(*draw.material);
        bind_texture_coordinates(textured_layout_.name(), *draw.mesh, draw.texture_targets);
        draw_mesh(draw, part, textured_layout_.name());
    }
    if (list.billboards.empty()) return;
    glUseProgram(impostors_.program.name());
    glBindVertexArray(no_layout_.name());
    glBindBufferRange(GL_SHADER_STORAGE_BUFFER, 1, stream_.name(), 0,
                      static_cast<GLsizeiptr>(selected_.size() * sizeof(ObjectInstance)));
    for (const Part& part : list.billboards) {
        const StoredImpostor& impostor = *billboards_[part.draw].impostor;
        impostors_.set(impostor, part.first);
        glBindTextureUnit(0, impostor.colours.name());
        glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(6 * part.count));
    }
}

void ObjectCasters::finish() {
    if (!selected_.empty()) stream_.end();
}

}  // namespace terrane::internal
