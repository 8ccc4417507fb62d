// SPDX-License-Identifier: MIT
//
// Hulls of the pieces of a closed solid that is cut by axis-aligned planes.
//
// Sources:    Lien, Amato. Approximate convex decomposition of polyhedra. SPM 2007 (cut where concavity is largest).
//             Wei, Liu, Su. Approximate convex decomposition for 3D meshes with collision-aware concavity and tree
//             search. SIGGRAPH 2022 (concavity as a Hausdorff distance; axis-aligned cutting planes).
//             Mamou. Volumetric hierarchical approximate convex decomposition. Game Engine Gems 3, 2016 (planes chosen
//             by the volume of the hulls minus that of the solid).
//             Sutherland, Hodgman. Reentrant polygon clipping. 1974.
// Deviations: surfaces of pieces are not closed along a cut. Every extreme point of the solid within a box lies on the
//             clipped surface or is a corner of the box that lies inside the solid, so the hull of these points is the
//             hull of the piece. Planes are chosen one at a time, without a tree search.
#include "base/aabb_tree.h"
#include "shapes/proxy_parts.h"

#include <algorithm>
#include <array>
#include <optional>
#include <queue>
#include <tuple>
#include <utility>

namespace terrane::internal {
namespace {

using Polygon = std::vector<Eigen::Vector3d>;

// Precision of the distances by which pieces are chosen for cutting: a quarter of the error, or this fraction of the
// extent if that is more. It does not affect whether a piece counts as within the error.
constexpr double kCutPrecision = 1e-4;

/// The solid within a box.
struct Cell {
    Aabb box;
    std::vector<Polygon> surface;  ///< the solid's triangles, clipped to the box
    double winding = 1.0;          ///< -1 if triangles are clockwise seen from outside
    std::optional<ProxyPart> part;
};

/// The cutting plane p[axis] = at.
struct Cut {
    int axis = 0;
    double at = 0.0;
};

/// The part of a polygon above a cut (`sign` 1) or below it (-1).
Polygon clipped(const Polygon& polygon, const Cut& cut, double sign) {
    Polygon made;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Eigen::Vector3d& a = polygon[i];
        const Eigen::Vector3d& b = polygon[i + 1 < polygon.size() ? i + 1 : 0];
        const double of_a = sign * (a[cut.axis] - cut.at), of_b = sign * (b[cut.axis] - cut.at);
        if (of_a >= 0.0) made.push_back(a);
        if ((of_a > 0.0 && of_b < 0.0) || (of_a < 0.0 && of_b > 0.0)) {
            Eigen::Vector3d crossing = a + (of_a / (of_a - of_b)) * (b - a);
            crossing[cut.axis] = cut.at;
            made.push_back(crossing);
        }
    }
    return made;
}

std::array<Eigen::Vector3d, 8> corners_of(const Aabb& box) {
    std::array<Eigen::Vector3d, 8> corners;
    for (std::size_t i = 0; i < 8; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            corners[i][axis] = ((i >> axis) & 1U) != 0 ? box.high[axis] : box.low[axis];
        }
    }
    return corners;
}

/// Whether a polygon belongs to the side above a cut (`sign` 1) or below it (-1): it has points there, or it lies in
/// the plane with the solid on that side. In the latter case the hull of the other side does not need it.
bool is_of_side(const Polygon& polygon, const Cut& cut, double sign, double winding) {
    bool is_in_plane = true;
    for (const Eigen::Vector3d& p : polygon) {
        if (sign * (p[cut.axis] - cut.at) > 0.0) return true;
        is_in_plane = is_in_plane && p[cut.axis] == cut.at;
    }
    if (!is_in_plane) return false;
    Eigen::Vector3d area = Eigen::Vector3d::Zero();
    for (std::size_t i = 2; i < polygon.size(); ++i) {
        area += cross(polygon[i - 1] - polygon[0], polygon[i] - polygon[0]);
    }
    return (winding * area[cut.axis] <= 0.0) == (sign > 0.0);
}

