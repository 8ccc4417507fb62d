// SPDX-License-Identifier: MIT
#include "base/settings_check.h"
#include "source/composed_heights.h"

#include <terrane/base/result.h>
#include <terrane/base/text.h>
#include <terrane/terrain/surface.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace terrane {
namespace {

constexpr double kMostFriction = 1e6;

// False for NaN.
bool is_in_range(const SurfaceProperties& properties) {
    return properties.friction >= 0.0 && properties.friction <= kMostFriction &&
           properties.restitution >= 0.0 && properties.restitution <= 1.0;
}

class FunctionMap final : public SurfaceMap {
public:
    FunctionMap(std::function<SurfaceProperties(double, double)> function,
                const SurfaceProperties& defaults)
        : SurfaceMap(defaults), function_(std::move(function)) {}

private:
    SurfaceProperties properties(double x, double y) const override { return function_(x, y); }

    std::function<SurfaceProperties(double, double)> function_;
};

}  // namespace

Result<void> SurfaceProperties::validate() const {
    TERRANE_TRY(check_range("friction", friction, 0.0, kMostFriction));
    return check_range("restitution", restitution, 0.0, 1.0);
}

SurfaceMap::SurfaceMap(const SurfaceProperties& defaults) : defaults_(defaults) {
    TERRANE_ASSERT(is_in_range(defaults_), "the defaults of a surface map must be in range");
}

SurfaceProperties SurfaceMap::at(double x, double y) const noexcept {
    if (!std::isfinite(x) || !std::isfinite(y)) return defaults_;
    try {
        const SurfaceProperties found = properties(x, y);
        if (is_in_range(found)) return found;
    } catch (...) {
        // counted below
    }
    fault_count_.fetch_add(1, std::memory_order_relaxed);
    return defaults_;
}

Result<std::shared_ptr<const SurfaceMap>> SurfaceMap::from_function(
    std::function<SurfaceProperties(double x, double y)> function,
    const SurfaceProperties& defaults) {
    if (!function) {
        return fail(ErrorCode::invalid_argument,
                    "function must be one that can be called, got an empty one");
    }
    if (auto ok = defaults.validate(); !ok) {
        return fail(ok.error().code, "defaults." + ok.error().message);
    }
    return std::make_shared<const FunctionMap>(std::move(function), defaults);
}

// A surface map of rectangles: a tree of boxes over them, searched for the last rectangle that contains a place.
//
// Sources:    Ericson. Real-time collision detection. 2005, chapter 6 (top-down construction, median cut).
// Deviations: every node stores the last rectangle below it, so that a search skips subtrees without a later rectangle.

namespace {

// Largest number of rectangles in a leaf: testing one costs about as much as testing a node's box.
constexpr std::size_t kMostInLeaf = 4;

class RectMap final : public SurfaceMap {
public:
    RectMap(std::span<const SurfaceRect> rects, const SurfaceProperties& defaults)
        : SurfaceMap(defaults) {
        for (const SurfaceRect& rect : rects) {
            entries_.push_back({rect.rect, entries_.size() + 1});
            properties_.push_back(rect.properties);
        }
        if (entries_.empty()) return;
        nodes_.emplace_back();
        build(0, 0, entries_.size());
    }

private:
    struct Entry {
        WorldRect rect;
        std::size_t number;  // from 1, in the caller's order
    };
    struct Node {
        WorldRect box;
        std::size_t last;          // greatest number below
        std::size_t begin, end;    // entries of a leaf
        std::size_t children = 0;  // the first of two; 0: a leaf
    };

    void build(std::size_t at, std::size_t begin, std::size_t end);
    void search(const Node& node, double x, double y, std::size_t& found) const;
    SurfaceProperties properties(double x, double y) const override {
        std::size_t found = 0;
        if (!nodes_.empty()) search(nodes_.front(), x, y, found);
        return found == 0 ? defaults() : properties_[found - 1];
    }

