// SPDX-License-Identifier: MIT
#include "base/vector_math.h"
#include "mesh/contractor.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace terrane::internal {
namespace {

// Least cosine of the angle between the normals of a sheet's triangle and of its largest triangle: 60 degrees.
constexpr double kSheetCosine = 0.5;

std::uint32_t root_of(std::vector<std::uint32_t>& parents, std::uint32_t i) {
    while (parents[i] != i) i = parents[i] = parents[parents[i]];
    return i;
}

bool share_an_edge(const StarMesh::Triangle& a, const StarMesh::Triangle& b) {
    std::size_t common = 0;
    for (const std::uint32_t v : a)
        common += static_cast<std::size_t>(std::find(b.begin(), b.end(), v) != b.end());
    return common >= 2;
}

}  // namespace

Components::Components(std::span<const Eigen::Vector3d> vertices, const StarMesh& mesh,
                       std::span<const TriangleBound> bounds)
    : vertices_(vertices), mesh_(mesh), bounds_(bounds), component_(mesh.triangle_count()) {
    std::vector<std::uint32_t> parents(vertices.size());
    std::iota(parents.begin(), parents.end(), 0u);
    for (std::size_t i = 0; i < component_.size(); ++i) {
        const StarMesh::Triangle& t = mesh.triangle(i);
        for (const std::uint32_t other : {t[1], t[2]}) {
            const std::uint32_t a = root_of(parents, t[0]), b = root_of(parents, other);
            parents[std::max(a, b)] = std::min(a, b);
        }
    }
    constexpr std::uint32_t kNew = ~std::uint32_t{0};
    std::vector<std::uint32_t> numbers(vertices.size(), kNew);
    for (std::size_t i = 0; i < component_.size(); ++i) {
        std::uint32_t& number = numbers[root_of(parents, mesh.triangle(i)[0])];
        if (number == kNew) {
            number = static_cast<std::uint32_t>(left_.size());
            left_.push_back(0);
        }
        component_[i] = number;
        ++left_[number];
    }
    for (std::size_t begin = 0; const std::size_t size : left_) {
        begins_.push_back(begin);
        ends_.push_back(begin);
        begin += size;
    }
    list_.resize(component_.size());
    for (std::uint32_t i = 0; i < component_.size(); ++i) list_[ends_[component_[i]]++] = i;
}

std::span<const std::uint32_t> Components::triangles(std::uint32_t component) {
    const auto begin = list_.begin() + static_cast<std::ptrdiff_t>(begins_[component]);
    const auto end = list_.begin() + static_cast<std::ptrdiff_t>(ends_[component]);
    const auto left = std::remove_if(
        begin, end, [&](std::uint32_t triangle) { return !mesh_.is_alive(triangle); });
    ends_[component] = static_cast<std::size_t>(left - list_.begin());
    return std::span(list_).subspan(begins_[component], ends_[component] - begins_[component]);
}

bool Components::count_removed(std::uint32_t component, std::size_t gone) {
    const std::size_t before = left_[component];
    left_[component] -= gone;
    return left_[component] <= kMostTriangles && before > kMostTriangles;
}

Corners Components::corners(std::uint32_t triangle) const {
    const StarMesh::Triangle& t = mesh_.triangle(triangle);
    return {vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]};
}

std::optional<Reduction> Components::find_reduction(std::uint32_t component) {
    const std::span<const std::uint32_t> all = triangles(component);
    if (all.empty() || all.size() > kMostTriangles) return std::nullopt;
    std::optional<Reduction> best;
    if (all.size() > 1) best = to_sheet(all);
    if (all.size() < mesh_.alive_count()) {
        std::optional<Reduction> none = to_others(component, all, best ? best->error_m : kInfinity);
        if (none) best = std::move(none);
    }
    if (best) add_turned_area(*best);
    return best;
}

// Keeps the triangles connected to the largest one whose normals are within 60 degrees of its normal. If all triangles
// are, keeps only the largest.
Reduction Components::to_sheet(std::span<const std::uint32_t> all) const {
    std::vector<Eigen::Vector3d> normals;
    std::size_t largest = 0;
    for (const std::uint32_t triangle : all) {
        const Corners c = corners(triangle);
        normals.push_back(cross(c[1] - c[0], c[2] - c[0]));
        if (dot(normals.back(), normals.back()) > dot(normals[largest], normals[largest]))
            largest = normals.size() - 1;
    }
    std::vector<std::uint8_t> is_kept(all.size(), 0);
    std::vector<std::size_t> front = {largest};
    is_kept[largest] = 1;
    while (!front.empty()) {
        const std::size_t i = front.back();
        front.pop_back();
        for (std::size_t k = 0; k < all.size(); ++k) {
            if (is_kept[k] != 0 || !share_an_edge(mesh_.triangle(all[i]), mesh_.triangle(all[k])))
                continue;
            const double limit = kSheetCosine * length(normals[largest]) * length(normals[k]);
            if (!(dot(normals[largest], normals[k]) >= limit)) continue;
            is_kept[k] = 1;
            front.push_back(k);
        }
    }
    Reduction reduction;
    if (std::find(is_kept.begin(), is_kept.end(), std::uint8_t{0}) == is_kept.end()) {
        std::fill(is_kept.begin(), is_kept.end(), std::uint8_t{0});
        is_kept[largest] = 1;
    }
    for (std::size_t k = 0; k < all.size(); ++k)
        (is_kept[k] != 0 ? reduction.near : reduction.removed).push_back(all[k]);
    for (const std::uint32_t triangle : reduction.removed) {
        const double distance =
            distance_to_set(corners(triangle), kInfinity, [&](const Corners& part) {
                double least = kInfinity;
                for (const std::uint32_t kept : reduction.near)
                    least = std::min(least, largest_distance(part, corners(kept)));
                return least;
            });
        reduction.error_m = std::max(reduction.error_m, distance + bounds_[triangle].largest());
    }
    return reduction;
}

