// SPDX-License-Identifier: MIT
//
// Source: H. Hoppe. Progressive Meshes. SIGGRAPH 1996.
// Deviations: half-edge contractions over one list of vertices, hence no positions in the record. Triangles are sorted
// by when they go, so that those of a level are the first ones and a step is a change of indices.
#include "progressive/attribute_quadrics.h"
#include "progressive/contraction_recorder.h"
#include "progressive/welded_mesh.h"
#include "simplify/contractor.h"
#include "simplify/input_checks.h"

#include <terrane/terrain/number_text.h>
#include <terrane/terrain/progressive_mesh.h>

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

namespace terrane {

using internal::ContractionRecord;

struct ProgressiveMesh::State {
    TriangleMesh finest;
    std::vector<std::uint32_t> input_vertices, input_triangles;
    std::vector<Triangle>
        triangles;         ///< of the present level, then those that are gone as they last were
    std::size_t step = 0;  ///< the present level
    // Of each step: the end of its changes, and the counts after it. [steps + 1], the first is the finest level.
    std::vector<ContractionRecord::Change> changes;
    std::vector<std::size_t> ends;
    std::vector<std::uint32_t> triangle_counts, vertex_counts;
    std::vector<double> errors_m;
    std::vector<std::uint32_t> unused_from, parents;  ///< [vertices]

