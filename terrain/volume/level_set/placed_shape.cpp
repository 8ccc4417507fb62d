// SPDX-License-Identifier: MIT
#include "level_set/placed_shape.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace terrane::internal {

PlacedShape::PlacedShape(Kind kind) : kind_(std::move(kind)) {
    const auto* exact = std::get_if<ExactShape>(&kind_);
    bounds_ = exact != nullptr ? exact->bounds() : std::get<1>(kind_)->bounds();
}

void PlacedShape::visit_part_bounds(const Aabb& within,
                                    const std::function<bool(const Aabb&)>& visit) const {
    const auto* exact = std::get_if<ExactShape>(&kind_);
    if (exact == nullptr || exact->capsules.empty()) {
        visit(bounds_);
        return;
    }
    for (const CapsulePart& part : exact->capsules) {
        // The interval of the segment over the rectangle, widened by the radius.
        double begin = 0.0, end = 1.0;
        for (int axis = 0; axis < 2; ++axis) {
            const double from = part.from_world[axis], along = part.along[axis];
            const double low = within.low[axis] - part.radius,
                         high = within.high[axis] + part.radius;
            if (along == 0.0) {
                if (from < low || from > high) end = -1.0;
                continue;
            }
            const double t0 = (low - from) / along, t1 = (high - from) / along;
            begin = std::max(begin, std::min(t0, t1));
            end = std::min(end, std::max(t0, t1));
        }
        if (begin > end) continue;
        // A long segment is cut into pieces, so that their boxes cover few tiles that the segment does not touch.
        const double length = (end - begin) * std::sqrt(dot(part.along, part.along));
        const int count = std::clamp(static_cast<int>(length / (2.0 * part.radius)), 1, 1 << 16);
        for (int i = 0; i < count; ++i) {
            Aabb box = empty_box();
            for (const int k : {i, i + 1}) {
                const double t = begin + (end - begin) * (static_cast<double>(k) / count);
                include(part.from_world + part.along * t, part.radius, box);
            }
            if (!visit(box)) return;
        }
    }
}

std::size_t PlacedShape::bytes() const {
    const auto* exact = std::get_if<ExactShape>(&kind_);
    if (exact == nullptr) return std::get<1>(kind_)->bytes();
    return exact->capsules.size() * sizeof(CapsulePart) + exact->boxes.size() * sizeof(BoxPart);
}

double PlacedShape::signed_distance(const Eigen::Vector3d& p_world) const {
    const auto* exact = std::get_if<ExactShape>(&kind_);
    if (exact != nullptr) return exact->signed_distance(p_world);
    return SampledShape::Reader(*std::get<1>(kind_)).signed_distance(p_world);
}

ShapeTraversal::ShapeTraversal(const PlacedShape& shape, double band)
    : shape_(&shape), band_(band), begins_{0} {
    if (const auto* exact = std::get_if<ExactShape>(&shape.kind())) {
        parts_.resize(exact->part_count());
        std::iota(parts_.begin(), parts_.end(), 0u);
    } else {
        reader_ = std::make_unique<SampledShape::Reader>(*std::get<1>(shape.kind()));
    }
}

BoxSide ShapeTraversal::enter(const NodeBox& box) {
    const auto* exact = std::get_if<ExactShape>(&shape_->kind());
    return exact != nullptr ? enter_exact(*exact, box) : enter_sampled(box);
}

BoxSide ShapeTraversal::enter_exact(const ExactShape& shape, const NodeBox& box) {
    const std::size_t begin = begins_.back(), end = parts_.size();
    begins_.push_back(end);
    // A signed distance is 1-Lipschitz: in the box it differs from the value at the centre by at most half the box's
    // diagonal. The slack bounds the rounding.
    const double reach = std::sqrt(dot(box.half_extents, box.half_extents)) + band_ * 0x1p-10;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t part = parts_[i];
        const double distance = shape.part_distance(part, box.centre_world);
        if (distance - reach > band_) continue;
        least = std::min(least, distance);
        parts_.push_back(part);
    }
    if (least + reach < -band_) return BoxSide::inside;
    return parts_.size() > end ? BoxSide::near : BoxSide::outside;
}

BoxSide ShapeTraversal::enter_sampled(const NodeBox& box) {
    begins_.push_back(parts_.size());
    const Aabb& bounds = shape_->bounds();
    for (int axis = 0; axis < 3; ++axis) {
        if (box.centre_world[axis] + box.half_extents[axis] < bounds.low[axis] ||
            box.centre_world[axis] - box.half_extents[axis] > bounds.high[axis]) {
            return BoxSide::outside;
        }
    }
    // Large boxes are divided without calling is_near(), which looks up each leaf.
    if (box.half_extents.maxCoeff() > 16.0 * reader_->voxel() ||
        reader_->is_near(box.centre_world, box.half_extents))
        return BoxSide::near;
    return reader_->signed_distance(box.centre_world) < 0.0 ? BoxSide::inside : BoxSide::outside;
}

void ShapeTraversal::leave() {
    parts_.resize(begins_.back());
    begins_.pop_back();
}

void ShapeTraversal::distances(std::span<const Eigen::Vector3d> nodes_world,
                               std::span<std::int16_t> steps_out) {
    const double steps_of_metre = kBandSteps / band_;
    const auto in_steps = [&](double d) {
        return static_cast<std::int16_t>(
            std::floor(std::clamp(d, -band_, band_) * steps_of_metre + 0.5));
    };
    if (reader_ != nullptr) {
        // Beyond the shape's own band it is only known that the surface is farther away.
        const double known = reader_->band() * 0.999;
        for (std::size_t i = 0; i < nodes_world.size(); ++i) {
            const double d = reader_->signed_distance(nodes_world[i]);
            steps_out[i] = in_steps(std::abs(d) < known ? d : d < 0.0 ? -band_ : band_);
        }
        return;
    }
    const auto& exact = std::get<ExactShape>(shape_->kind());
    for (std::size_t i = 0; i < nodes_world.size(); ++i) {
        double least = band_;
        for (const std::uint32_t part : parts())
            least = std::min(least, exact.part_distance(part, nodes_world[i]));
        steps_out[i] = in_steps(least);
    }
}

}  // namespace terrane::internal
