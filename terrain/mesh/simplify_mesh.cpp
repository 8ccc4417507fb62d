// SPDX-License-Identifier: MIT
//
// Computes: simplified meshes with vertices of their own. The methods estimate errors; the result's error is bounded by
//           surface_distance.cpp, which holds for any two surfaces, so that it does not depend on the method.
#include "base/vector_math.h"
#include "mesh/simplify_methods.h"
#include "mesh/surface_distance.h"

#include <terrane/base/text.h>
#include <terrane/terrain/progressive_mesh.h>
#include <terrane/terrain/simplify_mesh.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace terrane::internal {

MethodResult contract_edges(const SimplifyTask& task, std::size_t triangles, double limit) {
    AttributeQuadrics attributes(task.mesh, task.settings, task.welded.corners);
    ContractionRecorder recorder(task.welded, attributes);
    const std::vector<EdgeToKeep> seams = find_seams(task.welded);
    Contractor contractor(
        {.vertices = task.welded.places, .triangles = task.welded.triangles, .locked = task.locked},
        {.rules = &recorder,
         .edges_to_keep = seams,
         .error_ratio = kErrorRatio,
         .may_change_topology = true,
         .placement = Placement::optimal});
    MethodResult made;
    made.stop = contractor.contract_to({triangles, limit});
    if (made.stop != SimplifyStop::triangle_count) {
        recorder.allow_all();
        contractor.retry_all();
        made.stop = contractor.contract_to({triangles, limit});
    }
    TriangleMesh mesh = task.mesh;
    for (std::uint32_t v = 0; v < mesh.positions.size(); ++v)
        mesh.positions[v] = contractor.position(task.welded.place_of_vertex[v]);
    attributes.write(mesh, task.settings);
    mesh.triangles.clear();
    for (std::size_t i = 0; i < task.welded.triangles.size(); ++i) {
        if (contractor.is_left(i)) mesh.triangles.push_back(recorder.corners(i));
    }
    made.mesh = without_unused_vertices(mesh);
    return made;
}

namespace {

// The level of ProgressiveMesh with at most a number of triangles.
TriangleMesh contract_half_edges(const SimplifyTask& task, std::size_t triangles) {
    ProgressiveSettings settings = task.settings;
    settings.least_triangle_count = triangles;
    ProgressiveMesh level = ProgressiveMesh::create(task.mesh, settings).value();
    level.set_triangle_count(triangles);
    TriangleMesh mesh = level.finest();
    mesh.triangles.assign(level.triangles().begin(), level.triangles().end());
    return without_unused_vertices(mesh);
}

constexpr int kMostRounds = 12;
// Ratio of limits at which the search ends.
constexpr double kCloseLimits = 1.15;

MethodResult run_method(SimplifyMethod method, const SimplifyTask& task, std::size_t triangles,
                        double limit) {
    switch (method) {
        case SimplifyMethod::decimation:
            return decimate(task, triangles, limit);
        case SimplifyMethod::clustering:
            return cluster(task, triangles, limit);
        case SimplifyMethod::quadric:
            break;
    }
    return contract_edges(task, triangles, limit);
}

// Methods estimate their errors: the largest limit of the estimate with a certified error within the limit is searched
// for by bisection.
SimplifiedCopy simplify_within(const SimplifyTask& task, const SimplifyMeshSettings& settings) {
    const SurfaceView input = {task.welded.places, task.welded.triangles};
    const auto bound = [&](const TriangleMesh& mesh) {
        return bound_surface_distance(input, {mesh.positions, mesh.triangles});
    };
    std::optional<SimplifiedCopy> best;
    double limit = settings.error_m, good = 0.0, bad = kInfinity;
    for (int round = 0; round < kMostRounds && limit > 0.0; ++round) {
        MethodResult made = run_method(settings.method, task, settings.triangles, limit);
        const double error = bound(made.mesh);
        const bool is_good = error <= settings.error_m;
        if (is_good) {
            good = limit;
            best = SimplifiedCopy{std::move(made.mesh), error, made.stop};
            // without a limit, or with as few triangles as were asked for, there is nothing to gain
            if (made.stop != SimplifyStop::error_limit || limit == kInfinity) break;
        } else {
            bad = limit;
        }
        if (bad == kInfinity) {
            limit = 2.0 * good;
        } else if (good == 0.0) {
            limit *= std::clamp(0.95 * settings.error_m / error, 0.125, 0.875);
        } else {
            limit = std::sqrt(good * bad);
        }
        if (bad <= kCloseLimits * good) break;
    }
    if (best && settings.method == SimplifyMethod::quadric && limit == kInfinity) {
        // tracked points do not see how far a new triangle of a thin body is from the input
        TriangleMesh other = contract_half_edges(task, settings.triangles);
        const bool has_fewer = other.triangles.size() < best->mesh.triangles.size() &&
                               best->stop != SimplifyStop::triangle_count;
        const double error = bound(other);
        if (has_fewer ||
            (other.triangles.size() <= best->mesh.triangles.size() && error < best->error_m)) {
            const SimplifyStop stop = other.triangles.size() <= settings.triangles
                                          ? SimplifyStop::triangle_count
                                          : SimplifyStop::no_contraction;
            best = SimplifiedCopy{std::move(other), error, stop};
        }
    }
    if (best) return *std::move(best);
    TriangleMesh mesh = task.mesh;
    mesh.triangles = task.welded.corners;
    return {without_unused_vertices(mesh), 0.0, SimplifyStop::error_limit};
}

}  // namespace
}  // namespace terrane::internal

namespace terrane {

Result<SimplifiedCopy> simplify_mesh(const TriangleMesh& mesh,
                                     const SimplifyMeshSettings& settings) {
    TERRANE_TRY(mesh.validate());
    const ProgressiveSettings weights = {
        .normal_weight = settings.normal_weight,
        .texture_coordinate_weight = settings.texture_coordinate_weight,
        .colour_weight = settings.colour_weight,
        .locked = settings.locked};
    TERRANE_TRY(internal::check_settings(mesh, weights));
    if (!(settings.error_m >= 0.0)) {
        return fail(ErrorCode::invalid_argument,
                    "error_m must be at least 0, got " + number_text(settings.error_m));
    }
    const internal::WeldedMesh welded = internal::weld(mesh);
    const std::vector<std::uint8_t> locked = internal::locked_places(welded, settings.locked);
    if (welded.triangles.size() <= std::max<std::size_t>(settings.triangles, 1)) {
        TriangleMesh whole = mesh;
        whole.triangles = welded.corners;
        return SimplifiedCopy{.mesh = without_unused_vertices(whole),
                              .stop = welded.triangles.size() <= settings.triangles
                                          ? SimplifyStop::triangle_count
                                          : SimplifyStop::no_contraction};
    }
    return internal::simplify_within({mesh, welded, weights, locked}, settings);
}

}  // namespace terrane
