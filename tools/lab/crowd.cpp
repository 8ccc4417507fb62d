// SPDX-License-Identifier: MIT
#include "lab/crowd.h"

#include "program/geometry.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/shape_pairs.h>
#include <terrane/collision/shapes.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

using Cell = std::array<std::uint32_t, 3>;

// Axis-aligned cubic cells, counted from the origin. Positions beyond the room belong to the cells at its border.
struct CellLattice {
    double per_cell = 1.0;   ///< cells a metre
    std::uint32_t last = 0;  ///< last cell along each axis

    std::uint32_t along(double p) const {
        // no floor needed: a coordinate below 0 is in cell 0 anyway
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

/// The published dense grid over the cube from the origin to `width` along each axis: a list of bodies for each of 40^3
/// cells, all cleared in every update. Bodies beyond the cube are in its border cells.
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

/// A sphere-like closed mesh: two poles, and rings of corners between them at equal angles.
struct BallMesh {
    int rings = 3;        ///< 2 or more; a ring has 2 * rings corners
    double radius = 1.0;  ///< of the sphere through the corners, metres
    double aspect = 1.0;  ///< >= 1: factor by which the mesh is narrower across its poles' axis
    bool is_dented =
        false;  ///< every second segment between two meridians has 0.7 of the radius, so that the mesh is not convex
};

/// Number of corners of a mesh.
constexpr std::size_t corners_of(const BallMesh& mesh) {
    return 2 * static_cast<std::size_t>(mesh.rings) * static_cast<std::size_t>(mesh.rings) + 2;
}

// Corners on one meridian, from pole to pole, excluding the poles.
std::vector<Eigen::Vector3d> meridian(const BallMesh& mesh, int number, double scale) {
    // Motion::at() is bit-identical on every machine; sin() and cos() are not
    Motion tilt, turn;
    tilt.rotation_vector = Eigen::Vector3d(0.0, std::numbers::pi, 0.0);
    turn.rotation_vector = Eigen::Vector3d(0.0, 0.0, 2.0 * std::numbers::pi);
    const Pose around = turn.at(static_cast<double>(number) / (2 * mesh.rings));
    std::vector<Eigen::Vector3d> corners;
    for (int ring = 1; ring <= mesh.rings; ++ring) {
        const Pose down = tilt.at(static_cast<double>(ring) / (mesh.rings + 1));
        Eigen::Vector3d corner = mesh.radius * (around.rotation * down.rotation.col(2));
        corner.x() *= scale / mesh.aspect;
        corner.y() *= scale / mesh.aspect;
        corners.push_back(corner);
    }
    return corners;
}

// The mesh as a shape around its centre: a hull, or, if dented, a compound of one hull per segment.
Shape make_ball(const BallMesh& mesh) {
    constexpr double kDent = 0.7;
    const int meridians = 2 * mesh.rings;
    const Eigen::Vector3d pole(0.0, 0.0, mesh.radius);
    std::vector<Eigen::Vector3d> points{pole, -pole};
    if (!mesh.is_dented) {
        for (int number = 0; number < meridians; ++number) {
            const std::vector<Eigen::Vector3d> corners = meridian(mesh, number, 1.0);
            points.insert(points.end(), corners.begin(), corners.end());
        }
        return ConvexHull::create(points).value();
    }
    std::vector<CompoundPart> parts;
    for (int number = 0; number < meridians; ++number) {
        points.resize(2);
        const double scale = number % 2 == 0 ? 1.0 : kDent;
        for (const int side : {number, number + 1}) {
            const std::vector<Eigen::Vector3d> corners = meridian(mesh, side % meridians, scale);
            points.insert(points.end(), corners.begin(), corners.end());
        }
        parts.push_back({ConvexHull::create(points).value(), Pose{}});
    }
    return Compound::create(parts).value();
}

constexpr int kFewestRings = 2;  // with fewer, all corners lie in a plane
constexpr int kMostRings = 200;
constexpr int kSizes = 100;  // number of different sizes: small, so that bodies share meshes

// The radius of a size. The radii are in geometric progression, and the layout's radius is their geometric mean.
double radius_of(const CrowdLayout& layout, int size) {
    if (layout.size_spread == 1.0) return layout.radius;
    const double share = static_cast<double>(size) / (kSizes - 1);
    return layout.radius * std::pow(layout.size_spread, share - 0.5);
}

// Draws size indices; small ones are more frequent if the layout has a size power.
class SizeDraw {
public:
    explicit SizeDraw(const CrowdLayout& layout) : is_spread_(layout.size_spread != 1.0) {
        double sum = 0.0;
        for (int size = 0; size < kSizes; ++size) {
            sum += std::pow(radius_of(layout, size) / layout.radius, -layout.size_power);
            sums_[static_cast<std::size_t>(size)] = sum;
        }
    }
    // returns size 0 if all sizes are equal
    int draw(BodyRandom& random) const {
        if (!is_spread_) return 0;
        const auto found =
            std::upper_bound(sums_.begin(), sums_.end(), random.unit() * sums_.back());
        return std::min(static_cast<int>(found - sums_.begin()), kSizes - 1);
    }

private:
    bool is_spread_;
    std::array<double, kSizes> sums_{};  ///< cumulative shares of the sizes
};

// Draws a number of rings, uniform with the layout's mean and deviation.
int draw_rings(const CrowdLayout& layout, BodyRandom& random) {
    const double half_width = std::sqrt(3.0) * layout.detail_deviation;
    const double detail = layout.detail + half_width * random.within(-1.0, 1.0);
    return static_cast<int>(
        std::lround(std::clamp(detail, double{kFewestRings}, double{kMostRings})));
}

std::unique_ptr<Broadphase> make_scheme(const CrowdLayout& layout, double width) {
    switch (layout.scheme) {
        case CrowdScheme::grid:
            return make_broadphase(BroadphaseKind::grid, 0.0);
        case CrowdScheme::brute:
            return std::make_unique<EveryPair>();
        case CrowdScheme::hashed:
            return std::make_unique<HashedGrid>(width, layout.count);
        case CrowdScheme::dense:
            return std::make_unique<DenseGrid>(width);
        case CrowdScheme::sap:
        case CrowdScheme::two_scene:
            break;
    }
    return make_broadphase(BroadphaseKind::sap, 0.0);
}

Aabb box_of(const Shape& shape, const Pose& pose) {
    Aabb box;
    for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d along = pose.rotation.row(axis);
        box.low[axis] = pose.translation[axis] - support_distance(shape, -along);
        box.high[axis] = pose.translation[axis] + support_distance(shape, along);
    }
    return box;
}

}  // namespace

