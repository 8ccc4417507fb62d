// SPDX-License-Identifier: MIT
#pragma once

#include "progressive/attribute_quadrics.h"
#include "progressive/welded_mesh.h"
#include "simplify/contractor.h"

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace terrane::internal {

/// A record of contractions: the changes of triangles and vertices of each step.
struct ContractionRecord {
    static constexpr std::uint32_t kNever = ~std::uint32_t{0};
    struct Change {
        std::uint32_t corner = 0;        ///< 3 * triangle + 0, 1 or 2
        std::uint32_t from = 0, to = 0;  ///< vertices
    };

    std::vector<Change> changes;    ///< of all steps
    std::vector<std::size_t> ends;  ///< [steps] of the step's changes
    std::vector<double> errors_m;   ///< [steps] certified after the step; they do not decrease
    std::vector<std::uint32_t> removed_at;  ///< [triangles] after how many steps, or kNever
    std::vector<std::uint32_t>
        unused_from;  ///< [vertices] after how many steps no triangle has it, or kNever
    std::vector<std::uint32_t>
        parents;  ///< [vertices] the vertex that replaces it then; itself: none
};

/// Decides for a contraction of a place which vertex of the target takes the place of each of its vertices, and records
/// it.
class ContractionRecorder final : public ContractionRules {
public:
    /// @param mesh, attributes must stay
    ContractionRecorder(const WeldedMesh& mesh, AttributeQuadrics& attributes);

    /// From now on vertices without a partner along the edge are allowed to take the nearest one: seams move, and where
    /// they meet is not kept.
    void allow_all() { allows_all_ = true; }

    bool allows(std::uint32_t u, const Ring& ring) override;
    double cost(std::uint32_t u, std::uint32_t v) const override;
    void on_contraction(std::uint32_t u, const Ring& ring, double error_m) override;
    void on_removal(std::span<const std::uint32_t> triangles, double error_m) override;

    /// The record so far; the recorder has none afterwards.
    ContractionRecord take() { return std::move(record_); }

private:
    std::uint32_t corner_vertex(std::uint32_t triangle, std::size_t corner) const {
        return corners_[triangle][corner % 3];
    }
    std::uint32_t partner(std::uint32_t vertex, const Ring& ring, bool& is_unique_out) const;
    std::uint32_t nearest(std::uint32_t vertex, std::uint32_t place) const;
    void remove(std::uint32_t triangle);
    void retire(std::uint32_t place);
    void end_step(double error_m);

    std::uint32_t steps_with_this() const {
        return static_cast<std::uint32_t>(record_.ends.size()) + 1;
    }

    const WeldedMesh& mesh_;
    AttributeQuadrics& attributes_;
    bool allows_all_ = false;
    std::vector<TriangleMesh::Triangle> corners_;  // [triangles] of vertices
    std::vector<std::uint32_t> use_counts_;        // [vertices] corners of triangles that are left
    ContractionRecord record_;
};

/// The edges where the vertices of two neighbouring triangles differ, once for each triangle.
std::vector<EdgeToKeep> find_seams(const WeldedMesh& mesh);

}  // namespace terrane::internal
