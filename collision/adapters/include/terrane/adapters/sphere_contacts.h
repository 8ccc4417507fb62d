// SPDX-License-Identifier: MIT
#pragma once

// Fast path of find_contacts() for spheres near the surface, for engines with many spheres.
//
// Source:     C. Ericson. Real-time collision detection. 2005, section 5.1.5 (closest point on a triangle).
// Deviations: only local minima of the distance from the centre to the surface are contacts: a closest point on an edge
//             or vertex counts only if no triangle that contains it comes nearer. So every normal lies in the ground's
//             normal cone.

#include <terrane/adapters/ground_triangles.h>
#include <terrane/collision/ground_queries.h>

#include <optional>

namespace terrane::adapters {

namespace internal {

/// Closest point on a triangle.
struct TrianglePoint {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< closest point
    bool is_inside = false;                           ///< in the interior, not on an edge
};
/// Closest point on triangle a, b, c to p.
inline TrianglePoint closest_point(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                   const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    const Eigen::Vector3d ab = b - a, ac = c - a, ap = p - a;
    const double d1 = ab.dot(ap), d2 = ac.dot(ap);
    if (d1 <= 0.0 && d2 <= 0.0) return {a, false};
    const Eigen::Vector3d bp = p - b;
    const double d3 = ab.dot(bp), d4 = ac.dot(bp);
    if (d3 >= 0.0 && d4 <= d3) return {b, false};
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return {a + d1 / (d1 - d3) * ab, false};
    const Eigen::Vector3d cp = p - c;
    const double d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d6 >= 0.0 && d5 <= d6) return {c, false};
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return {a + d2 / (d2 - d6) * ac, false};
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0)
        return {b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b), false};
    const double sum = 1.0 / (va + vb + vc);
    return {a + vb * sum * ab + vc * sum * ac, true};
}

}  // namespace internal

