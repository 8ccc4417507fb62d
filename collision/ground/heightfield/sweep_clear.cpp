// SPDX-License-Identifier: MIT
#include "ground/column/column.h"
#include "ground/column/ground_lift.h"
#include "ground/column/local_ground.h"
#include "ground/column/local_shape.h"
#include "ground/column/window_features.h"
#include "ground/heightfield/ground_advance.h"
#include "ground/heightfield/heightfield_queries.h"
#include "shapes/query_shapes.h"

#include <terrane/collision/ground_queries.h>

#include <algorithm>
#include <cmath>

namespace terrane::internal {

/// The normal of a turning plane at the start and the end of a motion: unit, z >= 0.
struct TurningNormal {
    Eigen::Vector3d at_start, at_end;
};

/// The sweep of a convex shape: its poses at both ends of a motion. The shape turns about the body's origin.
class ConvexSweep {
public:
    ConvexSweep(const LocalShape& start, const LocalShape& end, const Motion& motion,
                double margin);

    /// The gap to a turning plane that the shape needs at both ends of the motion to keep at least the margin in
    /// between, metres: a function on [0, 1] with a second derivative of at most G lies at most G / 8 below its chord.
    double clearance(const TurningNormal& n) const {
        return margin_ + 0.125 * (2.0 * length(n.at_end - n.at_start) * travel_ + acceleration_);
    }
    /// The gap to a fixed plane that the shape needs at both ends, metres.
    double clearance() const { return margin_ + 0.125 * acceleration_; }
    /// Least depth of a fixed plane below the centre at the start for a gap of clearance() at both ends, metres.
    double depth(const Eigen::Vector3d& n) const {
        return clearance() +
               std::max(start_.drop(n), end_.drop(n) - dot(n, end_.centre - start_.centre));
    }

    const LocalShape& start() const { return start_; }
    const LocalShape& end() const { return end_; }

private:
    const LocalShape& start_;
    const LocalShape& end_;
    double margin_;
    double travel_;        ///< largest distance that a point moves, metres
    double acceleration_;  ///< largest second derivative of the trajectory of any point, metres
};

/// Whether planes prove that a shape stays farther than the sweep's margin from every triangle of some cells throughout
/// the motion.
///
/// @param window holds the cells, all of them ground
bool are_cells_separated(const LocalGround& local, const LocalWindow& window,
                         const CellRange& cells, const ConvexSweep& sweep);

// Sources: S. Redon, A. Kheddar, S. Coquillart. Fast continuous collision detection between rigid bodies. 2002
//          (one direction that separates over an interval of time).
// Deviations: the separating plane is interpolated linearly between a plane for the start and one for the end. The
//             ground is static, so it stays beyond the plane in between; the gap to the turning shape is reduced by a
//             bound of its curvature. Vertices have outcodes for a few common planes; triangles whose corners share a
//             bit need no plane of their own.

namespace {

/// Finds planes between a sweep and the triangles of some cells of a window.
class SweptSeparation {
public:
    SweptSeparation(const LocalGround& local, const LocalWindow& window, const CellRange& cells,
                    const ConvexSweep& sweep)
        : local_(local), window_(window), cells_(window, cells), sweep_(sweep) {
        switch (sweep.start().kind) {
            case ShapeKind::box:
                add_faces();
                break;
            case ShapeKind::hull:
                add_hull_faces();
                break;
            case ShapeKind::round:
                add_around();
                break;
        }
        mark();
    }

    /// Whether every triangle is proved to be beyond some plane.
    bool are_cells_separated() {
        for (int row = cells_.south; row <= cells_.north; ++row) {
            for (int column = cells_.west; column <= cells_.east; ++column) {
                // The diagonal's ends are corners of both triangles; each of the other two belongs to one triangle.
                const bool is_even = window_.is_cut_to_north_east(column, row);
                const int from = is_even ? column : column + 1;
                const int to = is_even ? column + 1 : column;
                const unsigned cut = codes_.at(from, row) & codes_.at(to, row + 1);
                if ((cut & codes_.at(to, row)) == 0 && !test_own_plane(column, row, true))
                    return false;
                if ((cut & codes_.at(from, row + 1)) == 0 && !test_own_plane(column, row, false))
                    return false;
            }
        }
        return std::all_of(undecided_.begin(), undecided_.begin() + undecided_count_,
                           [&](const Triangle& triangle) {
                               return is_beyond_separating(triangle) || is_beyond_edges(triangle) ||
                                      is_beside(triangle);
                           });
    }

private:
    /// Points p with normal . (centre at the start - p) >= depth are beyond the plane.
    struct Plane {
        Eigen::Vector3d normal;
        double depth;
    };

