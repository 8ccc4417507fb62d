// SPDX-License-Identifier: MIT
//
// Sources: C. Ericson. Real-time collision detection. 2005, section 5.1.9 (two segments).
// The way from the ground to the core of a sphere or capsule that is the shortest nearby starts at a face, a
// convex edge or a vertex, square to it. Each feature is looked at once: a contact is where the way lies in
// its normal cone.
#include "round_patches.h"

#include "closest_points.h"
#include "window_features.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

class Pairs {
public:
    Pairs(const LocalGround& local, const GroundWindow& window, const CellRange& cells,
          const LocalShape& shape, std::uint32_t part, const Eigen::Vector3d& freeing,
          double margin, double reach, ContactPatches& patches)
        : local_(local),
          window_(window),
          shape_(shape),
          has_core_(shape.has_core()),
          part_(part),
          freeing_(freeing),
          margin_(margin),
          reach_(reach),
          // Where it is not moved, a core clear of the ground is paired with features up to it.
          nearest_(length(freeing) == 0.0 ? 0.0 : shape.radius - kTouch),
          furthest_(shape.radius + reach),
          lowest_(shape.centre[2] - shape.bounds[2] - margin),
          spacing_(local.spacing()),
          per_metre_(1.0 / local.spacing()),
          slack_(1e-10 * local.spacing()),
          from_(shape.centre + freeing - shape.core),
          to_(shape.centre + freeing + shape.core),
          first_{static_cast<int>(cells.west - window.cells.west),
                 static_cast<int>(cells.south - window.cells.south)},
          last_{static_cast<int>(cells.east - window.cells.west) + 1,
                static_cast<int>(cells.north - window.cells.south) + 1},
          patches_(patches) {}

    void run() {
        make_codes();
        take_vertices();
        visit_convex_edges(
            window_, first_, last_, codes_,
            [&](const WindowVertex& from, const WindowVertex& to, const WindowVertex& left,
                const WindowVertex& right) { take_edge(from, to, left, right); });
        take_faces();
    }

private:
    Eigen::Vector3d vertex(const WindowVertex& v) const {
        return {local_.x(window_.cells.west + v.column), local_.y(window_.cells.south + v.row),
                window_.at(v.column, v.row)};
    }

    // A way of a length from the ground to a point of the core.
    void add(const Eigen::Vector3d& on_core, const Eigen::Vector3d& n, double distance) {
        const double gap = distance - shape_.radius;
        const double depth = dot(n, freeing_) - gap;
        if (gap > reach_ || depth < -margin_) return;
        Contact contact;
        contact.point_world = on_core - shape_.radius * n - freeing_;
        contact.normal = n;
        contact.depth = depth;
        contact.feature = shape_.core_feature(on_core - freeing_);
        contact.part = part_;
        patches_.add(contact);
    }

    bool is_in_reach(double square, double up) const {
        return square <= furthest_ * furthest_ && square >= nearest_ * nearest_ && up >= 0.0 &&
               square > kTouch * kTouch;
    }

    void take_vertices() {
        for (int row = first_.row + 1; row < last_.row; ++row) {
            for (int column = first_.column + 1; column < last_.column; ++column) {
                if (codes_.at(column, row) != 0) continue;
                const Eigen::Vector3d v = vertex({column, row});
                Eigen::Vector3d on_core = from_;
                if (has_core_) {
                    const Eigen::Vector3d along = to_ - from_;
                    on_core +=
                        std::clamp(dot(along, v - from_) / dot(along, along), 0.0, 1.0) * along;
                }
                const Eigen::Vector3d way = on_core - v;
                const double square = dot(way, way);
                if (!is_in_reach(square, way[2])) continue;
                const double distance = std::sqrt(square);
                const Eigen::Vector3d n = way / distance;
                if (is_top(window_, {column, row}, spacing_, n, slack_)) add(on_core, n, distance);
            }
        }
    }

