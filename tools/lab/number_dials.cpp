// SPDX-License-Identifier: MIT
#include "lab/dial.h"
#include "lab/ground_trials.h"
#include "program/geometry.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/shape_pairs.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

/// A point or vector of numbers of one precision.
template <class T>
using Point3 = std::array<T, 3>;

/// Squared distance of a point from a triangle, in the precision of its numbers.
///
/// Source: C. Ericson. Real-Time Collision Detection, 2005, 5.1.5 (Voronoi regions of corners, edges and face by
/// barycentric coordinates).
template <class T>
T squared_distance_to_triangle(const Point3<T>& p, const std::array<Point3<T>, 3>& corners) {
    const auto minus = [](const Point3<T>& a, const Point3<T>& b) {
        return Point3<T>{a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    };
    const auto dot = [](const Point3<T>& a, const Point3<T>& b) {
        return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    };
    const Point3<T>&a = corners[0], &b = corners[1], &c = corners[2];
    const Point3<T> ab = minus(b, a), ac = minus(c, a);
    const auto squared_to = [&](T v, T w) {
        Point3<T> off{};
        for (std::size_t i = 0; i < 3; ++i) off[i] = a[i] + v * ab[i] + w * ac[i] - p[i];
        return dot(off, off);
    };
    const Point3<T> ap = minus(p, a);
    const T d1 = dot(ab, ap), d2 = dot(ac, ap);
    if (d1 <= 0 && d2 <= 0) return squared_to(0, 0);
    const Point3<T> bp = minus(p, b);
    const T d3 = dot(ab, bp), d4 = dot(ac, bp);
    if (d3 >= 0 && d4 <= d3) return squared_to(1, 0);
    const T vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return squared_to(d1 / (d1 - d3), 0);
    const Point3<T> cp = minus(p, c);
    const T d5 = dot(ab, cp), d6 = dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) return squared_to(0, 1);
    const T vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return squared_to(0, d2 / (d2 - d6));
    const T va = d3 * d6 - d5 * d4;
    const T bc = (d4 - d3) + (d5 - d6);
    if (va <= 0 && d4 >= d3 && d5 >= d6) return squared_to((d5 - d6) / bc, (d4 - d3) / bc);
    const T sum = va + vb + vc;
    return squared_to(vb / sum, vc / sum);
}

template <class T>
struct TriangleQuestion {
    Point3<T> point{};
    std::array<Point3<T>, 3> corners{};
};

/// Triangles of about a metre around (origin, origin, 0), each with a point near it. All coordinates are rounded to T.
template <class T>
std::vector<TriangleQuestion<T>> make_questions(std::size_t count, double origin) {
    BodyRandom random(17, 0);
    const auto near = [&] {
        const double x = origin + random.within(-1.0, 1.0);
        const double y = origin + random.within(-1.0, 1.0);
        return Point3<T>{static_cast<T>(x), static_cast<T>(y),
                         static_cast<T>(random.within(-1.0, 1.0))};
    };
    std::vector<TriangleQuestion<T>> questions(count);
    for (TriangleQuestion<T>& question : questions) {
        for (Point3<T>& corner : question.corners) corner = near();
        question.point = near();
    }
    return questions;
}

template <class T>
TradeTrial precision_trial(std::string name, std::size_t count, double origin) {
    const auto questions =
        std::make_shared<const std::vector<TriangleQuestion<T>>>(make_questions<T>(count, origin));
    // the same queries around 0, with long double as the reference
    const std::vector<TriangleQuestion<long double>> exact =
        make_questions<long double>(count, 0.0);
    double error_m = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        const auto& [point, corners] = (*questions)[i];
        const long double measured =
            std::sqrt(static_cast<long double>(squared_distance_to_triangle(point, corners)));
        const long double truth =
            std::sqrt(squared_distance_to_triangle(exact[i].point, exact[i].corners));
        error_m = std::max(error_m, static_cast<double>(std::abs(measured - truth)));
    }
    const auto measure = [questions, error_m]() -> CommandResult<TradeSample> {
        const double ns = time_call_ns(questions->size(), [&](std::size_t i) {
            const auto& [point, corners] = (*questions)[i];
            return squared_distance_to_triangle(point, corners);
        });
        return TradeSample{ns, error_m, static_cast<double>(sizeof(T))};
    };
    return {std::move(name), measure};
}

