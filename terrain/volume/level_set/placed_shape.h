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

/// The shape of a placed volume: exact or sampled.
class PlacedShape {
public:
    using Kind = std::variant<ExactShape, std::shared_ptr<const SampledShape>>;

    explicit PlacedShape(Kind kind);

    const Kind& kind() const { return kind_; }
    /// Bounding box of the shape; of the band for sampled shapes.
    const Aabb& bounds() const { return bounds_; }
    /// Visits boxes whose union contains the part of the shape over a rectangle, to find the tiles that it touches. A
    /// tube is cut into short pieces. Stops when visit returns false.
    ///
    /// @param within its x and y are the rectangle
    void visit_part_bounds(const Aabb& within, const std::function<bool(const Aabb&)>& visit) const;
    std::size_t bytes() const;
    double signed_distance(const Eigen::Vector3d& p_world) const;

private:
    Kind kind_;
    Aabb bounds_;
};

/// Level sets store distances as integers from -kBandSteps to kBandSteps, in steps of band / kBandSteps.
inline constexpr std::int16_t kBandSteps = 32767;

/// A box of nodes: centre and half extents, metres.
struct NodeBox {
    Eigen::Vector3d centre_world, half_extents;
};

enum class BoxSide { outside, inside, near };

/// Computes the distances of one shape during a recursive subdivision of boxes of nodes. Each box keeps a list of the
/// parts of the shape that may be near. The distance of a node, clamped to the band, is the same in every box that
/// contains it.
class ShapeTraversal {
public:
    /// @param band largest distance that is needed, metres
    ShapeTraversal(const PlacedShape& shape, double band);

    /// Enters a box inside the current one. `near`: distances in the box may be within the band; otherwise the whole
    /// box is inside or outside the shape and beyond the band.
    BoxSide enter(const NodeBox& box);
    /// Parts of an exact shape that may be within the band in the current box, ascending.
    std::span<const std::uint32_t> parts() const {
        return std::span(parts_).subspan(begins_.back());
    }
    /// Leaves the current box.
    void leave();
    /// Distances of nodes in the current box, clamped to the band and rounded to steps of band / kBandSteps.
    void distances(std::span<const Eigen::Vector3d> nodes_world, std::span<std::int16_t> steps_out);

private:
    BoxSide enter_exact(const ExactShape& shape, const NodeBox& box);
    BoxSide enter_sampled(const NodeBox& box);

    const PlacedShape* shape_;
    double band_;
    std::vector<std::uint32_t> parts_;  // of all entered boxes, concatenated
    std::vector<std::size_t> begins_;   // start of each box's parts
    std::unique_ptr<SampledShape::Reader> reader_;
};

}  // namespace terrane::internal
