// SPDX-License-Identifier: MIT
#include "trade/dials/dial_list.h"
#include "trade/trials/rod_field.h"
#include "trade/trials/trade_meshes.h"

#include <terrane/terrain/simplify.h>

#include <fmt/format.h>

#include <cmath>
#include <memory>

namespace terrane::tools {
namespace {

Dial culling_dial() {
    Dial dial;
    dial.key = "culling";
    dial.title = "Culling, from none to exact";
    dial.text =
        "Rods of 20 x 2 x 2 m up to 300 m around the eye, 80 triangles each. An inexact test is "
        "cheaper, and draws some that are out of view.";
    dial.needs_terrain = false;
    dial.columns = {{"frame_ms", "culling and drawing", TradeUnit::ms},
                    {"cull_ms", "culling", TradeUnit::ms},
                    {"draw_ms", "drawing until the picture can be read", TradeUnit::ms},
                    {"surplus_share", "drawn out of view", TradeUnit::share},
                    {"kept", "drawn", TradeUnit::none}};
    dial.cost = "cull_ms";
    dial.loss = "surplus_share";
    dial.prepare = [](const TradePlace& place) -> CommandResult<std::vector<TradeTrial>> {
        const auto field =
            std::make_shared<const RodField>(make_rod_mesh(80), Aabb{{-10, -1, -1}, {10, 1, 1}},
                                             place.is_quick ? 2000 : 20'000, 300.0, place.is_quick);
        const Result<FieldFrame> exact = field->make_frame(CullTest::triangles);
        if (!exact) return pass_on(exact.error());
        std::vector<TradeTrial> trials;
        for (const CullTest test : kCullTests) {
            trials.push_back(
                {.label = name_of(test),
                 .value = static_cast<double>(trials.size()),
                 .command = "",
                 .measure = [field, test, in_view = exact->kept]() -> CommandResult<TradeSample> {
                     const Result<FieldFrame> frame = field->make_frame(test);
                     if (!frame) return pass_on(frame.error());
                     const auto kept = static_cast<double>(frame->kept);
                     const double surplus =
                         kept > 0.0 ? (kept - static_cast<double>(in_view)) / kept : 0.0;
                     return TradeSample{frame->cull_ms + frame->draw_ms, frame->cull_ms,
                                        frame->draw_ms, surplus, kept};
                 }});
        }
        return trials;
    };
    return dial;
}

CommandResult<std::vector<TradeTrial>> prepare_object_meshes(const TradePlace& place) {
    const TriangleMesh full = make_boulder(place.is_quick ? 4 : 5, 0.3);
    std::vector<SimplifyLevel> levels;
    for (std::size_t count = full.triangles.size(); count >= 8; count /= 4) {
        levels.push_back({.triangles = count});
    }
    const auto simplified =
        simplify({.vertices = full.positions, .triangles = full.triangles}, levels);
    if (!simplified) return pass_on(simplified.error());
    std::vector<TradeTrial> trials;
    for (const SimplifiedMesh& level : *simplified) {
        TriangleMesh mesh = full;
        mesh.triangles = level.triangles;
        const auto triangles = static_cast<double>(level.triangles.size());
        const auto field = std::make_shared<const RodField>(
            std::move(mesh), Aabb{{-1.3, -1.3, -1.3}, {1.3, 1.3, 1.3}},
            place.is_quick ? std::size_t{300} : std::size_t{2000}, 60.0, place.is_quick);
        trials.push_back({.label = fmt::format("{}", level.triangles.size()),
                          .value = triangles,
                          .command = "",
                          .measure = [field, triangles,
                                      error_m = level.error_m]() -> CommandResult<TradeSample> {
                              const Result<FieldFrame> frame = field->make_frame(CullTest::spheres);
                              if (!frame) return pass_on(frame.error());
                              return TradeSample{frame->draw_ms, error_m, triangles};
                          }});
    }
    return trials;
}

Dial mesh_dial() {
    Dial dial;
    dial.key = "object-mesh";
    dial.title = "Triangles of an object";
    dial.axis = "triangles";
    dial.text =
        "Boulders of 1 m up to 60 m around the eye, simplified within a certified distance.";
    dial.needs_terrain = false;
    dial.columns = {{"draw_ms", "drawing until the picture can be read", TradeUnit::ms},
                    {"error_m", "certified distance from the full mesh", TradeUnit::m},
                    {"triangles", "triangles of one", TradeUnit::none}};
    dial.cost = "triangles";
    dial.loss = "error_m";
    dial.prepare = prepare_object_meshes;
    return dial;
}

}  // namespace

std::vector<Dial> object_dials() { return {culling_dial(), mesh_dial()}; }

}  // namespace terrane::tools
