// SPDX-License-Identifier: MIT
//
// Sources:
//   P. Lindstrom, V. Pascucci. Terrain Simplification Simplified: A General Framework for
//   View-Dependent Out-of-Core Visualization. IEEE TVCG 8(3), 2002. (nested errors and radii)
// Deviations: nested boxes instead of spheres, so that steep ground enlarges them in height only; their widths are
// constants of a level, their heights those of the ground there; errors are certified bounds, not measured at the
// midpoint; keys are inverse squares, which need neither root nor division.
//
// Boxes. From a centre of spacing s the midpoints of its square are s away along one axis; from a
// midpoint of spacing s the centres of spacing s / 2 are s / 2 away along both. So half the width of a
// centre's box is s + s / 2 + (s + s / 2) / 2 + ... = 3 s, of a midpoint's s / 2 + 3 s / 2 = 2 s.
#include "lod/keys/screen_error.h"

#include "chunks/chunk_reaches.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::internal {
namespace {

// Margin for the rounding of positions in single precision.
constexpr double kWider = 1.0 + 0x1p-20;
// Coordinates are clamped to this, metres, so that their squares stay finite.
constexpr double kFarthest = 1e16;

float round_up(double value) {
    const auto rounded = static_cast<float>(value);
    return static_cast<double>(rounded) < value
               ? std::nextafter(rounded, std::numeric_limits<float>::infinity())
               : rounded;
}

float round_down(double value) { return -round_up(-value); }

float clamped(double metres) {
    return static_cast<float>(std::clamp(metres, -kFarthest, kFarthest));
}

// The support point of a box in a direction.
Eigen::Vector3d support(const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                        const Eigen::Vector3d& along) {
    return {along.x() > 0.0 ? high.x() : low.x(), along.y() > 0.0 ? high.y() : low.y(),
            along.z() > 0.0 ? high.z() : low.z()};
}

ScreenError::WorldBox widened(const ScreenError::WorldBox& samples, const HeightInterval& heights,
                              float half_width) {
    const auto margin = static_cast<double>(half_width);
    return {{samples.low.x() - margin, samples.low.y() - margin, heights.low},
            {samples.high.x() + margin, samples.high.y() + margin, heights.high}};
}

}  // namespace

Reaches make_reaches(const HeightSource& source) {
    const Lattice& lattice = source.lattice();
    Reaches reaches;
    for (int exponent = 0; exponent < lattice.finest_level + 8; ++exponent) {
        const double spacing = std::ldexp(lattice.spacing, exponent);
        const ReachHeights up = reach_heights(source, spacing);
        reaches.midpoint.push_back(
            {round_up(2.0 * spacing * kWider), round_up(up.of_midpoint * kWider)});
        reaches.centre.push_back(
            {round_up(3.0 * spacing * kWider), round_up(up.of_centre * kWider)});
    }
    return reaches;
}

double clearance_of(const HeightSource& source, const WorldPos& eye) {
    const auto gap = [&](double around) {
        const HeightInterval heights = source.interval(
            {eye.x() - around, eye.y() - around, eye.x() + around, eye.y() + around});
        // an empty or invalid interval gives no bound
        const bool is_known = heights.low <= heights.high && heights.low <= kMostHeight &&
                              heights.high >= -kMostHeight;
        return is_known ? std::max(heights.low - eye.z(), eye.z() - heights.high) : 0.0;
    };
    constexpr int kTries = 12;
    constexpr double kSmaller = 0.75;
    double clearance = 0.0;
    // outside the square the surface is farther than its half width
    double around = gap(0.0);
    for (int i = 0; i < kTries && around > clearance; ++i, around *= kSmaller) {
        const double inside = gap(around);
        if (inside > clearance) clearance = std::min(inside, around);
    }
    return clearance * (1.0 - 1e-9);
}

ScreenError::ScreenError(const View& view, const HeightSource& source, double clearance)
    : lattice_(source.lattice()),
      eye_(view.eye_world),
      near_(view.near_distance),
      clearance_(clearance),
      pixels_(view.pixels_per_radian()),
      frustum_(make_frustum(view)) {
    near_squared_ =
        std::max(round_down(std::min(near_ * near_, 1e30)), std::numeric_limits<float>::min());
}

float ScreenError::key_of(double error_px) const {
    const double ratio = pixels_ / error_px;
    return static_cast<float>(
        std::min(ratio * ratio, static_cast<double>(std::numeric_limits<float>::max())));
}

double ScreenError::error_px_of(float key) const {
    return pixels_ / std::sqrt(static_cast<double>(key));
}

double ScreenError::error_px_at(double bound, double distance) const {
    return bound * pixels_ / std::max({near_, clearance_, distance});
}

float ScreenError::height_over_eye(double height) const { return clamped(height - eye_.z()); }

EyeHeights ScreenError::eye_heights(const Chunk& chunk) const {
    return {chunk.vertices->reach_unit, height_over_eye(chunk.vertices->reach_base), near_squared_};
}

void ScreenError::fill_axes(const Chunk& chunk, ChunkAxes& axes_out) const {
    for (int i = 0; i < kChunkSamples; ++i) {
        const auto k = static_cast<std::size_t>(i / 2);
        const float x = clamped(lattice_.x(chunk.corner.x + i * chunk.step) - eye_.x());
        const float y = clamped(lattice_.y(chunk.corner.y + i * chunk.step) - eye_.y());
        (i % 2 == 0 ? axes_out.x.even[k] : axes_out.x.odd[k]) = x;
        (i % 2 == 0 ? axes_out.y.even[k] : axes_out.y.odd[k]) = y;
    }
}

