// SPDX-License-Identifier: MIT
#pragma once

#include "simplify/bounds/contraction_bound.h"
#include "simplify/bounds/star_mesh.h"
#include "simplify/components.h"
#include "simplify/quadric.h"
#include "simplify/vertex_queue.h"

#include <terrane/terrain/simplify.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace terrane::internal {

/// Callbacks of a contractor: costs of attributes, and a record of the contractions.
class ContractionRules {
public:
    virtual ~ContractionRules() = default;
    /// Whether u, whose triangles are the ring's, may be contracted onto ring.vertices[0].
    virtual bool allows(std::uint32_t u, const Ring& ring) = 0;
    /// Added to the cost of a contraction of u onto v, square metres, >= 0.
    virtual double cost(std::uint32_t u, std::uint32_t v) const = 0;
    /// Before u is contracted onto ring.vertices[0].
    virtual void on_contraction(std::uint32_t u, const Ring& ring, double error_m) = 0;
    /// Before triangles are taken out.
    virtual void on_removal(std::span<const std::uint32_t> triangles, double error_m) = 0;
};

/// An edge from which contractions should not move, and the third corner of a triangle of it.
struct EdgeToKeep {
    std::uint32_t from = 0, to = 0, apex = 0;  ///< vertices
};

/// Options of a contractor; the defaults are those of simplify().
struct ContractorOptions {
    ContractionRules* rules = nullptr;  ///< absent: none
    std::span<const EdgeToKeep> edges_to_keep =
        {};  ///< besides those of borders; for the constructor only
    /// A contraction waits while its certified error is more than this many times the square root of its cost;
    /// infinity: quadrics alone decide.
    double error_ratio = std::numeric_limits<double>::infinity();
    /// Thin bodies become sheets, and small components vanish, where that costs least.
    bool may_change_topology = false;
};

/// Contracts a mesh vertex by vertex, the cheapest first.
class Contractor {
public:
    /// @param input views that must stay; checked
    explicit Contractor(const SimplifyInput& input, const ContractorOptions& options = {});

    /// Contracts until the mesh has no more triangles than the level, or nothing is left within its error.
    SimplifyStop contract_to(const SimplifyLevel& level);

    /// The mesh as it is now.
    SimplifiedMesh result() const;

    /// Tries all refused contractions again, because the rules have changed. From now on the second certificate
    /// (edge_bound.cpp) is tried for all components, not only for small ones.
    void retry_all();

private:
    enum class VertexKind : std::uint8_t { fixed, interior, border };
    enum class Attempt : std::uint8_t { done, refused, over_limit, deferred };
    struct VertexPlanes {
        Quadric quadric;
        double weight = 0.0;    ///< sum of the planes' weights
        double own_cost = 0.0;  ///< of the quadric at the vertex
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

    /// The cost that a candidate is queued with.
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
    bool folds_over(const Ring& ring);
    bool keeps_topology(std::uint32_t u, const Ring& ring);
    void contract(std::uint32_t u, const Ring& ring);

    std::span<const Eigen::Vector3d> vertices_;
    std::span<const std::uint8_t> locked_;
    bool may_join_locked_;
    ContractorOptions options_;
    StarMesh mesh_;
    std::vector<TriangleBound> bounds_;  // [triangles]
    std::vector<VertexKind> kinds_;      // [vertices] fixed: also those that are gone
    std::vector<VertexPlanes> planes_;   // [vertices]
    VertexQueue queue_;
    ContractionBound bound_;
    Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
    // [vertices] a contraction was above this level's error
    std::vector<std::uint8_t> is_over_limit_;
    std::size_t over_limit_count_ = 0;
    // [vertices] the queued candidate is not the vertex's first: those before were refused
    std::vector<std::uint8_t> had_refusal_;
    std::vector<double> least_costs_;  // [vertices] of a queued candidate; empty: none
    std::optional<Components> components_;
    bool is_retrying_ = false;
    VertexQueue reductions_;  // [components]
    // [components] a reduction was above this level's error
    std::vector<std::uint8_t> is_reduction_over_limit_;
    Ring ring_;                         // scratch
    Neighbours of_vertex_, of_target_;  // scratch
};

}  // namespace terrane::internal