    std::vector<Entry> entries_;  // leaf by leaf
    std::vector<Node> nodes_;     // the first is the root
    std::vector<SurfaceProperties> properties_;
};

// Clamps infinite edges, so that sums and differences are finite.
double finite(double edge) { return std::clamp(edge, -1e300, 1e300); }

void RectMap::build(std::size_t at, std::size_t begin, std::size_t end) {
    Node node{.box = entries_[begin].rect, .last = 0, .begin = begin, .end = end};
    for (std::size_t i = begin; i < end; ++i) {
        const WorldRect& rect = entries_[i].rect;
        node.box.west = std::min(node.box.west, rect.west);
        node.box.south = std::min(node.box.south, rect.south);
        node.box.east = std::max(node.box.east, rect.east);
        node.box.north = std::max(node.box.north, rect.north);
        node.last = std::max(node.last, entries_[i].number);
    }
    if (end - begin <= kMostInLeaf) {
        nodes_[at] = node;
        return;
    }
    const bool is_wide = finite(node.box.east) - finite(node.box.west) >=
                         finite(node.box.north) - finite(node.box.south);
    const auto centre = [is_wide](const Entry& entry) {
        return is_wide ? finite(entry.rect.west) + finite(entry.rect.east)
                       : finite(entry.rect.south) + finite(entry.rect.north);
    };
    const std::size_t middle = begin + (end - begin) / 2;
    const auto entry_at = [this](std::size_t i) {
        return entries_.begin() + static_cast<std::ptrdiff_t>(i);
    };
    std::nth_element(entry_at(begin), entry_at(middle), entry_at(end),
                     [&](const Entry& a, const Entry& b) {
                         const double of_a = centre(a), of_b = centre(b);
                         return of_a != of_b ? of_a < of_b : a.number < b.number;
                     });
    node.children = nodes_.size();
    nodes_[at] = node;
    nodes_.resize(nodes_.size() + 2);
    build(node.children, begin, middle);
    build(node.children + 1, middle, end);
}

void RectMap::search(const Node& node, double x, double y, std::size_t& found) const {
    if (node.last <= found || !node.box.contains(x, y)) return;
    if (node.children == 0) {
        for (std::size_t i = node.begin; i < node.end; ++i) {
            const Entry& entry = entries_[i];
            if (entry.number > found && entry.rect.contains(x, y)) found = entry.number;
        }
        return;
    }
    const Node& one = nodes_[node.children];
    const Node& other = nodes_[node.children + 1];
    search(one.last > other.last ? one : other, x, y, found);
    search(one.last > other.last ? other : one, x, y, found);
}

Result<void> check_order(const std::string& name, const char* low_name, double low,
                         const char* high_name, double high) {
    if (low <= high) return {};
    return fail(ErrorCode::invalid_argument, name + "." + low_name + " must be at most " +
                                                 high_name + ", got " + number_text(low) + " and " +
                                                 number_text(high));
}

Result<void> check_rect(const std::string& name, const SurfaceRect& rect) {
    const WorldRect& r = rect.rect;
    TERRANE_TRY(check_order(name, "west", r.west, "east", r.east));
    TERRANE_TRY(check_order(name, "south", r.south, "north", r.north));
    if (auto ok = rect.properties.validate(); !ok) {
        return fail(ok.error().code, name + "." + ok.error().message);
    }
    return {};
}

}  // namespace

Result<std::shared_ptr<const SurfaceMap>> SurfaceMap::from_rects(
    std::span<const SurfaceRect> rects, const SurfaceProperties& defaults) {
    for (std::size_t i = 0; i < rects.size(); ++i) {
        const std::string name = "rects[" + number_text(i) + "]";
        TERRANE_TRY(check_rect(name, rects[i]));
    }
    if (auto ok = defaults.validate(); !ok) {
        return fail(ok.error().code, "defaults." + ok.error().message);
    }
    return std::make_shared<const RectMap>(rects, defaults);
}

namespace {

class PaintedMap final : public SurfaceMap {
public:
    PaintedMap(std::shared_ptr<const SurfaceMap> under, std::span<const SurfaceArea> areas)
        : SurfaceMap(under != nullptr ? under->defaults() : SurfaceProperties{}),
          under_(std::move(under)) {
        for (const SurfaceArea& area : areas) {
            areas_.push_back({internal::PolygonDistance(area.polygon), area.properties, area.map});
        }
    }

private:
    struct Area {
        internal::PolygonDistance polygon;
        SurfaceProperties properties;
        std::shared_ptr<const SurfaceMap> map;
    };

    SurfaceProperties properties(double x, double y) const override {
        for (auto area = areas_.rbegin(); area != areas_.rend(); ++area) {
            if (!area->polygon.contains(x, y)) continue;
            if (area->map == nullptr) return area->properties;
            const SurfaceProperties found = area->map->at(x, y);
            if (!(found == area->map->defaults())) return found;
        }
        return under_ != nullptr ? under_->at(x, y) : defaults();
    }

    std::shared_ptr<const SurfaceMap> under_;
    std::vector<Area> areas_;
};

}  // namespace

Result<std::shared_ptr<const SurfaceMap>> paint_surface(std::shared_ptr<const SurfaceMap> under,
                                                        std::span<const SurfaceArea> areas) {
    for (std::size_t i = 0; i < areas.size(); ++i) {
        const auto refuse = [i](const Error& error) {
            return fail(error.code, "areas[" + number_text(i) + "]." + error.message);
        };
        if (auto ok = areas[i].polygon.validate(); !ok) return refuse(ok.error());
        if (auto ok = areas[i].properties.validate(); !ok) return refuse(ok.error());
    }
    return std::make_shared<const PaintedMap>(std::move(under), areas);
}

}  // namespace terrane
