// SPDX-License-Identifier: MIT
//
// Sources: G. van den Bergen. Ray casting against general convex objects with application to continuous collision
//          detection. 2004 (the motion is clipped by planes between closest points).
// Deviations: the first plane is the triangle's, which excludes most columns.
#include "ground/heightfield/ground_advance.h"

#include "base/vector_math.h"
#include "ground/column/ground_lift.h"
#include "ground/heightfield/contact_patches.h"

#include <algorithm>

namespace terrane::internal {
namespace {

constexpr double kNear = 16.0;  // tolerances; at smaller gaps, directions are refined

// Finds the direction between the closest points of a shape and a column; false if all candidate axes must be tested.
bool find_widest(const LocalShape& shape, const Eigen::Vector3d& centre, const Triangle& triangle,
                 double ground_offset, Eigen::Vector3d& n_out) {
    if (shape.kind == ShapeKind::round) {
        return find_direction(find_closest_core(centre, shape.core, triangle), n_out);
    }
    return ground_offset == 0.0 &&
           find_direction(find_closest_in_column(*shape.hull, centre, triangle), n_out);
}

ColumnEntry find_curved_entry(const LocalShape& shape, const Eigen::Vector3d& velocity,
                              const Triangle& triangle, double tolerance, double ground_offset,
                              double from, double limit) {
    constexpr int kSteps =
        200;  // reached only if the shape grazes the ground within the tolerance: a hit
    double time = 0.0;
    // The largest gap at `time`, and how much longer the best plane separates.
    double widest = -kInfinity;
    double wait = -kInfinity;
    Eigen::Vector3d normal = triangle.normal;
    const auto test_plane = [&](const Eigen::Vector3d& n, double gap_at_start) {
        const double closing = -dot(n, velocity);
        const double gap = gap_at_start - time * closing;
        if (gap > widest) {
            widest = gap;
            normal = n;
        }
        if (gap < 0.0) return;
        const double rest = std::min(0.125 * tolerance, 0.5 * gap);
        wait = std::max(wait, closing > 0.0 ? (gap - rest) / closing : kInfinity);
    };
    const auto test_top = [&](const Eigen::Vector3d& n, double gap) {
        test_plane(n, gap + ground_offset);
    };
    test_top(triangle.normal, gap_along(triangle.normal, shape, triangle));
    if (!(wait < limit)) return {};
    if (widest > 0.25 * tolerance) {
        time = wait;
        if (shape.kind == ShapeKind::round && ground_offset < shape.radius) {
            // Common case: an end of the core meets the face.
            const double side = dot(triangle.normal, shape.core) > 0.0 ? -1.0 : 1.0;
            const Eigen::Vector3d end = shape.centre + time * velocity + side * shape.core;
            if (is_foot_inside(end, triangle)) return {time, triangle.normal};
        }
    }
    time = std::max(time, from);
    for (int i = 0; i < kSteps && time < limit; ++i) {
        widest = wait = -kInfinity;
        const Eigen::Vector3d centre = shape.centre + time * velocity;
        Eigen::Vector3d n;
        if (find_widest(shape, centre, triangle, ground_offset, n)) {
            test_top(n, gap_along(n, shape, triangle));
            if (shape.kind == ShapeKind::hull && widest <= kNear * tolerance) {
                // At a cliff the direction's rounding error matters: tests also directions perpendicular to each edge.
                visit_perpendicular_to_edges(triangle, n, [&](const Eigen::Vector3d& m) {
                    test_top(m, gap_along(m, shape, triangle));
                });
            }
        } else {
            LocalShape moved = shape;
            moved.centre = centre;
            const auto test_moved = [&](const Eigen::Vector3d& m, double gap) {
                test_plane(m, gap - time * dot(m, velocity));
            };
            visit_tops(moved, triangle, [&](const Eigen::Vector3d& m, double gap) {
                test_moved(m, gap + ground_offset);
            });
            visit_walls(moved, triangle, [&](const Eigen::Vector3d& m, double gap) {
                if (is_touching_wall(gap) && dot(m, velocity) <= 0.0) return;
                test_moved(m, gap);
            });
        }
        if (!(time + wait < limit)) return {};
        if (widest <= 0.25 * tolerance) return {time, normal};
        time += wait;
    }
    if (!(time < limit)) return {};
    return {time, normal};
}

}  // namespace

ColumnEntry find_entry(const LocalShape& shape, const Eigen::Vector3d& velocity,
                       const Triangle& triangle, double tolerance, double ground_offset,
                       double from, double limit) {
    if (shape.kind == ShapeKind::box) {
        return find_box_entry(shape, velocity, triangle, tolerance, ground_offset, limit);
    }
    return find_curved_entry(shape, velocity, triangle, tolerance, ground_offset, from, limit);
}

// Sources: D. Eberly. Dynamic collision detection using oriented bounding boxes. 1999 (the gap along each separating
//          axis is linear in time, so that the latest entry is the contact).
// Deviations: the axes come from column.h and are not normalised, since times are ratios. In the box's own frame the
//             cross product with an edge of the box has only two components.

namespace {

// Squared sine below which edges count as parallel, or a direction as horizontal.
constexpr double kParallel = 1e-24;

/// The interval of times in which the gaps along all axes so far are negative.
struct EntryClip {
    double limit;
    double first = 0.0;
    double last = kInfinity;
    double speed =
        0.0;  ///< closing speed along the normal that decides `first`, times the normal's length
    double square = 1.0;  ///< of the normal's length
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();

