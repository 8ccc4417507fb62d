// SPDX-License-Identifier: MIT
#include "scene/form_builder.h"

#include <terrane/terrain/crease_normals.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace terrane::tools {
namespace {

/// A convex polygon whose edges know the planes that cut them: labels[i] is that of the edge from corner i.
struct LabelledFace {
    Polygon3 corners;
    std::vector<std::size_t> labels;
};

double distance_to(const HalfSpace& plane, const Eigen::Vector3d& p) {
    return plane.normal.dot(p) - plane.offset;
}

LabelledFace clip(const LabelledFace& face, const HalfSpace& kept, std::size_t label) {
    LabelledFace out;
    const std::size_t count = face.corners.size();
    for (std::size_t i = 0; i < count; ++i) {
        const Eigen::Vector3d& a = face.corners[i];
        const Eigen::Vector3d& b = face.corners[(i + 1) % count];
        const double from = distance_to(kept, a), to = distance_to(kept, b);
        if (from <= 0.0) {
            out.corners.push_back(a);
            out.labels.push_back(face.labels[i]);
        }
        if ((from < 0.0 && to > 0.0) || (from > 0.0 && to < 0.0)) {
            out.corners.push_back(a + from / (from - to) * (b - a));
            out.labels.push_back(from < 0.0 ? label : face.labels[i]);
        } else if (from == 0.0 && to > 0.0) {
            out.labels.back() = label;
        }
    }
    return out;
}

LabelledFace labelled_face(std::span<const HalfSpace> planes, std::size_t face, double inset) {
    constexpr double kReach = 1e5;  // beyond every form, metres
    const HalfSpace& own = planes[face];
    const Eigen::Vector3d right = own.normal.unitOrthogonal();
    const Eigen::Vector3d up = own.normal.cross(right);
    const Eigen::Vector3d middle = own.offset * own.normal;
    LabelledFace polygon;
    constexpr std::array<std::array<double, 2>, 4> kCorners{{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
    for (const auto& [x, y] : kCorners) {
        polygon.corners.push_back(middle + kReach * (x * right + y * up));
        polygon.labels.push_back(planes.size());
    }
    for (std::size_t i = 0; i < planes.size(); ++i) {
        if (i == face) continue;
        polygon = clip(polygon, {planes[i].normal, planes[i].offset - inset}, i);
    }
    return polygon;
}

/// The point of three planes, whose order does not matter.
Eigen::Vector3d meet(std::span<const HalfSpace> planes, std::array<std::size_t, 3> of) {
    std::sort(of.begin(), of.end());
    const HalfSpace &a = planes[of[0]], &b = planes[of[1]], &c = planes[of[2]];
    const Eigen::Vector3d across = b.normal.cross(c.normal);
    return (a.offset * across + b.offset * c.normal.cross(a.normal) +
            c.offset * a.normal.cross(b.normal)) /
           a.normal.dot(across);
}

/// Index of the edge with a label; the number of edges if there is none.
std::size_t edge_of(const LabelledFace& face, std::size_t label) {
    return static_cast<std::size_t>(std::find(face.labels.begin(), face.labels.end(), label) -
                                    face.labels.begin());
}

/// Whether every edge of a face is an edge of the neighbour too.
bool are_joined(std::span<const LabelledFace> faces) {
    for (std::size_t f = 0; f < faces.size(); ++f) {
        if (faces[f].corners.size() < 3) return false;
        for (const std::size_t g : faces[f].labels) {
            if (g >= faces.size() || edge_of(faces[g], f) == faces[g].labels.size()) return false;
        }
    }
    return true;
}

}  // namespace

HalfSpace half_space(const Eigen::Vector3d& normal, const Eigen::Vector3d& point) {
    const Eigen::Vector3d unit = normal.normalized();
    return {unit, unit.dot(point)};
}

std::vector<HalfSpace> box_planes(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    std::vector<HalfSpace> planes;
    for (int axis = 0; axis < 3; ++axis) {
        planes.push_back({Eigen::Vector3d::Unit(axis), high[axis]});
        planes.push_back({-Eigen::Vector3d::Unit(axis), -low[axis]});
    }
    return planes;
}

Polygon3 face_of(std::span<const HalfSpace> planes, std::size_t face, double inset) {
    return labelled_face(planes, face, inset).corners;
}

Polygon3 clipped(const Polygon3& polygon, const HalfSpace& kept) {
    return clip({polygon, std::vector<std::size_t>(polygon.size(), 0)}, kept, 0).corners;
}

std::vector<MeshMaterial> form_materials() {
    std::vector<MeshMaterial> materials(7);
    const auto of = [&](FormMaterial kind) -> MeshMaterial& {
        return materials[static_cast<std::size_t>(kind)];
    };
    of(FormMaterial::paint).roughness = 0.35f;
    of(FormMaterial::glass).roughness = 0.08f;
    of(FormMaterial::steel).roughness = 0.4f;
    of(FormMaterial::steel).metal = 0.8f;
    of(FormMaterial::head_lamp).roughness = 0.15f;
    of(FormMaterial::head_lamp).emission = {0.55f, 0.53f, 0.48f};
    of(FormMaterial::tail_lamp).roughness = 0.2f;
    of(FormMaterial::tail_lamp).emission = {0.35f, 0.01f, 0.01f};
    of(FormMaterial::indicator).roughness = 0.2f;
    of(FormMaterial::indicator).emission = {0.35f, 0.13f, 0.01f};
    return materials;
}

Pose along_axis(const Eigen::Vector3d& place, const Eigen::Vector3d& axis) {
    Pose pose;
    const Eigen::Vector3d z = axis.normalized();
    const Eigen::Vector3d x = z.unitOrthogonal();
    pose.rotation << x, z.cross(x), z;
    pose.translation = place;
    return pose;
}

FormColour mixed(const FormColour& a, const FormColour& b, double share) {
    FormColour colour{};
    for (std::size_t k = 0; k < 3; ++k) colour[k] = a[k] + share * (b[k] - a[k]);
    return colour;
}

void FormBuilder::set_paint(FormMaterial material, const FormColour& colour) {
    material_ = material;
    for (std::size_t k = 0; k < 3; ++k)
        colour_[k] = static_cast<std::uint8_t>(std::lround(255.0 * colour[k]));
}

std::uint32_t FormBuilder::add_vertex(const Eigen::Vector3d& position,
                                      const Eigen::Vector3d& normal) {
    TriangleMesh& mesh = model_.mesh;
    mesh.positions.push_back(frame_ * position);
    mesh.normals.push_back((frame_.rotation * normal).normalized().cast<float>());
    mesh.colours.push_back(colour_);
    mesh.materials.push_back(static_cast<std::uint16_t>(material_));
    return static_cast<std::uint32_t>(mesh.positions.size() - 1);
}

void FormBuilder::add_polygon(std::span<const std::uint32_t> corners) {
    for (std::size_t i = 2; i < corners.size(); ++i)
        model_.mesh.triangles.push_back({corners[0], corners[i - 1], corners[i]});
}

void FormBuilder::add_solid(std::span<const HalfSpace> all_planes, double bevel) {
    constexpr int kTrials = 5;
    std::vector<HalfSpace> planes;  // without those that bound nothing
    for (std::size_t i = 0; i < all_planes.size(); ++i) {
        if (face_of(all_planes, i, 0.0).size() >= 3) planes.push_back(all_planes[i]);
    }
    if (planes.size() < 4) return;  // flat
    std::vector<LabelledFace> faces;
    for (int trial = 0;; ++trial) {
        faces.clear();
        if (trial == kTrials) bevel = 0.0;
        for (std::size_t f = 0; f < planes.size(); ++f)
            faces.push_back(labelled_face(planes, f, bevel));
        if (bevel <= 0.0 || are_joined(faces)) break;
        bevel *= 0.5;
    }
    std::vector<std::vector<std::uint32_t>> vertices(faces.size());
    for (std::size_t f = 0; f < faces.size(); ++f) {
        const std::vector<std::size_t>& labels = faces[f].labels;
        for (std::size_t i = 0; i < labels.size(); ++i) {
            // sharp corners have the same bits in all faces
            const std::size_t before = labels[(i + labels.size() - 1) % labels.size()];
            const bool is_sharp = bevel <= 0.0 && std::max(before, labels[i]) < planes.size();
            vertices[f].push_back(
                add_vertex(is_sharp ? meet(planes, {f, before, labels[i]}) : faces[f].corners[i],
                           planes[f].normal));
        }
        if (vertices[f].size() >= 3) add_polygon(vertices[f]);
    }
    if (bevel <= 0.0) return;
    for (std::size_t f = 0; f < faces.size(); ++f) {
        const std::size_t count = faces[f].labels.size();
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t g = faces[f].labels[i];
            const std::size_t before = faces[f].labels[(i + count - 1) % count];
            const std::size_t shared = edge_of(faces[g], f);
            const std::size_t next = (shared + 1) % faces[g].labels.size();
            if (f < g) {  // the chamfer between two faces
                add_polygon(std::array{vertices[f][(i + 1) % count], vertices[f][i],
                                       vertices[g][next], vertices[g][shared]});
            }
            if (f < g && f < before) {  // the corner between three faces, of which f is the first
                add_polygon(std::array{vertices[f][i], vertices[before][edge_of(faces[before], f)],
                                       vertices[g][next]});
            }
        }
    }
}

void FormBuilder::add_box(const Eigen::Vector3d& low, const Eigen::Vector3d& high, double bevel) {
    add_solid(box_planes(low, high), bevel);
}

void FormBuilder::add_plate(const Polygon3& polygon, double height, double bevel) {
    if (polygon.size() < 3) return;
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    for (std::size_t i = 2; i < polygon.size(); ++i)
        normal += (polygon[i - 1] - polygon[0]).cross(polygon[i] - polygon[0]);
    if (normal.norm() == 0.0) return;
    normal.normalize();
    std::vector<HalfSpace> planes{half_space(normal, polygon[0] + height * normal),
                                  half_space(-normal, polygon[0] - height * normal)};
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Eigen::Vector3d edge = polygon[(i + 1) % polygon.size()] - polygon[i];
        if (edge.norm() > 1e-9) planes.push_back(half_space(edge.cross(normal), polygon[i]));
    }
    add_solid(planes, bevel);
}

