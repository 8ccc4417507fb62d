// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/convex_core.h"

#include <terrane/collision/shape_pairs.h>

#include <array>
#include <cstddef>
#include <span>

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

/// The support feature of a core along a contact's normal: a face, edge or vertex, projected onto the contact plane.
/// Faces with more than kMost vertices are thinned out.
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
    double turn_ = 1.0;  ///< -1 if the loop is clockwise in the plane
    double low_x_ = 0.0, high_x_ = 0.0, low_y_ = 0.0, high_y_ = 0.0;
};

/// Signed distance of two shapes, radii included.
struct Gap {
    double distance = 0.0;  ///< metres; overlapping: minus the length of the minimum translation
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, from b towards a
    /// Nearest points of the cores. Unset if `has_points` is false: then the cores overlap, and the deepest contact has
    /// the witness points.
    Eigen::Vector3d core_a = Eigen::Vector3d::Zero();
    Eigen::Vector3d core_b = Eigen::Vector3d::Zero();
    bool has_points = true;
};

/// Contacts of one normal, reduced to at most four.
class Manifold {
public:
    /// @param margin largest gap of a contact, metres
    Manifold(const Eigen::Vector3d& normal, double margin) : normal_(normal), margin_(margin) {}

    void add(const Eigen::Vector3d& point_on_a, double depth, ShapeFeature a, ShapeFeature b,
             std::uint32_t part_a = 0, std::uint32_t part_b = 0);
    bool is_empty() const { return count_ == 0; }
    bool has_depth(double depth) const { return count_ > 0 && deepest_ >= depth; }

    /// Writes the contacts, deepest first, and returns their number, at most four.
    std::size_t finish(std::array<PairContact, 4>& contacts_out);

private:
    // No initializers: most elements stay unused.
    struct Candidate {
        Eigen::Vector3d point;  ///< on a
        double depth;
        std::array<std::uint32_t, 6> features;  ///< of a, then of b: part, first, second

        bool is_before(const Candidate& other) const;
    };

    void sort();
    void reduce();

    static constexpr std::size_t kMost = 32;
    std::array<Candidate, kMost> candidates_;
    std::size_t count_ = 0;
    Eigen::Vector3d normal_;
    double margin_;
    double deepest_ = 0.0;
};

/// Adds the contacts of two cores: the intersection of their support features projected along gap.normal, and the
/// deepest contact if it is not among these.
void find_core_contacts(const Core& a, const Core& b, const Gap& gap, Manifold& manifold);

/// The same, but without adding the deepest contact.
void intersect_support_features(const Core& a, const Core& b, const Eigen::Vector3d& normal,
                                Manifold& manifold);

}  // namespace terrane::internal
