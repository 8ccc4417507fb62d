// SPDX-License-Identifier: MIT
#include "reference_meshes.h"

#include <terrane/base/result.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <unordered_map>

namespace terrane::test {
namespace {

std::int64_t floor_divide(std::int64_t a, std::int64_t positive) {
    return a >= 0 ? a / positive : -((-a + positive - 1) / positive);
}

}  // namespace

Worst find_worst(const HeightTable& table, const std::array<Place, 3>& corners) {
    const auto& [a, b, c] = corners;
    const auto doubled = static_cast<double>(cross(a, b, c));
    const double za = static_cast<double>(table.at(a[0], a[1]));
    const double rise_b = static_cast<double>(table.at(b[0], b[1])) - za;
    const double rise_c = static_cast<double>(table.at(c[0], c[1])) - za;
    const double slope_x = (rise_b * (c[1] - a[1]) - rise_c * (b[1] - a[1])) / doubled;
    const double slope_y = (rise_c * (b[0] - a[0]) - rise_b * (c[0] - a[0])) / doubled;
    Worst worst;
    const auto [south, north] = std::minmax({a[1], b[1], c[1]});
    const auto [west, east] = std::minmax({a[0], b[0], c[0]});
    for (int y = south; y <= north; ++y) {
        // left of each edge: (b - a) x (p - a) >= 0, a condition on p's column
        std::int64_t first = west, last = east;
        for (std::size_t k = 0; k < 3; ++k) {
            const Place& from = corners[k];
            const Place& to = corners[(k + 1) % 3];
            const std::int64_t dy = to[1] - from[1];
            const std::int64_t rest = std::int64_t{to[0] - from[0]} * (y - from[1]);
            if (dy > 0) last = std::min(last, from[0] + floor_divide(rest, dy));
            if (dy < 0) first = std::max(first, from[0] - floor_divide(rest, -dy));
        }
        const double row = za + (y - a[1]) * slope_y;
        const float* samples = &table.heights[table.index(0, y)];
        for (std::int64_t x = first; x <= last; ++x) {
            const double plane = row + static_cast<double>(x - a[0]) * slope_x;
            const double error = std::abs(static_cast<double>(samples[x]) - plane);
            if (error > worst.error) worst = {error, {static_cast<int>(x), y}};
        }
    }
    return worst;
}

double measure_error(const HeightTable& table, const TableMesh& mesh) {
    double worst = 0.0;
    std::int64_t doubled = 0;
    for (const auto& triangle : mesh.triangles) {
        const std::array<Place, 3> corners{mesh.vertices[triangle[0]], mesh.vertices[triangle[1]],
                                           mesh.vertices[triangle[2]]};
        const std::int64_t area = cross(corners[0], corners[1], corners[2]);
        if (area <= 0) return std::numeric_limits<double>::infinity();
        doubled += area;
        worst = std::max(worst, find_worst(table, corners).error);
    }
    const std::int64_t whole = std::int64_t{2} * (table.columns - 1) * (table.rows - 1);
    return doubled == whole ? worst : std::numeric_limits<double>::infinity();
}

// Source: L. Velho, D. Gomes. Variable Resolution 4-k Meshes. Computer Graphics Forum 19(4), 2000.
// Deviations: no queue: the closure is the least fixed point of "an active vertex has active
// parents" and "a triangle that errs is split", reached from the roots down.

namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

// Active vertices of the longest-edge bisection of one square.
class Closure {
public:
    Closure(const HeightTable& table, double tolerance)
        : table_(table), last_(table.columns - 1), tolerance_(tolerance) {
        active_.resize(table.heights.size());
        for (int corner : {0, 1}) visit(root(corner));
        while (!stack_.empty()) {
            const Triangle next = stack_.back();
            stack_.pop_back();
            visit(next);
        }
    }

    TableMesh make_mesh() {
        TableMesh mesh;
        std::vector<std::uint32_t> numbers(table_.heights.size(), kNone);
        for (int corner : {0, 1}) emit(root(corner), mesh, numbers);
        return mesh;
    }

private:
    struct Triangle {
        Place apex, left, right;  ///< clockwise: the apex, then along the longest edge
    };

