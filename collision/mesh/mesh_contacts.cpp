// SPDX-License-Identifier: MIT
//
// Sources:    C. Ericson. Real-Time Collision Detection. 2005, section 9.5. J. Baerentzen, H. Aanaes. Signed distance
//             computation using the angle weighted pseudonormal. 2005 (which side of a mesh a point is on).
// Deviations: features are paired where a shrunk body is separated, so that distances have a direction; the normal
//             cone of an edge or a vertex is found from the triangles that touch the point, so that meshes need no
//             adjacency and meet across chunks and beside the heightfield.
#include "mesh/mesh_contacts.h"

#include "ground/column/closest_points.h"
#include "mesh/face_contacts.h"

#include <algorithm>

namespace terrane::internal {
namespace {

/// Least cosine with the face normal of a direction that counts as it.
constexpr double kFace = 1.0 - 1e-9;
/// Depths are the same within this, metres.
constexpr double kDeepest = 1e-9;
/// Sine by which a neighbour may rise above the plane of a contact.
constexpr double kConeSlack = 1e-6;
/// A triangle touches a point within this share of the ground's spacing.
constexpr double kTouchesPoint = 1e-7;

/// The triangle that a body is nearest to.
struct NearestTriangle {
    double distance = kInfinity;
    bool is_face = false;   ///< nearest in its interior: then `is_front` is certain
    bool is_front = false;  ///< on the outer side of the triangle
};

/// Whether a triangle excludes a direction from the normal cone at a point: it touches the point, and rises above the
/// plane through it.
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

/// Pairs one part with one triangle after the other.
class MeshPairing {
public:
    MeshPairing(const SurfaceTriangles& surface, const MeshPart& part, double offset, double margin,
                double exact_below, NearestTriangle& nearest, ContactPatches* patches)
        : surface_(surface),
          part_(part),
          offset_(offset),
          margin_(margin),
          exact_below_(exact_below),
          nearest_(nearest),
          patches_(patches),
          faces_(part, margin) {}

    /// Adds what was found to the patches.
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
        // Above the triangle's plane: where the lowest point is over the triangle, it is the nearest.
        double deepest = -kInfinity;
        if (front >= 0.0 && !is_point()) {
            const FaceContacts::Found found = faces_.add(triangle);
            deepest = found.depth;
            // Where a face lies on the triangle, other features of the two say the same.
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
        take(triangle, pair);
        if (pair.lower > reach() || !(pair.distance > 0.0)) return;
        const double facing = dot(pair.normal, triangle.normal);
        if (!(facing > 0.0)) return;  // behind it
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
    /// Largest distance of the shrunk part that may be a contact.
    double reach() const { return margin_ + offset_; }
    bool is_point() const { return part_.is_round() && !part_.whole().has_core(); }

    /// Updates the distance: by the bound where that is far enough.
    void measure(const SurfaceTriangle& triangle, double bound) {
        if (bound > exact_below_) {
            nearest_ = {bound, false, false};
            return;
        }
        take(triangle, part_.closest(triangle, nearest_.distance));
    }
    void take(const SurfaceTriangle& triangle, const MeshPair& pair) {
        const double distance = pair.lower;
        if (!(distance < nearest_.distance)) return;
        const double facing = dot(pair.normal, triangle.normal);
        nearest_ = {distance, std::abs(facing) >= kFace, facing > 0.0};
    }

    /// A contact at an edge or a vertex, where its direction is in the cone. Most are refused by a triangle that the
    /// part is near to.
    void add_candidate(const MeshPair& pair) {
        const ConeTest test(pair.on_triangle, pair.normal, surface_.local().spacing());
        for (std::size_t i = 0; i < near_count_; ++i) {
            if (test.refuses(near_[i])) return;
        }
        if (is_in_surface_cone(surface_, pair.on_triangle, pair.normal)) {
            add_pair(pair, pair.normal);
        }
    }

    /// A contact at the closest points.
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
    const MeshPart& part_;
    double offset_;
    double margin_;
    double exact_below_;
    NearestTriangle& nearest_;
    ContactPatches* patches_;
    FaceContacts faces_;
    // Triangles within reach, and pairs at their edges and vertices: the first ones. Not initialised beyond the counts.
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
    const auto find_side = [&](const MeshPart& part) {
        if (side == SurfaceSide::air) side = surface.side_of(part.inside(), part.ball());
    };
    const double around = std::max(reach, margin);
    const auto take = [&](const LocalShape& shape, std::uint32_t index) {
        const MeshPart part(shape, index, offset);
        MeshPairing pairing(surface, part, offset, margin, exact_below, nearest, patches);
        const bool is_known = surface.visit(
            part.box(around),
            [&](const std::array<Eigen::Vector3d, 3>& corners) {
                return !part.is_beside(corners, around);
            },
            [&](const SurfaceTriangle& triangle) { pairing.pair(triangle); });
        pairing.finish();
        result.is_missing = result.is_missing || !is_known;
        // What no triangle crosses is on one side: that of its nearest triangle, if that is nearest to its interior.
        const bool is_known_side = nearest.is_face && !body.is_compound();
        if (is_known_side && !nearest.is_front) side = SurfaceSide::solid;
        if (!is_known_side && nearest.distance > 0.0 && !result.is_missing) find_side(part);
    };
    body.visit(
        [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& bounds) {
            const Eigen::Vector3d half = bounds + Eigen::Vector3d::Constant(around);
            return !surface.is_empty({centre - half, centre + half});
        },
        take);
    result.distance = nearest.distance;
    if (result.is_missing || !(nearest.distance > 0.0)) return result;
    if (body.is_compound()) {
        LocalHull hull;
        const LocalShape first = body.part(0, hull);
        find_side(MeshPart(first, 0, offset));
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
    constexpr double kLeft = 1e-6;   // of a body is left, so that it has an inside
    constexpr double kGrowth = 8.0;  // of the offsets that are tried
    constexpr double kFirst = 1e-3;  // of the body
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
