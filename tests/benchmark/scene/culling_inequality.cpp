// SPDX-License-Identifier: MIT
// The inequality of culling: does a cheaper, inexact test and the drawing of what it keeps cost less than an exact
// test and the drawing of what is in view? From few objects to many, and from cheap ones to dear ones.
//
//   culling_inequality [--quick] [REPORT.html]
#include "assets.h"
#include "benchmark/scene/device.h"
#include "flight/report.h"
#include "lab/rod_field.h"
#include "support/random.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>
#include <vector>

namespace terrane::bench {
namespace {

using tools::FieldFrame;
using tools::kCullTests;

double total_ms(const FieldFrame& frame) { return frame.cull_ms + frame.draw_ms; }

// Means over the views of the median of the repetitions. The tests take turns.
std::array<FieldFrame, kCullTests.size()> measure(const tools::RodField& field,
                                                  std::span<const View> views) {
    constexpr std::size_t kRepetitions = 7;
    std::array<FieldFrame, kCullTests.size()> means;
    for (const View& view : views) {
        std::array<std::vector<FieldFrame>, kCullTests.size()> frames;
        tools::take_turns(
            kCullTests.size(), {.most_turns = kRepetitions}, [&](std::size_t test, std::size_t) {
                frames[test].push_back(value_or_exit(field.make_frame(kCullTests[test], view)));
                return true;
            });
        for (std::size_t test = 0; test < kCullTests.size(); ++test) {
            std::ranges::sort(frames[test], {}, total_ms);
            const FieldFrame& median = frames[test][kRepetitions / 2];
            means[test].kept += median.kept;
            means[test].cull_ms += median.cull_ms / static_cast<double>(views.size());
            means[test].draw_ms += median.draw_ms / static_cast<double>(views.size());
        }
    }
    for (FieldFrame& mean : means) mean.kept /= views.size();
    return means;
}

}  // namespace
}  // namespace terrane::bench

int main(int argc, char** argv) {
    using namespace terrane;
    using namespace terrane::bench;
    Arguments arguments(argc, argv, "culling_inequality [--quick] [REPORT.html]");
    const bool is_quick = arguments.has("--quick");
    const std::vector<std::string> reports = arguments.rest();
    if (reports.size() > 1) arguments.exit_with_usage("more than one report is named");
    const GlContext context = open_device();
    std::vector<View> views;
    test::Random random(5);
    for (int i = 0; i < (is_quick ? 1 : 7); ++i) {
        View view = tools::RodField::usual_view();
        view.eye_world = 20.0 * random.direction();
        const Eigen::Matrix3d rotation = random.rotation();
        view.forward = rotation.col(0);
        view.up = rotation.col(1);
        views.push_back(view);
    }
    std::printf("%8s %10s | %-12s %7s %9s %9s %9s\n", "objects", "triangles", "test", "kept",
                "cull ms", "draw ms", "sum ms");
    nlohmann::ordered_json fields = nlohmann::ordered_json::array();
    for (const std::size_t objects :
         is_quick ? std::vector<std::size_t>{200} : std::vector<std::size_t>{300, 3000, 30000}) {
        nlohmann::ordered_json points = nlohmann::ordered_json::array();
        for (const int triangles : is_quick ? std::vector{8} : std::vector{8, 24, 80, 240, 800}) {
            if (objects * static_cast<std::size_t>(triangles) > 3'000'000) continue;
            TriangleMesh mesh = tools::make_rod_mesh(triangles);
            const std::size_t count = mesh.triangles.size();
            const tools::RodField field(std::move(mesh), {{-10, -1, -1}, {10, 1, 1}}, objects,
                                        300.0, false);
            const auto frames = measure(field, views);
            nlohmann::ordered_json tests;
            for (std::size_t i = 0; i < kCullTests.size(); ++i) {
                const char* const name = name_of(kCullTests[i]);
                const FieldFrame& frame = frames[i];
                std::printf("%8zu %10zu | %-12s %7zu %9.3f %9.3f %9.3f\n", objects, count, name,
                            frame.kept, frame.cull_ms, frame.draw_ms, total_ms(frame));
                tests[name] = {
                    {"kept", frame.kept}, {"cull_ms", frame.cull_ms}, {"draw_ms", frame.draw_ms}};
            }
            const auto best = std::ranges::min_element(frames, {}, total_ms) - frames.begin();
            std::printf("%8zu %10zu | cheapest: %s\n", objects, count,
                        name_of(kCullTests[static_cast<std::size_t>(best)]));
            points.push_back({{"triangles", count}, {"tests", tests}});
        }
        fields.push_back({{"objects", objects}, {"points", points}});
    }
    if (reports.empty()) return 0;
    const tools::ReportHeader header = {.title = "What a test of culling costs, and what it saves",
                                        .summary = {{"renderer", context.renderer_name()}}};
    value_or_exit(
        tools::write_report(reports[0], header, {{"fields", fields}}, tools::assets::culling_js));
    return 0;
}