/// One side of a cut of a cell.
Cell side_of(const Cell& cell, const Cut& cut, double sign) {
    Cell side{cell.box, {}, cell.winding, std::nullopt};
    (sign > 0.0 ? side.box.low : side.box.high)[cut.axis] = cut.at;
    for (const Polygon& polygon : cell.surface) {
        if (!is_of_side(polygon, cut, sign, cell.winding)) continue;
        Polygon piece = clipped(polygon, cut, sign);
        if (!piece.empty()) side.surface.push_back(std::move(piece));
    }
    return side;
}

/// Points whose hull is that of the solid within the cell. Corners of the box that lie on the surface are skipped: they
/// are on the clipped surface already, or belong to the solid outside the cell.
std::vector<Eigen::Vector3d> extreme_points(const SolidMesh& solid, const Cell& cell) {
    std::vector<Eigen::Vector3d> points;
    for (const Polygon& polygon : cell.surface) {
        points.insert(points.end(), polygon.begin(), polygon.end());
    }
    const double on_surface = 1e-9 * solid.extent;
    for (const Eigen::Vector3d& corner : corners_of(cell.box)) {
        if (is_inside(solid, corner) && find_nearest(solid, corner).distance > on_surface) {
            points.push_back(corner);
        }
    }
    return points;
}

/// Volume of the hull of the points that are extreme along 26 directions.
double rough_volume(const std::vector<Eigen::Vector3d>& points) {
    if (points.size() < 4) return 0.0;
    std::vector<Eigen::Vector3d> extremes;
    for (int code = 0; code < 27; ++code) {
        const int x = code % 3 - 1, y = code / 3 % 3 - 1, z = code / 9 - 1;
        const Eigen::Vector3d direction(x, y, z);
        if (code == 13) continue;
        const Eigen::Vector3d* best = &points[0];
        double highest = -kInfinity;
        for (const Eigen::Vector3d& p : points) {
            const double height = dot(direction, p);
            if (height > highest) {
                highest = height;
                best = &p;
            }
        }
        extremes.push_back(*best);
    }
    const Result<ConvexHull> hull = ConvexHull::create(extremes);
    return hull ? volume_of(*hull) : 0.0;
}

/// Candidate coordinates of a cut along an axis: quarters of the box, up to ten vertices of the surface, and the point
/// of the hull that is known to be farthest from the solid.
std::vector<double> positions_along(const Cell& cell, int axis) {
    constexpr std::size_t kMostVertices = 10;
    constexpr double kMargin = 0.02;  // of the box's side, left on both sides of a cut
    const double low = cell.box.low[axis], side = cell.box.high[axis] - low;
    std::vector<double> vertices;
    for (const Polygon& polygon : cell.surface) {
        for (const Eigen::Vector3d& p : polygon) vertices.push_back(p[axis]);
    }
    vertices.push_back(cell.part->distance.place[axis]);
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    std::erase_if(vertices, [&](double at) {
        return at < low + kMargin * side || at > low + (1.0 - kMargin) * side;
    });
    std::vector<double> positions;
    const std::size_t kept = std::min(vertices.size(), kMostVertices);
    for (std::size_t i = 0; i < kept; ++i) {
        positions.push_back(vertices[(2 * i + 1) * vertices.size() / (2 * kept)]);
    }
    for (const double share : {0.25, 0.5, 0.75}) positions.push_back(low + share * side);
    return positions;
}