// Removes all triangles, if triangles of other components are near enough.
std::optional<Reduction> Components::to_others(std::uint32_t component,
                                               std::span<const std::uint32_t> all, double limit) {
    build_tree();
    if (!has_others_near(component, all, limit)) return std::nullopt;
    Reduction reduction;
    for (const std::uint32_t triangle : all) {
        const double bound = bounds_[triangle].largest();
        const double distance =
            distance_to_set(corners(triangle), limit - bound, [&](const Corners& part) {
                std::uint32_t other = kNoTriangle;
                const double least = nearest_other(component, part, limit - bound, other);
                if (other != kNoTriangle) reduction.near.push_back(other);
                return least;
            });
        reduction.error_m = std::max(reduction.error_m, distance + bound);
        if (!(reduction.error_m <= limit) || !(reduction.error_m < kInfinity)) return std::nullopt;
    }
    std::sort(reduction.near.begin(), reduction.near.end());
    reduction.near.erase(std::unique(reduction.near.begin(), reduction.near.end()),
                         reduction.near.end());
    reduction.removed.assign(all.begin(), all.end());
    return reduction;
}

// Quick test: false if the centroid of a triangle is too far from all triangles of other components.
bool Components::has_others_near(std::uint32_t component, std::span<const std::uint32_t> all,
                                 double limit) const {
    return std::all_of(all.begin(), all.end(), [&](std::uint32_t triangle) {
        const Corners c = corners(triangle);
        const Eigen::Vector3d middle = (c[0] + c[1] + c[2]) / 3.0;
        std::uint32_t other = kNoTriangle;
        nearest_other(component, {middle, middle, middle}, limit, other);
        return other != kNoTriangle;
    });
}

// Least largest_distance() from a part to a triangle of another component; infinity if none is within the limit.
double Components::nearest_other(std::uint32_t component, const Corners& part, double limit,
                                 std::uint32_t& other_out) const {
    double least = kInfinity;
    const auto bound = [&](const Aabb& box) {
        return std::max({distance_to_box(part[0], box), distance_to_box(part[1], box),
                         distance_to_box(part[2], box)});
    };
    visit_leaves_up_to(tree_, limit, bound, [&](std::uint32_t leaf) {
        const std::uint32_t other = items_[leaf];
        if (mesh_.is_alive(other) && component_[other] != component) {
            const double distance = largest_distance(part, corners(other));
            if (distance <= limit &&
                (distance < least || (distance == least && other < other_out))) {
                least = distance;
                other_out = other;
            }
        }
        return std::min(least, limit);
    });
    return least;
}

void Components::add_turned_area(Reduction& reduction) const {
    const auto area_vector = [&](std::uint32_t triangle) -> Eigen::Vector3d {
        const Corners c = corners(triangle);
        return 0.5 * cross(c[1] - c[0], c[2] - c[0]);
    };
    for (const std::uint32_t triangle : reduction.removed) {
        const Eigen::Vector3d area = area_vector(triangle);
        const bool has_likewise =
            std::any_of(reduction.near.begin(), reduction.near.end(),
                        [&](std::uint32_t other) { return dot(area, area_vector(other)) > 0.0; });
        if (!has_likewise) reduction.turned_area += length(area);
    }
}

// The tree's boxes are not updated when triangles change: a query returns a triangle at its current position, but not
// always the nearest one.
void Components::build_tree() {
    if (!tree_.empty() && 2 * mesh_.alive_count() > alive_at_build_) return;
    alive_at_build_ = mesh_.alive_count();
    items_.clear();
    std::vector<Aabb> boxes;
    for (std::uint32_t i = 0; i < component_.size(); ++i) {
        if (!mesh_.is_alive(i)) continue;
        const Corners c = corners(i);
        boxes.push_back({c[0].cwiseMin(c[1]).cwiseMin(c[2]), c[0].cwiseMax(c[1]).cwiseMax(c[2])});
        items_.push_back(i);
    }
    tree_ = make_aabb_tree(boxes);
}

}  // namespace terrane::internal