    /// Adds an axis. False if there is no contact before the limit.
    ///
    /// @param n       of any length, out of the column
    /// @param gap     at time 0, times the length of n
    /// @param closing speed, times the length of n
    bool narrow(const Eigen::Vector3d& n, double n_square, double gap, double closing) {
        if (gap > 0.0) {
            if (!(closing > 0.0)) return false;
            const double time = gap / closing;
            if (time > first) {
                first = time;
                speed = closing;
                square = n_square;
                normal = n;
            }
        } else if (closing < 0.0) {
            last = std::min(last, gap / closing);
        }
        return first < limit && first <= last;
    }
};

/// A triangle and a velocity in the frame of a box: along its axes, from its centre.
struct BoxFrame {
    const LocalShape& box;
    Eigen::Vector3d velocity;
    Eigen::Vector3d up;
    std::array<Eigen::Vector3d, 3> corners;  ///< of the triangle
    double ground_offset;

    double offset_along(double square) const {
        return ground_offset > 0.0 ? ground_offset * std::sqrt(square) : 0.0;
    }
};

// Tests the face normals of the box with z > 0.
bool clip_faces(const BoxFrame& f, EntryClip& clip) {
    for (int i = 0; i < 3; ++i) {
        if (!(f.up[i] * f.up[i] > kParallel)) continue;
        const double sign = f.up[i] < 0.0 ? -1.0 : 1.0;
        const double top =
            std::max({sign * f.corners[0][i], sign * f.corners[1][i], sign * f.corners[2][i]});
        if (!clip.narrow(sign * Eigen::Vector3d::Unit(i), 1.0,
                         f.ground_offset - f.box.half[i] - top, -sign * f.velocity[i])) {
            return false;
        }
    }
    return true;
}

// The cross product of an axis of the box with an edge of the triangle, or with the vertical.
struct EdgeCross {
    EdgeCross(int axis, const Eigen::Vector3d& edge)
        : a((axis + 1) % 3), b((axis + 2) % 3), x(-edge[b]), y(edge[a]), square(x * x + y * y) {}
    double along(const Eigen::Vector3d& p) const { return x * p[a] + y * p[b]; }
    double drop(const Eigen::Vector3d& half) const {
        return std::abs(x) * half[a] + std::abs(y) * half[b];
    }
    Eigen::Vector3d normal(double sign) const {
        Eigen::Vector3d n = Eigen::Vector3d::Zero();
        n[a] = sign * x;
        n[b] = sign * y;
        return n;
    }
    int a;
    int b;
    double x;  ///< of the direction, along axis a
    double y;  ///< along axis b
    double square;
};

// Tests the cross products of edges of the box and the triangle.
bool clip_edges(const BoxFrame& f, EntryClip& clip) {
    for (std::size_t j = 0; j < 3; ++j) {
        const Eigen::Vector3d& from = f.corners[j];
        const Eigen::Vector3d edge = f.corners[(j + 1) % 3] - from;
        const double least = kParallel * dot(edge, edge);
        for (int i = 0; i < 3; ++i) {
            const EdgeCross n(i, edge);
            if (!(n.square > least)) continue;
            const double rise = n.along(f.up);
            if (!(rise * rise > kParallel * n.square))
                continue;  // horizontal: an axis of clip_sides()
            const double sign = rise < 0.0 ? -1.0 : 1.0;
            const double top =
                std::max(sign * n.along(from), sign * n.along(f.corners[(j + 2) % 3]));
            if (!clip.narrow(n.normal(sign), n.square,
                             f.offset_along(n.square) - n.drop(f.box.half) - top,
                             -sign * n.along(f.velocity))) {
                return false;
            }
        }
    }
    return true;
}

// Tests the horizontal directions perpendicular to the box's edges.
bool clip_sides(const BoxFrame& f, EntryClip& clip) {
    for (int i = 0; i < 3; ++i) {
        const EdgeCross n(i, f.up);
        if (!(n.square > kParallel)) continue;
        const double drop = n.drop(f.box.half);
        const double speed = n.along(f.velocity);
        const double p0 = n.along(f.corners[0]);
        const double p1 = n.along(f.corners[1]);
        const double p2 = n.along(f.corners[2]);
        if (!clip.narrow(n.normal(1.0), n.square, -drop - std::max({p0, p1, p2}), -speed) ||
            !clip.narrow(n.normal(-1.0), n.square, -drop + std::min({p0, p1, p2}), speed)) {
            return false;
        }
    }
    return true;
}

// Tests the normals of the column's walls.
bool clip_walls(const BoxFrame& f, const Eigen::Vector3d& velocity, const Triangle& triangle,
                EntryClip& clip) {
    const LocalShape& box = f.box;
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d edge = triangle.v[(i + 1) % 3] - triangle.v[i];
        const Eigen::Vector3d n(edge[1], -edge[0], 0.0);
        const Eigen::Vector3d along(dot(n, box.axes[0]), dot(n, box.axes[1]), dot(n, box.axes[2]));
        const double drop = std::abs(along[0]) * box.half[0] + std::abs(along[1]) * box.half[1] +
                            std::abs(along[2]) * box.half[2];
        if (!clip.narrow(along, dot(n, n), dot(n, box.centre - triangle.v[i]) - drop,
                         -dot(n, velocity))) {
            return false;
        }
    }
    return true;
}

// Moves the time of contact back, so that a gap remains: an eighth of the tolerance along the normal, or less if the
// path back would be longer than half the tolerance. At least 0.
double back_from(const EntryClip& clip, double speed, double tolerance) {
    const double size = std::sqrt(clip.square);
    const double back = 0.5 * tolerance * size / std::max(4.0 * clip.speed, speed * size);
    return clip.first > back ? clip.first - back : 0.0;
}

}  // namespace

