// SPDX-License-Identifier: MIT
#include "shapes/hull_data.h"

#include "base/vector_math.h"
#include "shapes/hull/hull_lattice.h"
#include "shapes/hull/simplex.h"
#include "shapes/hull/triangle_hull.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>

namespace terrane::internal {
namespace {

using Indices = std::vector<std::uint32_t>;
using Pair = std::pair<std::uint32_t, std::uint32_t>;

/// A hull in indices of lattice points.
struct Surface {
    Indices vertices;             // in increasing order
    std::vector<HullFace> faces;  // of vertices
    std::vector<Pair> joined;     // sides of faces and of their triangles: the graph of the climb
    double thickness = 0.0;       // of a flat hull, in lattice spacings
};

void make_unique(auto& list) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
}

Indices vertices_of(const std::vector<HullFace>& faces) {
    Indices vertices;
    for (const HullFace& face : faces) {
        vertices.insert(vertices.end(), face.loop.begin(), face.loop.end());
    }
    make_unique(vertices);
    return vertices;
}

// Hull of one or two vertices.
Surface make_line(const Simplex& simplex) {
    Surface surface;
    surface.vertices = {simplex.corners[0]};
    if (simplex.dimension > 0) {
        surface.vertices.push_back(simplex.corners[1]);
        surface.joined.emplace_back(simplex.corners[0], simplex.corners[1]);
    }
    make_unique(surface.vertices);
    return surface;
}

Surface make_flat(const LatticePoints& points, const Indices& chosen, const Simplex& simplex) {
    Surface surface;
    surface.thickness = simplex.thickness;
    surface.faces = make_flat_faces(points.lattice, chosen, simplex);
    drop_collinear_points(points.lattice, points.tolerance, surface.faces);
    surface.vertices = vertices_of(surface.faces);
    const Indices& loop = surface.faces[0].loop;
    for (std::size_t i = 0; i < loop.size(); ++i) {
        surface.joined.emplace_back(loop[i], loop[(i + 1) % loop.size()]);
    }
    return surface;
}

// Merges faces and drops points until the exact hull of the remaining points has all of them as vertices, so that a
// climb over its sides reaches every extreme.
Surface make_surface(const LatticePoints& points) {
    constexpr int kRounds = 4;
    Indices chosen(points.lattice.size());
    std::iota(chosen.begin(), chosen.end(), 0u);
    for (int round = 0;; ++round) {
        const Simplex simplex = find_simplex(points.lattice, chosen, points.tolerance);
        if (simplex.dimension < 2) return make_line(simplex);
        if (simplex.dimension == 2) return make_flat(points, chosen, simplex);

        const TriangleHull hull = make_triangle_hull(points.lattice, chosen, simplex.corners);
        const bool is_last = round == kRounds;  // then the triangles are the faces
        Surface surface;
        surface.faces = merge_coplanar(points.lattice, hull, is_last ? -1.0 : points.tolerance);
        if (!is_last) drop_collinear_points(points.lattice, points.tolerance, surface.faces);
        surface.vertices = vertices_of(surface.faces);
        if (surface.faces.size() < 4) return make_flat(points, chosen, simplex);

        Indices corners;
        for (const TriangleHull::Triangle& t : hull.vertices) {
            corners.insert(corners.end(), t.begin(), t.end());
            for (std::size_t i = 0; i < 3; ++i) surface.joined.emplace_back(t[i], t[(i + 1) % 3]);
        }
        make_unique(corners);
        if (corners == surface.vertices) return surface;
        chosen = std::move(surface.vertices);
    }
}

// Adjacency lists of `count` vertices, from pairs in either order.
void fill_neighbours(std::vector<Pair> pairs, std::size_t count, Indices& first_out,
                     Indices& neighbours_out) {
    const std::size_t given = pairs.size();
    for (std::size_t i = 0; i < given; ++i) pairs.emplace_back(pairs[i].second, pairs[i].first);
    make_unique(pairs);
    first_out.assign(count + 1, 0);
    for (const Pair& pair : pairs) {
        ++first_out[pair.first + 1];
        neighbours_out.push_back(pair.second);
    }
    for (std::size_t i = 1; i <= count; ++i) first_out[i] += first_out[i - 1];
}

// Canonical order: each loop starts at its lowest vertex, and loops are sorted.
void fill_faces(std::vector<HullFace> faces, HullData& data_out) {
    for (HullFace& face : faces) {
        std::rotate(face.loop.begin(), std::min_element(face.loop.begin(), face.loop.end()),
                    face.loop.end());
    }
    std::sort(faces.begin(), faces.end(),
              [](const HullFace& a, const HullFace& b) { return a.loop < b.loop; });
    for (const HullFace& face : faces) {
        Polyhedron::Face result;
        result.normal = face.normal;
        result.first = static_cast<std::uint32_t>(data_out.loops.size());
        result.count = static_cast<std::uint32_t>(face.loop.size());
        result.offset = dot(face.normal, data_out.vertices[face.loop[0]]);
        for (const std::uint32_t vertex : face.loop) {
            result.offset = std::max(result.offset, dot(face.normal, data_out.vertices[vertex]));
            data_out.loops.push_back(vertex);
        }
        data_out.faces.push_back(result);
    }
}

void fill_edges(HullData& data_out) {
    struct Side {
        Pair ends;
        bool is_left;
        std::uint32_t face;
    };
    std::vector<Side> sides;
    for (std::uint32_t face = 0; face < data_out.faces.size(); ++face) {
        const Polyhedron::Face& f = data_out.faces[face];
        for (std::uint32_t i = 0; i < f.count; ++i) {
            const std::uint32_t from = data_out.loops[f.first + i];
            const std::uint32_t to = data_out.loops[f.first + (i + 1) % f.count];
            sides.push_back({std::minmax(from, to), from < to, face});
        }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
        return a.ends != b.ends ? a.ends < b.ends : a.is_left > b.is_left;
    });
    for (std::size_t i = 0; i + 1 < sides.size(); i += 2) {
        data_out.edges.push_back(
            {sides[i].ends.first, sides[i].ends.second, sides[i].face, sides[i + 1].face});
    }
    if (sides.empty() && data_out.vertices.size() == 2) data_out.edges.push_back({0, 1});
}

