// SPDX-License-Identifier: MIT
#include "judge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

namespace judge {
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
    w /= norm;
    x /= norm;
    y /= norm;
    z /= norm;
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
        body.kind = ShapeKind::capsule;
        body.radius = 0.2;
        body.half_height = 0.8;
        body.axes = {Vec{0, 1, 0}, Vec{0, 0, 1}, Vec{1, 0, 0}};
        return {head, body};
    } else if (shape == DropShape::box || (mixed && body_index % 3 == 2)) {
        body.kind = ShapeKind::box;
        body.half_extents = {1.0, 2.0, 0.5};
    } else if (shape == DropShape::capsule || (mixed && body_index % 3 == 1)) {
        body.kind = ShapeKind::capsule;
        body.radius = 0.4;
        body.half_height = 0.8;
    } else {
        body.kind = ShapeKind::sphere;
        body.radius = 0.5;
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
