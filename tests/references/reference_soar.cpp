// SPDX-License-Identifier: MIT
//
// Sources:
//   P. Lindstrom, V. Pascucci. Visualization of Large Terrains Made Easy. IEEE Visualization 2001.
//   P. Lindstrom, V. Pascucci. Terrain Simplification Simplified. IEEE TVCG 8(3), 2002.
// Deviations: certified errors of whole diamonds instead of midpoint errors; an index list instead
// of strips, into one vertex buffer that never changes; a budget, met by collecting the priorities
// above a bracket taken from the frame before and picking one of them.
#include "reference_soar.h"

#include <terrane/base/result.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

namespace terrane::test {
namespace {

constexpr unsigned kAllPlanes = 15;

}  // namespace

SoarReference::SoarReference(const TableHeights& source) {
    const HeightTable& table = source.padded();
    TERRANE_ASSERT(table.columns == table.rows, "one root square");
    side_ = table.columns;
    spacing_ = static_cast<float>(table.spacing);
    for (int cells = side_ - 1; cells > 1; cells /= 2) depth_ += 2;
    vertices_.resize(table.heights.size());
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
        vertices_[i] = {table.heights[i], source.bounds()[i], 0.0f};
    }
    make_radii();
}

// From fine to coarse. A finest midpoint's ball holds the corners of its diamond, every other ball
// those of the vertices just below it.
void SoarReference::make_radii() {
    constexpr float kOutward = 1.0f + 0x1p-20f;
    const auto hold = [&](Point p, int dx, int dy, bool with_ball) {
        const Point q{p.x + dx, p.y + dy};
        if (q.x < 0 || q.y < 0 || q.x >= side_ || q.y >= side_) return;
        Vertex& vertex = vertices_[index(p)];
        const Vertex& held = vertices_[index(q)];
        const float rise = vertex.height - held.height;
        const float across = spacing_ * spacing_ * static_cast<float>(dx * dx + dy * dy);
        const float reach = std::sqrt(across + rise * rise) + (with_ball ? held.radius : 0.0f);
        vertex.radius = std::max(vertex.radius, reach * kOutward);
    };
    for (int s = 1; 2 * s <= side_ - 1; s *= 2) {
        for (int y = 0; y < side_; y += s) {
            for (int x = (y / s) % 2 != 0 ? 0 : s; x < side_; x += 2 * s) {
                const int reach = s == 1 ? 1 : s / 2;
                if (s == 1) {
                    for (const int step : {-reach, reach}) {
                        hold({x, y}, step, 0, false);
                        hold({x, y}, 0, step, false);
                    }
                } else {
                    for (const int dx : {-reach, reach}) {
                        for (const int dy : {-reach, reach}) hold({x, y}, dx, dy, true);
                    }
                }
            }
        }
        for (int y = s; y < side_; y += 2 * s) {
            for (int x = s; x < side_; x += 2 * s) {
                for (const int step : {-s, s}) {
                    hold({x, y}, step, 0, true);
                    hold({x, y}, 0, step, true);
                }
            }
        }
    }
}

void SoarReference::look(const View& view) {
    const Frustum frustum = make_frustum(view);
    screen_.eye_x = static_cast<float>(view.eye_world.x());
    screen_.eye_y = static_cast<float>(view.eye_world.y());
    screen_.eye_z = static_cast<float>(view.eye_world.z());
    screen_.pixels = static_cast<float>(view.pixels_per_radian());
    screen_.near_distance = static_cast<float>(view.near_distance);
    for (std::size_t plane = 0; plane < 4; ++plane) {
        for (int axis = 0; axis < 3; ++axis) {
            screen_.normals[plane][axis] = static_cast<float>(frustum.normals[plane][axis]);
        }
    }
}

inline float SoarReference::priority(Point p, const Vertex& vertex, unsigned& planes) const {
    const float dx = spacing_ * static_cast<float>(p.x) - screen_.eye_x;
    const float dy = spacing_ * static_cast<float>(p.y) - screen_.eye_y;
    const float dz = vertex.height - screen_.eye_z;
    for (unsigned plane = 0; planes >> plane != 0; ++plane) {
        if ((planes >> plane & 1u) == 0) continue;
        const float* normal = screen_.normals[plane];
        const float inside = normal[0] * dx + normal[1] * dy + normal[2] * dz;
        if (inside < -vertex.radius) return 0.0f;
        if (inside > vertex.radius) planes &= ~(1u << plane);
    }
    const float distance = std::sqrt(dx * dx + dy * dy + dz * dz) - vertex.radius;
    return vertex.error * screen_.pixels / std::max(distance, screen_.near_distance);
}

// Every inner vertex is met in both triangles that it splits: one priority for each triangle more.
void SoarReference::gather(Point apex, Point left, Point right, int depth, unsigned planes) {
    const Point middle{(left.x + right.x) / 2, (left.y + right.y) / 2};
    const float here = priority(middle, vertices_[index(middle)], planes);
    if (!(here > tau_)) return;
    priorities_.push_back(here);
    if (depth == 1) return;
    gather(middle, apex, left, depth - 1, planes);
    gather(middle, right, apex, depth - 1, planes);
}

void SoarReference::emit(Point apex, Point left, Point right, int depth, unsigned planes) {
    if (depth > 0) {
        const Point middle{(left.x + right.x) / 2, (left.y + right.y) / 2};
        if (priority(middle, vertices_[index(middle)], planes) > tau_) {
            emit(middle, apex, left, depth - 1, planes);
            emit(middle, right, apex, depth - 1, planes);
            return;
        }
    }
    if (used_ + 3 > indices_.size()) indices_.resize(2 * indices_.size() + 3);
    std::uint32_t* const out = &indices_[used_];
    out[0] = static_cast<std::uint32_t>(index(apex));
    out[1] = static_cast<std::uint32_t>(index(right));
    out[2] = static_cast<std::uint32_t>(index(left));
    used_ += 3;
}

void SoarReference::emit_all() {
    const int last = side_ - 1;
    const unsigned planes = culls ? kAllPlanes : 0u;
    used_ = 0;
    emit({last, 0}, {0, 0}, {last, last}, depth_, planes);
    emit({0, last}, {last, last}, {0, 0}, depth_, planes);
}

std::size_t SoarReference::refine(const View& view, double tau_px) {
    look(view);
    tau_ = static_cast<float>(tau_px);
    emit_all();
    return used_ / 3;
}

std::size_t SoarReference::refine_to_budget(const View& view, std::size_t budget) {
    constexpr float kLowest = 1e-6f;
    look(view);
    const std::size_t splits = budget - 2;
    const int last = side_ - 1;
    const unsigned planes = culls ? kAllPlanes : 0u;
    tau_ = tau_ > 0.0f ? 0.9f * tau_ : 64.0f;
    for (;; tau_ *= 0.7f) {
        priorities_.clear();
        gather({last, 0}, {0, 0}, {last, last}, depth_, planes);
        gather({0, last}, {last, last}, {0, 0}, depth_, planes);
        if (priorities_.size() > splits || tau_ < kLowest) break;
    }
    if (priorities_.size() > splits) {
        const auto chosen = priorities_.begin() + static_cast<std::ptrdiff_t>(splits);
        std::nth_element(priorities_.begin(), chosen, priorities_.end(), std::greater<>());
        tau_ = *chosen;
    }
    emit_all();
    return used_ / 3;
}

}  // namespace terrane::test
