// SPDX-License-Identifier: MIT
// Sources: G. van den Bergen. Collision detection in interactive 3D environments. 2003, section 4.4
//          (contacts from pairs of features).
// Deviations: features are paired where the shape is *free*, so that every normal is one that really
//             holds there, and depths are counted back from there.
#include "contact_patches.h"

#include "closest_points.h"
#include "normal_cone.h"

#include <algorithm>

namespace terrane::internal {
namespace {

bool is_before(const Contact& a, const Contact& b) {
    if (a.depth != b.depth) return a.depth > b.depth;
    for (int i = 0; i < 3; ++i) {
        if (a.point_world[i] != b.point_world[i]) return a.point_world[i] < b.point_world[i];
    }
    for (int i = 0; i < 3; ++i) {
        if (a.normal[i] != b.normal[i]) return a.normal[i] < b.normal[i];
    }
    return false;
}

double square_distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    const Eigen::Vector3d d = a - b;
    return dot(d, d);
}

// Moves up to four contacts that stand for all of a patch to its front; returns how many.
std::size_t reduce(std::span<Contact> patch) {
    constexpr double kSamePlace = 1e-20;  // square metres
    std::size_t kept = 1;                 // the deepest comes first
    const Eigen::Vector3d n = patch[0].normal;
    while (kept < 4) {
        double best = 0.0;
        std::size_t which = 0;
        for (std::size_t i = kept; i < patch.size(); ++i) {
            const Eigen::Vector3d& p = patch[i].point_world;
            double gain = 0.0;
            if (kept == 1) {
                gain = square_distance(p, patch[0].point_world);
            } else {
                const Eigen::Vector3d& a = patch[0].point_world;
                const Eigen::Vector3d& b = patch[1].point_world;
                const double area = dot(cross(b - a, p - a), n);
                if (kept == 2) {
                    gain = std::abs(area);
                } else {
                    // What the fourth point adds to the triangle of the first three.
                    const Eigen::Vector3d& c = patch[2].point_world;
                    const double side = dot(cross(b - a, c - a), n) < 0.0 ? -1.0 : 1.0;
                    gain = std::max({-side * area, -side * dot(cross(c - b, p - b), n),
                                     -side * dot(cross(a - c, p - c), n)});
                }
            }
            if (gain > best) {
                best = gain;
                which = i;
            }
        }
        if (which == 0 || best < kSamePlace) break;
        std::swap(patch[kept], patch[which]);
        ++kept;
    }
    return kept;
}

struct PatchVisitor {
    const LocalGround& local;
    const LocalShape& shape;  ///< where it is free
    Eigen::Vector3d freeing;
    double reach;  ///< gaps up to this are looked at
    double margin;
    ContactPatches& patches;
    double error_m = 0.0;
    bool is_missing = false;

    bool wants(const Prism& prism) const { return bound_distance(shape, prism) <= reach; }
    bool miss(const Prism& prism) {
        if (!wants(prism)) return true;
        is_missing = true;
        return false;
    }
    void take(const GroundCell& cell, std::int64_t column, std::int64_t row) {
        error_m = std::max(error_m, static_cast<double>(cell.error_m));
        for (const Triangle& triangle : local.triangles(cell, column, row)) {
            if (gap_along(triangle.normal, shape, triangle) > reach) continue;
            if (shape.is_box)
                pair_box(triangle);
            else
                pair_core(triangle);
        }
    }

    void add(const Eigen::Vector3d& on_shape, const Eigen::Vector3d& n, double gap) {
        const double depth = dot(n, freeing) - gap;
        if (gap > reach || depth < -margin) return;
        Contact contact;
        contact.point_world = on_shape - freeing;
        contact.normal = n;
        contact.depth = depth;
        patches.add(contact);
    }

    static bool is_foot_inside(const Eigen::Vector3d& p, const Triangle& triangle) {
        for (std::size_t i = 0; i < 3; ++i) {
            const Eigen::Vector3d& a = triangle.v[i];
            const Eigen::Vector3d edge = triangle.v[(i + 1) % 3] - a;
            // A hair outside counts, so that a point over an edge is over one of the two faces.
            if (dot(cross(edge, p - a), triangle.normal) < -1e-12 * dot(edge, edge)) return false;
        }
        return true;
    }

