// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/kernels/core.h"

#include <terrane/collision/shape_pairs.h>

#include <array>

namespace terrane::internal {

/// The plane orthogonal to a contact's normal.
struct ContactPlane {
    explicit ContactPlane(const Eigen::Vector3d& normal_in)
        : normal(normal_in), x(any_tangent(normal_in)), y(cross(normal_in, x)) {}

    Eigen::Vector3d at(double px, double py, double height) const {
        return px * x + py * y + height * normal;
    }

    Eigen::Vector3d normal;
    Eigen::Vector3d x;
    Eigen::Vector3d y;
};

/// The support feature of a core along a contact's normal: a face, an edge or a vertex, projected on the contact plane.
/// Faces with more than kMost vertices are thinned.
struct SupportPolygon {
    static constexpr std::size_t kMost = 32;

    /// @param side +1: the highest feature along the normal, -1: the lowest
    SupportPolygon(const Core& core, const ContactPlane& plane, double side);

    /// Height of the face at a point of the plane.
    double height(double px, double py) const { return base + slope_x * px + slope_y * py; }
    /// Whether a point of the plane is on the face, up to `slack` metres. False for edges and vertices.
    bool contains(double px, double py, double slack) const;
    ShapeFeature vertex_feature(std::size_t i) const { return {index[i], index[i]}; }
    ShapeFeature edge_feature(std::size_t i) const;
    ShapeFeature face_feature() const { return {face, ShapeFeature::kFace}; }

    std::size_t count = 0;
    std::array<double, kMost> x;
    std::array<double, kMost> y;
    std::array<double, kMost> h;  ///< heights along the normal
    std::array<std::uint32_t, kMost> index;
    bool is_face = false;
    std::uint32_t face = 0;
    double base = 0.0;
    double slope_x = 0.0;
    double slope_y = 0.0;

private:
    double turn_ = 1.0;  ///< -1 where the loop is clockwise in the plane
    double low_x_ = 0.0, high_x_ = 0.0, low_y_ = 0.0, high_y_ = 0.0;
};

}  // namespace terrane::internal
