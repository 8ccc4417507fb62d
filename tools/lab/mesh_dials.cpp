// SPDX-License-Identifier: MIT
#include "lab/dial.h"
#include "program/geometry.h"

#include <terrane/base/math.h>
#include <terrane/collision/collision_proxy.h>
#include <terrane/collision/shape_pairs.h>
#include <terrane/collision/shapes.h>
#include <terrane/render/terrain_renderer.h>
#include <terrane/scene/culling.h>
#include <terrane/terrain/simplify.h>
#include <terrane/terrain/triangle_mesh.h>
#include <terrane/terrain/view.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

namespace terrane::tools {

/// Random points on the unit sphere: the same in every run.
std::vector<Eigen::Vector3d> sphere_points(std::size_t count);

/// A closed boulder of about 1 m: a subdivided octahedron with radially displaced corners.
///
/// @param subdivisions 0 to 7: the mesh has 8 * 4^subdivisions triangles
/// @param roughness    largest displacement over the radius, 0 to 0.9
TriangleMesh make_boulder(int subdivisions, double roughness);

/// A rod of 20 x 2 x 2 m about its x axis, with pointed ends.
TriangleMesh make_rod_mesh(int triangles);

/// The extreme vertex of a convex hull along a direction, by two methods. Both are independent of the library, whose
/// support_distance() chooses one by the number of vertices.
///
/// Source: G. van den Bergen. Collision Detection in Interactive 3D Environments, 2003, 4.3.4 (hill climbing from
/// vertex to vertex along edges). Here it starts at the best of six vertices, the extremes along the axes.
class ExtremeSearch {
public:
    explicit ExtremeSearch(const ConvexHull& hull);

    /// Compares all vertices. Cost: O(vertices)
    std::uint32_t by_scan(const Eigen::Vector3d& direction) const;
    /// Climbs along edges until no neighbour is farther. Cost: O(sqrt(vertices)) for even hulls
    std::uint32_t by_climb(const Eigen::Vector3d& direction) const;

private:
    std::vector<Eigen::Vector3d> vertices_;
    std::vector<std::uint32_t> first_neighbour_;  // [vertices + 1] into neighbours_
    std::vector<std::uint32_t> neighbours_;
    std::vector<std::uint32_t> starts_;
};

/// Culling tests, from none to exact.
enum class CullTest {
    none,
    spheres,      ///< ViewVolume::test_planes() of bounding spheres
    boxes,        ///< the same of oriented boxes
    exact_boxes,  ///< and ViewVolume::meets()
    triangles,    ///< and ViewVolume::meets_triangles()
};

/// The tests in order, and their names.
inline constexpr std::array kCullTests{CullTest::none, CullTest::spheres, CullTest::boxes,
                                       CullTest::exact_boxes, CullTest::triangles};
const char* name_of(CullTest test);

/// Cost of a frame.
struct FieldFrame {
    std::size_t kept = 0;
    double cull_ms = 0.0;
    double draw_ms = 0.0;  ///< until the picture can be read; NaN without a device
};

/// Copies of a mesh at random poses around an eye, and a device that draws them, if one can be opened.
class RodField {
public:
    /// @param box      of the mesh
    /// @param far_away largest distance of a copy from the eye, metres
    /// @param is_quick whether to skip drawing on software rasterisers
    RodField(TriangleMesh mesh, const Aabb& box, std::size_t count, double far_away, bool is_quick);

    /// Tests all copies and draws those not culled.
    Result<FieldFrame> make_frame(CullTest test) const;

private:
    struct Device {
        EglContext context;  // the renderer's objects live in it
        TerrainRenderer renderer;
        MeshId mesh;
    };
    bool is_kept(CullTest test, const ViewVolume& volume, std::size_t copy) const;
    void open_device(bool is_quick);

    TriangleMesh mesh_;
    View view_;
    std::vector<Pose> poses_;
    std::vector<OrientedBox> boxes_;
    std::vector<BoundingSphere> balls_;
    std::unique_ptr<Device> device_;  // null: none can be opened
};

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

}  // namespace

