// SPDX-License-Identifier: MIT
#include "mesh/contraction_recorder.h"

#include "base/vector_math.h"

#include <terrane/base/text.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

namespace terrane::internal {
namespace {

// Orders vertices by position, then by attributes, then by index. 0 and -0 are equal.
class VertexOrder {
public:
    explicit VertexOrder(const TriangleMesh& mesh) : mesh_(mesh) {}

    bool operator()(std::uint32_t a, std::uint32_t b) const {
        const int position = compare_positions(a, b);
        if (position != 0) return position < 0;
        const int attributes = compare_attributes(a, b);
        return attributes != 0 ? attributes < 0 : a < b;
    }

    int compare_positions(std::uint32_t a, std::uint32_t b) const {
        return compare(mesh_.positions[a], mesh_.positions[b]);
    }

    int compare_attributes(std::uint32_t a, std::uint32_t b) const {
        int order = 0;
        if (!mesh_.normals.empty()) order = compare(mesh_.normals[a], mesh_.normals[b]);
        if (order == 0 && !mesh_.texture_coordinates.empty())
            order = compare(mesh_.texture_coordinates[a], mesh_.texture_coordinates[b]);
        if (order == 0 && !mesh_.colours.empty() && mesh_.colours[a] != mesh_.colours[b])
            order = mesh_.colours[a] < mesh_.colours[b] ? -1 : 1;
        if (order == 0 && !mesh_.materials.empty() && mesh_.materials[a] != mesh_.materials[b])
            order = mesh_.materials[a] < mesh_.materials[b] ? -1 : 1;
        return order;
    }

private:
    template <class Vector>
    static int compare(const Vector& a, const Vector& b) {
        for (Eigen::Index k = 0; k < a.size(); ++k) {
            if (a[k] != b[k]) return a[k] < b[k] ? -1 : 1;
        }
        return 0;
    }

    const TriangleMesh& mesh_;
};

// Groups vertices into places, and finds for each vertex the first one with the same position and attributes.
std::vector<std::uint32_t> make_places(const TriangleMesh& mesh, WeldedMesh& welded) {
    const std::size_t count = mesh.positions.size();
    const VertexOrder order_of(mesh);
    std::vector<std::uint32_t> order(count), same(count), leader(count);
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(), order_of);
    for (std::size_t begin = 0, end = 0; begin < count; begin = end) {
        std::uint32_t first = order[begin];
        for (end = begin; end < count && order_of.compare_positions(order[begin], order[end]) == 0;
             ++end) {
            const std::uint32_t v = order[end];
            const bool is_same = end > begin && order_of.compare_attributes(order[end - 1], v) == 0;
            same[v] = is_same ? same[order[end - 1]] : v;
            first = std::min(first, v);
        }
        for (std::size_t i = begin; i < end; ++i) leader[order[i]] = first;
    }
    welded.place_of_vertex.resize(count);
    for (std::uint32_t v = 0; v < count; ++v) {
        if (leader[v] == v) {
            welded.place_of_vertex[v] = static_cast<std::uint32_t>(welded.places.size());
            welded.places.push_back(mesh.positions[v]);
        } else {
            welded.place_of_vertex[v] = welded.place_of_vertex[leader[v]];
        }
    }
    return same;
}

}  // namespace

WeldedMesh weld(const TriangleMesh& mesh) {
    WeldedMesh welded;
    const std::vector<std::uint32_t> same = make_places(mesh, welded);
    welded.first_vertex.assign(welded.places.size() + 1, 0);
    for (std::uint32_t v = 0; v < same.size(); ++v) {
        if (same[v] == v) ++welded.first_vertex[welded.place_of_vertex[v] + 1];
    }
    std::partial_sum(welded.first_vertex.begin(), welded.first_vertex.end(),
                     welded.first_vertex.begin());
    welded.vertices_of_place.resize(welded.first_vertex.back());
    std::vector<std::uint32_t> next(welded.first_vertex.begin(), welded.first_vertex.end());
    for (std::uint32_t v = 0; v < same.size(); ++v) {
        if (same[v] == v) welded.vertices_of_place[next[welded.place_of_vertex[v]]++] = v;
    }
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
        const TriangleMesh::Triangle& t = mesh.triangles[i];
        const TriangleMesh::Triangle places = {welded.place_of_vertex[t[0]],
                                               welded.place_of_vertex[t[1]],
                                               welded.place_of_vertex[t[2]]};
        if (places[0] == places[1] || places[1] == places[2] || places[2] == places[0]) continue;
        welded.triangles.push_back(places);
        welded.input_triangles.push_back(i);
        welded.corners.push_back({same[t[0]], same[t[1]], same[t[2]]});
    }
    return welded;
}

