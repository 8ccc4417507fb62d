// SPDX-License-Identifier: MIT
#include "query/answers.h"

#include "query/object_picker.h"
#include "query/query_ground.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/shape_pairs.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace terrane::tools {

using Json = nlohmann::ordered_json;

Json as_array(const Eigen::Vector3d& v) { return Json::array({v.x(), v.y(), v.z()}); }

Json as_object(const ShapeFeature& feature) {
    if (feature.second == ShapeFeature::kFace) return {{"face", feature.first}};
    if (feature.second == feature.first) return {{"vertex", feature.first}};
    return {{"edge", Json::array({feature.first, feature.second})}};
}

const char* name_of(QueryStatus status) {
    switch (status) {
        case QueryStatus::ok:
            return "ok";
        case QueryStatus::miss:
            return "miss";
        case QueryStatus::outside:
            return "outside";
        case QueryStatus::truncated:
            return "truncated";
        case QueryStatus::not_resident:
            return "not_resident";
        case QueryStatus::invalid:
            break;
    }
    return "invalid";
}

bool write_fault(QueryStatus status, Json& answer) {
    if (status == QueryStatus::not_resident) {
        answer["status"] = "not_resident";
        return true;
    }
    if (status == QueryStatus::invalid) {
        answer["status"] = "invalid";
        answer["message"] = "the shape or its pose was refused";
        return true;
    }
    return false;
}

namespace {

using Json = nlohmann::ordered_json;

// Upper bound of the number of contacts that find_contacts() finds between two shapes.
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

namespace {

using Json = nlohmann::ordered_json;

// Metres by which the part of a ray near a body is widened: more than the rounding error of coordinates up to 2e9 m.
constexpr double kPartSlack = 2e-6;
// Largest distance of the answer's point from the triangle that the ray hits, relative to the coordinates.
constexpr double kPointSlack = 1e-11;

/// The ray of a pick, with the nearest hit so far.
struct Pick {
    WorldPos from_world = WorldPos::Zero();
    Eigen::Vector3d displacement = Eigen::Vector3d::Zero();
    double fraction = 1.0;  // of the nearest hit, or of the far distance
    Json nearest = Json::object();

    WorldPos at(double t) const { return from_world + t * displacement; }
    void offer(double t, Json answer) {
        fraction = t;
        nearest = std::move(answer);
    }
};

/// Whether a point of the ground is on a triangle of a volume.
bool is_on_volume(const Pick& pick, double fraction, const WorldPos& point_world,
                  const Ground& ground) {
    if (!ground.has_solids()) return false;
    const double slack = kPointSlack * (1.0 + pick.from_world.cwiseAbs().maxCoeff() +
                                        point_world.cwiseAbs().maxCoeff());
    const double range = slack / pick.displacement.norm();
    // tests all chunks around a point on a border
    for (const double x : {point_world.x() - slack, point_world.x() + slack}) {
        for (const double y : {point_world.y() - slack, point_world.y() + slack}) {
            const SolidSurface* solid = ground.solid(ground.column_at(x), ground.row_at(y));
            if (solid == nullptr) continue;
            const auto hit =
                solid->ray(pick.from_world, pick.displacement, fraction - range, fraction + range);
            const auto& parts = solid->triangles().parts;
            if (hit && hit->triangle < parts.size() && parts[hit->triangle] != SolidPart::ground)
                return true;
        }
    }
    return false;
}

/// A hit of the ground.
Json as_json(const RayAnswer& found, bool is_volume) {
    Json json{{"kind", is_volume ? "volume" : "ground"},
              {"point", as_array(found.point_world)},
              {"normal", as_array(found.normal)},
              {"error_m", found.error_m}};
    if (found.filled) json["filled"] = true;
    return json;
}

/// Offers the first hit of the ground. False if required ground is not resident.
bool pick_ground(QueryGround& ground, Pick& pick) {
    const double spacing = ground.ground().spacing();
    const WorldPos end_world = pick.at(pick.fraction);
    const auto part = near_ground(pick.from_world, end_world, ground.source(),
                                  spacing + ground.ground().lattice().quantum);
    if (!part) return true;
    const double begin = part->begin * pick.fraction, end = part->end * pick.fraction;
    const WorldPos from_world = pick.at(begin), to_world = pick.at(end);
    const RayAnswer found = ask_along(ground, from_world, to_world, 0.0,
                                      [&] { return ground.ground().ray(from_world, to_world); });
    if (found.status == QueryStatus::not_resident) return false;
    if (found.status != QueryStatus::ok) return true;
    const double fraction = begin + found.fraction * (end - begin);
    pick.offer(fraction,
               as_json(found, is_on_volume(pick, fraction, found.point_world, ground.ground())));
    return true;
}

void pick_bodies(const std::vector<PlacedBody>& bodies, Pick& pick) {
    const double length = pick.displacement.norm();
    if (length == 0.0) return;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        const Shape& shape = bodies[i].settings.shape;
        const Pose& pose = bodies[i].state.pose;
        // casts only the part near the body, so that the rounding error does not grow with the far distance
        const double middle =
            (pose.translation - pick.from_world).dot(pick.displacement) / (length * length);
        const double half = (bounding_radius(shape) + kPartSlack) / length;
        const double begin = std::max(0.0, middle - half), end = std::min(1.0, middle + half);
        if (!(begin <= end)) continue;
        const ShapeRayAnswer found = cast_ray(shape, pose, pick.at(begin), pick.at(end));
        if (found.status != QueryStatus::ok || !found.hit) continue;
        const double fraction = begin + found.fraction * (end - begin);
        if (!(fraction < pick.fraction)) continue;
        Json answer{{"kind", "body"},
                    {"body", i},
                    {"point", as_array(found.point_world)},
                    {"normal", as_array(found.normal)}};
        if (std::holds_alternative<Compound>(shape)) answer["part"] = found.part;
        pick.offer(fraction, std::move(answer));
    }
}

Json as_json(const PickedObject& found, const SceneObjects& objects) {
    Json json{{"kind", "object"}, {"object", found.entry}, {"mesh", objects.names[found.mesh]}};
    if (found.square) {
        json["square"] = {found.square->x, found.square->y};
        json["index"] = found.index;
    }
    json["position"] = as_array(found.position_world);
    json["scale"] = found.scale;
    json["triangle"] = found.triangle;
    json["point"] = as_array(found.point_world);
    json["normal"] = as_array(found.normal);
    return json;
}

/// Offers the first hit of an object.
Result<void> pick_objects(PickScene& scene, Pick& pick) {
    if (scene.objects == nullptr) return {};
    if (!scene.picker) {
        TERRANE_TRY(ObjectPicker made, ObjectPicker::create(scene.source, *scene.objects));
        scene.picker.emplace(std::move(made));
    }
    TERRANE_TRY(const auto found, scene.picker->ray(pick.from_world, pick.at(1.0), pick.fraction));
    if (found && found->fraction < pick.fraction)
        pick.offer(found->fraction, as_json(*found, *scene.objects));
    return {};
}

/// Offers the first hits of bodies and objects. False, with the answer's status, if objects could not be placed.
bool pick_more(PickScene& scene, Pick& pick, Json& answer) {
    pick_bodies(scene.bodies, pick);
    const Result<void> ok = pick_objects(scene, pick);
    if (ok) return true;
    const bool is_unread = ok.error().code == ErrorCode::io;
    answer["status"] = is_unread ? "not_resident" : "invalid";
    if (!is_unread) answer["message"] = ok.error().message;
    return false;
}

}  // namespace

