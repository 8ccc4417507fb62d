// SPDX-License-Identifier: MIT
//
// Sources: G. van den Bergen. Collision detection in interactive 3D environments. 2003, section 4.4
//          (contacts from pairs of features).
// Deviations: each vertex, edge and face of the ground is tested once, and skipped if the planes below the box separate
//             it from the box. Features are paired after a *separating* translation.
#include "ground/column/column.h"
#include "ground/column/window_features.h"
#include "ground/heightfield/feature_contacts.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

class BoxPairs {
public:
    BoxPairs(const LocalGround& local, const LocalWindow& window, const CellRange& cells,
             const LocalShape& box, std::uint32_t part, const Eigen::Vector3d& translation,
             double margin, double reach, ContactPatches& patches)
        : local_(local),
          window_(window),
          cells_(window, cells),
          at_start_(box),
          part_(part),
          translation_(translation),
          margin_(margin),
          reach_(reach),
          spacing_(local.spacing()),
          slack_(1e-10 * local.spacing()),
          centre_(box.centre + translation),
          patches_(patches) {
        for (std::size_t i = 0; i < 3; ++i) up_[i] = box.up(i);
        const Eigen::Vector3d around = box.bounds + Eigen::Vector3d::Constant(margin);
        low_ = box.centre - around;
        high_ = box.centre + around;
    }

    void run() {
        visit_corners();
        make_codes();
        visit_vertices();
        visit_convex_edges(
            window_, cells_, codes_,
            [&](const WindowVertex& from, const WindowVertex& to, const WindowVertex& left,
                const WindowVertex& right) { visit_edge(from, to, left, right); });
    }

private:
    void add(const Eigen::Vector3d& on_box, const Eigen::Vector3d& n, double gap,
             const ShapeFeature& feature) {
        patches_.add(
            make_contact(on_box - translation_, n, dot(n, translation_) - gap, feature, part_));
    }

    bool is_gap(const Eigen::Vector3d& n, double gap) const {
        return gap >= -kTouch && gap <= std::min(dot(n, translation_) + margin_, reach_);
    }

    // Pairs corners of the box with faces of the ground.
    void visit_corners() {
        for (int k = 0; k < 8; ++k) {
            const Eigen::Vector3d start = at_start_.corner(k);
            if (start[2] > window_.high + margin_) continue;
            const Eigen::Vector3d p = start + translation_;
            const Eigen::Vector3d to = p - local_.corner(window_);
            const int west = std::max(cells_.west, cell_of(to[0] - reach_));
            const int east = std::min(cells_.east, cell_of(to[0] + reach_));
            const int south = std::max(cells_.south, cell_of(to[1] - reach_));
            const int north = std::min(cells_.north, cell_of(to[1] + reach_));
            for (int row = south; row <= north; ++row) {
                for (int column = west; column <= east; ++column) {
                    // before the translation, the corner is above the whole cell by more than the margin
                    if (start[2] > window_.highest(column, row) + margin_) continue;
                    visit_corner(k, p, column, row);
                }
            }
        }
    }

    // Index of the cell at a coordinate in the window, clamped to one cell outside.
    int cell_of(double p) const {
        return static_cast<int>(
            std::floor(std::clamp(p / spacing_, -1.0, double{LocalWindow::kMostCells})));
    }

