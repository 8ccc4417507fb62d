// SPDX-License-Identifier: MIT
//
// Sources:
//   P. Lindstrom, V. Pascucci. Terrain Simplification Simplified: A General Framework for
//   View-Dependent Out-of-Core Visualization. IEEE TVCG 8(3), 2002. (nested errors and radii)
// Deviations: radii are constants of a level, from the source's guaranteed rise, instead of stored
// with each vertex; the error is certified, not measured at the midpoint.
#include "screen_error.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terrane::internal {
namespace {

// Beside the view priorities fall to this share, so that a turning camera does not find bare roots.
constexpr float kLeastWeight = 1.0f / 16.0f;
// ... over a margin of a quarter of the distance.
constexpr float kWeightSlope = 4.0f;
// Takes up the rounding of distances in single precision.
constexpr float kShorter = 1.0f - 0x1p-20f;

float round_up(double value) {
    const auto rounded = static_cast<float>(value);
    return static_cast<double>(rounded) < value
               ? std::nextafter(rounded, std::numeric_limits<float>::infinity())
               : rounded;
}

}  // namespace

Radii make_radii(const HeightSource& source) {
    const Lattice& lattice = source.lattice();
    const auto reach = [&](double distance) {
        const double rise = source.rise_bound(distance) + lattice.quantum;
        return std::sqrt(distance * distance + rise * rise);
    };
    const int count = lattice.finest_level + 8;
    constexpr double kDiagonal = 0.70710678118654757;
    // below the finest spacing the steps shrink by half with each level, or faster, to the quantum
    constexpr int kBelow = 24;
    std::vector<double> centre(static_cast<std::size_t>(count));
    std::vector<double> midpoint(centre.size());
    Radii radii;
    double below = 0.0;  // radius of a centre of half the spacing
    for (int exponent = -kBelow; exponent < count; ++exponent) {
        const double spacing = std::ldexp(lattice.spacing, exponent);
        const double of_midpoint = reach(kDiagonal * spacing) + below;
        const double of_centre = reach(spacing) + of_midpoint;
        below = of_centre;
        if (exponent < 0) continue;
        const auto i = static_cast<std::size_t>(exponent);
        midpoint[i] = of_midpoint;
        centre[i] = of_centre;
    }
    for (const double radius : centre) radii.centre.push_back(round_up(radius));
    for (const double radius : midpoint) radii.midpoint.push_back(round_up(radius));
    return radii;
}

ScreenError::ScreenError(const View& view, const Lattice& lattice)
    : lattice_(lattice),
      eye_(view.eye_world),
      near_(view.near_distance),
      pixels_(view.pixels_per_radian()),
      frustum_(make_frustum(view)) {}

ScreenError::Axes ScreenError::axes(const Chunk& chunk) const {
    Axes axes;
    for (int i = 0; i < kChunkSamples; ++i) {
        const auto k = static_cast<std::size_t>(i);
        axes.x[k] = static_cast<float>(lattice_.x(chunk.corner.x + i * chunk.step) - eye_.x());
        axes.y[k] = static_cast<float>(lattice_.y(chunk.corner.y + i * chunk.step) - eye_.y());
    }
    return axes;
}

ScreenError::Box ScreenError::box_of(const Chunk& chunk) const {
    const std::int64_t side = chunk.step * kChunkCells;
    return {{lattice_.x(chunk.corner.x), lattice_.y(chunk.corner.y), lattice_.quantum * chunk.low},
            {lattice_.x(chunk.corner.x + side), lattice_.y(chunk.corner.y + side),
             lattice_.quantum * chunk.high}};
}

float ScreenError::upper_bound(const Chunk& chunk, float largest_radius) const {
    return upper_bound(box_of(chunk), static_cast<double>(chunk.max_vertex_bound),
                       static_cast<double>(largest_radius));
}

float ScreenError::upper_bound(const Chunk& chunk, int area, float largest_radius) const {
    const Chunk::Area& part = chunk.areas[static_cast<std::size_t>(area)];
    const std::int64_t west = chunk.corner.x + area % kChunkAreas * kAreaCells * chunk.step;
    const std::int64_t south = chunk.corner.y + area / kChunkAreas * kAreaCells * chunk.step;
    const std::int64_t side = kAreaCells * chunk.step;
    const Box box{
        {lattice_.x(west), lattice_.y(south), lattice_.quantum * part.low},
        {lattice_.x(west + side), lattice_.y(south + side), lattice_.quantum * part.high}};
    return upper_bound(box, static_cast<double>(part.max_vertex_bound),
                       static_cast<double>(largest_radius));
}

