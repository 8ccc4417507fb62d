// SPDX-License-Identifier: MIT
#include "ground/cast/ground_advance.h"

#include "base/vector_math.h"
#include "ground/cast/column_entry.h"
#include "ground/contact/nearest.h"
#include "ground/lift/ground_lift.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// bound_time() of a hull. With constant velocities of its points the gap is a support function and concave in time, so
// that it holds up to a time if it holds at that time.
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
    const auto take = [&](const Eigen::Vector3d& p) {
        arm = std::max(arm, length(cross(axis, p)));
    };
    if (shape.kind == ShapeKind::round) {
        take(shape.offset + shape.core);
        take(shape.offset - shape.core);
    } else if (shape.kind == ShapeKind::box) {
        for (const Eigen::Vector3d& corner : shape.corners) take(shape.offset + corner);
    } else {
        const auto vertex_count = static_cast<std::uint32_t>(shape.hull->shape->vertices.size());
        if (vertex_count > kFew) {
            return length(cross(axis, shape.offset)) + length(shape.bounds);
        }
        for (std::uint32_t i = 0; i < vertex_count; ++i) take(shape.offset + shape.hull->vertex(i));
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
    // Each point starts at its own gap with its own speed; its acceleration is at most this.
    const double acceleration = sweep.spin * sweep.spin * arm;
    if (shape.kind == ShapeKind::hull) {
        return bound_hull_time(shape, n, turn, speed, acceleration, gap - rest, time, remaining);
    }
    const double drop = shape.drop(n);
    double each = kInfinity;
    const auto take = [&](const Eigen::Vector3d& p, double radius) {
        const double clearance = gap - rest + drop + dot(n, p) - radius;
        const double rate = dot(turn, p + shape.offset) - speed;  // n . (v + w x arm)
        // clearance + rate t - acceleration t^2 / 2 = 0
        const double root =
            std::sqrt(std::max(0.0, rate * rate + 2.0 * acceleration * std::max(0.0, clearance)));
        const double when = rate < 0.0 ? 2.0 * std::max(0.0, clearance) / (root - rate)
                                       : (rate + root) / acceleration;
        each = std::min(each, when);
    };
    if (shape.kind == ShapeKind::box) {
        for (int i = 0; i < 8; ++i) take(shape.corner(i) - shape.centre, 0.0);
    } else {
        take(shape.core, shape.radius);
        take(-shape.core, shape.radius);
    }
    return std::max(time, each);
}

struct AdvanceVisitor::CellVisitor {
    AdvanceVisitor& each;

    bool wants(const CellPrism& prism) const {
        return each.approach_.time_to(prism) < each.found_.step && each.wants(prism);
    }
    void take(const GroundCell& cell, std::int64_t column, std::int64_t row) {
        each.found_.error_m = std::max(each.found_.error_m, static_cast<double>(cell.error_m));
        for (const Triangle& triangle : each.local_.triangles(cell, column, row)) {
            each.take(triangle, {0.0, Approach::kNever});
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
    const GroundWindow* const window = local_.window(cells, 0);
    if (window != nullptr) {
        const CellRange seen = visit_soonest(local_, *window, cells, approach_, *this);
        if (seen.west <= seen.east) found_.error_m = std::max(found_.error_m, local_.error(seen));
        return;
    }
    CellVisitor visitor{*this};
    visit_cells(local_, cells, visitor);
}

void AdvanceVisitor::take(const Triangle& triangle, const Approach::Interval& over) {
    if (arm_ == 0.0) {
        take_straight(triangle, over);
    } else {
        take_turning(triangle);
    }
}

void AdvanceVisitor::take_straight(const Triangle& triangle, const Approach::Interval& over) {
    if (found_.is_hit) {
        // Most neighbours of a triangle that was hit are further along its normal.
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

void AdvanceVisitor::take_turning(const Triangle& triangle) {
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
        // The gaps along the axes may be small where the distance is not.
        if (shape_.kind == ShapeKind::box && ground_offset == 0.0 && widest > 0.0) {
            const ClosestPair pair = find_closest(shape_, triangle);
            direction = pair.on_shape - pair.on_triangle;
        }
        if (dot(direction, direction) > 0.25 * tolerance * tolerance) {
            test_along(direction);
            // On a cliff the rounding of the direction matters: make it perpendicular to the edge.
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
