// SPDX-License-Identifier: MIT
#include "mesh_checks.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <sstream>

namespace terrane::test {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

std::string name(const SoupVertex& v) {
    std::ostringstream out;
    out << "(" << v.point.x << ", " << v.point.y << ", " << v.height;
    if (v.offset != 0.0f) out << " + " << std::hexfloat << v.offset << " m";
    out << ")";
    return out.str();
}

std::uint64_t hash(const LatticePoint& point) {
    std::uint64_t h = static_cast<std::uint64_t>(point.x) * 0x9e3779b97f4a7c15u;
    h ^= (h >> 32) + static_cast<std::uint64_t>(point.y) * 0xc2b2ae3d27d4eb4fu;
    h *= 0xff51afd7ed558ccdu;
    return h ^ (h >> 32);
}

// Adding zero turns -0 into +0: both display the same height.
std::uint32_t offset_bits(const SoupVertex& v) {
    return std::bit_cast<std::uint32_t>(v.offset + 0.0f);
}

SoupTriangle triangle_at(const TerrainMesh& mesh, const MeshChunk& part, std::size_t first) {
    SoupTriangle triangle;
    for (std::size_t corner = 0; corner < 3; ++corner) {
        const std::uint16_t index = mesh.indices[part.first_index + first + corner];
        const Chunk& chunk = *part.chunk;
        triangle[corner] = {{chunk.corner.x + (index % kChunkSamples) * chunk.step,
                             chunk.corner.y + (index / kChunkSamples) * chunk.step},
                            chunk.heights[index],
                            part.offsets == nullptr ? 0.0f : part.offsets[index]};
    }
    return triangle;
}

// A sum of areas in halves of a squared finest spacing, exact beyond 64 bits.
class ExactArea {
public:
    void add(std::uint64_t doubled, std::uint64_t times = 1) {
        low_ += (doubled & 0xffffffffu) * times;
        high_ += (doubled >> 32) * times + (low_ >> 32);
        low_ &= 0xffffffffu;
    }
    double value() const {
        return 0.5 * (static_cast<double>(high_) * 0x1p32 + static_cast<double>(low_));
    }
    friend bool operator==(const ExactArea&, const ExactArea&) = default;

private:
    std::uint64_t high_ = 0, low_ = 0;
};

// Accumulates the triangles of a mesh one by one.
class FlawFinder {
public:
    FlawFinder(const Lattice& lattice, std::size_t triangle_count) : lattice_(lattice) {
        vertices_.reserve(triangle_count / 2 + 16);
        triangles_.reserve(triangle_count);
        grow(std::bit_ceil(triangle_count + 16));
    }

    void add(const SoupTriangle& triangle) {
        if (!flaw_.empty()) return;
        check_shape(triangle);
        std::array<std::uint32_t, 3> numbers{};
        for (std::size_t i = 0; i < 3; ++i) numbers[i] = number_of(triangle[i]);
        triangles_.push_back(numbers);
    }

    std::string finish() {
        if (flaw_.empty()) check_edges();
        if (flaw_.empty()) check_area();
        return flaw_;
    }

private:
    void check_shape(const SoupTriangle& t) {
        for (const SoupVertex& v : t) {
            if (v.point.x < lattice_.west() || v.point.x > lattice_.east() ||
                v.point.y < lattice_.south() || v.point.y > lattice_.north()) {
                flaw_ = "vertex " + name(v) + " is outside the world";
                return;
            }
            if (!std::isfinite(v.offset)) {
                flaw_ = "the offset of vertex " + name(v) + " is not finite";
                return;
            }
        }
        const std::int64_t dx1 = t[1].point.x - t[0].point.x;
        const std::int64_t dy1 = t[1].point.y - t[0].point.y;
        const std::int64_t dx2 = t[2].point.x - t[0].point.x;
        const std::int64_t dy2 = t[2].point.y - t[0].point.y;
        const std::int64_t side = lattice_.chunk_side(0);
        for (const std::int64_t d : {dx1, dy1, dx2, dy2}) {
            if (d <= side && d >= -side) continue;
            flaw_ = "triangle at " + name(t[0]) + " is larger than a root square";
            return;
        }
        const std::int64_t doubled = dx1 * dy2 - dx2 * dy1;
        if (doubled > 0) {
            area_.add(static_cast<std::uint64_t>(doubled));
        } else {
            flaw_ = "triangle at " + name(t[0]) + " is not counter-clockwise";
        }
    }

