// SPDX-License-Identifier: MIT
//
// Sources: G. van den Bergen. Collision detection in interactive 3D environments. 2003, section 4.4
//          (contacts from pairs of features).
// Deviations: each vertex, edge and face of the ground is looked at once, and passed over where the planes
//             under the box part it from where the box is. Features are paired where the box is *free*.
#include "box_patches.h"

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

struct Vertex {
    int column = 0;
    int row = 0;
};

class Pairs {
public:
    Pairs(const LocalGround& local, const GroundWindow& window, const LocalShape& box,
          std::uint32_t part, const Eigen::Vector3d& freeing, double margin, double reach,
          ContactPatches& patches)
        : local_(local),
          window_(window),
          at_start_(box),
          part_(part),
          freeing_(freeing),
          margin_(margin),
          reach_(reach),
          spacing_(local.spacing()),
          slack_(1e-10 * local.spacing()),
          corner_(local.corner(window)),
          centre_(box.centre + freeing),
          patches_(patches) {
        for (std::size_t i = 0; i < 3; ++i) up_[i] = box.up(i);
        first_.column = index_of(box.centre[0] - box.bounds[0] - margin - corner_[0], 1.0);
        first_.row = index_of(box.centre[1] - box.bounds[1] - margin - corner_[1], 1.0);
        last_.column = index_of(box.centre[0] + box.bounds[0] + margin - corner_[0], 0.0);
        last_.row = index_of(box.centre[1] + box.bounds[1] + margin - corner_[1], 0.0);
    }

    void run() {
        take_corners();
        take_vertices();
        take_edges();
    }

private:
    // Bits say which planes part a vertex, and all below it, from where the box is.
    using Code = std::uint8_t;

    int index_of(double p, double round_up) const {
        const double index = p / spacing_;
        const auto whole = static_cast<int>(index);
        return round_up > 0.0 && static_cast<double>(whole) < index ? whole + 1 : whole;
    }

    Eigen::Vector3d vertex(int column, int row) const {
        return {local_.x(window_.cells.west + column), local_.y(window_.cells.south + row),
                window_.at(column, row)};
    }