void FormBuilder::add_turned(std::span<const RingPoint> profile, int segments) {
    constexpr double kRound = 0.7;  // cosine of the largest angle that is shaded as round
    const std::size_t spans = profile.size() - 1;
    std::vector<Eigen::Vector2d> normals;  // radial and along
    for (std::size_t i = 0; i < spans; ++i) {
        const Eigen::Vector2d step(profile[i + 1].radius - profile[i].radius,
                                   profile[i + 1].along - profile[i].along);
        normals.push_back(Eigen::Vector2d(step.y(), -step.x()).normalized());
    }
    // the normal at an end of a span: that of the span, or the mean with its neighbour's
    const auto normal_at = [&](std::size_t span, std::size_t neighbour) -> Eigen::Vector2d {
        if (neighbour >= spans || normals[span].dot(normals[neighbour]) < kRound)
            return normals[span];
        return (normals[span] + normals[neighbour]).normalized();
    };
    const auto add_ring = [&](const RingPoint& point, const Eigen::Vector2d& normal) {
        std::vector<std::uint32_t> ring;
        for (int k = 0; k < segments; ++k) {
            const double angle = 2.0 * std::numbers::pi * k / segments;
            const double c = std::cos(angle), s = std::sin(angle);
            ring.push_back(add_vertex({point.radius * c, point.radius * s, point.along},
                                      {normal.x() * c, normal.x() * s, normal.y()}));
        }
        return ring;
    };
    std::vector<std::uint32_t> low, high;
    for (std::size_t i = 0; i < spans; ++i) {
        const bool is_round = i > 0 && normals[i - 1].dot(normals[i]) >= kRound;
        low = is_round ? high : add_ring(profile[i], normal_at(i, i - 1));
        high = add_ring(profile[i + 1], normal_at(i, i + 1));
        for (std::size_t k = 0; k < low.size(); ++k) {
            const std::size_t next = (k + 1) % low.size();
            if (profile[i].radius > 0.0) add_polygon(std::array{low[k], low[next], high[k]});
            if (profile[i + 1].radius > 0.0)
                add_polygon(std::array{low[next], high[next], high[k]});
        }
    }
}

