// SPDX-License-Identifier: MIT
//
// Sources: M. Garland, P. Heckbert. Simplifying Surfaces with Color and Texture using Quadric Error Metrics. IEEE
// Visualization 1998. H. Hoppe. New Quadric Metric for Simplifying Meshes with Appearance Attributes. IEEE
// Visualization 1999: the deviation of an attribute is that from its linear continuation, at the same place.
// Deviations: attributes are those of the vertex that remains, not optimized; costs are means over the area, so that
// they compare as distances.
#include "progressive/attribute_quadrics.h"

#include "base/vector_math.h"

#include <algorithm>

namespace terrane::internal {

AttributeQuadrics::AttributeQuadrics(const TriangleMesh& mesh, const ProgressiveSettings& settings,
                                     std::span<const TriangleMesh::Triangle> corners) {
    if (mesh.positions.empty()) return;
    Eigen::Vector3d low = mesh.positions[0], high = low;
    for (const Eigen::Vector3d& p : mesh.positions) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    add_values(mesh, settings, length(high - low));
    if (is_empty()) return;
    for (const Eigen::Vector3d& p : mesh.positions) positions_.push_back(p - low);
    sums_.resize(mesh.positions.size());
    linear_.resize(mesh.positions.size() * dimension_);
    for (const TriangleMesh::Triangle& t : corners) add_triangle(t);
}

void AttributeQuadrics::add_values(const TriangleMesh& mesh, const ProgressiveSettings& settings,
                                   double size) {
    const bool has_normals = !mesh.normals.empty() && settings.normal_weight > 0.0;
    const bool has_texture =
        !mesh.texture_coordinates.empty() && settings.texture_coordinate_weight > 0.0;
    const bool has_colours = !mesh.colours.empty() && settings.colour_weight > 0.0;
    dimension_ = (has_normals ? 3u : 0u) + (has_texture ? 2u : 0u) + (has_colours ? 4u : 0u);
    values_.reserve(mesh.positions.size() * dimension_);
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        for (Eigen::Index k = 0; has_normals && k < 3; ++k)
            values_.push_back(settings.normal_weight * size * double{mesh.normals[i][k]});
        for (Eigen::Index k = 0; has_texture && k < 2; ++k)
            values_.push_back(settings.texture_coordinate_weight * size *
                              double{mesh.texture_coordinates[i][k]});
        for (std::size_t k = 0; has_colours && k < 4; ++k)
            values_.push_back(settings.colour_weight * size * (mesh.colours[i][k] / 255.0));
    }
}

void AttributeQuadrics::add_triangle(const TriangleMesh::Triangle& t) {
    const Eigen::Vector3d& a = positions_[t[0]];
    const Eigen::Vector3d first = positions_[t[1]] - a, second = positions_[t[2]] - a;
    const Eigen::Vector3d normal = cross(first, second);
    const double square = dot(normal, normal);
    if (!(square > 0.0)) return;
    const double area = 0.5 * std::sqrt(square);
    const Eigen::Vector3d along_first = cross(second, normal) / square,
                          along_second = cross(normal, first) / square;
    for (std::size_t k = 0; k < dimension_; ++k) {
        const double value = values_[t[0] * dimension_ + k];
        const double rise_first = values_[t[1] * dimension_ + k] - value,
                     rise_second = values_[t[2] * dimension_ + k] - value;
        const Eigen::Vector3d gradient = rise_first * along_first + rise_second * along_second;
        const double constant = value - dot(gradient, a);
        for (const std::uint32_t v : t) {
            // The attribute is gradient * p + constant: a plane in a space with one more dimension.
            Quadric& q = sums_[v].square;
            q.xx += area * gradient[0] * gradient[0];
            q.xy += area * gradient[0] * gradient[1];
            q.xz += area * gradient[0] * gradient[2];
            q.yy += area * gradient[1] * gradient[1];
            q.yz += area * gradient[1] * gradient[2];
            q.zz += area * gradient[2] * gradient[2];
            q.x += area * gradient[0] * constant;
            q.y += area * gradient[1] * constant;
            q.z += area * gradient[2] * constant;
            q.constant += area * constant * constant;
            Linear& linear = linear_[v * dimension_ + k];
            linear.x += area * gradient[0];
            linear.y += area * gradient[1];
            linear.z += area * gradient[2];
            linear.constant += area * constant;
        }
    }
    for (const std::uint32_t v : t) sums_[v].weight += area;
}

// Of a vertex's triangles, with the position and attributes of another one.
double AttributeQuadrics::sum_at(std::uint32_t vertex, std::uint32_t place) const {
    const Eigen::Vector3d& p = positions_[place];
    double sum = sums_[vertex].square.at(p);
    for (std::size_t k = 0; k < dimension_; ++k) {
        const double value = values_[place * dimension_ + k];
        const Linear& l = linear_[vertex * dimension_ + k];
        sum += value * (sums_[vertex].weight * value -
                        2.0 * (l.x * p[0] + l.y * p[1] + l.z * p[2] + l.constant));
    }
    return std::max(sum, 0.0);
}

double AttributeQuadrics::cost(std::uint32_t from, std::uint32_t to) const {
    const double weight = sums_[from].weight + sums_[to].weight;
    return weight > 0.0 ? (sum_at(from, to) + sum_at(to, to)) / weight : 0.0;
}

double AttributeQuadrics::difference(std::uint32_t a, std::uint32_t b) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < dimension_; ++k) {
        const double step = values_[a * dimension_ + k] - values_[b * dimension_ + k];
        sum += step * step;
    }
    return sum;
}

void AttributeQuadrics::add(std::uint32_t from, std::uint32_t to) {
    if (is_empty()) return;
    sums_[to].square.add(sums_[from].square);
    sums_[to].weight += sums_[from].weight;
    for (std::size_t k = 0; k < dimension_; ++k) {
        const Linear& l = linear_[from * dimension_ + k];
        Linear& sum = linear_[to * dimension_ + k];
        sum.x += l.x;
        sum.y += l.y;
        sum.z += l.z;
        sum.constant += l.constant;
    }
}

}  // namespace terrane::internal