    void visit_corner(int k, const Eigen::Vector3d& p, int column, int row) {
        if (!window_.is_ground(column, row)) return;
        for (const bool is_south : {true, false}) {
            const WindowFace face = make_window_face(local_, window_, column, row, is_south);
            const double over = face.above(p);
            const double over_start =
                over - (translation_[2] - (face.x * translation_[0] + face.y * translation_[1]));
            if (over_start > 0.0 && over_start * over_start > margin_ * margin_ * face.square)
                continue;
            if (over < 0.0 && over * over > kTouch * kTouch * face.square) continue;
            if (!face.may_have_foot(p, over, spacing_)) continue;
            const Triangle triangle = local_.triangle(window_, column, row, is_south);
            const Eigen::Vector3d& n = triangle.normal;
            const double gap = dot(n, p - triangle.v[0]);
            if (!is_gap(n, gap) || !is_foot_inside(p, triangle)) continue;
            // only corners of the box face that is most nearly parallel to the triangle and faces it
            const std::size_t nearest = at_start_.nearest_axis(n);
            if (((k >> nearest & 1) == 0) != (dot(n, at_start_.axes[nearest]) > 0.0)) continue;
            const auto name = static_cast<std::uint32_t>(k);
            add(p, n, gap, {name, name});
        }
    }

    // Pairs vertices of the ground with faces of the box.
    void visit_vertices() {
        for (int row = cells_.south; row <= cells_.north; ++row) {
            for (int column = cells_.west; column <= cells_.east; ++column) {
                if (codes_.at(column, row) != 0) continue;
                const Eigen::Vector3d v = local_.vertex(window_, column, row);
                const Eigen::Vector3d to = centre_ - v;
                for (std::size_t i = 0; i < 3; ++i) {
                    const Eigen::Vector3d& n = up_[i];
                    const double gap = dot(n, to) - at_start_.half[static_cast<Eigen::Index>(i)];
                    if (!is_gap(n, gap) || n[2] == 0.0) continue;
                    const std::size_t j = (i + 1) % 3;
                    const std::size_t k = (i + 2) % 3;
                    if (std::abs(dot(up_[j], to)) > at_start_.half[static_cast<Eigen::Index>(j)] ||
                        std::abs(dot(up_[k], to)) > at_start_.half[static_cast<Eigen::Index>(k)] ||
                        !is_top(window_, {column, row}, spacing_, n, slack_)) {
                        continue;
                    }
                    const std::uint32_t side = at_start_.axes[i][2] < 0.0 ? 1u : 0u;
                    add(v + gap * n, n, gap,
                        {2 * static_cast<std::uint32_t>(i) + side, ShapeFeature::kFace});
                }
            }
        }
    }

    // Computes the outcodes of vertices: bits 0 to 2 for the planes of the box's lower faces, lowered by the margin;
    // bits 3 to 6 for the sides of its bounds, widened by the margin.
    void make_codes() {
        std::array<double, 3> lowest;
        for (std::size_t i = 0; i < 3; ++i) {
            lowest[i] = -at_start_.half[static_cast<Eigen::Index>(i)] - margin_;
        }
        for (int row = cells_.south; row <= cells_.north + 1; ++row) {
            for (int column = cells_.west; column <= cells_.east + 1; ++column) {
                const Eigen::Vector3d v = local_.vertex(window_, column, row);
                const Eigen::Vector3d to = v - at_start_.centre;
                const unsigned code = (v[0] < low_[0] ? 8u : 0u) | (v[0] > high_[0] ? 16u : 0u) |
                                      (v[1] < low_[1] ? 32u : 0u) | (v[1] > high_[1] ? 64u : 0u) |
                                      (dot(up_[0], to) < lowest[0] ? 1u : 0u) |
                                      (dot(up_[1], to) < lowest[1] ? 2u : 0u) |
                                      (dot(up_[2], to) < lowest[2] ? 4u : 0u);
                codes_.at(column, row) = static_cast<std::uint8_t>(code);
            }
        }
    }

