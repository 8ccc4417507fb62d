// SPDX-License-Identifier: MIT
#include "view/marks.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <unordered_set>

namespace terrane::tools {
namespace {

constexpr float kOpacity = 0.45f;
constexpr double kNearPlane = 0.05;  // metres before the eye at which lines are cut

// A hue from 0 (blue) to 1 (red).
Colour warmth(double share) {
    const double s = std::clamp(share, 0.0, 1.0);
    const auto part = [](double centre, double at) {
        return static_cast<float>(std::clamp(1.5 - 4.0 * std::abs(at - centre), 0.0, 1.0));
    };
    return {part(0.75, s), part(0.5, s), part(0.25, s)};
}

// A colour from the hash of a chunk's key.
Colour colour_of(const ChunkKey& key) {
    const std::size_t hash = ChunkKeyHash()(key);
    const auto part = [hash](int shift) {
        return 0.2f + 0.8f * static_cast<float>(hash >> shift & 255) / 255.0f;
    };
    return {part(0), part(8), part(16)};
}

// Least distance of a point from a square of the ground and a range of heights.
double distance_to(const WorldPos& eye, const Aabb& box) {
    const Eigen::Vector3d nearest = eye.cwiseMax(box.low).cwiseMin(box.high);
    return (nearest - eye).norm();
}

Aabb box_of_quadrant(const Lattice& lattice, const Chunk& chunk, int quadrant) {
    const std::int64_t half = kChunkCells / 2 * chunk.step;
    const std::int64_t x = chunk.corner.x + (quadrant & 1) * half;
    const std::int64_t y = chunk.corner.y + (quadrant >> 1) * half;
    return {{lattice.x(x), lattice.y(y), lattice.quantum * chunk.low},
            {lattice.x(x + half), lattice.y(y + half), lattice.quantum * chunk.high}};
}

using Keys = std::unordered_set<ChunkKey, ChunkKeyHash>;

Keys keys_of(const TerrainMesh& mesh) {
    Keys keys;
    for (const MeshChunk& chunk : mesh.chunks)
        if (chunk.index_count > 0) keys.insert(chunk.chunk->key);
    return keys;
}

// The error of the quarters of a chunk that no finer chunk of the mesh draws, pixels.
double undrawn_error_px(const TerrainMesh& mesh, const Keys& drawn, const MeshChunk& chunk,
                        const View& view, bool only_late) {
    const Lattice& lattice = mesh.resident->lattice();
    double most = 0.0;
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
        const ChunkKey child = chunk.chunk->key.child(quadrant);
        if (drawn.contains(child)) continue;
        const bool is_absent = chunk.chunk->key.level < lattice.finest_level &&
                               mesh.resident->find_chunk(child) == nullptr;
        if (only_late && !is_absent) continue;
        const double distance =
            std::max(view.near_distance,
                     distance_to(view.eye_world, box_of_quadrant(lattice, *chunk.chunk, quadrant)));
        const auto bound =
            static_cast<double>(chunk.chunk->quadrant_bound[static_cast<std::size_t>(quadrant)]);
        most = std::max(most, view.pixels_per_radian() * bound / distance);
    }
    return most;
}

double threshold_error_px(const TerrainMesh& mesh, double morph_ratio) {
    return 2.0 * morph_ratio / (morph_ratio + 1.0) * mesh.threshold_px;
}

}  // namespace

double chunk_error_px(const TerrainMesh& mesh, const MeshChunk& chunk, const View& view,
                      double morph_ratio) {
    return threshold_error_px(mesh, morph_ratio) +
           undrawn_error_px(mesh, keys_of(mesh), chunk, view, false);
}

std::function<GroundMark(const MeshChunk&)> ground_marks(GroundColours colours,
                                                         const TerrainMesh& mesh, const View& view,
                                                         double max_error_px, double morph_ratio) {
    const bool has_marks = colours != GroundColours::none && colours != GroundColours::materials;
    if (!has_marks || mesh.resident == nullptr) return nullptr;
    if (colours == GroundColours::chunks) {
        return [](const MeshChunk& chunk) {
            return GroundMark{colour_of(chunk.chunk->key), kOpacity};
        };
    }
    if (colours == GroundColours::levels) {
        const double finest = std::max(1, mesh.resident->lattice().finest_level);
        return [finest](const MeshChunk& chunk) {
            return GroundMark{warmth(chunk.chunk->key.level / finest), kOpacity};
        };
    }
    const auto drawn = std::make_shared<const Keys>(keys_of(mesh));
    if (colours == GroundColours::late) {
        return [drawn, &mesh, view, max_error_px](const MeshChunk& chunk) {
            const bool is_late = undrawn_error_px(mesh, *drawn, chunk, view, true) > max_error_px;
            return GroundMark{{1.0f, 0.1f, 0.1f}, is_late ? kOpacity : 0.0f};
        };
    }
    const double shared = threshold_error_px(mesh, morph_ratio);
    const double most = std::max(mesh.error_px, max_error_px);
    return [drawn, &mesh, view, most, shared](const MeshChunk& chunk) {
        const double error = shared + undrawn_error_px(mesh, *drawn, chunk, view, false);
        return GroundMark{warmth(error / most), kOpacity};
    };
}

