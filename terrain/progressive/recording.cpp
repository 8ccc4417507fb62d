// SPDX-License-Identifier: MIT
#include "progressive/recording.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace terrane::internal {
namespace {

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
    // Counts fall from step to step.
    const auto found = std::partition_point(triangle_counts.begin(), triangle_counts.end(),
                                            [&](std::uint32_t of_step) { return of_step > count; });
    return std::min(static_cast<std::size_t>(found - triangle_counts.begin()),
                    triangle_counts.size() - 1);
}

}  // namespace terrane::internal
