// SPDX-License-Identifier: MIT
#pragma once

#include "base/aabb_tree.h"
#include "base/vector_math.h"
#include "mesh/star_mesh.h"
#include "mesh/tracked_points.h"

#include <terrane/terrain/simplify.h>

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace terrane::internal {

/// Fails: invalid_argument for 2^32 - 1 or more vertices, more than 1e9 triangles, or a number of locks that is neither
///        0 nor the number of vertices
Result<void> check_sizes(std::size_t vertex_count, std::size_t triangle_count,
                         std::size_t locked_count);

/// Fails: invalid_argument as simplify()
Result<void> check_simplify_input(const SimplifyInput& input,
                                  std::span<const SimplifyLevel> levels);

/// Sum of squared distances to weighted planes (Garland and Heckbert 1997), as a function of position: p' A p + 2 b' p
/// + c.
struct Quadric {
    double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;  ///< A, symmetric
    double x = 0.0, y = 0.0, z = 0.0;                                   ///< b
    double constant = 0.0;                                              ///< c

    void add_scaled(const Quadric& o, double scale) {
        xx += scale * o.xx;
        xy += scale * o.xy;
        xz += scale * o.xz;
        yy += scale * o.yy;
        yz += scale * o.yz;
        zz += scale * o.zz;
        x += scale * o.x;
        y += scale * o.y;
        z += scale * o.z;
        constant += scale * o.constant;
    }
    void add(const Quadric& o) { add_scaled(o, 1.0); }

    /// Adds `weight` times the square of the linear function gradient * p + offset.
    void add_square(const Eigen::Vector3d& gradient, double offset, double weight) {
        const double a = gradient[0], b = gradient[1], c = gradient[2];
        xx += weight * a * a;
        xy += weight * a * b;
        xz += weight * a * c;
        yy += weight * b * b;
        yz += weight * b * c;
        zz += weight * c * c;
        x += weight * a * offset;
        y += weight * b * offset;
        z += weight * c * offset;
        constant += weight * offset * offset;
    }

    /// Adds `weight` times the squared distance to a plane.
    /// @param normal unit
    void add_plane(const Eigen::Vector3d& normal, const Eigen::Vector3d& on_plane, double weight) {
        add_square(normal, -dot(normal, on_plane), weight);
    }

    /// The same function of p - step.
    Quadric translated(const Eigen::Vector3d& step) const;

    /// The position of the minimum. Where the function hardly depends on a direction, near `middle` in that direction.
    Eigen::Vector3d minimum(const Eigen::Vector3d& middle) const;

    /// Value at p, clamped to be non-negative despite rounding.
    double at(const Eigen::Vector3d& p) const {
        const double sum = p[0] * (xx * p[0] + 2.0 * (xy * p[1] + xz * p[2] + x)) +
                           p[1] * (yy * p[1] + 2.0 * (yz * p[2] + y)) +
                           p[2] * (zz * p[2] + 2.0 * z) + constant;
        return sum > 0.0 ? sum : 0.0;
    }
};

/// A contraction of a vertex onto a neighbour. Totally ordered by cost, vertex and target.
struct Candidate {
    double cost = 0.0;         ///< square metres, >= 0
    std::uint32_t vertex = 0;  ///< removed by the contraction
    std::uint32_t target = 0;  ///< the vertex it moves onto

    friend bool operator<(const Candidate& a, const Candidate& b) {
        if (a.cost != b.cost) return a.cost < b.cost;
        if (a.vertex != b.vertex) return a.vertex < b.vertex;
        return a.target < b.target;
    }
};

/// A binary heap with at most one, replaceable, candidate per vertex.
class VertexQueue {
public:
    explicit VertexQueue(std::size_t vertex_count) : places_(vertex_count, kAbsent) {}

    bool is_empty() const { return heap_.empty(); }
    const Candidate& first() const { return heap_.front(); }

    /// The candidate at an index of the heap; those at small indices are likely to come next. nullptr beyond the end.
    const Candidate* at(std::size_t place) const {
        return place < heap_.size() ? &heap_[place] : nullptr;
    }
    /// Prefetches a vertex's heap index.
    void prefetch(std::uint32_t vertex) const { __builtin_prefetch(&places_[vertex]); }
    /// The candidate of a vertex; nullptr if it has none. Valid until the next change.
    const Candidate* find(std::uint32_t vertex) const {
        const std::uint32_t place = places_[vertex];
        return place == kAbsent ? nullptr : &heap_[place];
    }

    /// Adds a candidate, or replaces the one of its vertex. Cost: O(log n)
    void set(const Candidate& candidate) {
        std::uint32_t place = places_[candidate.vertex];
        if (place == kAbsent) {
            place = static_cast<std::uint32_t>(heap_.size());
            heap_.push_back(candidate);
        }
        settle(place, candidate);
    }

    /// Removes a vertex's candidate, if it has one. Cost: O(log n)
    void erase(std::uint32_t vertex) {
        const std::uint32_t place = places_[vertex];
        if (place == kAbsent) return;
        places_[vertex] = kAbsent;
        const Candidate last = heap_.back();
        heap_.pop_back();
        if (place < heap_.size()) settle(place, last);
    }

private:
    static constexpr std::uint32_t kAbsent = ~std::uint32_t{0};

    void put(std::uint32_t place, const Candidate& candidate) {
        heap_[place] = candidate;
        places_[candidate.vertex] = place;
    }

    void settle(std::uint32_t place, const Candidate candidate) {
        while (place > 0 && candidate < heap_[(place - 1) / 2]) {
            put(place, heap_[(place - 1) / 2]);
            place = (place - 1) / 2;
        }
        const auto count = static_cast<std::uint32_t>(heap_.size());
        for (;;) {
            std::uint32_t child = 2 * place + 1;
            if (child >= count) break;
            if (child + 1 < count && heap_[child + 1] < heap_[child]) ++child;
            if (!(heap_[child] < candidate)) break;
            put(place, heap_[child]);
            place = child;
        }
        put(place, candidate);
    }

    std::vector<Candidate> heap_;
    std::vector<std::uint32_t> places_;  // [vertices] in heap_
};

/// Triangles of a connected component that can be removed because others are near.
struct Reduction {
    double error_m = 0.0;  ///< certified error of removing the triangles
    double turned_area =
        0.0;  ///< removed area with no similarly oriented triangle in `near`, square metres
    std::vector<std::uint32_t> removed = {};  ///< removed triangles
    std::vector<std::uint32_t> near = {};     ///< triangles within error_m of the removed ones
};

/// Connected components of a mesh that is being contracted, and reductions of small ones: closed components become open
/// sheets, sheets become single triangles, and these vanish.
class Components {
public:
    /// Components with more triangles are not reduced.
    static constexpr std::size_t kMostTriangles = 16;

    /// @param vertices, mesh, bounds must outlive this object
    Components(std::span<const Eigen::Vector3d> vertices, const StarMesh& mesh,
               std::span<const TriangleBound> bounds);

    std::size_t count() const { return ends_.size(); }
    std::uint32_t of_triangle(std::uint32_t triangle) const {
        return count() == 1 ? 0 : component_[triangle];
    }

    /// Remaining triangles of a component in increasing order. Valid until the next call.
    std::span<const std::uint32_t> triangles(std::uint32_t component);
    /// Whether the component is small enough for a reduction.
    bool is_small(std::uint32_t component) const { return left_[component] <= kMostTriangles; }
    /// Subtracts removed triangles. Returns true if the component has thereby become small.
    bool count_removed(std::uint32_t component, std::size_t gone);

    /// The reduction with the smallest error; none if all triangles are needed.
    std::optional<Reduction> find_reduction(std::uint32_t component);

private:
    Corners corners(std::uint32_t triangle) const;
    Reduction to_sheet(std::span<const std::uint32_t> all) const;
    std::optional<Reduction> to_others(std::uint32_t component, std::span<const std::uint32_t> all,
                                       double limit);
    void add_turned_area(Reduction& reduction) const;
    bool has_others_near(std::uint32_t component, std::span<const std::uint32_t> all,
                         double limit) const;
    double nearest_other(std::uint32_t component, const Corners& part, double limit,
                         std::uint32_t& other_out) const;
    void build_tree();

    std::span<const Eigen::Vector3d> vertices_;
    const StarMesh& mesh_;
    std::span<const TriangleBound> bounds_;
    std::vector<std::uint32_t> component_;  // [triangles]
    std::vector<std::uint32_t> list_;   // [triangles] by component; the remaining ones come first
    std::vector<std::size_t> begins_;   // [components] first index in list_
    std::vector<std::size_t> ends_;     // [components] end of the remaining ones in list_
    std::vector<std::size_t> left_;     // [components] number of remaining triangles
    std::vector<AabbNode> tree_;        // over the triangles that remained when it was built
    std::vector<std::uint32_t> items_;  // [leaves] triangles
    std::size_t alive_at_build_ = 0;
};

/// Callbacks of a contractor: may refuse contractions, add costs of attributes, and record what is contracted.
class ContractionRules {
public:
    virtual ~ContractionRules() = default;
    /// Whether u, the centre of the ring, may be contracted onto ring.vertices[0].
    virtual bool allows(std::uint32_t u, const Ring& ring) = 0;
    /// Additional cost of a contraction of u onto v, square metres, >= 0.
    virtual double cost(std::uint32_t u, std::uint32_t v) const = 0;
    /// Called before u is contracted onto ring.vertices[0].
    virtual void on_contraction(std::uint32_t u, const Ring& ring, double error_m) = 0;
    /// Called before triangles are removed.
    virtual void on_removal(std::span<const std::uint32_t> triangles, double error_m) = 0;
    /// Adds the additional cost of a contraction of u and v as a function of the position of the remaining vertex,
    /// relative to `origin`, with the best attributes for that position.
    virtual void add_cost(std::uint32_t u, std::uint32_t v, const Eigen::Vector3d& origin,
                          Quadric& sum) const = 0;
    /// Called after a contraction onto v that has moved v.
    virtual void on_move(std::uint32_t v, const Eigen::Vector3d& position) = 0;
};

/// Where a contraction puts the remaining vertex.
enum class Placement : std::uint8_t {
    endpoint,  ///< at the target
    optimal,   ///< where the quadrics are least
};

/// An edge that contractions should preserve, and the apex of a triangle at this edge.
struct EdgeToKeep {
    std::uint32_t from = 0, to = 0, apex = 0;  ///< vertices
};

/// Options of a contractor; the defaults are those of simplify().
struct ContractorOptions {
    ContractionRules* rules = nullptr;  ///< null: none
    std::span<const EdgeToKeep> edges_to_keep =
        {};  ///< in addition to borders; only used by the constructor
    /// A contraction is deferred while its certified error exceeds this multiple of the square root of its cost;
    /// infinity: quadrics alone determine the order.
    double error_ratio = std::numeric_limits<double>::infinity();
    /// Allows thin bodies to become sheets and small components to vanish, if that is cheapest.
    bool may_change_topology = false;
    /// With optimal placement, errors are distances of the input's vertices from the triangles near them: estimates,
    /// not certified.
    Placement placement = Placement::endpoint;
};

/// Contracts a mesh one vertex at a time, cheapest first.
class Contractor {
public:
    /// @param input checked; the viewed arrays must outlive this object
    explicit Contractor(const SimplifyInput& input, const ContractorOptions& options = {});

    /// Contracts until the mesh has at most the level's triangles, or no contraction is left within the level's error.
    SimplifyStop contract_to(const SimplifyLevel& level);

    /// The current mesh.
    SimplifiedMesh result() const;
    /// Whether a triangle of the input is in the current mesh, though with other vertices.
    bool is_left(std::size_t triangle) const { return mesh_.is_alive(triangle); }
    /// The current position of a vertex.
    const Eigen::Vector3d& position(std::uint32_t vertex) const { return vertices_[vertex]; }

    /// Retries all refused contractions, because the rules have changed. From now on the second certificate
    /// (contraction_bound.cpp) is tried for all components, not only for small ones.
    void retry_all();

private:
    enum class VertexKind : std::uint8_t { fixed, interior, border };
    enum class Attempt : std::uint8_t { done, refused, over_limit, deferred };
    struct VertexPlanes {
        Quadric quadric;
        double weight = 0.0;    ///< sum of the weights of the planes
        double own_cost = 0.0;  ///< the quadric's value at the vertex
    };

    bool is_locked(std::uint32_t vertex) const { return !locked_.empty() && locked_[vertex] != 0; }
    Eigen::Vector3d local(std::uint32_t vertex) const { return vertices_[vertex] - origin_; }

    void add_planes(std::span<const StarMesh::Triangle> triangles);
    void add_border_planes();
    void add_edge_plane(const EdgeToKeep& edge);
    void add_plane(std::uint32_t vertex, const Eigen::Vector3d& normal,
                   const Eigen::Vector3d& on_plane, double weight);
    void update_own_cost(std::uint32_t vertex);
    double cost(std::uint32_t u, std::uint32_t v) const;
    struct Place {
        Eigen::Vector3d position;  // relative to origin_
        double cost = 0.0;
    };
    Place best_place(std::uint32_t u, std::uint32_t v) const;
    bool is_placing() const { return options_.placement == Placement::optimal; }
    bool may_move(std::uint32_t u, std::uint32_t v) const;

    /// The cost with which a candidate is queued.
    double queued_cost(const Candidate& candidate) const {
        return least_costs_.empty() ? candidate.cost
                                    : std::max(candidate.cost, least_costs_[candidate.vertex]);
    }
    double reduction_cost(const Reduction& reduction) const;
    void queue_reductions();
    bool is_any_reduction_over_limit() const {
        return std::find(is_reduction_over_limit_.begin(), is_reduction_over_limit_.end(), 1) !=
               is_reduction_over_limit_.end();
    }
    void try_reduction(std::uint32_t component, double limit);
    void reduce(const Reduction& reduction);
    void queue_all();
    void queue_first(std::uint32_t u, const Neighbours& neighbours, const Candidate* after);
    void queue_best(std::uint32_t u);
    void queue_next(const Candidate& queued);
    void requeue(std::uint32_t w, std::uint32_t u, std::uint32_t v, std::size_t edge_triangles);

    void prefetch(const Ring& ring) const;
    Attempt try_contraction(const Candidate& candidate, double limit);
    bool evaluate(std::uint32_t u, const Ring& ring, double limit);
    Attempt try_placement(const Candidate& candidate, const Ring& ring, double limit);
    bool find_replaced(std::uint32_t u, const Ring& ring, bool moves,
                       const Eigen::Vector3d& position);
    bool are_replacements_good() const;
    bool folds_over(const Ring& ring);
    bool keeps_topology(std::uint32_t u, const Ring& ring);
    void contract(std::uint32_t u, const Ring& ring);

    std::vector<Eigen::Vector3d> moved_vertices_;  // [vertices]; empty if all are the input's
    std::span<const Eigen::Vector3d> vertices_;
    std::span<const std::uint8_t> locked_;
    bool may_join_locked_;
    ContractorOptions options_;
    StarMesh mesh_;
    std::vector<TriangleBound> bounds_;  // [triangles]
    std::vector<VertexKind> kinds_;      // [vertices] fixed: also removed vertices
    std::vector<VertexPlanes> planes_;   // [vertices]
    VertexQueue queue_;
    ContractionBound bound_;
    Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
    // [vertices] whether a contraction of the vertex exceeded this level's error
    std::vector<std::uint8_t> is_over_limit_;
    std::size_t over_limit_count_ = 0;
    // [vertices] whether the queued candidate is not the vertex's cheapest one, because cheaper ones were refused
    std::vector<std::uint8_t> had_refusal_;
    std::vector<double> least_costs_;  // [vertices] least cost of a queued candidate; may be empty
    std::optional<Components> components_;
    bool is_retrying_ = false;
    VertexQueue reductions_;  // [components]
    // [components] whether a reduction of the component exceeded this level's error
    std::vector<std::uint8_t> is_reduction_over_limit_;
    Ring ring_;                         // scratch
    Neighbours of_vertex_, of_target_;  // scratch

    // A triangle of u or of v before and after a contraction to a new position.
    struct Replacement {
        Eigen::Vector3d apex, second, third;  // before, relative to the new position of the apex
        bool is_next = false;  // the edge to `second` is the previous one's edge to `third`
    };
    std::optional<TrackedPoints> points_;
    std::vector<Replacement> replacements_;          // scratch
    std::vector<TrackedPoints::Target> targets_;     // [replacements_] scratch
    std::vector<std::uint32_t> replaced_triangles_;  // scratch: with those that are removed
    Ring target_ring_;                               // scratch
};

}  // namespace terrane::internal