namespace {

// Distance along a ray to a triangle from either side (T. Moeller, B. Trumbore, 1997); none if it misses.
std::optional<double> distance_to(const WorldPos& from, const Eigen::Vector3d& along,
                                  const std::array<WorldPos, 3>& corners) {
    constexpr double kEdge = 1e-9;  // of a side, so that a ray between two triangles hits one
    const auto cross = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
        return Eigen::Vector3d(a.y() * b.z() - a.z() * b.y(), a.z() * b.x() - a.x() * b.z(),
                               a.x() * b.y() - a.y() * b.x());
    };
    const Eigen::Vector3d one = corners[1] - corners[0], other = corners[2] - corners[0];
    const Eigen::Vector3d across = cross(along, other);
    const double area = one.dot(across);
    if (area == 0.0) return std::nullopt;
    const Eigen::Vector3d start = from - corners[0];
    const double u = start.dot(across) / area;
    const Eigen::Vector3d turned = cross(start, one);
    const double v = along.dot(turned) / area;
    if (u < -kEdge || v < -kEdge || u + v > 1.0 + kEdge) return std::nullopt;
    const double t = other.dot(turned) / area;
    return t > 0.0 ? std::optional(t) : std::nullopt;
}

}  // namespace

std::optional<MeshHit> first_on_mesh(const TerrainMesh& mesh, const WorldPos& from_world,
                                     const Eigen::Vector3d& along, double most_distance) {
    double nearest = most_distance;
    MeshHit hit;
    const auto meet = [&](const std::array<WorldPos, 3>& corners, const Chunk* drawn,
                          const MeshChunk* ground) {
        const std::optional<double> t = distance_to(from_world, along, corners);
        if (!t || *t > nearest) return;
        nearest = *t;
        hit = {from_world + nearest * along, drawn, ground};
    };
    for (const MeshChunk& drawn : mesh.chunks) {
        const Chunk& chunk = *drawn.chunk;
        const Lattice& lattice = mesh.resident->lattice();
        const double west = lattice.x(chunk.corner.x), south = lattice.y(chunk.corner.y);
        const double step = lattice.spacing * static_cast<double>(chunk.step);
        const auto corner = [&](std::uint16_t sample) {
            const int column = sample % kChunkSamples, row = sample / kChunkSamples;
            return WorldPos(west + step * column, south + step * row,
                            drawn.displayed_height(sample, lattice.quantum));
        };
        for (std::uint32_t i = 0; i < drawn.index_count; i += 3) {
            const std::uint16_t* const t = &mesh.indices[drawn.first_index + i];
            meet({corner(t[0]), corner(t[1]), corner(t[2])}, &chunk, &drawn);
        }
    }
    for (const MeshSolid& solid : mesh.solids) {
        const auto& vertices = solid.chunk->solid->triangles().vertices_world;
        const auto meet_all = [&](MeshSolid::Triangles triangles) {
            for (const auto& t : triangles)
                meet({vertices[t[0]], vertices[t[1]], vertices[t[2]]}, solid.chunk, nullptr);
        };
        meet_all(solid.triangles);
        for (const MeshSolid::Triangles& cap : solid.caps) meet_all(cap);
    }
    return hit.chunk != nullptr ? std::optional(hit) : std::nullopt;
}

const Chunk* finest_chunk_at(const ResidentSet& resident, const WorldVec2& place_world) {
    const Lattice& lattice = resident.lattice();
    const auto root = [&](double from_origin) {
        return static_cast<std::int32_t>(std::floor(from_origin / lattice.root_size()));
    };
    const double east = place_world.x() - lattice.origin_x;
    const double north = place_world.y() - lattice.origin_y;
    // beyond the numbers of root squares
    if (!(std::max(std::abs(east), std::abs(north)) / lattice.root_size() < 0x1p31)) return nullptr;
    ChunkKey key{root(east), root(north), 0};
    const Chunk* finest = resident.find_chunk(key);
    for (const Chunk* next = finest; next != nullptr; next = resident.find_chunk(key)) {
        finest = next;
        if (key.level == lattice.finest_level) break;
        const double half = 0.5 * kChunkCells * lattice.level_spacing(key.level);
        const int quadrant = (east >= (2.0 * key.x + 1.0) * half ? 1 : 0) |
                             (north >= (2.0 * key.y + 1.0) * half ? 2 : 0);
        key = key.child(quadrant);
    }
    return finest;
}

LineProjector::LineProjector(const View& view) : view_(view), right_(view.right()) {}

Eigen::Vector3d LineProjector::in_eye(const WorldPos& p_world) const {
    const Eigen::Vector3d p = p_world - view_.eye_world;
    return {p.dot(right_), p.dot(view_.up), p.dot(view_.forward)};
}

std::array<double, 2> LineProjector::on_picture(const Eigen::Vector3d& p_eye) const {
    const double scale = view_.pixels_per_radian() / p_eye.z();
    return {0.5 * view_.width_px + scale * p_eye.x(), 0.5 * view_.height_px - scale * p_eye.y()};
}