ColumnEntry find_box_entry(const LocalShape& box, const Eigen::Vector3d& velocity,
                           const Triangle& triangle, double tolerance, double ground_offset,
                           double limit) {
    const auto to_box = [&box](const Eigen::Vector3d& p) {
        return Eigen::Vector3d(dot(p, box.axes[0]), dot(p, box.axes[1]), dot(p, box.axes[2]));
    };
    EntryClip clip{limit};
    clip.normal = to_box(triangle.normal);
    const Eigen::Vector3d n = clip.normal;
    const double drop =
        std::abs(n[0]) * box.half[0] + std::abs(n[1]) * box.half[1] + std::abs(n[2]) * box.half[2];
    const double gap = dot(triangle.normal, box.centre - triangle.v[0]) - drop + ground_offset;
    const double closing = -dot(triangle.normal, velocity);
    clip.speed = closing;
    if (!clip.narrow(n, 1.0, gap, closing)) return {};
    if (clip.first > 0.0 && ground_offset == 0.0) {
        // Common case: a corner of the box meets the face.
        Eigen::Vector3d low = box.centre + clip.first * velocity;
        for (std::size_t i = 0; i < 3; ++i) {
            const auto axis = static_cast<Eigen::Index>(i);
            low -= (n[axis] > 0.0 ? box.half[axis] : -box.half[axis]) * box.axes[i];
        }
        if (is_foot_inside(low, triangle)) {
            return {back_from(clip, length(velocity), tolerance), triangle.normal};
        }
    }
    const BoxFrame frame{box,
                         to_box(velocity),
                         {box.axes[0][2], box.axes[1][2], box.axes[2][2]},
                         {to_box(triangle.v[0] - box.centre), to_box(triangle.v[1] - box.centre),
                          to_box(triangle.v[2] - box.centre)},
                         ground_offset};
    if (!clip_faces(frame, clip) || !clip_walls(frame, velocity, triangle, clip) ||
        !clip_edges(frame, clip) || !clip_sides(frame, clip)) {
        return {};
    }
    const double size = std::sqrt(clip.square);
    const Eigen::Vector3d normal = (clip.normal[0] / size) * box.axes[0] +
                                   (clip.normal[1] / size) * box.axes[1] +
                                   (clip.normal[2] / size) * box.axes[2];
    return {back_from(clip, length(velocity), tolerance), normal};
}

