// SPDX-License-Identifier: MIT
// The inequality of culling: does a cheaper, inexact test and the drawing of what it keeps cost less than an exact
// test and the drawing of what is in view? From few objects to many, and from cheap ones to dear ones.
//
//   culling_inequality [--quick] [REPORT.html]
#include "assets.h"
#include "flight/report.h"
#include "scene/scene_cases.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/scene/culling.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <numbers>
#include <vector>

namespace terrane {
namespace {

using test::Random;

// Culling test of an object.
enum class Cull { none, spheres, boxes, exact_boxes, triangles };
constexpr std::array kCulls = {Cull::none, Cull::spheres, Cull::boxes, Cull::exact_boxes,
                               Cull::triangles};
constexpr std::array kNames = {"none", "spheres", "boxes", "exact boxes", "triangles"};

struct Timed {
    std::size_t kept = 0;
    double cull_ms = 0.0, draw_ms = 0.0;
    double total_ms() const { return cull_ms + draw_ms; }
};

// A rod about its x axis, closed at its ends by points.
TriangleMesh make_rod(int triangles) {
    const int sides = 4, rings = std::max(1, triangles / (2 * sides));
    TriangleMesh mesh;
    for (int ring = 0; ring <= rings; ++ring) {
        for (int side = 0; side < sides; ++side) {
            const double angle = 2.0 * std::numbers::pi * side / sides;
            mesh.positions.push_back(
                {20.0 * ring / rings - 10.0, std::cos(angle), std::sin(angle)});
        }
    }
    for (int ring = 0; ring < rings; ++ring) {
        for (int side = 0; side < sides; ++side) {
            const auto a = static_cast<std::uint32_t>(sides * ring + side);
            const auto b = static_cast<std::uint32_t>(sides * ring + (side + 1) % sides);
            mesh.triangles.push_back({a, b, b + sides});
            mesh.triangles.push_back({a, b + sides, a + sides});
        }
    }
    return mesh;
}

struct Field {
    std::vector<Pose> poses;
    std::vector<OrientedBox> boxes;
    std::vector<BoundingSphere> spheres;
};

Field make_field(int count, double spread) {
    Random random(11);
    Field field;
    for (int i = 0; i < count; ++i) {
        field.poses.push_back(
            {random.rotation(), random.between(0.0, spread) * random.direction()});
        field.boxes.push_back(transform(field.poses.back(), 1.0, {{-10, -1, -1}, {10, 1, 1}}));
        field.spheres.push_back(bounding_sphere(field.boxes.back()));
    }
    return field;
}

bool is_kept(Cull cull, const ViewVolume& volume, const Field& field, std::size_t i,
             const TriangleMesh& mesh) {
    PlaneState all;
    switch (cull) {
        case Cull::none:
            return true;
        case Cull::spheres:
            return volume.test_planes(field.spheres[i], all) != Containment::outside;
        case Cull::boxes:
            return volume.test_planes(field.boxes[i], all) != Containment::outside;
        case Cull::exact_boxes:
            return volume.test_planes(field.boxes[i], all) != Containment::outside &&
                   volume.meets(field.boxes[i]);
        case Cull::triangles:
            return volume.test_planes(field.boxes[i], all) != Containment::outside &&
                   volume.meets(field.boxes[i]) &&
                   volume.meets_triangles(field.poses[i], 1.0, mesh.positions, mesh.triangles);
    }
    return true;
}

// One frame of one view.
Timed measure_frame(Cull cull, const Field& field, const TriangleMesh& mesh, MeshId id,
                    TerrainRenderer& renderer, const View& view) {
    using Clock = std::chrono::steady_clock;
    const auto start = Clock::now();
    const ViewVolume volume(view);
    std::vector<ObjectInstance> instances;
    for (std::size_t i = 0; i < field.poses.size(); ++i) {
        if (!is_kept(cull, volume, field, i, mesh)) continue;
        const LocalVec offset = to_local(field.poses[i].translation, view.eye_world);
        const Eigen::Quaterniond q(field.poses[i].rotation);
        instances.push_back({.offset_eye = {offset.x(), offset.y(), offset.z()},
                             .rotation = {static_cast<float>(q.x()), static_cast<float>(q.y()),
                                          static_cast<float>(q.z()), static_cast<float>(q.w())}});
    }
    const auto culled = Clock::now();
    const MeshDraw draw = {id, 0, 0, static_cast<std::uint32_t>(instances.size())};
    if (!renderer.draw({}, view, {}, {.instances = instances, .meshes = {&draw, 1}})) std::exit(1);
    renderer.read();
    const auto drawn = Clock::now();
    return {.kept = instances.size(),
            .cull_ms = std::chrono::duration<double, std::milli>(culled - start).count(),
            .draw_ms = std::chrono::duration<double, std::milli>(drawn - culled).count()};
}

// Means over the views of the median of the repetitions. The tests take turns, so that what else the machine does
// affects them alike.
std::array<Timed, kCulls.size()> measure(const Field& field, const TriangleMesh& mesh, MeshId id,
                                         TerrainRenderer& renderer, std::span<const View> views) {
    constexpr std::size_t kRepetitions = 7;
    std::array<Timed, kCulls.size()> means;
    for (const View& view : views) {
        std::array<std::array<Timed, kRepetitions>, kCulls.size()> times;
        for (std::size_t repetition = 0; repetition < kRepetitions; ++repetition) {
            for (std::size_t i = 0; i < kCulls.size(); ++i) {
                const std::size_t test = (i + repetition) % kCulls.size();
                times[test][repetition] =
                    measure_frame(kCulls[test], field, mesh, id, renderer, view);
            }
        }
        for (std::size_t test = 0; test < kCulls.size(); ++test) {
            std::sort(times[test].begin(), times[test].end(),
                      [](const Timed& a, const Timed& b) { return a.total_ms() < b.total_ms(); });
            const Timed& median = times[test][kRepetitions / 2];
            means[test].kept += median.kept;
            means[test].cull_ms += median.cull_ms / static_cast<double>(views.size());
            means[test].draw_ms += median.draw_ms / static_cast<double>(views.size());
        }
    }
    for (Timed& mean : means) mean.kept /= views.size();
    return means;
}

}  // namespace
}  // namespace terrane

