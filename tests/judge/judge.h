// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <istream>
#include <limits>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

// The contact surface, implemented independently of the library from its definition.
namespace judge {

struct Vec {
    double x = 0.0, y = 0.0, z = 0.0;
};
inline Vec operator+(const Vec& a, const Vec& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(const Vec& a, const Vec& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator*(double s, const Vec& a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(const Vec& a, const Vec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// Heights at lattice points (column, row), x = west + column * spacing, y = south + row * spacing.
/// A cell is split along its south-west to north-east diagonal where column + row + parity is even, along the other one
/// elsewhere. Cells with a missing height (NaN) have no ground.
class Surface {
public:
    double spacing = 1.0;
    double west = 0.0, south = 0.0;
    int parity = 0;

    void set_point(std::int64_t column, std::int64_t row, double height) {
        points_[{column, row}] = height;
    }

    double height(std::int64_t column, std::int64_t row) const {
        const auto found = points_.find({column, row});
        return found == points_.end() ? std::numeric_limits<double>::quiet_NaN() : found->second;
    }
    bool is_cut_to_north_east(std::int64_t column, std::int64_t row) const {
        return ((column + row + parity) & 1) == 0;
    }
    std::int64_t column_below(double x) const {
        return static_cast<std::int64_t>(std::floor((x - west) / spacing));
    }
    std::int64_t row_below(double y) const {
        return static_cast<std::int64_t>(std::floor((y - south) / spacing));
    }

private:
    struct PairHash {
        std::size_t operator()(const std::pair<std::int64_t, std::int64_t>& p) const {
            const auto mixed = static_cast<std::uint64_t>(p.first) * 0x9e3779b97f4a7c15u ^
                               static_cast<std::uint64_t>(p.second) * 0xc2b2ae3d27d4eb4fu;
            return static_cast<std::size_t>(mixed ^ (mixed >> 31));
        }
    };
    std::unordered_map<std::pair<std::int64_t, std::int64_t>, double, PairHash> points_;
};

enum class ShapeKind { capsule, box, hull };

/// A convex shape at a pose: centre, and axes as columns of a rotation. A body has one or more of them.
struct Body {
    ShapeKind kind = ShapeKind::capsule;
    double radius = 0.5;       ///< of a capsule, metres
    double half_height = 0.0;  ///< of a capsule's core along its z; 0: a sphere
    Vec half_extents;          ///< of a box
    std::vector<Vec> points;   ///< of a hull, relative to its centre, in its axes
    Vec centre;
    std::array<Vec, 3> axes{Vec{1, 0, 0}, Vec{0, 1, 0}, Vec{0, 0, 1}};

    double reach() const;   ///< largest distance of a point from the centre
    double bottom() const;  ///< world z of the lowest point
};

struct Lift {
    bool known = true;  ///< false: heights below the body are missing
    double value =
        0.0;  ///< vertical overlap: largest surface height minus z over the shape, 0 without overlap
};

/// Brute force over every triangle under the bounding square of each part.
Lift compute_lift(std::span<const Body> parts, const Surface& surface);

/// Penetration depth: length of the minimum translation that separates the body from the ground, at most its lift.
/// Searched over sampled directions and lengths: a close upper bound of the true depth.
double compute_depth(std::span<const Body> parts, const Surface& surface, double lift);

/// Shapes of `terrane drop`; mixed: body index modulo 3 is sphere, capsule, box.
enum class DropShape { sphere, capsule, box, hull, compound, mixed };

/// The parts of one body of a drop, at the origin.
std::vector<Body> make_drop_body(DropShape shape, std::int64_t body_index);

struct Settings {
    DropShape shape = DropShape::sphere;
    double tolerance = 0.01;  ///< largest allowed depth, metres
    double slack = 1e-6;      ///< allowance for rounding of trace and heights, metres
};

struct Report {
    std::uint64_t poses = 0;
    std::uint64_t bodies = 0;
    std::uint64_t touching = 0;  ///< poses that overlap the ground
    std::uint64_t too_deep = 0;  ///< poses deeper than tolerance + slack
    std::uint64_t unjudged = 0;  ///< poses with missing heights below that are not too deep
    double max_lift = 0.0;       ///< upper bound of every depth, metres
    double max_depth = 0.0;      ///< of the poses that were too deep, metres; 0 without any
    std::string first_too_deep;  ///< its line in the trace
    std::string error;           ///< where the trace is malformed; "" where it is not
};

/// Judges every pose of a trace: a header, then one line `step,body,x,y,z,qw,qx,qy,qz` per pose.
Report judge_trace(std::istream& trace, const Surface& surface, const Settings& settings);

}  // namespace judge
