// SPDX-License-Identifier: MIT
// Sources: I. Wald. On fast construction of SAH-based bounding volume hierarchies. 2007 (splits by centres of boxes).
//          B. Smits. Efficiency issues for ray tracing. 1998 (depth-first order, skip links).
//          G. van den Bergen. Efficient collision detection of complex deformable models using AABB trees. Journal of
//          Graphics Tools 1997 (refitting).
//          C. Ericson. Real-time collision detection. 2005, section 5.3.3 (slabs).
// Deviation: nodes are split into halves of equal count, not by a cost model. This bounds the depth, so that traversals
//            need no memory beyond a stack of fixed size.
#include "base/aabb_tree.h"

#include "base/vector_math.h"

#include <algorithm>
#include <bit>
#include <utility>

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

// Twice the coordinate of the centre of a box; infinity if the box is empty.
double centre_along(const Aabb& box, int axis) {
    return box.low[axis] <= box.high[axis] ? box.low[axis] + box.high[axis] : kInfinity;
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
    void build(std::size_t first, std::size_t last) {
        const std::size_t self = nodes_.size();
        nodes_.emplace_back();
        if (last - first == 1) {
            nodes_[self].item = order_[first];
            nodes_[self].bounds = bounds_[order_[first]];
        } else {
            const std::size_t middle =
                first + split_into_halves(bounds_, std::span(order_).subspan(first, last - first));
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

/// Builds the same tree as AabbTreeBuilder in about half the time, but allocates temporary memory. Items are sorted
/// once along each axis; splits keep the orders, without data-dependent branches (J. L. Bentley. Multidimensional
/// binary search trees used for associative searching. CACM 18(9), 1975; here with presorting).
class PresortedBuilder {
public:
    explicit PresortedBuilder(std::span<const Aabb> bounds)
        : bounds_(bounds), spare_(bounds.size()), is_left_(bounds.size()) {
        for (int axis = 0; axis < 3; ++axis) sort(axis);
        nodes_.resize(bounds.empty() ? 0 : 2 * bounds.size() - 1);
        if (!bounds.empty()) build(0, bounds.size());
    }
    std::vector<AabbNode> take() { return std::move(nodes_); }

private:
    double centre(std::uint32_t item, int axis) const { return centre_along(bounds_[item], axis); }

    // Sorts the items by centre, then by index: a stable radix sort of integer keys that have the order of the centres.
    void sort(int axis) {
        struct Item {
            std::uint64_t key;
            std::uint32_t index;
        };
        constexpr int kBits = 11, kPasses = 6;
        constexpr std::size_t kBuckets = std::size_t{1} << kBits;
        std::vector<Item> items(bounds_.size()), sorted(bounds_.size());
        std::vector<std::array<std::uint32_t, kBuckets>> counts(kPasses);
        for (std::size_t i = 0; i < items.size(); ++i) {
            const auto index = static_cast<std::uint32_t>(i);
            const auto bits = std::bit_cast<std::uint64_t>(centre(index, axis) + 0.0);  // no -0
            const std::uint64_t sign = std::uint64_t{1} << 63;
            items[i] = {(bits & sign) != 0 ? ~bits : bits | sign, index};
            for (std::size_t pass = 0; pass < kPasses; ++pass)
                ++counts[pass][(items[i].key >> (pass * kBits)) % kBuckets];
        }
        for (std::size_t pass = 0; pass < kPasses; ++pass) {
            std::uint32_t begin = 0;
            for (std::uint32_t& count : counts[pass]) begin += std::exchange(count, begin);
            for (const Item& item : items)
                sorted[counts[pass][(item.key >> (pass * kBits)) % kBuckets]++] = item;
            items.swap(sorted);
        }
        auto& order = orders_[static_cast<std::size_t>(axis)];
        order.resize(items.size());
        for (std::size_t i = 0; i < items.size(); ++i) order[i] = items[i].index;
    }

    std::size_t longest_axis(std::size_t first, std::size_t last) const {
        std::size_t longest = 0;
        double size = -1.0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto& order = orders_[axis];
            std::size_t end = last;
            while (end > first && centre(order[end - 1], static_cast<int>(axis)) == kInfinity)
                --end;
            if (end == first) continue;
            const double low = centre(order[first], static_cast<int>(axis));
            const double high = centre(order[end - 1], static_cast<int>(axis));
            if (high - low > size) {
                size = high - low;
                longest = axis;
            }
        }
        return longest;
    }

    void build(std::size_t first, std::size_t last) {
        const std::size_t self = next_++;
        if (last - first == 1) {
            const std::uint32_t item = orders_[0][first];
            nodes_[self].item = item;
            nodes_[self].bounds = bounds_[item];
        } else {
            const std::size_t middle = first + (last - first) / 2;
            const std::size_t along = longest_axis(first, last);
            for (std::size_t i = first; i < last; ++i) is_left_[orders_[along][i]] = i < middle;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                if (axis != along) halve(orders_[axis], first, last);
            }
            build(first, middle);
            const std::size_t right = next_;
            build(middle, last);
            nodes_[self].bounds = around_both(nodes_[self + 1].bounds, nodes_[right].bounds);
        }
        nodes_[self].end = static_cast<std::uint32_t>(next_);
    }

    void halve(std::vector<std::uint32_t>& order, std::size_t first, std::size_t last) {
        std::size_t left = first, right = 0;
        for (std::size_t i = first; i < last; ++i) {
            const std::uint32_t item = order[i];
            order[left] = item;
            spare_[right] = item;
            left += is_left_[item];
            right += 1u - is_left_[item];
        }
        std::copy_n(spare_.begin(), right, order.begin() + static_cast<std::ptrdiff_t>(left));
    }

    std::span<const Aabb> bounds_;
    std::array<std::vector<std::uint32_t>, 3> orders_;  // [axis] items of each node, sorted
    std::vector<std::uint32_t> spare_;
    std::vector<std::uint8_t> is_left_;  // [items]
    std::vector<AabbNode> nodes_;
    std::size_t next_ = 0;  // index of the next node to build
};

}  // namespace

std::size_t split_into_halves(std::span<const Aabb> bounds, std::span<std::uint32_t> items) {
    int longest = 0;
    double size = -1.0;
    for (int axis = 0; axis < 3; ++axis) {
        double low = kInfinity, high = -kInfinity;
        for (const std::uint32_t item : items) {
            const double at = centre_along(bounds[item], axis);
            if (at == kInfinity) continue;
            low = std::min(low, at);
            high = std::max(high, at);
        }
        if (high - low > size) {
            size = high - low;
            longest = axis;
        }
    }
    const std::size_t middle = items.size() / 2;
    std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(middle),
                     items.end(), [&](std::uint32_t a, std::uint32_t b) {
                         const double x = centre_along(bounds[a], longest);
                         const double y = centre_along(bounds[b], longest);
                         return x != y ? x < y : a < b;
                     });
    return middle;
}

void build_aabb_tree(std::span<const Aabb> bounds, std::vector<std::uint32_t>& order_out,
                     std::vector<AabbNode>& nodes_out) {
    AabbTreeBuilder(bounds, order_out, nodes_out);
}

std::vector<AabbNode> make_aabb_tree(std::span<const Aabb> bounds) {
    return PresortedBuilder(bounds).take();
}

void refit_aabb_tree(std::span<const Aabb> bounds, std::span<AabbNode> nodes) {
    // children come after their parent
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