namespace {

// bound_time() for a hull. If its points kept their velocities, the gap would be a minimum of linear functions of time,
// hence concave: if it is large enough at some time, it is large enough at all earlier times.
double bound_hull_time(const LocalShape& shape, const Eigen::Vector3d& n,
                       const Eigen::Vector3d& turn, double speed, double acceleration,
                       double clearance, double shortest, double remaining) {
    const double lowest = shape.hull->drop(n) - dot(n, shape.offset);
    const auto holds = [&](double t) {
        const Eigen::Vector3d m = n + t * turn;
        const double drop = shape.hull->drop(m) - dot(m, shape.offset);
        return clearance - t * speed + lowest - drop - 0.5 * acceleration * t * t >= 0.0;
    };
    double time = shortest;
    double next =
        std::max({2.0 * time, std::sqrt(0.5 * clearance / acceleration), 1e-4 * remaining});
    while (next < remaining && holds(next)) {
        time = next;
        next *= 2.0;
    }
    if (next >= remaining) {
        if (holds(remaining)) return kInfinity;
        next = remaining;
    }
    for (int i = 0; i < 3; ++i) {
        const double middle = 0.5 * (time + next);
        (holds(middle) ? time : next) = middle;
    }
    return time;
}

}  // namespace

double find_arm(const LocalShape& shape, const Eigen::Vector3d& axis) {
    constexpr std::size_t kFew = 64;
    double arm = 0.0;
    const auto include = [&](const Eigen::Vector3d& p) {
        arm = std::max(arm, length(cross(axis, p)));
    };
    if (shape.kind == ShapeKind::round) {
        include(shape.offset + shape.core);
        include(shape.offset - shape.core);
    } else if (shape.kind == ShapeKind::box) {
        for (const Eigen::Vector3d& corner : shape.corners) include(shape.offset + corner);
    } else {
        const auto vertex_count = static_cast<std::uint32_t>(shape.hull->shape->vertices.size());
        if (vertex_count > kFew) {
            return length(cross(axis, shape.offset)) + length(shape.bounds);
        }
        for (std::uint32_t i = 0; i < vertex_count; ++i)
            include(shape.offset + shape.hull->vertex(i));
    }
    return arm;
}

