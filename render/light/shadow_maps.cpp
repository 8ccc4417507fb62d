// SPDX-License-Identifier: MIT
//
// Sources:   R. Dimitrov. Cascaded Shadow Maps. NVIDIA 2007 (cascades).
//            M. Valient. Stable Rendering of Cascaded Shadow Maps. ShaderX 6, 2008 (sphere, moved by whole texels).
// Deviation: cascades are split by distance from the eye, not by depth along the view, so that the cascade of a point
//            does not change when the view turns.
#include "light/shadow_maps.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

// Margin around the receivers of a map, texels: snapping to whole texels takes half a texel, the rest is for the
// filter and the receiver's displacement (shadow.glsl).
constexpr double kBorderTexels = 4.0;

// Axes of the shadow maps as rows: right, up and towards the sun.
Eigen::Matrix3d axes_towards(const Eigen::Vector3d& direction) {
    const Eigen::Vector3d sun = direction / direction.norm();
    // the world axis with the largest angle to the sun's direction
    int least = 0;
    sun.cwiseAbs().minCoeff(&least);
    Eigen::Vector3d right = Eigen::Vector3d::Unit(least).cross(sun);
    right /= right.norm();
    Eigen::Matrix3d axes;
    axes.row(0) = right;
    axes.row(1) = sun.cross(right);
    axes.row(2) = sun;
    return axes;
}

// The smallest sphere around the part of a cone within `reach` of its apex, the eye. The sphere's centre is at distance
// `forward` from the eye on the cone's axis.
struct ConeSphere {
    double forward = 0.0, radius = 0.0;
};

ConeSphere sphere_around_cone(double half_angle_tangent, double reach) {
    const double cosine = 1.0 / std::sqrt(1.0 + half_angle_tangent * half_angle_tangent);
    // narrow: apex and rim are on the sphere; wide: the rim is a great circle of it
    if (half_angle_tangent <= 1.0) return {0.5 * reach / cosine, 0.5 * reach / cosine};
    return {reach * cosine, reach * cosine * half_angle_tangent};
}

}  // namespace

bool SunCascade::meets(const Aabb& box_world) const {
    const Eigen::Vector3d middle = 0.5 * (box_world.low + box_world.high);
    const Eigen::Vector3d half = 0.5 * (box_world.high - box_world.low);
    const Eigen::Vector3d from_centre = axes * middle - centre;
    const Eigen::Vector3d extent = axes.cwiseAbs() * half;
    return std::abs(from_centre.x()) <= half_side + extent.x() &&
           std::abs(from_centre.y()) <= half_side + extent.y() &&
           from_centre.z() >= -half_side - extent.z();
}

bool SunCascade::meets(const BoundingSphere& sphere_world) const {
    const Eigen::Vector3d from_centre = axes * sphere_world.centre - centre;
    const double limit = half_side + sphere_world.radius;
    return std::abs(from_centre.x()) <= limit && std::abs(from_centre.y()) <= limit &&
           from_centre.z() >= -limit;
}

Eigen::Vector3d SunCascade::centre_from(const WorldPos& eye_world) const {
    return centre - axes * eye_world;
}

std::array<float, 16> SunCascade::clip_from_eye(const WorldPos& eye_world) const {
    const Eigen::Vector3d middle = centre_from(eye_world);
    std::array<float, 16> clip{};
    for (int column = 0; column < 3; ++column) {
        for (int row = 0; row < 3; ++row) {
            // depth is in 0 to 1, x and y in -1 to 1
            const double scale = (row == 2 ? 0.5 : 1.0) / half_side;
            clip[static_cast<std::size_t>(4 * column + row)] =
                static_cast<float>(axes(row, column) * scale);
        }
    }
    clip[12] = static_cast<float>(-middle.x() / half_side);
    clip[13] = static_cast<float>(-middle.y() / half_side);
    clip[14] = static_cast<float>(0.5 - 0.5 * middle.z() / half_side);
    clip[15] = 1.0f;
    return clip;
}