std::shared_ptr<const HullData> make_hull_of(std::span<const Eigen::Vector3d> given) {
    const LatticePoints points = make_lattice_points(given);
    Surface surface = make_surface(points);
    auto data = std::make_shared<HullData>();

    Indices index(points.lattice.size(), 0);
    for (const std::uint32_t vertex : surface.vertices) {
        index[vertex] = static_cast<std::uint32_t>(data->vertices.size());
        data->vertices.push_back(points.positions[vertex]);
        data->bounding_radius = std::max(data->bounding_radius, length(points.positions[vertex]));
    }
    for (HullFace& face : surface.faces) {
        for (std::uint32_t& vertex : face.loop) vertex = index[vertex];
    }
    for (Pair& pair : surface.joined) pair = {index[pair.first], index[pair.second]};

    const std::size_t count = data->vertices.size();
    fill_faces(std::move(surface.faces), *data);
    fill_edges(*data);
    std::vector<Pair> sides;
    for (const Polyhedron::Edge& edge : data->edges) sides.emplace_back(edge.from, edge.to);
    fill_neighbours(std::move(sides), count, data->first_neighbour, data->neighbours);
    data->polyhedron = {data->vertices,        data->faces,      data->loops, data->edges,
                        data->first_neighbour, data->neighbours, nullptr};
    if (count >= kClimbFrom) {
        ClimbTable& climb = data->climb;
        fill_neighbours(std::move(surface.joined), count, climb.first_neighbour, climb.neighbours);
        // Twice the rounding of a product (three roundings of the largest coordinate), twice the distance between the
        // vertices and the lattice hull's (one rounding of the extent), and twice the thickness.
        climb.slack = 0x1p-49 * points.largest + 2.0 * surface.thickness * points.spacing;
        fill_climb_starts(data->vertices, climb);
        data->polyhedron.climb = &climb;
    }
    data->smallest_half_extent = 0.5 * compute_width(data->polyhedron);
    return data;
}

}  // namespace

std::shared_ptr<const HullData> make_hull_data(std::span<const Eigen::Vector3d> given) {
    // Points that are no vertices may decide how coplanar faces are merged. The hull is that of its vertices alone.
    std::shared_ptr<const HullData> data = make_hull_of(given);
    for (std::size_t count = given.size(); data->vertices.size() < count;) {
        count = data->vertices.size();
        data = make_hull_of(data->vertices);
    }
    return data;
}

}  // namespace terrane::internal