    void pair_core(const Triangle& triangle) {
        const Eigen::Vector3d& n = triangle.normal;
        const bool has_core = dot(shape.core, shape.core) > 0.0;
        bool has_face = false;
        for (const double sign : {-1.0, 1.0}) {
            if (!has_core && sign > 0.0) break;
            const Eigen::Vector3d end = shape.centre + sign * shape.core;
            const double gap = dot(n, end - triangle.v[0]) - shape.radius;
            if (gap > reach || gap < -kTouch || !is_foot_inside(end, triangle)) continue;
            has_face = true;
            add(end - shape.radius * n, n, gap);
        }
        const ClosestPair pair = find_closest_core(shape.centre, shape.core, triangle);
        if (pair.distance - shape.radius > reach) return;
        Eigen::Vector3d direction;
        if (find_core_direction(shape, triangle, direction)) {
            const double gap = pair.distance - shape.radius;
            const bool is_face = dot(direction, n) > 1.0 - 1e-14;
            if ((is_face && has_face) || !is_in_normal_cone(local, triangle, direction)) return;
            add(pair.on_shape - shape.radius * direction, is_face ? n : direction, gap);
            return;
        }
        if (has_face || pair.distance > 1e-9) return;
        // A core without thickness that touches: any direction of the cone that parts them.
        Separation best;
        visit_tops(shape, triangle, [&](const Eigen::Vector3d& m, double gap) {
            if (gap > best.gap && is_in_normal_cone(local, triangle, m)) best = {m, gap};
        });
        add(pair.on_shape - shape.radius * best.normal, best.normal, best.gap);
    }

    void pair_box(const Triangle& triangle) {
        pair_face(triangle);
        pair_corners(triangle);
        pair_edges(triangle);
    }

    // The corners of the box's face that looks most at the triangle, over the triangle.
    void pair_face(const Triangle& triangle) {
        const Eigen::Vector3d& n = triangle.normal;
        std::size_t face = 0;
        for (std::size_t i = 1; i < 3; ++i) {
            if (std::abs(dot(n, shape.axes[i])) > std::abs(dot(n, shape.axes[face]))) face = i;
        }
        const bool is_down = dot(n, shape.axes[face]) > 0.0;
        for (int k = 0; k < 8; ++k) {
            if (((k >> face & 1) == 0) != is_down) continue;
            const Eigen::Vector3d corner = shape.corner(k);
            const double gap = dot(n, corner - triangle.v[0]);
            // Far below a face is behind a wall, not in it.
            if (gap > reach || gap < -kTouch || !is_foot_inside(corner, triangle)) continue;
            add(corner, n, gap);
        }
    }

    // The triangle's corners under the faces of the box that look down.
    void pair_corners(const Triangle& triangle) {
        for (std::size_t i = 0; i < 3; ++i) {
            const Eigen::Vector3d& axis = shape.axes[i];
            if (axis[2] == 0.0) continue;
            const Eigen::Vector3d n = axis[2] < 0.0 ? Eigen::Vector3d(-axis) : axis;
            for (const Eigen::Vector3d& v : triangle.v) {
                const Eigen::Vector3d to = shape.centre - v;
                const double gap = dot(n, to) - shape.half[static_cast<Eigen::Index>(i)];
                if (gap > reach || gap < -kTouch) continue;
                const std::size_t j = (i + 1) % 3;
                const std::size_t k = (i + 2) % 3;
                if (std::abs(dot(shape.axes[j], to)) > shape.half[static_cast<Eigen::Index>(j)] ||
                    std::abs(dot(shape.axes[k], to)) > shape.half[static_cast<Eigen::Index>(k)]) {
                    continue;
                }
                // Only where the corner is the triangle's highest along n.
                if (dot(n, triangle.v[0] - v) > 1e-12 || dot(n, triangle.v[1] - v) > 1e-12 ||
                    dot(n, triangle.v[2] - v) > 1e-12) {
                    continue;
                }
                if (is_in_normal_cone(local, triangle, n)) add(v + gap * n, n, gap);
            }
        }
    }