ScreenError::WorldBox ScreenError::box_of(const Chunk& chunk) const {
    const std::int64_t side = chunk.step * kChunkCells;
    return {{lattice_.x(chunk.corner.x), lattice_.y(chunk.corner.y), lattice_.quantum * chunk.low},
            {lattice_.x(chunk.corner.x + side), lattice_.y(chunk.corner.y + side),
             lattice_.quantum * chunk.high}};
}

ScreenError::WorldBox ScreenError::box_of_area(const Chunk& chunk, int area) const {
    const Chunk::Area& part = chunk.areas[static_cast<std::size_t>(area)];
    const std::int64_t west = chunk.corner.x + area % kChunkAreas * kAreaCells * chunk.step;
    const std::int64_t south = chunk.corner.y + area / kChunkAreas * kAreaCells * chunk.step;
    const std::int64_t side = kAreaCells * chunk.step;
    return {{lattice_.x(west), lattice_.y(south), lattice_.quantum * part.low},
            {lattice_.x(west + side), lattice_.y(south + side), lattice_.quantum * part.high}};
}

float ScreenError::least_key(const WorldBox& reach, float largest_bound, bool is_in_view) const {
    const Eigen::Vector3d low = reach.low - eye_;
    const Eigen::Vector3d high = reach.high - eye_;
    const double distance_squared =
        low.cwiseMax(-high).cwiseMax(Eigen::Vector3d::Zero()).squaredNorm();
    double weight = 1.0;
    if (!is_in_view) {
        double beside = 0.0;
        for (const Eigen::Vector3d& normal : frustum_.normals) {
            beside = std::max(beside, -normal.dot(support(low, high, normal)));
        }
        const double farthest = low.cwiseAbs().cwiseMax(high.cwiseAbs()).sum() + near_;
        weight = std::max(1.0 - static_cast<double>(kWeightSlope) * beside / farthest,
                          static_cast<double>(kLeastWeight));
    }
    const double bound = static_cast<double>(largest_bound);
    // 0.9999: the rounding of the keys themselves
    const double key = 0.9999 * std::max(distance_squared, near_ * near_) /
                       std::max(bound * bound * weight * weight,
                                static_cast<double>(std::numeric_limits<float>::min()));
    return static_cast<float>(
        std::min(key, static_cast<double>(std::numeric_limits<float>::max())));
}

ScreenError::WorldBox ScreenError::reach_of(const Chunk& chunk, float half_width) const {
    return widened(box_of(chunk), chunk.vertex_reach, half_width);
}

ScreenError::WorldBox ScreenError::reach_of_area(const Chunk& chunk, int area,
                                                 float half_width) const {
    return widened(box_of_area(chunk, area), chunk.vertices->reach_of_area(area), half_width);
}

KeyPlanes ScreenError::planes_across(const WorldBox& box) const {
    KeyPlanes planes;
    planes.near_distance = static_cast<float>(near_);
    for (const Eigen::Vector3d& normal : frustum_.normals) {
        if (normal.dot(support(box.low, box.high, -normal) - eye_) >= 0.0) continue;
        planes.x[planes.count] = static_cast<float>(normal.x());
        planes.y[planes.count] = static_cast<float>(normal.y());
        planes.z[planes.count] = static_cast<float>(normal.z());
        ++planes.count;
    }
    return planes;
}

double ScreenError::error_in_view(const WorldBox& box, double bound) const {
    const Eigen::Vector3d low = box.low - eye_;
    const Eigen::Vector3d high = box.high - eye_;
    const double slack = 1e-9 * (low.cwiseAbs().maxCoeff() + high.cwiseAbs().maxCoeff());
    for (const Eigen::Vector3d& normal : frustum_.normals) {
        if (normal.dot(support(low, high, normal)) < -slack) return 0.0;
    }
    const double distance = low.cwiseMax(-high).cwiseMax(Eigen::Vector3d::Zero()).norm();
    return error_px_at(bound, distance * (1.0 - 1e-12)) * (1.0 + 1e-12);
}

double ScreenError::error_in_view(const Triangle& triangle, double bound) const {
    // the triangle clipped to where the surface within `bound` of it may be in view (Sutherland-Hodgman)
    std::array<Eigen::Vector3d, 8> part, next;
    std::size_t count = 3;
    double farthest = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
        part[i] = triangle[i] - eye_;
        farthest = std::max(farthest, part[i].cwiseAbs().maxCoeff());
    }
    const double slack = 1e-9 * (farthest + bound);
    for (const Eigen::Vector3d& normal : frustum_.normals) {
        const double least = -std::abs(normal.z()) * bound - slack;
        std::size_t kept = 0;
        for (std::size_t i = 0; i < count; ++i) {
            const Eigen::Vector3d& a = part[i];
            const Eigen::Vector3d& b = part[i + 1 < count ? i + 1 : 0];
            const double above_a = normal.dot(a) - least, above_b = normal.dot(b) - least;
            if (above_a >= 0.0) next[kept++] = a;
            if ((above_a >= 0.0) != (above_b >= 0.0)) {
                next[kept++] = a + above_a / (above_a - above_b) * (b - a);
            }
        }
        if (kept == 0) return 0.0;
        std::swap(part, next);
        count = kept;
    }
    Eigen::Vector3d low = part[0], high = part[0];
    for (std::size_t i = 1; i < count; ++i) {
        low = low.cwiseMin(part[i]);
        high = high.cwiseMax(part[i]);
    }
    low.z() -= bound;
    high.z() += bound;
    const double distance = low.cwiseMax(-high).cwiseMax(Eigen::Vector3d::Zero()).norm();
    return error_px_at(bound, std::max(distance - slack, 0.0)) * (1.0 + 1e-12);
}

}  // namespace terrane::internal
