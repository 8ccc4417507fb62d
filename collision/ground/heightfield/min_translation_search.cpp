// SPDX-License-Identifier: MIT
#include "base/vector_math.h"
#include "ground/column/ground_lift.h"
#include "ground/heightfield/min_translation.h"
#include "pairs/convex_core.h"

#include <algorithm>
#include <array>

// Bounds of the lift of a body over a triangle of sideways offsets, from single columns. A column and a part are both
// convex: as a function of the offset, the lift of the part over the column is concave where they overlap in plan.
namespace terrane::internal {

/// A sideways translation, metres.
struct Offset {
    double x, y;
};

/// A triangle of offsets, counter-clockwise.
using OffsetTriangle = std::array<Offset, 3>;

/// A column of the ground and a part of a body.
struct ColumnName {
    std::int64_t column, row;
    std::uint32_t part;
    std::size_t index;  ///< in LocalGround::triangles()

    bool operator==(const ColumnName&) const = default;
};

/// The column and the part that attain a lift, which must be finite.
ColumnName name_of(const LocalGround& local, const GroundLift& lift);

/// A column as an obstacle of a part of a body. Cannot be copied or moved, because the part may point into it.
class Obstacle {
public:
    Obstacle(const LocalGround& local, const LocalBody& body, const ColumnName& name);
    Obstacle(const Obstacle&) = delete;
    Obstacle& operator=(const Obstacle&) = delete;