/// The cut whose two hulls have the smallest total volume. If no cut saves 3 %, the middle of the longest side: for
/// instance, no first cut of a ring saves volume.
Cut choose_cut(const SolidMesh& solid, const Cell& cell, double error) {
    constexpr double kSaved = 0.97;
    const Eigen::Vector3d sides = cell.box.high - cell.box.low;
    int longest = 0;
    for (int axis = 1; axis < 3; ++axis) longest = sides[axis] > sides[longest] ? axis : longest;
    Cut best{longest, cell.box.low[longest] + 0.5 * sides[longest]};
    const auto volume_after = [&](const Cut& cut) {
        return rough_volume(extreme_points(solid, side_of(cell, cut, -1.0))) +
               rough_volume(extreme_points(solid, side_of(cell, cut, 1.0)));
    };
    double least = rough_volume(extreme_points(solid, cell)) * kSaved;
    for (int axis = 0; axis < 3; ++axis) {
        // Slices much thinner than the error reduce the volume but not the distance.
        if (!(sides[axis] > std::max(0.25 * error, 1e-6 * sides[longest]))) continue;
        for (const double at : positions_along(cell, axis)) {
            const double volume = volume_after({axis, at});
            if (volume < least) {
                least = volume;
                best = {axis, at};
            }
        }
    }
    return best;
}

}  // namespace

Result<ProxyPart> make_part(std::span<const Eigen::Vector3d> points) {
    TERRANE_TRY(ConvexHull hull, ConvexHull::create(points));
    Aabb bounds = empty_box();
    for (const Eigen::Vector3d& vertex : hull.vertices()) include(vertex, 0.0, bounds);
    const double volume = volume_of(hull);
    return ProxyPart{std::move(hull), bounds, volume, {}};
}

Result<std::vector<ProxyPart>> cut_to_parts(const SolidMesh& solid, double error,
                                            std::size_t max_parts) {
    const double precision = std::max(0.25 * error, kCutPrecision * solid.extent);
    // Makes the part of a cell and shrinks the cell's box to the part: the solid in the cell has no points outside it.
    const auto finish = [&](Cell& cell) -> Result<void> {
        const std::vector<Eigen::Vector3d> points = extreme_points(solid, cell);
        if (points.empty()) return {};
        TERRANE_TRY(ProxyPart part, make_part(points));
        cell.box = part.bounds;
        part.distance = distance_outside(solid, part.hull, error, precision, kInfinity);
        cell.part.emplace(std::move(part));
        return {};
    };
    std::vector<Cell> cells(1);
    cells[0].box = empty_box();
    cells[0].winding = signed_volume(solid) < 0.0 ? -1.0 : 1.0;
    for (std::uint32_t i = 0; i < solid.triangles.size(); ++i) {
        const auto corners = solid.corners(i);
        cells[0].surface.emplace_back(corners.begin(), corners.end());
        for (const Eigen::Vector3d& corner : corners) include(corner, 0.0, cells[0].box);
    }
    TERRANE_TRY(finish(cells[0]));
    while (cells.size() < max_parts) {
        const auto worst =
            std::max_element(cells.begin(), cells.end(), [](const Cell& a, const Cell& b) {
                return a.part->distance.high < b.part->distance.high;
            });
        if (worst->part->distance.high <= error) break;
        const Cell cell = std::move(*worst);
        cells.erase(worst);
        const Cut cut = choose_cut(solid, cell, error);
        for (const double sign : {-1.0, 1.0}) {
            Cell side = side_of(cell, cut, sign);
            TERRANE_TRY(finish(side));
            if (side.part) cells.push_back(std::move(side));
        }
    }
    std::vector<ProxyPart> parts;
    parts.reserve(cells.size());
    for (Cell& cell : cells) parts.push_back(*std::move(cell.part));
    return parts;
}

// Source:     Mamou, Ghorbel. A simple and efficient approach for 3D mesh approximate convex decomposition. ICIP 2009
//             (parts are merged in the order of their cost).
// Deviations: the cost of a merge is the volume that the common hull adds; pairs are merged if the certified distance
//             of the common hull is within the error.

namespace {

/// The common hull of two parts.
struct MergedPair {
    double added_volume = 0.0;
    std::size_t first = 0, second = 0;  ///< indices of parts
    ProxyPart part;

