// SPDX-License-Identifier: MIT
//
// Sources: C. Ericson. Real-time collision detection. 2005, section 5.1.9 (two segments).
// The vector from the ground to the core of a sphere or capsule that is locally shortest starts at a face, a convex
// edge or a vertex, and lies in the normal cone there. Each feature is tested once.
#include "ground/contact/round_patches.h"

#include "ground/column/closest_points.h"
#include "ground/frame/window_features.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

class RoundPairs {
public:
    RoundPairs(const LocalGround& local, const GroundWindow& window, const CellRange& cells,
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
          // Without a translation the shape overlaps, down to its core.
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
        if (!take_faces()) return;
        take_vertices();
        visit_convex_edges(
            window_, cells_, codes_,
            [&](const WindowVertex& from, const WindowVertex& to, const WindowVertex& left,
                const WindowVertex& right) { take_edge(from, to, left, right); });
    }

private:
    static constexpr unsigned kFar = 16;  // outcode bit: of no face near the core

    Eigen::Vector3d vertex(const WindowVertex& v) const {
        return local_.vertex(window_, v.column, v.row);
    }

    // Adds the contact for a vector of length `distance` along n from the ground to a point of the core.
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

    void take_vertices() {
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

    void take_edge(const WindowVertex& from, const WindowVertex& to, const WindowVertex& left,
                   const WindowVertex& right) {
        const Eigen::Vector3d a = vertex(from);
        const Eigen::Vector3d edge = vertex(to) - a;
        const SegmentParameters parameters = find_closest_parameters(from_, to_ - from_, a, edge);
        if (!(parameters.t > 0.0 && parameters.t < 1.0)) return;  // a vertex
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

    // Pairs faces, and makes the outcodes of vertices: only features of faces near the translated core can be contacts,
    // and only inside the bounds. False where no face is near.
    bool take_faces() {
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
                    if (!take_face(column, row, is_south)) continue;
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

    // A face against the ends of the core; false where its plane is too far below both.
    bool take_face(int column, int row, bool is_south) {
        const WindowFace face = make_window_face(local_, window_, column, row, is_south);
        // slightly more, for the rounding of planes
        const double furthest = (1.0 + 1e-9) * furthest_ * furthest_ * face.square;
        const double over_from = face.above(from_);
        if (!has_core_) {
            if (over_from > 0.0 && over_from * over_from > furthest) return false;
            take_end(face, column, row, is_south, from_, over_from);
            return true;
        }
        const double over_to = face.above(to_);
        const double least = std::min(over_from, over_to);
        if (least > 0.0 && least * least > furthest) return false;
        take_end(face, column, row, is_south, from_, over_from);
        take_end(face, column, row, is_south, to_, over_to);
        return true;
    }

    // An end of the core at a height above a face.
    void take_end(const WindowFace& face, int column, int row, bool is_south,
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
    const GroundWindow& window_;
    WindowCells cells_;
    const LocalShape& shape_;  ///< untranslated
    bool has_core_;
    std::uint32_t part_;
    const Eigen::Vector3d& translation_;
    double margin_;
    double reach_;
    double nearest_, furthest_;   ///< distances from the ground to the core that count, metres
    Eigen::Vector3d low_, high_;  ///< of the bounds with the margin
    double spacing_;
    double slack_;  ///< a neighbour counts as above a plane from this height on, metres
    Eigen::Vector3d from_, to_;  ///< ends of the translated core
    WindowCodes codes_;
    ContactPatches& patches_;
};

}  // namespace

void find_round_patches(const LocalGround& local, const GroundWindow& window,
                        const CellRange& cells, const LocalShape& shape, std::uint32_t part,
                        const Eigen::Vector3d& translation, double margin, double reach,
                        ContactPatches& patches) {
    RoundPairs(local, window, cells, shape, part, translation, margin, reach, patches).run();
}

}  // namespace terrane::internal
