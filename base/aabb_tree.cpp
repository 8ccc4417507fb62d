// SPDX-License-Identifier: MIT
// Sources: I. Wald. On fast construction of SAH-based bounding volume hierarchies. 2007 (centres of
//          boxes). B. Smits. Efficiency issues for ray tracing. 1998 (depth-first order, skip links).
//          G. van den Bergen. Efficient collision detection of complex deformable models using AABB trees. Journal of
//          Graphics Tools 1997 (refitting). C. Ericson. Real-time collision detection. 2005, section 5.3.3 (slabs).
// Deviations: halves of equal count instead of a cost model: the depth is bounded, so that traversals need no
//             allocation.
#include "base/aabb_tree.h"

#include "base/vector_math.h"

#include <algorithm>

namespace terrane::internal {
namespace {

Aabb around_both(const Aabb& a, const Aabb& b) {
    Aabb bounds;
    for (int axis = 0; axis < 3; ++axis) {
        bounds.low[axis] = std::min(a.low[axis], b.low[axis]);
        bounds.high[axis] = std::max(a.high[axis], b.high[axis]);
    }
    return bounds;
}

class AabbTreeBuilder {
public:
    AabbTreeBuilder(std::span<const Aabb> bounds, std::vector<std::uint32_t>& order,
                    std::vector<AabbNode>& nodes)
        : bounds_(bounds), order_(order), nodes_(nodes) {
        order_.resize(bounds.size());
        for (std::size_t i = 0; i < order_.size(); ++i) order_[i] = static_cast<std::uint32_t>(i);
        nodes_.clear();
        nodes_.reserve(2 * bounds.size());
        if (!order_.empty()) build(0, order_.size());
    }

private:
    // Twice the coordinate of the centre; infinity of an empty box.
    double centre(std::uint32_t item, int axis) const {
        const Aabb& box = bounds_[item];
        return box.low[axis] <= box.high[axis] ? box.low[axis] + box.high[axis] : kInfinity;
    }

    int longest_axis(std::size_t first, std::size_t last) const {
        int longest = 0;
        double size = -1.0;
        for (int axis = 0; axis < 3; ++axis) {
            double low = kInfinity;
            double high = -kInfinity;
            for (std::size_t i = first; i < last; ++i) {
                const double at = centre(order_[i], axis);
                if (at == kInfinity) continue;
                low = std::min(low, at);
                high = std::max(high, at);
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
            nodes_[self].item = order_[first];
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
            nodes_[self].bounds = around_both(nodes_[self + 1].bounds, nodes_[right].bounds);
        }
        nodes_[self].end = static_cast<std::uint32_t>(nodes_.size());
    }

    std::span<const Aabb> bounds_;
    std::vector<std::uint32_t>& order_;
    std::vector<AabbNode>& nodes_;
};

}  // namespace

void build_aabb_tree(std::span<const Aabb> bounds, std::vector<std::uint32_t>& order_out,
                     std::vector<AabbNode>& nodes_out) {
    AabbTreeBuilder(bounds, order_out, nodes_out);
}

std::vector<AabbNode> make_aabb_tree(std::span<const Aabb> bounds) {
    std::vector<std::uint32_t> order;
    std::vector<AabbNode> nodes;
    build_aabb_tree(bounds, order, nodes);
    return nodes;
}

void refit_aabb_tree(std::span<const Aabb> bounds, std::span<AabbNode> nodes) {
    // Children come after their parent.
    for (std::size_t i = nodes.size(); i-- > 0;) {
        AabbNode& node = nodes[i];
        node.bounds = node.item != AabbNode::kInner
                          ? bounds[node.item]
                          : around_both(nodes[i + 1].bounds, nodes[nodes[i + 1].end].bounds);
    }
}

double segment_entry(const Eigen::Vector3d& from, const Eigen::Vector3d& displacement,
                     const Aabb& box, double margin) {
    double first = 0.0;
    double last = 1.0;
    for (int i = 0; i < 3; ++i) {
        if (box.low[i] > box.high[i]) return kInfinity;
        const double low = box.low[i] - margin - from[i];
        const double high = box.high[i] + margin - from[i];
        if (displacement[i] == 0.0) {
            if (low > 0.0 || high < 0.0) return kInfinity;
            continue;
        }
        const double t0 = low / displacement[i];
        const double t1 = high / displacement[i];
        first = std::max(first, std::min(t0, t1));
        last = std::min(last, std::max(t0, t1));
    }
    return first <= last ? first : kInfinity;
}

}  // namespace terrane::internal