    // Index of the vertex at a lattice point; vertices are numbered in the order of first use.
    std::uint32_t number_of(const SoupVertex& v) {
        if (2 * vertices_.size() >= table_.size()) grow(2 * table_.size());
        std::uint32_t& slot = find(v.point);
        if (slot == kNone) {
            slot = static_cast<std::uint32_t>(vertices_.size());
            vertices_.push_back(v);
            return slot;
        }
        const SoupVertex& known = vertices_[slot];
        if (known.height != v.height) {
            flaw_ = "two heights at " + name(known) + " and " + name(v);
        } else if (offset_bits(known) != offset_bits(v)) {
            flaw_ = "two offsets at " + name(known) + " and " + name(v);
        }
        return slot;
    }

    std::uint32_t& find(const LatticePoint& point) {
        const std::size_t mask = table_.size() - 1;
        std::size_t at = hash(point) & mask;
        while (table_[at] != kNone && vertices_[table_[at]].point != point) at = (at + 1) & mask;
        return table_[at];
    }

    void grow(std::size_t size) {
        table_.assign(size, kNone);
        for (std::uint32_t i = 0; i < vertices_.size(); ++i) find(vertices_[i].point) = i;
    }

    // Groups edges by their lower vertex; each entry holds the other vertex and one bit for the direction.
    void check_edges() {
        std::vector<std::uint32_t> first(vertices_.size() + 2, 0);
        const auto for_all_edges = [&](auto use) {
            for (const std::array<std::uint32_t, 3>& t : triangles_) {
                for (std::size_t i = 0; i < 3; ++i) {
                    const std::uint32_t a = t[i], b = t[(i + 1) % 3];
                    use(std::min(a, b), std::max(a, b) << 1 | (a < b ? 0u : 1u));
                }
            }
        };
        for_all_edges([&](std::uint32_t lower, std::uint32_t) { ++first[lower + 2]; });
        std::partial_sum(first.begin(), first.end(), first.begin());
        std::vector<std::uint32_t> edges(3 * triangles_.size());
        for_all_edges(
            [&](std::uint32_t lower, std::uint32_t other) { edges[first[lower + 1]++] = other; });
        for (std::uint32_t v = 0; v < vertices_.size() && flaw_.empty(); ++v) {
            const auto begin = edges.begin() + first[v], end = edges.begin() + first[v + 1];
            std::sort(begin, end);
            for (auto edge = begin; edge != end && flaw_.empty();) {
                const auto next =
                    std::find_if(edge, end, [&](std::uint32_t e) { return e >> 1 != *edge >> 1; });
                check_edge(vertices_[v], vertices_[*edge >> 1], next - edge, *edge != *(next - 1));
                edge = next;
            }
        }
    }

    void check_edge(const SoupVertex& a, const SoupVertex& b, std::ptrdiff_t uses,
                    bool is_used_both_ways) {
        const bool on_border = (a.point.x == b.point.x &&
                                (a.point.x == lattice_.west() || a.point.x == lattice_.east())) ||
                               (a.point.y == b.point.y &&
                                (a.point.y == lattice_.south() || a.point.y == lattice_.north()));
        if (on_border ? uses == 1 : uses == 2 && is_used_both_ways) return;
        flaw_ = "edge " + name(a) + " - " + name(b) + " is used " + std::to_string(uses) +
                (uses == 2 && !is_used_both_ways ? " times in one direction" : " times");
    }

