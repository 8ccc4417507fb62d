// SPDX-License-Identifier: MIT
#include "graph/node_checks.h"

#include "base/settings_check.h"
#include "base/vector_math.h"

#include <terrane/terrain/number_text.h>

#include <cmath>
#include <string>

namespace terrane::internal {
namespace {

constexpr double kMostPlace = 2e9;  // metres
constexpr double kMostRatio = 2.0;

Result<void> refuse(std::string message) {
    return fail(ErrorCode::invalid_argument, std::move(message));
}

Result<void> check_geometry(const GeometryNode& geometry) {
    const Aabb& box = geometry.bounds;
    if (is_finite(box.low) && is_finite(box.high) && (box.low.array() <= box.high.array()).all())
        return {};
    return refuse("bounds must be finite, low at most high");
}

Result<void> check_switch(const SwitchNode& levels) {
    if (auto ok = check_range("hysteresis", levels.hysteresis, 1.0, kMostRatio); !ok) return ok;
    if (auto ok = check_range("fade_ratio", levels.fade_ratio, 1.0, kMostRatio); !ok) return ok;
    if (levels.hysteresis > 1.0 && levels.fade_ratio > 1.0)
        return refuse("a switch has hysteresis or a fade_ratio, not both");
    if (levels.limits.empty()) return refuse("a switch needs at least one limit, got 0");
    for (std::size_t i = 0; i < levels.limits.size(); ++i) {
        const double limit = levels.limits[i];
        if (!(limit > 0.0))
            return refuse("limits must be above 0, got " + number_text(limit) + " at " +
                          number_text(i));
        if (i == 0 || limit >= levels.limits[i - 1] * levels.fade_ratio) continue;
        return refuse("limits must not decrease, and differ by fade_ratio at least, got " +
                      number_text(limit) + " after " + number_text(levels.limits[i - 1]));
    }
    return {};
}

Result<void> check_particles(const ParticlesNode& particles) {
    for (std::size_t i = 0; i < particles.discs.size(); ++i) {
        const ParticlesNode::Disc& disc = particles.discs[i];
        if (!is_finite(disc.centre))
            return refuse("the centre of disc " + number_text(i) + " must be finite");
        if (!(disc.radius > 0.0) || !std::isfinite(disc.radius)) {
            return refuse("the radius of disc " + number_text(i) + " must be above 0, got " +
                          number_text(disc.radius));
        }
    }
    return {};
}

}  // namespace

Result<void> check_place(const NodePlace& place) {
    if (auto ok = check_range("scale", place.scale, 1e-6, 1e6); !ok) return ok;
    const Pose& pose = place.parent_from_node;
    if (!(pose.translation.cwiseAbs().maxCoeff() <= kMostPlace) || !is_finite(pose.translation))
        return refuse("the translation must be within 2e9 m along each axis");
    if (!(column_error(pose.rotation) <= 1e-6) || !(determinant(pose.rotation) > 0.0))
        return refuse("the rotation must be orthonormal to 1e-6 with determinant 1");
    return {};
}

Result<void> check_content(const NodeContent& content) {
    if (const auto* geometry = std::get_if<GeometryNode>(&content))
        return check_geometry(*geometry);
    if (const auto* levels = std::get_if<SwitchNode>(&content)) return check_switch(*levels);
    if (const auto* particles = std::get_if<ParticlesNode>(&content))
        return check_particles(*particles);
    return {};
}

}  // namespace terrane::internal
