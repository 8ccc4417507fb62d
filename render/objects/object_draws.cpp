// SPDX-License-Identifier: MIT
#include "objects/object_draws.h"

#include "gl/shader.h"
#include "objects/mesh_store.h"

#include <terrane/scene/mesh_clusters.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

namespace terrane::internal {

Result<ImpostorProgram> make_impostor_program(const std::string& name, std::string_view vertex,
                                              std::string_view fragment) {
    TERRANE_TRY(GlProgram made, make_program(name, vertex, fragment));
    const auto place = [&](const char* uniform) {
        return glGetUniformLocation(made.name(), uniform);
    };
    ImpostorProgram program;
    program.first_instance = place("first_instance");
    program.centre = place("centre");
    program.half_box = place("half_box");
    program.views = place("views");
    program.radius = place("radius");
    program.texels = place("texels");
    program.program = std::move(made);
    return program;
}

void ImpostorProgram::set(const StoredImpostor& impostor, std::uint32_t first) const {
    glUniform1i(first_instance, static_cast<GLint>(first));
    glUniform3fv(centre, 1, impostor.centre.data());
    glUniform2f(half_box, impostor.half_width, impostor.half_height);
    glUniform2i(views, impostor.settings.views_around, impostor.settings.views_above);
    glUniform1f(radius, impostor.radius);
    glUniform1f(texels, static_cast<float>(impostor.settings.texels));
}

MaterialPrograms textured_programs(const std::string& before) {
    return {"textured meshes", ~0u, std::string(instance_vert), before, std::string(textured_frag)};
}

namespace {

std::string samples_text(int sample_count) {
    return "#define SAMPLES " + std::to_string(sample_count) + "\n";
}

}  // namespace

Result<ObjectPrograms> ObjectPrograms::create(int sample_count, const std::string& lighting) {
    const std::string samples = samples_text(sample_count);
    const std::string covered = samples + lighting + std::string(coverage_glsl);
    TERRANE_TRY(GlProgram meshes, make_program("objects' meshes", instance_vert,
                                               covered + std::string(instance_frag)));
    TERRANE_TRY(
        ImpostorProgram impostors,
        make_impostor_program("impostors", impostor_vert, covered + std::string(impostor_frag)));
    TERRANE_TRY(
        ImpostorProgram small_impostors,
        make_impostor_program("small impostors", lighting + std::string(small_impostor_vert),
                              covered + std::string(small_impostor_frag)));
    TERRANE_TRY(GlProgram particles, make_program("particles", particle_vert,
                                                  samples + lighting + std::string(particle_frag)));
    ObjectPrograms made;
    made.meshes = std::move(meshes);
    made.impostors = std::move(impostors);
    made.small_impostors = std::move(small_impostors);
    made.particles = std::move(particles);
    made.textured = textured_programs(covered);
    made.object_layout = make_object_layout();
    made.textured_layout = make_textured_layout();
    made.no_layout = make_vertex_array();
    return made;
}

Result<void> ObjectPrograms::make_image_particles(int sample_count, const std::string& lighting) {
    if (image_particles.name() != 0) return {};
    const std::string image = "#define IMAGE\n";
    TERRANE_TRY(
        GlProgram made,
        make_program("particles with images", image + std::string(particle_vert),
                     image + samples_text(sample_count) + lighting + std::string(particle_frag)));
    image_particles = std::move(made);
    return {};
}

namespace {

// An instance is drawn whole if fewer triangles than this would be omitted per command. On a software rasteriser a
// command costs about as much as this many triangles.
constexpr std::size_t kCommandTriangles = 64;

// Errors of instance.vert from rounding to float, relative to a vertex's distance from the object's origin and the eye.
constexpr double kVertexRounding = 0x1p-20;
constexpr double kEyeRounding = 0x1p-19;

// Error of window coordinates, which are rounded to float and to the device's subpixel grid: an angle in radians. It is
// computed for the picture's centre, where a pixel spans the largest angle.
double window_error(const View& view, int subpixel_bits) {
    const double grid_px = std::ldexp(1.0, -std::clamp(subpixel_bits, 1, 24));
    const double float_px = 0x1p-22 * std::max(view.width_px, view.height_px);
    return std::numbers::sqrt2 * (grid_px + float_px) / view.pixels_per_radian();
}

// Matrix of rotated() in light.glsl.
Eigen::Matrix3d matrix_of(const std::array<float, 4>& quaternion) {
    const Eigen::Vector4d q = Eigen::Vector4f(quaternion.data()).cast<double>();
    Eigen::Matrix3d cross;
    cross << 0.0, -q[2], q[1], q[2], 0.0, -q[0], -q[1], q[0], 0.0;
    return Eigen::Matrix3d::Identity() + 2.0 * q[3] * cross + 2.0 * cross * cross;
}

}  // namespace

void OpaqueParts::prepare(std::span<OpaqueDraw> solids, std::span<const ObjectInstance> instances,
                          const View& view, int subpixel_bits) {
    angle_error_ = window_error(view, subpixel_bits) + kEyeRounding;
    clear();
    for (OpaqueDraw& draw : solids) {
        if (draw.clusters == nullptr) continue;
        first_of_draw_ = commands_.size();
        for (std::uint32_t i = 0; i < draw.instance_count; ++i) {
            const std::uint32_t number = draw.first_instance + i;
            add_instance(draw, instances[number], number, view);
        }
        draw.has_parts = true;
        draw.first_part = static_cast<std::uint32_t>(first_of_draw_);
        draw.part_count = static_cast<std::uint32_t>(commands_.size() - first_of_draw_);
    }
}

void OpaqueParts::clear() {
    commands_.clear();
    culled_triangles_ = 0;
}

void OpaqueParts::add_instance(const OpaqueDraw& draw, const ObjectInstance& instance,
                               std::uint32_t number, const View& view) {
    const bool is_morphing = draw.targets != 0 && instance.coverage > 1.0f;
    if (is_morphing) return add_whole(draw, number);
    const auto scale = static_cast<double>(instance.scale);
    const Eigen::Vector3d origin_eye = Eigen::Vector3f(instance.offset_eye.data()).cast<double>();
    const Aabb& bounds = draw.mesh->bounds;
    const double radius = bounds.low.cwiseAbs().cwiseMax(bounds.high.cwiseAbs()).norm();
    const bool is_clipped = !(origin_eye.dot(view.forward) - scale * radius > view.near_distance);
    if (is_clipped) return add_whole(draw, number);
    // The transpose is the inverse for a unit quaternion; otherwise it moves the eye by less than four times the
    // difference between the quaternion's squared norm and 1.
    const Eigen::Vector4d q = Eigen::Vector4f(instance.rotation.data()).cast<double>();
    const Eigen::Matrix3d world_from_mesh = matrix_of(instance.rotation);
    const FacingView facing = {
        .eye_mesh = -(world_from_mesh.transpose() * origin_eye) / scale,
        .vertex_error = kVertexRounding * radius,
        .angle_error = angle_error_ + 4.0 * std::abs(q.squaredNorm() - 1.0),
    };
    draw.clusters->find_front_facing(facing, runs_);
    std::size_t kept = 0;
    for (const TriangleRun& run : runs_) kept += run.count;
    const std::size_t culled = draw.index_count / 3 - kept;
    if (culled < kCommandTriangles * runs_.size()) return add_whole(draw, number);
    culled_triangles_ += culled;
    const auto first_index = static_cast<std::uint32_t>(draw.index_byte / sizeof(std::uint32_t));
    for (const TriangleRun& run : runs_)
        commands_.push_back({.index_count = 3 * run.count,
                             .instance_count = 1,
                             .first_index = first_index + 3 * run.first,
                             .first_instance = number});
}

// Extends the previous command if that draws the preceding instances of the same draw whole; otherwise adds a command.
void OpaqueParts::add_whole(const OpaqueDraw& draw, std::uint32_t number) {
    if (commands_.size() > first_of_draw_) {
        PartCommand& last = commands_.back();
        if (last.index_count == draw.index_count &&
            last.first_instance + last.instance_count == number) {
            ++last.instance_count;
            return;
        }
    }
    commands_.push_back(
        {.index_count = draw.index_count,
         .instance_count = 1,
         .first_index = static_cast<std::uint32_t>(draw.index_byte / sizeof(std::uint32_t)),
         .first_instance = number});
}

}  // namespace terrane::internal
