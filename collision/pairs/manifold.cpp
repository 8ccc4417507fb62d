// SPDX-License-Identifier: MIT
#include "pairs/manifold.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace terrane::internal {

SupportPolygon::SupportPolygon(const Core& core, const ContactPlane& plane, double side) {
    // Smallest cosine between the normal of a support face and the contact normal; an edge replaces a steeper face.
    constexpr double kSteep = 0.05;
    constexpr double kLevel = 1e-8;
    constexpr double kNone = std::numeric_limits<double>::infinity();
    const Polyhedron& shape = core.shape;
    const Eigen::Vector3d direction = core.to_body(side * plane.normal);
    const std::uint32_t vertex = find_extreme(shape, direction);

    // Squared sine of an edge's slope, for edges that end at the support vertex. Vertices of a flat box may coincide.
    const auto slope_of = [&](const Polyhedron::Edge& e) {
        const Eigen::Vector3d& from = shape.vertices[e.from];
        const Eigen::Vector3d& to = shape.vertices[e.to];
        const Eigen::Vector3d& here = shape.vertices[vertex];
        if (from == to || (from != here && to != here)) return kNone;
        const double rise = dot(to - from, direction);
        return rise * rise / dot(to - from, to - from);
    };
    double lowest = kNone;
    const Polyhedron::Edge* edge = nullptr;
    for (const Polyhedron::Edge& e : shape.edges) {
        const double slope = slope_of(e);
        if (slope < lowest) {
            lowest = slope;
            edge = &e;
        }
    }
    // If an edge is level, the support face must be adjacent to a level edge.
    const double steepest = lowest < kLevel * kLevel ? kLevel * kLevel : kNone;
    double flattest = kSteep;
    for (const Polyhedron::Edge& e : shape.edges) {
        if (e.left == Polyhedron::kNoFace || !(slope_of(e) < steepest)) continue;
        for (const std::uint32_t f : {e.left, e.right}) {
            const double cosine = dot(direction, shape.faces[f].normal);
            if (cosine > flattest || (is_face && cosine == flattest && f < face)) {
                flattest = cosine;
                face = f;
                is_face = true;
            }
        }
    }
    const auto add = [&](std::uint32_t i) {
        const Eigen::Vector3d p = core.vertex(i);
        x[count] = dot(plane.x, p);
        y[count] = dot(plane.y, p);
        h[count] = dot(plane.normal, p);
        index[count] = i;
        ++count;
    };
    if (!is_face) {
        if (edge == nullptr) {
            add(vertex);
        } else {
            add(edge->from);
            add(edge->to);
        }
        return;
    }
    const Polyhedron::Face& f = shape.faces[face];
    const std::size_t stride = (f.count + kMost - 1) / kMost;
    // Thinning keeps the support vertex.
    std::size_t start = 0;
    while (shape.loops[f.first + start] != vertex && start + 1 < f.count) ++start;
    for (std::size_t k = 0; k < f.count; k += stride) {
        add(shape.loops[f.first + (start + k) % f.count]);
    }
    // normal . p = offset, with p = px x + py y + height n.
    const Eigen::Vector3d m = core.to_axes(f.normal);
    const double offset = f.offset + dot(m, core.centre);
    const double across = dot(m, plane.normal);
    base = offset / across;
    slope_x = -dot(m, plane.x) / across;
    slope_y = -dot(m, plane.y) / across;
    turn_ = side;
    low_x_ = *std::min_element(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(count));
    high_x_ = *std::max_element(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(count));
    low_y_ = *std::min_element(y.begin(), y.begin() + static_cast<std::ptrdiff_t>(count));
    high_y_ = *std::max_element(y.begin(), y.begin() + static_cast<std::ptrdiff_t>(count));
}

bool SupportPolygon::contains(double px, double py, double slack) const {
    // The bounding box also bounds faces without area.
    if (!is_face || px < low_x_ - slack || px > high_x_ + slack || py < low_y_ - slack ||
        py > high_y_ + slack) {
        return false;
    }
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t j = i + 1 == count ? 0 : i + 1;
        const double ex = x[j] - x[i];
        const double ey = y[j] - y[i];
        const double inside = turn_ * (ex * (py - y[i]) - ey * (px - x[i]));
        if (inside < 0.0 && inside * inside > slack * slack * (ex * ex + ey * ey)) return false;
    }
    return true;
}

