// SPDX-License-Identifier: MIT
#include "judge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

namespace judge {
namespace {

using Triangle = std::array<Vec, 3>;

/// Twice the signed area in the plane.
double turn(const Vec& a, const Vec& b, const Vec& c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Height of a triangle's plane; `inside` tells whether the point is over the triangle.
double plane_height(const Triangle& t, double x, double y, bool& inside) {
    const Vec p{x, y, 0.0};
    const double area = turn(t[0], t[1], t[2]);
    const double a = turn(t[1], t[2], p) / area, b = turn(t[2], t[0], p) / area;
    const double c = 1.0 - a - b;
    constexpr double kSlack = -1e-12;
    inside = a >= kSlack && b >= kSlack && c >= kSlack;
    return a * t[0].z + b * t[1].z + c * t[2].z;
}

/// Largest of surface minus z for a sphere over one edge: a half circle over a line.
double sphere_over_edge(const Vec& centre, double radius, const Vec& a, const Vec& b) {
    const double dx = b.x - a.x, dy = b.y - a.y;
    const double length = std::sqrt(dx * dx + dy * dy);
    const double along = ((centre.x - a.x) * dx + (centre.y - a.y) * dy) / length;
    const double px = a.x + along * dx / length - centre.x;
    const double py = a.y + along * dy / length - centre.y;
    const double square = radius * radius - px * px - py * py;
    if (square < 0.0) return -1e300;
    const double half = std::sqrt(square);
    const double rise = (b.z - a.z) / length;
    double best = along + rise * half / std::sqrt(1.0 + rise * rise);
    const double low = std::max(0.0, along - half), high = std::min(length, along + half);
    if (low > high) return -1e300;
    best = std::clamp(best, low, high);  // the function is concave
    const double off = best - along;
    return a.z + rise * best - centre.z + std::sqrt(std::max(0.0, square - off * off));
}

double sphere_over_triangle(const Vec& centre, double radius, const Triangle& t) {
    double best = -1e300;
    const Vec u = t[1] - t[0], v = t[2] - t[0];
    const double nz = u.x * v.y - u.y * v.x;
    const double gx = -(u.y * v.z - u.z * v.y) / nz, gy = -(u.z * v.x - u.x * v.z) / nz;
    // The sphere's lowest point along the face's normal.
    const double norm = std::sqrt(1.0 + gx * gx + gy * gy);
    const double x = centre.x + radius * gx / norm, y = centre.y + radius * gy / norm;
    bool inside = false;
    const double height = plane_height(t, x, y, inside);
    if (inside) best = height - (centre.z - radius / norm);
    for (int i = 0; i < 3; ++i) {
        best = std::max(best, sphere_over_edge(centre, radius, t[static_cast<std::size_t>(i)],
                                               t[static_cast<std::size_t>((i + 1) % 3)]));
    }
    return best;
}

/// Maximum over spheres along the core. The value is concave along the core where the sphere is above the triangle, and
/// undefined (very low) elsewhere; a scan finds the defined range.
double capsule_over_triangle(const Body& body, const Triangle& t) {
    const auto at = [&](double u) {
        return sphere_over_triangle(body.centre + u * body.axes[2], body.radius, t);
    };
    if (body.half_height == 0.0) return at(0.0);
    constexpr int kScan = 16;
    int best_index = 0;
    double best = -1e300;
    const double h = body.half_height;
    for (int i = 0; i <= kScan; ++i) {
        const double value = at(h * (2.0 * i / kScan - 1.0));
        if (value > best) {
            best = value;
            best_index = i;
        }
    }
    double low = h * (2.0 * std::max(0, best_index - 1) / kScan - 1.0);
    double high = h * (2.0 * std::min(kScan, best_index + 1) / kScan - 1.0);
    for (int i = 0; i < 60; ++i) {
        const double a = low + (high - low) / 3.0, b = high - (high - low) / 3.0;
        const double value_a = at(a), value_b = at(b);
        best = std::max({best, value_a, value_b});
        (value_a < value_b ? low : high) = value_a < value_b ? a : b;
    }
    return best;
}

Vec to_world(const Body& body, const Vec& p) {
    return body.centre + p.x * body.axes[0] + p.y * body.axes[1] + p.z * body.axes[2];
}

std::vector<Vec> corners_of(const Body& body) {
    std::vector<Vec> corners;
    if (body.kind == ShapeKind::hull) {
        for (const Vec& p : body.points) corners.push_back(to_world(body, p));
    }
    if (body.kind != ShapeKind::box) return corners;
    for (unsigned i = 0; i < 8; ++i) {
        const double sx = i & 1u ? body.half_extents.x : -body.half_extents.x;
        const double sy = i & 2u ? body.half_extents.y : -body.half_extents.y;
        const double sz = i & 4u ? body.half_extents.z : -body.half_extents.z;
        corners.push_back(to_world(body, {sx, sy, sz}));
    }
    return corners;
}

/// Lowest z of a box on a vertical line; false where the line misses it.
bool box_bottom(const Body& body, double x, double y, double& z_out) {
    double low = -1e300, high = 1e300;
    const double half[3] = {body.half_extents.x, body.half_extents.y, body.half_extents.z};
    const Vec start = Vec{x, y, 0.0} - body.centre;
    for (std::size_t i = 0; i < 3; ++i) {
        const double s = dot(body.axes[i], start), d = body.axes[i].z;
        if (std::abs(d) < 1e-14) {
            if (std::abs(s) > half[i]) return false;
            continue;
        }
        const double a = (-half[i] - s) / d, b = (half[i] - s) / d;
        low = std::max(low, std::min(a, b));
        high = std::min(high, std::max(a, b));
    }
    z_out = low;
    return low <= high;
}

/// The same for a hull: all triangles of its corners are inside it, and some of them form its lower surface.
bool hull_bottom(const std::vector<Vec>& corners, double x, double y, double& z_out) {
    bool is_over = false;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        for (std::size_t j = i + 1; j < corners.size(); ++j) {
            for (std::size_t k = j + 1; k < corners.size(); ++k) {
                const Triangle t{corners[i], corners[j], corners[k]};
                if (std::abs(turn(t[0], t[1], t[2])) < 1e-14) continue;
                bool inside = false;
                const double z = plane_height(t, x, y, inside);
                if (!inside || (is_over && z >= z_out)) continue;
                is_over = true;
                z_out = z;
            }
        }
    }
    return is_over;
}

/// Surface and shape are piecewise linear: the maximum is at a vertex of either, or at a crossing of two edges in the
/// plane.
double polyhedron_over_triangle(const Body& body, const std::vector<Vec>& corners,
                                const Triangle& t) {
    double best = -1e300;
    for (const Vec& corner : corners) {
        bool inside = false;
        const double height = plane_height(t, corner.x, corner.y, inside);
        if (inside) best = std::max(best, height - corner.z);
    }
    for (const Vec& vertex : t) {
        double z = 0.0;
        const bool is_over = body.kind == ShapeKind::box
                                 ? box_bottom(body, vertex.x, vertex.y, z)
                                 : hull_bottom(corners, vertex.x, vertex.y, z);
        if (is_over) best = std::max(best, vertex.z - z);
    }
    // all pairs of corners: segments that are no edges are inside the shape and give no larger value
    for (std::size_t i = 0; i < corners.size(); ++i) {
        for (std::size_t j = i + 1; j < corners.size(); ++j) {
            const Vec& a = corners[i];
            const Vec& b = corners[j];
            for (std::size_t k = 0; k < 3; ++k) {
                const Vec& c = t[k];
                const Vec& d = t[(k + 1) % 3];
                const double ux = b.x - a.x, uy = b.y - a.y, vx = d.x - c.x, vy = d.y - c.y;
                const double denominator = ux * vy - uy * vx;
                if (std::abs(denominator) < 1e-14) continue;
                const double s = ((c.x - a.x) * vy - (c.y - a.y) * vx) / denominator;
                const double r = ((c.x - a.x) * uy - (c.y - a.y) * ux) / denominator;
                if (s < 0.0 || s > 1.0 || r < 0.0 || r > 1.0) continue;
                best = std::max(best, c.z + r * (d.z - c.z) - (a.z + s * (b.z - a.z)));
            }
        }
    }
    return best;
}

}  // namespace

double Body::reach() const {
    if (kind == ShapeKind::hull) {
        double square = 0.0;
        for (const Vec& p : points) square = std::max(square, dot(p, p));
        return std::sqrt(square);
    }
    if (kind == ShapeKind::box) return std::sqrt(dot(half_extents, half_extents));
    return radius + half_height;
}

double Body::bottom() const {
    if (kind == ShapeKind::hull) {
        double low = 1e300;
        for (const Vec& p : points) low = std::min(low, to_world(*this, p).z);
        return low;
    }
    if (kind == ShapeKind::capsule) return centre.z - radius - std::abs(axes[2].z) * half_height;
    return centre.z - std::abs(axes[0].z) * half_extents.x - std::abs(axes[1].z) * half_extents.y -
           std::abs(axes[2].z) * half_extents.z;
}

namespace {

/// Maximum of `lift` and the lift of one part.
void add_lift(const Body& body, const Surface& surface, Lift& lift) {
    const double reach = body.reach();
    const std::int64_t west = surface.column_below(body.centre.x - reach);
    const std::int64_t east = surface.column_below(body.centre.x + reach);
    const std::int64_t south = surface.row_below(body.centre.y - reach);
    const std::int64_t north = surface.row_below(body.centre.y + reach);
    const double bottom = body.bottom();
    const std::vector<Vec> corners = corners_of(body);
    for (std::int64_t row = south; row <= north; ++row) {
        for (std::int64_t column = west; column <= east; ++column) {
            Vec corner[4];
            bool known = true;
            double top = -1e300;
            for (int i = 0; i < 4; ++i) {
                const std::int64_t c = column + (i & 1), r = row + (i >> 1);
                const double z = surface.height(c, r);
                known = known && !std::isnan(z);
                corner[i] = {surface.west + static_cast<double>(c) * surface.spacing,
                             surface.south + static_cast<double>(r) * surface.spacing, z};
                top = std::max(top, z);
            }
            if (!known) {
                lift.known = false;
                continue;
            }
            if (top - bottom <= lift.value) continue;
            const bool cut = surface.is_cut_to_north_east(column, row);
            const Triangle triangles[2] = {cut ? Triangle{corner[0], corner[1], corner[3]}
                                               : Triangle{corner[0], corner[1], corner[2]},
                                           cut ? Triangle{corner[0], corner[3], corner[2]}
                                               : Triangle{corner[1], corner[3], corner[2]}};
            for (const Triangle& t : triangles) {
                lift.value = std::max(lift.value, body.kind == ShapeKind::capsule
                                                      ? capsule_over_triangle(body, t)
                                                      : polyhedron_over_triangle(body, corners, t));
            }
        }
    }
}

}  // namespace

Lift compute_lift(std::span<const Body> parts, const Surface& surface) {
    Lift lift;
    for (const Body& part : parts) add_lift(part, surface, lift);
    return lift;
}

double compute_depth(std::span<const Body> parts, const Surface& surface, double lift) {
    double best = lift;  // the vertical translation by the lift always separates
    constexpr int kDirections = 600;
    constexpr int kLengths = 40;
    constexpr double kGoldenTurn = 2.399963229728653;
    for (int i = 0; i < kDirections; ++i) {
        const double z = 1.0 - 2.0 * (i + 0.5) / kDirections;
        const double flat = std::sqrt(1.0 - z * z);
        const Vec direction{flat * std::cos(kGoldenTurn * i), flat * std::sin(kGoldenTurn * i), z};
        for (int k = 1; k < kLengths; ++k) {
            const double length = best * k / kLengths;
            std::vector<Body> moved(parts.begin(), parts.end());
            for (Body& part : moved) part.centre = part.centre + length * direction;
            if (compute_lift(moved, surface).value <= 1e-9) {
                best = length;
                break;
            }
        }
    }
    return best;
}

namespace {

constexpr int kFields = 9;

bool parse(const std::string& line, double (&values)[kFields]) {
    const char* at = line.c_str();
    for (int i = 0; i < kFields; ++i) {
        char* end = nullptr;
        values[i] = std::strtod(at, &end);
        if (end == at || !std::isfinite(values[i])) return false;
        const bool is_last = i + 1 == kFields;
        if (!is_last && *end != ',') return false;
        if (is_last && *end != '\0' && *end != '\r') return false;
        at = end + 1;
    }
    return true;
}

bool place(std::vector<Body>& parts, const double (&v)[kFields]) {
    double w = v[5], x = v[6], y = v[7], z = v[8];
    const double norm = std::sqrt(w * w + x * x + y * y + z * z);
    if (std::abs(norm - 1.0) > 1e-6) return false;
    for (double* const part : {&w, &x, &y, &z}) *part /= norm;
    std::array<Vec, 3> axes;
    axes[0] = {1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)};
    axes[1] = {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)};
    axes[2] = {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)};
    const auto turned = [&](const Vec& p) { return p.x * axes[0] + p.y * axes[1] + p.z * axes[2]; };
    for (Body& part : parts) {
        part.centre = Vec{v[2], v[3], v[4]} + turned(part.centre);
        for (Vec& axis : part.axes) axis = turned(axis);
    }
    return true;
}

