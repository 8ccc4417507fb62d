// SPDX-License-Identifier: MIT
#pragma once

#include "mesh/contractor.h"

#include <terrane/terrain/progressive_mesh.h>
#include <terrane/terrain/triangle_mesh.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace terrane::internal {

/// A mesh whose vertices of equal position are merged: the topology that contractions use.
struct WeldedMesh {
    std::vector<Eigen::Vector3d> places;         ///< [places] in the order of their first vertices
    std::vector<std::uint32_t> place_of_vertex;  ///< [vertices]
    std::vector<std::uint32_t> first_vertex;     ///< [places + 1] in vertices_of_place
    /// Vertices of each place in increasing order; of those with the same attributes only the first.
    std::vector<std::uint32_t> vertices_of_place;
    std::vector<TriangleMesh::Triangle>
        triangles;                                ///< of places; only those of three different ones
    std::vector<TriangleMesh::Triangle> corners;  ///< [triangles] the same of vertices
    std::vector<std::uint32_t> input_triangles;   ///< [triangles] which of the mesh each is

    std::span<const std::uint32_t> vertices_at(std::uint32_t place) const {
        return std::span(vertices_of_place)
            .subspan(first_vertex[place], first_vertex[place + 1] - first_vertex[place]);
    }
};

/// @param mesh checked
WeldedMesh weld(const TriangleMesh& mesh);

/// The attributes of vertices as numbers in metres, and for each vertex the squared differences to the attributes of
/// the triangles around it, continued linearly.
class AttributeQuadrics {
public:
    /// @param corners triangles of vertices
    AttributeQuadrics(const TriangleMesh& mesh, const ProgressiveSettings& settings,
                      std::span<const TriangleMesh::Triangle> corners);

    /// No attribute has a weight: all costs are 0.
    bool is_empty() const { return dimension_ == 0; }

    /// Mean over the area of both vertices' triangles, were both at `to` with its attributes, square metres.
    double cost(std::uint32_t from, std::uint32_t to) const;
    /// Squared difference of the attributes of two vertices, square metres.
    double difference(std::uint32_t a, std::uint32_t b) const;
    /// Adds the squared differences of a vertex to those of another one.
    void add(std::uint32_t from, std::uint32_t to);

private:
    struct Sums {
        Quadric square;       // of the attributes of triangles, as functions of the place
        double weight = 0.0;  // area, square metres
    };
    // Sums over triangles of the gradient and constant of one attribute, times the area.
    struct Linear {
        double x = 0.0, y = 0.0, z = 0.0, constant = 0.0;
    };

    void add_values(const TriangleMesh& mesh, const ProgressiveSettings& settings, double size);
    void add_triangle(const TriangleMesh::Triangle& triangle);
    double sum_at(std::uint32_t vertex, std::uint32_t place) const;

    std::size_t dimension_ = 0;
    std::vector<Eigen::Vector3d>
        positions_;               // [vertices] relative to the lowest corner of the bounding box
    std::vector<double> values_;  // [vertices * dimension]
    std::vector<Sums> sums_;      // [vertices]
    std::vector<Linear> linear_;  // [vertices * dimension]
};

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

/// A mesh and the record of its contractions in streaming order, which the levels of it share.
struct Recording {
    /// @param welded of the mesh
    /// @param record of contractions of `welded`
    Recording(const TriangleMesh& mesh, const WeldedMesh& welded, ContractionRecord record);

    /// The step of the finest level with no more triangles than this, or the last one.
    std::size_t step_of_count(std::size_t count) const;

    TriangleMesh finest;
    std::vector<std::uint32_t> input_vertices, input_triangles;
    // Of each step: the end of its changes, and the counts after it. [steps + 1], the first is the finest level.
    std::vector<ContractionRecord::Change> changes;
    std::vector<std::size_t> ends;
    std::vector<std::uint32_t> triangle_counts, vertex_counts;
    std::vector<double> errors_m;
    std::vector<std::uint32_t> unused_from, parents;  ///< [vertices]
};

}  // namespace terrane::internal