float ScreenError::upper_bound(const Box& box, double bound, double radius) const {
    const Eigen::Vector3d apart =
        (box.low - eye_).cwiseMax(eye_ - box.high).cwiseMax(Eigen::Vector3d::Zero());
    const Eigen::Vector3d far_corner =
        (box.low - eye_).cwiseAbs().cwiseMax((box.high - eye_).cwiseAbs());
    const double distance = std::max(near_, apart.norm() * (1.0 - 0x1p-19) - radius);
    double beside = 0.0;
    for (const Eigen::Vector3d& normal : frustum_.normals) {
        // the corner of the box that lies furthest in
        const Eigen::Vector3d corner(normal.x() > 0.0 ? box.high.x() : box.low.x(),
                                     normal.y() > 0.0 ? box.high.y() : box.low.y(),
                                     normal.z() > 0.0 ? box.high.z() : box.low.z());
        beside = std::max(beside, -(normal.dot(corner - eye_) + radius));
    }
    const double weight = std::max(
        1.0 - static_cast<double>(kWeightSlope) * beside / (far_corner.norm() + radius + near_),
        static_cast<double>(kLeastWeight));
    // the margin is for the rounding of the priorities themselves
    return round_up(1.0001 * weight * bound * pixels_ / distance);
}

ScreenError::Side ScreenError::side(const Chunk& chunk) const {
    const Box box = box_of(chunk);
    for (const Eigen::Vector3d& normal : frustum_.normals) {
        // the corner of the box that lies furthest out
        const Eigen::Vector3d corner(normal.x() > 0.0 ? box.low.x() : box.high.x(),
                                     normal.y() > 0.0 ? box.low.y() : box.high.y(),
                                     normal.z() > 0.0 ? box.low.z() : box.high.z());
        if (normal.dot(corner - eye_) < 0.0) return Side::crossing;
    }
    return Side::inside;
}

void ScreenError::priorities(const Chunk& chunk, const Axes& axes, const Span& span,
                             const float* radii, Side side, float* priorities_out) const {
    const auto pixels = static_cast<float>(pixels_);
    const auto nearest = static_cast<float>(near_);
    const auto count = static_cast<std::size_t>(span.count);
    const auto first = static_cast<std::size_t>(span.first);
    const float dy = axes.y[static_cast<std::size_t>(span.row)];
    const float* x = &axes.x[first];
    const std::int32_t* heights = &chunk.heights[sample_index(span.first, span.row)];
    const float* bounds = &chunk.vertex_bounds[sample_index(span.first, span.row)];
    radii += first;
    priorities_out += first;
    std::array<float, kChunkSamples> dz;
    std::array<float, kChunkSamples> distance;
    for (std::size_t i = 0; i < count; ++i) {
        dz[i] = static_cast<float>(lattice_.quantum * static_cast<double>(heights[i]) - eye_.z());
    }
    for (std::size_t i = 0; i < count; ++i) {
        distance[i] = std::sqrt(x[i] * x[i] + dy * dy + dz[i] * dz[i]);
    }
    for (std::size_t i = 0; i < count; ++i) {
        const float left = distance[i] * kShorter - radii[i];
        priorities_out[i] = bounds[i] * pixels / (left > nearest ? left : nearest);
    }
    if (side == Side::inside) return;

    std::array<float, kChunkSamples> beside;  // how far outside the nearest side plane
    std::fill_n(beside.begin(), count, 0.0f);
    for (const Eigen::Vector3d& normal : frustum_.normals) {
        const auto nx = static_cast<float>(normal.x());
        const auto ny = static_cast<float>(normal.y());
        const auto nz = static_cast<float>(normal.z());
        const float from_row = ny * dy;
        for (std::size_t i = 0; i < count; ++i) {
            // a little further in, for the rounding
            const float in = nx * x[i] + from_row + nz * dz[i] + radii[i] + distance[i] * 0x1p-18f;
            beside[i] = -in > beside[i] ? -in : beside[i];
        }
    }
    for (std::size_t i = 0; i < count; ++i) {
        const float weight = 1.0f - kWeightSlope * beside[i] / (distance[i] + radii[i] + nearest);
        priorities_out[i] *= weight > kLeastWeight ? weight : kLeastWeight;
    }
}

float ScreenError::error_in_view(const Box& box, double bound) const {
    const Eigen::Vector3d low = box.low - eye_;
    const Eigen::Vector3d high = box.high - eye_;
    const double slack = 1e-9 * (low.cwiseAbs().maxCoeff() + high.cwiseAbs().maxCoeff());
    for (const Eigen::Vector3d& normal : frustum_.normals) {
        // the corner that lies furthest in
        const Eigen::Vector3d corner(normal.x() > 0.0 ? high.x() : low.x(),
                                     normal.y() > 0.0 ? high.y() : low.y(),
                                     normal.z() > 0.0 ? high.z() : low.z());
        if (normal.dot(corner) < -slack) return 0.0f;
    }
    const double distance = low.cwiseMax(-high).cwiseMax(Eigen::Vector3d::Zero()).norm();
    return round_up(bound * pixels_ / std::max(near_, distance));
}

}  // namespace terrane::internal
