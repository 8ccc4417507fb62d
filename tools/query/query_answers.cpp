// SPDX-License-Identifier: MIT
#include "query/query_answers.h"

#include "query/answer_values.h"
#include "query/loading/ground_loading.h"
#include "query/loading/long_ray.h"
#include "query/loading/path_clip.h"
#include "query/pair_answers.h"
#include "query/pick_answers.h"

#include <terrane/collision/ground_cast.h>
#include <terrane/collision/ground_contact.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMaxContacts = 4096;

void answer_height(const HeightQuestion& question, QueryGround& ground, Json& answer) {
    const HeightAnswer found = ask_around(ground, WorldPos(question.x, question.y, 0.0), 0.0, [&] {
        return question.below
                   ? ground.ground().height_below(question.x, question.y, *question.below)
                   : ground.ground().height(question.x, question.y);
    });
    answer["status"] = name_of(found.status);
    if (found.status != GroundStatus::ok) return;
    answer["height"] = found.height;
    answer["normal"] = as_array(found.normal);
    answer["error_m"] = found.error_m;
    if (found.filled) answer["filled"] = true;
    if (const auto surface = ground.ground().surface(question.x, question.y)) {
        answer["friction"] = surface->friction;
    }
}

void answer_ray(const RayQuestion& question, QueryGround& ground, Json& answer) {
    const auto short_ray = [&] {
        return ask_along(ground, question.from_world, question.to_world, 0.0, [&] {
            return ground.ground().ray(question.from_world, question.to_world);
        });
    };
    const double length = (question.to_world - question.from_world).head<2>().norm();
    const RayAnswer found =
        length > kLongRay ? long_ray(ground, question.from_world, question.to_world) : short_ray();
    answer["status"] = name_of(found.status);
    if (found.status == GroundStatus::miss) answer["hit"] = false;
    if (found.status != GroundStatus::ok) return;
    answer["hit"] = true;
    answer["fraction"] = found.fraction;
    answer["point"] = as_array(found.point_world);
    answer["normal"] = as_array(found.normal);
    answer["error_m"] = found.error_m;
    if (found.filled) answer["filled"] = true;
}

Json as_json(const Contact& contact) {
    Json json;
    json["point"] = as_array(contact.point_world);
    json["normal"] = as_array(contact.normal);
    json["depth"] = contact.depth;
    json["part"] = contact.part;
    json["feature"] = as_object(contact.feature);
    return json;
}

/// All contacts of a pose, deepest first.
ContactAnswer find_all(const Shape& shape, const Pose& pose, const Ground& ground, double margin,
                       std::vector<Contact>& contacts_out) {
    contacts_out.resize(64);
    for (;;) {
        const ContactAnswer found = find_contacts(shape, pose, ground, margin, contacts_out);
        if (found.status != QueryStatus::truncated || contacts_out.size() >= kMaxContacts) {
            contacts_out.resize(found.count);
            return found;
        }
        contacts_out.resize(2 * contacts_out.size());
    }
}

void write_contacts(const ContactAnswer& found, const std::vector<Contact>& contacts,
                    Json& answer) {
    answer["contacts"] = Json::array();
    for (const Contact& contact : contacts) answer["contacts"].push_back(as_json(contact));
    if (found.status == QueryStatus::truncated) answer["truncated"] = true;
}

void answer_find(const ShapeQuestion& question, double reach, QueryGround& ground, Json& answer) {
    std::vector<Contact> contacts;
    const ContactAnswer found =
        ask_around(ground, question.world_from_shape.translation, reach, [&] {
            return find_all(question.shape, question.world_from_shape, ground.ground(), 0.0,
                            contacts);
        });
    if (write_fault(found.status, answer)) return;
    answer["status"] = "ok";
    answer["hit"] = !contacts.empty();
    write_contacts(found, contacts, answer);
    answer["error_m"] = found.error_m;
}

/// Signed distance, searched within a growing distance: over ground it starts with the vertical gap, which the lift
/// gives; beside the ground with the horizontal distance of the extent.
void answer_distance(const ShapeQuestion& question, double lift, double reach, QueryGround& ground,
                     Json& answer) {
    const WorldPos& centre_world = question.world_from_shape.translation;
    const WorldRect& extent = ground.ground().extent();
    const double beside = distance_beside(centre_world, extent);
    const double spacing = ground.ground().spacing();
    const bool is_over_ground = std::isfinite(lift);
    double within = is_over_ground ? std::abs(lift) + spacing : beside + reach + spacing;
    const double furthest = beside + (extent.east - extent.west) + (extent.north - extent.south) +
                            std::abs(centre_world.z()) + 1e5;
    for (;;) {
        const DistanceAnswer found = ask_around(ground, centre_world, reach + within, [&] {
            return signed_distance(question.shape, question.world_from_shape, ground.ground(),
                                   within);
        });
        if (write_fault(found.status, answer)) return;
        if (found.has_ground) {
            answer["status"] = "ok";
            answer["distance"] = found.distance;
            answer["distance_lower_bound"] = found.distance_lower_bound;
            answer["point"] = as_array(found.point_world);
            answer["normal"] = as_array(found.normal);
            answer["error_m"] = found.error_m;
            return;
        }
        if (within > furthest) break;
        within *= 2.0;
    }
    answer["status"] = "outside";
}

