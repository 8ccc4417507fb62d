// SPDX-License-Identifier: MIT
#include "shapes/polyhedron.h"

#include "base/vector_math.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace terrane::internal {
namespace {

using Edge = Polyhedron::Edge;

// Faces -x, +x, -y, +y, -z, +z, counter-clockwise seen from outside.
constexpr std::array<std::uint32_t, 24> kLoops = {0, 4, 6, 2, 1, 3, 7, 5, 0, 1, 5, 4,
                                                  2, 6, 7, 3, 0, 2, 3, 1, 4, 5, 7, 6};

constexpr std::uint32_t face_with_side(std::uint32_t from, std::uint32_t to) {
    for (std::uint32_t side = 0; side < 24; ++side) {
        const std::uint32_t face = side / 4;
        if (kLoops[side] == from && kLoops[4 * face + (side + 1) % 4] == to) return face;
    }
    return Polyhedron::kNoFace;
}

constexpr std::array<Edge, 12> make_edges() {
    std::array<Edge, 12> edges{};
    std::size_t count = 0;
    for (std::uint32_t from = 0; from < 8; ++from) {
        for (std::uint32_t bit = 1; bit < 8; bit *= 2) {
            if ((from & bit) != 0) continue;
            const std::uint32_t to = from | bit;
            edges[count++] = {from, to, face_with_side(from, to), face_with_side(to, from)};
        }
    }
    return edges;
}

constexpr std::array<std::uint32_t, 24> make_neighbours() {
    std::array<std::uint32_t, 24> neighbours{};
    std::size_t count = 0;
    for (std::uint32_t vertex = 0; vertex < 8; ++vertex) {
        for (std::uint32_t bit = 4; bit != 0; bit /= 2) {  // lower vertices first
            if ((vertex & bit) != 0) neighbours[count++] = vertex ^ bit;
        }
        for (std::uint32_t bit = 1; bit < 8; bit *= 2) {
            if ((vertex & bit) == 0) neighbours[count++] = vertex ^ bit;
        }
    }
    return neighbours;
}

constexpr std::array<Edge, 12> kEdges = make_edges();
constexpr std::array<std::uint32_t, 9> kFirstNeighbour = {0, 3, 6, 9, 12, 15, 18, 21, 24};
constexpr std::array<std::uint32_t, 24> kNeighbours = make_neighbours();

}  // namespace

Polyhedron box_polyhedron(const Eigen::Vector3d& half_extents, BoxStorage& storage_out) {
    for (std::size_t i = 0; i < 8; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            const double half = half_extents[axis];
            storage_out.vertices[i][axis] = (i >> axis & 1) != 0 ? half : -half;
        }
    }
    for (std::uint32_t i = 0; i < 6; ++i) {
        const int axis = static_cast<int>(i / 2);
        Polyhedron::Face& face = storage_out.faces[i];
        face.normal = Eigen::Vector3d::Zero();
        face.normal[axis] = i % 2 == 0 ? -1.0 : 1.0;
        face.offset = half_extents[axis];
        face.first = 4 * i;
        face.count = 4;
    }
    return {storage_out.vertices, storage_out.faces, kLoops, kEdges, kFirstNeighbour, kNeighbours};
}

// Sources: E. G. Gilbert, D. W. Johnson, S. S. Keerthi. A fast procedure for computing the distance between complex
//          objects. IEEE J. Robotics and Automation 1988 (support vertices).
//          S. Cameron. Enhancing GJK. ICRA 1997 (hill climbing).
// Deviations: the start comes from a table of directions instead of the previous query, so that the cost does not
//             depend on earlier queries. A local maximum caused by rounding does not end the climb: it continues over
//             all vertices within rounding of the maximum, which are connected on a convex surface.

namespace {

struct Candidate {
    double along = 0.0;
    std::uint32_t vertex = 0;

    // A total order: the candidate farther along the direction comes first, on a tie the one with the lower index.
    bool is_beyond(const Candidate& other) const {
        return along > other.along || (along == other.along && vertex < other.vertex);
    }
};

class Climb {
public:
    Climb(std::span<const Eigen::Vector3d> vertices, const ClimbTable& table,
          const Eigen::Vector3d& direction)
        : vertices_(vertices), table_(table), direction_(direction) {
        const double size =
            std::abs(direction[0]) + std::abs(direction[1]) + std::abs(direction[2]);
        // Products that underflow count as equal.
        slack_ = table.slack * size + std::numeric_limits<double>::min();
    }

    Candidate at(std::uint32_t vertex) const {
        return {dot(direction_, vertices_[vertex]), vertex};
    }

    Candidate steepest(Candidate best) const {
        for (;;) {
            const Candidate from = best;
            visit_neighbours(from.vertex, [&](const Candidate& next) {
                if (next.is_beyond(best)) best = next;
                return true;
            });
            if (best.vertex == from.vertex) return best;
        }
    }

