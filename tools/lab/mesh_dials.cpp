// SPDX-License-Identifier: MIT
#include "lab/dial.h"
#include "lab/rod_field.h"
#include "program/geometry.h"

#include <terrane/collision/collision_proxy.h>
#include <terrane/collision/shape_pairs.h>
#include <terrane/collision/shapes.h>
#include <terrane/terrain/simplify.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

// The mesh with each triangle cut into four; new corners lie on the unit sphere.
TriangleMesh subdivided(const TriangleMesh& mesh) {
    TriangleMesh fine;
    fine.positions = mesh.positions;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
        const auto [entry, is_new] = middles.try_emplace(
            std::minmax(a, b), static_cast<std::uint32_t>(fine.positions.size()));
        if (is_new) {
            fine.positions.emplace_back((mesh.positions[a] + mesh.positions[b]).normalized());
        }
        return entry->second;
    };
    for (const TriangleMesh::Triangle& t : mesh.triangles) {
        const std::uint32_t ab = middle(t[0], t[1]), bc = middle(t[1], t[2]),
                            ca = middle(t[2], t[0]);
        fine.triangles.push_back({t[0], ab, ca});
        fine.triangles.push_back({ab, t[1], bc});
        fine.triangles.push_back({ca, bc, t[2]});
        fine.triangles.push_back({ab, bc, ca});
    }
    return fine;
}

// Random points on the unit sphere: the same in every run.
std::vector<Eigen::Vector3d> sphere_points(std::size_t count) {
    BodyRandom random(5, count);
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = 0; i < count; ++i) points.push_back(random.direction());
    return points;
}