    void go_to(std::size_t wanted);
    std::size_t step_of_count(std::size_t count) const;
};

namespace {

constexpr double kLargestWeight = 1e3;
// How far the certified error of a contraction may be above the root of its cost before it waits. Measured on a fractal
// of 500,000 triangles (docs/simplify.md): at 2 distances are a tenth smaller in a third more time.
constexpr double kErrorRatio = 3.0;

Result<void> check_settings(const TriangleMesh& mesh, const ProgressiveSettings& settings) {
    const std::pair<const char*, double> weights[] = {
        {"normal_weight", settings.normal_weight},
        {"texture_coordinate_weight", settings.texture_coordinate_weight},
        {"colour_weight", settings.colour_weight}};
    for (const auto& [name, weight] : weights) {
        if (weight >= 0.0 && weight <= kLargestWeight) continue;
        return fail(ErrorCode::invalid_argument, std::string(name) + " must be from 0 to " +
                                                     number_text(kLargestWeight) + ", got " +
                                                     number_text(weight));
    }
    return internal::check_sizes(mesh.positions.size(), mesh.triangles.size(),
                                 settings.locked.size());
}

ContractionRecord record_contractions(const TriangleMesh& mesh, const ProgressiveSettings& settings,
                                      const internal::WeldedMesh& welded) {
    std::vector<std::uint8_t> locked(welded.places.size(), 0);
    for (std::size_t v = 0; v < settings.locked.size(); ++v) {
        if (settings.locked[v] != 0) locked[welded.place_of_vertex[v]] = 1;
    }
    internal::AttributeQuadrics attributes(mesh, settings, welded.corners);
    internal::ContractionRecorder recorder(welded, attributes);
    const std::vector<internal::EdgeToKeep> seams = internal::find_seams(welded);
    internal::Contractor contractor(
        {.vertices = welded.places, .triangles = welded.triangles, .locked = locked},
        {.rules = &recorder,
         .edges_to_keep = seams,
         .error_ratio = kErrorRatio,
         .may_change_topology = true});
    const SimplifyLevel last = {.triangles = settings.least_triangle_count};
    if (contractor.contract_to(last) != SimplifyStop::triangle_count) {
        recorder.allow_all();
        contractor.retry_all();
        contractor.contract_to(last);
    }
    return recorder.take();
}

// Indices in the order of when they go, the last first; of those that go together the first first.
std::vector<std::uint32_t> order_by(const std::vector<std::uint32_t>& gone_at, std::size_t steps) {
    // Counting sort: there are at most as many steps as triangles.
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

// [steps + 1] how many are not gone after that many steps.
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

void ProgressiveMesh::State::go_to(std::size_t wanted) {
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

std::size_t ProgressiveMesh::State::step_of_count(std::size_t count) const {
    // Counts fall from step to step.
    const auto found = std::partition_point(triangle_counts.begin(), triangle_counts.end(),
                                            [&](std::uint32_t of_step) { return of_step > count; });
    return std::min(static_cast<std::size_t>(found - triangle_counts.begin()),
                    triangle_counts.size() - 1);
}

Result<ProgressiveMesh> ProgressiveMesh::create(const TriangleMesh& mesh,
                                                const ProgressiveSettings& settings) {
    if (auto ok = check(mesh); !ok) return tl::unexpected<Error>(ok.error());
    if (auto ok = check_settings(mesh, settings); !ok) return tl::unexpected<Error>(ok.error());
    const internal::WeldedMesh welded = internal::weld(mesh);
    ContractionRecord record = record_contractions(mesh, settings, welded);
    const std::size_t steps = record.ends.size();

    const std::vector<std::uint32_t> vertices = order_by(record.unused_from, steps),
                                     triangles = order_by(record.removed_at, steps);
    const std::vector<std::uint32_t> vertex_of = inverse_of(vertices),
                                     triangle_of = inverse_of(triangles);
    auto state = std::make_unique<State>();
    state->finest.positions = permuted(mesh.positions, vertices);
    state->finest.normals = permuted(mesh.normals, vertices);
    state->finest.texture_coordinates = permuted(mesh.texture_coordinates, vertices);
    state->finest.colours = permuted(mesh.colours, vertices);
    state->triangles = permuted(welded.corners, triangles);
    for (Triangle& t : state->triangles) {
        for (std::uint32_t& v : t) v = vertex_of[v];
    }
    state->finest.triangles = state->triangles;
    for (ContractionRecord::Change& change : record.changes)
        change = {3 * triangle_of[change.corner / 3] + change.corner % 3, vertex_of[change.from],
                  vertex_of[change.to]};
    state->changes = std::move(record.changes);
    state->ends = {0};
    state->ends.insert(state->ends.end(), record.ends.begin(), record.ends.end());
    state->errors_m = {0.0};
    state->errors_m.insert(state->errors_m.end(), record.errors_m.begin(), record.errors_m.end());
    state->triangle_counts = counts_left(record.removed_at, steps);
    state->vertex_counts = counts_left(record.unused_from, steps);
    state->unused_from = permuted(record.unused_from, vertices);
    state->parents = permuted(record.parents, vertices);
    for (std::uint32_t& parent : state->parents) parent = vertex_of[parent];
    state->input_vertices = vertices;
    state->input_triangles = permuted(welded.input_triangles, triangles);
    return ProgressiveMesh(std::move(state));
}

ProgressiveMesh::ProgressiveMesh(std::unique_ptr<State> state) : state_(std::move(state)) {}
ProgressiveMesh::ProgressiveMesh(ProgressiveMesh&&) noexcept = default;
ProgressiveMesh& ProgressiveMesh::operator=(ProgressiveMesh&&) noexcept = default;
ProgressiveMesh::~ProgressiveMesh() = default;

const TriangleMesh& ProgressiveMesh::finest() const { return state_->finest; }
std::span<const std::uint32_t> ProgressiveMesh::input_vertices() const {
    return state_->input_vertices;
}

std::span<const std::uint32_t> ProgressiveMesh::input_triangles() const {
    return state_->input_triangles;
}

void ProgressiveMesh::set_triangle_count(std::size_t count) {
    state_->go_to(state_->step_of_count(count));
}

void ProgressiveMesh::set_error(double error_m) {
    const std::vector<double>& errors = state_->errors_m;
    const auto found = std::partition_point(errors.begin(), errors.end(),
                                            [&](double of_step) { return of_step <= error_m; });
    state_->go_to(static_cast<std::size_t>(std::max<std::ptrdiff_t>(found - errors.begin(), 1)) -
                  1);
}

std::span<const ProgressiveMesh::Triangle> ProgressiveMesh::triangles() const {
    return std::span(state_->triangles).first(state_->triangle_counts[state_->step]);
}

std::size_t ProgressiveMesh::vertex_count() const { return state_->vertex_counts[state_->step]; }
double ProgressiveMesh::error_m() const { return state_->errors_m[state_->step]; }
std::size_t ProgressiveMesh::least_triangle_count() const { return state_->triangle_counts.back(); }

std::vector<std::uint32_t> ProgressiveMesh::geomorph_targets(std::size_t coarser_count) const {
    const std::size_t step = std::max(state_->step, state_->step_of_count(coarser_count));
    // A parent stays longer than its vertex, so that it comes before it.
    std::vector<std::uint32_t> targets(vertex_count());
    for (std::uint32_t v = 0; v < targets.size(); ++v) {
        const std::uint32_t parent = state_->parents[v];
        targets[v] = state_->unused_from[v] > step || parent == v ? v : targets[parent];
    }
    return targets;
}

}  // namespace terrane
