// SPDX-License-Identifier: MIT
// Queries of two shapes, and of a ray against a shape.
#include "support/input.h"

#include <terrane/collision/shape_pairs.h>

#include <array>
#include <cmath>

using namespace terrane;
using fuzz::is_answer;
using fuzz::is_unit;
using fuzz::require;

namespace {

constexpr double kReach = 16.0;  // metres, of the second shape from the first

void ask_contacts(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b,
                  double margin) {
    std::array<PairContact, 96> contacts;
    const PairContactAnswer found = find_contacts(a, pose_a, b, pose_b, margin, contacts);
    if (!is_answer(found.status)) return;
    require(found.count <= contacts.size(), "contacts fit the buffer");
    for (std::size_t i = 0; i < found.count; ++i) {
        require(contacts[i].point_world.allFinite(), "a contact's point is finite");
        require(is_unit(contacts[i].normal), "a contact's normal is unit");
        require(std::isfinite(contacts[i].depth), "a depth is finite");
    }
    require(!std::isnan(found.least_distance), "the least distance is a number");
}

void ask_distances(const Shape& a, const Pose& pose_a, const Shape& b, const Pose& pose_b) {
    const PairDistanceAnswer distance = signed_distance(a, pose_a, b, pose_b);
    if (!is_answer(distance.status)) return;
    require(std::isfinite(distance.distance), "a distance is finite");
    require(is_unit(distance.normal), "a distance's normal is unit");
    require(distance.point_a_world.allFinite() && distance.point_b_world.allFinite(),
            "witness points are finite");
    const PseudodistanceAnswer cheap = pseudodistance(a, pose_a, b, pose_b);
    require(is_answer(cheap.status) && !std::isnan(cheap.pseudodistance),
            "a pseudodistance is a number");
    const TestAnswer touch = test_contact(a, pose_a, b, pose_b);
    const double between = (pose_a.translation - pose_b.translation).norm();
    const double slack = 1e-9 * (1.0 + bounding_radius(a) + bounding_radius(b) + between);
    require(std::abs(distance.distance) <= slack || touch.is_touching == (distance.distance < 0.0),
            "shapes touch where their distance is not above 0");
}

void ask_cast(const Shape& a, const Motion& motion_a, const Shape& b, const Motion& motion_b,
              const CastSettings& settings) {
    const PairCastAnswer hit = cast(a, motion_a, b, motion_b, settings);
    if (!is_answer(hit.status)) return;
    require(hit.fraction >= 0.0 && hit.fraction <= 1.0, "a fraction is 0 to 1");
    require(hit.count <= hit.contacts.size(), "contacts of a cast fit");
    for (std::size_t i = 0; i < hit.count; ++i) {
        require(hit.contacts[i].point_world.allFinite() && is_unit(hit.contacts[i].normal),
                "the contacts of a cast are finite");
    }
}

void ask_ray(const Shape& shape, const Pose& pose, const WorldPos& from, const WorldPos& to) {
    const ShapeRayAnswer ray = cast_ray(shape, pose, from, to);
    if (!is_answer(ray.status) || !ray.hit) return;
    require(ray.fraction >= 0.0 && ray.fraction <= 1.0, "a ray's fraction is 0 to 1");
    require(ray.point_world.allFinite() && is_unit(ray.normal), "a ray's hit is finite");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::Input input(data, size);
    const Shape a = fuzz::take_shape(input), b = fuzz::take_shape(input);
    const Motion motion_a = fuzz::take_motion(input, -kReach, kReach, kReach);
    const Motion motion_b = fuzz::take_motion(input, -kReach, kReach, kReach);
    const double margin = input.number(0.0, 2.0);
    CastSettings settings;
    settings.skip_separating = input.flag();
    if (input.flag()) settings.tolerance = input.number(0.0, 0.1);
    ask_contacts(a, motion_a.start, b, motion_b.start, margin);
    ask_distances(a, motion_a.start, b, motion_b.start);
    ask_cast(a, motion_a, b, motion_b, settings);
    ask_ray(a, motion_a.start, motion_b.start.translation,
            motion_b.start.translation + motion_b.translation);
    return 0;
}
