// SPDX-License-Identifier: MIT
#include "query/parsing/quaternion.h"
#include "trade/dials/dial_list.h"
#include "trade/trials/contact_ground.h"
#include "trade/trials/time_call.h"
#include "world/body_random.h"

#include <terrane/collision/ground_contact.h>
#include <terrane/collision/shape_pairs.h>

#include <fmt/format.h>

#include <array>
#include <functional>
#include <limits>
#include <memory>

namespace terrane::tools {
namespace {

/// A measure of how near two things are: a number for each of the same questions, smaller where they are nearer.
struct NamedMeasure {
    std::string name;
    std::function<double(std::size_t)> of;
};

const std::vector<TradeColumn>& measure_columns() {
    static const std::vector<TradeColumn> columns{
        {"ns", "a question", TradeUnit::ns},
        {"disorder", "pairs ordered unlike the distance", TradeUnit::share}};
    return columns;
}

/// Trials of measures of the same questions; the last measure is the distance, which the others are compared with.
std::vector<TradeTrial> measure_trials(const std::vector<NamedMeasure>& measures,
                                       std::size_t questions) {
    std::vector<double> distances;
    for (std::size_t i = 0; i < questions; ++i) distances.push_back(measures.back().of(i));
    std::vector<TradeTrial> trials;
    for (std::size_t m = 0; m < measures.size(); ++m) {
        std::vector<double> keys;
        for (std::size_t i = 0; i < questions; ++i) keys.push_back(measures[m].of(i));
        const double disorder = disorder_share(keys, distances);
        trials.push_back({.label = measures[m].name,
                          .value = static_cast<double>(m),
                          .command = "",
                          .measure = [questions, disorder,
                                      measure = measures[m].of]() -> CommandResult<TradeSample> {
                              return TradeSample{time_call_ns(questions, measure), disorder};
                          }});
    }
    return trials;
}

/// Poses of boxes that are apart, touch, and overlap.
std::vector<Pose> random_poses(std::size_t count) {
    BodyRandom random(3, 0);
    std::vector<Pose> poses;
    for (std::size_t i = 0; i < count; ++i) {
        Pose pose;
        pose.rotation = matrix_from_quaternion(random.direction<4>());
        const std::array<double, 3> way = random.direction<3>();
        const double far = random.within(0.3, 4.0);
        pose.translation = {far * way[0], far * way[1], far * way[2]};
        poses.push_back(pose);
    }
    return poses;
}

CommandResult<std::vector<TradeTrial>> prepare_ground_measures(const TradePlace& place) {
    const CommandResult<Ground> loaded = load_contact_ground(*place.terrain, 0.0);
    if (!loaded) return pass_on(loaded.error());
    std::vector<ProbePose> probes =
        probe_poses(*place.terrain, Sphere{1.0}, place.is_quick ? 100 : 600);
    if (probes.empty()) return failure("no ground at the terrain's centre");
    const std::vector<Pose> turns = random_poses(probes.size());
    for (std::size_t i = 0; i < probes.size(); ++i) probes[i].pose.rotation = turns[i].rotation;
    const auto poses = std::make_shared<const std::vector<ProbePose>>(std::move(probes));
    const Shape box = Box{{0.6, 0.9, 0.4}};
    const Ground& ground = *loaded;  // copied by the measures
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const std::vector<NamedMeasure> measures{
        {"test",
         [=](std::size_t i) {
             return test_contact(box, (*poses)[i].pose, ground).is_touching ? 0.0 : 1.0;
         }},
        {"pseudodistance",
         [=](std::size_t i) {
             return pseudodistance(box, (*poses)[i].pose, ground).pseudodistance;
         }},
        {"lift", [=](std::size_t i) { return -compute_lift(box, (*poses)[i].pose, ground).lift; }},
        {"contacts",
         [=](std::size_t i) {
             std::array<Contact, 32> contacts;
             const ContactAnswer answer =
                 find_contacts(box, (*poses)[i].pose, ground, 0.0, contacts);
             return answer.count > 0 ? -contacts[0].depth : 0.0;
         }},
        {"distance", [=](std::size_t i) {
             return signed_distance(box, (*poses)[i].pose, ground, kInfinity).distance;
         }}};
    return measure_trials(measures, poses->size());
}

CommandResult<std::vector<TradeTrial>> prepare_pair_measures(const TradePlace& place) {
    const auto poses =
        std::make_shared<const std::vector<Pose>>(random_poses(place.is_quick ? 150 : 800));
    const Shape a = Box{{0.6, 0.9, 0.4}}, b = Box{{0.5, 1.2, 0.7}};
    const std::vector<NamedMeasure> measures{
        {"test",
         [=](std::size_t i) {
             return test_contact(a, (*poses)[i], b, {}).is_touching ? 0.0 : 1.0;
         }},
        {"pseudodistance",
         [=](std::size_t i) { return pseudodistance(a, (*poses)[i], b, {}).pseudodistance; }},
        {"contacts",
         [=](std::size_t i) {
             std::array<PairContact, 8> contacts;
             const PairContactAnswer answer = find_contacts(a, (*poses)[i], b, {}, 0.0, contacts);
             return answer.count > 0 ? -contacts[0].depth : answer.least_distance;
         }},
        {"distance",
         [=](std::size_t i) { return signed_distance(a, (*poses)[i], b, {}).distance; }}};
    return measure_trials(measures, poses->size());
}

}  // namespace

std::vector<Dial> measure_dials() {
    Dial ground;
    ground.key = "ground-measure";
    ground.title = "How near to the ground: test, lift or distance";
    ground.text =
        "A box of 1.2 x 1.8 x 0.8 m at random poses near the ground. Disorder: pairs of poses "
        "that a measure does not order as the signed distance does.";
    ground.columns = measure_columns();
    ground.cost = "ns";
    ground.loss = "disorder";
    ground.prepare = prepare_ground_measures;
    Dial pair = ground;
    pair.key = "pair-measure";
    pair.title = "How near to another body: test, pseudodistance or distance";
    pair.text = "Two boxes at random poses, a third of which overlap. Disorder as above.";
    pair.needs_terrain = false;
    pair.prepare = prepare_pair_measures;
    return {ground, pair};
}

}  // namespace terrane::tools
