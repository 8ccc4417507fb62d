// SPDX-License-Identifier: MIT
#include "level_set/shapes.h"

#include "base/aabb_tree.h"
#include "base/settings_check.h"

#include <terrane/base/text.h>
#include <terrane/volume/volume_shapes.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace terrane {
namespace {

constexpr double kMostSize = 1e5;         // metres
constexpr double kMostPosition = 0x1p38;  // metres, as heights
constexpr std::size_t kMostPathPoints = std::size_t{1} << 20;
constexpr std::size_t kMostTriangles = std::size_t{1} << 22;

Result<void> check_size(const char* name, double value, bool may_be_zero) {
    if (value <= kMostSize && (value > 0.0 || (may_be_zero && value == 0.0))) return {};
    return fail(ErrorCode::invalid_argument,
                std::string(name) +
                    (may_be_zero ? " must be 0 to" : " must be above 0 and at most") +
                    " 1e+05 m, got " + number_text(value));
}

Result<void> check_points(const char* name, const std::vector<Eigen::Vector3d>& points) {
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            // also false for NaN
            if (std::abs(points[i][axis]) <= kMostSize) continue;
            return fail(ErrorCode::invalid_argument,
                        std::string(name) + "[" + number_text(i) +
                            "] must be within 1e+05 m of the origin, got " +
                            number_text(points[i][axis]));
        }
    }
    return {};
}

struct ShapeCheck {
    Result<void> operator()(const VolumeSphere& sphere) const {
        return check_size("radius", sphere.radius, false);
    }
    Result<void> operator()(const VolumeCapsule& capsule) const {
        TERRANE_TRY(check_size("radius", capsule.radius, false));
        return check_size("half_height", capsule.half_height, true);
    }
    Result<void> operator()(const VolumeBox& box) const {
        for (int axis = 0; axis < 3; ++axis) {
            TERRANE_TRY(check_size("half_extents", box.half_extents[axis], false));
        }
        return {};
    }
    Result<void> operator()(const VolumeTube& tube) const {
        if (tube.path_shape.empty() || tube.path_shape.size() > kMostPathPoints) {
            return fail(ErrorCode::invalid_argument, "path must have 1 to 1048576 points, got " +
                                                         number_text(tube.path_shape.size()));
        }
        TERRANE_TRY(check_points("path", tube.path_shape));
        return check_size("radius", tube.radius, false);
    }
    Result<void> operator()(const VolumeMesh& mesh) const {
        if (mesh.triangles.empty() || mesh.triangles.size() > kMostTriangles) {
            return fail(ErrorCode::invalid_argument,
                        "a mesh must have 1 to 4194304 triangles, got " +
                            number_text(mesh.triangles.size()));
        }
        for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
            for (const std::uint32_t point : mesh.triangles[i]) {
                if (point < mesh.points_shape.size()) continue;
                return fail(ErrorCode::invalid_argument, "triangle " + number_text(i) +
                                                             " of a mesh names point " +
                                                             number_text(point) + " of " +
                                                             number_text(mesh.points_shape.size()));
            }
        }
        return check_points("points", mesh.points_shape);
    }
    Result<void> operator()(const VolumeFile& file) const {
        if (!file.path.empty()) return {};
        return fail(ErrorCode::invalid_argument, "a file's path is empty");
    }
};

Result<void> check_pose(const Pose& pose) {
    for (int row = 0; row < 3; ++row) {
        if (!std::isfinite(pose.translation[row]) ||
            std::abs(pose.translation[row]) > kMostPosition) {
            return fail(ErrorCode::invalid_argument, "position must be within 2^38 m, got " +
                                                         number_text(pose.translation[row]));
        }
    }
    const Eigen::Matrix3d& r = pose.rotation;
    double worst = 0.0;
    for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) {
            const double product = r(0, a) * r(0, b) + r(1, a) * r(1, b) + r(2, a) * r(2, b);
            const double off = std::abs(product - (a == b ? 1.0 : 0.0));
            worst = off <= worst ? worst : off;  // propagates NaN
        }
    }
    const double determinant = r(0, 0) * (r(1, 1) * r(2, 2) - r(1, 2) * r(2, 1)) -
                               r(0, 1) * (r(1, 0) * r(2, 2) - r(1, 2) * r(2, 0)) +
                               r(0, 2) * (r(1, 0) * r(2, 1) - r(1, 1) * r(2, 0));
    if (worst <= 1e-6 && determinant > 0.0) return {};
    return fail(ErrorCode::invalid_argument,
                "rotation must be orthonormal to 1e-6 with determinant 1, is off by " +
                    number_text(worst) + " with determinant " + number_text(determinant));
}

}  // namespace