    // Pairs a convex edge of the ground, given with the third corners of its two triangles, with the edges of the box.
    void visit_edge(const WindowVertex& from, const WindowVertex& to, const WindowVertex& left,
                    const WindowVertex& right) {
        const auto vertex = [&](const WindowVertex& v) {
            return local_.vertex(window_, v.column, v.row);
        };
        const Eigen::Vector3d a = vertex(from);
        const Eigen::Vector3d edge = vertex(to) - a;
        const Eigen::Vector3d to_left = vertex(left) - a;
        const Eigen::Vector3d to_right = vertex(right) - a;
        const double edge_square = dot(edge, edge);
        const double edge_length = std::sqrt(edge_square);
        for (std::size_t i = 0; i < 3; ++i) {
            const Eigen::Vector3d& axis = at_start_.axes[i];
            Eigen::Vector3d n = cross(axis, edge);
            if (n[2] < 0.0) n = -n;
            // most directions are not in the edge's normal cone
            const double rise = std::max(dot(n, to_left), dot(n, to_right));
            if (n[2] <= 0.0 || rise > slack_ * edge_length) continue;
            // nearly parallel edges: faces and corners give the same contacts
            const double square = dot(n, n);
            if (square < 1e-12 * edge_square) continue;
            const double size = std::sqrt(square);
            if (rise > slack_ * size) continue;
            n /= size;
            // The support edge of the box against n.
            Eigen::Vector3d p = centre_;
            std::uint32_t corner = 0;
            for (std::size_t m = 0; m < 3; ++m) {
                if (m == i) continue;
                const double half = at_start_.half[static_cast<Eigen::Index>(m)];
                const bool is_high = !(dot(n, at_start_.axes[m]) > 0.0);
                p += (is_high ? half : -half) * at_start_.axes[m];
                if (is_high) corner |= 1u << m;
            }
            const double gap = dot(n, p - a);
            if (!is_gap(n, gap)) continue;
            // The closest points of the two lines.
            const Eigen::Vector3d direction = edge / edge_length;
            const Eigen::Vector3d r = p - a;
            const double b = dot(axis, direction);
            const double s = (b * dot(direction, r) - dot(axis, r)) / (1.0 - b * b);
            const double t = dot(direction, r) + s * b;
            // with slack, so that an edge of the box that crosses over a vertex crosses at least one edge at the vertex
            const double half = at_start_.half[static_cast<Eigen::Index>(i)];
            if (std::abs(s) > half + slack_ || t < -slack_ || t > edge_length + slack_) continue;
            add(p + s * axis, n, gap, {corner, corner | 1u << i});
        }
    }

    const LocalGround& local_;
    const LocalWindow& window_;
    WindowCells cells_;
    const LocalShape& at_start_;
    std::uint32_t part_;
    const Eigen::Vector3d& translation_;
    double margin_;
    double reach_;
    double spacing_;
    double slack_;            // a neighbour counts as above a plane if it is higher by this, metres
    Eigen::Vector3d centre_;  // of the translated box
    std::array<Eigen::Vector3d, 3> up_;
    Eigen::Vector3d low_, high_;  // of the bounds with the margin
    WindowCodes codes_;
    ContactPatches& patches_;
};

}  // namespace

void find_box_patches(const LocalGround& local, const LocalWindow& window, const CellRange& cells,
                      const LocalShape& box, std::uint32_t part, const Eigen::Vector3d& translation,
                      double margin, double reach, ContactPatches& patches) {
    BoxPairs(local, window, cells, box, part, translation, margin, reach, patches).run();
}

// Contacts of spheres and capsules: a locally shortest vector from the ground to the core starts at a face, a convex
// edge or a vertex, and lies in the normal cone there. Each feature is tested once.
//
// Sources: C. Ericson. Real-time collision detection. 2005, section 5.1.9 (two segments).

namespace {

class RoundPairs {
public:
    RoundPairs(const LocalGround& local, const LocalWindow& window, const CellRange& cells,
               const LocalShape& shape, std::uint32_t part, const Eigen::Vector3d& translation,
               double margin, double reach, ContactPatches& patches)
        : local_(local),
          window_(window),
          cells_(window, cells),
          shape_(shape),
          has_core_(shape.has_core()),
          part_(part),
          translation_(translation),
          margin_(margin),
          reach_(reach),
          // Without a translation, the shape may overlap the ground down to its core.
          nearest_(length(translation) == 0.0 ? 0.0 : shape.radius - kTouch),
          furthest_(shape.radius + reach),
          low_(shape.centre - shape.bounds - Eigen::Vector3d::Constant(margin)),
          high_(shape.centre + shape.bounds + Eigen::Vector3d::Constant(margin)),
          spacing_(local.spacing()),
          slack_(1e-10 * local.spacing()),
          from_(shape.centre + translation - shape.core),
          to_(shape.centre + translation + shape.core),
          patches_(patches) {}