void FormBuilder::add_loft(std::span<const Polygon3> sections) {
    constexpr double kRound = 0.766;  // cosine of 40 degrees
    TriangleMesh tube;
    const auto count = static_cast<std::uint32_t>(sections.front().size());
    for (const Polygon3& section : sections)
        tube.positions.insert(tube.positions.end(), section.begin(), section.end());
    for (std::uint32_t i = 0; i + 1 < sections.size(); ++i) {
        for (std::uint32_t k = 0; k < count; ++k) {
            const std::uint32_t a = i * count + k, b = i * count + (k + 1) % count;
            tube.triangles.push_back({a, b, b + count});
            tube.triangles.push_back({a, b + count, a + count});
        }
    }
    const auto last = static_cast<std::uint32_t>(tube.positions.size()) - count;
    for (std::uint32_t k = 2; k < count; ++k) {
        tube.triangles.push_back({0, k, k - 1});
        tube.triangles.push_back({last, last + k - 1, last + k});
    }
    std::erase_if(tube.triangles, [&](const TriangleMesh::Triangle& t) {
        const auto is_same = [&](std::uint32_t i, std::uint32_t k) {
            return tube.positions[i] == tube.positions[k];
        };
        return is_same(t[0], t[1]) || is_same(t[1], t[2]) || is_same(t[2], t[0]);
    });
    add_mesh(with_crease_normals(tube, kRound));
}

