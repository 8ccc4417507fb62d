// SPDX-License-Identifier: MIT
// Sources: D. Eberly. Dynamic collision detection using oriented bounding boxes. 1999 (the gap along each
//          separating axis is linear in time, so that the largest time of entry is that of contact).
// Deviations: the axes are those of column.h, without walls under it and without unit length: times are
//             ratios. Seen along the box's own axes an edge's cross has two components.
#include "ground/cast/column_entry.h"

#include "math/vector_math.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// Squares of sines: below, edges are parallel, or a direction is level.
constexpr double kParallel = 1e-24;

/// The time in which a moving point is inside all half-spaces so far.
struct EntryClip {
    double limit;
    double first = 0.0;
    double last = kInfinity;
    double speed = 0.0;  ///< along the normal that decides `first`, times its length
    double square = 1.0;
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();

    /// False where it is known that there is no contact before the limit.
    ///
    /// @param n       of any length, out of the half-space
    /// @param gap     times that length
    /// @param closing times that length
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

/// A box and what it may meet, seen along the box's own axes from its centre.
struct BoxFrame {
    const LocalShape& box;
    Eigen::Vector3d velocity;
    Eigen::Vector3d up;
    std::array<Eigen::Vector3d, 3> corners;  ///< of the triangle
    double ground_offset;

    double offset_along(double square) const { return ground_offset > 0.0 ? ground_offset * std::sqrt(square) : 0.0; }
};

// The faces of the box that look up.
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

// The crosses of an edge of the box with one of the triangle, or with the vertical.
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

bool take_edges(const BoxFrame& f, EntryClip& clip) {
    for (std::size_t j = 0; j < 3; ++j) {
        const Eigen::Vector3d& from = f.corners[j];
        const Eigen::Vector3d edge = f.corners[(j + 1) % 3] - from;
        const double least = kParallel * dot(edge, edge);
        for (int i = 0; i < 3; ++i) {
            const EdgeCross n(i, edge);
            if (!(n.square > least)) continue;
            const double rise = n.along(f.up);
            if (!(rise * rise > kParallel * n.square)) continue;  // that of a wall
            const double sign = rise < 0.0 ? -1.0 : 1.0;
            const double top =
                std::max(sign * n.along(from), sign * n.along(f.corners[(j + 2) % 3]));
            if (!clip.take(n.normal(sign), n.square, f.offset_along(n.square) - n.drop(f.box.half) - top,
                           -sign * n.along(f.velocity))) {
                return false;
            }
        }
    }
    return true;
}

// Level directions, square to the box's edges.
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

// The sides of the column.
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

// Back from contact by an eighth of the tolerance along the normal, by no more than half of it along the way.
double back_from(const EntryClip& clip, double speed, double tolerance) {
    const double size = std::sqrt(clip.square);
    const double back = 0.5 * tolerance * size / std::max(4.0 * clip.speed, speed * size);
    return clip.first > back ? clip.first - back : 0.0;
}

}  // namespace

ColumnEntry find_box_entry(const LocalShape& box, const Eigen::Vector3d& velocity,
                           const Triangle& triangle, double tolerance, double ground_offset, double limit) {
    const auto seen = [&box](const Eigen::Vector3d& p) {
        return Eigen::Vector3d(dot(p, box.axes[0]), dot(p, box.axes[1]), dot(p, box.axes[2]));
    };
    EntryClip clip{limit};
    clip.normal = seen(triangle.normal);
    const Eigen::Vector3d n = clip.normal;
    const double drop =
        std::abs(n[0]) * box.half[0] + std::abs(n[1]) * box.half[1] + std::abs(n[2]) * box.half[2];
    const double gap = dot(triangle.normal, box.centre - triangle.v[0]) - drop + ground_offset;
    const double closing = -dot(triangle.normal, velocity);
    clip.speed = closing;
    if (!clip.take(n, 1.0, gap, closing)) return {};
    if (clip.first > 0.0 && ground_offset == 0.0) {
        // Most boxes meet a face with a corner.
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
                         seen(velocity),
                         {box.axes[0][2], box.axes[1][2], box.axes[2][2]},
                         {seen(triangle.v[0] - box.centre), seen(triangle.v[1] - box.centre),
                          seen(triangle.v[2] - box.centre)},
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
