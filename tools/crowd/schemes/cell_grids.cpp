// SPDX-License-Identifier: MIT
#include "crowd/schemes/cell_grids.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

namespace terrane::tools {
namespace {

using Cell = std::array<std::uint32_t, 3>;

// Cubic cells along the axes, counted from the origin; coordinates beyond the room belong to its border cells.
struct CellLattice {
    double per_cell = 1.0;   ///< cells a metre
    std::uint32_t last = 0;  ///< along each axis

    std::uint32_t along(double p) const {
        // Not a floor: a coordinate below 0 is in cell 0 anyway.
        const double cells = p * per_cell;
        return static_cast<std::uint32_t>(std::clamp(cells, 0.0, static_cast<double>(last)));
    }
    Cell of(const Eigen::Vector3d& p) const { return {along(p.x()), along(p.y()), along(p.z())}; }
};

template <class Visit>
void visit_cells(const Cell& low, const Cell& high, Visit&& visit) {
    for (std::uint32_t z = low[2]; z <= high[2]; ++z) {
        for (std::uint32_t y = low[1]; y <= high[1]; ++y) {
            for (std::uint32_t x = low[0]; x <= high[0]; ++x) visit(Cell{x, y, z});
        }
    }
}

// Pairs in ascending order, each found once.
class FoundPairs {
public:
    void clear() {
        pairs_.clear();
        candidates_ = 0;
    }
    // Takes a pair of boxes that share a cell if that is the cell of the intersection's low corner.
    void compare(std::span<const Aabb> bounds, const CellLattice& lattice, const Cell& cell,
                 std::uint32_t i, std::uint32_t j) {
        ++candidates_;
        const Aabb &a = bounds[i], &b = bounds[j];
        if (!overlap(a, b)) return;
        if (lattice.of(a.low.cwiseMax(b.low)) != cell) return;
        pairs_.push_back({std::min(i, j), std::max(i, j)});
    }
    std::span<const BodyPair> sorted() {
        std::sort(pairs_.begin(), pairs_.end(), [](const BodyPair& p, const BodyPair& q) {
            return p.a != q.a ? p.a < q.a : p.b < q.b;
        });
        return pairs_;
    }
    std::uint64_t candidates() const { return candidates_; }

private:
    std::vector<BodyPair> pairs_;
    std::uint64_t candidates_ = 0;
};

class DenseGrid final : public Broadphase {
public:
    explicit DenseGrid(double width)
        : lattice_{static_cast<double>(kDenseCells) / width, kDenseCells - 1},
          lists_(kDenseCells * kDenseCells * kDenseCells) {}

    void update(std::span<const Aabb> bounds, std::span<const BoundingSphere>) override {
        bounds_ = bounds;
        operations_ = lists_.size();
        for (std::vector<std::uint32_t>& list : lists_) list.clear();
        for (std::uint32_t i = 0; i < bounds.size(); ++i) {
            visit_cells(lattice_.of(bounds[i].low), lattice_.of(bounds[i].high), [&](Cell cell) {
                lists_[index_of(cell)].push_back(i);
                ++operations_;
            });
        }
    }

    std::span<const BodyPair> find_pairs() override {
        found_.clear();
        for (std::uint32_t i = 0; i < bounds_.size(); ++i) {
            const Cell low = lattice_.of(bounds_[i].low), high = lattice_.of(bounds_[i].high);
            visit_cells(low, high, [&](Cell cell) {
                for (const std::uint32_t j : lists_[index_of(cell)]) {
                    if (j > i) found_.compare(bounds_, lattice_, cell, i, j);
                }
            });
        }
        return found_.sorted();
    }

    std::uint64_t candidate_count() const override { return found_.candidates(); }
    std::uint64_t update_operations() const override { return operations_; }

private:
    static std::size_t index_of(const Cell& cell) {
        return (std::size_t{cell[2]} * kDenseCells + cell[1]) * kDenseCells + cell[0];
    }

    CellLattice lattice_;
    std::span<const Aabb> bounds_;
    std::vector<std::vector<std::uint32_t>> lists_;
    FoundPairs found_;
    std::uint64_t operations_ = 0;
};

class HashedGrid final : public Broadphase {
public:
    HashedGrid(double width, std::size_t body_count)
        : width_(width), cells_(std::cbrt(static_cast<double>(body_count))) {
        choose_cells(cells_);
    }