    // What joins two vertices below the shape, or beside it on the rim, is further than the margin.
    void make_codes() {
        for (int row = first_.row; row <= last_.row; ++row) {
            for (int column = first_.column; column <= last_.column; ++column) {
                const unsigned code = (column == first_.column ? 1u : 0u) |
                                      (column == last_.column ? 2u : 0u) |
                                      (row == first_.row ? 4u : 0u) | (row == last_.row ? 8u : 0u) |
                                      (window_.at(column, row) < lowest_ ? 16u : 0u);
                codes_.at(column, row) = static_cast<std::uint8_t>(code);
            }
        }
    }

    void take_edge(const WindowVertex& from, const WindowVertex& to, const WindowVertex& left,
                   const WindowVertex& right) {
        const Eigen::Vector3d a = vertex(from);
        const Eigen::Vector3d edge = vertex(to) - a;
        const SegmentPlaces places = find_closest_places(from_, to_ - from_, a, edge);
        if (!(places.t > 0.0 && places.t < 1.0)) return;  // a vertex
        const Eigen::Vector3d on_core = from_ + places.s * (to_ - from_);
        const Eigen::Vector3d way = on_core - (a + places.t * edge);
        const double square = dot(way, way);
        if (!is_in_reach(square, way[2])) return;
        const double distance = std::sqrt(square);
        if (dot(way, vertex(left) - a) <= slack_ * distance &&
            dot(way, vertex(right) - a) <= slack_ * distance) {
            add(on_core, way / distance, distance);
        }
    }

    void take_faces() {
        for (int row = first_.row; row < last_.row; ++row) {
            for (int column = first_.column; column < last_.column; ++column) {
                if (window_.highest(column, row) < lowest_) continue;
                for (const bool is_south : {true, false}) {
                    const WindowSlopes slopes = window_.slopes(column, row, is_south);
                    const double x = slopes.x * per_metre_;
                    const double y = slopes.y * per_metre_;
                    const Eigen::Vector3d start = vertex(
                        {window_.is_cut_to_north_east(column, row) ? column : column + 1, row});
                    take_face(column, row, is_south, x, y, from_ - start, from_);
                    if (has_core_) take_face(column, row, is_south, x, y, to_ - start, to_);
                }
            }
        }
    }

    // One end of the core over a face of some slopes, seen from where the cell's cut starts in the south.
    void take_face(int column, int row, bool is_south, double x, double y,
                   const Eigen::Vector3d& to, const Eigen::Vector3d& end) {
        const double over = to[2] - (x * to[0] + y * to[1]);
        const double square = 1.0 + x * x + y * y;
        if (over < 0.0 || over * over > furthest_ * furthest_ * square ||
            over * over < nearest_ * nearest_ * square) {
            return;
        }
        // the foot of the perpendicular, roughly
        const double hair = 1e-9 * spacing_;
        const double foot_x = to[0] + x * (over / square);
        const double foot_y = to[1] + y * (over / square);
        const double u = window_.is_cut_to_north_east(column, row) ? foot_x : foot_x + spacing_;
        if (u < -hair || u > spacing_ + hair || foot_y < -hair || foot_y > spacing_ + hair) return;
        const Triangle triangle = local_.triangle(window_, column, row, is_south);
        if (!is_foot_inside(end, triangle)) return;
        add(end, triangle.normal, dot(triangle.normal, end - triangle.v[0]));
    }

    const LocalGround& local_;
    const GroundWindow& window_;
    const LocalShape& shape_;  ///< where it is
    bool has_core_;
    std::uint32_t part_;
    const Eigen::Vector3d& freeing_;
    double margin_;
    double reach_;
    double nearest_, furthest_;  ///< ways from the ground to the core that count, metres
    double lowest_;              ///< ground below this is further than the margin
    double spacing_;
    double per_metre_;  ///< cells
    double slack_;      ///< by which a neighbour may stand out before it counts as above a plane
    Eigen::Vector3d from_, to_;  ///< ends of the core where the shape is free
    WindowVertex first_, last_;
    WindowCodes codes_;
    ContactPatches& patches_;
};

}  // namespace

void find_round_patches(const LocalGround& local, const GroundWindow& window,
                        const CellRange& cells, const LocalShape& shape, std::uint32_t part,
                        const Eigen::Vector3d& freeing, double margin, double reach,
                        ContactPatches& patches) {
    Pairs(local, window, cells, shape, part, freeing, margin, reach, patches).run();
}

}  // namespace terrane::internal