std::string_view to_string(CrowdScheme scheme) {
    constexpr std::array kNames{"sap", "grid", "two-scene", "brute", "hashed", "dense"};
    return kNames[static_cast<std::size_t>(scheme)];
}

Crowd::Crowd(const CrowdLayout& layout) : is_two_scene_(layout.scheme == CrowdScheme::two_scene) {
    place_bodies(layout);
    broadphase_ = make_scheme(layout, width_);
    bounds_.resize(layout.count);
    if (is_two_scene_) {
        exact_.resize(layout.count);
        exact_in_query_.resize(layout.count);
    }
}

void Crowd::place_bodies(const CrowdLayout& layout) {
    const SizeDraw sizes(layout);
    double cubes = 0.0, largest = 0.0;
    for (std::size_t i = 0; i < layout.count; ++i) {
        BodyRandom random(layout.seed, i);
        const double radius = radius_of(layout, sizes.draw(random));
        cubes += radius * radius * radius;
        largest = std::max(largest, radius);
    }
    const double volume = 4.0 / 3.0 * std::numbers::pi * cubes;
    width_ =
        std::max(layout.room > 0.0 ? layout.room : std::cbrt(volume / layout.share), 2.0 * largest);
    // Bodies of the same mesh share one shape.
    std::map<std::pair<int, int>, Shape> shapes;
    for (std::size_t i = 0; i < layout.count; ++i) {
        BodyRandom random(layout.seed, i);
        const int size = sizes.draw(random);
        const double radius = radius_of(layout, size);
        const BallMesh mesh{.rings = draw_rings(layout, random),
                            .radius = radius,
                            .aspect = layout.aspect,
                            .is_dented = layout.is_dented};
        const std::pair key(size, mesh.rings);
        auto shape = shapes.find(key);
        if (shape == shapes.end()) shape = shapes.emplace(key, make_ball(mesh)).first;
        corner_count_ += corners_of(mesh);
        Pose pose;
        pose.rotation = random.rotation();
        for (int axis = 0; axis < 3; ++axis) {
            pose.translation[axis] = random.within(radius, width_ - radius);
        }
        const Eigen::Vector3d velocity = layout.speed * random.direction();
        bodies_.push_back(
            {shape->second, radius, pose, velocity, layout.spin * random.direction()});
    }
}

