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

/// A mesh whose vertices with equal positions are merged: the topology for contractions.
struct WeldedMesh {
    std::vector<Eigen::Vector3d> places;  ///< positions, in the order of their first vertices
    std::vector<std::uint32_t> place_of_vertex;  ///< [vertices]
    std::vector<std::uint32_t> first_vertex;     ///< [places + 1] in vertices_of_place
    /// Vertices of each place in increasing order; of vertices with equal attributes only the first.
    std::vector<std::uint32_t> vertices_of_place;
    std::vector<TriangleMesh::Triangle> triangles;  ///< of three different places each
    std::vector<TriangleMesh::Triangle> corners;    ///< [triangles] the same as vertices
    std::vector<std::uint32_t> input_triangles;     ///< [triangles] index in the input

    std::span<const std::uint32_t> vertices_at(std::uint32_t place) const {
        return std::span(vertices_of_place)
            .subspan(first_vertex[place], first_vertex[place + 1] - first_vertex[place]);
    }
};

/// @param mesh must have passed validate()
WeldedMesh weld(const TriangleMesh& mesh);

/// [places] nonzero: a vertex there is locked. @param locked [vertices] or empty
std::vector<std::uint8_t> locked_places(const WeldedMesh& welded,
                                        std::span<const std::uint8_t> locked);

/// Fails: invalid_argument for a weight out of range, and as check_sizes()
Result<void> check_settings(const TriangleMesh& mesh, const ProgressiveSettings& settings);

/// A contraction is deferred if its error exceeds this multiple of the square root of its cost. Measured on a fractal
/// of 500,000 triangles (docs/simplify.md): with 2, distances are a tenth smaller, and it takes a third longer.
inline constexpr double kErrorRatio = 3.0;

/// The attributes of vertices, scaled to metres, and a quadric for each vertex: how far the attributes at a position
/// deviate from those of the vertex's triangles, extrapolated linearly, squared and summed.
class AttributeQuadrics {
public:
    /// @param corners triangles as indices of vertices
    AttributeQuadrics(const TriangleMesh& mesh, const ProgressiveSettings& settings,
                      std::span<const TriangleMesh::Triangle> corners);

    /// Whether no attribute has a weight: all costs are 0.
    bool is_empty() const { return dimension_ == 0; }

    /// Mean squared deviation, over the area of both vertices' triangles, if `from` took the position and attributes of
    /// `to`, square metres.
    double cost(std::uint32_t from, std::uint32_t to) const;
    /// Squared difference of the attributes of two vertices, square metres.
    double difference(std::uint32_t a, std::uint32_t b) const;
    /// Adds the squared deviations of `from` to those of `to`.
    void add(std::uint32_t from, std::uint32_t to);

    /// Adds, as a function of a position relative to `origin`, the mean squared deviation of vertices that become one
    /// with the best attributes for that position, square metres.
    void add_least(std::span<const std::uint32_t> vertices, const Eigen::Vector3d& origin,
                   Quadric& sum) const;
    /// Moves a vertex, and gives it the attributes with the least deviation there. One without area keeps its own.
    void move(std::uint32_t vertex, const Eigen::Vector3d& position);
    /// Writes the attributes of vertices that have moved into the mesh from which this object was made.
    void write(TriangleMesh& mesh, const ProgressiveSettings& settings) const;

private:
    struct Sums {
        Quadric square;       // quadric of the extrapolated attributes
        double weight = 0.0;  // area of the triangles, square metres
    };
    // Area-weighted sums, over a vertex's triangles, of the gradient and constant of one attribute.
    struct Linear {
        double x = 0.0, y = 0.0, z = 0.0, constant = 0.0;
    };

    void add_values(const TriangleMesh& mesh, const ProgressiveSettings& settings, double size);
    void add_triangle(const TriangleMesh::Triangle& triangle);
    double sum_at(std::uint32_t vertex, std::uint32_t place) const;