Sweep::Sweep(const Shape& shape_in, const Motion& motion_in)
    : shape(shape_in), motion(motion_in), spin(length(motion_in.rotation_vector)) {
    if (spin == 0.0) return;
    axis = motion.rotation_vector / spin;
    const LocalBody start(shape, motion.start.rotation, Eigen::Vector3d::Zero());
    arm = start.is_compound() ? bounding_radius(shape) : find_arm(start.whole(), axis);
}

double bound_time(const Sweep& sweep, const LocalShape& shape, double arm, const Eigen::Vector3d& n,
                  double gap, double rest, double remaining) {
    const double speed = -dot(n, sweep.motion.translation);
    const Eigen::Vector3d turn = cross(n, sweep.motion.rotation_vector);
    const double closing = speed + length(turn) * arm;
    double time = closing > 0.0 ? (gap - rest) / closing : kInfinity;
    if (time >= remaining || arm == 0.0) return time;
    // Upper bound of the acceleration of any point. It is combined below with the gap and speed of each point.
    const double acceleration = sweep.spin * sweep.spin * arm;
    if (shape.kind == ShapeKind::hull) {
        return bound_hull_time(shape, n, turn, speed, acceleration, gap - rest, time, remaining);
    }
    const double drop = shape.drop(n);
    double each = kInfinity;
    const auto include = [&](const Eigen::Vector3d& p, double radius) {
        const double clearance = gap - rest + drop + dot(n, p) - radius;
        const double rate = dot(turn, p + shape.offset) - speed;  // speed of the point along n
        // clearance + rate t - acceleration t^2 / 2 = 0
        const double root =
            std::sqrt(std::max(0.0, rate * rate + 2.0 * acceleration * std::max(0.0, clearance)));
        const double when = rate < 0.0 ? 2.0 * std::max(0.0, clearance) / (root - rate)
                                       : (rate + root) / acceleration;
        each = std::min(each, when);
    };
    if (shape.kind == ShapeKind::box) {
        for (int i = 0; i < 8; ++i) include(shape.corner(i) - shape.centre, 0.0);
    } else {
        include(shape.core, shape.radius);
        include(-shape.core, shape.radius);
    }
    return std::max(time, each);
}

struct AdvanceVisitor::CellVisitor {
    AdvanceVisitor& each;

    bool wants(const CellPrism& prism) const {
        return each.approach_.time_to(prism) < each.found_.step && each.wants(prism);
    }
    void visit(const GroundCell& cell, std::int64_t column, std::int64_t row) {
        each.found_.error_m = std::max(each.found_.error_m, static_cast<double>(cell.error_m));
        for (const Triangle& triangle : each.local_.triangles(cell, column, row)) {
            each.visit(triangle, {0.0, Approach::kNever});
        }
    }
    bool miss(const CellPrism& prism) {
        Advance& found = each.found_;
        const double when = each.approach_.time_to(prism);
        if (when < found.step) {
            found.step = when;
            found.is_missing = true;
            found.is_hit = false;
        }
        return true;
    }
};

void AdvanceVisitor::visit(const CellRange& cells) {
    const LocalWindow* const window = local_.window(cells, 0);
    if (window != nullptr) {
        const CellRange seen = visit_soonest(local_, *window, cells, approach_, *this);
        if (seen.west <= seen.east) found_.error_m = std::max(found_.error_m, local_.error(seen));
        return;
    }
    CellVisitor visitor{*this};
    visit_cells(local_, cells, visitor);
}

void AdvanceVisitor::visit(const Triangle& triangle, const Approach::Interval& over) {
    if (arm_ == 0.0) {
        visit_straight(triangle, over);
    } else {
        visit_turning(triangle);
    }
}