ShapeFeature SupportPolygon::edge_feature(std::size_t i) const {
    const std::size_t j = i + 1 == count ? 0 : i + 1;
    return {std::min(index[i], index[j]), std::max(index[i], index[j])};
}

bool Manifold::Candidate::is_before(const Candidate& other) const {
    if (depth != other.depth) return depth > other.depth;
    if (features != other.features) return features < other.features;
    for (int i = 0; i < 3; ++i) {
        if (point[i] != other.point[i]) return point[i] < other.point[i];
    }
    return false;
}

void Manifold::add(const Eigen::Vector3d& point_on_a, double depth, ShapeFeature a, ShapeFeature b,
                   std::uint32_t part_a, std::uint32_t part_b) {
    if (!(depth >= -margin_)) return;
    if (count_ == kMost) reduce();
    deepest_ = count_ == 0 ? depth : std::max(deepest_, depth);
    candidates_[count_++] = {
        point_on_a, depth, {part_a, a.first, a.second, part_b, b.first, b.second}};
}

// Keeps up to four contacts: the deepest, the one farthest from it, the one that spans the largest triangle with both,
// and the one that adds the largest area to that triangle.
void Manifold::reduce() {
    if (count_ == 0) return;
    sort();
    std::size_t kept = 1;
    double same_place = 0.0;  // square metres: points that gain less area coincide
    while (kept < 4) {
        double best = 0.0;
        std::size_t which = 0;
        for (std::size_t i = kept; i < count_; ++i) {
            const Eigen::Vector3d& p = candidates_[i].point;
            const Eigen::Vector3d& a = candidates_[0].point;
            double gain = 0.0;
            if (kept == 1) {
                const double along = dot(p - a, normal_);
                gain = dot(p - a, p - a) - along * along;
            } else {
                const Eigen::Vector3d& b = candidates_[1].point;
                const double area = dot(cross(b - a, p - a), normal_);
                if (kept == 2) {
                    gain = std::abs(area);
                } else {
                    const Eigen::Vector3d& c = candidates_[2].point;
                    const double side = dot(cross(b - a, c - a), normal_) < 0.0 ? -1.0 : 1.0;
                    gain = std::max({-side * area, -side * dot(cross(c - b, p - b), normal_),
                                     -side * dot(cross(a - c, p - c), normal_)});
                }
            }
            if (gain > best) {
                best = gain;
                which = i;
            }
        }
        if (which == 0) break;
        if (kept == 1) {
            same_place = 1e-12 * best;
            if (best < 1e-24) break;
        } else if (best < same_place) {
            break;
        }
        std::swap(candidates_[kept], candidates_[which]);
        ++kept;
    }
    count_ = kept;
}

void Manifold::sort() {
    std::sort(candidates_.begin(), candidates_.begin() + static_cast<std::ptrdiff_t>(count_),
              [](const Candidate& a, const Candidate& b) { return a.is_before(b); });
}

std::size_t Manifold::finish(std::array<PairContact, 4>& contacts_out) {
    reduce();
    sort();
    for (std::size_t i = 0; i < count_; ++i) {
        const Candidate& from = candidates_[i];
        contacts_out[i] = {from.point,
                           normal_,
                           from.depth,
                           {from.features[1], from.features[2]},
                           {from.features[4], from.features[5]},
                           from.features[0],
                           from.features[3]};
    }
    return count_;
}

// Sources: G. van den Bergen. Collision detection in interactive 3D environments. 2003, section 4.4.
// Deviations: the support faces are intersected in the plane orthogonal to the normal and keep their own heights, so
//             that each contact's depth is the overlap along the normal, and its two points lie on the two shapes.