Dial precision_dial() {
    const auto prepare = [](const TradePlace& place) -> TradeTrials {
        const std::size_t count = place.is_quick ? 500 : 2000;
        return std::vector<TradeTrial>{precision_trial<float>("float, local", count, 0.0),
                                       precision_trial<float>("float, 10 km out", count, 1e4),
                                       precision_trial<float>("float, 1000 km out", count, 1e6),
                                       precision_trial<double>("double, local", count, 0.0),
                                       precision_trial<double>("double, 10 km out", count, 1e4),
                                       precision_trial<double>("double, 1000 km out", count, 1e6)};
    };
    return {.key = "precision",
            .title = "Float or double, near the origin or far from it",
            .text =
                "Distance of a point from a triangle of about 1 m, the same code in both "
                "precisions; coordinates are relative to the body, or of a world whose origin "
                "is that far away.",
            .needs_terrain = false,
            .columns = {{"ns", "a distance", "ns"},
                        {"error_m", "error of the distance", "m"},
                        {"number_bytes", "a number", "bytes"}},
            .cost = "ns",
            .loss = "error_m",
            .prepare = prepare};
}

TradeTrial nearest_trial(std::string name, std::size_t count, bool has_root) {
    BodyRandom random(23, 0);
    const auto points = std::make_shared<std::vector<Point3<double>>>(count);
    for (Point3<double>& p : *points) {
        p = {random.within(-1.0, 1.0), random.within(-1.0, 1.0), random.within(-1.0, 1.0)};
    }
    const auto square_of = [points](std::size_t from, std::size_t to) {
        const Point3<double>&a = (*points)[from], &b = (*points)[to];
        const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
        return x * x + y * y + z * z;
    };
    const auto key = [square_of, has_root](std::size_t from, std::size_t to) {
        const double square = square_of(from, to);
        return has_root ? std::sqrt(square) : square;
    };
    // counts pairs of different squares whose roots are equal
    std::vector<double> squares, keys;
    for (std::size_t i = 1; i < count; ++i) {
        squares.push_back(square_of(0, i));
        keys.push_back(key(0, i));
    }
    std::size_t unlike = 0;
    for (std::size_t i = 0; i < keys.size(); ++i) {
        for (std::size_t k = i + 1; k < keys.size(); ++k) {
            if ((squares[i] < squares[k]) != (keys[i] < keys[k])) ++unlike;
        }
    }
    const auto measure = [key, count, unlike]() -> CommandResult<TradeSample> {
        const double scan_ns = time_call_ns(16, [&](std::size_t from) {
            double least = 1e300;
            std::size_t nearest = 0;
            for (std::size_t to = 16; to < count; ++to) {
                const double distance = key(from, to);
                if (distance >= least) continue;
                least = distance;
                nearest = to;
            }
            return nearest;
        });
        return TradeSample{scan_ns / static_cast<double>(count - 16), static_cast<double>(unlike)};
    };
    return {std::move(name), measure};
}

Dial root_dial() {
    const auto prepare = [](const TradePlace& place) -> TradeTrials {
        const std::size_t count = place.is_quick ? 500 : 2000;
        return std::vector<TradeTrial>{nearest_trial("squared", count, false),
                                       nearest_trial("with root", count, true)};
    };
    return {
        .key = "root",
        .title = "Squared distances or distances",
        .text =
            "Nearest of many points by a scan; the root is monotonic, so the order is the same.",
        .needs_terrain = false,
        .columns = {{"ns", "a candidate", "ns"},
                    {"unlike_pairs", "pairs ordered unlike the squares"}},
        .cost = "ns",
        .loss = "unlike_pairs",
        .prepare = prepare};
}

/// The share of pairs that `keys` and `order` rank differently; a tie in `keys` counts as different. Pairs tied in
/// `order` are excluded.
double disorder_share(const std::vector<double>& keys, const std::vector<double>& order) {
    std::size_t pairs = 0, unlike = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
        for (std::size_t k = i + 1; k < order.size(); ++k) {
            if (order[i] == order[k]) continue;
            ++pairs;
            const bool is_alike = order[i] < order[k] ? keys[i] < keys[k] : keys[i] > keys[k];
            if (!is_alike) ++unlike;
        }
    }
    return ratio_or_zero(unlike, pairs);
}

/// A measure of proximity: it gives each query a number, which is smaller for closer objects.
struct NamedMeasure {
    std::string name;
    std::function<double(std::size_t)> of;
};

/// Trials of measures on the same queries. The last measure is the distance, the reference for the others.
TradeTrials measure_trials(const std::vector<NamedMeasure>& measures, std::size_t questions) {
    const auto answers_of = [questions](const NamedMeasure& measure) {
        std::vector<double> answers;
        for (std::size_t i = 0; i < questions; ++i) answers.push_back(measure.of(i));
        return answers;
    };
    const std::vector<double> distances = answers_of(measures.back());
    return make_trials(measures, [&](const NamedMeasure& each) {
        const auto measure = [questions, disorder = disorder_share(answers_of(each), distances),
                              of = each.of]() -> CommandResult<TradeSample> {
            return TradeSample{time_call_ns(questions, of), disorder};
        };
        return TradeTrial{each.name, measure};
    });
}

