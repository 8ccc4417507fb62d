// SPDX-License-Identifier: MIT
#include "trade/trials/rod_field.h"

#include "query/parsing/quaternion.h"
#include "world/body_random.h"

#include <chrono>
#include <limits>
#include <utility>

namespace terrane::tools {
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

}  // namespace terrane::tools
