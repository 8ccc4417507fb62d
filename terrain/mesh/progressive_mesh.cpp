// SPDX-License-Identifier: MIT
#include "mesh/contraction_recorder.h"
#include "mesh/contractor.h"

#include <terrane/terrain/progressive_mesh.h>

#include <algorithm>
#include <numeric>
#include <utility>

namespace terrane::internal {
namespace {

// Indices ordered by decreasing step of removal; those removed in the same step by increasing index.
std::vector<std::uint32_t> order_by(const std::vector<std::uint32_t>& gone_at, std::size_t steps) {
    // counting sort: there are at most as many steps as triangles
    const auto place_of = [&](std::uint32_t step) {
        return std::min<std::size_t>(step, steps + 1);
    };
    std::vector<std::uint32_t> next(steps + 3, 0);
    for (const std::uint32_t step : gone_at) ++next[steps + 2 - place_of(step)];
    std::partial_sum(next.begin(), next.end(), next.begin());
    std::vector<std::uint32_t> order(gone_at.size());
    for (std::uint32_t i = 0; i < gone_at.size(); ++i)
        order[next[steps + 1 - place_of(gone_at[i])]++] = i;
    return order;
}

std::vector<std::uint32_t> inverse_of(const std::vector<std::uint32_t>& order) {
    std::vector<std::uint32_t> inverse(order.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) inverse[order[i]] = i;
    return inverse;
}

template <class Value>
std::vector<Value> permuted(const std::vector<Value>& values,
                            const std::vector<std::uint32_t>& order) {
    std::vector<Value> result;
    result.reserve(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) result.push_back(values[order[i]]);
    return result;
}

// [steps + 1] number of elements that remain after each step.
std::vector<std::uint32_t> counts_left(const std::vector<std::uint32_t>& gone_at,
                                       std::size_t steps) {
    std::vector<std::uint32_t> counts(steps + 1, 0);
    for (const std::uint32_t step : gone_at) {
        if (step > 0) ++counts[std::min<std::size_t>(step - 1, steps)];
    }
    for (std::size_t i = steps; i-- > 0;) counts[i] += counts[i + 1];
    return counts;
}

}  // namespace

Recording::Recording(const TriangleMesh& mesh, const WeldedMesh& welded, ContractionRecord record) {
    const std::size_t steps = record.ends.size();

    const std::vector<std::uint32_t> vertices = order_by(record.unused_from, steps),
                                     triangles = order_by(record.removed_at, steps);
    const std::vector<std::uint32_t> vertex_of = inverse_of(vertices),
                                     triangle_of = inverse_of(triangles);
    finest.positions = permuted(mesh.positions, vertices);
    finest.normals = permuted(mesh.normals, vertices);
    finest.texture_coordinates = permuted(mesh.texture_coordinates, vertices);
    finest.colours = permuted(mesh.colours, vertices);
    finest.materials = permuted(mesh.materials, vertices);
    finest.triangles = permuted(welded.corners, triangles);
    for (TriangleMesh::Triangle& t : finest.triangles) {
        for (std::uint32_t& v : t) v = vertex_of[v];
    }
    for (ContractionRecord::Change& change : record.changes)
        change = {3 * triangle_of[change.corner / 3] + change.corner % 3, vertex_of[change.from],
                  vertex_of[change.to]};
    changes = std::move(record.changes);
    ends = {0};
    ends.insert(ends.end(), record.ends.begin(), record.ends.end());
    errors_m = {0.0};
    errors_m.insert(errors_m.end(), record.errors_m.begin(), record.errors_m.end());
    triangle_counts = counts_left(record.removed_at, steps);
    vertex_counts = counts_left(record.unused_from, steps);
    unused_from = permuted(record.unused_from, vertices);
    parents = permuted(record.parents, vertices);
    for (std::uint32_t& parent : parents) parent = vertex_of[parent];
    input_vertices = vertices;
    input_triangles = permuted(welded.input_triangles, triangles);
}

std::size_t Recording::step_of_count(std::size_t count) const {
    // counts decrease from step to step
    const auto found = std::partition_point(triangle_counts.begin(), triangle_counts.end(),
                                            [&](std::uint32_t of_step) { return of_step > count; });
    return std::min(static_cast<std::size_t>(found - triangle_counts.begin()),
                    triangle_counts.size() - 1);
}

}  // namespace terrane::internal

// Source: H. Hoppe. Progressive Meshes. SIGGRAPH 1996.
// Deviations: half-edge contractions over one list of vertices, so that the record contains no positions. Triangles are
//             sorted by their step of removal, so that a level uses the first ones and a step only changes indices.

namespace terrane {

using internal::ContractionRecord;

struct ProgressiveMesh::State {
    std::shared_ptr<const internal::Recording> recording;
    std::vector<Triangle>
        triangles;         ///< of the current level, followed by removed ones as they last were
    std::size_t step = 0;  ///< of the current level