void FormBuilder::add_mesh(const TriangleMesh& mesh) {
    std::vector<std::uint32_t> vertices;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
        vertices.push_back(add_vertex(mesh.positions[i], mesh.normals[i].cast<double>()));
    for (const TriangleMesh::Triangle& t : mesh.triangles)
        add_polygon(std::array{vertices[t[0]], vertices[t[1]], vertices[t[2]]});
}

void FormBuilder::mirror_since(std::size_t first) {
    TriangleMesh& mesh = model_.mesh;
    const std::size_t end = mesh.positions.size();
    for (std::size_t i = first; i < end; ++i) {
        Eigen::Vector3d position = mesh.positions[i];
        Eigen::Vector3f normal = mesh.normals[i];
        position.y() = -position.y();
        normal.y() = -normal.y();
        mesh.positions.push_back(position);
        mesh.normals.push_back(normal);
        mesh.colours.push_back(mesh.colours[i]);
        mesh.materials.push_back(mesh.materials[i]);
    }
    const auto shift = static_cast<std::uint32_t>(end - first);
    const std::size_t triangle_count = mesh.triangles.size();
    for (std::size_t i = 0; i < triangle_count; ++i) {
        const auto [a, b, c] = mesh.triangles[i];
        if (a >= first) mesh.triangles.push_back({a + shift, c + shift, b + shift});
    }
}

MeshModel FormBuilder::finish(
    const std::function<FormColour(const Eigen::Vector3d&, const Eigen::Vector3f&)>& tone) {
    TriangleMesh& mesh = model_.mesh;
    for (std::size_t i = 0; tone && i < mesh.positions.size(); ++i) {
        const FormColour factor = tone(mesh.positions[i], mesh.normals[i]);
        for (std::size_t k = 0; k < 3; ++k) {
            mesh.colours[i][k] = static_cast<std::uint8_t>(
                std::clamp(std::lround(factor[k] * mesh.colours[i][k]), 0L, 255L));
        }
    }
    model_.materials = form_materials();
    return std::move(model_);
}

}  // namespace terrane::tools
