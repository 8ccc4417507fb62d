// SPDX-License-Identifier: MIT
#include "scene/scene_cases.h"

#include "support/meshes.h"

#include <terrane/scene/culling.h>
#include <terrane/terrain/chunk.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace terrane::test {

View random_view(Random& random, const WorldPos& near_world) {
    View view;
    view.eye_world = near_world + random.between(0.0, 30.0) * random.direction();
    const Eigen::Matrix3d rotation = random.rotation();
    view.forward = rotation.col(0);
    view.up = rotation.col(1);
    view.vertical_fov = random.between(0.017, 2.97);
    view.width_px = 1 + random.below(2000);
    view.height_px = 1 + random.below(2000);
    return view;
}

bool is_shown(const View& view, const WorldPos& p_world, double far_distance) {
    const Eigen::Vector3d from_eye = p_world - view.eye_world;
    return view.forward.dot(from_eye) <= far_distance &&
           std::ranges::all_of(make_frustum(view).normals, [&](const Eigen::Vector3d& normal) {
               return normal.dot(from_eye) >= 0.0;
           });
}

std::optional<WorldPos> shown_point(Random& random, const View& view, const BoundingSphere& ball) {
    Eigen::Vector3d direction = random.direction();
    if (random.below(2) == 0) direction = (direction + Eigen::Vector3d(0, 0, 2)).normalized();
    const WorldPos p = ball.centre + ball.radius * direction;
    return is_shown(view, p) ? std::optional(p) : std::nullopt;
}

Eigen::Vector3d any_perpendicular(const Eigen::Vector3d& direction, Random& random) {
    for (;;) {
        const Eigen::Vector3d square = direction.cross(random.direction());
        if (square.norm() > 0.1) return square.normalized();
    }
}

OrientedBox random_box(Random& random, const WorldPos& centre_world, double size) {
    OrientedBox box;
    box.frame_from_box = {random.rotation(), centre_world};
    for (int axis = 0; axis < 3; ++axis)
        box.half_extents[axis] = random.below(8) == 0 ? 0.0 : random.between(0.0, size);
    return box;
}

Projection project_to_box(const OrientedBox& box) {
    return [box](const Eigen::Vector3d& p) -> Eigen::Vector3d {
        const Pose& pose = box.frame_from_box;
        const Eigen::Vector3d local = pose.rotation.transpose() * (p - pose.translation);
        return pose * Eigen::Vector3d(local.cwiseMax(-box.half_extents).cwiseMin(box.half_extents));
    };
}

Projection project_to_ball(const BoundingSphere& ball) {
    return [ball](const Eigen::Vector3d& p) -> Eigen::Vector3d {
        const Eigen::Vector3d apart = p - ball.centre;
        const double distance = apart.norm();
        return distance <= ball.radius
                   ? p
                   : Eigen::Vector3d(ball.centre + apart * (ball.radius / distance));
    };
}

// The nearest of the three edges' nearest points and of the projection to the plane.
Projection project_to_triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                               const Eigen::Vector3d& c) {
    return [corners = std::array<Eigen::Vector3d, 3>{a, b, c}](
               const Eigen::Vector3d& p) -> Eigen::Vector3d {
        Eigen::Vector3d best = corners[0];
        const auto take = [&](const Eigen::Vector3d& q) {
            if ((q - p).squaredNorm() < (best - p).squaredNorm()) best = q;
        };
        const Eigen::Vector3d normal =
            (corners[1] - corners[0]).cross(corners[2] - corners[0]).stableNormalized();
        const Eigen::Vector3d on_plane = p - normal * normal.dot(p - corners[0]);
        bool is_inside = normal.squaredNorm() > 0.5;
        for (std::size_t i = 0; i < 3; ++i) {
            const Eigen::Vector3d edge = corners[(i + 1) % 3] - corners[i];
            const double squared = edge.squaredNorm();
            const double share =
                squared > 0.0 ? std::clamp(edge.dot(p - corners[i]) / squared, 0.0, 1.0) : 0.0;
            take(corners[i] + share * edge);
            is_inside &= normal.dot(edge.cross(on_plane - corners[i])) >= 0.0;
        }
        if (is_inside) take(on_plane);
        return best;
    };
}