    /// Whether the column is ground; required by lift_at().
    bool is_ground() const { return is_ground_; }
    /// Lift of the part at an offset, metres; minus infinity if part and column do not overlap in plan.
    double lift_at(const Offset& at) const {
        LocalShape moved = shape_;
        moved.centre[0] += at.x;
        moved.centre[1] += at.y;
        return compute_column_lift(moved, triangle_);
    }

private:
    bool is_ground_ = false;
    Triangle triangle_;
    LocalHull hull_;
    LocalShape shape_;
};

/// The half-space of translations with an offset to the left of the line from a to b. False if a and b coincide.
bool make_side(const Offset& a, const Offset& b, HalfSpace& side_out);

/// The half-space on or above the plane that has height heights[i] at corner i of a triangle of offsets. If the heights
/// are finite lifts of the part over one column, the half-space contains every translation that has its offset in the
/// triangle and separates the part from the column, because the lift is concave. False if the triangle has no area or
/// the plane is too steep to represent.
bool make_top(const OffsetTriangle& triangle, const std::array<double, 3>& heights,
              HalfSpace& top_out);

/// The half-space that excludes the corners of a triangle of offsets at which the lift over a column is `high` or more.
/// It contains every translation that has its offset in the triangle, rises by at most `high` and separates the part
/// from the column. False if it would exclude no corner or all corners.
bool make_rim(const Obstacle& obstacle, const OffsetTriangle& triangle,
              const std::array<double, 3>& lifts, double high, HalfSpace& rim_out);

/// Of the tops (see make_top()) of the columns around a given one, finds the one that is highest above a point p. Only
/// columns that the body overlaps in plan at all corners of the triangle have a top. False if no top is above p. Needed
/// if the given column ends inside the triangle, at a neighbour's wall.
bool make_top_of_neighbour(const LocalGround& local, const LocalBody& body, const ColumnName& name,
                           const OffsetTriangle& triangle, const Eigen::Vector3d& p,
                           HalfSpace& top_out);

/// Lower bound of the z of every separating translation that has its offset in a triangle, from the lowest ground below
/// `lowest` at these offsets; 0 if there is no bound.
///
/// @param lowest a point of the body
double find_range_top(const LocalGround& local, const Eigen::Vector3d& lowest,
                      const OffsetTriangle& triangle);

// Sources: R. Horst, H. Tuy. Global optimization. 1996 (over a simplex, a concave function is nowhere below the plane
//          through its values at the corners; its superlevel sets are convex).

ColumnName name_of(const LocalGround& local, const GroundLift& lift) {
    const std::array<Eigen::Vector3d, 3>& v = lift.triangle.v;
    const auto [column, row] = local.cell_of(lift.triangle);
    if (!local.is_whole(column, row)) {
        const CellTriangles all = local.triangles(local.cell(column, row), column, row);
        std::size_t index = 0;
        while (index + 1 < all.count && all[index].v != v) ++index;
        return {column, row, lift.part, index};
    }
    const double south = std::min({v[0][1], v[1][1], v[2][1]});
    // Two corners of the first triangle of a cell are on its southern side.
    int at_south = 0;
    for (const Eigen::Vector3d& p : v) at_south += p[1] == south ? 1 : 0;
    return {column, row, lift.part, at_south == 2 ? std::size_t{0} : std::size_t{1}};
}

Obstacle::Obstacle(const LocalGround& local, const LocalBody& body, const ColumnName& name) {
    const GroundCell cell = local.cell(name.column, name.row);
    if (cell.status != QueryStatus::ok) return;
    const CellTriangles all = local.triangles(cell, name.column, name.row);
    is_ground_ = name.index < all.count;
    if (!is_ground_) return;
    triangle_ = all[name.index];
    shape_ = body.part(name.part, hull_);
}

bool make_side(const Offset& a, const Offset& b, HalfSpace& side_out) {
    const double x = b.x - a.x, y = b.y - a.y;
    const double size = std::sqrt(x * x + y * y);
    if (!(size > 0.0)) return false;
    side_out.normal = {-y / size, x / size, 0.0};
    side_out.depth = side_out.normal[0] * a.x + side_out.normal[1] * a.y;
    return true;
}

bool make_top(const OffsetTriangle& triangle, const std::array<double, 3>& heights,
              HalfSpace& top_out) {
    const double x1 = triangle[1].x - triangle[0].x, y1 = triangle[1].y - triangle[0].y;
    const double x2 = triangle[2].x - triangle[0].x, y2 = triangle[2].y - triangle[0].y;
    const double area = x1 * y2 - x2 * y1;
    if (!(area > 0.0)) return false;
    const double z1 = heights[1] - heights[0], z2 = heights[2] - heights[0];
    const double slope_x = (z1 * y2 - z2 * y1) / area;
    const double slope_y = (z2 * x1 - z1 * x2) / area;
    const double size = std::sqrt(1.0 + slope_x * slope_x + slope_y * slope_y);
    if (!std::isfinite(size)) return false;
    top_out.normal = Eigen::Vector3d(-slope_x, -slope_y, 1.0) / size;
    top_out.depth = (heights[0] - slope_x * triangle[0].x - slope_y * triangle[0].y) / size;
    return true;
}

bool make_rim(const Obstacle& obstacle, const OffsetTriangle& triangle,
              const std::array<double, 3>& lifts, double high, HalfSpace& rim_out) {
    constexpr int kSteps = 10;  // bisections: a resolution of a thousandth of a side
    std::size_t in_count = 0;
    for (const double lift : lifts) in_count += lift >= high ? 1 : 0;
    if (in_count == 0 || in_count == 3) return false;
    // The corner that differs from the other two.
    const bool is_in = in_count == 1;
    std::size_t lone = 0;
    while ((lifts[lone] >= high) != is_in) ++lone;
    const Offset& a = triangle[lone];
    const auto find_rim = [&](const Offset& b) {
        double low = 0.0, above = 1.0;  // fractions of the side, from its high corner
        const Offset& from = is_in ? a : b;
        const Offset& to = is_in ? b : a;
        const auto at = [&](double s) {
            return Offset{from.x + s * (to.x - from.x), from.y + s * (to.y - from.y)};
        };
        for (int i = 0; i < kSteps; ++i) {
            const double s = 0.5 * (low + above);
            (obstacle.lift_at(at(s)) >= high ? low : above) = s;
        }
        return at(low);
    };
    // Counter-clockwise around the lone corner.
    const Offset next = find_rim(triangle[(lone + 1) % 3]);
    const Offset last = find_rim(triangle[(lone + 2) % 3]);
    return is_in ? make_side(last, next, rim_out) : make_side(next, last, rim_out);
}

bool make_top_of_neighbour(const LocalGround& local, const LocalBody& body, const ColumnName& name,
                           const OffsetTriangle& triangle, const Eigen::Vector3d& p,
                           HalfSpace& top_out) {
    double most = kTouch;  // largest height of a top above p
    bool is_found = false;
    const auto visit = [&](const ColumnName& beside, const Obstacle& obstacle) {
        if (beside == name) return;
        std::array<double, 3> lifts;
        for (std::size_t i = 0; i < 3; ++i) {
            lifts[i] = obstacle.lift_at(triangle[i]);
            if (!std::isfinite(lifts[i])) return;
        }
        HalfSpace top;
        if (!make_top(triangle, lifts, top)) return;
        const double below = top.depth - dot(top.normal, p);
        if (!(below > most)) return;
        most = below;
        top_out = top;
        is_found = true;
    };
    for (int k = 0; k < 9; ++k) {
        ColumnName beside{name.column + k % 3 - 1, name.row + k / 3 - 1, name.part, 0};
        for (;; ++beside.index) {
            const Obstacle obstacle(local, body, beside);
            if (!obstacle.is_ground()) break;
            visit(beside, obstacle);
        }
    }
    return is_found;
}

double find_range_top(const LocalGround& local, const Eigen::Vector3d& lowest,
                      const OffsetTriangle& triangle) {
    constexpr std::int64_t kMost = 1024;  // cells along a side
    const auto [west, east] = std::minmax({triangle[0].x, triangle[1].x, triangle[2].x});
    const auto [south, north] = std::minmax({triangle[0].y, triangle[1].y, triangle[2].y});
    // If there are few cells, single columns give better bounds.
    if (east - west < 2.0 * local.spacing() && north - south < 2.0 * local.spacing()) return 0.0;
    const CellRange cells =
        local.cells(lowest[0] + west, lowest[1] + south, lowest[0] + east, lowest[1] + north);
    if (cells.east < cells.west || cells.north < cells.south || cells.east - cells.west >= kMost ||
        cells.north - cells.south >= kMost) {
        return 0.0;
    }
    const RangeAnswer range = local.ground().range(cells);
    if (range.status != QueryStatus::ok || !local.is_all_ground(cells)) return 0.0;
    return std::max(0.0, local.z(range.low) - lowest[2]);
}

// Sources: A. Land, A. Doig. An automatic method of solving discrete programming problems. Econometrica 1960
//          (branch and bound).
//
// A body moved by a sideways offset (x, y) is separated if it is also raised by its lift L(x, y) there, or if L <= 0.
// The minimum translation is therefore the point of {z >= L(x, y)} nearest to 0. L is the maximum of the lifts over
// single columns, each of which is concave. The translations over a triangle of offsets are bounded by half-spaces
// (above). Triangles are bisected, smallest bound first, until no bound is below the length of the best translation. A
// bound is exact if the lifts are linear over its triangle; otherwise its error falls with the square of the triangle's
// size.

namespace {

class MinTranslationSearch {
public:
    MinTranslationSearch(const LocalGround& local, const LocalBody& body,
                         const MinTranslation& known, const SearchLimits& limits)
        : local_(local),
          body_(body),
          best_(known.d),
          size_(length(known.d)),
          known_bound_(known.lower_bound),
          limits_(limits),
          last_cell_(local.cells_tested() + limits.most_cells) {}