    // Moves `best` to the best vertex within its slack that is connected to it. False if there are too many of these.
    bool search_plateau(Candidate& best) const {
        constexpr std::size_t kMost = 32;
        std::array<std::uint32_t, kMost> found;
        std::size_t count = 0;
        found[count++] = best.vertex;
        for (std::size_t i = 0; i < count; ++i) {
            const bool fits = visit_neighbours(found[i], [&](const Candidate& next) {
                if (next.along < best.along - slack_) return true;  // false for NaN: continues
                if (std::find(found.begin(), found.begin() + count, next.vertex) !=
                    found.begin() + count) {
                    return true;
                }
                if (count == kMost) return false;
                found[count++] = next.vertex;
                if (next.is_beyond(best)) best = next;
                return true;
            });
            if (!fits) return false;
        }
        return true;
    }

private:
    template <class Visit>
    bool visit_neighbours(std::uint32_t vertex, Visit visit) const {
        const std::uint32_t end = table_.first_neighbour[vertex + 1];
        for (std::uint32_t i = table_.first_neighbour[vertex]; i < end; ++i) {
            if (!visit(at(table_.neighbours[i]))) return false;
        }
        return true;
    }

    std::span<const Eigen::Vector3d> vertices_;
    const ClimbTable& table_;
    Eigen::Vector3d direction_;
    double slack_;
};

// Cell of a cube map that a direction falls into; 0 for a direction of 0 or NaN.
std::size_t cell_of(const Eigen::Vector3d& direction, int resolution) {
    int axis = 0;
    for (int i = 1; i < 3; ++i) {
        if (std::abs(direction[i]) > std::abs(direction[axis])) axis = i;
    }
    const double largest = std::abs(direction[axis]);
    const auto index = [&](double along) {
        const double place = (along / largest + 1.0) * 0.5 * resolution;
        if (!(place > 0.0)) return 0;  // also for NaN
        return std::min(static_cast<int>(std::min(place, 1e6)), resolution - 1);
    };
    const int side = 2 * axis + (direction[axis] < 0.0 ? 1 : 0);
    const int u = index(direction[(axis + 1) % 3]);
    const int v = index(direction[(axis + 2) % 3]);
    return static_cast<std::size_t>((side * resolution + v) * resolution + u);
}

}  // namespace

std::uint32_t find_extreme_by_scan(std::span<const Eigen::Vector3d> vertices,
                                   const Eigen::Vector3d& direction) {
    Candidate best{dot(direction, vertices[0]), 0};
    for (std::uint32_t i = 1; i < vertices.size(); ++i) {
        const double along = dot(direction, vertices[i]);
        if (along > best.along) best = {along, i};
    }
    return best.vertex;
}

std::uint32_t find_extreme_by_climb(std::span<const Eigen::Vector3d> vertices,
                                    const ClimbTable& table, const Eigen::Vector3d& direction) {
    // Products that overflow cannot be ordered.
    if (!(dot(direction, direction) <= 1e200)) return find_extreme_by_scan(vertices, direction);
    const Climb climb(vertices, table, direction);
    Candidate best = climb.at(table.starts[cell_of(direction, table.resolution)]);
    best = climb.steepest(best);
    if (!climb.search_plateau(best)) return find_extreme_by_scan(vertices, direction);
    return best.vertex;
}

std::uint32_t find_extreme(const Polyhedron& hull, const Eigen::Vector3d& direction) {
    if (hull.climb == nullptr) return find_extreme_by_scan(hull.vertices, direction);
    return find_extreme_by_climb(hull.vertices, *hull.climb, direction);
}

void fill_climb_starts(std::span<const Eigen::Vector3d> vertices, ClimbTable& table_out) {
    // About one cell per vertex, so that a climb takes a step or two.
    const double count = static_cast<double>(vertices.size());
    table_out.resolution = std::max(1, static_cast<int>(std::sqrt(count / 6.0)));
    const int resolution = table_out.resolution;
    table_out.starts.assign(static_cast<std::size_t>(6 * resolution * resolution), 0);
    std::uint32_t last = 0;
    for (std::size_t cell = 0; cell < table_out.starts.size(); ++cell) {
        const int place = static_cast<int>(cell);
        const int axis = place / (2 * resolution * resolution);
        const int row = place / resolution % resolution;
        int column = place % resolution;
        if (row % 2 != 0) column = resolution - 1 - column;  // zigzag, so that climbs are short
        Eigen::Vector3d direction;
        direction[axis] = place / (resolution * resolution) % 2 != 0 ? -1.0 : 1.0;
        direction[(axis + 1) % 3] = (2.0 * column + 1.0) / resolution - 1.0;
        direction[(axis + 2) % 3] = (2.0 * row + 1.0) / resolution - 1.0;
        const Climb climb(vertices, table_out, direction);
        last = climb.steepest(climb.at(last)).vertex;
        table_out.starts[cell_of(direction, resolution)] = last;
    }
}

}  // namespace terrane::internal