Result<void> VolumeOperation::validate() const {
    if (!(voxel > 0.0) || voxel > kMostSize) {
        return fail(ErrorCode::invalid_argument,
                    "voxel must be above 0 and at most 1e+05 m, got " + number_text(voxel));
    }
    TERRANE_TRY(std::visit(ShapeCheck{}, shape));
    return check_pose(world_from_shape);
}

}  // namespace terrane

namespace terrane::internal {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using TrianglePair = std::pair<std::uint32_t, std::uint32_t>;

Result<void> check_edges(const VolumeMesh& mesh) {
    using Edge = std::pair<std::uint32_t, std::uint32_t>;
    std::vector<Edge> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (const Triangle& triangle : mesh.triangles) {
        for (std::size_t i = 0; i < 3; ++i) edges.emplace_back(triangle[i], triangle[(i + 1) % 3]);
    }
    std::ranges::sort(edges);
    for (std::size_t i = 0; i < edges.size(); ++i) {
        const Edge& edge = edges[i];
        const char* fault = nullptr;
        if (edge.first == edge.second) fault = "has no length";
        if (i > 0 && edges[i - 1] == edge) fault = "has two triangles on one side";
        if (!std::ranges::binary_search(edges, Edge{edge.second, edge.first}))
            fault = "has one triangle";
        if (fault == nullptr) continue;
        return fail(ErrorCode::bad_data, "the mesh is not closed: its edge from point " +
                                             number_text(edge.first) + " to " +
                                             number_text(edge.second) + " " + fault);
    }
    return {};
}

/// Finds two triangles such that an edge of one passes through the other. Tests only triangles whose boxes overlap.
class CrossingSearch {
public:
    explicit CrossingSearch(const VolumeMesh& mesh)
        : mesh_(mesh), boxes_(mesh.triangles.size(), empty_box()) {
        for (std::size_t i = 0; i < boxes_.size(); ++i) {
            for (const std::uint32_t p : mesh.triangles[i])
                include(mesh.points_shape[p], 0.0, boxes_[i]);
        }
    }

    std::optional<TrianglePair> find() const {
        const std::vector<AabbNode> tree = make_aabb_tree(boxes_);
        std::optional<TrianglePair> found;
        for (std::uint32_t i = 0; i < boxes_.size() && !found; ++i) {
            visit_leaves(
                tree, [&](const Aabb& box) { return !found && overlap(box, boxes_[i], 0.0); },
                [&](std::uint32_t j) {
                    if (i < j && (pierces(i, j) || pierces(j, i))) found = TrianglePair{i, j};
                });
        }
        return found;
    }

private:
    // Whether an edge of one triangle passes through the interior of another. Edges that share a point with it do not.
    bool pierces(std::uint32_t with_edges, std::uint32_t through) const {
        const Triangle& t = mesh_.triangles[through];
        for (std::size_t i = 0; i < 3; ++i) {
            const std::uint32_t p = mesh_.triangles[with_edges][i],
                                q = mesh_.triangles[with_edges][(i + 1) % 3];
            if (std::ranges::find(t, p) != t.end() || std::ranges::find(t, q) != t.end()) continue;
            if (side(t[0], t[1], t[2], p) * side(t[0], t[1], t[2], q) >= 0) continue;
            const int first = side(p, q, t[0], t[1]);
            if (first != 0 && first == side(p, q, t[1], t[2]) && first == side(p, q, t[2], t[0]))
                return true;
        }
        return false;
    }

    // Sign of the volume of a tetrahedron; 0 if rounding could decide it.
    int side(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) const {
        const Eigen::Vector3d& origin = mesh_.points_shape[a];
        const Eigen::Vector3d u = mesh_.points_shape[b] - origin,
                              v = mesh_.points_shape[c] - origin;
        const Eigen::Vector3d w = mesh_.points_shape[d] - origin;
        const double volume = dot(cross(u, v), w);
        const double noise = 1e-12 * u.lpNorm<1>() * v.lpNorm<1>() * w.lpNorm<1>();
        return volume > noise ? 1 : volume < -noise ? -1 : 0;
    }