    MinTranslation run() {
        if (size_ < local_.spacing()) {
            // A shape smaller than a cell overlaps few columns: enumerating their facets often proves the minimum.
            HalfSpaces none;
            int visits = 0;
            const double proved = bound_by_facets(none, Eigen::Vector3d::Zero(), visits);
            known_bound_ = std::max(known_bound_, proved * (1.0 - 1e-12));
            if (cannot_improve(known_bound_)) return {best_, std::min(known_bound_, size_)};
        }
        const std::uint16_t centre = add_point({0.0, 0.0});
        if (!std::isfinite(points_[centre].lift)) return {best_, known_bound_};
        LocalHull hull;
        lowest_ =
            body_.part(points_[centre].column.part, hull).deepest_point(Eigen::Vector3d::UnitZ());
        // A square that contains all offsets shorter than the best translation.
        const double r = size_ * (1.0 + 1e-9);
        const std::array<std::uint16_t, 4> corners = {add_point({-r, -r}), add_point({r, -r}),
                                                      add_point({r, r}), add_point({-r, r})};
        for (std::size_t i = 0; i < 4; ++i) {
            visit_node({0.0, {centre, corners[i], corners[(i + 1) % 4]}});
        }
        for (int splits = 0; splits < limits_.most_splits && !is_done(); ++splits) {
            std::pop_heap(nodes_.begin(), nodes_.begin() + node_count_, is_after);
            split(nodes_[static_cast<std::size_t>(--node_count_)]);
        }
        // Slightly less, to cover the rounding of bounds.
        const double proved = lower_bound() * (1.0 - 1e-12) - 1e-12;
        return {best_, std::clamp(proved, std::min(known_bound_, size_), size_)};
    }

private:
    static constexpr std::size_t kMost = SearchLimits::kMostSplits + 5;  // points, and nodes
    static constexpr std::size_t kMostColumns = 12;  // columns that bound a triangle of offsets
    static constexpr double kSteep = 0.1;            // z of a normal
    static constexpr double kNear = 0.95;            // of the best length: tightens larger bounds
    static constexpr int kMostVisits = 32;           // of bound_by_facets()
    static constexpr std::size_t kMostFacets = 12;   // exits of the body from a column

