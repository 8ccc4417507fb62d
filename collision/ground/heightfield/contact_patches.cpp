// SPDX-License-Identifier: MIT
#include "ground/heightfield/contact_patches.h"

#include "ground/column/local_ground.h"
#include "ground/heightfield/feature_contacts.h"
#include "ground/heightfield/min_translation.h"

#include <algorithm>
#include <memory>

namespace terrane::internal {
namespace {

struct NearestVisitor {
    const LocalGround& local;
    const LocalShape& shape;
    double best;
    Nearest result;

    bool wants(const CellPrism& prism) const { return bound_distance(shape, prism) <= best; }
    bool miss(const CellPrism& prism) {
        if (wants(prism)) result.is_missing = true;
        return true;
    }
    void visit(const GroundCell& cell, std::int64_t column, std::int64_t row) {
        result.error_m = std::max(result.error_m, static_cast<double>(cell.error_m));
        for (const Triangle& triangle : local.triangles(cell, column, row)) {
            if (gap_along(triangle.normal, shape, triangle) > best) continue;
            if (shape.kind == ShapeKind::box &&
                find_separation(shape, triangle, false).gap > best) {
                continue;
            }
            const ClosestPair pair = find_closest(shape, triangle);
            if (pair.distance > best || (result.is_found && pair.distance >= best)) continue;
            best = pair.distance;
            result.is_found = true;
            result.distance = pair.distance;
            result.on_shape = pair.on_shape;
            result.triangle = triangle;
            const Eigen::Vector3d apart = pair.on_shape - pair.on_triangle;
            const double size = length(apart);
            if (size > kTouch) {
                result.normal = apart / size;
            } else {
                result.normal = find_separation(shape, triangle, false).normal;
            }
        }
    }
};

// Finds the point of the ground that is nearest to one shape, within a distance.
Nearest find_within(const LocalGround& local, const LocalShape& shape, double reach) {
    NearestVisitor visitor{local, shape, reach, {}};
    const Eigen::Vector3d low = shape.centre - shape.bounds;
    const Eigen::Vector3d high = shape.centre + shape.bounds;
    // Starts with the cell under the lowest point: its distance excludes most other cells.
    const Eigen::Vector3d lowest = shape.deepest_point(Eigen::Vector3d::UnitZ());
    const CellRange first = local.cells(lowest[0], lowest[1], lowest[0], lowest[1]);
    if (first.west <= first.east && first.south <= first.north) {
        const GroundCell cell = local.cell(first.east, first.north);
        if (cell.status == QueryStatus::ok) visitor.visit(cell, first.east, first.north);
    }
    visit_cells(local,
                local.cells(low[0] - reach, low[1] - reach, high[0] + reach, high[1] + reach),
                visitor);
    return visitor.result;
}

Nearest find_within(const LocalGround& local, const LocalBody& body, double reach) {
    Nearest all;
    all.distance = reach;
    body.visit(
        [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& bounds) {
            const Eigen::Vector3d around = bounds + Eigen::Vector3d::Constant(all.distance);
            return centre[2] - around[2] <= bound_ground(local, centre, around);
        },
        [&](const LocalShape& shape, std::uint32_t part) {
            const Nearest found = find_within(local, shape, all.distance);
            all.error_m = std::max(all.error_m, found.error_m);
            all.is_missing = all.is_missing || found.is_missing;
            if (!found.is_found || (all.is_found && found.distance >= all.distance)) return;
            all.is_found = true;
            all.distance = found.distance;
            all.on_shape = found.on_shape;
            all.normal = found.normal;
            all.part = part;
            all.triangle = found.triangle;
        });
    return all;
}

}  // namespace

ClosestPair find_closest(const LocalShape& shape, const Triangle& triangle) {
    if (shape.kind == ShapeKind::box) return find_closest_box(shape, triangle);
    if (shape.kind == ShapeKind::hull) {
        return find_closest_hull(*shape.hull, shape.centre, triangle);
    }
    ClosestPair pair = find_closest_core(shape.centre, shape.core, triangle);
    const double distance = pair.distance;
    if (distance > 0.0) {
        pair.on_shape += (shape.radius / distance) * (pair.on_triangle - pair.on_shape);
    }
    pair.distance = std::max(0.0, distance - shape.radius);
    return pair;
}

Nearest find_nearest(const LocalGround& local, const LocalBody& body, double max_distance) {
    // Searches in increasing distances, so that a large limit costs nothing if the ground is near.
    double reach = std::min(max_distance, local.spacing());
    for (;;) {
        const Nearest nearest = find_within(local, body, reach);
        if (nearest.is_found || nearest.is_missing || reach >= max_distance) return nearest;
        reach = std::min(max_distance, 4.0 * reach);
    }
}

bool add_nearest(const LocalGround& local, const LocalBody& body, double margin,
                 ContactPatches& patches) {
    if (!body.is_compound() && body.whole().kind == ShapeKind::round) return true;
    const Nearest nearest = find_nearest(local, body, margin);
    if (!nearest.is_found || !is_in_normal_cone(local, nearest.triangle, nearest.normal)) {
        return !nearest.is_missing;
    }
    LocalHull hull;
    const ShapeFeature feature = body.part(nearest.part, hull).deepest(nearest.normal).feature;
    patches.add(
        make_contact(nearest.on_shape, nearest.normal, -nearest.distance, feature, nearest.part));
    return true;
}

namespace {

bool is_before_by_position(const Contact& a, const Contact& b) {
    for (int i = 0; i < 3; ++i) {
        if (a.point_world[i] != b.point_world[i]) return a.point_world[i] < b.point_world[i];
    }
    for (int i = 0; i < 3; ++i) {
        if (a.normal[i] != b.normal[i]) return a.normal[i] < b.normal[i];
    }
    if (a.part != b.part) return a.part < b.part;
    if (a.feature.first != b.feature.first) return a.feature.first < b.feature.first;
    return a.feature.second < b.feature.second;
}

bool is_before(const Contact& a, const Contact& b) {
    if (a.depth != b.depth) return a.depth > b.depth;
    return is_before_by_position(a, b);
}

double square_distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    const Eigen::Vector3d d = a - b;
    return dot(d, d);
}

// Moves up to four contacts that represent a patch to the front of the patch; returns their number.
std::size_t reduce(std::span<Contact> patch) {
    constexpr double kSamePosition = 1e-20;  // square metres
    constexpr double kSameDepth = 1e-12;     // metres
    // Of the contacts that are deepest within rounding, the first by position comes first. It is an outermost one, so
    // that the result does not depend on where the edges of the ground are.
    std::size_t first = 0;
    for (std::size_t i = 1; i < patch.size(); ++i) {
        if (patch[i].depth < patch[0].depth - kSameDepth) break;
        if (is_before_by_position(patch[i], patch[first])) first = i;
    }
    std::swap(patch[0], patch[first]);
    std::size_t kept = 1;
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
                    // The area that the fourth point adds to the triangle of the first three.
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
        if (which == 0 || best < kSamePosition) break;
        std::swap(patch[kept], patch[which]);
        ++kept;
    }
    return kept;
}