    bool operator<(const MergedPair& other) const {  // the queue's top is the greatest
        return std::tie(added_volume, first, second) >
               std::tie(other.added_volume, other.first, other.second);
    }
};

class PartMerger {
public:
    PartMerger(const SolidMesh& solid, std::vector<ProxyPart> parts) : solid_(solid) {
        for (ProxyPart& part : parts) parts_.emplace_back(std::move(part));
        count_ = parts_.size();
    }

    /// Merges pairs while a common hull is within `error` of the solid and more than `enough` parts are left. With
    /// `only_neighbours`, only pairs whose boxes are at most half the error apart.
    Result<void> run(double error, std::size_t enough, bool only_neighbours) {
        pairs_ = {};
        margin_ = only_neighbours ? std::max(0.5 * error, 1e-9 * solid_.extent) : kInfinity;
        for (std::size_t i = 0; i < parts_.size(); ++i) {
            TERRANE_TRY(add_pairs(i));
        }
        while (!pairs_.empty() && count_ > enough) {
            MergedPair pair = pairs_.top();
            pairs_.pop();
            if (!parts_[pair.first] || !parts_[pair.second]) continue;
            pair.part.distance =
                distance_outside(solid_, pair.part.hull, error < kInfinity ? error : 0.0,
                                 error < kInfinity ? 0.0 : 1e-2 * solid_.extent, error);
            if (!(pair.part.distance.high <= error)) continue;
            parts_[pair.first].reset();
            parts_[pair.second].reset();
            parts_.emplace_back(std::move(pair.part));
            --count_;
            drop_contained(parts_.size() - 1);
            TERRANE_TRY(add_pairs(parts_.size() - 1));
        }
        return {};
    }

    std::vector<ProxyPart> take() {
        std::vector<ProxyPart> left;
        for (std::optional<ProxyPart>& part : parts_) {
            if (part) left.push_back(*std::move(part));
        }
        return left;
    }

private:
    /// Removes the parts contained in a new one.
    void drop_contained(std::size_t by) {
        const ConvexHull& hull = parts_[by]->hull;
        for (std::size_t i = 0; i < by; ++i) {
            if (!parts_[i] || !overlap(parts_[i]->bounds, parts_[by]->bounds, 0.0)) continue;
            const std::span<const Eigen::Vector3d> all = parts_[i]->hull.vertices();
            const bool is_contained =
                std::all_of(all.begin(), all.end(), [&](const Eigen::Vector3d& vertex) {
                    return !(distance_to_hull(hull, vertex) > 1e-12 * solid_.extent);
                });
            if (!is_contained) continue;
            parts_[i].reset();
            --count_;
        }
    }

    /// Adds the pairs of part `second` with the parts before it.
    Result<void> add_pairs(std::size_t second) {
        if (!parts_[second]) return {};
        const ProxyPart& b = *parts_[second];
        for (std::size_t first = 0; first < second; ++first) {
            if (!parts_[first] || !overlap(parts_[first]->bounds, b.bounds, margin_)) continue;
            const ProxyPart& a = *parts_[first];
            std::vector<Eigen::Vector3d> points(a.hull.vertices().begin(), a.hull.vertices().end());
            points.insert(points.end(), b.hull.vertices().begin(), b.hull.vertices().end());
            TERRANE_TRY(ProxyPart made, make_part(points));
            const double added = made.volume - a.volume - b.volume;
            pairs_.push({added, first, second, std::move(made)});
        }
        return {};
    }

    const SolidMesh& solid_;
    double margin_ = 0.0;
    std::size_t count_ = 0;
    std::vector<std::optional<ProxyPart>> parts_;  ///< empty once merged or contained in another
    std::priority_queue<MergedPair> pairs_;
};

}  // namespace

Result<std::vector<ProxyPart>> merge_parts(const SolidMesh& solid, std::vector<ProxyPart> parts,
                                           double error, std::size_t max_parts) {
    PartMerger merger(solid, std::move(parts));
    TERRANE_TRY(merger.run(error, 1, true));
    TERRANE_TRY(merger.run(kInfinity, max_parts, false));
    return merger.take();
}

