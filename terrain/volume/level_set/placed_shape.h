// SPDX-License-Identifier: MIT
#pragma once

#include "level_set/sampled_shape.h"
#include "level_set/shapes.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <variant>
#include <vector>

namespace terrane::internal {

/// The shape of a placed volume: with exact distances, or sampled.
class PlacedShape {
public:
    using Kind = std::variant<ExactShape, std::shared_ptr<const SampledShape>>;

    explicit PlacedShape(Kind kind);

    const Kind& kind() const { return kind_; }
    /// Of the shape; of sampled ones, of their band.
    const Aabb& bounds() const { return bounds_; }
    /// Visits boxes whose union contains the part of the shape over a rectangle: those of pieces of a tube's capsules,
    /// for finding tiles. Stops where visit returns false.
    ///
    /// @param within its low and high x and y
    void visit_part_bounds(const Aabb& within, const std::function<bool(const Aabb&)>& visit) const;
    std::size_t bytes() const;
    double signed_distance(const Eigen::Vector3d& p_world) const;

private:
    Kind kind_;
    Aabb bounds_;
};

/// Level sets hold distances as whole numbers from -kBandSteps to kBandSteps, in steps of band / kBandSteps.
inline constexpr std::int16_t kBandSteps = 32767;

/// A box of nodes: its middle, and half of its extent, metres.
struct NodeBox {
    Eigen::Vector3d centre_world, half_extents;
};

enum class BoxSide { outside, inside, near };

/// Distances of one shape over boxes that are divided: each box has a list of the parts that matter inside it.
///
/// The distances of a node are the same whatever boxes it was reached by, once limited to the band.
class ShapeTraversal {
public:
    /// @param band distances are needed up to this, metres
    ShapeTraversal(const PlacedShape& shape, double band);

    /// Enters a box within the one entered last. `near`: distances of the box may be within the band; otherwise all
    /// are beyond it on one side.
    BoxSide enter(const NodeBox& box);
    /// Parts of an exact shape that may be within the band in the box that was entered last, ascending.
    std::span<const std::uint32_t> parts() const {
        return std::span(parts_).subspan(begins_.back());
    }
    /// Leaves the box that was entered last.
    void leave();
    /// Distances of nodes of the box that was entered last, limited to the band, rounded to whole kBandSteps-th parts
    /// of it.
    void distances(std::span<const Eigen::Vector3d> nodes_world, std::span<std::int16_t> steps_out);

private:
    BoxSide enter_exact(const ExactShape& shape, const NodeBox& box);
    BoxSide enter_sampled(const NodeBox& box);

    const PlacedShape* shape_;
    double band_;
    std::vector<std::uint32_t> parts_;  // of all entered boxes, one after the other
    std::vector<std::size_t> begins_;   // where each box's parts begin
    std::unique_ptr<SampledShape::Reader> reader_;
};

}  // namespace terrane::internal