    void check_area() {
        const auto side = static_cast<std::uint64_t>(lattice_.chunk_side(0));
        ExactArea whole;
        whole.add(2 * side * side, static_cast<std::uint64_t>(lattice_.root_count_x) *
                                       static_cast<std::uint64_t>(lattice_.root_count_y));
        if (area_ == whole) return;
        flaw_ = "the triangles cover " + std::to_string(area_.value()) + " of " +
                std::to_string(whole.value());
    }

    Lattice lattice_;
    std::vector<SoupVertex> vertices_;
    std::vector<std::uint32_t> table_;  // open addressing into vertices_
    std::vector<std::array<std::uint32_t, 3>> triangles_;
    ExactArea area_;
    std::string flaw_;
};

}  // namespace

WorldPos displayed(const SoupVertex& vertex, const Lattice& lattice) {
    return {
        lattice.x(vertex.point.x), lattice.y(vertex.point.y),
        lattice.quantum * static_cast<double>(vertex.height) + static_cast<double>(vertex.offset)};
}

std::vector<SoupTriangle> make_soup(const TerrainMesh& mesh) {
    std::vector<SoupTriangle> soup;
    soup.reserve(mesh.triangle_count);
    for (const MeshChunk& part : mesh.chunks) {
        for (std::size_t i = 0; i < part.index_count; i += 3) {
            soup.push_back(triangle_at(mesh, part, i));
        }
    }
    return soup;
}

std::string find_flaw(const std::vector<SoupTriangle>& soup, const Lattice& lattice) {
    FlawFinder finder(lattice, soup.size());
    for (const SoupTriangle& triangle : soup) finder.add(triangle);
    return finder.finish();
}

std::string find_flaw(const TerrainMesh& mesh) {
    FlawFinder finder(mesh.resident->window(), mesh.triangle_count);
    std::size_t index_count = 0;
    for (const MeshChunk& part : mesh.chunks) {
        if (part.index_count % 3 != 0 || part.first_index > mesh.indices.size() ||
            part.index_count > mesh.indices.size() - part.first_index) {
            return "a chunk's indices are no part of the mesh's";
        }
        index_count += part.index_count;
        for (std::size_t i = 0; i < part.index_count; ++i) {
            if (mesh.indices[part.first_index + i] >= kChunkSamples * kChunkSamples) {
                return "an index names no sample";
            }
        }
        for (std::size_t i = 0; i < part.index_count; i += 3) {
            finder.add(triangle_at(mesh, part, i));
        }
    }
    if (index_count != 3 * mesh.triangle_count) return "the mesh miscounts its triangles";
    return finder.finish();
}

// Brute-force measurement of a mesh's displayed error.
// Source: M. Roberts. The unreasonable effectiveness of quasirandom sequences. 2018 (R2).

namespace {

using Corners = std::array<WorldPos, 3>;

// Accumulates screen errors of points in one view.
class PointErrors {
public:
    PointErrors(const HeightSource& source, const View& view, double allowed_m = 0.0)
        : source_(source),
          allowed_(allowed_m),
          eye_(view.eye_world),
          near_(view.near_distance),
          pixels_(view.pixels_per_radian()),
          frustum_(make_frustum(view)) {}

    // Compares a displayed point with the true surface.
    void add(const WorldPos& shown_world) {
        if (!source_.extent().contains(shown_world.x(), shown_world.y())) return;
        const double truth = source_.height(shown_world.x(), shown_world.y());
        const Eigen::Vector3d from_eye = WorldPos(shown_world.x(), shown_world.y(), truth) - eye_;
        for (const Eigen::Vector3d& normal : frustum_.normals) {
            if (normal.dot(from_eye) < 0.0) return;
        }
        const double metres = std::abs(shown_world.z() - truth) - allowed_;
        const double error = metres * pixels_ / std::max(near_, from_eye.norm());
        if (!(error <= worst_) && !std::isnan(worst_)) worst_ = error;  // keeps NaN
    }