std::vector<std::uint8_t> locked_places(const WeldedMesh& welded,
                                        std::span<const std::uint8_t> locked) {
    std::vector<std::uint8_t> result(welded.places.size(), 0);
    for (std::size_t v = 0; v < locked.size(); ++v) {
        if (locked[v] != 0) result[welded.place_of_vertex[v]] = 1;
    }
    return result;
}

Result<void> check_settings(const TriangleMesh& mesh, const ProgressiveSettings& settings) {
    constexpr double kLargestWeight = 1e3;
    const std::pair<const char*, double> weights[] = {
        {"normal_weight", settings.normal_weight},
        {"texture_coordinate_weight", settings.texture_coordinate_weight},
        {"colour_weight", settings.colour_weight}};
    for (const auto& [name, weight] : weights) {
        if (weight >= 0.0 && weight <= kLargestWeight) continue;
        return fail(ErrorCode::invalid_argument, std::string(name) + " must be from 0 to " +
                                                     number_text(kLargestWeight) + ", got " +
                                                     number_text(weight));
    }
    return check_sizes(mesh.positions.size(), mesh.triangles.size(), settings.locked.size());
}

// Quadrics of attributes.
// Sources: M. Garland, P. Heckbert. Simplifying Surfaces with Color and Texture using Quadric Error Metrics. IEEE
//          Visualization 1998 (quadrics of attributes).
//          H. Hoppe. New Quadric Metric for Simplifying Meshes with Appearance Attributes. IEEE Visualization 1999
//          (the deviation of an attribute from its linear extrapolation to the same position).
// Deviations: costs are means over the area, so that they compare as squared distances. A contraction onto a vertex
//             that stays keeps that vertex's attributes; one that moves it gives it the attributes with the least
//             deviation.

AttributeQuadrics::AttributeQuadrics(const TriangleMesh& mesh, const ProgressiveSettings& settings,
                                     std::span<const TriangleMesh::Triangle> corners) {
    if (mesh.positions.empty()) return;
    Eigen::Vector3d low = mesh.positions[0], high = low;
    for (const Eigen::Vector3d& p : mesh.positions) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
    }
    low_ = low;
    size_ = length(high - low);
    add_values(mesh, settings, size_);
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
            // the attribute is gradient * p + constant: a plane in a space with one more dimension
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

// Sum over the triangles of `vertex`, times area: squared deviation of the attributes of `place` from those
// extrapolated.
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

// The deviation sum_k sum_t a_t (s_k - g_tk p - d_tk)^2 of an attribute s_k over triangles t of area a_t is least for
// the mean s_k = sum_t a_t (g_tk p + d_tk) / sum_t a_t. The quadric that remains is that of the extrapolated
// attributes less the square of this mean.
void AttributeQuadrics::add_least(std::span<const std::uint32_t> vertices,
                                  const Eigen::Vector3d& origin, Quadric& sum) const {
    double weight = 0.0;
    for (const std::uint32_t v : vertices) weight += sums_[v].weight;
    if (!(weight > 0.0)) return;
    Quadric least;
    for (const std::uint32_t v : vertices) least.add_scaled(sums_[v].square, 1.0 / weight);
    for (std::size_t k = 0; k < dimension_; ++k) {
        Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
        double constant = 0.0;
        for (const std::uint32_t v : vertices) {
            const Linear& l = linear_[v * dimension_ + k];
            gradient += Eigen::Vector3d(l.x, l.y, l.z);
            constant += l.constant;
        }
        least.add_square(gradient / weight, constant / weight, -1.0);
    }
    sum.add_scaled(least.translated(low_ - origin), 1.0);
}

void AttributeQuadrics::move(std::uint32_t vertex, const Eigen::Vector3d& position) {
    if (is_empty()) return;
    const Eigen::Vector3d p = position - low_;
    positions_[vertex] = p;
    const double weight = sums_[vertex].weight;
    if (!(weight > 0.0)) return;
    has_moved_.resize(positions_.size(), 0);
    has_moved_[vertex] = 1;
    for (std::size_t k = 0; k < dimension_; ++k) {
        const Linear& l = linear_[vertex * dimension_ + k];
        values_[vertex * dimension_ + k] =
            (l.x * p[0] + l.y * p[1] + l.z * p[2] + l.constant) / weight;
    }
}