void answer_pick(const PickQuestion& question, QueryGround& ground, PickScene& scene,
                 Json& answer) {
    Pick pick;
    pick.from_world = question.view.eye_world;
    pick.displacement =
        question.far_distance * direction_through(question.view, question.x_px, question.y_px);
    if (!pick_ground(ground, pick)) {
        answer["status"] = "not_resident";
        return;
    }
    if (!pick_more(scene, pick, answer)) return;
    const bool is_hit = !pick.nearest.empty();
    answer["status"] = is_hit ? "ok" : "miss";
    answer["hit"] = is_hit;
    if (!is_hit) {
        answer["kind"] = "none";
        return;
    }
    answer["distance"] = pick.fraction * question.far_distance;
    answer.update(pick.nearest);
}

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
    if (found.status != QueryStatus::ok) return;
    answer["height"] = found.height;
    answer["normal"] = as_array(found.normal);
    answer["error_m"] = found.error_m;
    if (found.filled) answer["filled"] = true;
    if (const auto surface = ground.ground().surface(question.x, question.y)) {
        answer["friction"] = surface->friction;
    }
}

/// Answers with the first hit of the ground or, in a scene that has them, of a body or an object, in the order of
/// answer_pick().
void answer_ray(const RayQuestion& question, QueryGround& ground, PickScene& scene, Json& answer) {
    const auto short_ray = [&] {
        return ask_along(ground, question.from_world, question.to_world, 0.0, [&] {
            return ground.ground().ray(question.from_world, question.to_world);
        });
    };
    const double length = (question.to_world - question.from_world).head<2>().norm();
    const RayAnswer found =
        length > kLongRay ? long_ray(ground, question.from_world, question.to_world) : short_ray();
    if (found.status != QueryStatus::ok && found.status != QueryStatus::miss) {
        answer["status"] = name_of(found.status);
        return;
    }
    Pick pick{.from_world = question.from_world,
              .displacement = question.to_world - question.from_world};
    if (found.status == QueryStatus::ok) {
        const bool is_volume =
            is_on_volume(pick, found.fraction, found.point_world, ground.ground());
        pick.offer(found.fraction, as_json(found, is_volume));
    }
    if (!pick_more(scene, pick, answer)) return;
    const bool is_hit = !pick.nearest.empty();
    answer["status"] = is_hit ? "ok" : "miss";
    answer["hit"] = is_hit;
    if (!is_hit) return;
    answer["fraction"] = pick.fraction;
    answer.update(pick.nearest);
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

/// Answers with the signed distance. The search radius grows: over ground it starts with the vertical gap, which the
/// lift gives; beyond the extent it starts with the horizontal distance to the extent.
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
    LiftAnswer found{.status = QueryStatus::ok, .lift = -std::numeric_limits<double>::infinity()};
    // does not query far outside the extent, where cell indices would overflow
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
    // at the final pose the touch may be just beyond the tolerance: then the contact of the cast is used
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
        ray->other ? answer_shape_ray(*ray, *ray->other, answer)
                   : answer_ray(*ray, ground, scene, answer);
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