    const VolumeMesh& mesh_;
    std::vector<Aabb> boxes_;
};

Eigen::Vector3d doubled_area(const VolumeMesh& mesh, const Triangle& triangle) {
    const Eigen::Vector3d& a = mesh.points_shape[triangle[0]];
    return cross(mesh.points_shape[triangle[1]] - a, mesh.points_shape[triangle[2]] - a);
}

}  // namespace

Result<void> check_closed(const VolumeMesh& mesh) {
    TERRANE_TRY(check_edges(mesh));
    if (const auto pair = CrossingSearch(mesh).find()) {
        return fail(ErrorCode::bad_data,
                    "the mesh crosses itself: an edge of triangle " + number_text(pair->first) +
                        " or " + number_text(pair->second) + " passes through the other");
    }
    double volume = 0.0;
    for (const Triangle& triangle : mesh.triangles) {
        const Eigen::Vector3d from =
            mesh.points_shape[triangle[0]] - mesh.points_shape[mesh.triangles[0][0]];
        volume += dot(from, doubled_area(mesh, triangle)) / 6.0;
    }
    if (volume > 0.0) return {};
    return fail(ErrorCode::bad_data,
                "the mesh is inside out or empty: its volume is " + number_text(volume) + " m^3");
}

namespace {

/// [triangles] number of the shell, counted from 0 in the order of the first triangles.
std::vector<std::uint32_t> shells_of(const VolumeMesh& mesh) {
    const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
    // every edge has one triangle in each direction: sorted by their points, the two are neighbours
    std::vector<std::array<std::uint32_t, 3>> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (std::uint32_t i = 0; i < count; ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
            const auto [low, high] =
                std::minmax(mesh.triangles[i][k], mesh.triangles[i][(k + 1) % 3]);
            edges.push_back({low, high, i});
        }
    }
    std::ranges::sort(edges);
    std::vector<std::uint32_t> parent(count);
    for (std::uint32_t i = 0; i < count; ++i) parent[i] = i;
    const auto root_of = [&](std::uint32_t i) {
        while (parent[i] != i) i = parent[i] = parent[parent[i]];
        return i;
    };
    for (std::size_t i = 1; i < edges.size(); i += 2) {
        const auto [low, high] = std::minmax({root_of(edges[i - 1][2]), root_of(edges[i][2])});
        parent[high] = low;
    }
    std::vector<std::uint32_t> shells(count);
    std::uint32_t shell_count = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::uint32_t root = root_of(i);
        shells[i] = root == i ? shell_count++ : shells[root];
    }
    return shells;
}

/// Finds the shells that contain a point, by the triangles above it.
class ShellSearch {
public:
    ShellSearch(const VolumeMesh& mesh, const std::vector<std::uint32_t>& shells)
        : mesh_(mesh), shells_(shells), boxes_(mesh.triangles.size(), empty_box()) {
        for (std::size_t i = 0; i < boxes_.size(); ++i) {
            for (const std::uint32_t p : mesh.triangles[i])
                include(mesh.points_shape[p], 0.0, boxes_[i]);
        }
        tree_ = make_aabb_tree(boxes_);
    }

