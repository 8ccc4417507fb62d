// SPDX-License-Identifier: MIT
// Queries of a shape and of a ray against difficult grounds. A translation is mostly over the ground, 8 m below to 24 m
// above 0.
#include "support/input.h"

#include <terrane/collision/ground_queries.h>

#include <array>
#include <cmath>

using namespace terrane;
using fuzz::is_answer;
using fuzz::is_unit;
using fuzz::require;

namespace {

constexpr double kLow = -8.0, kHigh = 136.0;

/// A pose over the ground.
Pose lowered(Pose pose) {
    pose.translation.z() = pose.translation.z() / 4.0 - 8.0;
    return pose;
}

void ask_contacts(const Shape& shape, const Pose& pose, const Ground& ground, double margin) {
    std::array<Contact, 32> contacts;
    const ContactAnswer found = find_contacts(shape, pose, ground, margin, contacts);
    const TestAnswer touch = test_contact(shape, pose, ground);
    const LiftAnswer lift = compute_lift(shape, pose, ground);
    if (is_answer(lift.status) && is_answer(touch.status)) {
        require(!std::isnan(lift.lift), "a lift is a number");
        require(touch.is_touching == (lift.lift >= -1e-9), "touching is a lift of at least -1e-9");
    }
    if (!is_answer(found.status)) return;
    require(!std::isnan(found.lift), "the lift of contacts is a number");
    require(found.count <= contacts.size(), "contacts fit the buffer");
    for (std::size_t i = 0; i < found.count; ++i) {
        require(contacts[i].point_world.allFinite(), "a contact's point is finite");
        require(is_unit(contacts[i].normal), "a contact's normal is unit");
        require(contacts[i].depth >= -margin - 1e-6, "a gap is at most the margin");
        require(i == 0 || contacts[i].depth <= contacts[i - 1].depth + 1e-9,
                "contacts are sorted by depth");
    }
}

void ask_distances(const Shape& shape, const Pose& pose, const Ground& ground, double most) {
    const DistanceAnswer distance = signed_distance(shape, pose, ground, most);
    if (is_answer(distance.status) && distance.has_ground) {
        require(std::isfinite(distance.distance), "a distance is finite");
        require(distance.point_world.allFinite(), "the nearest point is finite");
        require(is_unit(distance.normal), "a distance's normal is unit");
        require(distance.distance_lower_bound >= 0.0 &&
                    distance.distance_lower_bound <= std::abs(distance.distance),
                "the lower bound is 0 to the length of the translation");
    }
    const PseudodistanceAnswer cheap = pseudodistance(shape, pose, ground);
    if (is_answer(cheap.status)) {
        require(!std::isnan(cheap.pseudodistance), "a pseudodistance is a number");
        require(is_unit(cheap.normal), "a pseudodistance's normal is unit");
    }
}

void ask_cast(const Shape& shape, const Motion& motion, const Ground& ground,
              const CastSettings& settings) {
    const CastAnswer hit = cast(shape, motion, ground, settings);
    if (!is_answer(hit.status)) return;
    require(hit.fraction >= 0.0 && hit.fraction <= 1.0, "a fraction is 0 to 1");
    if (!hit.hit) return;
    require(hit.contact.point_world.allFinite() && is_unit(hit.contact.normal),
            "the contact of a cast is finite");
    if (hit.started_in_contact || settings.skip_separating) return;
    const LiftAnswer before = compute_lift(shape, motion.at(hit.fraction), ground);
    const double size = 1.0 + bounding_radius(shape);
    require(!is_answer(before.status) || before.lift <= 1e-6 * size,
            "there is no overlap before a hit");
}

void ask_ray(const WorldPos& from, const WorldPos& to, const Ground& ground) {
    const RayAnswer ray = ground.ray(from, to);
    if (ray.status != QueryStatus::ok) return;
    require(ray.fraction >= 0.0 && ray.fraction <= 1.0, "a ray's fraction is 0 to 1");
    require(ray.point_world.allFinite() && is_unit(ray.normal), "a ray's hit is finite");
    const HeightAnswer height = ground.height(ray.point_world.x(), ray.point_world.y());
    require(height.status == QueryStatus::invalid || std::isfinite(height.height),
            "a height is finite");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::Input input(data, size);
    const Ground& ground = fuzz::take_ground(input);
    const Shape shape = fuzz::take_shape(input);
    Motion motion = fuzz::take_motion(input, kLow, kHigh, 64.0);
    motion.start = lowered(motion.start);
    const double margin = input.number(0.0, 2.0), most = input.number(0.0, 32.0);
    CastSettings settings;
    settings.skip_separating = input.flag();
    if (input.flag()) settings.tolerance = input.number(0.0, 0.1);
    ask_contacts(shape, motion.start, ground, margin);
    ask_distances(shape, motion.start, ground, most);
    ask_cast(shape, motion, ground, settings);
    ask_ray(motion.start.translation, motion.start.translation + motion.translation, ground);
    return 0;
}
