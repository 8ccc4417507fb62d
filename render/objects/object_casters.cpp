// SPDX-License-Identifier: MIT
#include "objects/object_casters.h"

#include "gl/gl_object.h"
#include "gl/shader.h"
#include "objects/mesh_store.h"

#include <terrane/base/text.h>

#include <algorithm>
#include <bit>
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
    TERRANE_TRY(GlProgram selecting,
                make_compute_program("instances_casters", instances_casters_comp));
    std::unique_ptr<ObjectCasters> made(new ObjectCasters);
    made->selecting_ = std::move(selecting);
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

// As select(), on the device: the command is drawn with the instances that are found.
ObjectCasters::Part ObjectCasters::select_on_device(std::uint32_t first, std::uint32_t count,
                                                    double radius, const SunCascade& cascade,
                                                    const WorldPos& eye_world,
                                                    const PartCommand& command, bool has_indices) {
    const std::size_t word = command_words_.size();
    for (const std::uint32_t each : std::bit_cast<std::array<std::uint32_t, 5>>(command))
        command_words_.push_back(each);
    Selection selection;
    // instances of a mesh are counted, or vertices of billboards
    selection.range = {first, count, copy_count_,
                       static_cast<std::uint32_t>(has_indices ? word + 1 : word)};
    const Eigen::Vector3d centre = cascade.centre_from(eye_world);
    for (int i = 0; i < 3; ++i) {
        const Eigen::Vector3f axis = cascade.axes.row(i).transpose().cast<float>();
        selection.axes[static_cast<std::size_t>(i)] = {axis.x(), axis.y(), axis.z(),
                                                       static_cast<float>(centre[i])};
    }
    selection.sizes = {static_cast<float>(cascade.half_side), static_cast<float>(radius),
                       has_indices ? 1.0f : 6.0f, 0.0f};
    selections_.push_back(selection);
    const Part part = {.first = copy_count_, .count = count, .command_byte = 4 * word};
    copy_count_ += count;
    most_selected_ = std::max(most_selected_, count);
    return part;
}

// Runs the selections of select_on_device().
Result<void> ObjectCasters::run_selections(GLuint instances) {
    if (selections_.empty()) return {};
    const std::size_t bytes = selections_.size() * sizeof(Selection);
    TERRANE_TRY(selection_words_.reserve(bytes, false));
    TERRANE_TRY(copies_.reserve(copy_count_ * sizeof(ObjectInstance), false));
    TERRANE_TRY(commands_.reserve(4 * command_words_.size(), false));
    selection_words_.write(0, selections_.data(), bytes);
    commands_.write(0, command_words_.data(), 4 * command_words_.size());
    GLuint binding = 0;
    for (const GLuint buffer :
         {selection_words_.name(), instances, copies_.name(), commands_.name()})
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding++, buffer);
    glUseProgram(selecting_.name());
    constexpr std::uint32_t kGroup = 64;
    glDispatchCompute((most_selected_ + kGroup - 1) / kGroup,
                      static_cast<GLuint>(selections_.size()), 1);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT |
                    GL_VERTEX_ATTRIB_ARRAY_BARRIER_BIT);
    return {};
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
    selections_.clear();
    command_words_.clear();
    copy_count_ = most_selected_ = 0;
    GLuint device_instances = 0;
    for (const OpaqueDraw& draw : solids) {
        if ((draw.material->features & kCut) == 0) continue;
        TERRANE_TRY(cut_meshes_.make(draw.material->features));
    }
    for (std::size_t i = 0; i < cascades.size(); ++i) {
        List& list = lists_[i];
        list.solids.clear();
        list.billboards.clear();
        const auto add = [&](const auto& draw, std::size_t number, double radius, GLuint on_device,
                             const PartCommand& command, std::vector<Part>& parts) {
            Part part;
            if (on_device != 0) {
                device_instances = on_device;
                part = select_on_device(draw.first_instance, draw.instance_count, radius,
                                        cascades[i], eye_world, command, &parts == &list.solids);
            } else {
                part = select(instances.subspan(draw.first_instance, draw.instance_count), radius,
                              cascades[i], eye_world);
            }
            part.draw = number;
            if (part.count > 0) parts.push_back(part);
        };
        for (std::size_t number = 0; number < solids.size(); ++number) {
            const OpaqueDraw& draw = solids[number];
            add(draw, number, radius_of(draw), draw.device_instances,
                {.index_count = draw.index_count,
                 .first_index = static_cast<std::uint32_t>(draw.index_byte / 4),
                 .first_instance = copy_count_},
                list.solids);
        }
        for (std::size_t number = 0; number < billboards.size(); ++number) {
            const BillboardDraw& draw = billboards[number];
            // the words of a DrawArraysIndirectCommand
            add(draw, number, radius_of(*draw.impostor), draw.device_instances,
                {.index_count = 0, .instance_count = 1}, list.billboards);
        }
    }
    TERRANE_TRY(run_selections(device_instances));
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
    glVertexArrayVertexBuffer(layout, 1, instances_of(part), 0, sizeof(ObjectInstance));
    if (draw.has_own_vertices) {
        bind_own_vertices(layout, frame_stream_, draw.vertex_byte);
    }
    if (draw.has_own_indices) glVertexArrayElementBuffer(layout, frame_stream_);
    // OpenGL passes offsets in buffers as pointers
    if (part.command_byte) {
        glDrawElementsIndirect(GL_TRIANGLES, GL_UNSIGNED_INT,
                               reinterpret_cast<const void*>(*part.command_byte));
        return;
    }
    glDrawElementsInstancedBaseInstance(GL_TRIANGLES, static_cast<GLsizei>(draw.index_count),
                                        GL_UNSIGNED_INT,
                                        reinterpret_cast<const void*>(draw.index_byte),
                                        static_cast<GLsizei>(part.count), part.first);
}

void ObjectCasters::draw(std::size_t cascade) const {
    const List& list = lists_[cascade];
    if (list.solids.empty() && list.billboards.empty()) return;
    if (!selections_.empty()) glBindBuffer(GL_DRAW_INDIRECT_BUFFER, commands_.name());
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
    for (const Part& part : list.billboards) {
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, instances_of(part));
        const StoredImpostor& impostor = *billboards_[part.draw].impostor;
        impostors_.set(impostor, part.first);
        glBindTextureUnit(0, impostor.colours.name());
        if (part.command_byte) {
            glDrawArraysIndirect(GL_TRIANGLES, reinterpret_cast<const void*>(*part.command_byte));
        } else {
            glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(6 * part.count));
        }
    }
}

void ObjectCasters::finish() {
    if (!selected_.empty()) stream_.end();
}

}  // namespace terrane::internal
