// SPDX-License-Identifier: MIT
#include "trade/dials/dial_list.h"
#include "trade/trials/extreme_search.h"
#include "trade/trials/time_call.h"
#include "trade/trials/trade_meshes.h"

#include <terrane/collision/collision_proxy.h>
#include <terrane/collision/shape_pairs.h>

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <optional>

namespace terrane::tools {
namespace {

CommandResult<TradeTrial> extreme_trial(std::size_t vertices) {
    const Result<ConvexHull> hull = ConvexHull::create(sphere_points(vertices));
    if (!hull) return pass_on(hull.error());
    const auto search = std::make_shared<const ExtremeSearch>(*hull);
    const auto directions =
        std::make_shared<const std::vector<Eigen::Vector3d>>(sphere_points(256));
    return TradeTrial{
        .label = fmt::format("{}", vertices),
        .value = static_cast<double>(vertices),
        .command = "",
        .measure = [=, shape = Shape(*hull)]() -> CommandResult<TradeSample> {
            const double scan_ns = time_call_ns(directions->size(), [&](std::size_t i) {
                return search->by_scan((*directions)[i]);
            });
            const double climb_ns = time_call_ns(directions->size(), [&](std::size_t i) {
                return search->by_climb((*directions)[i]);
            });
            const double support_ns = time_call_ns(directions->size(), [&](std::size_t i) {
                return support_distance(shape, (*directions)[i]);
            });
            return TradeSample{scan_ns, climb_ns, support_ns};
        }};
}

// Where the curves of scan and climb cross for good, by linear interpolation.
std::vector<std::string> find_break_even(const TradeTable& table) {
    std::optional<double> crossing;
    for (std::size_t i = 1; i < table.rows.size(); ++i) {
        const auto gain = [&table](std::size_t row) {
            const std::vector<TradeFigure>& figures = table.rows[row].figures;
            return figures[0].median - figures[1].median;  // of the climb over the scan
        };
        const double before = gain(i - 1), after = gain(i);
        if (before >= 0.0 || after < 0.0) continue;
        const double from = table.rows[i - 1].value, to = table.rows[i].value;
        crossing = from + (to - from) * before / (before - after);
    }
    if (!crossing) return {"Scan and climb do not cross within these numbers of vertices."};
    return {fmt::format("A climb is faster than a scan from {:.0f} vertices on.", *crossing)};
}

Dial extreme_dial() {
    Dial dial;
    dial.key = "extremes";
    dial.title = "Extremal points by scan or climb";
    dial.axis = "vertices";
    dial.text =
        "Hulls of random points on a sphere, random directions; a plain scan and a plain climb, "
        "and the library's support function, which chooses one of its own by the vertices.";
    dial.needs_terrain = false;
    dial.columns = {{"scan_ns", "a scan", TradeUnit::ns},
                    {"climb_ns", "a climb", TradeUnit::ns},
                    {"support_ns", "support_distance()", TradeUnit::ns}};
    dial.prepare = [](const TradePlace& place) -> CommandResult<std::vector<TradeTrial>> {
        const std::vector<std::size_t> counts =
            place.is_quick
                ? std::vector<std::size_t>{8, 24, 64, 200, 800}
                : std::vector<std::size_t>{8, 16, 24, 32, 48, 64, 96, 128, 200, 400, 1000, 3000};
        std::vector<TradeTrial> trials;
        for (const std::size_t count : counts) {
            CommandResult<TradeTrial> trial = extreme_trial(count);
            if (!trial) return pass_on(trial.error());
            trials.push_back(std::move(*trial));
        }
        return trials;
    };
    dial.find = find_break_even;
    return dial;
}

CommandResult<TradeTrial> proxy_trial(const TriangleMesh& mesh, double share, std::size_t index) {
    const auto start = std::chrono::steady_clock::now();
    const Result<CollisionProxy> proxy = make_collision_proxy(mesh, {.proxy_error = share});
    if (!proxy) return pass_on(proxy.error());
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - start;
    const auto ways = std::make_shared<const std::vector<Eigen::Vector3d>>(sphere_points(200));
    const double distance_m = proxy->distance_m;
    const auto parts = static_cast<double>(proxy->shape.parts().size());
    return TradeTrial{
        .label = share == 0.0 ? "full" : fmt::format("{:.6g} m", share),
        .value = static_cast<double>(index),
        .command = "",
        .measure = [=, shape = Shape(proxy->shape),
                    make_ms = taken.count()]() -> CommandResult<TradeSample> {
            const double contact_ns = time_call_ns(ways->size(), [&](std::size_t i) {
                Pose pose;
                pose.translation = 1.25 * (*ways)[i];
                std::array<PairContact, 16> contacts;
                return find_contacts(Sphere{0.3}, pose, shape, {}, 0.0, contacts).count;
            });
            return TradeSample{contact_ns, distance_m, parts, make_ms};
        }};
}

Dial proxy_dial() {
    Dial dial;
    dial.key = "collision-mesh";
    dial.title = "Collision mesh, from full to one hull";
    dial.text =
        "Contacts of a sphere of 0.3 m with a boulder of 1 m: its triangles, then hulls within a "
        "certified distance.";
    dial.needs_terrain = false;
    dial.columns = {{"contact_ns", "contacts", TradeUnit::ns},
                    {"distance_m", "certified distance from the mesh", TradeUnit::m},
                    {"parts", "parts", TradeUnit::none},
                    {"make_ms", "making it, once", TradeUnit::ms}};
    dial.cost = "contact_ns";
    dial.loss = "distance_m";
    dial.prepare = [](const TradePlace& place) -> CommandResult<std::vector<TradeTrial>> {
        const TriangleMesh mesh = make_boulder(place.is_quick ? 2 : 3, 0.3);
        const std::vector<double> errors = place.is_quick
                                               ? std::vector{0.0, 0.1, 1.0}
                                               : std::vector{0.0, 0.02, 0.05, 0.1, 0.2, 1.0};
        std::vector<TradeTrial> trials;
        for (std::size_t i = 0; i < errors.size(); ++i) {
            CommandResult<TradeTrial> trial = proxy_trial(mesh, errors[i], i);
            if (!trial) return pass_on(trial.error());
            trials.push_back(std::move(*trial));
        }
        return trials;
    };
    return dial;
}

}  // namespace

std::vector<Dial> hull_dials() { return {extreme_dial(), proxy_dial()}; }

}  // namespace terrane::tools
