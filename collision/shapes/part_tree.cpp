// SPDX-License-Identifier: MIT
// Sources: I. Wald. On fast construction of SAH-based bounding volume hierarchies. 2007 (centres of
//          boxes). B. Smits. Efficiency issues for ray tracing. 1998 (depth-first order, skip links).
// Deviations: halves of equal count instead of a cost model: the depth is bounded, so that traversals need no
//             allocation.
#include "shapes/part_tree.h"

#include <algorithm>

namespace terrane::internal {
namespace {

class Builder {
public:
    explicit Builder(std::span<const Aabb> bounds) : bounds_(bounds) {
        order_.resize(bounds.size());
        for (std::size_t i = 0; i < order_.size(); ++i) order_[i] = static_cast<std::uint32_t>(i);
        nodes_.reserve(2 * bounds.size());
        build(0, order_.size());
    }

    std::vector<PartNode> take() { return std::move(nodes_); }

private:
    double centre(std::uint32_t part, int axis) const {
        return bounds_[part].low[axis] + bounds_[part].high[axis];
    }

    int longest_axis(std::size_t first, std::size_t last) const {
        int longest = 0;
        double size = -1.0;
        for (int axis = 0; axis < 3; ++axis) {
            double low = std::numeric_limits<double>::infinity();
            double high = -low;
            for (std::size_t i = first; i < last; ++i) {
                low = std::min(low, centre(order_[i], axis));
                high = std::max(high, centre(order_[i], axis));
            }
            if (high - low > size) {
                size = high - low;
                longest = axis;
            }
        }
        return longest;
    }

    void build(std::size_t first, std::size_t last) {
        const std::size_t self = nodes_.size();
        nodes_.emplace_back();
        if (last - first == 1) {
            nodes_[self].part = order_[first];
            nodes_[self].bounds = bounds_[order_[first]];
        } else {
            const int axis = longest_axis(first, last);
            const std::size_t middle = first + (last - first) / 2;
            const auto at = [&](std::size_t i) {
                return order_.begin() + static_cast<std::ptrdiff_t>(i);
            };
            std::nth_element(at(first), at(middle), at(last),
                             [&](std::uint32_t a, std::uint32_t b) {
                                 const double x = centre(a, axis), y = centre(b, axis);
                                 return x != y ? x < y : a < b;
                             });
            build(first, middle);
            const std::size_t right = nodes_.size();
            build(middle, last);
            const Aabb& a = nodes_[self + 1].bounds;
            const Aabb& b = nodes_[right].bounds;
            for (int k = 0; k < 3; ++k) {
                nodes_[self].bounds.low[k] = std::min(a.low[k], b.low[k]);
                nodes_[self].bounds.high[k] = std::max(a.high[k], b.high[k]);
            }
        }
        nodes_[self].end = static_cast<std::uint32_t>(nodes_.size());
    }

    std::span<const Aabb> bounds_;
    std::vector<std::uint32_t> order_;
    std::vector<PartNode> nodes_;
};

}  // namespace

std::vector<PartNode> make_part_tree(std::span<const Aabb> bounds) {
    return Builder(bounds).take();
}

}  // namespace terrane::internal