namespace {

// Adds the intersection of two edges in the plane.
void cross_edges(const SupportPolygon& a, std::size_t i, const SupportPolygon& b, std::size_t j,
                 double slack, const auto& add) {
    const std::size_t i1 = i + 1 == a.count ? 0 : i + 1;
    const std::size_t j1 = j + 1 == b.count ? 0 : j + 1;
    const double ux = a.x[i1] - a.x[i], uy = a.y[i1] - a.y[i];
    const double vx = b.x[j1] - b.x[j], vy = b.y[j1] - b.y[j];
    const double rx = b.x[j] - a.x[i], ry = b.y[j] - a.y[i];
    const double uu = ux * ux + uy * uy;
    const double vv = vx * vx + vy * vy;
    const double across = ux * vy - uy * vx;
    const auto add_at = [&](double s, double t) {
        add(a.x[i] + s * ux, a.y[i] + s * uy, a.h[i] + s * (a.h[i1] - a.h[i]),
            b.h[j] + t * (b.h[j1] - b.h[j]), a.edge_feature(i), b.edge_feature(j));
    };
    if (across * across > 1e-18 * uu * vv) {
        const double s = (rx * vy - ry * vx) / across;
        const double t = (rx * uy - ry * ux) / across;
        const auto is_beyond = [&](double share, double square) {
            const double over = std::max(-share, share - 1.0);
            return over > 0.0 && over * over * square > slack * slack;
        };
        if (is_beyond(s, uu) || is_beyond(t, vv)) return;
        add_at(std::clamp(s, 0.0, 1.0), std::clamp(t, 0.0, 1.0));
        return;
    }
    // Collinear edges: adds the ends of their common interval.
    if (uu == 0.0 || vv == 0.0) return;
    if (std::abs(rx * uy - ry * ux) > slack * std::sqrt(uu)) return;
    const auto on_a = [&](double t) { return ((rx + t * vx) * ux + (ry + t * vy) * uy) / uu; };
    const auto on_b = [&](double s) { return ((s * ux - rx) * vx + (s * uy - ry) * vy) / vv; };
    for (const double end : {0.0, 1.0}) {
        if (const double t = on_b(end); t >= 0.0 && t <= 1.0) add_at(end, t);
        if (const double s = on_a(end); s >= 0.0 && s <= 1.0) add_at(s, end);
    }
}

void intersect(const Core& a, const Core& b, const ContactPlane& plane, const SupportPolygon& of_a,
               const SupportPolygon& of_b, Manifold& manifold) {
    const double radii = a.radius + b.radius;
    const double size = a.reach + b.reach;
    const double slack = 1e-11 * size;
    const auto add = [&](double x, double y, double height_a, double height_b,
                         const ShapeFeature& feature_a, const ShapeFeature& feature_b) {
        manifold.add(plane.at(x, y, height_a - a.radius), height_b - height_a + radii, feature_a,
                     feature_b);
    };
    for (std::size_t i = 0; i < of_a.count; ++i) {
        if (!of_b.contains(of_a.x[i], of_a.y[i], slack)) continue;
        add(of_a.x[i], of_a.y[i], of_a.h[i], of_b.height(of_a.x[i], of_a.y[i]),
            of_a.vertex_feature(i), of_b.face_feature());
    }
    for (std::size_t j = 0; j < of_b.count; ++j) {
        if (!of_a.contains(of_b.x[j], of_b.y[j], slack)) continue;
        add(of_b.x[j], of_b.y[j], of_a.height(of_b.x[j], of_b.y[j]), of_b.h[j], of_a.face_feature(),
            of_b.vertex_feature(j));
    }
    // An edge has one side, a vertex none.
    const auto sides = [](const SupportPolygon& p) { return p.count < 3 ? p.count - 1 : p.count; };
    for (std::size_t i = 0; i < sides(of_a); ++i) {
        for (std::size_t j = 0; j < sides(of_b); ++j) {
            cross_edges(of_a, i, of_b, j, slack, add);
        }
    }
}

}  // namespace

void intersect_support_features(const Core& a, const Core& b, const Eigen::Vector3d& normal,
                                Manifold& manifold) {
    const ContactPlane plane(normal);
    intersect(a, b, plane, SupportPolygon(a, plane, -1.0), SupportPolygon(b, plane, 1.0), manifold);
}

void find_core_contacts(const Core& a, const Core& b, const Gap& gap, Manifold& manifold) {
    const ContactPlane plane(gap.normal);
    const SupportPolygon of_a(a, plane, -1.0);
    const SupportPolygon of_b(b, plane, 1.0);
    intersect(a, b, plane, of_a, of_b, manifold);
    const double radii = a.radius + b.radius;
    const double size = a.reach + b.reach;
    // The deepest contact may be missing: vertex on vertex, or vertex on a face too steep to be a support face.
    if (manifold.has_depth(-gap.distance - 1e-9 * (size + radii))) return;
    Eigen::Vector3d on_a = gap.core_a;
    if (!gap.has_points) {
        const std::uint32_t vertex = find_extreme(a.shape, a.to_body(-gap.normal));
        on_a = a.vertex(vertex);
    }
    manifold.add(on_a - a.radius * gap.normal, -gap.distance, of_a.vertex_feature(0),
                 of_b.vertex_feature(0));
}

}  // namespace terrane::internal
