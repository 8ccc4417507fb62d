// SPDX-License-Identifier: MIT
//
// Source: M. Garland, P. S. Heckbert. Fast Polygonal Approximation of Terrains and Height Fields.
// CMU-CS-95-181, 1995. (greedy insertion, each triangle keeping its own worst sample)
// Deviations: exact integer predicates; ties go to the older triangle.
#include "reference_meshes.h"

#include <algorithm>
#include <cstddef>
#include <queue>
#include <utility>

namespace terrane::test {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

// A Delaunay triangulation that grows; every triangle knows its worst sample.
class GreedyTin {
public:
    explicit GreedyTin(const HeightTable& table) : table_(table) {
        const int east = table.columns - 1, north = table.rows - 1;
        mesh_.vertices = {{0, 0}, {east, 0}, {east, north}, {0, north}};
        mesh_.triangles = {{0, 1, 2}, {0, 2, 3}};
        beside_ = {{kNone, kNone, 1}, {0, kNone, kNone}};
        worst_.resize(2);
        changed_ = {0, 1};
        look_at_changed();
    }

    void insert_until(double tolerance) {
        while (!queue_.empty()) {
            const Entry top = queue_.top();
            queue_.pop();
            const Worst& worst = worst_[top.triangle];
            if (top.error != worst.error || top.place != worst.place) continue;  // of an old shape
            if (top.error <= tolerance) return;
            insert(top.triangle, worst.place);
            look_at_changed();
        }
    }

    TableMesh take() { return std::move(mesh_); }

private:
    using Three = std::array<std::uint32_t, 3>;
    struct Entry {
        double error;
        std::uint32_t triangle;
        Place place;
        bool operator<(const Entry& other) const {
            return error != other.error ? error < other.error : triangle > other.triangle;
        }
    };

    std::array<Place, 3> corners(std::uint32_t t) const {
        const Three& v = mesh_.triangles[t];
        return {mesh_.vertices[v[0]], mesh_.vertices[v[1]], mesh_.vertices[v[2]]};
    }

    void look_at_changed() {
        std::sort(changed_.begin(), changed_.end());
        changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
        for (const std::uint32_t t : changed_) {
            worst_[t] = find_worst(table_, corners(t));
            if (worst_[t].error > 0.0) queue_.push({worst_[t].error, t, worst_[t].place});
        }
        changed_.clear();
    }

    std::uint32_t add_triangle() {
        mesh_.triangles.push_back({});
        beside_.push_back({kNone, kNone, kNone});
        worst_.push_back({});
        return static_cast<std::uint32_t>(mesh_.triangles.size() - 1);
    }

    /// beside_[t][k] lies across the edge from corner k to corner k + 1.
    void set(std::uint32_t t, const Three& corners, const Three& beside) {
        mesh_.triangles[t] = corners;
        beside_[t] = beside;
        changed_.push_back(t);
    }
    void relink(std::uint32_t t, std::uint32_t from, std::uint32_t to) {
        if (t == kNone) return;
        *std::find(beside_[t].begin(), beside_[t].end(), from) = to;
    }

    void insert(std::uint32_t t, const Place& place) {
        const auto p = static_cast<std::uint32_t>(mesh_.vertices.size());
        mesh_.vertices.push_back(place);
        const std::array<Place, 3> old = corners(t);
        for (std::size_t k = 0; k < 3; ++k) {
            if (cross(old[k], old[(k + 1) % 3], place) == 0) {
                insert_on_edge(t, k, p);
                return;
            }
        }
        const Three v = mesh_.triangles[t], n = beside_[t];
        const std::uint32_t second = add_triangle(), third = add_triangle();
        set(t, {v[0], v[1], p}, {n[0], second, third});
        set(second, {v[1], v[2], p}, {n[1], third, t});
        set(third, {v[2], v[0], p}, {n[2], t, second});
        relink(n[1], t, second);
        relink(n[2], t, third);
        for (const std::uint32_t made : {t, second, third}) legalise(made, p);
    }

