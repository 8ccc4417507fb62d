// SPDX-License-Identifier: MIT
#include "objects/scene_objects.h"

#include "gl/gl_object.h"
#include "objects/mesh_store.h"

#include <terrane/base/result.h>
#include <terrane/base/text.h>
#include <terrane/scene/scene_draws.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

namespace terrane::internal {

/// Fails: invalid_argument for a number that is not finite, a scale or radius that is not above 0, or a coverage
///        outside -1 to 2; the message names the first such instance or particle
Result<void> check_values(const SceneDraws& draws);

/// Fails: invalid_argument for a range that ends beyond the instances, `of` in all
Result<void> check_instances(std::size_t of, std::uint32_t first, std::uint32_t count);

/// Fails: invalid_argument if there are positions but not one for each vertex, if a position is not finite, if a
///        triangle refers to a vertex beyond the mesh's, and for more triangles than OpenGL can draw
Result<void> check_streamed(const StreamedDraw& streamed, std::size_t vertex_count);

namespace {

// A number times 0 is 0 if it is finite, else NaN.
template <std::size_t count>
bool is_finite(const std::array<float, count>& values) {
    float sum = 0.0f;
    for (const float value : values) sum += 0.0f * value;
    return sum == 0.0f;
}

bool is_finite(const ObjectInstance& instance) {
    return is_finite(std::bit_cast<std::array<float, sizeof(instance) / sizeof(float)>>(instance));
}

bool is_finite(const Particle& p) {
    const auto& [x, y, z] = p.offset_eye;
    return is_finite(p.colour) && is_finite(std::array{x, y, z, p.radius, p.turn});
}

}  // namespace

Result<void> check_values(const SceneDraws& draws) {
    for (std::size_t i = 0; i < draws.instances.size(); ++i) {
        const ObjectInstance& instance = draws.instances[i];
        if (!is_finite(instance)) {
            return fail(ErrorCode::invalid_argument,
                        "instance " + number_text(i) + " must have finite numbers only");
        }
        if (!(instance.scale > 0.0f)) {
            return fail(ErrorCode::invalid_argument, "instance " + number_text(i) +
                                                         " must have a scale > 0, got " +
                                                         number_text(instance.scale));
        }
        if (!(instance.coverage >= -1.0f && instance.coverage <= 2.0f)) {
            return fail(ErrorCode::invalid_argument, "instance " + number_text(i) +
                                                         " must have a coverage of -1 to 2, got " +
                                                         number_text(instance.coverage));
        }
    }
    for (std::size_t i = 0; i < draws.particles.size(); ++i) {
        const Particle& particle = draws.particles[i];
        if (is_finite(particle) && particle.radius > 0.0f) continue;
        return fail(ErrorCode::invalid_argument,
                    "particle " + number_text(i) +
                        " must have finite numbers and a radius > 0, got " +
                        number_text(particle.radius));
    }
    return {};
}

Result<void> check_instances(std::size_t of, std::uint32_t first, std::uint32_t count) {
    if (std::size_t{first} + count <= of) return {};
    return fail(ErrorCode::invalid_argument, "the scene has " + number_text(of) +
                                                 " instances, a draw's end at " +
                                                 number_text(std::size_t{first} + count));
}

Result<void> check_streamed(const StreamedDraw& streamed, std::size_t vertex_count) {
    if (!streamed.positions.empty() && streamed.positions.size() != vertex_count) {
        return fail(ErrorCode::invalid_argument,
                    "a streamed object must have one position a vertex, got " +
                        number_text(streamed.positions.size()) + " of " +
                        number_text(vertex_count));
    }
    for (const Eigen::Vector3f& p : streamed.positions) {
        if (p.allFinite()) continue;
        return fail(ErrorCode::invalid_argument,
                    "a streamed object must have finite positions, got one that is not at vertex " +
                        number_text(static_cast<std::size_t>(&p - streamed.positions.data())));
    }
    constexpr std::size_t kMostTriangles = std::numeric_limits<std::int32_t>::max() / 3;
    if (streamed.triangles.size() > kMostTriangles) {
        return fail(ErrorCode::invalid_argument,
                    "a streamed object must have at most " + number_text(kMostTriangles) +
                        " triangles, got " + number_text(streamed.triangles.size()));
    }
    for (const TriangleMesh::Triangle& t : streamed.triangles) {
        const std::uint32_t most = std::max({t[0], t[1], t[2]});
        if (most < vertex_count) continue;
        return fail(ErrorCode::invalid_argument, "a streamed triangle names vertex " +
                                                     number_text(most) + " of " +
                                                     number_text(vertex_count));
    }
    return {};
}

namespace {

tl::unexpected<Error> no_such(const char* what, std::uint32_t id) {
    return fail(ErrorCode::invalid_argument,
                std::string("the renderer has no ") + what + " " + number_text(id));
}

// Upper bound of the offset alignment of storage blocks on all devices.
constexpr std::size_t kObjectAlignment = 256;
std::size_t aligned(std::size_t byte) {
    return (byte + kObjectAlignment - 1) / kObjectAlignment * kObjectAlignment;
}

const void* as_pointer(std::size_t byte) {
    // OpenGL passes offsets in buffers as pointers
    return reinterpret_cast<const void*>(byte);
}

}  // namespace

Result<void> SceneObjects::make_programs() {
    if (programs_) return {};
    TERRANE_TRY(ObjectPrograms made, ObjectPrograms::create(sample_count_, lighting_));
    programs_ = std::move(made);
    return {};
}

Result<void> SceneObjects::set_lighting(const std::string& lighting) {
    if (programs_) {
        TERRANE_TRY(ObjectPrograms made, ObjectPrograms::create(sample_count_, lighting));
        if (!particle_images_.empty())
            TERRANE_TRY(made.make_image_particles(sample_count_, lighting));
        for (const unsigned features : meshes_.features())
            TERRANE_TRY(made.textured.make(features));
        programs_ = std::move(made);
    }
    lighting_ = lighting;
    return {};
}

Result<MeshId> SceneObjects::add_mesh(const TriangleMesh& mesh, std::span<const MeshLevel> levels,
                                      std::span<const MeshMaterial> materials) {
    TERRANE_TRY(make_programs());
    TERRANE_TRY(const MeshId id, meshes_.add(mesh, levels, materials, textures_));
    for (const StoredMaterial& material : meshes_.find(id)->materials) {
        if (material.features == 0) continue;
        if (const auto made = programs_->textured.make(material.features); !made) {
            meshes_.remove(id);
            return tl::unexpected(made.error());
        }
    }
    return id;
}

Result<ImpostorId> SceneObjects::add_impostor(MeshId mesh, const ImpostorSettings& settings) {
    const StoredMesh* stored = meshes_.find(mesh);
    if (stored == nullptr) return no_such("mesh", static_cast<std::uint32_t>(mesh));
    return impostors_.add(*stored, settings);
}

Result<GpuInstances*> SceneObjects::instance_device(bool is_hosted) {
    if (!instances_) {
        TERRANE_TRY(std::unique_ptr<GpuInstances> made,
                    GpuInstances::create(impostors_, is_hosted));
        instances_ = std::move(made);
    }
    return instances_.get();
}

Result<ParticleImageId> SceneObjects::add_particle_image(
    std::shared_ptr<const TextureImage> image) {
    TERRANE_TRY(make_programs());
    TERRANE_TRY(programs_->make_image_particles(sample_count_, lighting_));
    TERRANE_TRY(auto stored, textures_.add_particle_image(std::move(image)));
    const ParticleImageId id{++last_image_};
    particle_images_.emplace(id, std::move(stored));
    return id;
}

// @param device null: instances are in the frame's stream
Result<void> SceneObjects::add_meshes(std::span<const MeshDraw> meshes, std::size_t instance_count,
                                      const DeviceInstances* device) {
    for (const MeshDraw& draw : meshes) {
        const StoredMesh* mesh = meshes_.find(draw.mesh);
        if (mesh == nullptr) return no_such("mesh", static_cast<std::uint32_t>(draw.mesh));
        if (draw.level >= mesh->levels.size()) {
            return fail(ErrorCode::invalid_argument,
                        "the mesh has " + number_text(mesh->levels.size()) + " levels, got level " +
                            number_text(draw.level));
        }
        TERRANE_TRY(check_instances(instance_count, draw.first_instance, draw.instance_count));
        const StoredMesh::Level& level = mesh->levels[draw.level];
        if (draw.instance_count == 0 || level.index_count == 0) continue;
        for (const StoredMesh::Group& group : level.groups) {
            solid_.push_back(
                {.mesh = mesh,
                 .material = &mesh->materials[group.material],
                 .targets = level.targets.name(),
                 .texture_targets = level.texture_targets.name(),
                 .is_first = &group == level.groups.data(),
                 .index_byte = group.first_index * sizeof(std::uint32_t),
                 .index_count = group.index_count,
                 .first_instance = draw.first_instance,
                 .instance_count = draw.instance_count,
                 .device_instances = device != nullptr ? device->buffer : 0,
                 .clusters = device == nullptr && group.clusters ? &*group.clusters : nullptr});
        }
    }
    return {};
}

// @param device null: instances are in the frame's stream
Result<void> SceneObjects::add_impostors(std::span<const ImpostorDraw> impostors,
                                         std::size_t instance_count,
                                         const DeviceInstances* device) {
    for (const ImpostorDraw& draw : impostors) {
        const StoredImpostor* impostor = impostors_.find(draw.impostor);
        if (impostor == nullptr)
            return no_such("impostor", static_cast<std::uint32_t>(draw.impostor));
        TERRANE_TRY(check_instances(instance_count, draw.first_instance, draw.instance_count));
        if (draw.instance_count == 0) continue;
        BillboardDraw& made = impostor_draws_.emplace_back();
        made.impostor = impostor;
        made.first_instance = draw.first_instance;
        made.instance_count = draw.instance_count;
        if (device == nullptr) continue;
        made.device_instances = device->buffer;
        made.first_copy = draw.first_instance;
        made.small_count = device->small_count(draw.first_instance);
    }
    return {};
}

Result<void> SceneObjects::add_on_device(const SceneDraws& draws) {
    if (draws.device == nullptr) return {};
    TERRANE_TRY(add_meshes(draws.device_meshes, draws.device->count, draws.device));
    return add_impostors(draws.device_impostors, draws.device->count, draws.device);
}

Result<void> SceneObjects::collect(const SceneDraws& draws, bool has_casters) {
    TERRANE_TRY(add_on_device(draws));
    TERRANE_TRY(add_meshes(draws.meshes, draws.instances.size(), nullptr));
    TERRANE_TRY(add_impostors(draws.impostors, draws.instances.size(), nullptr));
    for (const StreamedDraw& streamed : draws.streamed) {
        TERRANE_TRY(add_streamed(draws, streamed));
    }
    drawn_solids_ = solid_.size();
    drawn_impostors_ = impostor_draws_.size();
    TERRANE_TRY(add_particles(draws.particles));
    if (!has_casters) return {};
    TERRANE_TRY(add_meshes(draws.caster_meshes, draws.instances.size(), nullptr));
    return add_impostors(draws.caster_impostors, draws.instances.size(), nullptr);
}

Result<void> SceneObjects::add_streamed(const SceneDraws& draws, const StreamedDraw& streamed) {
    const StoredMesh* mesh = meshes_.find(streamed.mesh);
    if (mesh == nullptr) return no_such("mesh", static_cast<std::uint32_t>(streamed.mesh));
    TERRANE_TRY(check_instances(draws.instances.size(), streamed.instance, 1));
    TERRANE_TRY(check_streamed(streamed, mesh->vertices.size()));
    // one draw for each material
    std::vector<std::uint32_t> counts(mesh->materials.size(), 0);
    for (const TriangleMesh::Triangle& t : streamed.triangles) ++counts[mesh->material_of(t)];
    bool is_first = true;
    for (std::size_t material = 0; material < counts.size(); ++material) {
        if (counts[material] == 0) continue;
        solid_.push_back({.mesh = mesh,
                          .material = &mesh->materials[material],
                          .is_first = std::exchange(is_first, false),
                          .has_own_vertices = !streamed.positions.empty(),
                          .has_own_indices = true,
                          .index_count = 3 * counts[material],
                          .first_instance = streamed.instance,
                          .instance_count = 1});
        streamed_.push_back(&streamed);
    }
    return {};
}

Result<void> SceneObjects::add_particles(std::span<const Particle> particles) {
    for (std::size_t i = 0; i < particles.size(); ++i) {
        const ParticleImageId image = particles[i].image;
        if (i == 0 || image != particles[i - 1].image) {
            ParticleRun run = {.first = i};
            if (image != ParticleImageId::soft_disc) {
                const auto found = particle_images_.find(image);
                if (found == particle_images_.end())
                    return no_such("image of particles", static_cast<std::uint32_t>(image));
                run.image = found->second.get();
            }
            particle_runs_.push_back(run);
        }
        ++particle_runs_.back().count;
    }
    return {};
}

// Copies the triangles of a streamed draw that have the draw's material.
void SceneObjects::copy_triangles(const OpaqueDraw& draw, const StreamedDraw& streamed,
                                  std::byte* memory) {
    if (draw.mesh->materials.size() == 1) {
        std::memcpy(memory, streamed.triangles.data(), streamed.triangles.size_bytes());
        return;
    }
    const auto material = static_cast<std::uint32_t>(draw.material - draw.mesh->materials.data());
    for (const TriangleMesh::Triangle& t : streamed.triangles) {
        if (draw.mesh->material_of(t) != material) continue;
        std::memcpy(memory, &t, sizeof(t));
        memory += sizeof(t);
    }
}

// The instances come first in the buffer, so that a draw's first_instance is also an index into the buffer.
Result<void> SceneObjects::upload(const SceneDraws& draws) {
    billboard_byte_ = aligned(draws.instances.size_bytes());
    billboard_count_ = 0;
    for (const BillboardDraw& draw : drawn_impostors())
        billboard_count_ += draw.device_instances != 0 ? 0 : draw.instance_count;
    particle_byte_ = aligned(billboard_byte_ + billboard_count_ * sizeof(ObjectInstance));
    command_byte_ = aligned(particle_byte_ + draws.particles.size_bytes());
    std::size_t end = aligned(command_byte_ + parts_.commands().size_bytes());
    const std::size_t first_streamed = drawn_solids_ - streamed_.size();
    for (std::size_t i = 0; i < streamed_.size(); ++i) {
        OpaqueDraw& draw = solid_[first_streamed + i];
        draw.vertex_byte = end;
        if (draw.has_own_vertices && draw.is_first) {
            end = aligned(end + draw.mesh->vertices.size() * sizeof(ObjectVertex));
        } else if (draw.has_own_vertices) {
            draw.vertex_byte = solid_[first_streamed + i - 1].vertex_byte;
        }
        draw.index_byte = end;
        end = aligned(end + draw.index_count * sizeof(std::uint32_t));
    }
    std::byte* memory = stream_.begin(std::max<std::size_t>(end, 16));
    if (memory == nullptr) {
        const std::string doing = "take " + number_text(end) + " bytes of the device for objects";
        TERRANE_TRY(check_gl(doing));
        return fail(ErrorCode::device_unavailable, "OpenGL cannot " + doing);
    }
    const auto copy = [&](std::size_t byte, const void* data, std::size_t bytes) {
        if (bytes > 0) std::memcpy(memory + byte, data, bytes);
    };
    copy(0, draws.instances.data(), draws.instances.size_bytes());
    sort_billboards(draws, memory + billboard_byte_);
    copy(particle_byte_, draws.particles.data(), draws.particles.size_bytes());
    copy(command_byte_, parts_.commands().data(), parts_.commands().size_bytes());
    std::vector<ObjectVertex> moved;
    for (std::size_t i = 0; i < streamed_.size(); ++i) {
        const OpaqueDraw& draw = solid_[first_streamed + i];
        copy_triangles(draw, *streamed_[i], memory + draw.index_byte);
        if (!draw.has_own_vertices || !draw.is_first) continue;
        moved = draw.mesh->vertices;
        for (std::size_t vertex = 0; vertex < moved.size(); ++vertex) {
            for (int axis = 0; axis < 3; ++axis)
                moved[vertex].position[axis] = streamed_[i]->positions[vertex][axis];
        }
        copy(draw.vertex_byte, moved.data(), moved.size() * sizeof(ObjectVertex));
    }
    return {};
}

// Copies the instances of impostors to a separate range, the small ones of each draw first.
void SceneObjects::sort_billboards(const SceneDraws& draws, std::byte* memory) {
    std::uint32_t copied = 0;
    for (BillboardDraw& draw : std::span(impostor_draws_).first(drawn_impostors_)) {
        if (draw.device_instances != 0) continue;
        const float most_squared = most_small_squared(pixels_per_radian_, draw.impostor->radius);
        std::byte* const first = memory + copied * sizeof(ObjectInstance);
        std::uint32_t small = 0, large = 0;
        for (const ObjectInstance& instance :
             draws.instances.subspan(draw.first_instance, draw.instance_count)) {
            const auto& [x, y, z] = instance.offset_eye;
            const bool is_small =
                instance.scale * instance.scale <= most_squared * (x * x + y * y + z * z);
            const std::uint32_t place = is_small ? small++ : draw.instance_count - ++large;
            std::memcpy(first + place * sizeof(instance), &instance, sizeof(instance));
        }
        draw.first_copy = copied;
        draw.small_count = small;
        copied += draw.instance_count;
    }
}

Result<void> SceneObjects::prepare_casters(const SceneDraws& draws, const View& view,
                                           std::span<const SunCascade> cascades) {
    if (!casters_) {
        TERRANE_TRY(std::unique_ptr<ObjectCasters> made, ObjectCasters::create());
        casters_ = std::move(made);
    }
    return casters_->prepare(solid_, impostor_draws_, draws.instances, stream_.name(), cascades,
                             view.eye_world);
}

Result<void> SceneObjects::prepare(const SceneDraws& draws, const View& view,
                                   std::span<const SunCascade> cascades) {
    pixels_per_radian_ = view.pixels_per_radian();
    solid_.clear();
    impostor_draws_.clear();
    drawn_solids_ = drawn_impostors_ = 0;
    streamed_.clear();
    parts_.clear();
    particle_count_ = 0;
    particle_runs_.clear();
    object_count_ = triangle_count_ = 0;
    const auto give_up = [&](const Result<void>& failed) {
        solid_.clear();
        impostor_draws_.clear();
        return failed;
    };
    if (auto ok = check_values(draws); !ok) return give_up(ok);
    if (auto ok = collect(draws, !cascades.empty()); !ok) return give_up(ok);
    if (is_empty() && draws.particles.empty()) return {};
    if (auto ok = make_programs(); !ok) return give_up(ok);
    if (auto ok = prepare_textures(); !ok) return give_up(ok);
    if (subpixel_bits_ == 0) glGetIntegerv(GL_SUBPIXEL_BITS, &subpixel_bits_);
    parts_.prepare(std::span(solid_).first(drawn_solids_), draws.instances, view, subpixel_bits_);
    if (auto ok = upload(draws); !ok) return give_up(ok);
    if (!cascades.empty()) {
        if (auto ok = prepare_casters(draws, view, cascades); !ok) return give_up(ok);
    }
    particle_count_ = draws.particles.size();
    for (const OpaqueDraw& draw : drawn_solids()) {
        object_count_ += draw.is_first ? draw.instance_count : 0;
        triangle_count_ += std::size_t{draw.instance_count} * (draw.index_count / 3);
    }
    for (const BillboardDraw& draw : drawn_impostors()) {
        object_count_ += draw.instance_count;
        triangle_count_ += 2 * std::size_t{draw.instance_count};
    }
    triangle_count_ += 2 * particle_count_;
    return {};
}

// Marks the textures of a frame, casters included, and gives textures the memory that they may have.
Result<void> SceneObjects::prepare_textures() {
    has_textures_ = false;
    bool has_casters = false;
    textures_.begin_frame();
    for (std::size_t i = 0; i < solid_.size(); ++i) {
        if (solid_[i].material->features == 0) continue;
        textures_.mark_drawn(*solid_[i].material);
        (i < drawn_solids_ ? has_textures_ : has_casters) = true;
    }
    bool has_images = false;
    for (const ParticleRun& run : particle_runs_) {
        if (run.image == nullptr) continue;
        textures_.mark_drawn(*run.image);
        has_images = true;
    }
    if (!has_textures_ && !has_casters && !has_images) return {};
    return textures_.balance();
}

void SceneObjects::draw_mesh(const OpaqueDraw& draw, GLuint layout) const {
    bind_mesh(layout, *draw.mesh, draw.targets);
    const GLuint instances = draw.device_instances != 0 ? draw.device_instances : stream_.name();
    glVertexArrayVertexBuffer(layout, 1, instances, 0, sizeof(ObjectInstance));
    if (draw.has_own_vertices) {
        bind_own_vertices(layout, stream_.name(), draw.vertex_byte);
    }
    if (draw.has_own_indices) glVertexArrayElementBuffer(layout, stream_.name());
    if (draw.material->numbers.is_two_sided) {
        glDisable(GL_CULL_FACE);
    } else {
        glEnable(GL_CULL_FACE);
    }
    if (draw.has_parts) {
        glMultiDrawElementsIndirect(
            GL_TRIANGLES, GL_UNSIGNED_INT,
            as_pointer(command_byte_ + draw.first_part * sizeof(PartCommand)),
            static_cast<GLsizei>(draw.part_count), sizeof(PartCommand));
    } else {
        glDrawElementsInstancedBaseInstance(GL_TRIANGLES, static_cast<GLsizei>(draw.index_count),
                                            GL_UNSIGNED_INT, as_pointer(draw.index_byte),
                                            static_cast<GLsizei>(draw.instance_count),
                                            draw.first_instance);
    }
}

void SceneObjects::draw_solid() const {
    if (drawn_solids_ + drawn_impostors_ == 0) return;
    const GLuint layout = programs_->object_layout.name();
    glUseProgram(programs_->meshes.name());
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, stream_.name());
    for (const OpaqueDraw& draw : drawn_solids()) {
        if (draw.material->features == 0) draw_mesh(draw, layout);
    }
    if (has_textures_) {
        const GLuint textured_layout = programs_->textured_layout.name();
        for (const OpaqueDraw& draw : drawn_solids()) {
            if (draw.material->features == 0) continue;
            programs_->textured.of(draw.material->features).use(*draw.material);
            bind_texture_coordinates(textured_layout, *draw.mesh, draw.texture_targets);
            draw_mesh(draw, textured_layout);
        }
    }
    glDisable(GL_CULL_FACE);
    draw_billboards();
}

