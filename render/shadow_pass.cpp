// SPDX-License-Identifier: MIT
#include "shadow_pass.h"

namespace terrane::internal {

ShadowPass::ShadowPass(const RendererSettings& settings)
    : sun_direction_(settings.sun_direction),
      distance_(settings.shadow_distance),
      maps_(settings.shadow_texels) {
    for (GlBuffer& buffer : uniforms_) {
        buffer = make_buffer();
        glNamedBufferStorage(buffer.name(), sizeof(FrameUniforms), nullptr, GL_DYNAMIC_STORAGE_BIT);
    }
}

void ShadowPass::prepare(const View& view) {
    cascades_ = make_sun_cascades(view, sun_direction_, distance_, maps_.texels());
}

void ShadowPass::bind_uniforms(std::size_t cascade, const FrameUniforms& of_view,
                               const View& view) const {
    FrameUniforms uniforms = of_view;
    uniforms.clip_from_eye = cascades_[cascade].clip_from_eye(view.eye_world);
    glNamedBufferSubData(uniforms_[cascade].name(), 0, sizeof(uniforms), &uniforms);
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, uniforms_[cascade].name());
}

}  // namespace terrane::internal
