// SPDX-License-Identifier: MIT
#include "objects/object_programs.h"

#include "gl/shader.h"
#include "objects/store/object_layout.h"

#include <string>

namespace terrane::internal {

Result<ImpostorProgram> make_impostor_program(const std::string& name, std::string_view vertex,
                                              std::string_view fragment) {
    Result<GlProgram> made = make_program(name, vertex, fragment);
    if (!made) return tl::unexpected(made.error());
    const auto place = [&](const char* uniform) {
        return glGetUniformLocation(made->name(), uniform);
    };
    ImpostorProgram program;
    program.first_instance = place("first_instance");
    program.centre = place("centre");
    program.half_box = place("half_box");
    program.views = place("views");
    program.radius = place("radius");
    program.texels = place("texels");
    program.program = std::move(*made);
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

Result<ObjectPrograms> ObjectPrograms::create(int sample_count, const std::string& lighting) {
    const std::string samples = "#define SAMPLES " + std::to_string(sample_count) + "\n";
    const std::string covered = samples + lighting + std::string(coverage_glsl);
    Result<GlProgram> meshes =
        make_program("objects' meshes", instance_vert, covered + std::string(instance_frag));
    if (!meshes) return tl::unexpected(meshes.error());
    Result<ImpostorProgram> impostors =
        make_impostor_program("impostors", impostor_vert, covered + std::string(impostor_frag));
    if (!impostors) return tl::unexpected(impostors.error());
    Result<ImpostorProgram> small_impostors =
        make_impostor_program("small impostors", lighting + std::string(small_impostor_vert),
                              covered + std::string(small_impostor_frag));
    if (!small_impostors) return tl::unexpected(small_impostors.error());
    Result<GlProgram> particles =
        make_program("particles", particle_vert, samples + lighting + std::string(particle_frag));
    if (!particles) return tl::unexpected(particles.error());
    ObjectPrograms made;
    made.meshes = std::move(*meshes);
    made.impostors = std::move(*impostors);
    made.small_impostors = std::move(*small_impostors);
    made.particles = std::move(*particles);
    made.object_layout = make_object_layout();
    made.no_layout = make_vertex_array();
    return made;
}

}  // namespace terrane::internal
