// SPDX-License-Identifier: MIT
#include "progressive/welded_mesh.h"

#include <algorithm>
#include <numeric>

namespace terrane::internal {
namespace {

// Orders vertices by position, then by attributes, then by index. 0 and -0 are the same.
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

// Sorts vertices into places, and finds the first vertex with the position and attributes of each.
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

}  // namespace terrane::internal
