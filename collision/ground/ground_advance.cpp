// SPDX-License-Identifier: MIT
#include "ground_advance.h"

namespace terrane::internal {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The same as bound_time() for a hull: where all points keep their velocities its gap is a support, and
// concave in time, so that a time holds if its end does.
double bound_hull_time(const LocalShape& shape, const Eigen::Vector3d& n,
                       const Eigen::Vector3d& turn, double speed, double bend, double room,
                       double shortest, double remaining) {
    const double lowest = shape.hull->drop(n) - dot(n, shape.offset);
    const auto holds = [&](double t) {
        const Eigen::Vector3d m = n + t * turn;
        const double drop = shape.hull->drop(m) - dot(m, shape.offset);
        return room - t * speed + lowest - drop - 0.5 * bend * t * t >= 0.0;
    };
    double time = shortest;
    double next = std::max({2.0 * time, std::sqrt(0.5 * room / bend), 1e-4 * remaining});
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
    // Each point starts at its own gap, at its own speed, and is bent by at most this.
    const double bend = sweep.spin * sweep.spin * arm;
    if (shape.kind == ShapeKind::hull) {
        return bound_hull_time(shape, n, turn, speed, bend, gap - rest, time, remaining);
    }
    const double drop = shape.drop(n);
    double each = kInfinity;
    const auto take = [&](const Eigen::Vector3d& p, double radius) {
        const double room = gap - rest + drop + dot(n, p) - radius;
        const double rate = dot(turn, p + shape.offset) - speed;  // n . (v + w x arm)
        // room + rate t - bend t^2 / 2 = 0
        const double root =
            std::sqrt(std::max(0.0, rate * rate + 2.0 * bend * std::max(0.0, room)));
        const double when =
            rate < 0.0 ? 2.0 * std::max(0.0, room) / (root - rate) : (rate + root) / bend;
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

}  // namespace terrane::internal
