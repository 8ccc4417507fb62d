// SPDX-License-Identifier: MIT
#include "ground/column/column.h"
#include "ground/eroded_part.h"
#include "ground/heightfield/contact_patches.h"
#include "ground/joined_queries.h"
#include "pairs/manifold.h"

#include <algorithm>

namespace terrane::internal {

/// Contacts of one part with the faces of triangles. Of the points that are not corners or ends of the part, only the
/// deepest are kept: on a floor of many triangles the others are redundant.
class FaceContacts {
public:
    /// @param margin gaps of the whole part up to this are contacts, metres
    FaceContacts(const ErodedPart& part, double margin) : part_(part), margin_(margin) {}

    struct Found {
        /// Largest depth of the whole part, metres; minus infinity if part and triangle do not overlap in projection.
        double depth;
        bool is_flat;  ///< a box face or capsule's side is nearly parallel to the triangle
    };
    /// Adds the contacts of a triangle with the part's support feature against the triangle's normal.
    Found add(const SurfaceTriangle& triangle);
    /// Moves the contacts to the patches.
    void finish(ContactPatches& patches) const {
        for (std::size_t i = 0; i < count_; ++i) patches.add(contacts_[i]);
        for (std::size_t i = 0; i < inner_count_; ++i) patches.add(inner_[i]);
    }

private:
    double add_segment(const SurfaceTriangle& triangle);
    double add_box_face(const SurfaceTriangle& triangle, std::size_t axis, double up);
    double add_support(const SurfaceTriangle& triangle);
    void add_outer(const Contact& contact);
    void add_inner(const Contact& contact);
    bool wants_inner(double depth) const {
        return inner_count_ < kMostInner || depth > inner_[shallowest_].depth;
    }

    static constexpr std::size_t kMostOuter = 64, kMostInner = 12;
    const ErodedPart& part_;
    double margin_;
    // Only the first count_ and inner_count_ elements are initialised.
    union {
        std::array<Contact, kMostOuter> contacts_;  // NOLINT(readability-identifier-naming)
    };
    union {
        std::array<Contact, kMostInner> inner_;  // NOLINT(readability-identifier-naming)
    };
    std::size_t count_ = 0, inner_count_ = 0;
    std::size_t shallowest_ = 0;  // index in inner_, once that is full
};

// Sources:    I. Sutherland, G. Hodgman. Reentrant polygon clipping. 1974.
// Deviations: the triangle is clipped by a face of the box, projected along the normal of the face; depths are measured
//             from the triangle's own plane.

namespace {

/// A triangle is clipped by a box face if the cosine of the angle between their normals is at least this.
constexpr double kFlat = 0.9;

/// A point of a clipped triangle in the plane of a face.
struct FlatPoint {
    double x, y;
};

/// Clips a polygon to the points p with along(p) <= half; `along` is x, -x, y or -y.
template <class Along>
std::size_t clip(const std::array<FlatPoint, 8>& from, std::size_t count, double half, Along along,
                 std::array<FlatPoint, 8>& to) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
        const FlatPoint& a = from[i];
        const FlatPoint& b = from[i + 1 == count ? 0 : i + 1];
        const double da = half - along(a), db = half - along(b);
        if (da >= 0.0) to[kept++] = a;
        if ((da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0)) {
            const double s = da / (da - db);
            to[kept++] = {a.x + s * (b.x - a.x), a.y + s * (b.y - a.y)};
        }
    }
    return kept;
}

}  // namespace

FaceContacts::Found FaceContacts::add(const SurfaceTriangle& triangle) {
    const LocalShape& shape = part_.whole();
    if (shape.kind == ShapeKind::round) {
        const double along = dot(triangle.normal, shape.core);
        const bool is_flat = along * along <= (1.0 - kFlat * kFlat) * dot(shape.core, shape.core);
        return {add_segment(triangle), is_flat};
    }
    if (shape.kind == ShapeKind::box) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double up = dot(triangle.normal, shape.axes[axis]);
            if (std::abs(up) >= kFlat) return {add_box_face(triangle, axis, up), true};
        }
    }
    return {add_support(triangle), false};
}