/// Poses of boxes that are apart, touch, and overlap.
std::vector<Pose> random_poses(std::size_t count) {
    BodyRandom random(3, 0);
    std::vector<Pose> poses;
    for (std::size_t i = 0; i < count; ++i) {
        Pose pose;
        pose.rotation = random.rotation();
        const Eigen::Vector3d way = random.direction();
        pose.translation = random.within(0.3, 4.0) * way;
        poses.push_back(pose);
    }
    return poses;
}

TradeTrials prepare_ground_measures(const TradePlace& place) {
    TERRANE_TRY(const Ground loaded, load_contact_ground(*place.terrain, 0.0));
    std::vector<ProbePose> probes =
        probe_poses(*place.terrain, Sphere{1.0}, place.is_quick ? 100 : 600);
    if (probes.empty()) return failure("no ground at the terrain's centre");
    const std::vector<Pose> turns = random_poses(probes.size());
    for (std::size_t i = 0; i < probes.size(); ++i) probes[i].pose.rotation = turns[i].rotation;
    const auto poses = std::make_shared<const std::vector<ProbePose>>(std::move(probes));
    const Shape box = Box{{0.6, 0.9, 0.4}};
    const Ground& ground = loaded;  // copied by the measures
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

/// The measures of two shapes at random poses of the first one.
std::vector<NamedMeasure> pair_measures(const Shape& a, const Shape& b,
                                        std::shared_ptr<const std::vector<Pose>> poses) {
    return {{"test",
             [=](std::size_t i) {
                 return test_contact(a, (*poses)[i], b, {}).is_touching ? 0.0 : 1.0;
             }},
            {"pseudodistance",
             [=](std::size_t i) { return pseudodistance(a, (*poses)[i], b, {}).pseudodistance; }},
            {"contacts",
             [=](std::size_t i) {
                 std::array<PairContact, 8> contacts;
                 const PairContactAnswer answer =
                     find_contacts(a, (*poses)[i], b, {}, 0.0, contacts);
                 return answer.count > 0 ? -contacts[0].depth : answer.least_distance;
             }},
            {"distance",
             [=](std::size_t i) { return signed_distance(a, (*poses)[i], b, {}).distance; }}};
}

TradeTrials prepare_pair_measures(const TradePlace& place) {
    const auto poses =
        std::make_shared<const std::vector<Pose>>(random_poses(place.is_quick ? 150 : 800));
    return measure_trials(pair_measures(Box{{0.6, 0.9, 0.4}}, Box{{0.5, 1.2, 0.7}}, poses),
                          poses->size());
}

TradeTrials prepare_swept_measures(const TradePlace& place) {
    struct Pair {
        std::string name;
        Shape a, b;
    };
    const Shape sphere = Sphere{1.2}, capsule = Capsule{0.7, 0.8};
    const std::vector<Pair> pairs{{"two spheres", sphere, sphere},
                                  {"sphere and capsule", sphere, capsule},
                                  {"two capsules", capsule, capsule}};
    const auto poses =
        std::make_shared<const std::vector<Pose>>(random_poses(place.is_quick ? 150 : 800));
    std::vector<TradeTrial> trials;
    for (const Pair& pair : pairs) {
        TERRANE_TRY(const std::vector<TradeTrial> of_pair,
                    measure_trials(pair_measures(pair.a, pair.b, poses), poses->size()));
        for (TradeTrial trial : of_pair) {
            trial.label = fmt::format("{}, {}", pair.name, trial.label);
            trials.push_back(std::move(trial));
        }
    }
    return trials;
}

}  // namespace

std::vector<Dial> number_dials() {
    const Dial ground{.key = "ground-measure",
                      .title = "How near to the ground: test, lift or distance",
                      .text =
                          "A box of 1.2 x 1.8 x 0.8 m at random poses near the ground. Disorder: "
                          "pairs of poses that a measure does not order as the signed distance "
                          "does.",
                      .columns = {{"ns", "a question", "ns"},
                                  {"disorder", "pairs ordered unlike the distance", "share"}},
                      .cost = "ns",
                      .loss = "disorder",
                      .prepare = prepare_ground_measures};
    Dial pair = ground;
    pair.key = "pair-measure";
    pair.title = "How near to another body: test, pseudodistance or distance";
    pair.text = "Two boxes at random poses, a third of which overlap. Disorder as above.";
    pair.needs_terrain = false;
    pair.prepare = prepare_pair_measures;
    Dial swept = pair;
    swept.key = "swept-measure";
    swept.title = "How near two spheres or capsules are: without roots, with one, or the distance";
    swept.text =
        "Spheres of radius 1.2 m and capsules of radius 0.7 m and length 3 m at random poses. The "
        "test compares squares, the pseudodistance takes one root. Disorder as above.";
    swept.prepare = prepare_swept_measures;
    return {ground, pair, swept, root_dial(), precision_dial()};
}

}  // namespace terrane::tools
