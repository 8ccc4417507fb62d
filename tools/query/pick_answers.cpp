// SPDX-License-Identifier: MIT
#include "query/pick_answers.h"

#include "objects/near_ground.h"
#include "query/answer_values.h"
#include "query/loading/ground_loading.h"

#include <terrane/collision/shape_pairs.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

// Metres: widens the part of a ray that is near a body, beyond the rounding of coordinates up to 2e9.
constexpr double kPartSlack = 2e-6;
// Of the coordinates: how far the triangle that a ray met may be from the point of the answer.
constexpr double kPointSlack = 1e-11;

/// The ray of a pick, and its nearest answer so far.
struct Pick {
    WorldPos from_world = WorldPos::Zero();
    Eigen::Vector3d displacement = Eigen::Vector3d::Zero();
    double fraction = 1.0;  // of the nearest answer, or of the far distance
    Json nearest = Json::object();

    WorldPos at(double t) const { return from_world + t * displacement; }
    void take(double t, Json answer) {
        fraction = t;
        nearest = std::move(answer);
    }
};

/// Whether a point of the ground is on a triangle that volumes made.
bool is_on_volume(const Pick& pick, double fraction, const WorldPos& point_world,
                  const Ground& ground) {
    if (!ground.has_solids()) return false;
    const double slack = kPointSlack * (1.0 + pick.from_world.cwiseAbs().maxCoeff() +
                                        point_world.cwiseAbs().maxCoeff());
    const double range = slack / pick.displacement.norm();
    // the chunks around the point, if it is on a border
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

/// False where the ground is needed and not resident.
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
    if (found.status == GroundStatus::not_resident) return false;
    if (found.status != GroundStatus::ok) return true;
    const double fraction = begin + found.fraction * (end - begin);
    const bool is_volume = is_on_volume(pick, fraction, found.point_world, ground.ground());
    Json answer{{"kind", is_volume ? "volume" : "ground"},
                {"point", as_array(found.point_world)},
                {"normal", as_array(found.normal)},
                {"error_m", found.error_m}};
    if (found.filled) answer["filled"] = true;
    pick.take(fraction, std::move(answer));
    return true;
}

void pick_bodies(const std::vector<PlacedBody>& bodies, Pick& pick) {
    const double length = pick.displacement.norm();
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        const Shape& shape = bodies[i].settings.shape;
        const Pose& pose = bodies[i].state.pose;
        // only the part near the body: its rounding does not grow with the far distance
        const double middle =
            (pose.translation - pick.from_world).dot(pick.displacement) / (length * length);
        const double half = (bounding_radius(shape) + kPartSlack) / length;
        const double begin = std::max(0.0, middle - half), end = std::min(1.0, middle + half);
        if (!(begin <= end)) continue;
        const ShapeRayAnswer found = cast_ray(shape, pose, pick.at(begin), pick.at(end));
        if (found.status != QueryStatus::complete || !found.hit) continue;
        const double fraction = begin + found.fraction * (end - begin);
        if (!(fraction < pick.fraction)) continue;
        Json answer{{"kind", "body"},
                    {"body", i},
                    {"point", as_array(found.point_world)},
                    {"normal", as_array(found.normal)}};
        if (std::holds_alternative<Compound>(shape)) answer["part"] = found.part;
        pick.take(fraction, std::move(answer));
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

Result<void> pick_objects(PickScene& scene, Pick& pick) {
    if (scene.objects == nullptr) return {};
    if (!scene.picker) {
        Result<ObjectPicker> made = ObjectPicker::create(scene.heightfield, *scene.objects);
        if (!made) return tl::unexpected(made.error());
        scene.picker.emplace(*std::move(made));
    }
    const auto found = scene.picker->ray(pick.from_world, pick.at(1.0), pick.fraction);
    if (!found) return tl::unexpected(found.error());
    if (*found && (*found)->fraction < pick.fraction)
        pick.take((*found)->fraction, as_json(**found, *scene.objects));
    return {};
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
    pick_bodies(scene.bodies, pick);
    if (const Result<void> ok = pick_objects(scene, pick); !ok) {
        const bool is_unread = ok.error().code == ErrorCode::io;
        answer["status"] = is_unread ? "not_resident" : "invalid";
        if (!is_unread) answer["message"] = ok.error().message;
        return;
    }
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

}  // namespace terrane::tools
