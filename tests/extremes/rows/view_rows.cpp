// SPDX-License-Identifier: MIT
#include "extremes/extreme_row.h"
#include "extremes/rows/grounds.h"
#include "support/mesh_checks.h"

#include <terrane/terrain/triangulator.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

namespace terrane::extremes {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr const char* kErrorPromise =
    "error_px is at least the frame's error on the screen, and the mesh is watertight.";
constexpr const char* kErrorFigure = "error by brute force / error_px";

/// A source and all of its chunks.
struct Scene {
    Source source;
    std::shared_ptr<const ResidentSet> resident;
};

Scene make_scene(const FractalSettings& settings) {
    Scene scene{FractalHeights::create(settings).value(), nullptr};
    const Lattice& lattice = scene.source->lattice();
    std::vector<std::shared_ptr<const Chunk>> chunks;
    for (std::uint8_t level = 0; level <= lattice.finest_level; ++level) {
        const std::int32_t side = std::int32_t{1} << level;
        for (std::int32_t y = 0; y < side; ++y) {
            for (std::int32_t x = 0; x < side; ++x) {
                chunks.push_back(make_chunk(*scene.source, {x, y, level}).value());
            }
        }
    }
    scene.resident =
        std::make_shared<const ResidentSet>(lattice, scene.source->extent(), std::move(chunks), 1);
    return scene;
}

/// One root square of 2^side_log2 m, 1 m between samples.
FractalSettings one_root(int side_log2) {
    return {.seed = 8,
            .octave_count = 5,
            .amplitude = 30.0,
            .wavelength_log2 = 6,
            .root_size_log2 = side_log2,
            .first_root_x = 0,
            .first_root_y = 0,
            .root_count_x = 1,
            .root_count_y = 1};
}

const Scene& small_scene() {
    static const Scene scene = make_scene(one_root(9));
    return scene;
}

/// Error by brute force over error_px of a frame; NaN for a frame that is refused, over its budget or not watertight.
double error_share(const View& view, std::size_t budget) {
    const Scene& scene = small_scene();
    Triangulator triangulator =
        Triangulator::create(*scene.source, {.triangle_budget = budget, .max_error_px = 0.5})
            .value();
    const TerrainMesh mesh = triangulator.update(scene.resident, view);
    if (mesh.status == MeshStatus::invalid_view || mesh.triangle_count > budget ||
        !std::isfinite(mesh.error_px) || !test::find_flaw(mesh).empty()) {
        return kNan;
    }
    const int per_triangle = mesh.triangle_count > 1000 ? 4 : 1000;
    const double measured =
        test::measure_error_px(test::make_soup(mesh), *scene.source, view, per_triangle);
    return mesh.error_px > 0.0 ? measured / mesh.error_px : measured;
}

/// From above the south-western corner to the middle of the ground.
View make_view(double vertical_fov) {
    return look_at({20.0, 30.0, 90.0}, {250.0, 260.0, 0.0}, 1.0, 640, 360)
        .map([vertical_fov](View view) {
            view.vertical_fov = vertical_fov;
            return view;
        })
        .value();
}

ExtremeRow fov_row() {
    ExtremeRow row{.name = "FieldOfView",
                   .topic = "Views",
                   .swept = "vertical field of view, degrees",
                   .promise = kErrorPromise,
                   .figure = kErrorFigure,
                   .values = {1e-4, 0.1, 1.0, 10.0, 60.0, 120.0, 170.0, 179.0, 179.9999}};
    row.measure = [](double degrees) { return error_share(make_view(degrees * kDegree), 20'000); };
    row.refusal = [](double degrees) {
        return message_of(make_view(degrees * kDegree).validate());
    };
    row.ends = {{1e-4, -1.0, false, "field of view"}, {179.9999, 181.0, false, "field of view"}};
    return row;
}

ExtremeRow eye_row() {
    ExtremeRow row{.name = "DistanceOfTheEye",
                   .topic = "Views",
                   .swept = "distance of the eye from the ground, m",
                   .promise = kErrorPromise,
                   .figure = kErrorFigure,
                   .values = {0.0, 1.0, 1e3, 1e6, 1e9, 1e12, 1e15, 1e18}};
    const auto view_from = [](double distance) {
        View view = make_view(1.0);
        const double ground = small_scene().source->height(20.0, 30.0);
        view.eye_world = WorldPos(20.0, 30.0, ground) - distance * view.forward;
        return view;
    };
    row.measure = [view_from](double distance) { return error_share(view_from(distance), 20'000); };
    row.refusal = [view_from](double distance) {
        return message_of(view_from(distance).validate());
    };
    row.ends = {{1e18, 1e300, false, "eye"}};
    return row;
}

ExtremeRow budget_row() {
    ExtremeRow row{
        .name = "TriangleBudget",
        .topic = "Budgets",
        .swept = "triangle_budget, over one root square",
        .promise = "A frame never has more triangles than its budget, and is watertight.",
        .figure = "triangles / budget",
        .values = {2.0, 3.0, 10.0, 100.0, 1e3, 1e4, 1e5},
        .long_values = {1e6, 8e6}};
    row.measure = [](double budget) {
        const bool is_large = budget > 1e5;
        const Scene& scene = small_scene();
        const Scene large = is_large ? make_scene(one_root(11)) : Scene{};
        const Scene& used = is_large ? large : scene;
        Triangulator triangulator =
            Triangulator::create(*used.source, {.triangle_budget = static_cast<std::size_t>(budget),
                                                .max_error_px = 1e-6})
                .value();
        const TerrainMesh mesh = triangulator.update(used.resident, make_view(1.0));
        if (!test::find_flaw(mesh).empty()) return kNan;
        return static_cast<double>(mesh.triangle_count) / budget;
    };
    row.refusal = [](double budget) {
        return message_of(Triangulator::create(
            *small_scene().source, {.triangle_budget = static_cast<std::size_t>(budget)}));
    };
    row.ends = {{2.0, 0.0, true, "triangle_budget"}, {8e6, 1e12, true, "triangle_budget"}};
    return row;
}

}  // namespace

std::vector<ExtremeRow> view_rows() { return {fov_row(), eye_row(), budget_row()}; }

}  // namespace terrane::extremes