    /// Points are beyond a turning plane if they are beyond both planes.
    struct TurningPlane {
        Plane start, end;
    };

    void add_fixed(const Eigen::Vector3d& n) {
        if (n[2] > 0.0) fixed_[fixed_count_++] = {n, sweep_.depth(n)};
    }

    /// Adds the lower faces of a box, as fixed planes and as planes that turn with it.
    void add_faces() {
        const LocalShape &start = sweep_.start(), &end = sweep_.end();
        for (std::size_t i = 0; i < 3; ++i) {
            const Eigen::Vector3d n = start.up(i);
            add_fixed(n);
            const Eigen::Vector3d& axis = end.axes[i];
            const TurningNormal turn{n, dot(n, axis) < 0.0 ? Eigen::Vector3d(-axis) : axis};
            const double drop = start.half[static_cast<Eigen::Index>(i)];
            add_turning(turn, drop, drop);
        }
    }

    /// Adds a plane that turns with the shape, given by its distances below the shape's centre at both ends.
    void add_turning(const TurningNormal& turn, double drop_at_start, double drop_at_end) {
        if (turn.at_end[2] < 0.0) return;
        const double clearance = sweep_.clearance(turn);
        const double further = dot(turn.at_end, sweep_.end().centre - sweep_.start().centre);
        turning_[turning_count_++] = {{turn.at_start, drop_at_start + clearance},
                                      {turn.at_end, drop_at_end + clearance - further}};
    }

    /// Adds the lowest face of a hull and the planes of fixed slopes as fixed planes, and the lowest faces as planes
    /// that turn with the hull.
    void add_hull_faces() {
        const LocalHull &start = *sweep_.start().hull, &end = *sweep_.end().hull;
        for (std::size_t i = 0; i < start.face_count && i < turning_.size(); ++i) {
            const LocalHull::Plane& face = start.planes[i];
            const Eigen::Vector3d at_end = rotated(end.rotation, start.to_body(face.normal));
            add_turning({face.normal, at_end}, face.drop, end.drop(at_end));
        }
        if (start.face_count > 0) add_fixed(start.planes[0].normal);
        for (std::size_t i = start.face_count; i < start.plane_count; ++i) {
            add_fixed(start.planes[i].normal);
        }
    }

    /// Adds fixed planes around a round shape.
    void add_around() {
        const Eigen::Vector3d& core = sweep_.start().core;
        const double size = length(core);
        const double level = std::sqrt(core[0] * core[0] + core[1] * core[1]);
        Eigen::Vector3d along = Eigen::Vector3d::UnitX(), up = Eigen::Vector3d::UnitZ();
        if (level > 0.1 * size) {
            along = {core[0] / level, core[1] / level, 0.0};
            up = (level / size) * Eigen::Vector3d::UnitZ() - (core[2] / size) * along;
        }
        const Eigen::Vector3d side(-along[1], along[0], 0.0);
        add_fixed(up);
        for (const double sign : {-1.0, 1.0}) {
            add_fixed(0.8 * up + 0.6 * sign * side);
            add_fixed(0.28 * up + 0.96 * sign * side);
            add_fixed(0.6 * Eigen::Vector3d::UnitZ() + 0.8 * sign * along);
        }
    }