    // False only if no true point over the bounding box of the triangle is inside the view's side planes.
    bool may_see(const Corners& corners) const {
        const WorldPos low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
        const WorldPos high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
        const HeightInterval z = source_.interval({low.x(), low.y(), high.x(), high.y()});
        const auto is_before = [&](const Eigen::Vector3d& normal) {
            const WorldPos corner(normal.x() > 0.0 ? high.x() : low.x(),
                                  normal.y() > 0.0 ? high.y() : low.y(),
                                  normal.z() > 0.0 ? z.high : z.low);
            const Eigen::Vector3d from_eye = corner - eye_;
            return normal.dot(from_eye) >= -1e-9 * from_eye.norm();
        };
        return std::all_of(frustum_.normals.begin(), frustum_.normals.end(), is_before);
    }

    double worst() const { return worst_; }

private:
    const HeightSource& source_;
    double allowed_;
    WorldPos eye_;
    double near_, pixels_;
    Frustum frustum_;
    double worst_ = 0.0;
};

Corners corners_of(const SoupTriangle& triangle, const Lattice& lattice) {
    return {displayed(triangle[0], lattice), displayed(triangle[1], lattice),
            displayed(triangle[2], lattice)};
}

// Adds the points of a regular grid that lie in a triangle, edges included; coordinates are in grid steps.
void add_net(const SoupTriangle& triangle, const Lattice& lattice, int per_side,
             PointErrors& errors) {
    const Corners corners = corners_of(triangle, lattice);
    if (!errors.may_see(corners)) return;
    std::array<Eigen::Vector2d, 3> net;
    for (std::size_t k = 0; k < 3; ++k) {
        net[k] = {static_cast<double>(triangle[k].point.x * per_side),
                  static_cast<double>(triangle[k].point.y * per_side)};
    }
    const Eigen::Vector2d b = net[1] - net[0], c = net[2] - net[0];
    const double area = b.x() * c.y() - b.y() * c.x();
    const double south = std::min({net[0].y(), net[1].y(), net[2].y()});
    const double north = std::max({net[0].y(), net[1].y(), net[2].y()});
    for (double y = south + 0.5; y < north; y += 1.0) {
        double west = std::max({net[0].x(), net[1].x(), net[2].x()});
        double east = std::min({net[0].x(), net[1].x(), net[2].x()});
        for (std::size_t k = 0; k < 3; ++k) {
            const Eigen::Vector2d& from = net[k];
            const Eigen::Vector2d& to = net[(k + 1) % 3];
            if ((y < from.y()) == (y < to.y())) continue;
            const double x = from.x() + (y - from.y()) * (to.x() - from.x()) / (to.y() - from.y());
            west = std::min(west, x);
            east = std::max(east, x);
        }
        for (double x = std::ceil(west - 0.5) + 0.5; x <= east; x += 1.0) {
            const double px = x - net[0].x(), py = y - net[0].y();
            const double u = (px * c.y() - py * c.x()) / area;
            const double v = (b.x() * py - b.y() * px) / area;
            errors.add(corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0]));
        }
    }
}

}  // namespace

double measure_error_px(const std::vector<SoupTriangle>& soup, const HeightSource& source,
                        const View& view, int per_triangle, double allowed_m) {
    PointErrors errors(source, view, allowed_m);
    for (std::size_t t = 0; t < soup.size(); ++t) {
        const Corners corners = corners_of(soup[t], source.lattice());
        for (int i = 0; i < per_triangle; ++i) {
            // each triangle uses another part of the sequence, folded into the triangle
            const double k = static_cast<double>(i) + 0.5 + 0.137 * static_cast<double>(t % 97);
            double u = k * 0.7548776662466927;
            double v = k * 0.5698402909980532;
            u -= std::floor(u);
            v -= std::floor(v);
            if (u + v > 1.0) {
                u = 1.0 - u;
                v = 1.0 - v;
            }
            errors.add(corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0]));
        }
    }
    return errors.worst();
}

double measure_error_px_everywhere(const std::vector<SoupTriangle>& soup,
                                   const HeightSource& source, const View& view, int per_side) {
    PointErrors errors(source, view);
    for (const SoupTriangle& triangle : soup) {
        add_net(triangle, source.lattice(), per_side, errors);
    }
    return errors.worst();
}

}  // namespace terrane::test
