// SPDX-License-Identifier: MIT
#include "world/body_objects.h"

#include <terrane/collision/shape_pairs.h>

#include <Eigen/Geometry>

#include <optional>
#include <span>

namespace terrane::tools {
namespace {

constexpr float kAsleep = 0.55f;  // brightness of sleeping bodies
constexpr double kBar = 0.08;     // radius of a hull's edges over its bounding radius
constexpr Colour kStatic{0.60f, 0.59f, 0.57f};

/// Appends the solids of a shape, in one colour or, without it, in that of the shape; multiplied by `share`.
class BodyObjects {
public:
    BodyObjects(const std::optional<Colour>& colour, float share, std::vector<DrawnObject>& objects)
        : colour_(colour), share_(share), out_(objects) {}

    void add(const Sphere& sphere, const Pose& pose) {
        out_.push_back({Form::ball, pose, Eigen::Vector3d::Constant(sphere.radius),
                        shade({0.90f, 0.45f, 0.10f})});
    }
    void add(const Capsule& capsule, const Pose& pose) {
        const Colour colour = shade({0.15f, 0.45f, 0.85f});
        out_.push_back(
            {Form::tube, pose, {capsule.radius, capsule.radius, capsule.half_height}, colour});
        for (const double end : {-capsule.half_height, capsule.half_height}) {
            out_.push_back({Form::ball,
                            {pose.rotation, pose * Eigen::Vector3d(0.0, 0.0, end)},
                            Eigen::Vector3d::Constant(capsule.radius),
                            colour});
        }
    }
    void add(const Box& box, const Pose& pose) {
        out_.push_back({Form::box, pose, box.half_extents, shade({0.93f, 0.90f, 0.82f})});
    }
    /// Edges as tubes.
    void add(const ConvexHull& hull, const Pose& pose) {
        const std::span<const Eigen::Vector3d> corners = hull.vertices();
        const double thickness = kBar * bounding_radius(hull);
        for (std::size_t i = 0; i < corners.size(); ++i) {
            for (std::size_t j = i + 1; j < corners.size(); ++j) {
                if (is_edge(hull, corners[i], corners[j])) {
                    add_bar(pose * corners[i], pose * corners[j], thickness);
                }
            }
        }
    }
    void add(const Compound& compound, const Pose& pose) {
        for (const CompoundPart& part : compound.parts()) {
            const Pose& own = part.body_from_part;
            const Pose world{pose.rotation * own.rotation, pose * own.translation};
            std::visit([&](const auto& shape) { add(shape, world); }, part.shape);
        }
    }

private:
    using Form = DrawnObject::Form;

    Colour shade(const Colour& of_shape) const {
        const Colour colour = colour_.value_or(of_shape);
        return {share_ * colour.red, share_ * colour.green, share_ * colour.blue};
    }

    /// Whether the segment between two corners is on the surface: tests its midpoint.
    static bool is_edge(const ConvexHull& hull, const Eigen::Vector3d& a,
                        const Eigen::Vector3d& b) {
        constexpr double kOnSurface = 1e-6;  // of the hull's size
        const Pose middle{Eigen::Matrix3d::Identity(), 0.5 * (a + b)};
        return signed_distance(Sphere{0.0}, middle, hull, {}).distance >
               -kOnSurface * bounding_radius(hull);
    }

    void add_bar(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius) {
        const Eigen::Vector3d along = (b - a).normalized();
        const Eigen::Vector3d side = along.unitOrthogonal();
        Pose pose;
        pose.rotation << side, along.cross(side), along;
        pose.translation = 0.5 * (a + b);
        const Colour colour = shade({0.55f, 0.50f, 0.47f});
        out_.push_back({Form::tube, pose, {radius, radius, 0.5 * (b - a).norm()}, colour});
        out_.push_back({Form::ball,
                        {Eigen::Matrix3d::Identity(), a},
                        Eigen::Vector3d::Constant(radius),
                        colour});
    }

    std::optional<Colour> colour_;
    float share_;
    std::vector<DrawnObject>& out_;
};

}  // namespace

void add_objects(const Shape& shape, const BodyState& state, std::vector<DrawnObject>& objects) {
    const std::optional<Colour> colour =
        state.condition == BodyCondition::fixed ? std::optional(kStatic) : std::nullopt;
    BodyObjects all(colour, state.condition == BodyCondition::asleep ? kAsleep : 1.0f, objects);
    std::visit([&](const auto& each) { all.add(each, state.pose); }, shape);
}

void add_objects(const Shape& shape, const Pose& pose, const Colour& colour,
                 std::vector<DrawnObject>& objects) {
    BodyObjects all(colour, 1.0f, objects);
    std::visit([&](const auto& each) { all.add(each, pose); }, shape);
}

}  // namespace terrane::tools