void AdvanceVisitor::visit_straight(const Triangle& triangle, const Approach::Interval& over) {
    if (found_.is_hit) {
        // The normal of the hit so far excludes most neighbours of the triangle that was hit.
        const Eigen::Vector3d& n = found_.hit_normal;
        const double ground_offset = n[2] > 0.0 ? approach_.ground_offset() : 0.0;
        const double gap = gap_along(n, shape_, triangle) + ground_offset;
        if (gap > 0.0 && gap >= -dot(n, sweep_.motion.translation) * found_.step) return;
    }
    const ColumnEntry entry =
        find_entry(shape_, sweep_.motion.translation, triangle, approach_.tolerance(),
                   approach_.ground_offset(), over.first, std::min(found_.step, over.last));
    if (entry.time < found_.step) hit(entry.time, entry.normal);
}

void AdvanceVisitor::visit_turning(const Triangle& triangle) {
    const double tolerance = approach_.tolerance();
    const double ground_offset = approach_.ground_offset();
    double when = -kInfinity;
    double widest = -kInfinity;
    Eigen::Vector3d normal = triangle.normal;
    bool is_step_clear = false;
    const auto test_plane = [&](const Eigen::Vector3d& n, double gap) {
        if (gap > widest) {
            widest = gap;
            normal = n;
        }
        if (is_step_clear || gap < 0.0) return;
        const double rest = std::min(0.125 * tolerance, 0.5 * gap);
        const double time = bound_time(sweep_, shape_, arm_, n, gap, rest, found_.step);
        when = std::max(when, time);
        is_step_clear = when >= found_.step;
    };
    const auto test_top = [&](const Eigen::Vector3d& n, double gap) {
        test_plane(n, gap + ground_offset);
    };
    test_top(triangle.normal, gap_along(triangle.normal, shape_, triangle));
    if (is_step_clear) return;
    const auto test_along = [&](const Eigen::Vector3d& direction) {
        Eigen::Vector3d n;
        if (!is_step_clear && make_escape_direction(direction, n))
            test_plane(n, gap_along(n, shape_, triangle));
    };
    // The gap is largest along the direction between the closest points.
    Eigen::Vector3d direction = Eigen::Vector3d::Zero();
    const bool has_direction = shape_.kind == ShapeKind::hull && ground_offset == 0.0;
    if (has_direction) {
        const ClosestPair pair = find_closest_in_column(*shape_.hull, shape_.centre, triangle);
        if (pair.distance > kTouch) {
            direction = pair.on_shape - pair.on_triangle;
            test_along(direction);
        }
    }
    if (is_step_clear) return;
    if (!(has_direction && widest > kTouch)) {
        visit_tops(shape_, triangle, test_top);
        if (is_step_clear) return;
        visit_walls(shape_, triangle, [&](const Eigen::Vector3d& n, double gap) {
            if (is_touching_wall(gap)) {
                const double turning = length(cross(n, sweep_.motion.rotation_vector)) * arm_;
                if (dot(n, sweep_.motion.translation) <= turning) return;
            }
            test_plane(n, gap);
        });
        if (is_step_clear) return;
    }
    if (widest <= 0.25 * tolerance) {
        // The gaps along the axes may be small although the distance is not.
        if (shape_.kind == ShapeKind::box && ground_offset == 0.0 && widest > 0.0) {
            const ClosestPair pair = find_closest(shape_, triangle);
            direction = pair.on_shape - pair.on_triangle;
        }
        if (dot(direction, direction) > 0.25 * tolerance * tolerance) {
            test_along(direction);
            // At a cliff the direction's rounding error matters: tests also directions perpendicular to each edge.
            visit_perpendicular_to_edges(triangle, direction, test_along);
            if (is_step_clear) return;
        }
        if (widest <= 0.25 * tolerance) {
            hit(0.0, normal);
            return;
        }
    }
    found_.step = std::max(0.0, when);
    found_.is_hit = false;
    found_.is_missing = false;
}

void AdvanceVisitor::hit(double step, const Eigen::Vector3d& normal) {
    found_.step = step;
    found_.is_hit = true;
    found_.is_missing = false;
    found_.hit_normal = normal;
    found_.hit_part = part_;
}

}  // namespace terrane::internal