void AttributeQuadrics::write(TriangleMesh& mesh, const ProgressiveSettings& settings) const {
    for (std::size_t v = 0; v < has_moved_.size(); ++v) {
        if (has_moved_[v] == 0) continue;
        const double* value = &values_[v * dimension_];
        if (!mesh.normals.empty() && settings.normal_weight > 0.0) {
            const Eigen::Vector3d normal(value[0], value[1], value[2]);
            const double of_normal = length(normal);
            if (of_normal > 0.0) mesh.normals[v] = (normal / of_normal).cast<float>();
            value += 3;
        }
        if (!mesh.texture_coordinates.empty() && settings.texture_coordinate_weight > 0.0) {
            const double scale = settings.texture_coordinate_weight * size_;
            mesh.texture_coordinates[v] = {static_cast<float>(value[0] / scale),
                                           static_cast<float>(value[1] / scale)};
            value += 2;
        }
        if (!mesh.colours.empty() && settings.colour_weight > 0.0) {
            const double scale = settings.colour_weight * size_ / 255.0;
            for (std::size_t k = 0; k < 4; ++k)
                mesh.colours[v][k] = static_cast<std::uint8_t>(
                    std::floor(std::clamp(value[k] / scale, 0.0, 255.0) + 0.5));
        }
    }
}

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

// The vertex that replaces a vertex of u when u moves along the edge to ring.vertices[0]: the one at that place in the
// triangles at the edge that contain the vertex. kNone if no triangle does; not unique if the two triangles differ.
std::uint32_t ContractionRecorder::partner(std::uint32_t vertex, const Ring& ring,
                                           bool& is_unique_out) const {
    is_unique_out = true;
    std::uint32_t found = kNone;
    // triangle 0 is (u, target, ...), the last one (u, ..., target)
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
    // places with more vertices are not contracted
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

// Of the vertices in use at a place, the one that another one can replace at the least cost; kNone if none is.
std::uint32_t ContractionRecorder::cheapest(std::uint32_t vertex, std::uint32_t place) const {
    std::uint32_t best = kNone;
    double least = kInfinity;
    for (const std::uint32_t other : mesh_.vertices_at(place)) {
        if (use_counts_[other] == 0) continue;
        const double cost = attributes_.cost(vertex, other);
        if (best != kNone && !(cost < least)) continue;
        least = cost;
        best = other;
    }
    return best;
}

void ContractionRecorder::add_cost(std::uint32_t u, std::uint32_t v, const Eigen::Vector3d& origin,
                                   Quadric& sum) const {
    const auto of_u = mesh_.vertices_at(u), of_v = mesh_.vertices_at(v);
    // places with more vertices are not contracted
    if (attributes_.is_empty() || std::max(of_u.size(), of_v.size()) > kMaxValence) return;
    if (of_u.size() == 1 && of_v.size() == 1)
        return attributes_.add_least(std::array{of_v[0], of_u[0]}, origin, sum);
    std::array<std::uint32_t, kMaxValence> targets;
    for (std::size_t i = 0; i < of_u.size(); ++i)
        targets[i] = use_counts_[of_u[i]] == 0 ? kNone : cheapest(of_u[i], v);
    for (const std::uint32_t to : of_v) {
        if (use_counts_[to] == 0) continue;
        std::array<std::uint32_t, kMaxValence + 1> joined = {to};
        std::size_t count = 1;
        for (std::size_t i = 0; i < of_u.size(); ++i) {
            if (targets[i] == to) joined[count++] = of_u[i];
        }
        attributes_.add_least(std::span(joined).first(count), origin, sum);
    }
}

void ContractionRecorder::on_move(std::uint32_t v, const Eigen::Vector3d& position) {
    for (const std::uint32_t vertex : mesh_.vertices_at(v)) attributes_.move(vertex, position);
}

// Of the vertices in use at a place, the one whose attributes are most similar to those of `vertex`; kNone if none is.
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
    // If a partner lost its last triangle in this step too, uses the partner's parent: a parent must outlast its
    // vertex.
    for (const std::uint32_t vertex : mesh_.vertices_at(u)) {
        if (record_.unused_from[vertex] != steps_with_this()) continue;
        std::uint32_t& parent = record_.parents[vertex];
        if (use_counts_[parent] == 0) parent = record_.parents[parent];
    }
    // the apexes of the removed triangles
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

// Retires the vertices of a place that lost their last triangle in this step.
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
        std::uint32_t triangle, first;  // first corner
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