std::array<SunCascade, kCascades> make_sun_cascades(const View& view,
                                                    const Eigen::Vector3d& sun_direction,
                                                    double distance, int texels) {
    const Eigen::Matrix3d axes = axes_towards(sun_direction);
    // tangent of half the opening angle of the cone through the picture's corners
    const double half_height = std::tan(0.5 * view.vertical_fov);
    const double tangent = half_height * std::hypot(1.0, 1.0 * view.width_px / view.height_px);
    std::array<SunCascade, kCascades> cascades;
    double reach = distance;
    for (int i = kCascades; i-- > 0; reach /= kCascadeRatio) {
        SunCascade& cascade = cascades[static_cast<std::size_t>(i)];
        const ConeSphere sphere = sphere_around_cone(tangent, reach);
        cascade.axes = axes;
        cascade.reach = reach;
        cascade.half_side = sphere.radius * texels / (texels - 2.0 * kBorderTexels);
        const double texel = 2.0 * cascade.half_side / texels;
        cascade.centre = axes * (view.eye_world + sphere.forward * view.forward);
        for (int axis = 0; axis < 2; ++axis)
            cascade.centre[axis] = texel * std::round(cascade.centre[axis] / texel);
    }
    return cascades;
}

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

// Slope-scaled depth bias, away from the sun, in units of the depth's slope over a texel: the filter of shadow.glsl
// compares with depths up to a texel and a half beside the receiver. Measured: 1 leaves stripes on planes in low sun,
// 1.5 none.
constexpr float kSlopeOffset = 2.0f;
// The same towards the sun for the ground's back faces: moves them into the ground, so that no light passes at their
// foot.
constexpr float kGroundOffset = 1.0f;

ShadowBlock::Vec4 pack(const Eigen::Vector3d& v, double w) {
    return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()),
            static_cast<float>(w)};
}

}  // namespace

ShadowMaps::ShadowMaps(int texels, double sun_radius)
    : texels_(texels),
      sun_radius_(sun_radius),
      depths_(make_texture_2d_array()),
      places_(make_buffer()) {
    const GLuint name = depths_.name();
    glTextureStorage3D(name, 1, GL_DEPTH_COMPONENT32F, texels, texels, kCascades);
    glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    // a comparison gives 1 if the receiver is not farther from the sun than the depth in the map
    glTextureParameteri(name, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    glTextureParameteri(name, GL_TEXTURE_COMPARE_FUNC, GL_GEQUAL);
    glNamedBufferStorage(places_.name(), sizeof(ShadowBlock), nullptr, GL_DYNAMIC_STORAGE_BIT);
    if (sun_radius > 0.0) {
        plain_ = make_sampler();
        glSamplerParameteri(plain_.name(), GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        glSamplerParameteri(plain_.name(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
        glSamplerParameteri(plain_.name(), GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        glSamplerParameteri(plain_.name(), GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    }
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

void ShadowMaps::begin_ground() {
    glEnable(GL_CULL_FACE);
    glCullFace(GL_FRONT);
    glPolygonOffset(kGroundOffset, 0.0f);
}

void ShadowMaps::end_ground() {
    glDisable(GL_CULL_FACE);
    glCullFace(GL_BACK);
    glPolygonOffset(-kSlopeOffset, 0.0f);
}

void ShadowMaps::end_cascades() const {
    glDisable(GL_POLYGON_OFFSET_FILL);
    glDisable(GL_DEPTH_CLAMP);
}

void ShadowMaps::bind(std::span<const SunCascade, kCascades> cascades,
                      const WorldPos& eye_world) const {
    ShadowBlock block;
    block.right = pack(cascades[0].axes.row(0), std::tan(sun_radius_));
    block.up = pack(cascades[0].axes.row(1), 0.0);
    for (std::size_t i = 0; i < kCascades; ++i) {
        block.places[i] = pack(cascades[i].centre_from(eye_world), 0.5 / cascades[i].half_side);
        block.reach[i] = static_cast<float>(cascades[i].reach);
    }
    block.reach[3] = static_cast<float>(1.0 / texels_);
    glNamedBufferSubData(places_.name(), 0, sizeof(block), &block);
    glBindBufferBase(GL_UNIFORM_BUFFER, 2, places_.name());
    glBindTextureUnit(6, depths_.name());
    if (sun_radius_ > 0.0) {
        glBindTextureUnit(14, depths_.name());
        glBindSampler(14, plain_.name());
    }
}

std::size_t ShadowMaps::bytes() const {
    const auto side = static_cast<std::size_t>(texels_);
    return sizeof(float) * kCascades * side * side;
}

ShadowPass::ShadowPass(const RendererSettings& settings)
    : sun_direction_(settings.sun_direction),
      distance_(settings.shadow_distance),
      maps_(settings.shadow_texels, settings.sun_radius) {
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
