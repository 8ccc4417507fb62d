// SPDX-License-Identifier: MIT
#include "trade/dials/dial_list.h"
#include "trade/trials/point_triangle.h"
#include "trade/trials/time_call.h"
#include "world/body_random.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

namespace terrane::tools {
namespace {

template <class T>
struct TriangleQuestion {
    Point3<T> point{};
    std::array<Point3<T>, 3> corners{};
};

/// Triangles of about a metre with a point beside each, around (origin, origin, 0), rounded to T.
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
TradeTrial precision_trial(std::string name, std::size_t index, std::size_t count, double origin) {
    const auto questions =
        std::make_shared<const std::vector<TriangleQuestion<T>>>(make_questions<T>(count, origin));
    // the same questions around 0, with long double as the truth
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
    return {.label = std::move(name),
            .value = static_cast<double>(index),
            .command = "",
            .measure = [questions, error_m]() -> CommandResult<TradeSample> {
                const double ns = time_call_ns(questions->size(), [&](std::size_t i) {
                    const auto& [point, corners] = (*questions)[i];
                    return squared_distance_to_triangle(point, corners);
                });
                return TradeSample{ns, error_m, static_cast<double>(sizeof(T))};
            }};
}

Dial precision_dial() {
    Dial dial;
    dial.key = "precision";
    dial.title = "Float or double, near the origin or far from it";
    dial.text =
        "Distance of a point from a triangle of about 1 m, the same code in both precisions; "
        "coordinates are relative to the body, or of a world whose origin is that far away.";
    dial.needs_terrain = false;
    dial.columns = {{"ns", "a distance", TradeUnit::ns},
                    {"error_m", "error of the distance", TradeUnit::m},
                    {"number_bytes", "a number", TradeUnit::bytes}};
    dial.cost = "ns";
    dial.loss = "error_m";
    dial.prepare = [](const TradePlace& place) -> CommandResult<std::vector<TradeTrial>> {
        const std::size_t count = place.is_quick ? 500 : 2000;
        return std::vector<TradeTrial>{
            precision_trial<float>("float, local", 0, count, 0.0),
            precision_trial<float>("float, 10 km out", 1, count, 1e4),
            precision_trial<float>("float, 1000 km out", 2, count, 1e6),
            precision_trial<double>("double, local", 3, count, 0.0),
            precision_trial<double>("double, 10 km out", 4, count, 1e4),
            precision_trial<double>("double, 1000 km out", 5, count, 1e6)};
    };
    return dial;
}

TradeTrial nearest_trial(std::string name, std::size_t index, std::size_t count, bool has_root) {
    BodyRandom random(23, 0);
    const auto points = std::make_shared<std::vector<Point3<double>>>(count);
    for (Point3<double>& p : *points) {
        p = {random.within(-1.0, 1.0), random.within(-1.0, 1.0), random.within(-1.0, 1.0)};
    }
    const auto key = [points, has_root](std::size_t from, std::size_t to) {
        const Point3<double>&a = (*points)[from], &b = (*points)[to];
        const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
        const double square = x * x + y * y + z * z;
        return has_root ? std::sqrt(square) : square;
    };
    // pairs of different squares whose roots are equal
    std::vector<double> squares, keys;
    for (std::size_t i = 1; i < count; ++i) {
        const double root = key(0, i);
        const Point3<double>&a = (*points)[0], &b = (*points)[i];
        squares.push_back((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                          (a[2] - b[2]) * (a[2] - b[2]));
        keys.push_back(root);
    }
    std::size_t unlike = 0;
    for (std::size_t i = 0; i < keys.size(); ++i) {
        for (std::size_t k = i + 1; k < keys.size(); ++k) {
            if ((squares[i] < squares[k]) != (keys[i] < keys[k])) ++unlike;
        }
    }
    return {.label = std::move(name),
            .value = static_cast<double>(index),
            .command = "",
            .measure = [key, count, unlike]() -> CommandResult<TradeSample> {
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
                return TradeSample{scan_ns / static_cast<double>(count - 16),
                                   static_cast<double>(unlike)};
            }};
}

Dial root_dial() {
    Dial dial;
    dial.key = "root";
    dial.title = "Squared distances or distances";
    dial.text =
        "Nearest of many points by a scan; the root is monotonic, so the order is the same.";
    dial.needs_terrain = false;
    dial.columns = {{"ns", "a candidate", TradeUnit::ns},
                    {"unlike_pairs", "pairs ordered unlike the squares", TradeUnit::none}};
    dial.cost = "ns";
    dial.loss = "unlike_pairs";
    dial.prepare = [](const TradePlace& place) -> CommandResult<std::vector<TradeTrial>> {
        const std::size_t count = place.is_quick ? 500 : 2000;
        return std::vector<TradeTrial>{nearest_trial("squared", 0, count, false),
                                       nearest_trial("with root", 1, count, true)};
    };
    return dial;
}

}  // namespace

std::vector<Dial> number_dials() { return {root_dial(), precision_dial()}; }

}  // namespace terrane::tools
