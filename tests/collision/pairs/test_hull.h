// SPDX-License-Identifier: MIT
#pragma once

#include "pairs/convex_pairs.h"

#include <algorithm>
#include <cmath>
#include <vector>

// Hulls by brute force: every triple of points is tried as a face.
namespace terrane::test {

class TestHull {
public:
    explicit TestHull(std::vector<Eigen::Vector3d> points) : vertices_(std::move(points)) {
        find_faces();
        find_edges();
    }

    internal::HullView view() const {
        internal::HullView view;
        view.shape = {vertices_, faces_, loops_, edges_, first_, neighbours_};
        for (const Eigen::Vector3d& v : vertices_) view.reach = std::max(view.reach, v.norm());
        return view;
    }

private:
    // All points must be vertices of their hull.
    void find_faces() {
        const std::size_t n = vertices_.size();
        double size = 0.0;
        for (const Eigen::Vector3d& v : vertices_) size = std::max(size, v.norm());
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t j = i + 1; j < n; ++j) {
                for (std::size_t k = j + 1; k < n; ++k) {
                    Eigen::Vector3d m =
                        (vertices_[j] - vertices_[i]).cross(vertices_[k] - vertices_[i]);
                    m.normalize();
                    add_face(m, i, 1e-9 * size);
                    add_face(-m, i, 1e-9 * size);
                }
            }
        }
    }
    void add_face(const Eigen::Vector3d& m, std::size_t on, double slack) {
        const double offset = m.dot(vertices_[on]);
        std::vector<std::uint32_t> members;
        double farthest = offset;
        for (std::uint32_t i = 0; i < vertices_.size(); ++i) {
            const double height = m.dot(vertices_[i]);
            if (height > offset + slack) return;
            farthest = std::max(farthest, height);
            if (height > offset - slack) members.push_back(i);
        }
        for (const auto& face : faces_) {
            if (face.normal.dot(m) > 1.0 - 1e-12) return;  // another triple of the same face
        }
        Eigen::Vector3d middle = Eigen::Vector3d::Zero();
        for (const std::uint32_t i : members) {
            middle += vertices_[i] / static_cast<double>(members.size());
        }
        const Eigen::Vector3d x = (vertices_[members[0]] - middle).normalized();
        const Eigen::Vector3d y = m.cross(x);
        const auto angle = [&](std::uint32_t i) {
            return std::atan2(y.dot(vertices_[i] - middle), x.dot(vertices_[i] - middle));
        };
        std::sort(members.begin(), members.end(),
                  [&](std::uint32_t a, std::uint32_t b) { return angle(a) < angle(b); });
        internal::Polyhedron::Face face;
        face.normal = m;
        face.offset = farthest;
        face.first = static_cast<std::uint32_t>(loops_.size());
        face.count = static_cast<std::uint32_t>(members.size());
        loops_.insert(loops_.end(), members.begin(), members.end());
        faces_.push_back(face);
    }
    void find_edges() {
        using internal::Polyhedron;
        if (vertices_.size() == 2) {
            edges_.push_back({0, 1, Polyhedron::kNoFace, Polyhedron::kNoFace});
        }
        for (std::uint32_t f = 0; f < faces_.size(); ++f) {
            for (std::uint32_t k = 0; k < faces_[f].count; ++k) {
                const std::uint32_t from = loops_[faces_[f].first + k];
                const std::uint32_t to = loops_[faces_[f].first + (k + 1) % faces_[f].count];
                const auto is_same = [&](const Polyhedron::Edge& e) {
                    return e.from == std::min(from, to) && e.to == std::max(from, to);
                };
                auto edge = std::find_if(edges_.begin(), edges_.end(), is_same);
                if (edge == edges_.end()) {
                    edge = edges_.insert(edges_.end(), {std::min(from, to), std::max(from, to),
                                                        Polyhedron::kNoFace, Polyhedron::kNoFace});
                }
                (from < to ? edge->left : edge->right) = f;
            }
        }
        for (std::uint32_t i = 0; i < vertices_.size(); ++i) {
            first_.push_back(static_cast<std::uint32_t>(neighbours_.size()));
            for (std::uint32_t j = 0; j < vertices_.size(); ++j) {
                for (const Polyhedron::Edge& e : edges_) {
                    if (e.from == std::min(i, j) && e.to == std::max(i, j)) {
                        neighbours_.push_back(j);
                    }
                }
            }
        }
        first_.push_back(static_cast<std::uint32_t>(neighbours_.size()));
    }

    std::vector<Eigen::Vector3d> vertices_;
    std::vector<internal::Polyhedron::Face> faces_;
    std::vector<std::uint32_t> loops_;
    std::vector<internal::Polyhedron::Edge> edges_;
    std::vector<std::uint32_t> first_;
    std::vector<std::uint32_t> neighbours_;
};

}  // namespace terrane::test