    /// Number of shells other than `own` around a point; absent if the point lies on one of them.
    std::optional<std::size_t> count_around(const Eigen::Vector3d& p, std::uint32_t own) const {
        std::vector<std::pair<std::uint32_t, int>> crossings;  // shell, direction of its triangle
        bool is_clear = true;
        const auto may_be_above = [&](const Aabb& box) {
            return box.low.x() <= p.x() && p.x() <= box.high.x() && box.low.y() <= p.y() &&
                   p.y() <= box.high.y() && p.z() <= box.high.z();
        };
        visit_leaves(tree_, may_be_above, [&](std::uint32_t i) {
            if (shells_[i] == own) return;
            const int way = way_around(mesh_.triangles[i], p);
            if (way == 0) return;
            const int side = side_of(mesh_.triangles[i], p);
            if (side == 0) is_clear = false;
            if (side == -way) crossings.emplace_back(shells_[i], way);
        });
        if (!is_clear) return std::nullopt;
        std::ranges::sort(crossings);
        std::size_t count = 0;
        for (std::size_t i = 0; i < crossings.size();) {
            int winding = 0;
            const std::uint32_t shell = crossings[i].first;
            for (; i < crossings.size() && crossings[i].first == shell; ++i)
                winding += crossings[i].second;
            if (winding != 0) ++count;
        }
        return count;
    }

private:
    /// 1 or -1 if the triangle, seen from above, winds around the point counter-clockwise or clockwise; otherwise 0.
    /// Of two triangles at an edge exactly one owns it: their sides there are computed from the same end.
    int way_around(const Triangle& triangle, const Eigen::Vector3d& p) const {
        int winding = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t from = triangle[k], to = triangle[(k + 1) % 3];
            const Eigen::Vector3d &a = mesh_.points_shape[std::min(from, to)],
                                  &b = mesh_.points_shape[std::max(from, to)];
            if ((a.y() <= p.y()) == (b.y() <= p.y())) continue;
            const bool is_upward = a.y() <= p.y();
            const double turn =
                (b.x() - a.x()) * (p.y() - a.y()) - (b.y() - a.y()) * (p.x() - a.x());
            // the ray to the right of the point crosses the edge
            if (is_upward != (turn > 0.0)) continue;
            winding += is_upward == (from < to) ? 1 : -1;
        }
        return winding;
    }

    /// Sign of the distance in front of a triangle's plane; 0 if rounding could decide it.
    int side_of(const Triangle& triangle, const Eigen::Vector3d& p) const {
        const Eigen::Vector3d& a = mesh_.points_shape[triangle[0]];
        const Eigen::Vector3d u = mesh_.points_shape[triangle[1]] - a,
                              v = mesh_.points_shape[triangle[2]] - a, w = p - a;
        const double volume = dot(cross(u, v), w);
        const double noise = 1e-12 * u.lpNorm<1>() * v.lpNorm<1>() * w.lpNorm<1>();
        return volume > noise ? 1 : volume < -noise ? -1 : 0;
    }

    const VolumeMesh& mesh_;
    const std::vector<std::uint32_t>& shells_;
    std::vector<Aabb> boxes_;
    std::vector<AabbNode> tree_;
};

}  // namespace

Result<std::vector<std::vector<Triangle>>> nested_shells(const VolumeMesh& mesh) {
    const std::vector<std::uint32_t> shells = shells_of(mesh);
    const std::size_t shell_count = std::size_t{*std::ranges::max_element(shells)} + 1;
    if (shell_count == 1) return std::vector<std::vector<Triangle>>{mesh.triangles};
    std::vector<double> volumes(shell_count);
    std::vector<std::vector<std::uint32_t>> members(shell_count);
    for (std::uint32_t i = 0; i < shells.size(); ++i) {
        members[shells[i]].push_back(i);
        // relative to a point of the shell, for the rounding of a small one far from the origin
        const std::uint32_t origin = mesh.triangles[members[shells[i]].front()][0];
        volumes[shells[i]] +=
            dot(mesh.points_shape[mesh.triangles[i][0]] - mesh.points_shape[origin],
                doubled_area(mesh, mesh.triangles[i]));
    }
    const ShellSearch search(mesh, shells);
    std::vector<std::vector<Triangle>> layers;
    for (std::uint32_t shell = 0; shell < shell_count; ++shell) {
        // shells do not cross, so that any point that is on no other shell will do
        std::optional<std::size_t> depth;
        Eigen::Vector3d p;
        for (std::size_t i = 0; i < members[shell].size() && !depth; ++i) {
            const Triangle& t = mesh.triangles[members[shell][i]];
            p = (mesh.points_shape[t[0]] + mesh.points_shape[t[1]] + mesh.points_shape[t[2]]) / 3.0;
            depth = search.count_around(p, shell);
        }
        const auto refuse = [&](const char* fault) {
            return fail(ErrorCode::bad_data, "the shell of the mesh at [" + number_text(p[0]) +
                                                 ", " + number_text(p[1]) + ", " +
                                                 number_text(p[2]) + "] " + fault);
        };
        if (!depth) return refuse("touches another one everywhere");
        const bool is_cavity = *depth % 2 == 1;
        if (is_cavity && volumes[shell] > 0.0)
            return refuse(
                "is inside the solid, but its triangles do not face inwards as a cavity's");
        if (!is_cavity && !(volumes[shell] > 0.0))
            return refuse("is inside out: its triangles do not face outwards");
        if (*depth >= layers.size()) layers.resize(*depth + 1);
        for (const std::uint32_t i : members[shell]) layers[*depth].push_back(mesh.triangles[i]);
    }
    return layers;
}

