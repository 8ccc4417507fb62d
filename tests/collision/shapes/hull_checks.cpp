// SPDX-License-Identifier: MIT
#include "hull_checks.h"

#include "collision/ground/ground_oracle.h"

#include <algorithm>
#include <map>
#include <set>
#include <sstream>
#include <utility>
#include <vector>

namespace terrane::test {
namespace {

using internal::Polyhedron;
using Pair = std::pair<std::uint32_t, std::uint32_t>;

template <class... Parts>
std::string say(const Parts&... parts) {
    std::ostringstream text;
    text.precision(17);
    (text << ... << parts);
    return text.str();
}

std::string find_fault_of_face(const Polyhedron& hull, std::size_t index, double tolerance,
                               std::map<Pair, std::uint32_t>& sides) {
    const Polyhedron::Face& face = hull.faces[index];
    if (face.count < 3) return say("face ", index, " has ", face.count, " corners");
    if (!(std::abs(face.normal.norm() - 1.0) <= 1e-15)) return say("normal of face ", index);
    const auto corner = [&](std::uint32_t i) { return hull.loops[face.first + i % face.count]; };
    Eigen::Vector3d area = Eigen::Vector3d::Zero();
    const double size = (hull.vertices[corner(1)] - hull.vertices[corner(0)]).stableNorm();
    for (std::uint32_t i = 0; i < face.count; ++i) {
        const Eigen::Vector3d& a = hull.vertices[corner(i)];
        const Eigen::Vector3d& b = hull.vertices[corner(i + 1)];
        const Eigen::Vector3d& c = hull.vertices[corner(i + 2)];
        if (!sides.emplace(Pair(corner(i), corner(i + 1)), index).second) {
            return say("side ", corner(i), " ", corner(i + 1), " twice");
        }
        const double above = face.normal.dot(a) - face.offset;
        if (!(above <= 0.0 + 1e-15 * std::abs(face.offset)) || above < -tolerance) {
            return say("vertex ", corner(i), " of face ", index, " lies off it by ", above);
        }
        const double inward = face.normal.dot((c - a).cross(b - a));
        if (inward > tolerance * (c - a).norm()) {
            return say("face ", index, " is dented at vertex ", corner(i + 1), " by ",
                       inward / (c - a).norm());
        }
        const Eigen::Vector3d from_first = a - hull.vertices[corner(0)];
        area += (from_first / size).cross((b - a) / size);
    }
    if (hull.faces.size() > 2 && !(face.normal.dot(area) > 0.0)) {
        return say("face ", index, " is clockwise");
    }
    return {};
}

}  // namespace

std::string find_fault(const Polyhedron& hull, double tolerance) {
    std::map<Pair, std::uint32_t> sides;
    for (std::size_t i = 0; i < hull.faces.size(); ++i) {
        if (std::string fault = find_fault_of_face(hull, i, tolerance, sides); !fault.empty()) {
            return fault;
        }
    }
    const std::size_t count = hull.vertices.size();
    if (hull.faces.size() == 1 || hull.faces.size() == 3) return say(hull.faces.size(), " faces");
    if (hull.faces.size() == 2 && hull.faces[0].normal != -hull.faces[1].normal) return "normals";
    if (hull.faces.empty() && (count > 2 || hull.edges.size() != count - 1)) {
        return say("no face, but ", count, " vertices and ", hull.edges.size(), " edges");
    }
    if (!hull.faces.empty() && sides.size() != 2 * hull.edges.size()) {
        return say(sides.size(), " sides, but ", hull.edges.size(), " edges");
    }
    std::set<Pair> joined;
    Pair last;
    for (const Polyhedron::Edge& edge : hull.edges) {
        const Pair pair(edge.from, edge.to);
        if (edge.from >= edge.to || (!joined.empty() && pair <= last)) return "order of edges";
        last = pair;
        joined.insert(pair);
        joined.insert({edge.to, edge.from});
        if (hull.faces.empty()) continue;
        const auto left = sides.find(pair);
        const auto right = sides.find({edge.to, edge.from});
        if (left == sides.end() || right == sides.end() || left->second != edge.left ||
            right->second != edge.right) {
            return say("faces beside edge ", edge.from, " ", edge.to);
        }
    }
    const auto euler =
        static_cast<long>(count + hull.faces.size()) - static_cast<long>(hull.edges.size());
    if (!hull.faces.empty() && euler != 2) return say("V - E + F is ", euler);

    std::set<Pair> neighbours;
    if (hull.first_neighbour.size() != count + 1) return "size of first_neighbour";
    for (std::uint32_t i = 0; i < count; ++i) {
        for (std::uint32_t k = hull.first_neighbour[i]; k < hull.first_neighbour[i + 1]; ++k) {
            neighbours.insert({i, hull.neighbours[k]});
        }
    }
    if (neighbours != joined) return "neighbours differ from edges";
    return {};
}

std::string find_fault_of_hull(const Polyhedron& hull, std::span<const Eigen::Vector3d> points,
                               double tolerance) {
    for (const Eigen::Vector3d& v : hull.vertices) {
        if (std::find(points.begin(), points.end(), v) == points.end()) {
            return say("vertex ", v.transpose(), " is no point");
        }
    }
    for (std::size_t i = 0; i < hull.faces.size(); ++i) {
        for (const Eigen::Vector3d& p : points) {
            const double above = hull.faces[i].normal.dot(p) - hull.faces[i].offset;
            if (above > tolerance) {
                return say("point ", p.transpose(), " is ", above, " in front of face ", i);
            }
        }
    }
    Random random(17);
    for (int i = 0; i < 500; ++i) {
        Eigen::Vector3d direction = random.direction();
        if (i % 3 == 0 && !hull.faces.empty()) {
            const auto face = static_cast<std::size_t>(
                random.between(0.0, static_cast<double>(hull.faces.size())));
            direction = (hull.faces[face].normal + (i % 2) * 1e-6 * direction).normalized();
        }
        double of_points = -1e300;
        double of_vertices = -1e300;
        for (const Eigen::Vector3d& p : points) of_points = std::max(of_points, direction.dot(p));
        for (const Eigen::Vector3d& v : hull.vertices) {
            of_vertices = std::max(of_vertices, direction.dot(v));
        }
        if (of_points > of_vertices + tolerance) {
            return say("a point reaches ", of_points - of_vertices, " beyond the hull");
        }
    }
    return {};
}

}  // namespace terrane::test
