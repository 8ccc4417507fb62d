// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/broadphase.h>
#include <terrane/collision/shapes.h>

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

namespace terrane::tools {

/// How a crowd finds the pairs of bodies that may touch: the library's broadphases, and those of the published study.
enum class CrowdScheme {
    sap,   ///< BroadphaseKind::sap
    grid,  ///< BroadphaseKind::grid
    two_scene,  ///< sweep-and-prune of cubes that hold a body at any rotation; boxes of the pairs found only
    brute,   ///< BroadphaseKind::brute
    hashed,  ///< a hashed grid: cells as wide as the mean distance of the bodies
    dense,   ///< the published dense grid: 40^3 cells, all cleared in each update
};

/// `sap`, `grid`, `two-scene`, `brute`, `hashed` or `dense`.
std::string_view to_string(CrowdScheme scheme);

/// Moving bodies that pass through each other in a cubic room.
struct CrowdLayout {
    std::size_t count = 50;
    double detail =
        3.0;  ///< mean number of rings of corners between the poles; each body has 2 or more
    double detail_deviation = 1.0;  ///< standard deviation of it: uniform over the bodies
    double radius = 1.0;            ///< of the sphere through the corners, metres
    /// Largest over smallest of 100 radii in equal ratios around `radius`.
    double size_spread = 1.0;
    /// Bodies of at least a radius are as many as radius^-size_power: 0 for equal numbers of each of the radii, 2.5 for
    /// fragments (J. Dohnanyi. Collisional model of asteroids and their debris. 1969).
    double size_power = 0.0;
    double aspect = 1.0;     ///< length over width of a body
    bool is_dented = false;  ///< bodies are not convex
    double room = 0.0;       ///< width of the room, metres; 0: by `share`
    double share = 0.02;     ///< of the room's volume that the spheres take, 0 to 1
    double speed = 1.0;      ///< metres a second
    double spin = 1.0;       ///< radians a second
    CrowdScheme scheme = CrowdScheme::sap;
    std::uint64_t seed = 1;
};

/// Result and cost of one query of all bodies.
struct CrowdQuery {
    double boxes_ms = 0.0;         ///< axis-aligned boxes, or cubes, of all bodies
    double update_ms = 0.0;        ///< Broadphase::update(), without the boxes
    double query_ms = 0.0;         ///< pairs and their contact tests
    std::size_t boxes = 0;         ///< exact boxes that were computed
    std::size_t pairs = 0;         ///< with overlapping boxes
    std::size_t touching = 0;      ///< pairs in contact
    std::uint64_t candidates = 0;  ///< pairs that the broadphase compared
};

/// Sphere-like polyhedra with rings of 2 x detail corners that move at constant velocity and angular velocity and
/// bounce off the walls of a cube.
///
/// The same layout gives the same poses and counts in every run.
class Crowd {
public:
    explicit Crowd(const CrowdLayout& layout);

    /// Advances all bodies by dt seconds.
    void move(double dt);
    /// Finds the touching pairs of bodies.
    CrowdQuery query();

    /// Total number of corners of all bodies.
    std::size_t corner_count() const { return corner_count_; }
    /// Width of the room, metres.
    double width() const { return width_; }

private:
    struct Body {
        Shape shape;
        double radius;  ///< of the sphere through the corners, metres
        Pose pose;
        Eigen::Vector3d velocity;
        Eigen::Vector3d angular_velocity;
    };

    void place_bodies(const CrowdLayout& layout);
    void place_bounds();
    void place_cubes();
    const Aabb& exact_box(std::uint32_t body, CrowdQuery& query);
    bool do_boxes_overlap(const BodyPair& pair, CrowdQuery& query);

    double width_ = 0.0;  ///< of the room, metres
    bool is_two_scene_;
    std::vector<Body> bodies_;
    std::size_t corner_count_ = 0;
    std::vector<Aabb> bounds_;  ///< boxes of the bodies; cubes of their spheres for two scenes
    std::vector<BoundingSphere> balls_;
    std::vector<Aabb> exact_;                    ///< of two scenes
    std::vector<std::uint64_t> exact_in_query_;  ///< the query that exact_ was computed in
    std::uint64_t query_count_ = 0;
    std::unique_ptr<Broadphase> broadphase_;
};

}  // namespace terrane::tools
