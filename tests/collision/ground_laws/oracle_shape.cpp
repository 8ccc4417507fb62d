// SPDX-License-Identifier: MIT
#include "collision/ground_laws/oracle_shape.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <limits>

namespace terrane::test {

Soup::Soup(const Ground& ground) : spacing_(ground.spacing()) {
    const WorldRect& extent = ground.extent();
    const std::int64_t first_column = ground.column_at(extent.west);
    const std::int64_t first_row = ground.row_at(extent.south);
    extent_ = extent;
    west_ = ground.cell_x(first_column);
    south_ = ground.cell_y(first_row);
    side_ = static_cast<int>(
        std::ceil(std::max(extent.east - west_, extent.north - south_) / spacing_ - 1e-9));
    is_cut_ = west_ != extent.west || south_ != extent.south ||
              west_ + side_ * spacing_ != extent.east || south_ + side_ * spacing_ != extent.north;
    const auto count = static_cast<std::size_t>(side_);
    heights_.assign((count + 1) * (count + 1), 0.0);
    highest_.assign(count * count, -std::numeric_limits<double>::infinity());
    is_cell_.assign(count * count, false);
    for (int row = 0; row < side_; ++row) {
        for (int column = 0; column < side_; ++column) {
            const GroundCell cell = ground.cell(first_column + column, first_row + row);
            if (cell.status != QueryStatus::ok) continue;
            is_cell_[index(column, row)] = true;
            const std::array<std::int32_t, 4> corners{cell.south_west, cell.south_east,
                                                      cell.north_west, cell.north_east};
            for (int k = 0; k < 4; ++k) {
                const double z = ground.lattice().quantum * corners[static_cast<std::size_t>(k)];
                heights_[static_cast<std::size_t>((row + k / 2) * (side_ + 1) + column + k % 2)] =
                    z;
                highest_[index(column, row)] = std::max(highest_[index(column, row)], z);
            }
        }
    }
}

double Soup::height(double x, double y) const {
    const double u = (x - west_) / spacing_, v = (y - south_) / spacing_;
    const int column = std::clamp(static_cast<int>(std::floor(u)), 0, side_ - 1);
    const int row = std::clamp(static_cast<int>(std::floor(v)), 0, side_ - 1);
    const double s = u - column, t = v - row;
    const double sw = vertex(column, row).z(), se = vertex(column + 1, row).z();
    const double nw = vertex(column, row + 1).z(), ne = vertex(column + 1, row + 1).z();
    if (is_cut_to_north_east(column, row)) {
        return s > t ? sw + s * (se - sw) + t * (ne - se) : sw + s * (ne - nw) + t * (nw - sw);
    }
    return s + t < 1.0 ? sw + s * (se - sw) + t * (nw - sw)
                       : ne - (1.0 - s) * (ne - nw) - (1.0 - t) * (ne - se);
}

namespace {

// Triangles are all triples with every other point on one side; edges are all pairs that lie in two planes.
OraclePart hull_of(std::vector<Eigen::Vector3d> points) {
    struct Plane {
        Eigen::Vector3d normal;
        double offset;
    };
    double size = 0.0;
    for (const Eigen::Vector3d& p : points) {
        size = std::max(size, (p - points[0]).cwiseAbs().maxCoeff());
    }
    const double slack = 1e-12 * size;
    std::vector<Plane> planes;
    OraclePart part;
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (std::size_t j = i + 1; j < points.size(); ++j) {
            for (std::size_t k = j + 1; k < points.size(); ++k) {
                const Eigen::Vector3d n = (points[j] - points[i]).cross(points[k] - points[i]);
                if (!(n.norm() > 1e-12 * size * size)) continue;
                bool is_face = false;
                for (const double sign : {-1.0, 1.0}) {
                    const Plane plane{sign * n.normalized(), sign * n.normalized().dot(points[i])};
                    if (std::any_of(points.begin(), points.end(), [&](const Eigen::Vector3d& p) {
                            return plane.normal.dot(p) > plane.offset + slack;
                        })) {
                        continue;
                    }
                    is_face = true;
                    if (std::none_of(planes.begin(), planes.end(), [&](const Plane& other) {
                            return (other.normal - plane.normal).norm() < 1e-9;
                        })) {
                        planes.push_back(plane);
                    }
                }
                if (is_face) part.triangles.push_back({i, j, k});
            }
        }
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (std::size_t j = i + 1; j < points.size(); ++j) {
            const auto count = std::count_if(planes.begin(), planes.end(), [&](const Plane& plane) {
                return plane.normal.dot(points[i]) > plane.offset - slack &&
                       plane.normal.dot(points[j]) > plane.offset - slack;
            });
            if (count >= 2 || planes.empty()) part.edges.push_back({i, j});
        }
    }
    if (points.size() == 1) part.edges.push_back({0, 0});
    part.points = std::move(points);
    return part;
}

struct MakePart {
    OraclePart operator()(const Sphere& sphere) const {
        OraclePart part = hull_of({Eigen::Vector3d::Zero()});
        part.radius = sphere.radius;
        return part;
    }
    OraclePart operator()(const Capsule& capsule) const {
        const Eigen::Vector3d end(0.0, 0.0, capsule.half_height);
        OraclePart part = hull_of({-end, end});
        part.radius = capsule.radius;
        return part;
    }
    OraclePart operator()(const Box& box) const {
        std::vector<Eigen::Vector3d> points;
        for (int k = 0; k < 8; ++k) {
            const Eigen::Vector3d signs((k & 1) != 0 ? 1.0 : -1.0, (k & 2) != 0 ? 1.0 : -1.0,
                                        (k & 4) != 0 ? 1.0 : -1.0);
            points.push_back(signs.cwiseProduct(box.half_extents));
        }
        return hull_of(std::move(points));
    }
    OraclePart operator()(const ConvexHull& hull) const {
        return hull_of({hull.vertices().begin(), hull.vertices().end()});
    }
};

}  // namespace

OracleShape make_oracle(const Shape& shape) {
    OracleShape oracle;
    if (const Compound* compound = std::get_if<Compound>(&shape)) {
        for (const CompoundPart& of : compound->parts()) {
            OraclePart part = std::visit(MakePart{}, of.shape);
            for (Eigen::Vector3d& p : part.points) p = of.body_from_part * p;
            oracle.parts.push_back(std::move(part));
        }
        return oracle;
    }
    std::visit(
        [&](const auto& convex) {
            if constexpr (!std::is_same_v<std::decay_t<decltype(convex)>, Compound>) {
                oracle.parts.push_back(MakePart{}(convex));
            }
        },
        shape);
    return oracle;
}

OracleShape make_hull_oracle(std::vector<Eigen::Vector3d> points) {
    OracleShape oracle;
    oracle.parts.push_back(hull_of(std::move(points)));
    return oracle;
}

}  // namespace terrane::test
