// SPDX-License-Identifier: MIT
// The inequality of culling: does a cheaper, inexact test and the drawing of what it keeps cost less than an exact
// test and the drawing of what is in view? From few objects to many, and from cheap ones to dear ones.
#include "scene/culling/random_views.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/scene/view_volume.h>

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

// Means over the views; each is drawn three times, and the median counts.
Timed measure(Cull cull, const Field& field, const TriangleMesh& mesh, MeshId id,
              TerrainRenderer& renderer, std::span<const View> views) {
    using Clock = std::chrono::steady_clock;
    Timed mean;
    for (const View& view : views) {
        std::array<Timed, 3> times;
        for (Timed& timed : times) {
            const auto start = Clock::now();
            const ViewVolume volume(view);
            std::vector<ObjectInstance> instances;
            for (std::size_t i = 0; i < field.poses.size(); ++i) {
                if (!is_kept(cull, volume, field, i, mesh)) continue;
                const LocalVec offset = to_local(field.poses[i].translation, view.eye_world);
                const Eigen::Quaterniond q(field.poses[i].rotation);
                instances.push_back(
                    {.offset_eye = {offset.x(), offset.y(), offset.z()},
                     .rotation = {static_cast<float>(q.x()), static_cast<float>(q.y()),
                                  static_cast<float>(q.z()), static_cast<float>(q.w())}});
            }
            const auto culled = Clock::now();
            const MeshDraw draw = {id, 0, 0, static_cast<std::uint32_t>(instances.size())};
            if (!renderer.draw({}, view, {}, {.instances = instances, .meshes = {&draw, 1}}))
                std::exit(1);
            renderer.read();
            const auto drawn = Clock::now();
            timed.kept = instances.size();
            timed.cull_ms = std::chrono::duration<double, std::milli>(culled - start).count();
            timed.draw_ms = std::chrono::duration<double, std::milli>(drawn - culled).count();
        }
        std::sort(times.begin(), times.end(),
                  [](const Timed& a, const Timed& b) { return a.total_ms() < b.total_ms(); });
        mean.kept += times[1].kept;
        mean.cull_ms += times[1].cull_ms / static_cast<double>(views.size());
        mean.draw_ms += times[1].draw_ms / static_cast<double>(views.size());
    }
    mean.kept /= views.size();
    return mean;
}

}  // namespace
}  // namespace terrane

int main(int argument_count, char** arguments) {
    using namespace terrane;
    const bool is_quick = argument_count > 1 && std::strcmp(arguments[1], "--quick") == 0;
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
    for (const int objects : is_quick ? std::vector{200} : std::vector{300, 3000, 30000}) {
        const Field field = make_field(objects, 300.0);
        for (const int triangles : is_quick ? std::vector{8} : std::vector{8, 80, 800}) {
            if (objects * triangles > 3'000'000) continue;
            const TriangleMesh mesh = make_rod(triangles);
            const MeshId id = renderer.add_mesh(mesh).value();
            double least = 1e300;
            const char* best = "";
            for (std::size_t i = 0; i < kCulls.size(); ++i) {
                const Timed timed = measure(kCulls[i], field, mesh, id, renderer, views);
                std::printf("%8d %10zu | %-12s %7zu %9.3f %9.3f %9.3f\n", objects,
                            mesh.triangles.size(), kNames[i], timed.kept, timed.cull_ms,
                            timed.draw_ms, timed.total_ms());
                if (timed.total_ms() < least) {
                    least = timed.total_ms();
                    best = kNames[i];
                }
            }
            std::printf("%8d %10zu | cheapest: %s\n", objects, mesh.triangles.size(), best);
            renderer.remove_mesh(id);
        }
    }
    return 0;
}
