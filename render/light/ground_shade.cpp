// SPDX-License-Identifier: MIT
#include "light/ground_shade.h"

#include "gl/shader.h"
#include "light/ground_noise.h"

#include <string>

namespace terrane::internal {

Result<GroundShade> GroundShade::create(int sample_count, const std::string& lighting) {
    GroundShade made;
    for (const bool has_overlay : {false, true}) {
        const std::string defines = "#define SAMPLES " + std::to_string(sample_count) +
                                    "\n#define OVERLAY " + (has_overlay ? "1\n" : "0\n");
        Result<GlProgram> program =
            make_program("the light", shade_vert, defines + lighting + std::string(shade_frag));
        if (!program) return tl::unexpected(program.error());
        (has_overlay ? made.with_overlay_ : made.plain_) = std::move(*program);
    }
    made.noise_ = make_ground_noise();
    made.no_layout_ = make_vertex_array();
    return made;
}

void GroundShade::draw(const Framebuffer& picture, bool has_overlay) const {
    picture.bind_colours();
    glDisable(GL_DEPTH_TEST);
    light_->bind();
    glBindTextureUnit(1, noise_.name());
    glBindTextureUnit(2, picture.depth_texture());
    glBindTextureUnit(3, picture.overlay_texture());
    glUseProgram((has_overlay ? with_overlay_ : plain_).name());
    glBindVertexArray(no_layout_.name());
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

}  // namespace terrane::internal