/// Adds the contacts of the part of a capsule's core that is over a triangle.
double FaceContacts::add_segment(const SurfaceTriangle& triangle) {
    const LocalShape& shape = part_.whole();
    const Eigen::Vector3d& n = triangle.normal;
    const Eigen::Vector3d from = shape.centre - shape.core, along = 2.0 * shape.core;
    double begin = 0.0, end = 1.0;
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d inwards = cross(n, triangle.v[(i + 1) % 3] - triangle.v[i]);
        const double at = dot(inwards, from - triangle.v[i]), slope = dot(inwards, along);
        if (slope > 0.0) {
            begin = std::max(begin, -at / slope);
        } else if (slope < 0.0) {
            end = std::min(end, -at / slope);
        } else if (at < 0.0) {
            return -kInfinity;
        }
    }
    if (!(begin <= end)) return -kInfinity;
    double deepest = -kInfinity;
    for (const double s : {begin, end}) {
        const Eigen::Vector3d core = from + s * along;
        const double depth = shape.radius - dot(n, core - triangle.v[0]);
        deepest = std::max(deepest, depth);
        if (depth < -margin_) continue;
        const Contact contact = make_contact(core - shape.radius * n, n, depth,
                                             shape.core_feature(core), part_.index());
        s == 0.0 || s == 1.0 ? add_outer(contact) : add_inner(contact);
    }
    return deepest;
}