// Whether a shape's features are paired with those of a whole window; otherwise with those of one triangle at a time.
bool is_paired_by_feature(const LocalShape& shape) {
    return shape.kind == ShapeKind::box || (shape.kind == ShapeKind::round && shape.radius > kThin);
}

// Finds the contacts of a shape for which is_paired_by_feature() holds with cells of a window.
void find_window_patches(const LocalGround& local, const LocalWindow& window,
                         const CellRange& cells, const LocalShape& shape, std::uint32_t part,
                         const Eigen::Vector3d& translation, double margin, double reach,
                         ContactPatches& patches) {
    if (shape.kind == ShapeKind::box) {
        find_box_patches(local, window, cells, shape, part, translation, margin, reach, patches);
    } else {
        find_round_patches(local, window, cells, shape, part, translation, margin, reach, patches);
    }
}

struct PatchVisitor {
    const LocalGround& local;
    const LocalShape& shape;  ///< at the pose of the query
    const LocalShape& moved;  ///< after the translation
    std::uint32_t part;
    const Eigen::Vector3d& translation;
    double margin;
    double reach;
    ContactPatches& patches;
    FeaturePairs pairs;
    double error_m = 0.0;
    bool is_missing = false;

    // There are no contacts beyond the margin of the untranslated shape.
    bool wants(const CellPrism& prism) const {
        return bound_distance(shape, prism) <= margin && bound_distance(moved, prism) <= reach;
    }
    bool miss(const CellPrism& prism) {
        if (!wants(prism)) return true;
        is_missing = true;
        return false;
    }
    bool visit_square(const CellRange& cells) {
        if (!is_paired_by_feature(shape)) return false;
        const LocalWindow* const window = local.window(cells, 1);
        if (window == nullptr) return false;
        find_window_patches(local, *window, cells, shape, part, translation, margin, reach,
                            patches);
        error_m = std::max(error_m, local.error(cells));
        return true;
    }
    void visit(const GroundCell& cell, std::int64_t column, std::int64_t row) {
        error_m = std::max(error_m, static_cast<double>(cell.error_m));
        for (const Triangle& triangle : local.triangles(cell, column, row)) {
            if (gap_along(triangle.normal, shape, triangle) <= margin) pairs.pair(triangle);
        }
    }
};