    Code code_of(const Eigen::Vector3d& v) const {
        const Eigen::Vector3d to = v - at_start_.centre;
        unsigned code = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            const double half = at_start_.half[static_cast<Eigen::Index>(i)];
            if (dot(up_[i], to) < -half - margin_) code |= 1u << i;
        }
        if (to[0] < -at_start_.bounds[0] - margin_) code |= 8u;
        if (to[0] > at_start_.bounds[0] + margin_) code |= 16u;
        if (to[1] < -at_start_.bounds[1] - margin_) code |= 32u;
        if (to[1] > at_start_.bounds[1] + margin_) code |= 64u;
        return static_cast<Code>(code);
    }

    void add(const Eigen::Vector3d& on_box, const Eigen::Vector3d& n, double gap,
             const ShapeFeature& feature) {
        Contact contact;
        contact.point_world = on_box - freeing_;
        contact.normal = n;
        contact.depth = dot(n, freeing_) - gap;
        contact.feature = feature;
        contact.part = part_;
        patches_.add(contact);
    }

    bool is_gap(const Eigen::Vector3d& n, double gap) const {
        return gap >= -kTouch && gap <= std::min(dot(n, freeing_) + margin_, reach_);
    }

    // Corners of the box over faces of the ground.
    void take_corners() {
        for (int k = 0; k < 8; ++k) {
            const Eigen::Vector3d start = at_start_.corner(k);
            if (start[2] > window_.high + margin_) continue;
            const Eigen::Vector3d p = start + freeing_;
            const Eigen::Vector3d to = p - corner_;
            const int west = std::clamp(cell_of(to[0] - reach_), 0, window_.columns - 1);
            const int east = std::clamp(cell_of(to[0] + reach_), 0, window_.columns - 1);
            const int south = std::clamp(cell_of(to[1] - reach_), 0, window_.rows - 1);
            const int north = std::clamp(cell_of(to[1] + reach_), 0, window_.rows - 1);
            for (int row = south; row <= north; ++row) {
                for (int column = west; column <= east; ++column) {
                    // above the whole cell where it starts: not in it, and no nearer than the margin
                    const double highest =
                        std::max({window_.at(column, row), window_.at(column + 1, row),
                                  window_.at(column, row + 1), window_.at(column + 1, row + 1)});
                    if (start[2] > highest + margin_) continue;
                    take_corner(k, p, column, row);
                }
            }
        }
    }

    int cell_of(double p) const { return static_cast<int>(std::max(p, 0.0) / spacing_); }

    void take_corner(int k, const Eigen::Vector3d& p, int column, int row) {
        if (!window_.is_ground(column, row)) return;
        const double south_west = window_.at(column, row);
        const double south_east = window_.at(column + 1, row);
        const double north_west = window_.at(column, row + 1);
        const double north_east = window_.at(column + 1, row + 1);
        const bool is_even = window_.is_cut_to_north_east(column, row);
        const double per_cell = 1.0 / spacing_;
        for (const bool is_south : {true, false}) {
            // slopes of the triangle's plane, which passes through the end of the cut that both have
            const double x =
                (is_south ? south_east - south_west : north_east - north_west) * per_cell;
            const double y =
                (is_south != is_even ? north_west - south_west : north_east - south_east) *
                per_cell;
            const double end = is_even ? south_west : south_east;
            const Eigen::Vector3d from(local_.x(window_.cells.west + column + (is_even ? 0 : 1)),
                                       local_.y(window_.cells.south + row), end);
            const Eigen::Vector3d to = p - from;
            const double over = to[2] - (x * to[0] + y * to[1]);
            const double over_start = over - (freeing_[2] - (x * freeing_[0] + y * freeing_[1]));
            const double square = 1.0 + x * x + y * y;
            if (over_start > 0.0 && over_start * over_start > margin_ * margin_ * square) continue;
            if (over < 0.0 && over * over > kTouch * kTouch * square) continue;
            // the foot of the perpendicular, roughly
            const double foot_x = to[0] + x * (over / square);
            const double foot_y = to[1] + y * (over / square);
            const double hair = 1e-9 * spacing_;
            const double u = is_even ? foot_x : foot_x + spacing_;
            if (u < -hair || u > spacing_ + hair || foot_y < -hair || foot_y > spacing_ + hair) {
                continue;
            }
            const double v = is_south ? 0.0 : 1.0;
            const Triangle triangle =
                local_.triangle(window_, column, row, is_even ? 1.0 - v : v, v);
            const Eigen::Vector3d& n = triangle.normal;
            const double gap = dot(n, p - triangle.v[0]);
            if (!is_gap(n, gap) || !is_foot_inside(p, triangle)) continue;
            // only the face of the box that looks most at the triangle
            std::size_t face = 0;
            for (std::size_t i = 1; i < 3; ++i) {
                if (std::abs(dot(n, at_start_.axes[i])) > std::abs(dot(n, at_start_.axes[face]))) {
                    face = i;
                }
            }
            if (((k >> face & 1) == 0) != (dot(n, at_start_.axes[face]) > 0.0)) continue;
            const auto name = static_cast<std::uint32_t>(k);
            add(p, n, gap, {name, name});
        }
    }

    // Vertices of the ground under faces of the box.
    void take_vertices() {
        for (int row = first_.row; row <= last_.row; ++row) {
            for (int column = first_.column; column <= last_.column; ++column) {
                const Eigen::Vector3d v = vertex(column, row);
                if (code_of(v) != 0) continue;
                const Eigen::Vector3d to = centre_ - v;
                for (std::size_t i = 0; i < 3; ++i) {
                    const Eigen::Vector3d& n = up_[i];
                    const double gap = dot(n, to) - at_start_.half[static_cast<Eigen::Index>(i)];
                    if (!is_gap(n, gap) || n[2] == 0.0) continue;
                    const std::size_t j = (i + 1) % 3;
                    const std::size_t k = (i + 2) % 3;
                    if (std::abs(dot(up_[j], to)) > at_start_.half[static_cast<Eigen::Index>(j)] ||
                        std::abs(dot(up_[k], to)) > at_start_.half[static_cast<Eigen::Index>(k)] ||
                        !is_top(column, row, v, n)) {
                        continue;
                    }
                    const std::uint32_t side = at_start_.axes[i][2] < 0.0 ? 1u : 0u;
                    add(v + gap * n, n, gap,
                        {2 * static_cast<std::uint32_t>(i) + side, ShapeFeature::kFace});
                }
            }
        }
    }

    // Whether no neighbour of a vertex is higher along a direction.
    bool is_top(int column, int row, const Eigen::Vector3d& v, const Eigen::Vector3d& n) const {
        // where the ground ends only faces count
        if (!window_.is_full &&
            !(window_.is_ground(column, row) && window_.is_ground(column - 1, row) &&
              window_.is_ground(column, row - 1) && window_.is_ground(column - 1, row - 1))) {
            return false;
        }
        const bool has_diagonals = window_.is_cut_to_north_east(column, row);
        for (int y = -1; y <= 1; ++y) {
            for (int x = -1; x <= 1; ++x) {
                if ((x == 0 && y == 0) || (x != 0 && y != 0 && !has_diagonals)) continue;
                if (dot(n, vertex(column + x, row + y) - v) > slack_) return false;
            }
        }
        return true;
    }

    // Edges of the ground under edges of the box.
    void take_edges() {
        std::array<Code, static_cast<std::size_t>(GroundWindow::kStride) * GroundWindow::kStride>
            codes;
        const auto code = [&](const Vertex& v) -> Code& {
            return codes[static_cast<std::size_t>(v.row) * GroundWindow::kStride +
                         static_cast<std::size_t>(v.column)];
        };
        // edges that reach in from the vertices around
        const int west = std::max(first_.column - 1, 1);
        const int south = std::max(first_.row - 1, 1);
        const int east = std::min(last_.column + 1, window_.columns - 1);
        const int north = std::min(last_.row + 1, window_.rows - 1);
        for (int row = south; row <= north; ++row) {
            for (int column = west; column <= east; ++column) {
                code({column, row}) = code_of(vertex(column, row));
            }
        }
        const auto z = [&](int column, int row) { return window_.at(column, row); };
        for (int row = south; row <= north; ++row) {
            for (int column = west; column <= east; ++column) {
                const Vertex here{column, row};
                const bool is_even = window_.is_cut_to_north_east(column, row);
                if (column < east && (code(here) & code({column + 1, row})) == 0) {
                    // the third corners lie across from the odd end
                    const int odd = is_even ? column + 1 : column;
                    if (are_ground({column, row}, {column, row - 1}) &&
                        z(odd, row + 1) + z(odd, row - 1) < 2.0 * z(odd, row)) {
                        take_edge(here, {column + 1, row}, {odd, row + 1}, {odd, row - 1});
                    }
                }
                if (row < north && (code(here) & code({column, row + 1})) == 0) {
                    const int odd = is_even ? row + 1 : row;
                    if (are_ground({column, row}, {column - 1, row}) &&
                        z(column + 1, odd) + z(column - 1, odd) < 2.0 * z(column, odd)) {
                        take_edge(here, {column, row + 1}, {column + 1, odd}, {column - 1, odd});
                    }
                }
                if (column == east || row == north) continue;
                const Vertex a = is_even ? here : Vertex{column + 1, row};
                const Vertex b = is_even ? Vertex{column + 1, row + 1} : Vertex{column, row + 1};
                const Vertex c = is_even ? Vertex{column + 1, row} : here;
                const Vertex d = is_even ? Vertex{column, row + 1} : Vertex{column + 1, row + 1};
                if ((code(a) & code(b)) != 0) continue;
                if (are_ground(here, here) && z(c.column, c.row) + z(d.column, d.row) <
                                                  z(a.column, a.row) + z(b.column, b.row)) {
                    take_edge(a, b, c, d);
                }
            }
        }
    }

    // Edges where the ground ends are no surface.
    bool are_ground(const Vertex& a, const Vertex& b) const {
        return window_.is_ground(a.column, a.row) && window_.is_ground(b.column, b.row);
    }

    // A convex edge and the third corners of its two triangles.
    void take_edge(const Vertex& from, const Vertex& to, const Vertex& left, const Vertex& right) {
        const Eigen::Vector3d a = vertex(from.column, from.row);
        const Eigen::Vector3d edge = vertex(to.column, to.row) - a;
        const Eigen::Vector3d to_left = vertex(left.column, left.row) - a;
        const Eigen::Vector3d to_right = vertex(right.column, right.row) - a;
        for (std::size_t i = 0; i < 3; ++i) {
            const Eigen::Vector3d& axis = at_start_.axes[i];
            Eigen::Vector3d n = cross(axis, edge);
            if (n[2] < 0.0) n = -n;
            const double square = dot(n, n);
            const double edge_square = dot(edge, edge);
            // nearly parallel: faces and corners tell the same
            if (n[2] <= 0.0 || square < 1e-12 * edge_square) continue;
            const double size = std::sqrt(square);
            if (dot(n, to_left) > slack_ * size || dot(n, to_right) > slack_ * size) continue;
            n /= size;
            // The edge of the box that is deepest against n.
            Eigen::Vector3d p = centre_;
            std::uint32_t corner = 0;
            for (std::size_t m = 0; m < 3; ++m) {
                if (m == i) continue;
                const double half = at_start_.half[static_cast<Eigen::Index>(m)];
                const bool is_high = !(dot(n, at_start_.axes[m]) > 0.0);
                p += (is_high ? half : -half) * at_start_.axes[m];
                if (is_high) corner |= 1u << m;
            }
            const double gap = dot(n, p - a);
            if (!is_gap(n, gap)) continue;
            // Where the two lines pass each other.
            const double edge_length = std::sqrt(edge_square);
            const Eigen::Vector3d direction = edge / edge_length;
            const Eigen::Vector3d r = p - a;
            const double b = dot(axis, direction);
            const double s = (b * dot(direction, r) - dot(axis, r)) / (1.0 - b * b);
            const double t = dot(direction, r) + s * b;
            if (std::abs(s) > at_start_.half[static_cast<Eigen::Index>(i)] || t < 0.0 ||
                t > edge_length) {
                continue;
            }
            add(p + s * axis, n, gap, {corner, corner | 1u << i});
        }
    }

    const LocalGround& local_;
    const GroundWindow& window_;
    const LocalShape& at_start_;
    std::uint32_t part_;
    const Eigen::Vector3d& freeing_;
    double margin_;
    double reach_;
    double spacing_;
    double slack_;  // by which a neighbour may stand out before it counts as above a plane
    Eigen::Vector3d corner_;
    Eigen::Vector3d centre_;  // where the box is free
    std::array<Eigen::Vector3d, 3> up_;
    Vertex first_, last_;  // of the vertices under the bounds
    ContactPatches& patches_;
};

}  // namespace

void find_box_patches(const LocalGround& local, const GroundWindow& window, const LocalShape& box,
                      std::uint32_t part, const Eigen::Vector3d& freeing, double margin,
                      double reach, ContactPatches& patches) {
    Pairs(local, window, box, part, freeing, margin, reach, patches).run();
}

}  // namespace terrane::internal