/// Adds the contacts of a box face whose axis is nearly parallel to the triangle's normal.
double FaceContacts::add_box_face(const SurfaceTriangle& triangle, std::size_t axis, double up) {
    const LocalShape& box = part_.whole();
    const std::size_t ix = (axis + 1) % 3, iy = (axis + 2) % 3;
    const Eigen::Vector3d &x = box.axes[ix], &y = box.axes[iy];
    const auto half = [&](std::size_t i) { return box.half[static_cast<Eigen::Index>(i)]; };
    const double hx = half(ix), hy = half(iy);
    const Eigen::Vector3d& n = triangle.normal;
    // The face towards the triangle: the depth of its points below the triangle's plane is linear in x and y.
    const double side = up > 0.0 ? -1.0 : 1.0;
    const Eigen::Vector3d middle = box.centre + side * half(axis) * box.axes[axis];
    const double depth0 = dot(n, triangle.v[0] - middle);
    const double slope_x = -dot(n, x), slope_y = -dot(n, y);
    const auto depth_at = [&](const FlatPoint& p) {
        return depth0 + slope_x * p.x + slope_y * p.y;
    };
    std::array<FlatPoint, 3> corners;
    std::array<std::array<FlatPoint, 8>, 2> polygons;
    FlatPoint low{kInfinity, kInfinity}, high{-kInfinity, -kInfinity};
    for (std::size_t i = 0; i < 3; ++i) {
        const Eigen::Vector3d to = triangle.v[i] - middle;
        const FlatPoint p{dot(to, x), dot(to, y)};
        corners[i] = polygons[0][i] = p;
        low = {std::min(low.x, p.x), std::min(low.y, p.y)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
    std::size_t count = 3, last = 0;
    const auto clip_side = [&](double limit, auto along) {
        count = clip(polygons[last], count, limit, along, polygons[1 - last]);
        last = 1 - last;
    };
    if (high.x > hx) clip_side(hx, [](const FlatPoint& p) { return p.x; });
    if (low.x < -hx) clip_side(hx, [](const FlatPoint& p) { return -p.x; });
    if (high.y > hy) clip_side(hy, [](const FlatPoint& p) { return p.y; });
    if (low.y < -hy) clip_side(hy, [](const FlatPoint& p) { return -p.y; });
    const std::array<FlatPoint, 8>& a = polygons[last];
    double deepest = -kInfinity;
    FlatPoint best{};
    for (std::size_t i = 0; i < count; ++i) {
        const double depth = depth_at(a[i]);
        if (depth > deepest) {
            deepest = depth;
            best = a[i];
        }
    }
    if (deepest < -margin_) return deepest;
    const auto place = [&](const FlatPoint& p, const ShapeFeature& feature) {
        return make_contact(middle + p.x * x + p.y * y, n, depth_at(p), feature, part_.index());
    };
    // Corners of the box over the triangle.
    const auto turn = [&](std::size_t i, const FlatPoint& p) {
        const FlatPoint &from = corners[i], &to = corners[i == 2 ? 0 : i + 1];
        return (to.x - from.x) * (p.y - from.y) - (to.y - from.y) * (p.x - from.x);
    };
    for (int k = 0; k < 4; ++k) {
        const FlatPoint p{(k & 1) != 0 ? hx : -hx, (k & 2) != 0 ? hy : -hy};
        if (p.x < low.x || p.x > high.x || p.y < low.y || p.y > high.y) continue;
        const double depth = depth_at(p);
        if (depth < -margin_) continue;
        const double t0 = turn(0, p), t1 = turn(1, p), t2 = turn(2, p);
        if (!((t0 >= 0.0 && t1 >= 0.0 && t2 >= 0.0) || (t0 <= 0.0 && t1 <= 0.0 && t2 <= 0.0))) {
            continue;
        }
        std::uint32_t corner = side > 0.0 ? 1u << axis : 0u;
        if ((k & 1) != 0) corner |= 1u << ix;
        if ((k & 2) != 0) corner |= 1u << iy;
        add_outer(place(p, {corner, corner}));
    }
    add_inner(place(
        best, {static_cast<std::uint32_t>(2 * axis + (side > 0.0 ? 1 : 0)), ShapeFeature::kFace}));
    return deepest;
}

double FaceContacts::add_support(const SurfaceTriangle& triangle) {
    const TriangleCore core(triangle);
    Manifold manifold(triangle.normal, kInfinity);
    intersect_support_features(part_.whole_core(), core.core(), triangle.normal, manifold);
    if (manifold.is_empty()) return -kInfinity;
    std::array<PairContact, 4> found;
    const std::size_t count = manifold.finish(found);
    for (std::size_t i = 0; i < count; ++i) {
        if (found[i].depth < -margin_) break;
        const bool is_corner = found[i].feature_a.first == found[i].feature_a.second;
        const Contact contact = make_contact(found[i].point_world, found[i].normal, found[i].depth,
                                             found[i].feature_a, part_.index());
        is_corner ? add_outer(contact) : add_inner(contact);
    }
    return found[0].depth;
}

void FaceContacts::add_outer(const Contact& contact) {
    if (count_ < kMostOuter) {
        contacts_[count_++] = contact;
    } else {
        add_inner(contact);
    }
}

void FaceContacts::add_inner(const Contact& contact) {
    if (!wants_inner(contact.depth)) return;
    inner_[inner_count_ < kMostInner ? inner_count_++ : shallowest_] = contact;
    if (inner_count_ < kMostInner) return;
    shallowest_ = 0;
    for (std::size_t i = 1; i < kMostInner; ++i) {
        if (inner_[i].depth < inner_[shallowest_].depth) shallowest_ = i;
    }
}

// Sources:    C. Ericson. Real-Time Collision Detection. 2005, section 9.5 (GJK).
//             J. Baerentzen, H. Aanaes. Signed distance computation using the angle weighted pseudonormal. 2005 (side).
// Deviations: features are paired for a shrunk, separated body, so that distances have a direction; the normal cone of
//             an edge or vertex is found from the triangles that touch the point, so that meshes need no adjacency and
//             join across chunks and with the heightfield.

namespace {

/// A direction counts as equal to a face normal if the cosine of the angle between them is at least this.
constexpr double kFace = 1.0 - 1e-9;
/// Depths that differ by less count as equal, metres.
constexpr double kDeepest = 1e-9;
/// Sine of the angle by which a neighbour may rise above the plane of a contact.
constexpr double kConeSlack = 1e-6;
/// Distance within which a triangle touches a point, relative to the ground's spacing.
constexpr double kTouchesPoint = 1e-7;

/// The triangle that a body is nearest to.
struct NearestTriangle {
    double distance = kInfinity;
    bool is_face = false;   ///< nearest at an interior point: then `is_front` is reliable
    bool is_front = false;  ///< on the outer side of the triangle
};

/// Tests whether a triangle excludes a direction n from the normal cone at a point: whether it touches the point and
/// rises above the plane of normal n through it.
struct ConeTest {
    ConeTest(const Eigen::Vector3d& point_in, const Eigen::Vector3d& n_in, double spacing)
        : point(point_in), n(n_in), near(kTouchesPoint * spacing) {}

    bool refuses(const SurfaceTriangle& triangle) const {
        bool rises = false;
        for (const Eigen::Vector3d& v : triangle.v) {
            const Eigen::Vector3d to = v - point;
            const double height = dot(n, to);
            rises = rises || (height > near && height > kConeSlack * length(to) + near);
        }
        if (!rises) return false;
        const Eigen::Vector3d apart = closest_on_triangle(point, triangle) - point;
        return dot(apart, apart) <= near * near;
    }

    Eigen::Vector3d point, n;
    double near;
};

/// Pairs one part with one triangle at a time.
class MeshPairing {
public:
    MeshPairing(const SurfaceTriangles& surface, const ErodedPart& part, double offset,
                double margin, double exact_below, NearestTriangle& nearest,
                ContactPatches* patches)
        : surface_(surface),
          part_(part),
          offset_(offset),
          margin_(margin),
          exact_below_(exact_below),
          nearest_(nearest),
          patches_(patches),
          faces_(part, margin) {}

    /// Adds the contacts found to the patches.
    void finish() {
        if (patches_ == nullptr) return;
        faces_.finish(*patches_);
        for (std::size_t i = 0; i < candidate_count_; ++i) add_candidate(candidates_[i]);
    }

    void pair(const SurfaceTriangle& triangle) {
        const double enough = std::max(nearest_.distance, patches_ != nullptr ? reach() : 0.0);
        const auto [bound, front] = part_.bound_distance(triangle, enough);
        if (bound >= enough) return;
        if (patches_ == nullptr) {
            if (bound < nearest_.distance) measure(triangle, bound);
            return;
        }
        if (near_count_ < near_.size()) near_[near_count_++] = triangle;
        // The part is above the triangle's plane: if its lowest point is over the triangle, this is the nearest point.
        double deepest = -kInfinity;
        if (front >= 0.0 && !is_point()) {
            const FaceContacts::Found found = faces_.add(triangle);
            deepest = found.depth;
            // If a face lies on the triangle, other features of the two are redundant.
            if (found.is_flat && deepest > -kInfinity) {
                if (bound < nearest_.distance) measure(triangle, bound);
                return;
            }
            if (deepest >= part_.shift(triangle.normal) - front - kDeepest) {
                if (front < nearest_.distance) nearest_ = {front, true, true};
                return;
            }
        }
        const MeshPair pair = part_.closest(triangle, enough);
        visit(triangle, pair);
        if (pair.lower > reach() || !(pair.distance > 0.0)) return;
        const double facing = dot(pair.normal, triangle.normal);
        if (!(facing > 0.0)) return;  // behind the triangle
        if (facing >= kFace) {
            const double depth = part_.shift(triangle.normal) - pair.distance;
            if (deepest < depth - kDeepest) add_pair(pair, triangle.normal);
        } else if (candidate_count_ < candidates_.size()) {
            candidates_[candidate_count_++] = pair;
        } else {
            add_candidate(pair);
        }
    }

private:
    /// Largest distance of the shrunk part at which there may be a contact.
    double reach() const { return margin_ + offset_; }
    bool is_point() const { return part_.is_round() && !part_.whole().has_core(); }

    /// Updates the nearest distance: with `bound` if this exceeds exact_below_, otherwise with the exact distance.
    void measure(const SurfaceTriangle& triangle, double bound) {
        if (bound > exact_below_) {
            nearest_ = {bound, false, false};
            return;
        }
        visit(triangle, part_.closest(triangle, nearest_.distance));
    }
    void visit(const SurfaceTriangle& triangle, const MeshPair& pair) {
        const double distance = pair.lower;
        if (!(distance < nearest_.distance)) return;
        const double facing = dot(pair.normal, triangle.normal);
        nearest_ = {distance, std::abs(facing) >= kFace, facing > 0.0};
    }

    /// Adds a contact at an edge or vertex if its direction is in the normal cone. Most are rejected early by a
    /// triangle near the part.
    void add_candidate(const MeshPair& pair) {
        const ConeTest test(pair.on_triangle, pair.normal, surface_.local().spacing());
        for (std::size_t i = 0; i < near_count_; ++i) {
            if (test.refuses(near_[i])) return;
        }
        if (is_in_surface_cone(surface_, pair.on_triangle, pair.normal)) {
            add_pair(pair, pair.normal);
        }
    }

    /// Adds a contact at the closest points.
    void add_pair(const MeshPair& pair, const Eigen::Vector3d& normal) {
        const double shift = part_.shift(normal);
        if (part_.is_round()) {
            const double gap = pair.distance - shift;
            if (gap > margin_) return;
            const Eigen::Vector3d point = pair.on_part - part_.whole().radius * normal;
            patches_->add(make_contact(point, normal, -gap,
                                       part_.whole().core_feature(pair.on_part), part_.index()));
            return;
        }
        const double gap = dot(normal, pair.on_part - pair.on_triangle) - shift;
        if (gap > margin_) return;
        const DeepestPoint deepest = part_.whole().deepest(normal);
        patches_->add(make_contact(pair.on_part - shift * normal, normal, -gap, deepest.feature,
                                   part_.index()));
    }

    const SurfaceTriangles& surface_;
    const ErodedPart& part_;
    double offset_;
    double margin_;
    double exact_below_;
    NearestTriangle& nearest_;
    ContactPatches* patches_;
    FaceContacts faces_;
    // The first triangles within reach, and the first pairs at their edges and vertices. Only the counted elements
    // are initialised.
    union {
        std::array<SurfaceTriangle, 48> near_;  // NOLINT(readability-identifier-naming)
    };
    union {
        std::array<MeshPair, 48> candidates_;  // NOLINT(readability-identifier-naming)
    };
    std::size_t near_count_ = 0, candidate_count_ = 0;
};

MeshNearness find(const SurfaceTriangles& surface, const LocalBody& body, double offset,
                  double reach, double margin, double exact_below, ContactPatches* patches) {
    MeshNearness result;
    NearestTriangle nearest;
    nearest.distance = reach;
    SurfaceSide side = SurfaceSide::air;
    const auto find_side = [&](const ErodedPart& part) {
        if (side == SurfaceSide::air) side = surface.side_of(part.inside(), part.inner_radius());
    };
    const double around = std::max(reach, margin);
    const auto visit_part = [&](const LocalShape& shape, std::uint32_t index) {
        const ErodedPart part(shape, index, offset);
        MeshPairing pairing(surface, part, offset, margin, exact_below, nearest, patches);
        const bool is_known = surface.visit(
            part.box(around),
            [&](const std::array<Eigen::Vector3d, 3>& corners) {
                return !part.is_beside(corners, around);
            },
            [&](const SurfaceTriangle& triangle) { pairing.pair(triangle); });
        pairing.finish();
        result.is_missing = result.is_missing || !is_known;
        // A part that no triangle crosses lies on one side of the surface. The nearest triangle shows on which, if the
        // nearest point is in the interior of that triangle.
        const bool is_known_side = nearest.is_face && !body.is_compound();
        if (is_known_side && !nearest.is_front) side = SurfaceSide::solid;
        if (!is_known_side && nearest.distance > 0.0 && !result.is_missing) find_side(part);
    };
    body.visit(
        [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& bounds) {
            const Eigen::Vector3d half = bounds + Eigen::Vector3d::Constant(around);
            return !surface.is_empty({centre - half, centre + half});
        },
        visit_part);
    result.distance = nearest.distance;
    if (result.is_missing || !(nearest.distance > 0.0)) return result;
    if (body.is_compound()) {
        LocalHull hull;
        const LocalShape first = body.part(0, hull);
        find_side(ErodedPart(first, 0, offset));
    }
    if (side == SurfaceSide::unknown) result.is_missing = true;
    if (side == SurfaceSide::solid) result.distance = -kInfinity;
    return result;
}

}  // namespace

bool is_in_surface_cone(const SurfaceTriangles& surface, const Eigen::Vector3d& point,
                        const Eigen::Vector3d& n) {
    const ConeTest test(point, n, surface.local().spacing());
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(test.near);
    bool is_in = true;
    surface.visit({point - half, point + half}, [&](const SurfaceTriangle& triangle) {
        is_in = is_in && !test.refuses(triangle);
    });
    return is_in;
}

MeshNearness find_nearness(const SurfaceTriangles& surface, const LocalBody& body, double offset,
                           double reach, double exact_below) {
    return find(surface, body, offset, reach, 0.0, exact_below, nullptr);
}

MeshNearness find_mesh_contacts(const SurfaceTriangles& surface, const LocalBody& body,
                                double offset, double margin, double exact_below,
                                ContactPatches& patches) {
    const MeshNearness result =
        find(surface, body, offset, margin + offset, margin, exact_below, &patches);
    if (!(result.distance > 0.0)) patches.clear();
    return result;
}

MeshOverlap find_overlap_offset(const SurfaceTriangles& surface, const LocalBody& body,
                                double touch, double accuracy) {
    constexpr double kLeft =
        1e-6;  // fraction of the body that always remains, so that it has an interior
    constexpr double kGrowth = 8.0;  // ratio of successive trial offsets
    constexpr double kFirst = 1e-3;  // first trial offset, relative to the body
    MeshOverlap overlap;
    const double most = (1.0 - kLeft) * body.whole().bounds.maxCoeff();
    const auto nearness = [&](double offset) {
        const MeshNearness near = find_nearness(surface, body, offset, 2.0 * touch, 2.0 * touch);
        overlap.is_missing = overlap.is_missing || near.is_missing;
        return near.distance;
    };
    const auto accept = [&](double offset, double distance) {
        overlap.offset = offset;
        overlap.distance = distance;
    };
    const double at_first = nearness(0.0);
    accept(0.0, at_first);
    if (overlap.is_missing || at_first > 0.0) return overlap;
    double deep = 0.0, clear = most;
    if (!body.is_compound() && body.whole().kind == ShapeKind::round && at_first > -kInfinity) {
        const double offset = touch - at_first;
        const double distance = nearness(offset);
        if (distance > 0.0) {
            accept(offset, distance);
            return overlap;
        }
        deep = std::min(offset, most);
    } else {
        clear = std::min(most, std::max(touch, kFirst * most));
    }
    for (;;) {
        const double distance = nearness(clear);
        accept(clear, distance);
        if (distance > 0.0) break;
        if (clear >= most) {
            overlap.is_deep = true;
            return overlap;
        }
        deep = clear;
        clear = std::min(most, kGrowth * clear);
    }
    while (clear - deep > touch && clear > (1.0 + accuracy) * deep) {
        const double middle = 0.5 * (clear + deep);
        const double distance = nearness(middle);
        if (distance > 0.0) {
            clear = middle;
            accept(middle, distance);
        } else {
            deep = middle;
        }
    }
    return overlap;
}

}  // namespace terrane::internal