    void go_to(std::size_t wanted);
};

namespace {

ContractionRecord record_contractions(const TriangleMesh& mesh, const ProgressiveSettings& settings,
                                      const internal::WeldedMesh& welded) {
    const std::vector<std::uint8_t> locked = internal::locked_places(welded, settings.locked);
    internal::AttributeQuadrics attributes(mesh, settings, welded.corners);
    internal::ContractionRecorder recorder(welded, attributes);
    const std::vector<internal::EdgeToKeep> seams = internal::find_seams(welded);
    internal::Contractor contractor(
        {.vertices = welded.places, .triangles = welded.triangles, .locked = locked},
        {.rules = &recorder,
         .edges_to_keep = seams,
         .error_ratio = internal::kErrorRatio,
         .may_change_topology = true});
    const SimplifyLevel last = {.triangles = settings.least_triangle_count};
    if (contractor.contract_to(last) != SimplifyStop::triangle_count && !settings.keeps_seams) {
        recorder.allow_all();
        contractor.retry_all();
        contractor.contract_to(last);
    }
    return recorder.take();
}

}  // namespace

void ProgressiveMesh::State::go_to(std::size_t wanted) {
    const std::vector<ContractionRecord::Change>& changes = recording->changes;
    const std::vector<std::size_t>& ends = recording->ends;
    const auto corner = [&](const ContractionRecord::Change& change) -> std::uint32_t& {
        return triangles[change.corner / 3][change.corner % 3];
    };
    for (; step < wanted; ++step) {
        for (std::size_t i = ends[step]; i < ends[step + 1]; ++i)
            corner(changes[i]) = changes[i].to;
    }
    for (; step > wanted; --step) {
        for (std::size_t i = ends[step]; i-- > ends[step - 1];)
            corner(changes[i]) = changes[i].from;
    }
}

Result<ProgressiveMesh> ProgressiveMesh::create(const TriangleMesh& mesh,
                                                const ProgressiveSettings& settings) {
    TERRANE_TRY(mesh.validate());
    TERRANE_TRY(internal::check_settings(mesh, settings));
    const internal::WeldedMesh welded = internal::weld(mesh);
    auto state = std::make_unique<State>();
    state->recording = std::make_shared<internal::Recording>(
        mesh, welded, record_contractions(mesh, settings, welded));
    state->triangles = state->recording->finest.triangles;
    return ProgressiveMesh(std::move(state));
}

ProgressiveMesh::ProgressiveMesh(std::unique_ptr<State> state) : state_(std::move(state)) {}
ProgressiveMesh::ProgressiveMesh(ProgressiveMesh&&) noexcept = default;
ProgressiveMesh& ProgressiveMesh::operator=(ProgressiveMesh&&) noexcept = default;
ProgressiveMesh::~ProgressiveMesh() = default;

ProgressiveMesh ProgressiveMesh::share() const {
    return ProgressiveMesh(std::make_unique<State>(*state_));
}

const TriangleMesh& ProgressiveMesh::finest() const { return state_->recording->finest; }
std::span<const std::uint32_t> ProgressiveMesh::input_vertices() const {
    return state_->recording->input_vertices;
}

std::span<const std::uint32_t> ProgressiveMesh::input_triangles() const {
    return state_->recording->input_triangles;
}

void ProgressiveMesh::set_triangle_count(std::size_t count) {
    state_->go_to(state_->recording->step_of_count(count));
}

void ProgressiveMesh::set_error(double error_m) {
    const std::vector<double>& errors = state_->recording->errors_m;
    const auto found = std::partition_point(errors.begin(), errors.end(),
                                            [&](double of_step) { return of_step <= error_m; });
    state_->go_to(static_cast<std::size_t>(std::max<std::ptrdiff_t>(found - errors.begin(), 1)) -
                  1);
}

std::span<const ProgressiveMesh::Triangle> ProgressiveMesh::triangles() const {
    return std::span(state_->triangles).first(state_->recording->triangle_counts[state_->step]);
}

std::span<const double> ProgressiveMesh::step_errors_m() const {
    return state_->recording->errors_m;
}
std::span<const std::uint32_t> ProgressiveMesh::step_triangle_counts() const {
    return state_->recording->triangle_counts;
}

std::size_t ProgressiveMesh::vertex_count() const {
    return state_->recording->vertex_counts[state_->step];
}
double ProgressiveMesh::error_m() const { return state_->recording->errors_m[state_->step]; }
std::size_t ProgressiveMesh::least_triangle_count() const {
    return state_->recording->triangle_counts.back();
}

std::vector<std::uint32_t> ProgressiveMesh::geomorph_targets(std::size_t coarser_count) const {
    const std::size_t step =
        std::max(state_->step, state_->recording->step_of_count(coarser_count));
    // a parent remains longer than its vertex, so it precedes the vertex
    std::vector<std::uint32_t> targets(vertex_count());
    for (std::uint32_t v = 0; v < targets.size(); ++v) {
        const std::uint32_t parent = state_->recording->parents[v];
        targets[v] = state_->recording->unused_from[v] > step || parent == v ? v : targets[parent];
    }
    return targets;
}

}  // namespace terrane