    struct Point {
        Offset at;
        double lift;
        ColumnName column;  // attains the lift, if finite
    };
    struct Node {
        double bound;
        std::array<std::uint16_t, 3> corners;  // counter-clockwise
    };
    struct Column {
        ColumnName name;
        std::array<double, 3> lifts;  // at the corners of a triangle
        bool is_rim_useful;
    };

    static bool is_after(const Node& a, const Node& b) {
        return a.bound != b.bound ? a.bound > b.bound : a.corners > b.corners;
    }
    // A bound of at least this proves the best translation.
    double goal() const { return size_ - 1e-7 * size_ - kSeparatedLift; }
    bool cannot_improve(double bound) const { return bound >= goal(); }
    double lower_bound() const {
        const double open = node_count_ > 0 ? nodes_[0].bound : kInfinity;
        return std::max(known_bound_, std::min({open, unsplit_, size_}));
    }
    bool is_at_limit() const {
        return local_.cells_tested() >= last_cell_ && size_ > 2.0 * body_.whole().smallest;
    }
    bool is_done() const {
        return node_count_ == 0 || cannot_improve(nodes_[0].bound) || is_at_limit() ||
               is_minimum(size_, lower_bound());
    }

    // Computes the lift at an offset; the separating translation there may become the best.
    Point evaluate(const Offset& at) {
        Point point{at, -kInfinity, {}};
        const GroundLift lift = find_lift(local_, body_, {at.x, at.y, 0.0});
        point.lift = lift.lift;
        if (std::isfinite(lift.lift)) point.column = name_of(local_, lift);
        offer({at.x, at.y, std::max(0.0, lift.lift)});
        return point;
    }

    void offer(const Eigen::Vector3d& d) {
        const double size = length(d);
        if (!(size < size_)) return;
        const bool is_much = size < (1.0 - 1e-6) * size_;
        best_ = d;
        size_ = size;
        if (!is_much) return;
        const Eigen::Vector3d shorter = shorten(local_, body_, d);
        if (!(length(shorter) < size_)) return;
        best_ = shorter;
        size_ = length(shorter);
    }

    std::uint16_t add_point(const Offset& at) {
        points_[point_count_] = evaluate(at);
        return static_cast<std::uint16_t>(point_count_++);
    }

    // Adds a triangle that may hold a shorter translation than the best.
    void visit_node(Node node) {
        if (!bound(node)) return;
        nodes_[static_cast<std::size_t>(node_count_++)] = node;
        std::push_heap(nodes_.begin(), nodes_.begin() + node_count_, is_after);
    }