double surface_area(const VolumeMesh& mesh) {
    double area = 0.0;
    for (const Triangle& triangle : mesh.triangles) {
        const Eigen::Vector3d doubled = doubled_area(mesh, triangle);
        area += 0.5 * std::sqrt(dot(doubled, doubled));
    }
    return area;
}

// Signed distances in closed form.
// Source: C. Ericson. Real-time collision detection. 2005, sections 5.1.2 (segment) and 5.1.4 (box).

namespace {

CapsulePart make_capsule(const Eigen::Vector3d& from_world, const Eigen::Vector3d& to_world,
                         double radius) {
    const Eigen::Vector3d along = to_world - from_world;
    const double square = dot(along, along);
    return {from_world, along, square > 0.0 ? 1.0 / square : 0.0, radius};
}

Eigen::Vector3d to_place(const Pose& pose, const Eigen::Vector3d& p_shape) {
    return rotated(pose.rotation, p_shape) + pose.translation;
}

}  // namespace

double signed_distance(const CapsulePart& part, const Eigen::Vector3d& p_world) {
    const Eigen::Vector3d p = p_world - part.from_world;
    const double t = std::clamp(dot(p, part.along) * part.inverse_square, 0.0, 1.0);
    const Eigen::Vector3d off = p - t * part.along;
    return std::sqrt(dot(off, off)) - part.radius;
}

double signed_distance(const BoxPart& part, const Eigen::Vector3d& p_world) {
    const Eigen::Vector3d p = rotated_back(part.world_from_box, p_world - part.centre_world);
    Eigen::Vector3d beyond;
    double largest = -std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
        const double excess = std::abs(p[axis]) - part.half_extents[axis];
        largest = std::max(largest, excess);
        beyond[axis] = std::max(excess, 0.0);
    }
    return largest <= 0.0 ? largest : std::sqrt(dot(beyond, beyond));
}

ExactShape ExactShape::place(const VolumeOperation& operation) {
    const Pose& pose = operation.world_from_shape;
    ExactShape shape;
    if (const auto* sphere = std::get_if<VolumeSphere>(&operation.shape)) {
        shape.capsules.push_back(make_capsule(pose.translation, pose.translation, sphere->radius));
    } else if (const auto* capsule = std::get_if<VolumeCapsule>(&operation.shape)) {
        const Eigen::Vector3d end(0.0, 0.0, capsule->half_height);
        shape.capsules.push_back(
            make_capsule(to_place(pose, -end), to_place(pose, end), capsule->radius));
    } else if (const auto* box = std::get_if<VolumeBox>(&operation.shape)) {
        shape.boxes.push_back({pose.rotation, pose.translation, box->half_extents});
    } else if (const auto* tube = std::get_if<VolumeTube>(&operation.shape)) {
        const std::size_t count = tube->path_shape.size();
        for (std::size_t i = 0; i < std::max<std::size_t>(count - 1, 1); ++i) {
            shape.capsules.push_back(make_capsule(
                to_place(pose, tube->path_shape[i]),
                to_place(pose, tube->path_shape[std::min(i + 1, count - 1)]), tube->radius));
        }
    }
    return shape;
}

Aabb ExactShape::bounds() const {
    Aabb box = empty_box();
    for (const CapsulePart& part : capsules) {
        include(part.from_world, part.radius, box);
        include(part.from_world + part.along, part.radius, box);
    }
    for (const BoxPart& part : boxes) {
        for (int corner = 0; corner < 8; ++corner) {
            const Eigen::Vector3d& half = part.half_extents;
            const Eigen::Vector3d offset((corner & 1) != 0 ? half[0] : -half[0],
                                         (corner & 2) != 0 ? half[1] : -half[1],
                                         (corner & 4) != 0 ? half[2] : -half[2]);
            include(part.centre_world + rotated(part.world_from_box, offset), 0.0, box);
        }
    }
    return box;
}

double ExactShape::thickness() const {
    return boxes.empty() ? 2.0 * capsules.front().radius
                         : 2.0 * boxes.front().half_extents.minCoeff();
}

double ExactShape::signed_distance(const Eigen::Vector3d& p_world) const {
    double least = std::numeric_limits<double>::infinity();
    for (std::uint32_t part = 0; part < part_count(); ++part) {
        least = std::min(least, part_distance(part, p_world));
    }
    return least;
}

