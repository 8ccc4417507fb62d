// SPDX-License-Identifier: MIT
//
// Fades. With fade f a vertex of screen error p counts as f p. It shows none of itself up to the
// threshold t, and above it the share W (1 - t / (f p)), at most all, W = w / (w - 1) for the morph
// ratio w. So it moves by at most W t d pixels when 1 / f changes by d, whatever p and f are: 1 / f is
// what changes evenly, and t / f is the screen error that is still held back.
#include "need.h"

#include <terrane/terrain/assert.h>

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr double kGravity = 9.81;
// Places on a client's way within the horizon that are looked at, the present one first.
constexpr int kPlaces = 5;

// A relative step of a priority at the threshold moves a vertex by so many thresholds: see lod/morph.h.
constexpr double kMorphGain =
    2.0 * kDefaultMorphRatio * kDefaultMorphRatio / (kDefaultMorphRatio * kDefaultMorphRatio - 1.0);
// What fading may move in one update while little is held back. With 1.5 pixels held back at a
// threshold of 0.2 the rest takes 43 updates.
constexpr double kMostMove_px = 0.25;
// No frame promises anything while more than this is held back: its error is larger. Then a share goes
// in each update, or a chunk that came late would stay away for too long. From 20 pixels: 30 updates.
constexpr double kPromised_px = 1.5;
constexpr double kLateShare = 1.0 / 12.0;
// Movements of points closer than this many ways of the eye do not count.
constexpr double kNearWays = 10.0;
constexpr double kLargestRatio = 1e9;

struct Box {
    Eigen::Vector3d low;
    Eigen::Vector3d high;
};

double distance_to(const Box& box, const Eigen::Vector3d& point) {
    const Eigen::Vector3d outside =
        (box.low - point).cwiseMax(point - box.high).cwiseMax(Eigen::Vector3d::Zero());
    return outside.norm();
}

double farthest_from(const Box& box, const Eigen::Vector3d& point) {
    const Eigen::Vector3d corner =
        (box.low - point).cwiseAbs().cwiseMax((box.high - point).cwiseAbs());
    return corner.norm();
}

// False where the box lies beside one of the side planes.
bool may_hold(const Frustum& frustum, const WorldPos& eye, const Box& box) {
    for (const Eigen::Vector3d& normal : frustum.normals) {
        // the corner that lies furthest in
        const Eigen::Vector3d corner(normal.x() > 0.0 ? box.high.x() : box.low.x(),
                                     normal.y() > 0.0 ? box.high.y() : box.low.y(),
                                     normal.z() > 0.0 ? box.high.z() : box.low.z());
        if (normal.dot(corner - eye) < 0.0) return false;
    }
    return true;
}

WorldRect rect_of(const Lattice& lattice, const ChunkKey& key) {
    const LatticePoint corner = lattice.corner(key);
    const std::int64_t side = lattice.chunk_side(key.level);
    return {lattice.x(corner.x), lattice.y(corner.y), lattice.x(corner.x + side),
            lattice.y(corner.y + side)};
}

// Screen error that a camera would see from a place, were the chunk absent.
double error_px_from(const Camera& camera, const Eigen::Vector3d& place, const Box& box,
                     double bound) {
    const double distance = std::max(camera.need.view.near_distance, distance_to(box, place));
    const double error = bound * camera.pixels_per_radian / distance;
    // what lies beside the view is wanted too, but a camera must turn before it counts in full
    const Eigen::Vector3d middle = 0.5 * (box.low + box.high);
    const double radius = 0.5 * (box.high - box.low).norm();
    double beside = 0.0;
    for (const Eigen::Vector3d& normal : camera.frustum.normals) {
        beside = std::max(beside, -(normal.dot(middle - place) + radius));
    }
    return error * std::clamp(1.0 - 2.0 * beside / (distance + beside), 0.125, 1.0);
}

Need camera_need(const Camera& camera, const Box& box, double bound, double horizon) {
    Need need;
    for (int i = 0; i < kPlaces; ++i) {
        const double t = horizon * i / (kPlaces - 1);
        const Eigen::Vector3d place = camera.need.view.eye_world + t * camera.need.velocity;
        const double error = error_px_from(camera, place, box, bound);
        if (error <= camera.need.threshold_px) continue;
        const Need here{i == 0 ? NeedClass::drawn : NeedClass::predicted, error};
        if (here.goes_before(need)) need = here;
        if (i == 0) break;
    }
    return need;
}

// Bound over distance, at most, of the vertices of a chunk: the distance is to a box around the vertex
// that holds its descendants.
double largest_angle(const Lattice& lattice, const Chunk& chunk, const View& view) {
    // half the width of the box: s + s / 2 + s / 2 + s / 4 + ... for a spacing of s
    const double across = 3.0 * lattice.level_spacing(chunk.key.level);
    const std::int64_t side = kAreaCells * chunk.step;
    double largest = 0.0;
    for (int i = 0; i < kChunkAreas * kChunkAreas; ++i) {
        const Chunk::Area& area = chunk.areas[static_cast<std::size_t>(i)];
        const std::int64_t west = chunk.corner.x + i % kChunkAreas * side;
        const std::int64_t south = chunk.corner.y + i / kChunkAreas * side;
        const HeightInterval reach = chunk.reach_of_area(i);
        const Box box{
            {lattice.x(west) - across, lattice.y(south) - across, reach.low},
            {lattice.x(west + side) + across, lattice.y(south + side) + across, reach.high}};
        const double distance = std::max(view.near_distance, distance_to(box, view.eye_world));
        largest = std::max(largest, static_cast<double>(area.max_vertex_bound) / distance);
    }
    return largest;
}