// Finds the contacts of one convex shape. False if a cell in reach is not resident.
bool find_patches(const LocalGround& local, const LocalShape& shape, std::uint32_t part,
                  const Eigen::Vector3d& translation, double margin, ContactPatches& patches,
                  double& error_out) {
    const Eigen::Vector3d low = shape.centre - shape.bounds;
    const Eigen::Vector3d high = shape.centre + shape.bounds;
    const CellRange cells =
        local.cells(low[0] - margin, low[1] - margin, high[0] + margin, high[1] + margin);
    const LocalWindow* const window = local.window(cells, 1);
    if (window != nullptr) error_out = std::max(error_out, local.error(cells));
    // For a deep overlap, only ground near the translated shape matters.
    const double reach = margin + std::min(length(translation), kDeep * shape.smallest);
    if (window != nullptr && is_paired_by_feature(shape)) {
        find_window_patches(local, *window, cells, shape, part, translation, margin, reach,
                            patches);
        return true;
    }
    LocalShape moved = shape;
    moved.centre += translation;
    PatchVisitor visitor{
        local, shape,       moved,
        part,  translation, margin,
        reach, patches,     FeaturePairs(local, moved, translation, reach, margin, part, patches)};
    visit_cells(local, cells, visitor);
    error_out = std::max(error_out, visitor.error_m);
    return !visitor.is_missing;
}

}  // namespace

void ContactPatches::add(const Contact& contact) {
    if (count_ == kMost) {
        merge();
        // Too many normals: keeps the deepest half.
        count_ = std::min(count_, kMost / 2);
    }
    std::construct_at(&contacts_[count_++], contact);
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
            // rotate(), because the rest must stay sorted
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

bool find_patches(const LocalGround& local, const LocalBody& body,
                  const Eigen::Vector3d& translation, double margin, ContactPatches& patches,
                  double& error_out) {
    const double near = margin + kTouch;
    bool is_known = true;
    body.visit(
        [&](const Eigen::Vector3d& centre, const Eigen::Vector3d& bounds) {
            const Eigen::Vector3d around = bounds + Eigen::Vector3d::Constant(near);
            return centre[2] - around[2] <= bound_ground(local, centre, around);
        },
        [&](const LocalShape& shape, std::uint32_t part) {
            is_known =
                find_patches(local, shape, part, translation, near, patches, error_out) && is_known;
        });
    return is_known;
}

}  // namespace terrane::internal