namespace {

constexpr std::uint64_t kMostItems = std::uint64_t{1} << 24;  // of a list in an untrusted file

void put_vector(ByteWriter& out, const Eigen::Vector3d& v) {
    for (int axis = 0; axis < 3; ++axis) out.put(v[axis]);
}

Eigen::Vector3d get_vector(ByteReader& in) {
    Eigen::Vector3d v;
    for (int axis = 0; axis < 3; ++axis) v[axis] = in.get<double>();
    return v;
}

void put_points(ByteWriter& out, const std::vector<Eigen::Vector3d>& points) {
    out.put(static_cast<std::uint64_t>(points.size()));
    for (const Eigen::Vector3d& p : points) put_vector(out, p);
}

std::vector<Eigen::Vector3d> get_points(ByteReader& in) {
    const auto count = in.get<std::uint64_t>();
    std::vector<Eigen::Vector3d> points;
    for (std::uint64_t i = 0; i < count && count <= kMostItems && !in.has_failed(); ++i)
        points.push_back(get_vector(in));
    return points;
}

void put_shape(ByteWriter& out, const VolumeSphere& shape) { out.put(shape.radius); }
void put_shape(ByteWriter& out, const VolumeCapsule& shape) {
    out.put(shape.radius);
    out.put(shape.half_height);
}
void put_shape(ByteWriter& out, const VolumeBox& shape) { put_vector(out, shape.half_extents); }
void put_shape(ByteWriter& out, const VolumeTube& shape) {
    out.put(shape.radius);
    put_points(out, shape.path_shape);
}
void put_shape(ByteWriter& out, const VolumeMesh& shape) {
    put_points(out, shape.points_shape);
    out.put(static_cast<std::uint64_t>(shape.triangles.size()));
    for (const auto& triangle : shape.triangles)
        out.put_each(std::span<const std::uint32_t>(triangle));
}
void put_shape(ByteWriter& out, const VolumeFile& shape) {
    out.put_text(shape.path);
    out.put_text(shape.grid);
}

std::optional<VolumeShape> get_shape(ByteReader& in, std::uint8_t kind) {
    switch (kind) {
        case 0:
            return VolumeSphere{in.get<double>()};
        case 1: {
            VolumeCapsule shape;
            shape.radius = in.get<double>();
            shape.half_height = in.get<double>();
            return shape;
        }
        case 2:
            return VolumeBox{get_vector(in)};
        case 3: {
            VolumeTube shape;
            shape.radius = in.get<double>();
            shape.path_shape = get_points(in);
            return shape;
        }
        case 4: {
            VolumeMesh shape;
            shape.points_shape = get_points(in);
            const auto count = in.get<std::uint64_t>();
            for (std::uint64_t i = 0; i < count && count <= kMostItems && !in.has_failed(); ++i)
                in.get_each(std::span<std::uint32_t>(shape.triangles.emplace_back()));
            return shape;
        }
        case 5: {
            VolumeFile shape;
            shape.path = in.get_text();
            shape.grid = in.get_text();
            return shape;
        }
        default:
            return std::nullopt;
    }
}

}  // namespace

void put(ByteWriter& out, const VolumeOperation& operation) {
    out.put(static_cast<std::uint8_t>(operation.op));
    out.put(static_cast<std::uint8_t>(operation.shape.index()));
    std::visit([&](const auto& shape) { put_shape(out, shape); }, operation.shape);
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
            out.put(operation.world_from_shape.rotation(row, column));
    }
    put_vector(out, operation.world_from_shape.translation);
    out.put(operation.voxel);
}

std::optional<VolumeOperation> get_operation(ByteReader& in) {
    VolumeOperation operation;
    const auto op = in.get<std::uint8_t>();
    if (op > static_cast<std::uint8_t>(VolumeOp::add)) return std::nullopt;
    operation.op = static_cast<VolumeOp>(op);
    auto shape = get_shape(in, in.get<std::uint8_t>());
    if (!shape) return std::nullopt;
    operation.shape = std::move(*shape);
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
            operation.world_from_shape.rotation(row, column) = in.get<double>();
    }
    operation.world_from_shape.translation = get_vector(in);
    operation.voxel = in.get<double>();
    if (in.has_failed()) return std::nullopt;
    return operation;
}

}  // namespace terrane::internal