    /// Computes the outcodes of vertices: a bit for each plane that a vertex is beyond.
    void mark() {
        const Eigen::Vector3d& centre = sweep_.start().centre;
        for (int row = cells_.south; row <= cells_.north + 1; ++row) {
            for (int column = cells_.west; column <= cells_.east + 1; ++column) {
                const Eigen::Vector3d to = centre - local_.vertex(window_, column, row);
                const auto is_beyond = [&to](const Plane& plane) {
                    return dot(plane.normal, to) >= plane.depth;
                };
                unsigned code = 0;
                for (std::size_t i = 0; i < fixed_count_; ++i) {
                    code = code << 1 | (is_beyond(fixed_[i]) ? 1u : 0u);
                }
                for (std::size_t i = 0; i < turning_count_; ++i) {
                    const TurningPlane& plane = turning_[i];
                    code = code << 1 | (is_beyond(plane.start) && is_beyond(plane.end) ? 1u : 0u);
                }
                codes_.at(column, row) = static_cast<std::uint8_t>(code);
            }
        }
    }

    /// Tests a triangle's own plane. False if too many triangles are undecided.
    bool test_own_plane(int column, int row, bool is_south) {
        const Triangle triangle = local_.triangle(window_, column, row, is_south);
        const Plane own{triangle.normal, sweep_.depth(triangle.normal)};
        if (is_beyond(triangle, own)) {
            if (separating_count_ < separating_.size()) separating_[separating_count_++] = own;
            return true;
        }
        if (undecided_count_ == undecided_.size()) return false;
        undecided_[undecided_count_++] = triangle;
        return true;
    }

    bool is_beyond(const Triangle& triangle, const Plane& plane) const {
        return std::all_of(triangle.v.begin(), triangle.v.end(), [&](const Eigen::Vector3d& v) {
            return dot(plane.normal, sweep_.start().centre - v) >= plane.depth;
        });
    }
    bool is_beyond_separating(const Triangle& triangle) const {
        return std::any_of(separating_.begin(), separating_.begin() + separating_count_,
                           [&](const Plane& plane) { return is_beyond(triangle, plane); });
    }
    bool is_beyond(const Triangle& triangle, const TurningNormal& turn) const {
        const double gap = gap_along(turn.at_start, sweep_.start(), triangle);
        if (!(gap >= sweep_.clearance())) return false;
        return std::min(gap, gap_along(turn.at_end, sweep_.end(), triangle)) >=
               sweep_.clearance(turn);
    }

    static bool find_hull_direction(const LocalShape& shape, const Triangle& triangle,
                                    Eigen::Vector3d& n_out) {
        const ClosestPair pair = find_closest_in_column(*shape.hull, shape.centre, triangle);
        return make_escape_direction(pair.on_shape - pair.on_triangle, n_out);
    }

    /// Tests turning planes perpendicular to the line between closest points or, for boxes, to pairs of edges.
    bool is_beyond_edges(const Triangle& triangle) const {
        const LocalShape &start = sweep_.start(), &end = sweep_.end();
        TurningNormal turn;
        if (start.kind == ShapeKind::round) {
            return find_core_direction(start, triangle, turn.at_start) &&
                   find_core_direction(end, triangle, turn.at_end) && is_beyond(triangle, turn);
        }
        if (start.kind == ShapeKind::hull) {
            return find_hull_direction(start, triangle, turn.at_start) &&
                   find_hull_direction(end, triangle, turn.at_end) && is_beyond(triangle, turn);
        }
        for (std::size_t j = 0; j < 3; ++j) {
            const Eigen::Vector3d edge = triangle.v[(j + 1) % 3] - triangle.v[j];
            const double least = 1e-6 * dot(edge, edge);
            for (std::size_t i = 0; i < 3; ++i) {
                turn = {cross(start.axes[i], edge), cross(end.axes[i], edge)};
                if (turn.at_start[2] < 0.0) turn = {-turn.at_start, -turn.at_end};
                const double from = dot(turn.at_start, turn.at_start);
                const double to = dot(turn.at_end, turn.at_end);
                if (!(from > least && to > least) || turn.at_end[2] < 0.0) continue;
                turn = {turn.at_start / std::sqrt(from), turn.at_end / std::sqrt(to)};
                if (is_beyond(triangle, turn)) return true;
            }
        }
        return false;
    }

    /// Tests fixed vertical planes.
    bool is_beside(const Triangle& triangle) const {
        bool is_found = false;
        visit_walls(sweep_.start(), triangle, [&](const Eigen::Vector3d& n, double gap) {
            is_found = is_found || (gap >= sweep_.clearance() &&
                                    gap_along(n, sweep_.end(), triangle) >= sweep_.clearance());
        });
        return is_found;
    }

