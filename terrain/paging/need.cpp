// SPDX-License-Identifier: MIT
#include "need.h"

#include <terrane/terrain/assert.h>

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

constexpr double kGravity = 9.81;
// Places on a client's way within the horizon that are looked at, the present one first.
constexpr int kPlaces = 5;

struct Box {
    Eigen::Vector3d low;
    Eigen::Vector3d high;
};

double distance_to(const Box& box, const Eigen::Vector3d& point) {
    const Eigen::Vector3d outside =
        (box.low - point).cwiseMax(point - box.high).cwiseMax(Eigen::Vector3d::Zero());
    return outside.norm();
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

}  // namespace terrane::internal
