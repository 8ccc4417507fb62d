// SPDX-License-Identifier: MIT
#include "query/pair_answers.h"

#include "query/answer_values.h"

#include <terrane/collision/shape_pairs.h>

#include <array>
#include <span>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

// Upper bound of the contacts of find_contacts().
constexpr std::size_t kMaxPairContacts = 128;

Json as_json(const PairContact& contact) {
    Json json;
    json["point"] = as_array(contact.point_world);
    json["normal"] = as_array(contact.normal);
    json["depth"] = contact.depth;
    json["part"] = contact.part_a;
    json["feature"] = as_object(contact.feature_a);
    json["other_part"] = contact.part_b;
    json["other_feature"] = as_object(contact.feature_b);
    return json;
}

void write_contacts(std::span<const PairContact> contacts, Json& answer) {
    answer["contacts"] = Json::array();
    for (const PairContact& contact : contacts) answer["contacts"].push_back(as_json(contact));
}

void answer_find(const ShapeQuestion& question, const OtherShape& other, Json& answer) {
    std::array<PairContact, kMaxPairContacts> contacts;
    const PairContactAnswer found = find_contacts(question.shape, question.world_from_shape,
                                                  other.shape, other.start, 0.0, contacts);
    if (write_fault(found.status, answer)) return;
    answer["status"] = "ok";
    answer["hit"] = found.count > 0;
    write_contacts(std::span(contacts).first(found.count), answer);
    if (found.status == QueryStatus::truncated) answer["truncated"] = true;
}

}  // namespace

Motion motion_to(const Pose& start, const WorldPos& to_world, const Eigen::Matrix3d& to_rotation) {
    return {.start = start,
            .translation = to_world - start.translation,
            .rotation_vector = rotation_vector_between(start.rotation, to_rotation)};
}

void answer_pair(const ShapeQuestion& question, const OtherShape& other, Json& answer) {
    const Shape& a = question.shape;
    const Pose& pose = question.world_from_shape;
    if (question.op == ShapeOp::find) {
        answer_find(question, other, answer);
    } else if (question.op == ShapeOp::test) {
        const TestAnswer found = test_contact(a, pose, other.shape, other.start);
        if (write_fault(found.status, answer)) return;
        answer["status"] = "ok";
        answer["hit"] = found.is_touching;
    } else if (question.op == ShapeOp::distance) {
        const PairDistanceAnswer found = signed_distance(a, pose, other.shape, other.start);
        if (write_fault(found.status, answer)) return;
        answer["status"] = "ok";
        answer["distance"] = found.distance;
        answer["point"] = as_array(found.point_a_world);
        answer["other_point"] = as_array(found.point_b_world);
        answer["normal"] = as_array(found.normal);
        answer["part"] = found.part_a;
        answer["other_part"] = found.part_b;
    } else {
        const PseudodistanceAnswer found = pseudodistance(a, pose, other.shape, other.start);
        if (write_fault(found.status, answer)) return;
        answer["status"] = "ok";
        answer["distance"] = found.pseudodistance;
        answer["normal"] = as_array(found.normal);
    }
}

void answer_pair_cast(const CastQuestion& question, const OtherShape& other, Json& answer) {
    CastSettings settings;
    settings.skip_separating = question.skip_separating;
    const PairCastAnswer found =
        cast(question.shape, motion_to(question.start, question.to_world, question.to_rotation),
             other.shape, motion_to(other.start, other.to_world, other.to_rotation), settings);
    if (write_fault(found.status, answer)) return;
    answer["status"] = found.hit ? "ok" : "miss";
    answer["hit"] = found.hit;
    if (!found.hit) return;
    answer["fraction"] = found.fraction;
    answer["point"] = as_array(found.contacts[0].point_world);
    answer["normal"] = as_array(found.contacts[0].normal);
    write_contacts(std::span(found.contacts).first(found.count), answer);
}

void answer_shape_ray(const RayQuestion& question, const OtherShape& other, Json& answer) {
    const ShapeRayAnswer found =
        cast_ray(other.shape, other.start, question.from_world, question.to_world);
    if (write_fault(found.status, answer)) return;
    answer["status"] = found.hit ? "ok" : "miss";
    answer["hit"] = found.hit;
    if (!found.hit) return;
    answer["fraction"] = found.fraction;
    answer["point"] = as_array(found.point_world);
    answer["normal"] = as_array(found.normal);
    answer["other_part"] = found.part;
}

}  // namespace terrane::tools
