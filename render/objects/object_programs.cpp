// SPDX-License-Identifier: MIT
#include "objects/object_programs.h"

#include "gl/shader.h"
#include "objects/object_layout.h"

#include <string>

namespace terrane::internal {

Result<ObjectPrograms> ObjectPrograms::create(int sample_count) {
    const std::string samples = "#define SAMPLES " + std::to_string(sample_count) + "\n";
    const std::string covered = samples + std::string(coverage_glsl);
    Result<GlProgram> meshes =
        make_program("objects' meshes", instance_vert, covered + std::string(instance_frag));
    if (!meshes) return tl::unexpected(meshes.error());
    Result<GlProgram> impostors =
        make_program("impostors", impostor_vert, covered + std::string(impostor_frag));
    if (!impostors) return tl::unexpected(impostors.error());
    Result<GlProgram> particles =
        make_program("particles", particle_vert, samples + std::string(particle_frag));
    if (!particles) return tl::unexpected(particles.error());
    ObjectPrograms made;
    made.centre = glGetUniformLocation(impostors->name(), "centre");
    made.half_box = glGetUniformLocation(impostors->name(), "half_box");
    made.views = glGetUniformLocation(impostors->name(), "views");
    made.radius = glGetUniformLocation(impostors->name(), "radius");
    made.texels = glGetUniformLocation(impostors->name(), "texels");
    made.meshes = std::move(*meshes);
    made.impostors = std::move(*impostors);
    made.particles = std::move(*particles);
    made.object_layout = make_object_layout();
    made.particle_layout = make_particle_layout();
    return made;
}

}  // namespace terrane::internal
