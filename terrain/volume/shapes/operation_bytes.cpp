// SPDX-License-Identifier: MIT
#include "shapes/operation_bytes.h"

#include <utility>

namespace terrane::internal {
namespace {

constexpr std::uint64_t kMostItems = std::uint64_t{1}
                                     << 24;  // of a list in a file, which is not trusted

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