int main(int argument_count, char** arguments) {
    using namespace terrane;
    const bool is_quick = argument_count > 1 && std::strcmp(arguments[1], "--quick") == 0;
    const int report = is_quick ? 2 : 1;
    Result<EglContext> context = EglContext::create();
    if (!context) {
        std::printf("skipped: %s\n", context.error().message.c_str());
        return 0;
    }
    RendererSettings settings;
    settings.sample_count = 1;
    TerrainRenderer renderer = TerrainRenderer::create(*context, 640, 360, settings).value();
    std::vector<View> views;
    Random random(5);
    for (int i = 0; i < (is_quick ? 1 : 7); ++i) {
        View view;
        view.eye_world = 20.0 * random.direction();
        const Eigen::Matrix3d rotation = random.rotation();
        view.forward = rotation.col(0);
        view.up = rotation.col(1);
        view.vertical_fov = 0.6;
        view.width_px = 640;
        view.height_px = 360;
        views.push_back(view);
    }
    std::printf("%8s %10s | %-12s %7s %9s %9s %9s\n", "objects", "triangles", "test", "kept",
                "cull ms", "draw ms", "sum ms");
    nlohmann::ordered_json fields = nlohmann::ordered_json::array();
    for (const int objects : is_quick ? std::vector{200} : std::vector{300, 3000, 30000}) {
        const Field field = make_field(objects, 300.0);
        nlohmann::ordered_json points = nlohmann::ordered_json::array();
        for (const int triangles : is_quick ? std::vector{8} : std::vector{8, 24, 80, 240, 800}) {
            if (objects * triangles > 3'000'000) continue;
            const TriangleMesh mesh = make_rod(triangles);
            const MeshId id = renderer.add_mesh(mesh).value();
            double least = 1e300;
            const char* best = "";
            nlohmann::ordered_json tests;
            const auto times = measure(field, mesh, id, renderer, views);
            for (std::size_t i = 0; i < kCulls.size(); ++i) {
                const Timed& timed = times[i];
                std::printf("%8d %10zu | %-12s %7zu %9.3f %9.3f %9.3f\n", objects,
                            mesh.triangles.size(), kNames[i], timed.kept, timed.cull_ms,
                            timed.draw_ms, timed.total_ms());
                tests[kNames[i]] = {
                    {"kept", timed.kept}, {"cull_ms", timed.cull_ms}, {"draw_ms", timed.draw_ms}};
                if (timed.total_ms() < least) {
                    least = timed.total_ms();
                    best = kNames[i];
                }
            }
            std::printf("%8d %10zu | cheapest: %s\n", objects, mesh.triangles.size(), best);
            points.push_back({{"triangles", mesh.triangles.size()}, {"tests", tests}});
            renderer.remove_mesh(id);
        }
        fields.push_back({{"objects", objects}, {"points", points}});
    }
    if (argument_count <= report) return 0;
    const tools::ReportHeader header = {.title = "What a test of culling costs, and what it saves",
                                        .command_line = tools::own_command_line(),
                                        .film = "",
                                        .summary = {{"renderer", context->renderer_name()}}};
    const Result<void> written = tools::write_report(
        arguments[report], header, {{"fields", fields}}, tools::assets::culling_js);
    if (!written) std::fprintf(stderr, "culling_inequality: %s\n", written.error().message.c_str());
    return written ? 0 : 1;
}