    std::size_t dimension_ = 0;
    double size_ = 0.0;                              // diagonal of the bounding box
    Eigen::Vector3d low_ = Eigen::Vector3d::Zero();  // its lowest corner
    std::vector<std::uint8_t> has_moved_;            // [vertices] or empty: none
    std::vector<Eigen::Vector3d>
        positions_;               // [vertices] relative to the lowest corner of the bounding box
    std::vector<double> values_;  // [vertices * dimension]
    std::vector<Sums> sums_;      // [vertices]
    std::vector<Linear> linear_;  // [vertices * dimension]
};

/// A record of contractions: the changes to triangles and vertices in each step.
struct ContractionRecord {
    static constexpr std::uint32_t kNever = ~std::uint32_t{0};
    struct Change {
        std::uint32_t corner = 0;        ///< 3 * triangle + 0, 1 or 2
        std::uint32_t from = 0, to = 0;  ///< vertices
    };

    std::vector<Change> changes;            ///< of all steps
    std::vector<std::size_t> ends;          ///< [steps] end of the step's changes
    std::vector<double> errors_m;           ///< [steps] certified after the step; non-decreasing
    std::vector<std::uint32_t> removed_at;  ///< [triangles] the step that removes it, or kNever
    std::vector<std::uint32_t>
        unused_from;  ///< [vertices] the step after which no triangle uses it, or kNever
    std::vector<std::uint32_t>
        parents;  ///< [vertices] the vertex that replaces it from then on; itself: none
};

/// Chooses, for each vertex of a contracted place, the vertex of the target place that replaces it, and records the
/// contraction.
class ContractionRecorder final : public ContractionRules {
public:
    /// @param mesh, attributes must outlive this object
    ContractionRecorder(const WeldedMesh& mesh, AttributeQuadrics& attributes);

    /// From now on, a vertex without a partner along the edge may be replaced by the vertex with the most similar
    /// attributes: seams then move, and the places where they meet are not kept.
    void allow_all() { allows_all_ = true; }

    bool allows(std::uint32_t u, const Ring& ring) override;
    double cost(std::uint32_t u, std::uint32_t v) const override;
    void on_contraction(std::uint32_t u, const Ring& ring, double error_m) override;
    void on_removal(std::span<const std::uint32_t> triangles, double error_m) override;
    void add_cost(std::uint32_t u, std::uint32_t v, const Eigen::Vector3d& origin,
                  Quadric& sum) const override;
    void on_move(std::uint32_t v, const Eigen::Vector3d& position) override;

    /// The vertices of a triangle that has not been removed.
    const TriangleMesh::Triangle& corners(std::size_t triangle) const { return corners_[triangle]; }

    /// Moves out the record so far; the recorder's record is then empty.
    ContractionRecord take() { return std::move(record_); }

private:
    std::uint32_t corner_vertex(std::uint32_t triangle, std::size_t corner) const {
        return corners_[triangle][corner % 3];
    }
    std::uint32_t partner(std::uint32_t vertex, const Ring& ring, bool& is_unique_out) const;
    std::uint32_t cheapest(std::uint32_t vertex, std::uint32_t place) const;
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
    std::vector<TriangleMesh::Triangle> corners_;  // [triangles] indices of vertices
    std::vector<std::uint32_t> use_counts_;  // [vertices] number of corners of remaining triangles
    ContractionRecord record_;
};

/// The edges at which two adjacent triangles have different vertices, once per triangle.
std::vector<EdgeToKeep> find_seams(const WeldedMesh& mesh);

/// A mesh and the record of its contractions in streaming order, shared by all ProgressiveMesh objects of the mesh.
struct Recording {
    /// @param welded from the mesh
    /// @param record of contractions of `welded`
    Recording(const TriangleMesh& mesh, const WeldedMesh& welded, ContractionRecord record);

    /// The step of the finest level with at most this number of triangles, or the last step.
    std::size_t step_of_count(std::size_t count) const;

    TriangleMesh finest;
    std::vector<std::uint32_t> input_vertices, input_triangles;
    // [steps + 1] end of each step's changes, and counts after it. The first entry is the finest level.
    std::vector<ContractionRecord::Change> changes;
    std::vector<std::size_t> ends;
    std::vector<std::uint32_t> triangle_counts, vertex_counts;
    std::vector<double> errors_m;
    std::vector<std::uint32_t> unused_from, parents;  ///< [vertices]
};

}  // namespace terrane::internal
