// SPDX-License-Identifier: MIT
#include "base/settings_check.h"

#include <terrane/volume/volume_shapes.h>

#include <cmath>

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
        if (auto ok = check_size("radius", capsule.radius, false); !ok) return ok;
        return check_size("half_height", capsule.half_height, true);
    }
    Result<void> operator()(const VolumeBox& box) const {
        for (int axis = 0; axis < 3; ++axis) {
            if (auto ok = check_size("half_extents", box.half_extents[axis], false); !ok) return ok;
        }
        return {};
    }
    Result<void> operator()(const VolumeTube& tube) const {
        if (tube.path_shape.empty() || tube.path_shape.size() > kMostPathPoints) {
            return fail(ErrorCode::invalid_argument, "path must have 1 to 1048576 points, got " +
                                                         number_text(tube.path_shape.size()));
        }
        if (auto ok = check_points("path", tube.path_shape); !ok) return ok;
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
            worst = off <= worst ? worst : off;  // keeps a NaN
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

Result<void> check(const VolumeOperation& operation) {
    if (!(operation.voxel > 0.0) || operation.voxel > kMostSize) {
        return fail(ErrorCode::invalid_argument, "voxel must be above 0 and at most 1e+05 m, got " +
                                                     number_text(operation.voxel));
    }
    if (auto ok = std::visit(ShapeCheck{}, operation.shape); !ok) return ok;
    return check_pose(operation.world_from_shape);
}

}  // namespace terrane
