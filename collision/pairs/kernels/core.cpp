// SPDX-License-Identifier: MIT
#include "pairs/kernels/core.h"

namespace terrane::internal {
namespace {

constexpr std::array<Polyhedron::Edge, 1> kSegmentEdges = {
    {{0, 1, Polyhedron::kNoFace, Polyhedron::kNoFace}}};
constexpr std::array<std::uint32_t, 3> kSegmentFirst = {0, 1, 2};
constexpr std::array<std::uint32_t, 2> kSegmentNeighbours = {1, 0};
constexpr std::array<std::uint32_t, 2> kPointFirst = {0, 0};

}  // namespace

Core make_core(const PlacedSphere& sphere, CoreStorage& storage_out) {
    storage_out.ends[0] = Eigen::Vector3d::Zero();
    Core core;
    core.shape.vertices = {storage_out.ends.data(), 1};
    core.shape.first_neighbour = kPointFirst;
    core.rotation = Eigen::Matrix3d::Identity();
    core.centre = sphere.centre;
    core.radius = sphere.radius;
    return core;
}

Core make_core(const PlacedCapsule& capsule, CoreStorage& storage_out) {
    storage_out.ends[0] = -capsule.half_axis;
    storage_out.ends[1] = capsule.half_axis;
    Core core;
    core.shape.vertices = storage_out.ends;
    core.shape.edges = kSegmentEdges;
    core.shape.first_neighbour = kSegmentFirst;
    core.shape.neighbours = kSegmentNeighbours;
    core.rotation = Eigen::Matrix3d::Identity();
    core.centre = capsule.centre;
    core.radius = capsule.radius;
    core.reach = length(capsule.half_axis);
    return core;
}

Core make_core(const PlacedBox& box, CoreStorage& storage_out) {
    // The faces of a box without extent have no meaning: it is a point.
    if (box.half == Eigen::Vector3d::Zero()) {
        Core point = make_core(PlacedSphere{box.centre, 0.0}, storage_out);
        point.rotation = box.rotation;
        return point;
    }
    return {box_polyhedron(box.half, storage_out.box), box.rotation, box.centre, 0.0,
            length(box.half)};
}

Core make_core(const PlacedHull& hull, CoreStorage&) {
    return {hull.shape, hull.rotation, hull.centre, 0.0, hull.reach};
}

}  // namespace terrane::internal
