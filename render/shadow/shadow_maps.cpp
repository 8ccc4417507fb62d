// SPDX-License-Identifier: MIT
#include "shadow/shadow_maps.h"

namespace terrane::internal {
namespace {

// The uniform block `Shadow` of shadow.glsl, in its std140 layout.
struct ShadowBlock {
    using Vec4 = std::array<float, 4>;
    Vec4 right{}, up{};
    std::array<Vec4, kCascades> places{};
    Vec4 reach{};
};
static_assert(sizeof(ShadowBlock) == 16 * (3 + kCascades));
static_assert(kCascades == 3, "ShadowBlock::reach holds three distances");

// Depth is moved away from the sun by this many times its slope over a texel: the filter of shadow.glsl compares with
// depths up to a texel and a half beside the receiver. Measured: 1 leaves stripes on planes in low sun, 1.5 none.
constexpr float kSlopeOffset = 2.0f;

ShadowBlock::Vec4 pack(const Eigen::Vector3d& v, double w) {
    return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()),
            static_cast<float>(w)};
}

}  // namespace

ShadowMaps::ShadowMaps(int texels)
    : texels_(texels), depths_(make_texture_2d_array()), places_(make_buffer()) {
    const GLuint name = depths_.name();
    glTextureStorage3D(name, 1, GL_DEPTH_COMPONENT32F, texels, texels, kCascades);
    glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    // 1 where the receiver is no farther from the sun than the depth in the map
    glTextureParameteri(name, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    glTextureParameteri(name, GL_TEXTURE_COMPARE_FUNC, GL_GEQUAL);
    glNamedBufferStorage(places_.name(), sizeof(ShadowBlock), nullptr, GL_DYNAMIC_STORAGE_BIT);
    for (int cascade = 0; cascade < kCascades; ++cascade) {
        GlFramebuffer& target = targets_[static_cast<std::size_t>(cascade)];
        target = make_framebuffer();
        glNamedFramebufferTextureLayer(target.name(), GL_DEPTH_ATTACHMENT, name, 0, cascade);
        glNamedFramebufferDrawBuffer(target.name(), GL_NONE);
    }
}

void ShadowMaps::begin_cascade(int cascade) const {
    glBindFramebuffer(GL_FRAMEBUFFER, targets_[static_cast<std::size_t>(cascade)].name());
    glViewport(0, 0, texels_, texels_);
    // depths are clamped, so that casters between the sun and the map's near plane are kept
    glEnable(GL_DEPTH_CLAMP);
    glEnable(GL_POLYGON_OFFSET_FILL);
    glPolygonOffset(-kSlopeOffset, 0.0f);  // away from the sun: depth is reversed
    glClear(GL_DEPTH_BUFFER_BIT);
}

void ShadowMaps::end_cascades() const {
    glDisable(GL_POLYGON_OFFSET_FILL);
    glDisable(GL_DEPTH_CLAMP);
}

void ShadowMaps::bind(std::span<const SunCascade, kCascades> cascades,
                      const WorldPos& eye_world) const {
    ShadowBlock block;
    block.right = pack(cascades[0].axes.row(0), 0.0);
    block.up = pack(cascades[0].axes.row(1), 0.0);
    for (std::size_t i = 0; i < kCascades; ++i) {
        block.places[i] = pack(cascades[i].centre_from(eye_world), 0.5 / cascades[i].half_side);
        block.reach[i] = static_cast<float>(cascades[i].reach);
    }
    block.reach[3] = static_cast<float>(1.0 / texels_);
    glNamedBufferSubData(places_.name(), 0, sizeof(block), &block);
    glBindBufferBase(GL_UNIFORM_BUFFER, 2, places_.name());
    glBindTextureUnit(6, depths_.name());
}

std::size_t ShadowMaps::bytes() const {
    const auto side = static_cast<std::size_t>(texels_);
    return sizeof(float) * kCascades * side * side;
}

}  // namespace terrane::internal