void SceneObjects::draw_billboards() const {
    if (drawn_impostors_ == 0) return;
    glBindVertexArray(programs_->no_layout.name());
    const auto bind_instances = [&](GLuint on_device) {
        if (on_device != 0) {
            glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, on_device);
        } else {
            glBindBufferRange(GL_SHADER_STORAGE_BUFFER, 1, stream_.name(),
                              static_cast<GLintptr>(billboard_byte_),
                              static_cast<GLsizeiptr>(billboard_count_ * sizeof(ObjectInstance)));
        }
    };
    const auto draw = [](const ImpostorProgram& program, const StoredImpostor& impostor,
                         std::uint32_t first, std::uint32_t count) {
        if (count == 0) return;
        glUseProgram(program.program.name());
        program.set(impostor, first);
        glBindTextureUnit(0, impostor.colours.name());
        glBindTextureUnit(1, impostor.shapes.name());
        glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(6 * count));
    };
    for (const BillboardDraw& each : drawn_impostors()) {
        bind_instances(each.device_instances);
        draw(programs_->small_impostors, *each.impostor, each.first_copy, each.small_count);
        draw(programs_->impostors, *each.impostor, each.first_copy + each.small_count,
             each.instance_count - each.small_count);
    }
}

void SceneObjects::draw_casters(std::size_t cascade) const {
    if (casters_ && !is_empty()) casters_->draw(cascade);
}

void SceneObjects::draw_particles(const Framebuffer& picture) const {
    if (particle_count_ == 0) return;
    picture.bind_overlay();
    glBindTextureUnit(2, picture.depth_texture());
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    glBindVertexArray(programs_->no_layout.name());
    glBindBufferRange(GL_SHADER_STORAGE_BUFFER, 1, stream_.name(),
                      static_cast<GLintptr>(particle_byte_),
                      static_cast<GLsizeiptr>(sizeof(Particle) * particle_count_));
    for (const ParticleRun& run : particle_runs_) {
        const bool has_image = run.image != nullptr;
        glUseProgram(has_image ? programs_->image_particles.name() : programs_->particles.name());
        if (has_image) glBindTextureUnit(kColourUnit, run.image->texture.name());
        glDrawArrays(GL_TRIANGLES, static_cast<GLint>(6 * run.first),
                     static_cast<GLsizei>(6 * run.count));
    }
    glDisable(GL_BLEND);
    glEnable(GL_DEPTH_TEST);
}

void SceneObjects::finish() {
    if (is_empty()) return;
    stream_.end();
    if (casters_) casters_->finish();
}

}  // namespace terrane::internal
