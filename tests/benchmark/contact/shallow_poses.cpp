// SPDX-License-Identifier: MIT
#include "contact_oracle.h"
#include "contact_workload.h"
#include "support/random.h"
#include "world/solver/body_step.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace terrane::bench {
namespace {

// Nearer than this to the height of first touch, metres: below the oracle's own tolerance.
constexpr double kTouchPrecision = 1e-9;

// Axes of a rectangle that lies on the ground: x and y along its sides, z out of the ground.
Eigen::Matrix3d rotation_along_ground(const ContactOracle& surface, const WorldPos& place,
                                      const Eigen::Vector2d& half, double angle) {
    const Eigen::Vector3d level_x(std::cos(angle), std::sin(angle), 0.0);
    const Eigen::Vector3d level_y(-level_x.y(), level_x.x(), 0.0);
    const auto ground_at = [&](const Eigen::Vector3d& offset) {
        const WorldPos p = place + offset;
        return WorldPos(p.x(), p.y(), surface.height(p.x(), p.y()));
    };
    const Eigen::Vector3d x =
        (ground_at(half.x() * level_x) - ground_at(-half.x() * level_x)).normalized();
    const Eigen::Vector3d along_y = ground_at(half.y() * level_y) - ground_at(-half.y() * level_y);
    const Eigen::Vector3d z = x.cross(along_y).normalized();
    Eigen::Matrix3d rotation;
    rotation << x, z.cross(x), z;
    return rotation;
}

// At rest a box stands on its broad side, and a capsule lies along the ground.
Eigen::Matrix3d resting_rotation(const ContactOracle& surface, const Shape& shape,
                                 const WorldPos& place, double angle) {
    if (const Box* const box = std::get_if<Box>(&shape)) {
        return rotation_along_ground(surface, place, box->half_extents.head<2>(), angle);
    }
    const double half = bounding_radius(shape);
    const Eigen::Matrix3d along =
        rotation_along_ground(surface, place, Eigen::Vector2d(half, half), angle);
    Eigen::Matrix3d lying;
    lying << along.col(1), along.col(2), along.col(0);
    return lying;
}

// The height of the centre at which the shape, from above, first touches the surface.
double find_touching_height(const ContactOracle& surface, const Shape& shape, Pose pose) {
    const WorldPos& centre = pose.translation;
    double inside = surface.height(centre.x(), centre.y());
    double apart = inside + bounding_radius(shape);
    const auto overlaps_at = [&](double z) {
        pose.translation.z() = z;
        return surface.deepest(shape, pose) > 0.0;
    };
    while (overlaps_at(apart)) apart += bounding_radius(shape);
    while (apart - inside > kTouchPrecision) {
        const double middle = 0.5 * (inside + apart);
        (overlaps_at(middle) ? inside : apart) = middle;
    }
    return apart;
}

}  // namespace

ShallowPoses make_shallow_poses(const ContactMap& map, Cut cut, const Shape& shape,
                                std::size_t count, std::uint64_t seed) {
    const ContactOracle surface(map.table, cut);
    const double tolerance = default_contact_tolerance(shape);
    ShallowPoses shallow;
    shallow.margin = internal::kContactMargin * tolerance;
    test::Random random(seed);
    const double border = 2.0 * bounding_radius(shape) + map.table.spacing;
    const std::vector<Pose> places = make_poses(map, count, 0.0, border, seed + 1);
    for (std::size_t i = 0; i < count; ++i) {
        Pose pose = places[i];
        const double angle = random.between(0.0, 2.0 * std::numbers::pi);
        const double gap = random.between(-tolerance, shallow.margin);
        if (i % 2 == 0) pose.rotation = resting_rotation(surface, shape, pose.translation, angle);
        pose.translation.z() = find_touching_height(surface, shape, pose) + gap;
        shallow.poses.push_back(pose);
        shallow.vertical_gaps.push_back(gap);
    }
    return shallow;
}

}  // namespace terrane::bench