ReducedHull reduce_hull(const ConvexHull& hull, double error, std::size_t max_vertices) {
    const std::span<const Eigen::Vector3d> all = hull.vertices();
    if (all.size() <= 4) return {hull, 0.0};
    // Chooses at least four vertices: the first in order, then always the farthest from the hull of those chosen.
    std::vector<Eigen::Vector3d> chosen{all[0]};
    for (;;) {
        const ConvexHull made = ConvexHull::create(chosen).value();
        double farthest = 0.0;
        const Eigen::Vector3d* next = nullptr;
        for (const Eigen::Vector3d& vertex : all) {
            const double distance = distance_to_hull(made, vertex);
            if (distance > farthest) {
                farthest = distance;
                next = &vertex;
            }
        }
        const bool is_enough = chosen.size() >= 4 && farthest <= error;
        if (next == nullptr || is_enough || chosen.size() >= max_vertices) return {made, farthest};
        chosen.push_back(*next);
    }
}

// Proves a lower bound of the error of any proxy.
//
// Let the hull of a part contain a point x, and let a path from x to infinity keep a distance of at least 2 e from the
// solid. The proxy may replace the hull by a reduced one that omits vertices. If an omitted vertex is farther than e
// from the reduced hull, the error exceeds e. Otherwise the reduced hull contains a point y within e of x. The path
// from y to x and on to infinity keeps a distance of at least e from the solid and crosses the surface of the reduced
// hull, so that the error is at least e.
//
// Source: J. Hart. Sphere tracing: a geometric method for the antialiased ray tracing of implicit surfaces. The Visual
//         Computer 12(10), 1996 (steps along a ray by the distance, which bounds how near the surface can be).

namespace {

constexpr std::size_t kMostParts = 16;  // tested: those farthest from the solid
constexpr int kMostSteps = 64;          // of a ray
// Bound of the rounding of hulls and clipped points, relative to the extent: ten times the bound of ConvexHull.
constexpr double kReachRounding = 1e-8;

// Whether a ray is proved to stay at least `clearance` away from the solid.
bool is_clear(const SolidMesh& solid, Eigen::Vector3d p, const Eigen::Vector3d& direction,
              double clearance) {
    for (int step = 0; step < kMostSteps; ++step) {
        const double distance = find_nearest(solid, p).distance;
        if (!(distance > clearance)) return false;
        // The ray began near the solid and is now farther away than its extent, so the rest leads away from it.
        if (distance > 8.0 * solid.extent) return true;
        p += 0.999 * (distance - clearance) * direction;
    }
    return false;
}

bool has_clear_ray(const SolidMesh& solid, const Eigen::Vector3d& p, double clearance) {
    for (int code = 0; code < 27; ++code) {
        const int x = code % 3 - 1, y = code / 3 % 3 - 1, z = code / 9 - 1;
        const Eigen::Vector3d direction(x, y, z);
        if (code != 13 && is_clear(solid, p, direction / length(direction), clearance)) return true;
    }
    return false;
}

}  // namespace

double least_error(const SolidMesh& solid, std::span<const ProxyPart> parts) {
    std::vector<const HullDistance*> worst;
    for (const ProxyPart& part : parts) worst.push_back(&part.distance);
    std::stable_sort(worst.begin(), worst.end(),
                     [](const HullDistance* a, const HullDistance* b) { return a->low > b->low; });
    worst.resize(std::min(worst.size(), kMostParts));
    double least = 0.0;
    for (const HullDistance* distance : worst) {
        for (const double share : {0.9, 0.5, 0.1}) {
            const double clearance = share * distance->low;
            const double bound = 0.5 * (0.999 * clearance - kReachRounding * solid.extent);
            if (!(bound > least)) break;
            if (has_clear_ray(solid, distance->place, clearance)) least = bound;
        }
    }
    return least;
}

}  // namespace terrane::internal
