// SPDX-License-Identifier: MIT
#include "lab/crowd.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

namespace terrane::tools {
namespace {

using Cell = std::array<std::uint32_t, 3>;

// Axis-aligned cubic cells, counted from the origin. Positions beyond the room belong to the cells at its border.
struct CellLattice {
    double per_cell = 1.0;   ///< cells a metre
    std::uint32_t last = 0;  ///< last cell along each axis

    std::uint32_t along(double p) const {
        // no floor needed: a coordinate below 0 is in cell 0 anyway, as is NaN
        const double cells = p * per_cell;
        if (!(cells > 0.0)) return 0;
        return static_cast<std::uint32_t>(std::min(cells, static_cast<double>(last)));
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

struct Ball {
    Eigen::Vector3d centre;
    double radius;  ///< metres
};

// Collects pairs of bodies, each once, in ascending order.
class FoundPairs {
public:
    void clear() {
        pairs_.clear();
        candidates_ = 0;
    }
    // Compares two boxes that share a cell. Records the pair only in the cell of their intersection's low corner.
    void compare(std::span<const Aabb> bounds, const CellLattice& lattice, const Cell& cell,
                 std::uint32_t i, std::uint32_t j) {
        ++candidates_;
        const Aabb &a = bounds[i], &b = bounds[j];
        if (!overlap(a, b)) return;
        if (lattice.of(a.low.cwiseMax(b.low)) != cell) return;
        pairs_.push_back({std::min(i, j), std::max(i, j)});
    }
    // Compares the squared distance of two bodies' centres with the square of their radii's sum.
    void compare(const Ball& a, const Ball& b, std::uint32_t i, std::uint32_t j) {
        ++candidates_;
        const double reach = a.radius + b.radius;
        if ((a.centre - b.centre).squaredNorm() > reach * reach) return;
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

class EveryPair final : public Broadphase {
public:
    void update(std::span<const Aabb> bounds) override { bounds_ = bounds; }
    std::span<const BodyPair> find_pairs() override {
        pairs_.clear();
        for (std::uint32_t i = 0; i < bounds_.size(); ++i) {
            for (std::uint32_t j = i + 1; j < bounds_.size(); ++j) {
                if (overlap(bounds_[i], bounds_[j])) pairs_.push_back({i, j});
            }
        }
        return pairs_;
    }
    std::uint64_t candidate_count() const override {
        return bounds_.size() * (bounds_.size() - 1) / 2;
    }
    std::uint64_t update_operations() const override { return 0; }

private:
    std::span<const Aabb> bounds_;
    std::vector<BodyPair> pairs_;
};

/// A dense grid over the cube from the origin to `width` along each axis: a list of bodies for each of 40^3 cells, all
/// cleared in every update. A body is in every cell of its box. Bodies beyond the cube are in its border cells.
class DenseGrid final : public Broadphase {
public:
    explicit DenseGrid(double width)
        : lattice_{static_cast<double>(kDenseCells) / width, kDenseCells - 1},
          lists_(kDenseCells * kDenseCells * kDenseCells) {}

    void update(std::span<const Aabb> bounds) override {
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

/// The hashed grid proposed by the published study. It stores only occupied cells, by a hash of their coordinates: time
/// and memory of an update are linear in the number of bodies. Cells are as wide as the mean distance of bodies, so
/// that a typical body occupies little more than one cell; wider if boxes would occupy more than 64 cells on average.
///
/// Sources:    M. Teschner et al. Optimized spatial hashing for collision detection of deformable objects. 2003
/// Deviations: entries are sorted into buckets by counting, not kept in linked lists; a pair is reported only by the
///             cell of the low corner of the boxes' intersection, not compared with the pairs found so far.
class HashedGrid final : public Broadphase {
public:
    HashedGrid(double width, std::size_t body_count)
        : width_(width), cells_(std::cbrt(static_cast<double>(body_count))) {
        choose_cells(cells_);
    }

    void update(std::span<const Aabb> bounds) override {
        constexpr std::uint64_t kMostCells = 64;  // of a box, on average
        bounds_ = bounds;
        if (first_of_bucket_.empty() || lows_.size() != bounds.size()) {
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

    // Places all boxes in cells. False if they occupy more than `most` cells and cells can be wider.
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
        // primes from the paper
        return (cell[0] * 73856093u ^ cell[1] * 19349663u ^ cell[2] * 83492791u) & bucket_mask_;
    }

    // Counting sort of the entries by bucket.
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
    double cells_;  ///< number of cells along an axis
    CellLattice lattice_;
    std::span<const Aabb> bounds_;
    std::vector<Cell> lows_, highs_;  ///< by body
    std::vector<std::uint32_t> first_of_bucket_;
    std::uint32_t bucket_mask_ = 0;
    std::vector<Entry> entries_;  ///< bucket by bucket
    FoundPairs found_;
};

/// The published dense grid over the same cube. Its cells are as wide as the largest body's diameter, and each body is
/// in one cell, that of its centre: bodies whose spheres meet are in the same cell or in neighbouring ones. All cells
/// are cleared in every update. The bounds are cubes around the bodies' spheres; pairs are those whose spheres meet.
///
/// Deviations: cells are wider if there would be more than 40 and 4 cbrt(bodies) along an axis; a cell's list is linked
///             through its bodies, so that clearing it sets one number.
class CentroidGrid final : public Broadphase {
public:
    explicit CentroidGrid(double width) : width_(width) {}

    void update(std::span<const Aabb> bounds) override {
        place_balls(bounds);
        const std::size_t along = std::size_t{lattice_.last} + 1;
        first_.assign(along * along * along, kNone);
        next_.assign(balls_.size(), kNone);
        for (std::uint32_t i = 0; i < balls_.size(); ++i) {
            if (balls_[i].radius < 0.0) continue;
            std::uint32_t& first = first_[index_of(lattice_.of(balls_[i].centre))];
            next_[i] = first;
            first = i;
        }
    }

    std::span<const BodyPair> find_pairs() override {
        found_.clear();
        for (std::uint32_t i = 0; i < balls_.size(); ++i) {
            if (balls_[i].radius < 0.0) continue;
            Cell low = lattice_.of(balls_[i].centre), high = low;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                if (low[axis] > 0) --low[axis];
                if (high[axis] < lattice_.last) ++high[axis];
            }
            visit_cells(low, high, [&](const Cell& cell) {
                for (std::uint32_t j = first_[index_of(cell)]; j != kNone; j = next_[j]) {
                    if (j > i) found_.compare(balls_[i], balls_[j], i, j);
                }
            });
        }
        return found_.sorted();
    }

    std::uint64_t candidate_count() const override { return found_.candidates(); }
    std::uint64_t update_operations() const override { return first_.size() + balls_.size(); }

private:
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};

    // Sets the balls, with radius -1 for an empty box, and the cells' width.
    void place_balls(std::span<const Aabb> bounds) {
        constexpr double kLargest = 1e150;     // a coordinate: see Broadphase::update()
        constexpr double kWider = 1.0 + 1e-6;  // exceeds the rounding of a cell's index
        double largest = 0.0;                  // radius
        balls_.resize(bounds.size());
        for (std::size_t i = 0; i < bounds.size(); ++i) {
            const auto& [low, high] = bounds[i];
            const bool is_box = (low.array() >= -kLargest).all() &&
                                (low.array() <= high.array()).all() &&
                                (high.array() <= kLargest).all();
            balls_[i] = {0.5 * (low + high), is_box ? 0.5 * (high - low).maxCoeff() : -1.0};
            largest = std::max(largest, balls_[i].radius);
        }
        // cells along an axis, so that memory is linear in the bodies
        const double most =
            std::max(double{kDenseCells}, 4.0 * std::cbrt(static_cast<double>(bounds.size())));
        const double cell = std::max(2.0 * largest * kWider, width_ / most);
        lattice_.per_cell = 1.0 / cell;
        lattice_.last = static_cast<std::uint32_t>(std::max(1.0, std::ceil(width_ / cell))) - 1;
    }
    std::size_t index_of(const Cell& cell) const {
        const std::size_t along = std::size_t{lattice_.last} + 1;
        return (cell[2] * along + cell[1]) * along + cell[0];
    }

    double width_;
    CellLattice lattice_;
    std::vector<Ball> balls_;
    std::vector<std::uint32_t> first_;  ///< [cells] a body of the cell, or kNone
    std::vector<std::uint32_t> next_;   ///< [bodies] the next one in the same cell, or kNone
    FoundPairs found_;
};

}  // namespace

std::string_view to_string(CrowdScheme scheme) {
    constexpr std::array kNames{"sap", "grid", "two-scene", "brute", "hashed", "dense", "centroid"};
    return kNames[static_cast<std::size_t>(scheme)];
}

std::unique_ptr<Broadphase> make_scheme(CrowdScheme scheme, double width, std::size_t body_count) {
    switch (scheme) {
        case CrowdScheme::grid:
            return make_broadphase(BroadphaseKind::grid, 0.0);
        case CrowdScheme::two_scene:
            return make_broadphase(BroadphaseKind::two_scene, 0.0);
        case CrowdScheme::brute:
            return std::make_unique<EveryPair>();
        case CrowdScheme::hashed:
            return std::make_unique<HashedGrid>(width, body_count);
        case CrowdScheme::dense:
            return std::make_unique<DenseGrid>(width);
        case CrowdScheme::centroid:
            return std::make_unique<CentroidGrid>(width);
        case CrowdScheme::sap:
            break;
    }
    return make_broadphase(BroadphaseKind::sap, 0.0);
}

}  // namespace terrane::tools