void Crowd::move(double dt) {
    for (Body& body : bodies_) {
        Motion motion;
        motion.start = body.pose;
        motion.translation = dt * body.velocity;
        motion.rotation_vector = dt * body.angular_velocity;
        body.pose = motion.at(1.0);
        for (int axis = 0; axis < 3; ++axis) {
            double& p = body.pose.translation[axis];
            const bool is_low = p < body.radius;
            if (!is_low && p <= width_ - body.radius) continue;
            p = std::clamp(p, body.radius, width_ - body.radius);
            body.velocity[axis] =
                is_low ? std::abs(body.velocity[axis]) : -std::abs(body.velocity[axis]);
        }
    }
}

void Crowd::place_bounds() {
    // margin around the sphere, larger than the rounding error of a box
    constexpr double kRoundingMargin = 1e-11;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        const Body& body = bodies_[i];
        if (!is_two_scene_) {
            bounds_[i] = box_of(body.shape, body.pose);
            continue;
        }
        const double half = body.radius + kRoundingMargin * (body.radius + 3.0 * width_);
        const Eigen::Vector3d around = Eigen::Vector3d::Constant(half);
        bounds_[i] = {body.pose.translation - around, body.pose.translation + around};
    }
}

const Aabb& Crowd::exact_box(std::uint32_t body, CrowdTotals& query) {
    if (exact_in_query_[body] != query_count_) {
        exact_[body] = box_of(bodies_[body].shape, bodies_[body].pose);
        exact_in_query_[body] = query_count_;
        ++query.boxes;
    }
    return exact_[body];
}

CrowdTotals Crowd::query() {
    CrowdTotals query{.queries = 1};
    ++query_count_;
    const Stopwatch placing(Clock::wall);
    place_bounds();
    query.boxes = is_two_scene_ ? 0 : bodies_.size();
    query.boxes_ms = placing.ms();
    const Stopwatch updating(Clock::wall);
    broadphase_->update(bounds_);
    query.update_ms = updating.ms();
    const Stopwatch querying(Clock::wall);
    for (const BodyPair& pair : broadphase_->find_pairs()) {
        if (is_two_scene_ && !overlap(exact_box(pair.a, query), exact_box(pair.b, query))) continue;
        ++query.pairs;
        const Body& a = bodies_[pair.a];
        const Body& b = bodies_[pair.b];
        query.touching += test_contact(a.shape, a.pose, b.shape, b.pose).is_touching ? 1u : 0u;
    }
    query.query_ms = querying.ms();
    query.candidates = broadphase_->candidate_count();
    if (query.touching == 0) return query;
    query.positive_queries = 1;
    query.positive_ms = query.query_ms;
    return query;
}

void CrowdTotals::add(const CrowdTotals& other) {
    queries += other.queries;
    positive_queries += other.positive_queries;
    query_ms += other.query_ms;
    positive_ms += other.positive_ms;
    boxes_ms += other.boxes_ms;
    update_ms += other.update_ms;
    boxes += other.boxes;
    pairs += other.pairs;
    touching += other.touching;
    candidates += other.candidates;
}

CrowdTotals run_crowd(Crowd& crowd, double dt,
                      const std::function<bool(const CrowdTotals&)>& goes_on) {
    CrowdTotals totals;
    do {
        totals.add(crowd.query());
        crowd.move(dt);
    } while (goes_on(totals));
    return totals;
}

}  // namespace terrane::tools
