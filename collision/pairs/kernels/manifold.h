// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/kernels/core.h"

#include <terrane/collision/shape_pairs.h>

#include <array>
#include <cstddef>
#include <span>

namespace terrane::internal {

/// How two shapes lie, radii included.
struct Gap {
    double distance = 0.0;  ///< signed: the gap, or minus the shortest translation that parts them
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, from b towards a
    /// Nearest points of the cores; where `has_points` is false the cores cross, and the points are
    /// those of the deepest contact.
    Eigen::Vector3d core_a = Eigen::Vector3d::Zero();
    Eigen::Vector3d core_b = Eigen::Vector3d::Zero();
    bool has_points = true;
};

/// Contacts of one normal: at most four that stand for all of them.
class Manifold {
public:
    /// @param margin contacts with a gap up to it are kept, metres
    Manifold(const Eigen::Vector3d& normal, double margin) : normal_(normal), margin_(margin) {}

    void add(const Eigen::Vector3d& point_on_a, double depth, ShapeFeature a, ShapeFeature b,
             std::uint32_t part_a = 0, std::uint32_t part_b = 0);
    bool has_depth(double depth) const { return count_ > 0 && deepest_ >= depth; }

    /// How many there are: at most four, the deepest first.
    std::size_t finish(std::array<PairContact, 4>& contacts_out);

private:
    // Without initial values: most places stay empty.
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

/// Contacts of two cores along gap.normal: their support features, projected along it and cut with each
/// other.
void find_core_contacts(const Core& a, const Core& b, const Gap& gap, Manifold& manifold);

}  // namespace terrane::internal