std::optional<std::array<double, 2>> LineProjector::place_of(const WorldPos& p_world) const {
    const Eigen::Vector3d p = in_eye(p_world);
    if (!(p.z() > kNearPlane)) return std::nullopt;
    return on_picture(p);
}

void LineProjector::add(const WorldPos& from_world, const WorldPos& to_world,
                        const std::array<float, 3>& colour,
                        std::vector<PictureLine>& lines_out) const {
    Eigen::Vector3d from = in_eye(from_world), to = in_eye(to_world);
    if (!(from.z() > kNearPlane || to.z() > kNearPlane)) return;
    const auto cut = [](Eigen::Vector3d& end, const Eigen::Vector3d& other) {
        if (end.z() >= kNearPlane) return;
        end += (kNearPlane - end.z()) / (other.z() - end.z()) * (other - end);
    };
    cut(from, to);
    cut(to, from);
    const std::array<double, 2> a = on_picture(from), b = on_picture(to);
    // beyond this the coordinates lose their pixels
    constexpr double kMost = 1e5;
    for (const double part : {a[0], a[1], b[0], b[1]})
        if (!(std::abs(part) < kMost)) return;
    lines_out.push_back({{static_cast<float>(a[0]), static_cast<float>(a[1]),
                          static_cast<float>(b[0]), static_cast<float>(b[1])},
                         colour});
}

namespace {

using Rgb = std::array<float, 3>;

void add_box(const Pose& pose, const Aabb& box, const Rgb& colour, const LineProjector& projector,
             std::vector<PictureLine>& lines_out) {
    const auto corner = [&](int number) {
        return WorldPos(pose * Eigen::Vector3d((number & 1) != 0 ? box.high.x() : box.low.x(),
                                               (number & 2) != 0 ? box.high.y() : box.low.y(),
                                               (number & 4) != 0 ? box.high.z() : box.low.z()));
    };
    for (int from = 0; from < 8; ++from)
        for (const int bit : {1, 2, 4})
            if ((from & bit) == 0)
                projector.add(corner(from), corner(from | bit), colour, lines_out);
}

void add_circle(const WorldPos& centre, double radius, const Rgb& colour,
                const LineProjector& projector, std::vector<PictureLine>& lines_out) {
    constexpr int kPieces = 24;
    constexpr double kTurn = 6.283185307179586 / kPieces;
    const auto at = [&](int i) {
        return WorldPos(centre +
                        radius * Eigen::Vector3d(std::cos(kTurn * i), std::sin(kTurn * i), 0.0));
    };
    for (int i = 0; i < kPieces; ++i) projector.add(at(i), at(i + 1), colour, lines_out);
}

}  // namespace

void add_body_marks(const World& world, std::span<const BodyNeed> needs, const BodyMarks& marks,
                    const LineProjector& projector, std::vector<PictureLine>& lines_out) {
    constexpr Rgb kNormal{1.0f, 0.9f, 0.1f}, kImpulse{1.0f, 0.25f, 0.1f};
    constexpr Rgb kAwake{0.2f, 0.9f, 0.3f}, kAsleep{0.6f, 0.6f, 0.6f}, kNeed{0.2f, 0.7f, 1.0f};
    constexpr double kNormalLength = 0.5;       // metres
    constexpr double kMetresPerImpulse = 2e-3;  // m / (N s)
    constexpr double kMostLength = 5.0;         // metres
    if (marks.contacts) {
        for (const ContactEvent& event : world.contact_events()) {
            const std::span<const ContactPoint> points = world.contact_points(event);
            for (const ContactPoint& point : points) {
                projector.add(point.point_world, point.point_world + kNormalLength * point.normal,
                              kNormal, lines_out);
            }
            const double size = event.impulse.norm();
            if (points.empty() || !(size > 0.0)) continue;
            const double length = std::min(kMetresPerImpulse * size, kMostLength);
            projector.add(points.front().point_world,
                          points.front().point_world + length / size * event.impulse, kImpulse,
                          lines_out);
        }
    }
    if (marks.bounds) {
        const std::span<const BodyState> states = world.states();
        for (std::size_t i = 0; i < states.size(); ++i) {
            const BodyState& state = states[i];
            if (state.condition == BodyCondition::removed) continue;
            const Shape& shape = world.settings()[i].shape;
            const bool sleeps = state.condition == BodyCondition::asleep;
            Aabb box;
            for (int axis = 0; axis < 3; ++axis) {
                box.high[axis] = support_distance(shape, Eigen::Vector3d::Unit(axis));
                box.low[axis] = -support_distance(shape, -Eigen::Vector3d::Unit(axis));
            }
            add_box(state.pose, box, sleeps ? kAsleep : kAwake, projector, lines_out);
        }
    }
    if (marks.needs) {
        for (const BodyNeed& need : needs) {
            add_circle(need.centre_world, need.radius, kNeed, projector, lines_out);
            projector.add(need.centre_world, need.centre_world + need.velocity, kNeed, lines_out);
        }
    }
}

}  // namespace terrane::tools
