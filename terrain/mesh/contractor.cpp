// SPDX-License-Identifier: MIT
//
// Sources: M. Garland, P. Heckbert. Surface Simplification Using Quadric Error Metrics. SIGGRAPH 1997.
//          P. Lindstrom, G. Turk. Fast and Memory Efficient Polygonal Simplification. IEEE Visualization 1998 (ties on
//          flat parts are resolved by length).
//          T. Dey et al. Topology preserving edge contraction. Publ. Inst. Math. 66, 1999 (the link condition).
// Deviations: costs are means over the area of the planes, so that they compare as squared distances. With
//             Placement::endpoint, half-edge contractions: quadrics only determine the order, ContractionBound decides.
//             With Placement::optimal, the distances of tracked points of the input decide in its place.
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
// Weight of the squared distance from the middle of an edge in the minimum of a quadric, relative to the quadric's
// trace: a direction along which normals turn by less than a hundredth of a radian hardly counts.
constexpr double kMiddleWeight = 1e-4;
// Least cosine of the angle between the normals of a triangle before and after a contraction, and least ratio of height
// to longest edge afterwards, unless one of the old triangles is worse: as in contraction_bound.cpp.
constexpr double kLeastTurnCosine = 0.2;
constexpr double kLeastPlacedShape = 0.02;
constexpr double kLeastPlacedShapeEver = 1e-5;

}  // namespace

// With s = step, x' A x + 2 b' x + c at x = p - s is p' A p + 2 (b - A s)' p + s' A s - 2 b' s + c.
Quadric Quadric::translated(const Eigen::Vector3d& s) const {
    const Eigen::Vector3d turned = {xx * s[0] + xy * s[1] + xz * s[2],
                                    xy * s[0] + yy * s[1] + yz * s[2],
                                    xz * s[0] + yz * s[1] + zz * s[2]};
    Quadric result = *this;
    result.x -= turned[0];
    result.y -= turned[1];
    result.z -= turned[2];
    result.constant += dot(s, turned) - 2.0 * (x * s[0] + y * s[1] + z * s[2]);
    return result;
}

// Solves (A + w I) step = -(A middle + b) by Cholesky factors; w keeps the matrix positive definite.
Eigen::Vector3d Quadric::minimum(const Eigen::Vector3d& middle) const {
    const double w = kMiddleWeight * (xx + yy + zz);
    if (!(w > 0.0)) return middle;
    const Eigen::Vector3d slope = {xx * middle[0] + xy * middle[1] + xz * middle[2] + x,
                                   xy * middle[0] + yy * middle[1] + yz * middle[2] + y,
                                   xz * middle[0] + yz * middle[1] + zz * middle[2] + z};
    const double l00 = std::sqrt(xx + w), l10 = xy / l00, l20 = xz / l00;
    const double l11 = std::sqrt(std::max(yy + w - l10 * l10, w));
    const double l21 = (yz - l20 * l10) / l11;
    const double l22 = std::sqrt(std::max(zz + w - l20 * l20 - l21 * l21, w));
    const double a = -slope[0] / l00, b = (-slope[1] - l10 * a) / l11,
                 c = (-slope[2] - l20 * a - l21 * b) / l22;
    const double step_z = c / l22, step_y = (b - l21 * step_z) / l11,
                 step_x = (a - l10 * step_y - l20 * step_z) / l00;
    return middle + Eigen::Vector3d(step_x, step_y, step_z);
}

Contractor::Contractor(const SimplifyInput& input, const ContractorOptions& options)
    : moved_vertices_(
          options.placement == Placement::optimal
              ? std::vector<Eigen::Vector3d>(input.vertices.begin(), input.vertices.end())
              : std::vector<Eigen::Vector3d>()),
      vertices_(options.placement == Placement::optimal
                    ? std::span<const Eigen::Vector3d>(moved_vertices_)
                    : input.vertices),
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
    if (is_placing()) points_.emplace(vertices_, input.triangles);
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
    if (is_placing()) return best_place(u, v).cost;
    const Eigen::Vector3d edge = vertices_[v] - vertices_[u];
    const double weight = planes_[u].weight + planes_[v].weight;
    const double sum = planes_[u].quadric.at(local(v)) + planes_[v].own_cost;
    const double by_planes = (weight > 0.0 ? sum / weight : 0.0) + kLengthWeight * dot(edge, edge);
    return options_.rules == nullptr ? by_planes : by_planes + options_.rules->cost(u, v);
}

// Whether a contraction of u and v may move v. A vertex of a border moves only with another one of the border.
bool Contractor::may_move(std::uint32_t u, std::uint32_t v) const {
    return kinds_[v] != VertexKind::fixed &&
           (kinds_[v] == VertexKind::interior || kinds_[u] == VertexKind::border);
}