    void update(std::span<const Aabb> bounds, std::span<const BoundingSphere>) override {
        constexpr std::uint64_t kMostCells = 64;  // of a box, on average
        bounds_ = bounds;
        if (lows_.size() != bounds.size()) {
            lows_.resize(bounds.size());
            highs_.resize(bounds.size());
            const std::size_t buckets = std::bit_ceil(2 * bounds.size() + 1);
            first_of_bucket_.resize(buckets + 1);
            bucket_mask_ = static_cast<std::uint32_t>(buckets - 1);
        }
        while (!place_boxes(kMostCells * bounds.size())) choose_cells(cells_ / 2.0);
        count_and_fill();
    }

    std::span<const BodyPair> find_pairs() override {
        found_.clear();
        for (std::size_t bucket = 0; bucket <= bucket_mask_; ++bucket) {
            const std::uint32_t first = first_of_bucket_[bucket];
            const std::uint32_t last = first_of_bucket_[bucket + 1];
            for (std::uint32_t i = first; i < last; ++i) {
                for (std::uint32_t j = i + 1; j < last; ++j) {
                    const Entry &a = entries_[i], &b = entries_[j];
                    if (a.cell == b.cell) found_.compare(bounds_, lattice_, a.cell, a.body, b.body);
                }
            }
        }
        return found_.sorted();
    }

    std::uint64_t candidate_count() const override { return found_.candidates(); }
    std::uint64_t update_operations() const override {
        return bounds_.size() + entries_.size() + first_of_bucket_.size();
    }

private:
    struct Entry {
        Cell cell;
        std::uint32_t body;
    };

    void choose_cells(double along_axis) {
        constexpr double kMost = 1 << 20;
        cells_ = std::clamp(along_axis, 1.0, kMost);
        lattice_.per_cell = cells_ / width_;
        lattice_.last = static_cast<std::uint32_t>(cells_);
    }

    // False where the boxes lie in more cells than that and cells can be wider.
    bool place_boxes(std::uint64_t most) {
        std::uint64_t count = 0;
        for (std::size_t i = 0; i < bounds_.size(); ++i) {
            const Cell low = lattice_.of(bounds_[i].low), high = lattice_.of(bounds_[i].high);
            lows_[i] = low;
            highs_[i] = high;
            std::uint64_t cells = 1;
            for (std::size_t axis = 0; axis < 3; ++axis) cells *= high[axis] - low[axis] + 1;
            count += cells;
            if (count > most && cells_ > 1.0) return false;
        }
        entries_.resize(count);
        return true;
    }

    std::uint32_t bucket_of(const Cell& cell) const {
        // Primes of the paper.
        return (cell[0] * 73856093u ^ cell[1] * 19349663u ^ cell[2] * 83492791u) & bucket_mask_;
    }

    // Sorts the entries by bucket, by counting.
    void count_and_fill() {
        std::fill(first_of_bucket_.begin(), first_of_bucket_.end(), 0u);
        for (std::size_t i = 0; i < bounds_.size(); ++i) {
            visit_cells(lows_[i], highs_[i],
                        [&](const Cell& cell) { ++first_of_bucket_[bucket_of(cell)]; });
        }
        std::uint32_t end = 0;
        for (std::uint32_t& first : first_of_bucket_) {
            end += first;
            first = end;
        }
        for (std::size_t i = bounds_.size(); i-- > 0;) {
            visit_cells(lows_[i], highs_[i], [&](const Cell& cell) {
                entries_[--first_of_bucket_[bucket_of(cell)]] = {cell,
                                                                 static_cast<std::uint32_t>(i)};
            });
        }
    }

    double width_;
    double cells_;  ///< along an axis
    CellLattice lattice_;
    std::span<const Aabb> bounds_;
    std::vector<Cell> lows_, highs_;  ///< by body
    std::vector<std::uint32_t> first_of_bucket_;
    std::uint32_t bucket_mask_ = 0;
    std::vector<Entry> entries_;  ///< bucket by bucket
    FoundPairs found_;
};

}  // namespace

std::unique_ptr<Broadphase> make_dense_grid(double width) {
    return std::make_unique<DenseGrid>(width);
}

std::unique_ptr<Broadphase> make_hashed_grid(double width, std::size_t body_count) {
    return std::make_unique<HashedGrid>(width, body_count);
}

}  // namespace terrane::tools
