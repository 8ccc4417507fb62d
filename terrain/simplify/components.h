// SPDX-License-Identifier: MIT
#pragma once

#include "base/aabb_tree.h"
#include "simplify/bounds/star_mesh.h"
#include "simplify/bounds/surface_distance.h"
#include "simplify/bounds/triangle_bound.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace terrane::internal {

/// Triangles of a connected component that can go because others are near.
struct Reduction {
    double error_m = 0.0;  ///< certified, of the triangles that are removed
    double turned_area =
        0.0;  ///< of removed triangles without a similarly oriented one near, square metres
    std::vector<std::uint32_t> removed = {};  ///< triangles
    std::vector<std::uint32_t> near = {};     ///< triangles within error_m of the removed ones
};

/// Connected components of a mesh while it is contracted, and reductions of the small ones: closed ones become open
/// sheets, sheets single triangles, and these vanish.
class Components {
public:
    /// Components of more triangles are not looked at.
    static constexpr std::size_t kMostTriangles = 16;

    /// @param vertices, mesh, bounds must stay
    Components(std::span<const Eigen::Vector3d> vertices, const StarMesh& mesh,
               std::span<const TriangleBound> bounds);

    std::size_t count() const { return ends_.size(); }
    std::uint32_t of_triangle(std::uint32_t triangle) const {
        return count() == 1 ? 0 : component_[triangle];
    }

    /// Triangles of a component that are left, in increasing order. Valid until the next call.
    std::span<const std::uint32_t> triangles(std::uint32_t component);
    /// Whether it may have a reduction.
    bool is_small(std::uint32_t component) const { return left_[component] <= kMostTriangles; }
    /// Subtracts removed triangles. True where the component has become small by it.
    bool count_removed(std::uint32_t component, std::size_t gone);

    /// The reduction of least error; none where all triangles are needed.
    std::optional<Reduction> find_reduction(std::uint32_t component);

private:
    Corners corners(std::uint32_t triangle) const;
    Reduction to_sheet(std::span<const std::uint32_t> all) const;
    std::optional<Reduction> to_others(std::uint32_t component, std::span<const std::uint32_t> all,
                                       double limit);
    void add_turned_area(Reduction& reduction) const;
    bool has_others_near(std::uint32_t component, std::span<const std::uint32_t> all,
                         double limit) const;
    double nearest_other(std::uint32_t component, const Corners& part, double limit,
                         std::uint32_t& other_out) const;
    void build_tree();

    std::span<const Eigen::Vector3d> vertices_;
    const StarMesh& mesh_;
    std::span<const TriangleBound> bounds_;
    std::vector<std::uint32_t> component_;  // [triangles]
    std::vector<std::uint32_t> list_;   // [triangles] by component; those that are left come first
    std::vector<std::size_t> begins_;   // [components] in list_
    std::vector<std::size_t> ends_;     // [components] in list_, of those that were left
    std::vector<std::size_t> left_;     // [components] triangles
    std::vector<AabbNode> tree_;        // of triangles as they were when it was built
    std::vector<std::uint32_t> items_;  // [leaves] triangles
    std::size_t alive_at_build_ = 0;
};

}  // namespace terrane::internal