Projection project_to_view(const View& view, double far_distance) {
    struct HalfSpace {
        Eigen::Vector3d normal;
        double offset;
    };
    std::vector<HalfSpace> planes;
    for (const Eigen::Vector3d& normal : make_frustum(view).normals)
        planes.push_back({normal, normal.dot(view.eye_world)});
    if (std::isfinite(far_distance))
        planes.push_back({-view.forward, -view.forward.dot(view.eye_world) - far_distance});
    return [planes](const Eigen::Vector3d& p) -> Eigen::Vector3d {
        Eigen::Vector3d x = p;
        std::vector<Eigen::Vector3d> corrections(planes.size(), Eigen::Vector3d::Zero());
        for (int round = 0; round < 3000; ++round) {
            double moved = 0.0;
            for (std::size_t i = 0; i < planes.size(); ++i) {
                const Eigen::Vector3d y = x + corrections[i];
                const double at = planes[i].normal.dot(y) - planes[i].offset;
                const Eigen::Vector3d next = at < 0.0 ? y - planes[i].normal * at : y;
                corrections[i] = y - next;
                moved = std::max(moved, (next - x).norm());
                x = next;
            }
            if (moved < 1e-12) break;
        }
        return x;
    };
}

Apart are_apart(const Projection& a, const Projection& b, const Eigen::Vector3d& start) {
    Eigen::Vector3d p = start;
    double before = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 2000; ++i) {
        const Eigen::Vector3d q = a(p);
        p = b(q);
        const double distance = (p - q).norm();
        if (distance < 1e-9) return Apart::no;
        // Steps shrink geometrically at worst like the square of the iteration: far from 0 they are final.
        if (before - distance < 1e-10 * distance && distance > 1e-5) return Apart::yes;
        before = distance;
    }
    return Apart::unknown;
}

std::shared_ptr<const ResidentSet> resident_chunks(
    const HeightSource& source, int finest_level,
    const std::function<bool(const ChunkKey&)>& is_resident,
    const std::function<std::shared_ptr<const Chunk>(std::shared_ptr<const Chunk>)>& change) {
    const Lattice& lattice = source.lattice();
    std::vector<std::shared_ptr<const Chunk>> chunks;
    std::set<ChunkKey> keys;
    for (int level = 0; level <= finest_level; ++level) {
        const std::int32_t scale = 1 << level;
        for (std::int32_t j = 0; j < lattice.root_count_y * scale; ++j) {
            for (std::int32_t i = 0; i < lattice.root_count_x * scale; ++i) {
                const ChunkKey key = {lattice.first_root_x * scale + i,
                                      lattice.first_root_y * scale + j,
                                      static_cast<std::uint8_t>(level)};
                if (level > 0 && keys.count(key.parent()) == 0) continue;
                if (is_resident && !is_resident(key)) continue;
                keys.insert(key);
                std::shared_ptr<const Chunk> chunk = make_chunk(source, key).value();
                chunks.push_back(change ? change(std::move(chunk)) : std::move(chunk));
            }
        }
    }
    return std::make_shared<const ResidentSet>(lattice, source.extent(), std::move(chunks), 1);
}

MeshRays drawn_surface(const TerrainMesh& mesh) {
    const Lattice& lattice = mesh.resident->lattice();
    TriangleMesh triangles;
    for (const MeshChunk& part : mesh.chunks) {
        std::map<std::uint16_t, std::uint32_t> made;
        const auto vertex_of = [&](std::uint16_t sample) {
            const auto [place, is_new] =
                made.emplace(sample, static_cast<std::uint32_t>(triangles.positions.size()));
            if (is_new) {
                const Chunk& chunk = *part.chunk;
                triangles.positions.emplace_back(
                    lattice.x(chunk.corner.x + sample % kChunkSamples * chunk.step),
                    lattice.y(chunk.corner.y + sample / kChunkSamples * chunk.step),
                    part.displayed_height(sample, lattice.quantum));
            }
            return place->second;
        };
        for (std::uint32_t i = part.first_index; i < part.first_index + part.index_count; i += 3) {
            const std::uint32_t a = vertex_of(mesh.indices[i]);
            const std::uint32_t b = vertex_of(mesh.indices[i + 1]);
            const std::uint32_t c = vertex_of(mesh.indices[i + 2]);
            triangles.triangles.push_back({a, b, c});
        }
    }
    return MeshRays::create(triangles).value();
}