    Triangle root(int corner) const {
        return corner == 0 ? Triangle{{last_, 0}, {0, 0}, {last_, last_}}
                           : Triangle{{0, last_}, {last_, last_}, {0, 0}};
    }
    static Place middle_of(const Triangle& t) {
        return {(t.left[0] + t.right[0]) / 2, (t.left[1] + t.right[1]) / 2};
    }
    static bool is_half_cell(const Triangle& t) {
        return std::abs(t.apex[0] - t.left[0]) + std::abs(t.apex[1] - t.left[1]) == 1;
    }
    bool is_active(const Place& p) const { return active_[table_.index(p[0], p[1])]; }

    void visit(const Triangle& t) {
        if (is_half_cell(t)) return;
        const Place middle = middle_of(t);
        if (!is_active(middle)) {
            waiting_[table_.index(middle[0], middle[1])].push_back(t);
            if (find_worst(table_, {t.apex, t.right, t.left}).error > tolerance_) activate(middle);
            return;
        }
        stack_.push_back({middle, t.apex, t.left});
        stack_.push_back({middle, t.right, t.apex});
    }

    void activate(const Place& p) {
        const auto [x, y] = p;
        if (x < 0 || y < 0 || x > last_ || y > last_ || is_active(p)) return;
        const int s = (x | y) & -(x | y);
        if ((x | y) == 0 || s >= last_) return;  // the root's corners are always there
        const bool odd_x = (x & s) != 0, odd_y = (y & s) != 0;
        if (odd_x && odd_y) {
            const bool to_north_east = cut_to_north_east((x - s) / (2 * s), (y - s) / (2 * s));
            activate({x + s, to_north_east ? y - s : y + s});
            activate({x - s, to_north_east ? y + s : y - s});
        } else if (odd_x) {
            activate({x, y - s});
            activate({x, y + s});
        } else {
            activate({x - s, y});
            activate({x + s, y});
        }
        active_[table_.index(x, y)] = true;
        const auto found = waiting_.find(table_.index(x, y));
        if (found == waiting_.end()) return;
        for (const Triangle& t : found->second) stack_.push_back(t);
        waiting_.erase(found);
    }

    void emit(const Triangle& t, TableMesh& mesh, std::vector<std::uint32_t>& numbers) const {
        const Place middle = middle_of(t);
        if (!is_half_cell(t) && is_active(middle)) {
            emit({middle, t.apex, t.left}, mesh, numbers);
            emit({middle, t.right, t.apex}, mesh, numbers);
            return;
        }
        std::array<std::uint32_t, 3> triangle{};
        std::size_t k = 0;
        for (const Place& corner : {t.apex, t.right, t.left}) {
            std::uint32_t& number = numbers[table_.index(corner[0], corner[1])];
            if (number == kNone) {
                number = static_cast<std::uint32_t>(mesh.vertices.size());
                mesh.vertices.push_back(corner);
            }
            triangle[k++] = number;
        }
        mesh.triangles.push_back(triangle);
    }

    const HeightTable& table_;
    int last_;
    double tolerance_;
    std::vector<bool> active_;
    std::vector<Triangle> stack_;
    std::unordered_map<std::size_t, std::vector<Triangle>> waiting_;  ///< on a vertex that is out
};

}  // namespace

TableMesh make_minimal_closure(const HeightTable& table, double tolerance) {
    TERRANE_ASSERT(table.columns == table.rows, "a square table");
    return Closure(table, tolerance).make_mesh();
}

// Sources:
//   P. Lindstrom, V. Pascucci. Visualization of Large Terrains Made Easy. IEEE Visualization 2001.
//   P. Lindstrom, V. Pascucci. Terrain Simplification Simplified. IEEE TVCG 8(3), 2002.
// Deviations: certified errors of whole diamonds instead of midpoint errors; an index list instead
// of strips, into one vertex buffer that never changes; a budget, met by collecting the priorities
// above a bracket taken from the frame before and picking one of them.

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