std::vector<Eigen::Vector3d> sphere_points(std::size_t count) {
    BodyRandom random(5, count);
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = 0; i < count; ++i) {
        const std::array<double, 3> p = random.direction<3>();
        points.emplace_back(p[0], p[1], p[2]);
    }
    return points;
}

TriangleMesh make_boulder(int subdivisions, double roughness) {
    TriangleMesh mesh;
    mesh.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                      {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (int i = 0; i < subdivisions; ++i) mesh = subdivided(mesh);
    for (Eigen::Vector3d& p : mesh.positions) {
        // waves in three directions: smooth, so that coarser meshes stay close
        const double wave =
            std::sin(5.0 * p.x() + 1.0) * std::sin(4.0 * p.y() + 2.0) * std::sin(6.0 * p.z() + 0.5);
        p *= 1.0 + roughness * wave;
    }
    return mesh;
}

TriangleMesh make_rod_mesh(int triangles) {
    constexpr int kSides = 4;
    const int rings = std::max(1, triangles / (2 * kSides));
    TriangleMesh mesh;
    for (int ring = 0; ring <= rings; ++ring) {
        for (int side = 0; side < kSides; ++side) {
            const double angle = 2.0 * std::numbers::pi * side / kSides;
            mesh.positions.emplace_back(20.0 * ring / rings - 10.0, std::cos(angle),
                                        std::sin(angle));
        }
    }
    for (int ring = 0; ring < rings; ++ring) {
        for (int side = 0; side < kSides; ++side) {
            const auto a = static_cast<std::uint32_t>(kSides * ring + side);
            const auto b = static_cast<std::uint32_t>(kSides * ring + (side + 1) % kSides);
            mesh.triangles.push_back({a, b, b + kSides});
            mesh.triangles.push_back({a, b + kSides, a + kSides});
        }
    }
    return mesh;
}

ExtremeSearch::ExtremeSearch(const ConvexHull& hull)
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

std::uint32_t ExtremeSearch::by_scan(const Eigen::Vector3d& direction) const {
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

std::uint32_t ExtremeSearch::by_climb(const Eigen::Vector3d& direction) const {
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

namespace {

double since_ms(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

}  // namespace

const char* name_of(CullTest test) {
    switch (test) {
        case CullTest::none:
            return "none";
        case CullTest::spheres:
            return "spheres";
        case CullTest::boxes:
            return "boxes";
        case CullTest::exact_boxes:
            return "exact boxes";
        case CullTest::triangles:
            return "triangles";
    }
    return "";
}

RodField::RodField(TriangleMesh mesh, const Aabb& box, std::size_t count, double far_away,
                   bool is_quick)
    : mesh_(std::move(mesh)) {
    view_.width_px = 640;
    view_.height_px = 360;
    view_.vertical_fov = 0.6;
    BodyRandom random(11, 0);
    for (std::size_t i = 0; i < count; ++i) {
        Pose pose;
        pose.rotation = matrix_from_quaternion(random.direction<4>());
        const std::array<double, 3> way = random.direction<3>();
        const double far = random.within(0.0, far_away);
        pose.translation = {far * way[0], far * way[1], far * way[2]};
        poses_.push_back(pose);
        boxes_.push_back(transform(pose, 1.0, box));
        balls_.push_back(bounding_sphere(boxes_.back()));
    }
    open_device(is_quick);
}

void RodField::open_device(bool is_quick) {
    Result<EglContext> context = EglContext::create();
    if (!context || (is_quick && context->is_software())) return;
    RendererSettings settings;
    settings.sample_count = 1;
    Result<TerrainRenderer> renderer =
        TerrainRenderer::create(*context, view_.width_px, view_.height_px, settings);
    if (!renderer) return;
    const Result<MeshId> id = renderer->add_mesh(mesh_);
    if (!id) return;
    device_ = std::make_unique<Device>(Device{std::move(*context), std::move(*renderer), *id});
}

bool RodField::is_kept(CullTest test, const ViewVolume& volume, std::size_t copy) const {
    if (test == CullTest::none) return true;
    PlaneState all;
    if (test == CullTest::spheres) {
        return volume.test_planes(balls_[copy], all) != Containment::outside;
    }
    if (volume.test_planes(boxes_[copy], all) == Containment::outside) return false;
    if (test == CullTest::boxes) return true;
    if (!volume.meets(boxes_[copy])) return false;
    if (test == CullTest::exact_boxes) return true;
    return volume.meets_triangles(poses_[copy], 1.0, mesh_.positions, mesh_.triangles);
}

Result<FieldFrame> RodField::make_frame(CullTest test) const {
    FieldFrame frame;
    auto start = std::chrono::steady_clock::now();
    const ViewVolume volume(view_);
    std::vector<ObjectInstance> instances;
    for (std::size_t i = 0; i < poses_.size(); ++i) {
        if (!is_kept(test, volume, i)) continue;
        const LocalVec offset = to_local(poses_[i].translation, view_.eye_world);
        const Quaternion q = quaternion_from_matrix(poses_[i].rotation);
        instances.push_back({.offset_eye = {offset.x(), offset.y(), offset.z()},
                             .rotation = {static_cast<float>(q[1]), static_cast<float>(q[2]),
                                          static_cast<float>(q[3]), static_cast<float>(q[0])}});
    }
    frame.kept = instances.size();
    frame.cull_ms = since_ms(start);
    frame.draw_ms = std::numeric_limits<double>::quiet_NaN();
    if (device_ == nullptr) return frame;
    device_->context.make_current();
    const MeshDraw draw = {device_->mesh, 0, 0, static_cast<std::uint32_t>(instances.size())};
    start = std::chrono::steady_clock::now();
    const Result<void> drawn =
        device_->renderer.draw({}, view_, {}, {.instances = instances, .meshes = {&draw, 1}});
    if (!drawn) return tl::unexpected(drawn.error());
    device_->renderer.read();
    frame.draw_ms = since_ms(start);
    return frame;
}

namespace {

CommandResult<TradeTrial> extreme_trial(std::size_t vertices) {
    const Result<ConvexHull> hull = ConvexHull::create(sphere_points(vertices));
    if (!hull) return pass_on(hull.error());
    const auto search = std::make_shared<const ExtremeSearch>(*hull);
    const auto directions =
        std::make_shared<const std::vector<Eigen::Vector3d>>(sphere_points(256));
    return TradeTrial{
        .label = fmt::format("{}", vertices),
        .value = static_cast<double>(vertices),
        .command = "",
        .measure = [=, shape = Shape(*hull)]() -> CommandResult<TradeSample> {
            const double scan_ns = time_call_ns(directions->size(), [&](std::size_t i) {
                return search->by_scan((*directions)[i]);
            });
            const double climb_ns = time_call_ns(directions->size(), [&](std::size_t i) {
                return search->by_climb((*directions)[i]);
            });
            const double support_ns = time_call_ns(directions->size(), [&](std::size_t i) {
                return support_distance(shape, (*directions)[i]);
            });
            return TradeSample{scan_ns, climb_ns, support_ns};
        }};
}

// The last crossing of the curves of scan and climb, by linear interpolation.
std::vector<std::string> find_break_even(const TradeTable& table) {
    std::optional<double> crossing;
    for (std::size_t i = 1; i < table.rows.size(); ++i) {
        const auto gain = [&table](std::size_t row) {
            const std::vector<TradeFigure>& figures = table.rows[row].figures;
            return figures[0].median - figures[1].median;  // gain of climb over scan
        };
        const double before = gain(i - 1), after = gain(i);
        if (before >= 0.0 || after < 0.0) continue;
        const double from = table.rows[i - 1].value, to = table.rows[i].value;
        crossing = from + (to - from) * before / (before - after);
    }
    if (!crossing) return {"Scan and climb do not cross within these numbers of vertices."};
    return {fmt::format("A climb is faster than a scan from {:.0f} vertices on.", *crossing)};
}

Dial extreme_dial() {
    Dial dial;
    dial.key = "extremes";
    dial.title = "Extremal points by scan or climb";
    dial.axis = "vertices";
    dial.text =
        "Hulls of random points on a sphere, random directions; a plain scan and a plain climb, "
        "and the library's support function, which chooses one of its own by the vertices.";
    dial.needs_terrain = false;
    dial.columns = {{"scan_ns", "a scan", TradeUnit::ns},
                    {"climb_ns", "a climb", TradeUnit::ns},
                    {"support_ns", "support_distance()", TradeUnit::ns}};
    dial.prepare = [](const TradePlace& place) -> CommandResult<std::vector<TradeTrial>> {
        const std::vector<std::size_t> counts =
            place.is_quick
                ? std::vector<std::size_t>{8, 24, 64, 200, 800}
                : std::vector<std::size_t>{8, 16, 24, 32, 48, 64, 96, 128, 200, 400, 1000, 3000};
        std::vector<TradeTrial> trials;
        for (const std::size_t count : counts) {
            CommandResult<TradeTrial> trial = extreme_trial(count);
            if (!trial) return pass_on(trial.error());
            trials.push_back(std::move(*trial));
        }
        return trials;
    };
    dial.find = find_break_even;
    return dial;
}

CommandResult<TradeTrial> proxy_trial(const TriangleMesh& mesh, double share, std::size_t index) {
    const auto start = std::chrono::steady_clock::now();
    const Result<CollisionProxy> proxy = make_collision_proxy(mesh, {.proxy_error = share});
    if (!proxy) return pass_on(proxy.error());
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - start;
    const auto ways = std::make_shared<const std::vector<Eigen::Vector3d>>(sphere_points(200));
    const double distance_m = proxy->distance_m;
    const auto parts = static_cast<double>(proxy->shape.parts().size());
    return TradeTrial{
        .label = share == 0.0 ? "full" : fmt::format("{:.6g} m", share),
        .value = static_cast<double>(index),
        .command = "",
        .measure = [=, shape = Shape(proxy->shape),
                    make_ms = taken.count()]() -> CommandResult<TradeSample> {
            const double contact_ns = time_call_ns(ways->size(), [&](std::size_t i) {
                Pose pose;
                pose.translation = 1.25 * (*ways)[i];
                std::array<PairContact, 16> contacts;
                return find_contacts(Sphere{0.3}, pose, shape, {}, 0.0, contacts).count;
            });
            return TradeSample{contact_ns, distance_m, parts, make_ms};
        }};
}

Dial proxy_dial() {
    Dial dial;
    dial.key = "collision-mesh";
    dial.title = "Collision mesh, from full to one hull";
    dial.text =
        "Contacts of a sphere of 0.3 m with a boulder of 1 m: its triangles, then hulls within a "
        "certified distance.";
    dial.needs_terrain = false;
    dial.columns = {{"contact_ns", "contacts", TradeUnit::ns},
                    {"distance_m", "certified distance from the mesh", TradeUnit::m},
                    {"parts", "parts", TradeUnit::none},
                    {"make_ms", "making it, once", TradeUnit::ms}};
    dial.cost = "contact_ns";
    dial.loss = "distance_m";
    dial.prepare = [](const TradePlace& place) -> CommandResult<std::vector<TradeTrial>> {
        const TriangleMesh mesh = make_boulder(place.is_quick ? 2 : 3, 0.3);
        const std::vector<double> errors = place.is_quick
                                               ? std::vector{0.0, 0.1, 1.0}
                                               : std::vector{0.0, 0.02, 0.05, 0.1, 0.2, 1.0};
        std::vector<TradeTrial> trials;
        for (std::size_t i = 0; i < errors.size(); ++i) {
            CommandResult<TradeTrial> trial = proxy_trial(mesh, errors[i], i);
            if (!trial) return pass_on(trial.error());
            trials.push_back(std::move(*trial));
        }
        return trials;
    };
    return dial;
}

}  // namespace

std::vector<Dial> hull_dials() { return {extreme_dial(), proxy_dial()}; }

namespace {

Dial culling_dial() {
    Dial dial;
    dial.key = "culling";
    dial.title = "Culling, from none to exact";
    dial.text =
        "Rods of 20 x 2 x 2 m up to 300 m around the eye, 80 triangles each. An inexact test is "
        "cheaper, and draws some that are out of view.";
    dial.needs_terrain = false;
    dial.columns = {{"frame_ms", "culling and drawing", TradeUnit::ms},
                    {"cull_ms", "culling", TradeUnit::ms},
                    {"draw_ms", "drawing until the picture can be read", TradeUnit::ms},
                    {"surplus_share", "drawn out of view", TradeUnit::share},
                    {"kept", "drawn", TradeUnit::none}};
    dial.cost = "cull_ms";
    dial.loss = "surplus_share";
    dial.prepare = [](const TradePlace& place) -> CommandResult<std::vector<TradeTrial>> {
        const auto field =
            std::make_shared<const RodField>(make_rod_mesh(80), Aabb{{-10, -1, -1}, {10, 1, 1}},
                                             place.is_quick ? 2000 : 20'000, 300.0, place.is_quick);
        const Result<FieldFrame> exact = field->make_frame(CullTest::triangles);
        if (!exact) return pass_on(exact.error());
        std::vector<TradeTrial> trials;
        for (const CullTest test : kCullTests) {
            trials.push_back(
                {.label = name_of(test),
                 .value = static_cast<double>(trials.size()),
                 .command = "",
                 .measure = [field, test, in_view = exact->kept]() -> CommandResult<TradeSample> {
                     const Result<FieldFrame> frame = field->make_frame(test);
                     if (!frame) return pass_on(frame.error());
                     const auto kept = static_cast<double>(frame->kept);
                     const double surplus =
                         kept > 0.0 ? (kept - static_cast<double>(in_view)) / kept : 0.0;
                     return TradeSample{frame->cull_ms + frame->draw_ms, frame->cull_ms,
                                        frame->draw_ms, surplus, kept};
                 }});
        }
        return trials;
    };
    return dial;
}

CommandResult<std::vector<TradeTrial>> prepare_object_meshes(const TradePlace& place) {
    const TriangleMesh full = make_boulder(place.is_quick ? 4 : 5, 0.3);
    std::vector<SimplifyLevel> levels;
    for (std::size_t count = full.triangles.size(); count >= 8; count /= 4) {
        levels.push_back({.triangles = count});
    }
    const auto simplified =
        simplify({.vertices = full.positions, .triangles = full.triangles}, levels);
    if (!simplified) return pass_on(simplified.error());
    std::vector<TradeTrial> trials;
    for (const SimplifiedMesh& level : *simplified) {
        TriangleMesh mesh = full;
        mesh.triangles = level.triangles;
        const auto triangles = static_cast<double>(level.triangles.size());
        const auto field = std::make_shared<const RodField>(
            std::move(mesh), Aabb{{-1.3, -1.3, -1.3}, {1.3, 1.3, 1.3}},
            place.is_quick ? std::size_t{300} : std::size_t{2000}, 60.0, place.is_quick);
        trials.push_back({.label = fmt::format("{}", level.triangles.size()),
                          .value = triangles,
                          .command = "",
                          .measure = [field, triangles,
                                      error_m = level.error_m]() -> CommandResult<TradeSample> {
                              const Result<FieldFrame> frame = field->make_frame(CullTest::spheres);
                              if (!frame) return pass_on(frame.error());
                              return TradeSample{frame->draw_ms, error_m, triangles};
                          }});
    }
    return trials;
}

Dial mesh_dial() {
    Dial dial;
    dial.key = "object-mesh";
    dial.title = "Triangles of an object";
    dial.axis = "triangles";
    dial.text =
        "Boulders of 1 m up to 60 m around the eye, simplified within a certified distance.";
    dial.needs_terrain = false;
    dial.columns = {{"draw_ms", "drawing until the picture can be read", TradeUnit::ms},
                    {"error_m", "certified distance from the full mesh", TradeUnit::m},
                    {"triangles", "triangles of one", TradeUnit::none}};
    dial.cost = "triangles";
    dial.loss = "error_m";
    dial.prepare = prepare_object_meshes;
    return dial;
}

}  // namespace

std::vector<Dial> object_dials() { return {culling_dial(), mesh_dial()}; }

}  // namespace terrane::tools