    void pair_edges(const Triangle& triangle) {
        for (std::size_t j = 0; j < 3; ++j) {
            const Eigen::Vector3d& a = triangle.v[j];
            const Eigen::Vector3d edge = triangle.v[(j + 1) % 3] - a;
            const double edge_length = length(edge);
            const Eigen::Vector3d direction = edge / edge_length;
            for (std::size_t i = 0; i < 3; ++i) {
                const auto axis_index = static_cast<Eigen::Index>(i);
                const Eigen::Vector3d& axis = shape.axes[i];
                Eigen::Vector3d n = cross(axis, direction);
                const double size = length(n);
                if (size < 1e-6) continue;  // nearly parallel: faces and corners tell the same
                n /= n[2] < 0.0 ? -size : size;
                if (n[2] <= 0.0) continue;
                // The edge must be the triangle's highest part along n.
                if (dot(n, triangle.v[(j + 2) % 3] - a) > 0.0) continue;
                // The edge of the box that is deepest against n.
                Eigen::Vector3d p = shape.centre;
                for (std::size_t m = 0; m < 3; ++m) {
                    if (m == i) continue;
                    const double half = shape.half[static_cast<Eigen::Index>(m)];
                    p += (dot(n, shape.axes[m]) > 0.0 ? -half : half) * shape.axes[m];
                }
                const double gap = dot(n, p - a);
                if (gap > reach || gap < -kTouch) continue;
                // Where the two lines pass each other.
                const Eigen::Vector3d r = p - a;
                const double b = dot(axis, direction);
                const double denominator = 1.0 - b * b;
                const double s = (b * dot(direction, r) - dot(axis, r)) / denominator;
                const double t = dot(direction, r) + s * b;
                if (std::abs(s) > shape.half[axis_index] || t < 0.0 || t > edge_length) continue;
                if (is_in_normal_cone(local, triangle, n)) add(p + s * axis, n, gap);
            }
        }
    }
};

}  // namespace

void ContactPatches::add(const Contact& contact) {
    if (count_ == kMost) {
        merge();
        // Many normals: the deepest half stays.
        count_ = std::min(count_, kMost / 2);
    }
    contacts_[count_++] = contact;
}

void ContactPatches::merge() {
    constexpr double kSameNormal = 1.0 - 1e-6;  // cosine of 1.4 milliradians
    std::sort(contacts_.begin(), contacts_.begin() + static_cast<std::ptrdiff_t>(count_),
              is_before);
    std::size_t kept = 0;
    // Contacts from `kept` on have no patch yet; the first of them is the deepest.
    while (kept < count_) {
        const Eigen::Vector3d n = contacts_[kept].normal;
        std::size_t end = kept + 1;
        for (std::size_t i = end; i < count_; ++i) {
            if (dot(n, contacts_[i].normal) < kSameNormal) continue;
            // Kept in order, because what is left must stay sorted.
            std::rotate(contacts_.begin() + static_cast<std::ptrdiff_t>(end),
                        contacts_.begin() + static_cast<std::ptrdiff_t>(i),
                        contacts_.begin() + static_cast<std::ptrdiff_t>(i + 1));
            ++end;
        }
        const std::size_t patch = reduce(std::span<Contact>(contacts_.data() + kept, end - kept));
        std::move(contacts_.begin() + static_cast<std::ptrdiff_t>(end),
                  contacts_.begin() + static_cast<std::ptrdiff_t>(count_),
                  contacts_.begin() + static_cast<std::ptrdiff_t>(kept + patch));
        count_ -= end - kept - patch;
        kept += patch;
    }
    std::sort(contacts_.begin(), contacts_.begin() + static_cast<std::ptrdiff_t>(count_),
              is_before);
}

std::span<const Contact> ContactPatches::finish() {
    merge();
    return {contacts_.data(), count_};
}

bool find_patches(const LocalGround& local, const LocalShape& shape, const Eigen::Vector3d& freeing,
                  double margin, ContactPatches& patches, double& error_out) {
    LocalShape moved = shape;
    moved.centre += freeing;
    const double reach = margin + length(freeing) + kTouch;
    PatchVisitor visitor{local, moved, freeing, reach, margin + kTouch, patches};
    const Eigen::Vector3d low = moved.centre - moved.bounds;
    const Eigen::Vector3d high = moved.centre + moved.bounds;
    visit_cells(local,
                local.cells(low[0] - reach, low[1] - reach, high[0] + reach, high[1] + reach),
                visitor);
    error_out = std::max(error_out, visitor.error_m);
    return !visitor.is_missing;
}

}  // namespace terrane::internal
