// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/kernels/core.h"

#include <terrane/collision/shape_pairs.h>

#include <array>
#include <cstddef>
#include <span>

namespace terrane::internal {

/// Signed distance of two shapes, radii included.
struct Gap {
    double distance = 0.0;  ///< metres: the gap, or minus the length of the min translation
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, from b towards a
    /// Nearest points of the cores; unset where `has_points` is false: the cores overlap, and the witness points are
    /// those of the deepest contact.
    Eigen::Vector3d core_a = Eigen::Vector3d::Zero();
    Eigen::Vector3d core_b = Eigen::Vector3d::Zero();
    bool has_points = true;
};

/// Contacts of one normal, reduced to at most four.
class Manifold {
public:
    /// @param margin contacts with a gap up to it are kept, metres
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
        std::array<std::uint32_t, 6> features;  ///< part, first, second of a; of b

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

/// Contacts of two cores along gap.normal: the intersection of their support features, projected along it.
void find_core_contacts(const Core& a, const Core& b, const Gap& gap, Manifold& manifold);

/// The same without the deepest contact where the features do not meet.
void intersect_support_features(const Core& a, const Core& b, const Eigen::Vector3d& normal,
                                Manifold& manifold);

}  // namespace terrane::internal