    void run() {
        if (!visit_faces()) return;
        visit_vertices();
        visit_convex_edges(
            window_, cells_, codes_,
            [&](const WindowVertex& from, const WindowVertex& to, const WindowVertex& left,
                const WindowVertex& right) { visit_edge(from, to, left, right); });
    }

private:
    static constexpr unsigned kFar = 16;  // outcode bit of a vertex: on no face near the core

    Eigen::Vector3d vertex(const WindowVertex& v) const {
        return local_.vertex(window_, v.column, v.row);
    }

    // Adds the contact of a point of the core that lies at `distance` along n from its nearest point of the ground.
    void add(const Eigen::Vector3d& on_core, const Eigen::Vector3d& n, double distance) {
        const double gap = distance - shape_.radius;
        const double depth = dot(n, translation_) - gap;
        if (gap > reach_ || depth < -margin_) return;
        patches_.add(make_contact(on_core - shape_.radius * n - translation_, n, depth,
                                  shape_.core_feature(on_core - translation_), part_));
    }

    bool is_in_reach(double square, double up) const {
        return square <= furthest_ * furthest_ && square >= nearest_ * nearest_ && up >= 0.0 &&
               square > kTouch * kTouch;
    }

    void visit_vertices() {
        for (int row = cells_.south; row <= cells_.north; ++row) {
            for (int column = cells_.west; column <= cells_.east; ++column) {
                if (codes_.at(column, row) != 0) continue;
                const Eigen::Vector3d v = vertex({column, row});
                Eigen::Vector3d on_core = from_;
                if (has_core_) {
                    const Eigen::Vector3d along = to_ - from_;
                    on_core +=
                        std::clamp(dot(along, v - from_) / dot(along, along), 0.0, 1.0) * along;
                }
                const Eigen::Vector3d to_core = on_core - v;
                const double square = dot(to_core, to_core);
                if (!is_in_reach(square, to_core[2])) continue;
                const double distance = std::sqrt(square);
                const Eigen::Vector3d n = to_core / distance;
                if (is_top(window_, {column, row}, spacing_, n, slack_)) add(on_core, n, distance);
            }
        }
    }

    void visit_edge(const WindowVertex& from, const WindowVertex& to, const WindowVertex& left,
                    const WindowVertex& right) {
        const Eigen::Vector3d a = vertex(from);
        const Eigen::Vector3d edge = vertex(to) - a;
        const SegmentParameters parameters = find_closest_parameters(from_, to_ - from_, a, edge);
        if (!(parameters.t > 0.0 && parameters.t < 1.0)) return;  // closest at a vertex
        const Eigen::Vector3d on_core = from_ + parameters.s * (to_ - from_);
        const Eigen::Vector3d to_core = on_core - (a + parameters.t * edge);
        const double square = dot(to_core, to_core);
        if (!is_in_reach(square, to_core[2])) return;
        const double distance = std::sqrt(square);
        if (dot(to_core, vertex(left) - a) <= slack_ * distance &&
            dot(to_core, vertex(right) - a) <= slack_ * distance) {
            add(on_core, to_core / distance, distance);
        }
    }

