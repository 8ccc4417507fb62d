// SPDX-License-Identifier: MIT
#include "mesh/star_mesh.h"

#include <algorithm>
#include <utility>

namespace terrane::internal {

Ring Ring::rotated(std::size_t first) const {
    Ring result;
    result.count = count;
    result.is_closed = is_closed;
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t from = i + first < count ? i + first : i + first - count;
        result.vertices[i] = vertices[from];
        result.triangles[i] = triangles[from];
        result.corners[i] = corners[from];
    }
    return result;
}

StarMesh::StarMesh(std::size_t vertex_count, std::span<const Triangle> triangles)
    : slots_(triangles.size()), first_corner_(vertex_count, kEnd), alive_count_(triangles.size()) {
    for (std::uint32_t i = static_cast<std::uint32_t>(slots_.size()); i-- > 0;) {
        slots_[i].triangle = triangles[i];
        for (std::uint32_t k = 3; k-- > 0;) {
            std::uint32_t& first = first_corner_[triangles[i][k]];
            slots_[i].next[k] = first;
            first = 3 * i + k;
        }
    }
}

template <class Visit>
void StarMesh::visit_corners(std::uint32_t vertex, const Visit& visit) {
    std::uint32_t* link = &first_corner_[vertex];
    while (*link != kEnd) {
        const std::uint32_t corner = *link;
        if (!is_alive(corner / 3)) {
            *link = next(corner);
            continue;
        }
        if (!visit(corner)) return;
        link = &next(corner);
    }
}

bool StarMesh::find_ring(std::uint32_t vertex, Ring& ring_out) {
    struct Spoke {
        std::uint32_t from, to, corner;
    };
    std::array<Spoke, kMaxValence> spokes;
    std::size_t count = 0;
    bool fits = true;
    visit_corners(vertex, [&](std::uint32_t corner) {
        if (count == kMaxValence) return fits = false;
        const Triangle& t = slots_[corner / 3].triangle;
        const std::uint32_t i = corner % 3;
        spokes[count++] = {t[i == 2 ? 0 : i + 1], t[i == 0 ? 2 : i - 1], corner};
        return true;
    });
    if (!fits || count == 0) return false;
    // a half disk starts at the only neighbour that no triangle ends at
    std::size_t first = 0, begins = 0;
    for (std::size_t i = 0; i < count; ++i) {
        std::size_t before = 0;
        for (std::size_t j = 0; j < count; ++j) {
            before += static_cast<std::size_t>(spokes[j].to == spokes[i].from);
            if (j != i && spokes[j].from == spokes[i].from) return false;
        }
        if (before > 1) return false;
        if (before == 0) {
            first = i;
            ++begins;
        }
    }
    if (begins > 1) return false;
    std::swap(spokes[0], spokes[first]);
    for (std::size_t i = 0; i < count; ++i) {
        ring_out.vertices[i] = spokes[i].from;
        ring_out.triangles[i] = spokes[i].corner / 3;
        ring_out.corners[i] = static_cast<std::uint8_t>(spokes[i].corner % 3);
        if (i + 1 == count) break;
        std::size_t j = i + 1;
        while (j < count && spokes[j].from != spokes[i].to) ++j;
        if (j == count) return false;  // two disks
        std::swap(spokes[i + 1], spokes[j]);
    }
    ring_out.is_closed = spokes[count - 1].to == spokes[0].from;
    ring_out.count = count;
    if (ring_out.is_closed) return count > 2 && begins == 0;
    if (begins == 0) return false;
    ring_out.vertices[count] = spokes[count - 1].to;
    ring_out.triangles[count] = kNoTriangle;
    ring_out.corners[count] = 0;
    ring_out.count = count + 1;
    return true;
}

void StarMesh::find_neighbours(std::uint32_t vertex, Neighbours& neighbours_out) {
    Neighbours& result = neighbours_out;
    result.count = 0;
    result.has_all = true;
    const auto add = [&](std::uint32_t other) {
        for (std::size_t i = 0; i < result.count; ++i) {
            if (result.vertices[i] != other) continue;
            ++result.edge_triangles[i];
            return;
        }
        result.vertices[result.count] = other;
        result.edge_triangles[result.count++] = 1;
    };
    std::size_t valence = 0;
    visit_corners(vertex, [&](std::uint32_t corner) {
        if (valence++ == kMaxValence) return result.has_all = false;
        const Triangle& t = slots_[corner / 3].triangle;
        const std::uint32_t i = corner % 3;
        add(t[i == 2 ? 0 : i + 1]);
        add(t[i == 0 ? 2 : i - 1]);
        return true;
    });
}

bool StarMesh::has_triangle(std::uint32_t vertex, std::uint32_t second, std::uint32_t third,
                            std::uint32_t not_of) {
    bool found = false;
    visit_corners(vertex, [&](std::uint32_t corner) {
        const Triangle& t = slots_[corner / 3].triangle;
        const auto has = [&](std::uint32_t v) { return t[0] == v || t[1] == v || t[2] == v; };
        found = has(second) && has(third) && !has(not_of);
        return !found;
    });
    return found;
}

std::uint32_t StarMesh::triangle_at(std::uint32_t from, std::uint32_t to) {
    std::uint32_t found = kNoTriangle;
    visit_corners(from, [&](std::uint32_t corner) {
        const bool is_there =
            slots_[corner / 3].triangle[corner % 3 == 2 ? 0 : corner % 3 + 1] == to;
        if (is_there) found = corner / 3;
        return !is_there;
    });
    return found;
}

void StarMesh::remove(std::uint32_t triangle) {
    slots_[triangle].triangle.fill(kGone);
    --alive_count_;
}

void StarMesh::add(const Triangle& triangle) {
    const auto index = static_cast<std::uint32_t>(slots_.size());
    slots_.push_back({triangle, {}});
    for (std::uint32_t k = 0; k < 3; ++k) {
        std::uint32_t& first = first_corner_[triangle[k]];
        slots_[index].next[k] = first;
        first = 3 * index + k;
    }
    ++alive_count_;
}

void StarMesh::contract(std::uint32_t u, const Ring& ring) {
    const std::uint32_t v = ring.vertices[0];
    for (const std::size_t i : {std::size_t{0}, ring.count - 1}) {
        if (ring.triangles[i] == kNoTriangle) continue;
        remove(ring.triangles[i]);
    }
    std::uint32_t last = kEnd;
    visit_corners(u, [&](std::uint32_t corner) {
        slots_[corner / 3].triangle[corner % 3] = v;
        last = corner;
        return true;
    });
    if (last != kEnd) {
        next(last) = first_corner_[v];
        first_corner_[v] = first_corner_[u];
    }
    first_corner_[u] = kEnd;
}

namespace {

constexpr double kRoundedUpDistance = 1.0 + 0x1p-40;

}  // namespace

double largest_distance(const Corners& from, const Corners& to) {
    double largest = 0.0, size = 0.0;
    for (const Eigen::Vector3d& p : from) {
        largest = std::max(largest, distance_to_triangle(p, to));
        size = std::max(size, length(p - to[0]));
    }
    for (const Eigen::Vector3d& p : to) size = std::max(size, length(p - to[0]));
    return largest * kRoundedUpDistance + size * 0x1p-40;
}

}  // namespace terrane::internal