    // Edge k of t and its twin become two edges each.
    void insert_on_edge(std::uint32_t t, std::size_t k, std::uint32_t p) {
        const Three v = mesh_.triangles[t], n = beside_[t];
        const std::uint32_t a = v[k], b = v[(k + 1) % 3], c = v[(k + 2) % 3];
        const std::uint32_t beyond_b = n[(k + 1) % 3], beyond_c = n[(k + 2) % 3];
        const std::uint32_t other = n[k];
        const std::uint32_t half = add_triangle();
        if (other == kNone) {
            set(t, {c, a, p}, {beyond_c, kNone, half});
            set(half, {b, c, p}, {beyond_b, t, kNone});
            relink(beyond_b, t, half);
            for (const std::uint32_t made : {t, half}) legalise(made, p);
            return;
        }
        const Three w = mesh_.triangles[other], m = beside_[other];
        const auto j = static_cast<std::size_t>(std::find(m.begin(), m.end(), t) - m.begin());
        const std::uint32_t d = w[(j + 2) % 3];  // other is b, a, d from corner j
        const std::uint32_t beyond_a = m[(j + 1) % 3], beyond_d = m[(j + 2) % 3];
        const std::uint32_t other_half = add_triangle();
        set(t, {c, a, p}, {beyond_c, other, half});
        set(half, {b, c, p}, {beyond_b, t, other_half});
        set(other, {a, d, p}, {beyond_a, other_half, t});
        set(other_half, {d, b, p}, {beyond_d, half, other});
        relink(beyond_b, t, half);
        relink(beyond_d, other, other_half);
        for (const std::uint32_t made : {t, half, other, other_half}) legalise(made, p);
    }

    // Flips the edge across from p while the corner beyond it lies in the triangle's circle.
    void legalise(std::uint32_t t, std::uint32_t p) {
        const Three v = mesh_.triangles[t];
        const auto k = static_cast<std::size_t>(std::find(v.begin(), v.end(), p) - v.begin());
        const std::size_t edge = (k + 1) % 3;
        const std::uint32_t other = beside_[t][edge];
        if (other == kNone) return;
        const Three w = mesh_.triangles[other], m = beside_[other];
        const auto j = static_cast<std::size_t>(std::find(m.begin(), m.end(), t) - m.begin());
        const std::uint32_t a = v[edge], b = v[(edge + 1) % 3], d = w[(j + 2) % 3];
        if (!in_circle(p, a, b, d)) return;
        const Three n = beside_[t];
        const std::uint32_t beyond_pa = n[k], beyond_bp = n[(k + 2) % 3];
        const std::uint32_t beyond_ad = m[(j + 1) % 3], beyond_db = m[(j + 2) % 3];
        set(t, {p, a, d}, {beyond_pa, beyond_ad, other});
        set(other, {p, d, b}, {t, beyond_db, beyond_bp});
        relink(beyond_ad, other, t);
        relink(beyond_bp, t, other);
        legalise(t, p);
        legalise(other, p);
    }

    bool in_circle(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) const {
        const Place& o = mesh_.vertices[d];
        const auto seen = [&](std::uint32_t i) {
            const Place& q = mesh_.vertices[i];
            return std::array<std::int64_t, 2>{q[0] - o[0], q[1] - o[1]};
        };
        const auto p = seen(a), q = seen(b), r = seen(c);
        const auto square = [](const auto& u) { return u[0] * u[0] + u[1] * u[1]; };
        const auto wedge = [](const auto& u, const auto& w) { return u[0] * w[1] - u[1] * w[0]; };
        return square(p) * wedge(q, r) + square(q) * wedge(r, p) + square(r) * wedge(p, q) > 0;
    }

    const HeightTable& table_;
    TableMesh mesh_;
    std::vector<Three> beside_;
    std::vector<Worst> worst_;
    std::vector<std::uint32_t> changed_;
    std::priority_queue<Entry> queue_;
};

}  // namespace

TableMesh make_greedy_tin(const HeightTable& table, double tolerance) {
    GreedyTin tin(table);
    tin.insert_until(tolerance);
    return tin.take();
}

}  // namespace terrane::test