// A closed boulder of about 1 m: a subdivided octahedron with radially displaced corners; 8 * 4^subdivisions triangles.
TriangleMesh make_boulder(int subdivisions) {
    TriangleMesh mesh;
    mesh.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                      {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (int i = 0; i < subdivisions; ++i) mesh = subdivided(mesh);
    constexpr double kRoughness = 0.3;  // largest displacement, relative to the radius
    for (Eigen::Vector3d& p : mesh.positions) {
        // waves in three directions: smooth, so that coarser meshes stay close
        const double wave =
            std::sin(5.0 * p.x() + 1.0) * std::sin(4.0 * p.y() + 2.0) * std::sin(6.0 * p.z() + 0.5);
        p *= 1.0 + kRoughness * wave;
    }
    return mesh;
}

/// The extreme vertex of a convex hull along a direction, by two methods. Both are independent of the library, whose
/// support_distance() chooses one by the number of vertices.
///
/// Source: G. van den Bergen. Collision Detection in Interactive 3D Environments, 2003, 4.3.4 (hill climbing from
/// vertex to vertex along edges). Here it starts at the best of six vertices, the extremes along the axes.
class ExtremeSearch {
public:
    explicit ExtremeSearch(const ConvexHull& hull)
        : vertices_(hull.vertices().begin(), hull.vertices().end()) {
        std::vector<std::vector<std::uint32_t>> neighbours(vertices_.size());
        for (std::size_t face = 0; face < hull.face_count(); ++face) {
            // each edge is in two faces, once in each direction
            const std::span<const std::uint32_t> corners = hull.face(face);
            for (std::size_t i = 0; i < corners.size(); ++i) {
                neighbours[corners[i]].push_back(corners[(i + 1) % corners.size()]);
            }
        }
        for (const std::vector<std::uint32_t>& each : neighbours) {
            first_neighbour_.push_back(static_cast<std::uint32_t>(neighbours_.size()));
            neighbours_.insert(neighbours_.end(), each.begin(), each.end());
        }
        first_neighbour_.push_back(static_cast<std::uint32_t>(neighbours_.size()));
        for (int axis = 0; axis < 3; ++axis) {
            starts_.push_back(by_scan(Eigen::Vector3d::Unit(axis)));
            starts_.push_back(by_scan(-Eigen::Vector3d::Unit(axis)));
        }
    }

    // Compares all vertices. Cost: O(vertices)
    std::uint32_t by_scan(const Eigen::Vector3d& direction) const {
        std::uint32_t best = 0;
        double most = direction.dot(vertices_[0]);
        for (std::uint32_t i = 1; i < vertices_.size(); ++i) {
            const double along = direction.dot(vertices_[i]);
            if (along <= most) continue;
            most = along;
            best = i;
        }
        return best;
    }

    // Climbs along edges until no neighbour is farther. Cost: O(sqrt(vertices)) for evenly spaced vertices
    std::uint32_t by_climb(const Eigen::Vector3d& direction) const {
        std::uint32_t best = starts_[0];
        double most = direction.dot(vertices_[best]);
        for (const std::uint32_t start : starts_) {
            const double along = direction.dot(vertices_[start]);
            if (along <= most) continue;
            most = along;
            best = start;
        }
        for (bool climbs = true; climbs;) {
            climbs = false;
            const std::uint32_t from = best;
            for (std::uint32_t i = first_neighbour_[from]; i < first_neighbour_[from + 1]; ++i) {
                const double along = direction.dot(vertices_[neighbours_[i]]);
                if (along <= most) continue;
                most = along;
                best = neighbours_[i];
                climbs = true;
            }
        }
        return best;
    }

private:
    std::vector<Eigen::Vector3d> vertices_;
    std::vector<std::uint32_t> first_neighbour_;  // [vertices + 1] into neighbours_
    std::vector<std::uint32_t> neighbours_;
    std::vector<std::uint32_t> starts_;
};

CommandResult<TradeTrial> extreme_trial(std::size_t vertices) {
    TERRANE_TRY(const ConvexHull hull, ConvexHull::create(sphere_points(vertices)));
    const auto measure = [search = std::make_shared<const ExtremeSearch>(hull), shape = Shape(hull),
                          directions = sphere_points(256)]() -> CommandResult<TradeSample> {
        const auto time_ns = [&](const auto& of) {
            return time_call_ns(directions.size(),
                                [&](std::size_t i) { return of(directions[i]); });
        };
        using Vector = Eigen::Vector3d;
        return TradeSample{time_ns([&](const Vector& d) { return search->by_scan(d); }),
                           time_ns([&](const Vector& d) { return search->by_climb(d); }),
                           time_ns([&](const Vector& d) { return support_distance(shape, d); })};
    };
    return TradeTrial{fmt::format("{}", vertices), measure, static_cast<double>(vertices)};
}

// States up to which number of vertices a scan is faster, and from which on a climb is.
std::vector<std::string> find_break_even(const TradeTable& table) {
    std::vector<double> vertices, gains;
    for (const TradeRow& row : table.rows) {
        vertices.push_back(row.value);
        gains.push_back(row.figures[0].median - row.figures[1].median);  // time that a climb saves
    }
    const std::optional<SignChange> change = find_sign_change(vertices, gains);
    if (!change) return {"Scan and climb do not cross within these numbers of vertices."};
    return {fmt::format(
        "A scan is faster below {} vertices, a climb above {}; between them either may be.",
        change->from, change->to)};
}

Dial extreme_dial() {
    const auto prepare = [](const TradePlace& place) -> TradeTrials {
        const std::vector<std::size_t> counts =
            place.is_quick
                ? std::vector<std::size_t>{8, 24, 64, 200, 800}
                : std::vector<std::size_t>{8,  16, 24, 28, 32, 36,  40,  44,  48,   52,
                                           56, 60, 64, 80, 96, 128, 200, 400, 1000, 3000};
        return make_trials(counts, extreme_trial);
    };
    return {.key = "extremes",
            .title = "Extremal points by scan or climb",
            .axis = "vertices",
            .text =
                "Hulls of random points on a sphere, random directions; a plain scan and a "
                "plain climb, and the library's support function, which chooses one of its own "
                "by the vertices.",
            .needs_terrain = false,
            .columns = {{"scan_ns", "a scan", "ns"},
                        {"climb_ns", "a climb", "ns"},
                        {"support_ns", "support_distance()", "ns"}},
            .prepare = prepare,
            .find = find_break_even};
}

CommandResult<TradeTrial> proxy_trial(const TriangleMesh& mesh, double share) {
    const Stopwatch making(Clock::wall);
    TERRANE_TRY(const CollisionProxy proxy, make_collision_proxy(mesh, {.proxy_error = share}));
    const double make_ms = making.ms();
    const auto measure =
        [shape = Shape(proxy.shape), ways = sphere_points(200), make_ms,
         distance_m = proxy.distance_m,
         parts = static_cast<double>(proxy.shape.parts().size())]() -> CommandResult<TradeSample> {
        const double contact_ns = time_call_ns(ways.size(), [&](std::size_t i) {
            Pose pose;
            pose.translation = 1.25 * ways[i];
            std::array<PairContact, 16> contacts;
            return find_contacts(Sphere{0.3}, pose, shape, {}, 0.0, contacts).count;
        });
        return TradeSample{contact_ns, distance_m, parts, make_ms};
    };
    return TradeTrial{share == 0.0 ? "full" : fmt::format("{:.6g} m", share), measure};
}

Dial proxy_dial() {
    const auto prepare = [](const TradePlace& place) -> TradeTrials {
        const std::vector<double> errors = place.is_quick
                                               ? std::vector{0.0, 0.1, 1.0}
                                               : std::vector{0.0, 0.02, 0.05, 0.1, 0.2, 1.0};
        const TriangleMesh mesh = make_boulder(place.is_quick ? 2 : 3);
        return make_trials(errors, [&](double error) { return proxy_trial(mesh, error); });
    };
    return {.key = "collision-mesh",
            .title = "Collision mesh, from full to one hull",
            .text =
                "Contacts of a sphere of 0.3 m with a boulder of 1 m: its triangles, then hulls "
                "within a certified distance.",
            .needs_terrain = false,
            .columns = {{"contact_ns", "contacts", "ns"},
                        {"distance_m", "certified distance from the mesh", "m"},
                        {"parts", "parts"},
                        {"make_ms", "making it, once", "ms"}},
            .cost = "contact_ns",
            .loss = "distance_m",
            .prepare = prepare};
}

Dial culling_dial() {
    const auto prepare = [](const TradePlace& place) -> TradeTrials {
        const auto field =
            std::make_shared<const RodField>(make_rod_mesh(80), Aabb{{-10, -1, -1}, {10, 1, 1}},
                                             place.is_quick ? 2000 : 20'000, 300.0, place.is_quick);
        TERRANE_TRY(const FieldFrame exact, field->make_frame(CullTest::triangles));
        const std::vector tests(kCullTests.begin(), kCullTests.end());
        return make_trials(tests, [&](CullTest test) {
            const auto measure = [field, test,
                                  in_view = exact.kept]() -> CommandResult<TradeSample> {
                TERRANE_TRY(const FieldFrame frame, field->make_frame(test));
                const auto kept = static_cast<double>(frame.kept);
                const double surplus = ratio_or_zero(kept - static_cast<double>(in_view), kept);
                return TradeSample{frame.cull_ms + frame.draw_ms, frame.cull_ms, frame.draw_ms,
                                   surplus, kept};
            };
            return TradeTrial{name_of(test), measure};
        });
    };
    return {.key = "culling",
            .title = "Culling, from none to exact",
            .text =
                "Rods of 20 x 2 x 2 m up to 300 m around the eye, 80 triangles each. An inexact "
                "test is cheaper, and draws some that are out of view.",
            .needs_terrain = false,
            .columns = {{"frame_ms", "culling and drawing", "ms"},
                        {"cull_ms", "culling", "ms"},
                        {"draw_ms", "drawing until the picture can be read", "ms"},
                        {"surplus_share", "drawn out of view", "share"},
                        {"kept", "drawn"}},
            .cost = "cull_ms",
            .loss = "surplus_share",
            .prepare = prepare};
}

TradeTrials prepare_object_meshes(const TradePlace& place) {
    const TriangleMesh full = make_boulder(place.is_quick ? 4 : 5);
    std::vector<SimplifyLevel> levels;
    for (std::size_t count = full.triangles.size(); count >= 8; count /= 4) {
        levels.push_back({.triangles = count});
    }
    TERRANE_TRY(const auto simplified,
                simplify({.vertices = full.positions, .triangles = full.triangles}, levels));
    return make_trials(simplified, [&](const SimplifiedMesh& level) {
        TriangleMesh mesh = full;
        mesh.triangles = level.triangles;
        const auto triangles = static_cast<double>(level.triangles.size());
        const auto field = std::make_shared<const RodField>(
            std::move(mesh), Aabb{{-1.3, -1.3, -1.3}, {1.3, 1.3, 1.3}},
            place.is_quick ? std::size_t{300} : std::size_t{2000}, 60.0, place.is_quick);
        const auto measure = [field, triangles,
                              error_m = level.error_m]() -> CommandResult<TradeSample> {
            TERRANE_TRY(const FieldFrame frame, field->make_frame(CullTest::spheres));
            return TradeSample{frame.draw_ms, error_m, triangles};
        };
        return TradeTrial{fmt::format("{}", level.triangles.size()), measure, triangles};
    });
}

Dial object_dial() {
    return {.key = "object-mesh",
            .title = "Triangles of an object",
            .axis = "triangles",
            .text =
                "Boulders of 1 m up to 60 m around the eye, simplified within a certified "
                "distance.",
            .needs_terrain = false,
            .columns = {{"draw_ms", "drawing until the picture can be read", "ms"},
                        {"error_m", "certified distance from the full mesh", "m"},
                        {"triangles", "triangles of one"}},
            .cost = "triangles",
            .loss = "error_m",
            .prepare = prepare_object_meshes};
}

}  // namespace

std::vector<Dial> mesh_dials() {
    return {extreme_dial(), proxy_dial(), culling_dial(), object_dial()};
}

}  // namespace terrane::tools