    const LocalGround& local_;
    const LocalWindow& window_;
    WindowCells cells_;
    const ConvexSweep& sweep_;
    std::array<Plane, 7> fixed_;
    std::array<TurningPlane, 3> turning_;
    WindowCodes codes_;
    std::array<Plane, 16> separating_;    // own planes of triangles, where they separate
    std::array<Triangle, 32> undecided_;  // triangles whose own planes do not separate
    std::size_t fixed_count_ = 0, turning_count_ = 0, separating_count_ = 0, undecided_count_ = 0;
};

}  // namespace

ConvexSweep::ConvexSweep(const LocalShape& start, const LocalShape& end, const Motion& motion,
                         double margin)
    : start_(start), end_(end), margin_(margin) {
    const Eigen::Vector3d& turn = motion.rotation_vector;
    const double spin = length(turn);
    double turned = 0.0;
    if (start.kind == ShapeKind::hull) {
        turned = spin > 0.0 ? spin * find_arm(start, turn / spin) : 0.0;
    } else {
        // Rotation about the core does not move the surface of a round shape.
        const double own = start.kind == ShapeKind::box ? spin * length(start.half)
                                                        : length(cross(turn, start.core));
        turned = own + length(cross(turn, start.offset));
    }
    travel_ = length(motion.translation) + turned;
    acceleration_ = spin * turned;
}

bool are_cells_separated(const LocalGround& local, const LocalWindow& window,
                         const CellRange& cells, const ConvexSweep& sweep) {
    return SweptSeparation(local, window, cells, sweep).are_cells_separated();
}

namespace {

/// Motions with at least this rotation are not tested, radians.
constexpr double kMostTurn = 0.5;

bool is_part_clear(const LocalGround& local, const LocalShape& start, const LocalShape& end,
                   const Motion& motion, double margin) {
    const ConvexSweep sweep(start, end, motion, margin);
    const auto reach = [&](const LocalShape& shape) -> Eigen::Vector3d {
        return shape.bounds + Eigen::Vector3d::Constant(sweep.clearance());
    };
    const Eigen::Vector3d low = (start.centre - reach(start)).cwiseMin(end.centre - reach(end));
    const Eigen::Vector3d high = (start.centre + reach(start)).cwiseMax(end.centre + reach(end));
    const Eigen::Vector3d middle = 0.5 * (low + high);
    if (low[2] > bound_ground(local, middle, high - middle)) return true;
    const CellRange cells = local.cells(low[0], low[1], high[0], high[1]);
    const LocalWindow* const window = local.window(cells, 0);
    return window != nullptr && are_cells_separated(local, *window, cells, sweep);
}

}  // namespace

bool is_sweep_clear(const Shape& shape, const Motion& motion, const Ground& ground, double margin) {
    const double spin = length(motion.rotation_vector);
    if (!(spin < kMostTurn) || !is_valid_query(shape, motion)) return false;
    const LocalGround local(ground, motion.start.translation);
    const Eigen::Vector3d from = local.to_local(motion.start.translation);
    const LocalBody start(shape, motion.start.rotation, from);
    const LocalBody end(shape, motion.at(1.0).rotation, from + motion.translation);
    if (!start.is_compound())
        return is_part_clear(local, start.whole(), end.whole(), motion, margin);

    // Distance by which a part may leave its AABB at the start, plus the margin.
    const double reach = margin + length(motion.translation) + spin * bounding_radius(shape);
    bool is_clear = true;
    const auto may_meet = [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& bounds) {
        const Eigen::Vector3d half = bounds + Eigen::Vector3d::Constant(reach);
        return is_clear && !(centre[2] - half[2] > bound_ground(local, centre, half));
    };
    start.visit(may_meet, [&](const LocalShape& part, std::uint32_t index) {
        LocalHull hull;
        is_clear = is_clear && is_part_clear(local, part, end.part(index, hull), motion, margin);
    });
    return is_clear;
}

}  // namespace terrane::internal
