// SPDX-License-Identifier: MIT
#include "trade/trials/extreme_search.h"

namespace terrane::tools {

ExtremeSearch::ExtremeSearch(const ConvexHull& hull)
    : vertices_(hull.vertices().begin(), hull.vertices().end()) {
    std::vector<std::vector<std::uint32_t>> neighbours(vertices_.size());
    for (std::size_t face = 0; face < hull.face_count(); ++face) {
        // each edge is in two faces, once in each direction
        const std::span<const std::uint32_t> corners = hull.face(face);
        for (std::size_t i = 0; i < corners.size(); ++i) {
            neighbours[corners[i]].push_back(corners[(i + 1) % corners.size()]);
        }
    }
    for (const std::vector<std::uint32_t>& each : neighbours) {
        first_neighbour_.push_back(static_cast<std::uint32_t>(neighbours_.size()));
        neighbours_.insert(neighbours_.end(), each.begin(), each.end());
    }
    first_neighbour_.push_back(static_cast<std::uint32_t>(neighbours_.size()));
    for (int axis = 0; axis < 3; ++axis) {
        starts_.push_back(by_scan(Eigen::Vector3d::Unit(axis)));
        starts_.push_back(by_scan(-Eigen::Vector3d::Unit(axis)));
    }
}

std::uint32_t ExtremeSearch::by_scan(const Eigen::Vector3d& direction) const {
    std::uint32_t best = 0;
    double most = direction.dot(vertices_[0]);
    for (std::uint32_t i = 1; i < vertices_.size(); ++i) {
        const double along = direction.dot(vertices_[i]);
        if (along <= most) continue;
        most = along;
        best = i;
    }
    return best;
}

std::uint32_t ExtremeSearch::by_climb(const Eigen::Vector3d& direction) const {
    std::uint32_t best = starts_[0];
    double most = direction.dot(vertices_[best]);
    for (const std::uint32_t start : starts_) {
        const double along = direction.dot(vertices_[start]);
        if (along <= most) continue;
        most = along;
        best = start;
    }
    for (bool climbs = true; climbs;) {
        climbs = false;
        const std::uint32_t from = best;
        for (std::uint32_t i = first_neighbour_[from]; i < first_neighbour_[from + 1]; ++i) {
            const double along = direction.dot(vertices_[neighbours_[i]]);
            if (along <= most) continue;
            most = along;
            best = neighbours_[i];
            climbs = true;
        }
    }
    return best;
}

}  // namespace terrane::tools
