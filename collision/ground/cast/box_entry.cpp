// SPDX-License-Identifier: MIT
// Sources: D. Eberly. Dynamic collision detection using oriented bounding boxes. 1999 (the gap along each
//          separating axis is linear in time, so that the largest time of entry is that of contact).
// Deviations: the axes are those of column.h, not normalised, since times are ratios. Along the box's own axes the
//             cross product with an edge of the box has two components.
#include "base/vector_math.h"
#include "ground/cast/column_entry.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// Square of a sine below which edges are parallel, or a direction is level.
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

    /// Adds an axis. False where there is no contact before the limit.
    ///
    /// @param n       of any length, out of the column
    /// @param gap     at time 0, times that length
    /// @param closing speed, times that length
    bool take(const Eigen::Vector3d& n, double n_square, double gap, double closing) {
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

// Axes: face normals of the box with z > 0.
bool take_faces(const BoxFrame& f, EntryClip& clip) {
    for (int i = 0; i < 3; ++i) {
        if (!(f.up[i] * f.up[i] > kParallel)) continue;
        const double sign = f.up[i] < 0.0 ? -1.0 : 1.0;
        const double top =
            std::max({sign * f.corners[0][i], sign * f.corners[1][i], sign * f.corners[2][i]});
        if (!clip.take(sign * Eigen::Vector3d::Unit(i), 1.0, f.ground_offset - f.box.half[i] - top,
                       -sign * f.velocity[i])) {
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

// Axes: cross products of edges of the box and the triangle.
bool take_edges(const BoxFrame& f, EntryClip& clip) {
    for (std::size_t j = 0; j < 3; ++j) {
        const Eigen::Vector3d& from = f.corners[j];
        const Eigen::Vector3d edge = f.corners[(j + 1) % 3] - from;
        const double least = kParallel * dot(edge, edge);
        for (int i = 0; i < 3; ++i) {
            const EdgeCross n(i, edge);
            if (!(n.square > least)) continue;
            const double rise = n.along(f.up);
            if (!(rise * rise > kParallel * n.square)) continue;  // level: an axis of take_sides()
            const double sign = rise < 0.0 ? -1.0 : 1.0;
            const double top =
                std::max(sign * n.along(from), sign * n.along(f.corners[(j + 2) % 3]));
            if (!clip.take(n.normal(sign), n.square,
                           f.offset_along(n.square) - n.drop(f.box.half) - top,
                           -sign * n.along(f.velocity))) {
                return false;
            }
        }
    }
    return true;
}

// Axes: level directions perpendicular to the box's edges.
bool take_sides(const BoxFrame& f, EntryClip& clip) {
    for (int i = 0; i < 3; ++i) {
        const EdgeCross n(i, f.up);
        if (!(n.square > kParallel)) continue;
        const double drop = n.drop(f.box.half);
        const double speed = n.along(f.velocity);
        const double p0 = n.along(f.corners[0]);
        const double p1 = n.along(f.corners[1]);
        const double p2 = n.along(f.corners[2]);
        if (!clip.take(n.normal(1.0), n.square, -drop - std::max({p0, p1, p2}), -speed) ||
            !clip.take(n.normal(-1.0), n.square, -drop + std::min({p0, p1, p2}), speed)) {
            return false;
        }
    }
    return true;
}

// Axes: normals of the column's walls.
bool take_walls(const BoxFrame& f, const Eigen::Vector3d& velocity, const Triangle& triangle,
                EntryClip& clip) {
    const LocalShape& box = f.box;
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d edge = triangle.v[(i + 1) % 3] - triangle.v[i];
        const Eigen::Vector3d n(edge[1], -edge[0], 0.0);
        const Eigen::Vector3d along(dot(n, box.axes[0]), dot(n, box.axes[1]), dot(n, box.axes[2]));
        const double drop = std::abs(along[0]) * box.half[0] + std::abs(along[1]) * box.half[1] +
                            std::abs(along[2]) * box.half[2];
        if (!clip.take(along, dot(n, n), dot(n, box.centre - triangle.v[i]) - drop,
                       -dot(n, velocity))) {
            return false;
        }
    }
    return true;
}

// The time at which the gap along the normal is an eighth of the tolerance, but no more than half the tolerance of
// path length before contact.
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
    if (!clip.take(n, 1.0, gap, closing)) return {};
    if (clip.first > 0.0 && ground_offset == 0.0) {
        // The common case: a corner of the box meets the face.
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
    if (!take_faces(frame, clip) || !take_walls(frame, velocity, triangle, clip) ||
        !take_edges(frame, clip) || !take_sides(frame, clip)) {
        return {};
    }
    const double size = std::sqrt(clip.square);
    const Eigen::Vector3d normal = (clip.normal[0] / size) * box.axes[0] +
                                   (clip.normal[1] / size) * box.axes[1] +
                                   (clip.normal[2] / size) * box.axes[2];
    return {back_from(clip, length(velocity), tolerance), normal};
}

}  // namespace terrane::internal