struct Verdict {
    double pose[kFields] = {};
    Lift lift;
    double depth = 0.0;
    bool is_known = false;
};

}  // namespace

std::vector<Body> make_drop_body(DropShape shape, std::int64_t body_index) {
    const bool mixed = shape == DropShape::mixed;
    Body body;
    if (shape == DropShape::hull) {
        body.kind = ShapeKind::hull;
        body.points = {{1.2, 0.0, 0.1},  {-0.9, 0.2, 0.0}, {0.0, 1.0, -0.1},
                       {0.1, -0.8, 0.0}, {0.0, 0.1, 0.7},  {0.0, 0.0, -0.6}};
    } else if (shape == DropShape::compound) {
        Body head;
        head.kind = ShapeKind::box;
        head.half_extents = {0.3, 0.8, 0.3};
        head.centre = {1.0, 0.0, 0.0};
        body.radius = 0.2;
        body.half_height = 0.8;
        body.axes = {Vec{0, 1, 0}, Vec{0, 0, 1}, Vec{1, 0, 0}};
        return {head, body};
    } else if (shape == DropShape::box || (mixed && body_index % 3 == 2)) {
        body.kind = ShapeKind::box;
        body.half_extents = {1.0, 2.0, 0.5};
    } else if (shape == DropShape::capsule || (mixed && body_index % 3 == 1)) {
        body.radius = 0.4;
        body.half_height = 0.8;
    }
    return {body};
}

