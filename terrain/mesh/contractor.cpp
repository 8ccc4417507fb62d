// SPDX-License-Identifier: MIT
//
// Sources: M. Garland, P. Heckbert. Surface Simplification Using Quadric Error Metrics. SIGGRAPH 1997.
//          P. Lindstrom, G. Turk. Fast and Memory Efficient Polygonal Simplification. IEEE Visualization 1998 (ties on
//          flat parts are resolved by length).
//          T. Dey et al. Topology preserving edge contraction. Publ. Inst. Math. 66, 1999 (the link condition).
// Deviations: half-edge contractions; costs are means over the area of the planes, so that they compare as squared
//             distances; quadrics only determine the order, ContractionBound decides.
#include "mesh/contractor.h"

#include "base/vector_math.h"

#include <algorithm>

namespace terrane::internal {
namespace {

// Weight of the plane that keeps a border edge in place, relative to the square of the edge's length.
constexpr double kBorderWeight = 4.0;
// The cost includes the square of a thousandth of the contraction's length. This determines the order on flat parts.
constexpr double kLengthWeight = 1e-6;
// Cost per area whose orientation is lost: a square costs as much as a move by a tenth of its side.
constexpr double kTurnedWeight = 0.01;
// A deferred contraction is performed if its cost has grown by at most this factor since it was deferred.
constexpr double kDeferredGrowth = 1.25;

}  // namespace

Contractor::Contractor(const SimplifyInput& input, const ContractorOptions& options)
    : vertices_(input.vertices),
      locked_(input.locked),
      may_join_locked_(input.may_join_locked),
      options_(options),
      mesh_(input.vertices.size(), input.triangles),
      bounds_(input.triangles.size()),
      kinds_(input.vertices.size(), VertexKind::fixed),
      planes_(input.vertices.size()),
      queue_(input.vertices.size()),
      bound_(vertices_, bounds_),
      is_over_limit_(input.vertices.size(), 0),
      had_refusal_(input.vertices.size(), 0),
      least_costs_(options.error_ratio < kInfinity ? input.vertices.size() : 0, 0.0),
      reductions_(0) {
    if (!vertices_.empty() && !input.triangles.empty()) origin_ = vertices_[input.triangles[0][0]];
    add_planes(input.triangles);
    for (std::uint32_t u = 0; u < vertices_.size(); ++u) {
        if (is_locked(u)) continue;
        if (!mesh_.find_ring(u, ring_)) continue;
        kinds_[u] = ring_.is_closed ? VertexKind::interior : VertexKind::border;
    }
    add_border_planes();
    for (const EdgeToKeep& edge : options.edges_to_keep) add_edge_plane(edge);
    for (std::uint32_t u = 0; u < vertices_.size(); ++u) update_own_cost(u);
    queue_all();
    if (!options.may_change_topology) return;
    components_.emplace(vertices_, mesh_, bounds_);
    reductions_ = VertexQueue(components_->count());
    is_reduction_over_limit_.resize(components_->count());
    for (std::uint32_t i = 0; i < components_->count(); ++i)
        is_reduction_over_limit_[i] = components_->is_small(i) ? 1 : 0;
}

void Contractor::retry_all() {
    is_retrying_ = true;
    queue_all();
}

void Contractor::queue_all() {
    for (std::uint32_t u = 0; u < vertices_.size(); ++u) queue_best(u);
}

SimplifyStop Contractor::contract_to(const SimplifyLevel& level) {
    for (std::uint32_t u = 0; u < vertices_.size(); ++u) {
        if (is_over_limit_[u] != 0) queue_best(u);
    }
    std::fill(is_over_limit_.begin(), is_over_limit_.end(), std::uint8_t{0});
    over_limit_count_ = 0;
    queue_reductions();
    while (mesh_.alive_count() > level.triangles) {
        if (!reductions_.is_empty() &&
            (queue_.is_empty() || reductions_.first().cost <= queue_.first().cost)) {
            try_reduction(reductions_.first().vertex, level.error_m);
            continue;
        }
        if (queue_.is_empty())
            return over_limit_count_ == 0 && !is_any_reduction_over_limit()
                       ? SimplifyStop::no_contraction
                       : SimplifyStop::error_limit;
        for (std::size_t i = 1; i <= 2; ++i) {
            if (const Candidate* const later = queue_.at(i)) mesh_.prefetch(later->vertex);
        }
        const Candidate candidate = queue_.first();
        switch (try_contraction(candidate, level.error_m)) {
            case Attempt::done:
                break;
            case Attempt::deferred:
                queue_.set({least_costs_[candidate.vertex], candidate.vertex, candidate.target});
                break;
            case Attempt::over_limit:
                over_limit_count_ += 1u - is_over_limit_[candidate.vertex];
                is_over_limit_[candidate.vertex] = 1;
                [[fallthrough]];
            case Attempt::refused:
                queue_next(candidate);
        }
    }
    return SimplifyStop::triangle_count;
}

SimplifiedMesh Contractor::result() const {
    SimplifiedMesh result;
    result.triangles.reserve(mesh_.alive_count());
    for (std::size_t i = 0; i < bounds_.size(); ++i) {
        if (!mesh_.is_alive(i)) continue;
        result.triangles.push_back(mesh_.triangle(i));
        result.error_m = std::max(result.error_m, bounds_[i].largest());
    }
    return result;
}

void Contractor::add_planes(std::span<const StarMesh::Triangle> triangles) {
    for (const StarMesh::Triangle& t : triangles) {
        const Eigen::Vector3d a = local(t[0]);
        const Eigen::Vector3d normal = cross(local(t[1]) - a, local(t[2]) - a);
        const double doubled = length(normal);
        if (!(doubled > 0.0)) continue;
        for (const std::uint32_t v : t) add_plane(v, normal / doubled, a, 0.5 * doubled);
    }
}

void Contractor::add_border_planes() {
    for (std::uint32_t u = 0; u < vertices_.size(); ++u) {
        if (kinds_[u] == VertexKind::interior || !mesh_.find_ring(u, ring_) || ring_.is_closed)
            continue;
        // only the edge from u to its first neighbour: the edge to its last neighbour is added at that neighbour
        add_edge_plane({u, ring_.vertices[0], ring_.vertices[1]});
    }
}

// Adds the plane that contains an edge and is orthogonal to the edge's triangle.
void Contractor::add_edge_plane(const EdgeToKeep& kept) {
    const Eigen::Vector3d from = local(kept.from), edge = local(kept.to) - from;
    const Eigen::Vector3d normal = cross(edge, cross(edge, local(kept.apex) - from));
    const double length_of_normal = length(normal);
    if (!(length_of_normal > 0.0)) return;
    for (const std::uint32_t v : {kept.from, kept.to})
        add_plane(v, normal / length_of_normal, from, kBorderWeight * dot(edge, edge));
}

void Contractor::add_plane(std::uint32_t vertex, const Eigen::Vector3d& normal,
                           const Eigen::Vector3d& on_plane, double weight) {
    planes_[vertex].quadric.add_plane(normal, on_plane, weight);
    planes_[vertex].weight += weight;
}

void Contractor::update_own_cost(std::uint32_t vertex) {
    planes_[vertex].own_cost = planes_[vertex].quadric.at(local(vertex));
}

double Contractor::cost(std::uint32_t u, std::uint32_t v) const {
    const Eigen::Vector3d edge = vertices_[v] - vertices_[u];
    const double weight = planes_[u].weight + planes_[v].weight;
    const double sum = planes_[u].quadric.at(local(v)) + planes_[v].own_cost;
    const double by_planes = (weight > 0.0 ? sum / weight : 0.0) + kLengthWeight * dot(edge, edge);
    return options_.rules == nullptr ? by_planes : by_planes + options_.rules->cost(u, v);
}

// Queues a vertex's cheapest candidate or, given `after`, the next one after it; removes the vertex if there is none.
void Contractor::queue_first(std::uint32_t u, const Neighbours& neighbours,
                             const Candidate* after) {
    Candidate best;
    bool is_found = false;
    for (std::size_t i = 0; i < neighbours.count; ++i) {
        if (kinds_[u] == VertexKind::border && neighbours.edge_triangles[i] != 1) continue;
        const std::uint32_t v = neighbours.vertices[i];
        const Candidate candidate = {cost(u, v), u, v};
        if (after != nullptr && !(*after < candidate)) continue;
        if (is_found && !(candidate < best)) continue;
        best = candidate;
        is_found = true;
    }
    had_refusal_[u] = static_cast<std::uint8_t>(after != nullptr);
    if (is_found) {
        best.cost = queued_cost(best);
        queue_.set(best);
    } else {
        queue_.erase(u);
    }
}

void Contractor::queue_best(std::uint32_t u) {
    if (kinds_[u] == VertexKind::fixed) return;
    mesh_.find_neighbours(u, of_vertex_);
    if (of_vertex_.has_all) queue_first(u, of_vertex_, nullptr);
}

void Contractor::queue_next(const Candidate& queued) {
    const std::uint32_t u = queued.vertex;
    const Candidate refused = {least_costs_.empty() ? queued.cost : cost(u, queued.target), u,
                               queued.target};
    mesh_.find_neighbours(u, of_vertex_);
    queue_first(u, of_vertex_, &refused);
}

// Equivalent to queue_best(w) after u was contracted onto v, a neighbour of w. Usually does not evaluate the other
// neighbours, whose costs have not changed.
void Contractor::requeue(std::uint32_t w, std::uint32_t u, std::uint32_t v,
                         std::size_t edge_triangles) {
    if (kinds_[w] == VertexKind::fixed) return;
    const Candidate* const queued = queue_.find(w);
    if (queued == nullptr || had_refusal_[w] != 0 || queued->target == u) return queue_best(w);
    Candidate present = *queued;
    // replaces the cost at which the candidate was deferred
    if (!least_costs_.empty() && present.cost <= least_costs_[w])
        present.cost = cost(w, present.target);
    Candidate candidate = {cost(w, v), w, v};
    const bool may_go = kinds_[w] != VertexKind::border || edge_triangles == 1;
    if (may_go && !(present < candidate)) {
        candidate.cost = queued_cost(candidate);
        return queue_.set(candidate);
    }
    if (present.target == v) queue_best(w);
}

// Prefetches the data of a contraction, which rarely shares cache lines with the previous contraction's.
void Contractor::prefetch(const Ring& ring) const {
    for (std::size_t i = 0; i < ring.count; ++i) {
        const std::uint32_t v = ring.vertices[i];
        __builtin_prefetch(&vertices_[v]);
        queue_.prefetch(v);
        mesh_.prefetch(v);
        const auto* const planes = reinterpret_cast<const char*>(&planes_[v]);
        __builtin_prefetch(planes);
        __builtin_prefetch(planes + 64);
        if (ring.triangles[i] == kNoTriangle) continue;
        const auto* const bound = reinterpret_cast<const char*>(&bounds_[ring.triangles[i]]);
        __builtin_prefetch(bound);
        __builtin_prefetch(bound + 64);
    }
}

Contractor::Attempt Contractor::try_contraction(const Candidate& candidate, double limit) {
    const std::uint32_t u = candidate.vertex, v = candidate.target;
    if (!mesh_.find_ring(u, ring_)) return Attempt::refused;
    prefetch(ring_);
    const auto place =
        std::find(ring_.vertices.begin(),
                  ring_.vertices.begin() + static_cast<std::ptrdiff_t>(ring_.count), v);
    const Ring ring = ring_.rotated(static_cast<std::size_t>(place - ring_.vertices.begin()));
    // if contractions may be deferred, keeps_topology() is tested last, because it rarely refuses
    const bool may_wait = !least_costs_.empty();
    if (!may_wait && !keeps_topology(u, ring)) return Attempt::refused;
    if (options_.rules != nullptr && !options_.rules->allows(u, ring)) return Attempt::refused;
    if (!evaluate(u, ring, limit)) return Attempt::refused;
    if (bound_.error() > limit) return Attempt::over_limit;
    if (may_wait) {
        const double least = bound_.error() / options_.error_ratio;
        if (least * least > candidate.cost * kDeferredGrowth) {
            least_costs_[u] = least * least;
            return Attempt::deferred;
        }
        if (!keeps_topology(u, ring)) return Attempt::refused;
    }
    for (std::size_t i = 1; i + 1 < ring.count; ++i) bounds_[ring.triangles[i]] = bound_.bound(i);
    if (options_.rules != nullptr) options_.rules->on_contraction(u, ring, bound_.error());
    contract(u, ring);
    return Attempt::done;
}

bool Contractor::evaluate(std::uint32_t u, const Ring& ring, double limit) {
    if (ring.count < 3) return false;  // a single triangle
    const bool is_good = bound_.evaluate(u, ring, limit);
    if (!components_) return is_good;
    const bool is_coarse =
        is_retrying_ || components_->is_small(components_->of_triangle(ring.triangles[1]));
    if (!is_coarse) return is_good;
    return (is_good || bound_.evaluate_along_edge(u, ring)) && !folds_over(ring);
}

// Whether a new triangle would be folded onto the triangle on the other side of its outer edge.
bool Contractor::folds_over(const Ring& ring) {
    for (std::size_t i = 1; i + 1 < ring.count; ++i) {
        const std::uint32_t from = ring.vertices[i + 1], to = ring.vertices[i];
        const std::uint32_t behind = mesh_.triangle_at(from, to);
        if (behind == kNoTriangle) continue;
        const StarMesh::Triangle& t = mesh_.triangle(behind);
        const std::uint32_t apex = t[0] != from && t[0] != to   ? t[0]
                                   : t[1] != from && t[1] != to ? t[1]
                                                                : t[2];
        const Eigen::Vector3d edge = vertices_[to] - vertices_[from];
        const Eigen::Vector3d normal = cross(edge, vertices_[apex] - vertices_[from]),
                              made = cross(vertices_[ring.vertices[0]] - vertices_[from], edge);
        if (dot(normal, made) < kFoldedCosine * length(normal) * length(made)) return true;
    }
    return false;
}

// The link condition: the only common neighbours of u and v are the apexes of their common triangles.
bool Contractor::keeps_topology(std::uint32_t u, const Ring& ring) {
    const std::uint32_t v = ring.vertices[0];
    mesh_.find_neighbours(v, of_target_);
    if (!of_target_.has_all) return false;
    std::size_t triangle_count = 0;
    for (std::size_t i = 0; i < of_target_.count; ++i)
        triangle_count += of_target_.edge_triangles[i];
    // each triangle is counted at two of v's edges
    const std::size_t after = triangle_count / 2 + ring.count - (ring.is_closed ? 4 : 3);
    if (after > kMaxValence) return false;
    const std::size_t last = ring.count - 1;
    for (std::size_t i = 1; i <= last; ++i) {
        const bool is_apex = (i == 1 && ring.triangles[0] != kNoTriangle) ||
                             (i == last && ring.triangles[last] != kNoTriangle);
        if (of_target_.contains(ring.vertices[i]) != is_apex) return false;
        // a new edge must not join locked vertices
        if (!is_apex && !may_join_locked_ && is_locked(v) && is_locked(ring.vertices[i]))
            return false;
    }
    return ring.count > 3 || !mesh_.has_triangle(v, ring.vertices[1], ring.vertices[2], u);
}

void Contractor::contract(std::uint32_t u, const Ring& ring) {
    const std::uint32_t v = ring.vertices[0];
    queue_.erase(u);
    if (components_) {
        const std::uint32_t component = components_->of_triangle(ring.triangles[1]);
        if (components_->count_removed(component, ring.is_closed ? 2 : 1))
            reductions_.set({0.0, component, 0});
    }
    mesh_.contract(u, ring);
    kinds_[u] = VertexKind::fixed;
    over_limit_count_ -= is_over_limit_[u];
    is_over_limit_[u] = 0;
    planes_[v].quadric.add(planes_[u].quadric);
    planes_[v].weight += planes_[u].weight;
    update_own_cost(v);
    mesh_.find_neighbours(v, of_target_);
    if (kinds_[v] != VertexKind::fixed && of_target_.has_all) queue_first(v, of_target_, nullptr);
    for (std::size_t i = 0; i < of_target_.count; ++i)
        requeue(of_target_.vertices[i], u, v, of_target_.edge_triangles[i]);
}

// Cost of a reduction, comparable with those of contractions: from its error, longest removed edge, and turned_area.
double Contractor::reduction_cost(const Reduction& reduction) const {
    const double ratio = options_.error_ratio < kInfinity ? options_.error_ratio : 1.0;
    double longest = 0.0;
    for (const std::uint32_t triangle : reduction.removed) {
        const StarMesh::Triangle& t = mesh_.triangle(triangle);
        for (std::size_t i = 0; i < 3; ++i) {
            const Eigen::Vector3d edge = vertices_[t[(i + 1) % 3]] - vertices_[t[i]];
            longest = std::max(longest, dot(edge, edge));
        }
    }
    const double error = reduction.error_m / ratio;
    return error * error + kLengthWeight * longest + kTurnedWeight * reduction.turned_area;
}

// Queues components that are small from the start, and those whose reduction exceeded the last level's error. Their
// costs are computed when no contraction is cheaper.
void Contractor::queue_reductions() {
    for (std::uint32_t i = 0; i < is_reduction_over_limit_.size(); ++i) {
        if (is_reduction_over_limit_[i] == 0) continue;
        is_reduction_over_limit_[i] = 0;
        reductions_.set({0.0, i, 0});
    }
}

void Contractor::try_reduction(std::uint32_t component, double limit) {
    const double queued = reductions_.first().cost;
    if (!locked_.empty()) {
        for (const std::uint32_t triangle : components_->triangles(component)) {
            for (const std::uint32_t v : mesh_.triangle(triangle)) {
                if (is_locked(v)) return reductions_.erase(component);
            }
        }
    }
    const std::optional<Reduction> reduction = components_->find_reduction(component);
    if (!reduction) return reductions_.erase(component);
    const double cost = reduction_cost(*reduction);
    if (cost > kDeferredGrowth * queued) return reductions_.set({cost, component, 0});
    if (reduction->error_m > limit) {
        is_reduction_over_limit_[component] = 1;
        return reductions_.erase(component);
    }
    reduce(*reduction);
    reductions_.set({0.0, component, 0});
}

void Contractor::reduce(const Reduction& reduction) {
    if (options_.rules != nullptr) options_.rules->on_removal(reduction.removed, reduction.error_m);
    for (const std::uint32_t triangle : reduction.near)
        bounds_[triangle].include(reduction.error_m);
    std::vector<std::uint32_t> around;
    for (const std::uint32_t triangle : reduction.removed) {
        const StarMesh::Triangle& t = mesh_.triangle(triangle);
        around.insert(around.end(), t.begin(), t.end());
        components_->count_removed(components_->of_triangle(triangle), 1);
        mesh_.remove(triangle);
    }
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    for (const std::uint32_t u : around) {
        queue_.erase(u);
        over_limit_count_ -= is_over_limit_[u];
        is_over_limit_[u] = 0;
        kinds_[u] = VertexKind::fixed;
        if (!mesh_.find_ring(u, ring_)) continue;
        kinds_[u] = ring_.is_closed ? VertexKind::interior : VertexKind::border;
    }
    for (const std::uint32_t u : around) queue_best(u);
}

}  // namespace terrane::internal