    // Bisects a triangle at the middle of its longest side.
    void split(const Node node) {
        std::size_t longest = 0;
        double most = -1.0;
        for (std::size_t i = 0; i < 3; ++i) {
            const Offset& a = points_[node.corners[i]].at;
            const Offset& b = points_[node.corners[(i + 1) % 3]].at;
            const double square = (b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y);
            if (square > most) {
                most = square;
                longest = i;
            }
        }
        const Offset& a = points_[node.corners[longest]].at;
        const Offset& b = points_[node.corners[(longest + 1) % 3]].at;
        if (!(most > kSeparatedLift * kSeparatedLift)) {
            unsplit_ = std::min(unsplit_, node.bound);
            return;
        }
        const std::uint16_t middle = add_point({0.5 * (a.x + b.x), 0.5 * (a.y + b.y)});
        Node first = node, second = node;
        first.corners[(longest + 1) % 3] = middle;
        second.corners[longest] = middle;
        visit_node(first);
        visit_node(second);
    }

    // Raises the bound of a triangle of offsets. False if no translation over the triangle is shorter than the best.
    bool bound(Node& node) {
        constexpr int kRounds = 8;
        OffsetTriangle triangle;
        for (std::size_t i = 0; i < 3; ++i) triangle[i] = points_[node.corners[i]].at;
        HalfSpaces spaces;
        for (std::size_t i = 0; i < 3; ++i) {
            HalfSpace side;
            if (make_side(triangle[i], triangle[(i + 1) % 3], side)) spaces.add(side);
        }
        Eigen::Vector3d p;
        if (!solve(spaces, node, p)) return false;
        const double near = length(p);
        const double range_top = find_range_top(local_, lowest_, triangle);
        if (range_top > 0.0) spaces.add({Eigen::Vector3d::UnitZ(), range_top});
        column_count_ = 0;
        for (const std::uint16_t corner : node.corners) {
            if (std::isfinite(points_[corner].lift)) {
                add_column(triangle, points_[corner].column, spaces);
            }
        }
        bool has_rims = false;
        for (int round = 0; round < kRounds; ++round) {
            if (!solve(spaces, node, p)) return false;
            const Point there = evaluate({p[0], p[1]});
            if (cannot_improve(node.bound)) return false;
            if (!(there.lift > p[2])) return true;  // p separates: the bound is exact
            if (is_at_limit()) return true;
            if (add_column(triangle, there.column, spaces)) continue;
            HalfSpace top;
            if (make_top_of_neighbour(local_, body_, there.column, triangle, p, top)) {
                spaces.add(top);
                continue;
            }
            if (has_rims) break;
            has_rims = true;
            if (!add_rims(triangle, near, spaces)) break;
        }
        if (!solve(spaces, node, p)) return false;
        // For polyhedra this bound is loose at the rims of facets, so the facets are enumerated too.
        if (node.bound < kNear * size_) return true;
        int visits = 0;
        node.bound = std::max(node.bound, bound_by_facets(spaces, p, visits));
        return !cannot_improve(node.bound);
    }

    // Raises a bound to the length of the shortest translation inside half-spaces. False if that is not below the best.
    bool solve(const HalfSpaces& spaces, Node& node, Eigen::Vector3d& p_out) const {
        if (!find_shortest(spaces, p_out)) return false;
        node.bound = std::max(node.bound, length(p_out));
        return !cannot_improve(node.bound);
    }

    // Adds the top of a column that the body overlaps in plan at all offsets of a triangle. False if it does not, or if
    // the column was added before.
    bool add_column(const OffsetTriangle& triangle, const ColumnName& name, HalfSpaces& spaces) {
        for (std::size_t i = 0; i < column_count_; ++i) {
            if (columns_[i].name == name) return false;
        }
        const Obstacle obstacle(local_, body_, name);
        if (column_count_ == kMostColumns || !obstacle.is_ground()) return false;
        Column& column = columns_[column_count_++];
        column.name = name;
        bool is_under_all = true;
        for (std::size_t i = 0; i < 3; ++i) {
            column.lifts[i] = obstacle.lift_at(triangle[i]);
            is_under_all = is_under_all && std::isfinite(column.lifts[i]);
        }
        HalfSpace top;
        column.is_rim_useful = true;
        if (!is_under_all || !make_top(triangle, column.lifts, top)) return false;
        spaces.add(top);
        // If the top is steep, the rim (see make_rim()) may cross the triangle.
        column.is_rim_useful = top.normal[2] < kSteep;
        return true;
    }

