// SPDX-License-Identifier: MIT
//
// Source: L. Velho, D. Gomes. Variable Resolution 4-k Meshes. Computer Graphics Forum 19(4), 2000.
// Deviations: no queue: the closure is the least fixed point of "an active vertex has active
// parents" and "a triangle that errs is split", reached from the roots down.
#include "reference_meshes.h"
#include "reference_scan.h"

#include <terrane/base/result.h>

#include <algorithm>
#include <cstddef>
#include <unordered_map>

namespace terrane::test {
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

}  // namespace terrane::test