// The sum of the quadrics, as means over the area, at its minimum. If that is farther from the edge's middle than the
// edge is long, the best of both ends and the middle instead: the planes are then nearly parallel.
Contractor::Place Contractor::best_place(std::uint32_t u, std::uint32_t v) const {
    Quadric sum;
    const double weight = planes_[u].weight + planes_[v].weight;
    if (weight > 0.0) {
        sum.add_scaled(planes_[u].quadric, 1.0 / weight);
        sum.add_scaled(planes_[v].quadric, 1.0 / weight);
    }
    if (options_.rules != nullptr) options_.rules->add_cost(u, v, origin_, sum);
    const Eigen::Vector3d from = local(u), to = local(v), edge = to - from;
    Place place{to, sum.at(to)};
    if (may_move(u, v)) {
        const Eigen::Vector3d middle = 0.5 * (from + to), best = sum.minimum(middle);
        const Eigen::Vector3d step = best - middle;
        if (dot(step, step) <= dot(edge, edge)) {
            place = {best, sum.at(best)};
        } else {
            for (const Eigen::Vector3d& other : {from, middle}) {
                const double cost = sum.at(other);
                if (cost < place.cost) place = {other, cost};
            }
        }
    }
    place.cost += kLengthWeight * dot(edge, edge);
    return place;
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
    if (is_placing()) return try_placement(candidate, ring, limit);
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

Contractor::Attempt Contractor::try_placement(const Candidate& candidate, const Ring& ring,
                                              double limit) {
    const std::uint32_t u = candidate.vertex, v = candidate.target;
    if (ring.count < 3) return Attempt::refused;  // a single triangle
    const bool moves = may_move(u, v);
    const Eigen::Vector3d position =
        moves ? Eigen::Vector3d(origin_ + best_place(u, v).position) : vertices_[v];
    if (!find_replaced(u, ring, moves, position) || !are_replacements_good())
        return Attempt::refused;
    const double error = points_->measure(replaced_triangles_, targets_, limit);
    if (error > limit) return Attempt::over_limit;
    const double least = error / options_.error_ratio;
    if (least * least > candidate.cost * kDeferredGrowth) {
        least_costs_[u] = least * least;
        return Attempt::deferred;
    }
    if (!keeps_topology(u, ring)) return Attempt::refused;
    points_->commit();
    for (std::size_t i = 0; i < targets_.size(); ++i) {
        bounds_[targets_[i].triangle] = {};
        bounds_[targets_[i].triangle].include(points_->error(i));
    }
    if (options_.rules != nullptr) options_.rules->on_contraction(u, ring, error);
    if (moves) {
        moved_vertices_[v] = position;
        if (options_.rules != nullptr) options_.rules->on_move(v, position);
    }
    contract(u, ring);
    return Attempt::done;
}

// The triangles of u and, if v moves, of v, before and after. Returns false if those of v are no disk or half disk.
bool Contractor::find_replaced(std::uint32_t u, const Ring& ring, bool moves,
                               const Eigen::Vector3d& position) {
    replacements_.clear();
    targets_.clear();
    replaced_triangles_.clear();
    const auto add = [&](const Ring& around, std::uint32_t apex, std::size_t i) {
        const Eigen::Vector3d &second = vertices_[around.vertices[i]],
                              &third = vertices_[around.vertices[i + 1 < around.count ? i + 1 : 0]];
        replacements_.push_back(
            {vertices_[apex] - position, second - position, third - position, i > 1});
        targets_.push_back({around.triangles[i], {position, second, third}});
    };
    const std::uint32_t v = ring.vertices[0];
    for (std::size_t i = 0; i < ring.count; ++i) {
        if (ring.triangles[i] != kNoTriangle) replaced_triangles_.push_back(ring.triangles[i]);
    }
    for (std::size_t i = 1; i + 1 < ring.count; ++i) {
        if (ring.triangles[i] != kNoTriangle) add(ring, u, i);
    }
    if (!moves) return true;
    if (!mesh_.find_ring(v, target_ring_)) return false;
    const auto place = std::find(
        target_ring_.vertices.begin(),
        target_ring_.vertices.begin() + static_cast<std::ptrdiff_t>(target_ring_.count), u);
    const Ring around =
        target_ring_.rotated(static_cast<std::size_t>(place - target_ring_.vertices.begin()));
    for (std::size_t i = 1; i + 1 < around.count; ++i) {
        if (around.triangles[i] == kNoTriangle) continue;
        replaced_triangles_.push_back(around.triangles[i]);
        add(around, v, i);
    }
    return true;
}

// Whether no triangle is turned, folded onto its neighbour, or becomes a sliver where there was none before.
bool Contractor::are_replacements_good() const {
    const auto shape = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                          const Eigen::Vector3d& normal) {
        const Eigen::Vector3d edge = b - a;
        return length(normal) / std::max({dot(a, a), dot(b, b), dot(edge, edge)});
    };
    double worst_old = kLeastPlacedShape;
    for (const Replacement& r : replacements_) {
        const Eigen::Vector3d a = r.second - r.apex, b = r.third - r.apex;
        worst_old = std::min(worst_old, shape(a, b, cross(a, b)));
    }
    const double least = std::max(worst_old, kLeastPlacedShapeEver);
    Eigen::Vector3d before = Eigen::Vector3d::Zero();
    for (const Replacement& r : replacements_) {
        const Eigen::Vector3d normal = cross(r.second, r.third),
                              old_normal = cross(r.second - r.apex, r.third - r.apex);
        if (!(shape(r.second, r.third, normal) >= least)) return false;
        if (!(dot(normal, old_normal) >= kLeastTurnCosine * length(normal) * length(old_normal)))
            return false;
        if (r.is_next && !(dot(normal, before) >= kFoldedCosine * length(normal) * length(before)))
            return false;
        before = normal;
    }
    return true;
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
    if (points_) {
        targets_.clear();
        for (const std::uint32_t triangle : reduction.near) {
            const StarMesh::Triangle& t = mesh_.triangle(triangle);
            targets_.push_back({triangle, {vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]}});
        }
        points_->measure(reduction.removed, targets_, kInfinity);
        points_->commit();
    }
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
