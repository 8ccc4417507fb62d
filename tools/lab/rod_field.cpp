// SPDX-License-Identifier: MIT
#include "lab/rod_field.h"

#include "lab/measure.h"
#include "program/geometry.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>

namespace terrane::tools {

const char* name_of(CullTest test) {
    constexpr std::array kNames{"none", "spheres", "boxes", "exact boxes", "triangles"};
    return kNames[static_cast<std::size_t>(test)];
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

View RodField::usual_view() {
    View view;
    view.width_px = 640;
    view.height_px = 360;
    view.vertical_fov = 0.6;
    return view;
}

RodField::RodField(TriangleMesh mesh, const Aabb& box, std::size_t count, double far_away,
                   bool is_quick)
    : mesh_(std::move(mesh)) {
    BodyRandom random(11, 0);
    for (std::size_t i = 0; i < count; ++i) {
        Pose pose;
        pose.rotation = random.rotation();
        const Eigen::Vector3d way = random.direction();
        pose.translation = random.within(0.0, far_away) * way;
        poses_.push_back(pose);
        boxes_.push_back(transform(pose, 1.0, box));
        balls_.push_back(bounding_sphere(boxes_.back()));
    }
    Result<GlContext> context = GlContext::create();
    if (!context || (is_quick && context->is_software())) return;
    RendererSettings settings;
    settings.sample_count = 1;
    const View view = usual_view();
    Result<TerrainRenderer> renderer =
        TerrainRenderer::create(*context, view.width_px, view.height_px, settings);
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

Result<FieldFrame> RodField::make_frame(CullTest test, const View& view) const {
    FieldFrame frame;
    const Stopwatch culling(Clock::wall);
    const ViewVolume volume(view);
    std::vector<ObjectInstance> instances;
    for (std::size_t i = 0; i < poses_.size(); ++i) {
        if (!is_kept(test, volume, i)) continue;
        const LocalVec offset = to_local(poses_[i].translation, view.eye_world);
        const Quaternion q = quaternion_from_matrix(poses_[i].rotation);
        instances.push_back({.offset_eye = {offset.x(), offset.y(), offset.z()},
                             .rotation = {static_cast<float>(q[1]), static_cast<float>(q[2]),
                                          static_cast<float>(q[3]), static_cast<float>(q[0])}});
    }
    frame.kept = instances.size();
    frame.cull_ms = culling.ms();
    frame.draw_ms = std::numeric_limits<double>::quiet_NaN();
    if (device_ == nullptr) return frame;
    device_->context.make_current();
    const MeshDraw draw = {device_->mesh, 0, 0, static_cast<std::uint32_t>(instances.size())};
    const Stopwatch drawing(Clock::wall);
    TERRANE_TRY(device_->renderer.draw({}, view, {.instances = instances, .meshes = {&draw, 1}}));
    device_->renderer.read();
    frame.draw_ms = drawing.ms();
    return frame;
}

}  // namespace terrane::tools
