// SPDX-License-Identifier: MIT
#include "base/vector_math.h"
#include "shapes/query_shapes.h"
#include "shapes/quickhull.h"

#include <terrane/collision/shapes.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

namespace terrane::internal {
namespace {

using Indices = std::vector<std::uint32_t>;
using Pair = std::pair<std::uint32_t, std::uint32_t>;

/// A hull as indices of lattice points.
struct Surface {
    Indices vertices;             // in increasing order
    std::vector<HullFace> faces;  // their loops are indices of lattice points
    std::vector<Pair> joined;     // edges of faces and triangles: find_extreme() climbs along them
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

// Merges coplanar faces and drops points that are not corners of faces, until every remaining point is a vertex of the
// exact hull of the remaining points. A climb along the edges of that hull reaches every extreme vertex.
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
    // With a comparison of elements: on big-endian machines libstdc++ 12 compares too few bytes of whole vectors.
    std::sort(faces.begin(), faces.end(), [](const HullFace& a, const HullFace& b) {
        return std::lexicographical_compare(a.loop.begin(), a.loop.end(), b.loop.begin(),
                                            b.loop.end(), std::less<>());
    });
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
        // The first term covers twice the rounding error of a dot product (three roundings of the largest coordinate)
        // and twice the distance of a vertex from its lattice point (one rounding of the extent).
        climb.slack = 0x1p-49 * points.largest + 2.0 * surface.thickness * points.spacing;
        fill_climb_starts(data->vertices, climb);
        data->polyhedron.climb = &climb;
    }
    data->smallest_half_extent = 0.5 * compute_width(data->polyhedron);
    return data;
}

}  // namespace

std::shared_ptr<const HullData> make_hull_data(std::span<const Eigen::Vector3d> given) {
    // Points that are not vertices may affect the merging of coplanar faces. Repeats with the vertices alone until
    // every point is a vertex of the hull.
    std::shared_ptr<const HullData> data = make_hull_of(given);
    for (std::size_t count = given.size(); data->vertices.size() < count;) {
        count = data->vertices.size();
        data = make_hull_of(data->vertices);
    }
    return data;
}

// Sources: M. E. Houle, G. T. Toussaint. Computing the width of a set. IEEE Trans. Pattern Analysis and
//          Machine Intelligence 1988.
// Deviations: antipodal pairs of edges are found by bisection: as a direction rotates about an edge from one of its
//             face normals to the other, the opposite support vertex changes at each antipodal edge.

namespace {

double extent_along(const Polyhedron& hull, const Eigen::Vector3d& direction) {
    const double size = length(direction);
    if (!(size > 0.0)) return kInfinity;
    const Eigen::Vector3d unit = direction / size;
    const double high = dot(unit, hull.vertices[find_extreme(hull, unit)]);
    const double low = dot(unit, hull.vertices[find_extreme(hull, -unit)]);
    return high - low;
}

// The directions begin + t turn, t in [0, 1], from one normal to the other of the two faces at an edge.
struct Arc {
    const Polyhedron& hull;
    std::uint32_t highest;  // a vertex of the edge
    Eigen::Vector3d begin;
    Eigen::Vector3d turn;

    Eigen::Vector3d at(double t) const { return begin + t * turn; }
    // Height of the edge above a vertex along at(t), metres. At most the extent along at(t), which is no longer than a
    // unit vector.
    double depth(std::uint32_t vertex, double t) const {
        return dot(at(t), hull.vertices[highest] - hull.vertices[vertex]);
    }

    // The smaller of `width` and the least extent of the hull along the directions at(t), `from` < t < `to`, at which
    // the lowest vertex changes. The lowest vertices at `from` and `to` are `low_from` and `low_to`.
    double least(double from, std::uint32_t low_from, double to, std::uint32_t low_to,
                 double width) const {
        if (low_from == low_to) return width;
        const double bound = std::max(std::min(depth(low_from, from), depth(low_from, to)),
                                      std::min(depth(low_to, from), depth(low_to, to)));
        if (bound >= width * (1.0 - 1e-12)) return width;
        const Eigen::Vector3d between = hull.vertices[low_to] - hull.vertices[low_from];
        const double t = -dot(begin, between) / dot(turn, between);  // both are equally low
        if (!(t > from && t < to)) return width;
        const std::uint32_t low = find_extreme(hull, -at(t));
        if (low == low_from || low == low_to || depth(low, t) <= depth(low_from, t)) {
            return std::min(width, extent_along(hull, at(t)));
        }
        return least(t, low, to, low_to, least(from, low_from, t, low, width));
    }
};

}  // namespace

double compute_width(const Polyhedron& hull) {
    if (hull.faces.size() <= 2) return 0.0;
    double width = kInfinity;
    std::vector<std::uint32_t> below;  // [faces] vertex farthest below the face
    for (const Polyhedron::Face& face : hull.faces) {
        below.push_back(find_extreme(hull, -face.normal));
        width = std::min(width, face.offset - dot(face.normal, hull.vertices[below.back()]));
    }
    for (const Polyhedron::Edge& edge : hull.edges) {
        const Eigen::Vector3d begin = hull.faces[edge.left].normal;
        const Arc arc{hull, edge.from, begin, hull.faces[edge.right].normal - begin};
        width = arc.least(0.0, below[edge.left], 1.0, below[edge.right], width);
    }
    return std::max(width, 0.0);
}

}  // namespace terrane::internal

namespace terrane {

ConvexHull::ConvexHull(std::shared_ptr<const internal::HullData> data) : data_(std::move(data)) {}

Result<ConvexHull> ConvexHull::create(std::span<const Eigen::Vector3d> points) {
    char text[200];
    if (points.empty() || points.size() > kMaxPoints) {
        std::snprintf(text, sizeof text, "a convex hull needs 1 to %zu points, got %zu", kMaxPoints,
                      points.size());
        return fail(ErrorCode::invalid_argument, text);
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            // Written so that NaN fails.
            if (std::abs(points[i][axis]) <= kLargestCoordinate) continue;
            std::snprintf(text, sizeof text,
                          "coordinates of hull point %zu must be -1e5 to 1e5 m, got %c %.6g", i,
                          "xyz"[axis], points[i][axis]);
            return fail(ErrorCode::invalid_argument, text);
        }
    }
    return ConvexHull(internal::make_hull_data(points));
}

std::span<const Eigen::Vector3d> ConvexHull::vertices() const { return data_->vertices; }

std::size_t ConvexHull::face_count() const { return data_->faces.size(); }

std::span<const std::uint32_t> ConvexHull::face(std::size_t index) const {
    const internal::Polyhedron::Face& face = data_->faces[index];
    return std::span(data_->loops).subspan(face.first, face.count);
}

double bounding_radius(const ConvexHull& hull) { return internal::hull_data(hull).bounding_radius; }

double smallest_half_extent(const ConvexHull& hull) {
    return internal::hull_data(hull).smallest_half_extent;
}

double support_distance(const ConvexHull& hull, const Eigen::Vector3d& direction_body) {
    const internal::Polyhedron& polyhedron = internal::polyhedron(hull);
    const std::uint32_t vertex = internal::find_extreme(polyhedron, direction_body);
    return internal::dot(direction_body, polyhedron.vertices[vertex]);
}

namespace internal {

const HullData& hull_data(const ConvexHull& hull) { return *hull.data_; }

const Polyhedron& polyhedron(const ConvexHull& hull) { return hull_data(hull).polyhedron; }

}  // namespace internal
}  // namespace terrane
