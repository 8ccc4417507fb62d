// SPDX-License-Identifier: MIT
#pragma once

#include "simplify/quadric.h"

#include <terrane/terrain/progressive_mesh.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

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

}  // namespace terrane::internal