    // Pairs faces and computes the outcodes of vertices: only features of faces near the translated core, inside the
    // widened bounds, can have contacts. False if no face is near.
    bool visit_faces() {
        bool is_any_near = false;
        for (int row = cells_.south; row <= cells_.north + 1; ++row) {
            const double y = local_.y(window_.cells.south + row);
            const unsigned row_code = kFar | (y < low_[1] ? 4u : 0u) | (y > high_[1] ? 8u : 0u);
            for (int column = cells_.west; column <= cells_.east + 1; ++column) {
                const double x = local_.x(window_.cells.west + column);
                codes_.at(column, row) = static_cast<std::uint8_t>(
                    row_code | (x < low_[0] ? 1u : 0u) | (x > high_[0] ? 2u : 0u));
            }
        }
        for (int row = cells_.south; row <= cells_.north; ++row) {
            for (int column = cells_.west; column <= cells_.east; ++column) {
                if (window_.highest(column, row) < low_[2]) continue;
                const bool is_even = window_.is_cut_to_north_east(column, row);
                for (const bool is_south : {true, false}) {
                    if (!visit_face(column, row, is_south)) continue;
                    is_any_near = true;
                    unmark(is_even ? column : column + 1, row);
                    unmark(is_even ? column + 1 : column, row + 1);
                    unmark(is_even == is_south ? column + 1 : column, is_south ? row : row + 1);
                }
            }
        }
        return is_any_near;
    }

    void unmark(int column, int row) {
        std::uint8_t& code = codes_.at(column, row);
        code = static_cast<std::uint8_t>(code & ~kFar);
    }

    // Pairs a face with the ends of the core; false if the plane of the face is too far below both ends.
    bool visit_face(int column, int row, bool is_south) {
        const WindowFace face = make_window_face(local_, window_, column, row, is_south);
        // slightly more, to cover the rounding of planes
        const double furthest = (1.0 + 1e-9) * furthest_ * furthest_ * face.square;
        const double over_from = face.above(from_);
        if (!has_core_) {
            if (over_from > 0.0 && over_from * over_from > furthest) return false;
            visit_end(face, column, row, is_south, from_, over_from);
            return true;
        }
        const double over_to = face.above(to_);
        const double least = std::min(over_from, over_to);
        if (least > 0.0 && least * least > furthest) return false;
        visit_end(face, column, row, is_south, from_, over_from);
        visit_end(face, column, row, is_south, to_, over_to);
        return true;
    }

    // Adds a contact of an end of the core and a face if the end projects into the face and is within range. `over` is
    // the height of the end above the plane of the face, measured vertically.
    void visit_end(const WindowFace& face, int column, int row, bool is_south,
                   const Eigen::Vector3d& end, double over) {
        if (over < 0.0 || over * over > furthest_ * furthest_ * face.square ||
            over * over < nearest_ * nearest_ * face.square ||
            !face.may_have_foot(end, over, spacing_)) {
            return;
        }
        const Triangle triangle = local_.triangle(window_, column, row, is_south);
        if (!is_foot_inside(end, triangle)) return;
        add(end, triangle.normal, dot(triangle.normal, end - triangle.v[0]));
    }

    const LocalGround& local_;
    const LocalWindow& window_;
    WindowCells cells_;
    const LocalShape& shape_;  ///< untranslated
    bool has_core_;
    std::uint32_t part_;
    const Eigen::Vector3d& translation_;
    double margin_;
    double reach_;
    double nearest_, furthest_;   ///< least and largest distance from ground to core, metres
    Eigen::Vector3d low_, high_;  ///< of the bounds with the margin
    double spacing_;
    double slack_;  ///< a neighbour counts as above a plane if it is higher by this, metres
    Eigen::Vector3d from_, to_;  ///< ends of the translated core
    WindowCodes codes_;
    ContactPatches& patches_;
};

}  // namespace

void find_round_patches(const LocalGround& local, const LocalWindow& window, const CellRange& cells,
                        const LocalShape& shape, std::uint32_t part,
                        const Eigen::Vector3d& translation, double margin, double reach,
                        ContactPatches& patches) {
    RoundPairs(local, window, cells, shape, part, translation, margin, reach, patches).run();
}

}  // namespace terrane::internal