    // Adds half-spaces that exclude offsets with too high a lift over a column for a translation shorter than the best.
    bool add_rims(const OffsetTriangle& triangle, double near, HalfSpaces& spaces) const {
        const double high = std::sqrt(std::max(0.0, size_ * size_ - near * near));
        bool is_any = false;
        for (std::size_t i = 0; i < column_count_; ++i) {
            if (!columns_[i].is_rim_useful) continue;
            const Obstacle obstacle(local_, body_, columns_[i].name);
            HalfSpace rim;
            if (!make_rim(obstacle, triangle, columns_[i].lifts, high, rim)) continue;
            spaces.add(rim);
            is_any = true;
        }
        return is_any;
    }

    // Lower bound of the length of separating translations inside the half-spaces. Such a translation leaves every
    // overlapped column through a facet of the Minkowski difference of body and column. Only polyhedra have few facets.
    //
    // @param p the shortest translation inside the half-spaces
    double bound_by_facets(HalfSpaces& spaces, const Eigen::Vector3d& p, int& visits) {
        const double here = length(p);
        if (++visits > kMostVisits || spaces.count == HalfSpaces::kMost || is_at_limit())
            return here;
        const GroundLift lift = find_lift(local_, body_, p, 0.5 * kSeparatedLift);
        if (!(lift.lift > 0.5 * kSeparatedLift)) {
            offer(p);
            return here;
        }
        LocalHull hull;
        const LocalShape shape = body_.part(lift.part, hull);
        if (shape.kind == ShapeKind::round) return here;
        struct FacetExit {
            HalfSpace facet;
            Eigen::Vector3d d;
            double size;
        };
        std::array<FacetExit, kMostFacets> exits;
        std::size_t count = 0;
        bool is_known = true;
        const auto visit_facet = [&](const Eigen::Vector3d& n, double gap) {
            if (!is_known) return;
            FacetExit exit{{n, -gap}, Eigen::Vector3d::Zero(), 0.0};
            // If p is on the facet within rounding, it is unknown on which side p lies.
            is_known = dot(n, p) < exit.facet.depth - 0.1 * kSeparatedLift;
            spaces.planes[spaces.count++] = exit.facet;
            const bool is_possible = find_shortest(spaces, exit.d);
            --spaces.count;
            exit.size = length(exit.d);
            if (!is_possible || cannot_improve(exit.size)) return;
            is_known = is_known && count < kMostFacets;
            if (is_known) exits[count++] = exit;
        };
        visit_tops(shape, lift.triangle, visit_facet);
        visit_walls(shape, lift.triangle, visit_facet);
        if (!is_known) return here;
        // Insertion sort: allocates nothing and is stable.
        for (std::size_t i = 1; i < count; ++i) {
            for (std::size_t j = i; j > 0 && exits[j].size < exits[j - 1].size; --j) {
                std::swap(exits[j], exits[j - 1]);
            }
        }
        double least = size_;
        for (std::size_t i = 0; i < count && exits[i].size < least; ++i) {
            if (cannot_improve(exits[i].size)) break;
            spaces.planes[spaces.count++] = exits[i].facet;
            least = std::min(least, bound_by_facets(spaces, exits[i].d, visits));
            --spaces.count;
        }
        return std::max(here, least);
    }

    const LocalGround& local_;
    const LocalBody& body_;
    Eigen::Vector3d best_;
    double size_;  // length of the best
    double known_bound_;
    const SearchLimits& limits_;
    std::int64_t last_cell_;
    Eigen::Vector3d lowest_;      // point of the part with the largest lift
    double unsplit_ = kInfinity;  // smallest bound of triangles that are too small to bisect
    // Not initialised: only the first *_count_ are used.
    std::array<Point, kMost> points_;
    std::size_t point_count_ = 0;
    std::array<Node, kMost> nodes_;  // a heap, smallest bound first
    std::ptrdiff_t node_count_ = 0;
    std::array<Column, kMostColumns> columns_;  // columns that bound the current triangle
    std::size_t column_count_ = 0;
};

}  // namespace

MinTranslation search_min_translation(const LocalGround& local, const LocalBody& body,
                                      const MinTranslation& known, const SearchLimits& limits) {
    return MinTranslationSearch(local, body, known, limits).run();
}

}  // namespace terrane::internal