Report judge_trace(std::istream& trace, const Surface& surface, const Settings& settings) {
    Report report;
    std::vector<Verdict> last;  // [body]: an unchanged pose is judged once
    std::string line;
    std::uint64_t line_number = 0;
    while (std::getline(trace, line)) {
        ++line_number;
        if (line_number == 1 && line.rfind("step", 0) == 0) continue;
        if (line.empty()) continue;
        double values[kFields];
        const auto refuse = [&] {
            report.error = "line " + std::to_string(line_number) + " is no pose: " + line;
            return report;
        };
        if (!parse(line, values) || values[1] < 0.0 || values[1] > 1e7) return refuse();
        const auto index = static_cast<std::size_t>(values[1]);
        std::vector<Body> body = make_drop_body(settings.shape, static_cast<std::int64_t>(index));
        if (!place(body, values)) return refuse();
        if (index >= last.size()) last.resize(index + 1);
        Verdict& verdict = last[index];
        if (!verdict.is_known || !std::equal(values + 2, values + kFields, verdict.pose + 2)) {
            if (!verdict.is_known) ++report.bodies;
            std::copy(values, values + kFields, verdict.pose);
            verdict.is_known = true;
            verdict.lift = compute_lift(body, surface);
            verdict.depth = 0.0;
            if (verdict.lift.value > settings.tolerance + settings.slack) {
                verdict.depth = compute_depth(body, surface, verdict.lift.value);
            }
        }
        ++report.poses;
        report.max_lift = std::max(report.max_lift, verdict.lift.value);
        if (verdict.lift.value > 0.0) ++report.touching;
        if (verdict.depth > settings.tolerance + settings.slack) {
            if (report.too_deep++ == 0) report.first_too_deep = line;
            report.max_depth = std::max(report.max_depth, verdict.depth);
        } else if (!verdict.lift.known) {
            ++report.unjudged;
        }
    }
    if (report.poses == 0) report.error = "the trace holds no pose";
    return report;
}

}  // namespace judge