void answer_shape(const ShapeQuestion& question, QueryGround& ground, Json& answer) {
    const WorldPos& centre_world = question.world_from_shape.translation;
    const double reach = bounding_radius(question.shape);
    LiftAnswer found{.status = QueryStatus::complete,
                     .lift = -std::numeric_limits<double>::infinity()};
    // no query far outside the extent, where cell indices would overflow
    if (distance_beside(centre_world, ground.ground().extent()) <= reach) {
        found = ask_around(ground, centre_world, reach, [&] {
            return compute_lift(question.shape, question.world_from_shape, ground.ground());
        });
    }
    if (write_fault(found.status, answer)) return;
    if (question.op == ShapeOp::distance) {
        answer_distance(question, found.lift, reach, ground, answer);
        return;
    }
    if (!std::isfinite(found.lift)) {
        answer["status"] = "outside";
        if (question.op != ShapeOp::pseudodistance) answer["hit"] = false;
        if (question.op == ShapeOp::find) answer["contacts"] = Json::array();
        return;
    }
    if (question.op == ShapeOp::find) {
        answer_find(question, reach, ground, answer);
        return;
    }
    answer["status"] = "ok";
    if (question.op == ShapeOp::test) {
        answer["hit"] = found.lift >= 0.0;
    } else {
        answer["distance"] = -found.lift;
    }
    answer["error_m"] = found.error_m;
}

void answer_cast(const CastQuestion& question, QueryGround& ground, Json& answer) {
    const Motion motion = motion_to(question.start, question.to_world, question.to_rotation);
    CastSettings settings;
    settings.skip_separating = question.skip_separating;
    const double reach = bounding_radius(question.shape) + settings.tolerance;
    const CastAnswer found =
        ask_along(ground, question.start.translation, question.to_world, reach,
                  [&] { return cast(question.shape, motion, ground.ground(), settings); });
    if (write_fault(found.status, answer)) return;
    answer["status"] = found.hit ? "ok" : "miss";
    answer["hit"] = found.hit;
    if (!found.hit) return;
    answer["fraction"] = found.fraction;
    answer["point"] = as_array(found.contact.point_world);
    answer["normal"] = as_array(found.contact.normal);
    const Pose touching = motion.at(found.fraction);
    std::vector<Contact> contacts;
    const ContactAnswer patch = ask_around(ground, touching.translation, reach, [&] {
        return find_all(question.shape, touching, ground.ground(), settings.tolerance, contacts);
    });
    // the cast may report a touch that is just beyond the tolerance at the final pose: use its contact
    if (contacts.empty()) contacts.push_back(found.contact);
    write_contacts(patch, contacts, answer);
    answer["error_m"] = found.error_m;
}

}  // namespace

nlohmann::ordered_json invalid_answer(const std::string& message) {
    Json answer;
    answer["status"] = "invalid";
    answer["message"] = message;
    return answer;
}

nlohmann::ordered_json answer_query(const QueryLine& line, QueryGround& ground, PickScene& scene) {
    Json answer;
    if (line.has_id) answer["id"] = line.id;
    if (!line.question) {
        answer.update(invalid_answer(line.question.error()));
        return answer;
    }
    const Question& question = *line.question;
    if (const auto* height = std::get_if<HeightQuestion>(&question)) {
        answer_height(*height, ground, answer);
    } else if (const auto* ray = std::get_if<RayQuestion>(&question)) {
        ray->other ? answer_shape_ray(*ray, *ray->other, answer) : answer_ray(*ray, ground, answer);
    } else if (const auto* shape = std::get_if<ShapeQuestion>(&question)) {
        shape->other ? answer_pair(*shape, *shape->other, answer)
                     : answer_shape(*shape, ground, answer);
    } else if (const auto* swept = std::get_if<CastQuestion>(&question)) {
        swept->other ? answer_pair_cast(*swept, *swept->other, answer)
                     : answer_cast(*swept, ground, answer);
    } else if (const auto* pick = std::get_if<PickQuestion>(&question)) {
        answer_pick(*pick, ground, scene, answer);
    }
    ground.release();
    return answer;
}

nlohmann::ordered_json answer_query(const QueryLine& line, QueryGround& ground) {
    PickScene nothing;
    return answer_query(line, ground, nothing);
}

}  // namespace terrane::tools