View view_along(const WorldPos& eye_world, const Eigen::Vector2d& direction, double slope,
                double roll) {
    View view;
    view.eye_world = eye_world;
    view.forward = Eigen::Vector3d(direction.x(), direction.y(), slope).normalized();
    const Eigen::Vector3d right = view.forward.cross(Eigen::Vector3d::UnitZ()).normalized();
    const Eigen::Vector3d up = right.cross(view.forward).normalized();
    view.up = (std::cos(roll) * up + std::sin(roll) * right).normalized();
    return view;
}

RockLevels make_rock_levels(int depth, std::uint64_t seed, bool has_impostor, bool morphs) {
    RockLevels rock;
    ProgressiveMesh mesh = ProgressiveMesh::create(make_rock(depth, seed)).value();
    rock.model.bounds = bounding_box(mesh.finest().positions);
    const double size = (rock.model.bounds.high - rock.model.bounds.low).norm();
    for (const double share : {0.0, 0.002, 0.005, 0.015}) {
        mesh.set_error(share * size);
        const auto level = static_cast<std::uint32_t>(rock.triangles.size());
        if (level > 0) rock.model.levels.back().morphs = morphs;
        rock.triangles.emplace_back(mesh.triangles().begin(), mesh.triangles().end());
        rock.model.levels.push_back(
            {share * size, static_cast<std::uint32_t>(rock.triangles.back().size()), level, false});
    }
    if (has_impostor) {
        rock.model.impostor = ImpostorId{0};
        rock.model.levels.push_back({.error_m = 0.03 * size, .triangles = 2, .is_impostor = true});
    }
    rock.model.absence_error_m = size;
    rock.model.continuous = std::make_shared<const ProgressiveMesh>(std::move(mesh));
    return rock;
}

double factor_of(const View& view, const ObjectModel& model, const PlacedObject& object) {
    const Eigen::Vector3d middle = 0.5 * (model.bounds.low + model.bounds.high);
    const auto scale = static_cast<double>(object.scale);
    const WorldPos centre = object.position + rotation_of(object) * (scale * middle);
    const double radius = 0.5 * scale * (model.bounds.high - model.bounds.low).norm();
    const double distance = (centre - view.eye_world).norm() - radius;
    return scale * view.pixels_per_radian() / std::max(distance, view.near_distance);
}

std::size_t object_of(const ObjectInstance& instance, const View& view,
                      std::span<const PlacedObject> objects) {
    const auto& [x, y, z] = instance.offset_eye;
    const WorldPos at = view.eye_world + Eigen::Vector3f(x, y, z).cast<double>();
    std::size_t nearest = objects.size();
    double least = 0.01;
    for (std::size_t i = 0; i < objects.size(); ++i) {
        const double apart = (objects[i].position - at).norm();
        if (!(apart < least)) continue;
        least = apart;
        nearest = i;
    }
    return nearest;
}

Eigen::Quaterniond rotation_of(const PlacedObject& object) {
    const auto& [x, y, z, w] = object.rotation;
    return Eigen::Quaternionf(w, x, y, z).cast<double>().normalized();
}

std::vector<std::byte> bits_of(const SceneDraws& draws) {
    std::vector<std::byte> bits;
    const auto add = [&](const auto& values) {
        const auto bytes = std::as_bytes(values);
        bits.insert(bits.end(), bytes.begin(), bytes.end());
    };
    add(draws.instances);
    add(draws.meshes);
    add(draws.impostors);
    for (const StreamedDraw& draw : draws.streamed) {
        add(draw.triangles);
        add(std::span(&draw.instance, 1));
    }
    return bits;
}

bool are_equal(std::span<const TriangleDemand> a, std::span<const TriangleDemand> b) {
    return std::ranges::equal(a, b, [](const TriangleDemand& one, const TriangleDemand& other) {
        return one.threshold_px == other.threshold_px && one.triangles == other.triangles;
    });
}

double random_threshold(Random& random, std::span<const TriangleDemand> demands, double low,
                        double high) {
    if (demands.empty() || random.below(2) != 0) return std::exp2(random.between(low, high));
    return demands[static_cast<std::size_t>(random.below(static_cast<int>(demands.size())))]
        .threshold_px;
}

std::size_t granted(std::span<const TriangleDemand> demands, double threshold_px) {
    std::size_t triangles = 0;
    for (const TriangleDemand& demand : demands)
        triangles += demand.threshold_px > threshold_px ? demand.triangles : 0;
    return triangles;
}

}  // namespace terrane::test
