// SPDX-License-Identifier: MIT
#include "progressive/contraction_recorder.h"

#include "base/vector_math.h"

#include <algorithm>

namespace terrane::internal {
namespace {

constexpr std::uint32_t kNone = ~std::uint32_t{0};

}  // namespace

ContractionRecorder::ContractionRecorder(const WeldedMesh& mesh, AttributeQuadrics& attributes)
    : mesh_(mesh),
      attributes_(attributes),
      corners_(mesh.corners),
      use_counts_(mesh.place_of_vertex.size(), 0) {
    for (const TriangleMesh::Triangle& t : corners_) {
        for (const std::uint32_t v : t) ++use_counts_[v];
    }
    record_.removed_at.assign(corners_.size(), ContractionRecord::kNever);
    for (std::uint32_t v = 0; v < use_counts_.size(); ++v) {
        record_.unused_from.push_back(use_counts_[v] == 0 ? 0 : ContractionRecord::kNever);
        record_.parents.push_back(v);
    }
}

// The vertex of ring.vertices[0] in the triangles of the edge to it that have this vertex of u: where a vertex goes
// when its place moves along the edge. kNone where they have not; not unique where the two sides differ.
std::uint32_t ContractionRecorder::partner(std::uint32_t vertex, const Ring& ring,
                                           bool& is_unique_out) const {
    is_unique_out = true;
    std::uint32_t found = kNone;
    // Triangle 0 is (u, target, ...), the last one (u, ..., target).
    for (const std::size_t i : {std::size_t{0}, ring.count - 1}) {
        const std::uint32_t triangle = ring.triangles[i];
        if (triangle == kNoTriangle) continue;
        const std::size_t corner = ring.corners[i];
        if (corner_vertex(triangle, corner) != vertex) continue;
        const std::uint32_t other = corner_vertex(triangle, corner + (i == 0 ? 1 : 2));
        if (found == kNone) {
            found = other;
        } else if (found != other) {
            is_unique_out = false;
            if (attributes_.difference(vertex, other) < attributes_.difference(vertex, found))
                found = other;
        }
    }
    return found;
}

bool ContractionRecorder::allows(std::uint32_t /*u*/, const Ring& ring) {
    if (allows_all_) return true;
    for (std::size_t i = 0; i < ring.count; ++i) {
        if (ring.triangles[i] == kNoTriangle) continue;
        bool is_unique = true;
        const std::uint32_t vertex = corner_vertex(ring.triangles[i], ring.corners[i]);
        if (partner(vertex, ring, is_unique) == kNone || !is_unique) return false;
    }
    return true;
}

double ContractionRecorder::cost(std::uint32_t u, std::uint32_t v) const {
    const auto of_u = mesh_.vertices_at(u), of_v = mesh_.vertices_at(v);
    // Places with more are not contracted.
    if (attributes_.is_empty() || std::max(of_u.size(), of_v.size()) > kMaxValence) return 0.0;
    double sum = 0.0;
    for (const std::uint32_t from : of_u) {
        if (use_counts_[from] == 0) continue;
        double least = kInfinity;
        for (const std::uint32_t to : of_v) {
            if (use_counts_[to] != 0) least = std::min(least, attributes_.cost(from, to));
        }
        if (least < kInfinity) sum += least;
    }
    return sum;
}

// The vertex in use at a place with the nearest attributes; kNone where none is in use.
std::uint32_t ContractionRecorder::nearest(std::uint32_t vertex, std::uint32_t place) const {
    std::uint32_t best = kNone;
    double least = kInfinity;
    for (const std::uint32_t other : mesh_.vertices_at(place)) {
        if (use_counts_[other] == 0 || other == vertex) continue;
        const double difference = attributes_.difference(vertex, other);
        if (best != kNone && !(difference < least)) continue;
        least = difference;
        best = other;
    }
    return best;
}

void ContractionRecorder::on_contraction(std::uint32_t u, const Ring& ring, double error_m) {
    const std::uint32_t v = ring.vertices[0];
    for (const std::uint32_t vertex : mesh_.vertices_at(u)) {
        if (use_counts_[vertex] == 0) continue;
        bool is_unique = true;
        std::uint32_t to = partner(vertex, ring, is_unique);
        if (to == kNone) to = nearest(vertex, v);
        record_.parents[vertex] = to;
        record_.unused_from[vertex] = steps_with_this();
        attributes_.add(vertex, to);
    }
    for (std::size_t i = 0; i < ring.count; ++i) {
        const std::uint32_t triangle = ring.triangles[i];
        if (triangle == kNoTriangle) continue;
        if (i == 0 || i + 1 == ring.count) {
            remove(triangle);
            continue;
        }
        const std::uint32_t corner = 3 * triangle + ring.corners[i];
        std::uint32_t& vertex = corners_[triangle][ring.corners[i]];
        const std::uint32_t to = record_.parents[vertex];
        record_.changes.push_back({corner, vertex, to});
        --use_counts_[vertex];
        ++use_counts_[to];
        vertex = to;
    }
    retire(v);
    // A partner that has lost its last triangle in the same step hands its vertices on, so that parents stay longer.
    for (const std::uint32_t vertex : mesh_.vertices_at(u)) {
        if (record_.unused_from[vertex] != steps_with_this()) continue;
        std::uint32_t& parent = record_.parents[vertex];
        if (use_counts_[parent] == 0) parent = record_.parents[parent];
    }
    // The apexes of the triangles that went.
    retire(ring.vertices[1]);
    retire(ring.vertices[ring.count - 1]);
    end_step(error_m);
}

void ContractionRecorder::on_removal(std::span<const std::uint32_t> triangles, double error_m) {
    for (const std::uint32_t triangle : triangles) remove(triangle);
    for (const std::uint32_t triangle : triangles) {
        for (const std::uint32_t vertex : corners_[triangle]) retire(mesh_.place_of_vertex[vertex]);
    }
    end_step(error_m);
}

void ContractionRecorder::remove(std::uint32_t triangle) {
    record_.removed_at[triangle] = steps_with_this();
    for (const std::uint32_t vertex : corners_[triangle]) --use_counts_[vertex];
}

void ContractionRecorder::end_step(double error_m) {
    record_.ends.push_back(record_.changes.size());
    record_.errors_m.push_back(
        std::max(error_m, record_.errors_m.empty() ? 0.0 : record_.errors_m.back()));
}

// Vertices of a place that have lost their last triangle in this step.
void ContractionRecorder::retire(std::uint32_t place) {
    for (const std::uint32_t vertex : mesh_.vertices_at(place)) {
        if (use_counts_[vertex] != 0 || record_.unused_from[vertex] != ContractionRecord::kNever)
            continue;
        record_.unused_from[vertex] = steps_with_this();
        const std::uint32_t other = nearest(vertex, place);
        if (other == kNone) continue;
        record_.parents[vertex] = other;
        attributes_.add(vertex, other);
    }
}

std::vector<EdgeToKeep> find_seams(const WeldedMesh& mesh) {
    struct Side {
        std::uint32_t low, high;        // places
        std::uint32_t triangle, first;  // corner
    };
    std::vector<Side> sides;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t a = mesh.triangles[i][k], b = mesh.triangles[i][(k + 1) % 3];
            if (mesh.vertices_at(a).size() + mesh.vertices_at(b).size() == 2) continue;
            sides.push_back({std::min(a, b), std::max(a, b), i, k});
        }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
        if (a.low != b.low) return a.low < b.low;
        if (a.high != b.high) return a.high < b.high;
        return a.triangle < b.triangle;
    });
    const auto vertex_at = [&](const Side& side, std::uint32_t place) {
        const std::uint32_t k = side.first;
        return mesh.triangles[side.triangle][k] == place ? mesh.corners[side.triangle][k]
                                                         : mesh.corners[side.triangle][(k + 1) % 3];
    };
    std::vector<EdgeToKeep> seams;
    for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
        const Side &a = sides[i], &b = sides[i + 1];
        if (a.low != b.low || a.high != b.high) continue;
        if (vertex_at(a, a.low) == vertex_at(b, a.low) &&
            vertex_at(a, a.high) == vertex_at(b, a.high))
            continue;
        for (const Side& side : {a, b})
            seams.push_back({mesh.triangles[side.triangle][side.first],
                             mesh.triangles[side.triangle][(side.first + 1) % 3],
                             mesh.triangles[side.triangle][(side.first + 2) % 3]});
    }
    return seams;
}

}  // namespace terrane::internal