// How far 1 / fade may move in one update for one camera.
double fade_step(double threshold_px, double inverse_fade) {
    const double even = kMostMove_px / (kMorphGain * threshold_px);
    if (threshold_px * inverse_fade <= kPromised_px) return even;
    return std::max(even, kLateShare * inverse_fade);
}

// When a body may first touch the box; nothing where it passes beside or above.
Need body_need(const BodyNeed& body, const Box& box, double horizon) {
    const double speed = body.velocity.norm();
    // a piece of the way at a time, each as a ball that holds it
    const int pieces =
        std::clamp(static_cast<int>(std::ceil(speed * horizon /
                                              (0.5 * (box.high.x() - box.low.x()) + body.radius))),
                   1, 256);
    for (int i = 0; i < pieces; ++i) {
        const double begin = horizon * i / pieces;
        const double end = horizon * (i + 1) / pieces;
        const double middle = 0.5 * (begin + end);
        const Eigen::Vector3d centre = body.centre_world + middle * body.velocity;
        // falling may take it off the straight line
        const double reach = body.radius + 0.5 * (end - begin) * speed + 0.5 * kGravity * end * end;
        if (distance_to(box, centre) <= reach) return {NeedClass::contact, -begin};
    }
    return {};
}

}  // namespace

bool overlaps(const Lattice& lattice, const ChunkKey& key, const WorldRect& rect) {
    const WorldRect own = rect_of(lattice, key);
    return own.west <= rect.east && own.east >= rect.west && own.south <= rect.north &&
           own.north >= rect.south;
}

Need child_need(const Lattice& lattice, const Chunk& chunk, int quadrant, const Clients& clients,
                int contact_level, double horizon) {
    TERRANE_ASSERT(chunk.key.level < lattice.finest_level, "the finest chunks have no children");
    const ChunkKey key = chunk.key.child(quadrant);
    const auto bound =
        static_cast<double>(chunk.quadrant_bound[static_cast<std::size_t>(quadrant)]);
    const WorldRect rect = rect_of(lattice, key);
    // the surface over the child, and a cell around for what only touches it
    const double margin = lattice.level_spacing(key.level);
    const Box box{{rect.west - margin, rect.south - margin, lattice.quantum * chunk.low - bound},
                  {rect.east + margin, rect.north + margin, lattice.quantum * chunk.high + bound}};

    Need need;
    const auto take = [&](const Need& other) {
        if (other.goes_before(need)) need = other;
    };
    if (key.level <= contact_level) {
        for (const RegionNeed& region : clients.regions) {
            if (overlaps(lattice, key, region.region)) {
                take({NeedClass::contact, -std::max(0.0, region.deadline_s - clients.time_s)});
            }
        }
        // bodies under the ground need it as well
        Box column = box;
        column.low.z() = -1e12;
        for (const BodyNeed& body : clients.bodies) take(body_need(body, column, horizon));
    }
    for (const Camera& camera : clients.cameras) take(camera_need(camera, box, bound, horizon));
    return need;
}

Watch watch(const Lattice& lattice, const Chunk& chunk, const Clients& clients,
            double inverse_fade) {
    // a vertex moves the surface up to a cell around it
    const double margin = lattice.level_spacing(chunk.key.level);
    const auto bound = static_cast<double>(chunk.max_vertex_bound);
    const WorldRect rect = rect_of(lattice, chunk.key);
    const Box box{{rect.west - margin, rect.south - margin, lattice.quantum * chunk.low - bound},
                  {rect.east + margin, rect.north + margin, lattice.quantum * chunk.high + bound}};
    Watch seen;
    for (const Camera& camera : clients.cameras) {
        const View& view = camera.need.view;
        if (!camera.before) continue;
        const double way = (view.eye_world - camera.before->eye_world).norm();
        if (farthest_from(box, view.eye_world) < kNearWays * way) continue;
        if (!may_hold(camera.frustum, view.eye_world, box) ||
            !may_hold(camera.before->frustum, camera.before->eye_world, box)) {
            continue;
        }
        constexpr double kWider = 1.001;  // for the rounding of those who draw
        const double error_px =
            kWider * camera.pixels_per_radian * largest_angle(lattice, chunk, view);
        const double threshold_px = camera.need.threshold_px;
        const double step = fade_step(threshold_px, inverse_fade);
        seen.step = seen.ratio > 0.0 ? std::min(seen.step, step) : step;
        seen.ratio = std::max(seen.ratio, std::min(kLargestRatio, error_px / threshold_px));
    }
    return seen;
}

}  // namespace terrane::internal