/// Finds the contact of a sphere whose centre is above the surface. Gives the same answer as find_contacts(), except
/// that it leaves out the feature and error_m, and that the lift is 0. Returns nothing if find_contacts() must be used
/// instead: for ground with volumes, over absent ground or the border of the ground, over more than 6 x 6 cells, for a
/// centre under the surface, for several contacts, or for arguments that are not finite.
///
/// Threads:   any number at once
/// Allocates: nothing
/// Cost:      linear in the cells under the sphere
inline std::optional<ContactAnswer> find_sphere_contacts(const Ground& ground,
                                                         const WorldPos& centre_world,
                                                         double radius, double margin,
                                                         std::span<Contact> contacts_out) {
    const double reach = radius + margin;
    constexpr std::int64_t kMostSide = 6;
    if (ground.has_solids() || !centre_world.allFinite() || !(radius >= 0.0) || !(margin >= 0.0) ||
        !(reach <= 0.5 * kMostSide * ground.spacing())) {
        return std::nullopt;
    }
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(reach);
    const CellRange cells =
        internal::cells_under(ground, {centre_world - half, centre_world + half});
    ContactAnswer answer;
    answer.status = QueryStatus::ok;
    if (cells.west > cells.east || cells.south > cells.north) return std::nullopt;
    if (!ground.is_within_extent(cells)) return std::nullopt;
    if (cells.east - cells.west >= kMostSide || cells.north - cells.south >= kMostSide)
        return std::nullopt;

    constexpr std::size_t kStride = kMostSide + 1;
    std::array<std::int32_t, kStride * kStride> quanta;
    std::array<std::uint32_t, kMostSide> ground_bits;
    GroundReader reader(ground);
    reader.heights(cells, kStride, quanta, ground_bits);
    const auto columns = static_cast<std::size_t>(cells.east - cells.west) + 1;
    const auto rows = static_cast<std::size_t>(cells.north - cells.south) + 1;
    for (std::size_t j = 0; j < rows; ++j) {
        if (ground_bits[j] != (1u << columns) - 1u) return std::nullopt;
    }

    // relative to the centre
    struct Near {
        Eigen::Vector3d point;
        std::array<Eigen::Vector3d, 3> corners;
        double squared;
        bool is_inside;
        bool is_below;  // the centre is under the triangle's plane
    };
    std::array<Near, 2 * kMostSide * kMostSide> near;
    std::size_t near_count = 0;
    const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
    const double quantum = ground.lattice().quantum, squared_reach = reach * reach;
    for (std::size_t j = 0; j < rows; ++j) {
        const std::int64_t row = cells.south + static_cast<std::int64_t>(j);
        const double south = ground.cell_y(row) - centre_world.y();
        const double north = ground.cell_y(row + 1) - centre_world.y();
        for (std::size_t i = 0; i < columns; ++i) {
            const std::int64_t column = cells.west + static_cast<std::int64_t>(i);
            const std::int32_t* const q = &quanta[j * kStride + i];
            const double west = ground.cell_x(column) - centre_world.x();
            const double east = ground.cell_x(column + 1) - centre_world.x();
            const auto z = [&](std::size_t k) { return quantum * q[k] - centre_world.z(); };
            const Eigen::Vector3d sw(west, south, z(0)), se(east, south, z(1));
            const Eigen::Vector3d nw(west, north, z(kStride)), ne(east, north, z(kStride + 1));
            const bool is_to_north_east = cut_to_north_east(column, row);
            bool is_under = false;
            const auto visit = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                   const Eigen::Vector3d& c) {
                const Eigen::Vector3d n = (b - a).cross(c - a);  // z > 0
                const double above = -n.dot(a);
                if (above > 0.0 && above * above > squared_reach * n.squaredNorm()) return;
                const internal::TrianglePoint closest = internal::closest_point(origin, a, b, c);
                const double squared = closest.point.squaredNorm();
                // whether the centre is over this triangle and under its plane
                if (above < 0.0) {
                    const auto side = [](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
                        return from.x() * to.y() - from.y() * to.x() >= 0.0;
                    };
                    is_under = is_under || (side(a, b) && side(b, c) && side(c, a));
                }
                if (squared <= squared_reach)
                    near[near_count++] = {
                        closest.point, {a, b, c}, squared, closest.is_inside, above < 0.0};
            };
            visit(sw, se, is_to_north_east ? ne : nw);
            visit(is_to_north_east ? sw : se, ne, nw);
            if (is_under) return std::nullopt;
        }
    }

    const double small = 1e-9 * ground.spacing();
    const auto contains = [&](const Near& triangle, const Eigen::Vector3d& p) {
        for (std::size_t k = 0; k < 3; ++k) {
            const Eigen::Vector3d& a = triangle.corners[k];
            const Eigen::Vector3d edge = triangle.corners[(k + 1) % 3] - a;
            if (edge.x() * (p.y() - a.y()) - edge.y() * (p.x() - a.x()) < -small * ground.spacing())
                return false;
        }
        return true;
    };
    struct Found {
        Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
        double depth = 0.0;
    };
    Found found;
    bool is_found = false;
    for (std::size_t i = 0; i < near_count; ++i) {
        const Near& t = near[i];
        const Eigen::Vector3d n = (t.corners[1] - t.corners[0]).cross(t.corners[2] - t.corners[0]);
        if (t.is_below) continue;
        bool is_contact = true;
        for (std::size_t k = 0; k < near_count && is_contact && !t.is_inside; ++k) {
            if (k == i || !contains(near[k], t.point)) continue;
            // rejects the point if a triangle that contains it comes nearer; of equal points keeps the first
            const double nearer = t.squared - near[k].squared;
            is_contact = nearer <= small * reach &&
                         !(nearer >= -small * reach && k < i && !near[k].is_inside &&
                           !near[k].is_below && (near[k].point - t.point).norm() < small);
        }
        if (!is_contact) continue;
        const double distance = std::sqrt(t.squared);
        if (is_found) return std::nullopt;
        is_found = true;
        found = {
            t.is_inside || distance < small ? n.normalized() : Eigen::Vector3d(-t.point / distance),
            radius - distance};
    }
    if (!is_found) return answer;
    if (contacts_out.empty()) {
        answer.status = QueryStatus::truncated;
        return answer;
    }
    answer.count = 1;
    contacts_out[0] = {};
    contacts_out[0].normal = found.normal;
    contacts_out[0].depth = found.depth;
    contacts_out[0].point_world = centre_world - radius * found.normal;
    return answer;
}

}  // namespace terrane::adapters
