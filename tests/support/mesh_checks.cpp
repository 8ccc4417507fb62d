// SPDX-License-Identifier: MIT
#include "support/mesh_checks.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <utility>

namespace terrane::test {
namespace {

std::string name(const SoupVertex& v) {
    std::ostringstream out;
    out << "(" << v.point.x << ", " << v.point.y << ", " << v.height << ")";
    return out.str();
}

double doubled_area(const SoupTriangle& t) {
    const auto dx1 = static_cast<double>(t[1].point.x - t[0].point.x);
    const auto dy1 = static_cast<double>(t[1].point.y - t[0].point.y);
    const auto dx2 = static_cast<double>(t[2].point.x - t[0].point.x);
    const auto dy2 = static_cast<double>(t[2].point.y - t[0].point.y);
    return dx1 * dy2 - dx2 * dy1;
}

}  // namespace

std::vector<SoupTriangle> make_soup(const TerrainMesh& mesh) {
    std::vector<SoupTriangle> soup;
    soup.reserve(mesh.triangle_count);
    for (const MeshChunk& part : mesh.chunks) {
        for (std::uint32_t i = 0; i < part.index_count; i += 3) {
            SoupTriangle triangle;
            for (std::uint32_t corner = 0; corner < 3; ++corner) {
                const std::uint16_t index = mesh.indices[part.first_index + i + corner];
                const Chunk& chunk = *part.chunk;
                triangle[corner] = {{chunk.corner.x + (index % kChunkSamples) * chunk.step,
                                     chunk.corner.y + (index / kChunkSamples) * chunk.step},
                                    chunk.heights[index]};
            }
            soup.push_back(triangle);
        }
    }
    return soup;
}

std::string find_flaw(const std::vector<SoupTriangle>& soup, const Lattice& lattice) {
    std::map<std::pair<SoupVertex, SoupVertex>, std::pair<int, int>> edges;  // forward, backward
    std::map<LatticePoint, std::int32_t> heights;
    double area = 0.0;
    for (const SoupTriangle& triangle : soup) {
        const double doubled = doubled_area(triangle);
        if (!(doubled > 0.0))
            return "triangle at " + name(triangle[0]) + " is not counter-clockwise";
        area += 0.5 * doubled;
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const SoupVertex& a = triangle[corner];
            const SoupVertex& b = triangle[(corner + 1) % 3];
            const auto [known, is_new] = heights.emplace(a.point, a.height);
            if (!is_new && known->second != a.height) return "two heights at " + name(a);
            auto& uses = edges[a < b ? std::pair(a, b) : std::pair(b, a)];
            ++(a < b ? uses.first : uses.second);
        }
    }
    for (const auto& [edge, uses] : edges) {
        const auto& [a, b] = edge;
        const bool on_border = (a.point.x == b.point.x &&
                                (a.point.x == lattice.west() || a.point.x == lattice.east())) ||
                               (a.point.y == b.point.y &&
                                (a.point.y == lattice.south() || a.point.y == lattice.north()));
        const bool is_good =
            on_border ? uses.first + uses.second == 1 : uses.first == 1 && uses.second == 1;
        if (!is_good) {
            return "edge " + name(a) + " - " + name(b) + " is used " +
                   std::to_string(uses.first + uses.second) + " times";
        }
    }
    const double whole = static_cast<double>(lattice.east() - lattice.west()) *
                         static_cast<double>(lattice.north() - lattice.south());
    if (area != whole) {
        return "the triangles cover " + std::to_string(area) + " of " + std::to_string(whole);
    }
    return "";
}

double measure_error_px(const std::vector<SoupTriangle>& soup, const HeightSource& source,
                        const View& view, int per_triangle) {
    const Lattice& lattice = source.lattice();
    const Frustum frustum = make_frustum(view);
    double worst = 0.0;
    for (std::size_t t = 0; t < soup.size(); ++t) {
        const SoupTriangle& triangle = soup[t];
        std::array<Eigen::Vector3d, 3> corners;
        for (std::size_t k = 0; k < 3; ++k) {
            corners[k] = {lattice.x(triangle[k].point.x), lattice.y(triangle[k].point.y),
                          lattice.quantum * triangle[k].height};
        }
        for (int i = 0; i < per_triangle; ++i) {
            // the additive recurrence of the plastic number, folded into the triangle
            const double k = static_cast<double>(i) + 0.5 + 0.137 * static_cast<double>(t % 97);
            double u = k * 0.7548776662466927;
            double v = k * 0.5698402909980532;
            u -= std::floor(u);
            v -= std::floor(v);
            if (u + v > 1.0) {
                u = 1.0 - u;
                v = 1.0 - v;
            }
            const Eigen::Vector3d shown =
                corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0]);
            if (!source.extent().contains(shown.x(), shown.y())) continue;
            const Eigen::Vector3d truth(shown.x(), shown.y(), source.height(shown.x(), shown.y()));
            const Eigen::Vector3d way = truth - view.eye_world;
            const bool is_inside =
                std::all_of(frustum.normals.begin(), frustum.normals.end(),
                            [&](const Eigen::Vector3d& normal) { return normal.dot(way) >= 0.0; });
            if (!is_inside) continue;
            worst = std::max(worst, std::abs(shown.z() - truth.z()) * view.pixels_per_radian() /
                                        std::max(view.near_distance, way.norm()));
        }
    }
    return worst;
}

}  // namespace terrane::test
