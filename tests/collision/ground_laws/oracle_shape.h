// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/shapes.h>
#include <terrane/terrain/ground.h>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace terrane::test {

template <class Real>
using Vec = Eigen::Matrix<Real, 3, 1>;

/// A triangle of the contact surface, counter-clockwise seen from above.
template <class Real>
struct SoupTriangle {
    std::array<Vec<Real>, 3> v;
};

/// All triangles of a ground's contact surface, read once cell by cell; the rule for diagonals is implemented
/// independently.
class Soup {
public:
    explicit Soup(const Ground& ground);

    /// Height of the surface at a point inside the extent, metres.
    double height(double x, double y) const;
    int cells() const { return side_; }
    double spacing() const { return spacing_; }
    double west() const { return west_; }
    double south() const { return south_; }
    Eigen::Vector3d vertex(int column, int row) const {
        return {west_ + spacing_ * column, south_ + spacing_ * row,
                heights_[static_cast<std::size_t>(row * (side_ + 1) + column)]};
    }
    static bool is_cut_to_north_east(int column, int row) { return ((column + row) & 1) == 0; }

    /// Calls visit(triangle) for triangles of cells that overlap a rectangle and have a corner above a height, all
    /// relative to `origin`.
    template <class Real, class Visit>
    void visit(const Eigen::Vector3d& origin, const Vec<Real>& low, const Vec<Real>& high,
               Real above, Visit&& visit) const {
        const auto cell_of = [&](double p, double from) {
            return static_cast<int>(std::clamp(std::floor((p - from) / spacing_), -2.0, 1e9));
        };
        const Real shift_x = Real(west_) - Real(origin.x());
        const Real shift_y = Real(south_) - Real(origin.y());
        const int first_column =
            std::max(cell_of(static_cast<double>(low.x() - shift_x), 0) - 1, 0);
        const int last_column =
            std::min(cell_of(static_cast<double>(high.x() - shift_x), 0) + 1, side_ - 1);
        const int first_row = std::max(cell_of(static_cast<double>(low.y() - shift_y), 0) - 1, 0);
        const int last_row =
            std::min(cell_of(static_cast<double>(high.y() - shift_y), 0) + 1, side_ - 1);
        const auto show = [&](const SoupTriangle<Real>& triangle) {
            if (!is_cut_) return visit(triangle);
            std::vector<Vec<Real>> part(triangle.v.begin(), triangle.v.end());
            part = beyond<Real>(part, 0, 1, Real(extent_.west) - Real(origin.x()));
            part = beyond<Real>(part, 0, -1, Real(extent_.east) - Real(origin.x()));
            part = beyond<Real>(part, 1, 1, Real(extent_.south) - Real(origin.y()));
            part = beyond<Real>(part, 1, -1, Real(extent_.north) - Real(origin.y()));
            for (std::size_t i = 2; i < part.size(); ++i) {
                const Vec<Real> normal = (part[i - 1] - part[0]).cross(part[i] - part[0]);
                if (normal.z() > Real(1e-12))
                    visit(SoupTriangle<Real>{{part[0], part[i - 1], part[i]}});
            }
        };
        const auto corner = [&](int column, int row) {
            return Vec<Real>(shift_x + Real(spacing_) * column, shift_y + Real(spacing_) * row,
                             Real(heights_[static_cast<std::size_t>(row * (side_ + 1) + column)]) -
                                 Real(origin.z()));
        };
        for (int row = first_row; row <= last_row; ++row) {
            for (int column = first_column; column <= last_column; ++column) {
                if (!is_cell_[index(column, row)]) continue;
                if (Real(highest_[index(column, row)]) - Real(origin.z()) < above) continue;
                const Vec<Real> sw = corner(column, row), se = corner(column + 1, row);
                const Vec<Real> nw = corner(column, row + 1), ne = corner(column + 1, row + 1);
                if (is_cut_to_north_east(column, row)) {
                    show(SoupTriangle<Real>{{sw, se, ne}});
                    show(SoupTriangle<Real>{{sw, ne, nw}});
                } else {
                    show(SoupTriangle<Real>{{sw, se, nw}});
                    show(SoupTriangle<Real>{{se, ne, nw}});
                }
            }
        }
    }

private:
    std::size_t index(int column, int row) const {
        return static_cast<std::size_t>(row * side_ + column);
    }
    /// The part of a polygon on one side of an edge of the extent.
    template <class Real>
    static std::vector<Vec<Real>> beyond(const std::vector<Vec<Real>>& polygon, int axis, int sign,
                                         Real edge) {
        std::vector<Vec<Real>> part;
        for (std::size_t i = 0; i < polygon.size(); ++i) {
            const Vec<Real>& a = polygon[i];
            const Vec<Real>& b = polygon[(i + 1) % polygon.size()];
            const Real at_a = sign * (a[axis] - edge), at_b = sign * (b[axis] - edge);
            if (at_a >= 0) part.push_back(a);
            if ((at_a < 0) != (at_b < 0)) part.push_back(a + at_a / (at_a - at_b) * (b - a));
        }
        return part;
    }

    WorldRect extent_;
    bool is_cut_ = false;  // whether an edge of the extent is no line between cells

    int side_ = 0;  // cells
    double spacing_ = 1.0;
    double west_ = 0.0, south_ = 0.0;
    std::vector<double> heights_;
    std::vector<double> highest_;  // highest corner of each cell
    std::vector<bool> is_cell_;
};

/// All points within `radius` of the convex hull of `points`.
struct OraclePart {
    std::vector<Eigen::Vector3d> points;                ///< body frame
    std::vector<std::array<std::size_t, 2>> edges;      ///< contain all edges of the hull
    std::vector<std::array<std::size_t, 3>> triangles;  ///< cover all faces of the hull
    double radius = 0.0;
};

/// A shape of the oracles: a union of rounded hulls, each found by testing all triples of points.
struct OracleShape {
    std::vector<OraclePart> parts;
};

/// The oracle of any shape. Parts with a radius have a core of one or two points.
OracleShape make_oracle(const Shape& shape);

/// The oracle of the hull of points, found without the library.
OracleShape make_hull_oracle(std::vector<Eigen::Vector3d> points);

/// A part at its pose, relative to the pose's translation minus an offset.
template <class Real>
struct PosedPart {
    const OraclePart* part = nullptr;
    std::vector<Vec<Real>> points;
    Vec<Real> low, high;  ///< bounds, including the radius

    PosedPart(const OraclePart& of, const Eigen::Matrix3d& rotation, const Vec<Real>& offset)
        : part(&of) {
        points.reserve(of.points.size());
        for (const Eigen::Vector3d& p : of.points) {
            points.push_back(rotation.cast<Real>() * p.cast<Real>() + offset);
            low = points.size() == 1 ? points[0] : Vec<Real>(low.cwiseMin(points.back()));
            high = points.size() == 1 ? points[0] : Vec<Real>(high.cwiseMax(points.back()));
        }
        low.array() -= Real(of.radius);
        high.array() += Real(of.radius);
    }
};

}  // namespace terrane::test
