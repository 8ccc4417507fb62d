// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/broadphase.h>
#include <terrane/collision/shapes.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace terrane::tools {

/// Moving bodies that pass through each other in a cubic room.
struct CrowdLayout {
    std::size_t count = 50;
    double detail =
        3.0;  ///< mean number of rings of corners between the poles; each body has 2 or more
    double detail_deviation = 1.0;  ///< standard deviation of it over the bodies
    double radius = 1.0;            ///< of the sphere through the corners, metres
    double share = 0.02;            ///< of the room's volume that the spheres take, 0 to 1
    double speed = 1.0;             ///< metres a second
    double spin = 1.0;              ///< radians a second
    BroadphaseKind broadphase = BroadphaseKind::sap;
    std::uint64_t seed = 1;
};

/// Result and cost of one query of all bodies.
struct CrowdQuery {
    double update_ms = 0.0;        ///< bounds and Broadphase::update()
    double query_ms = 0.0;         ///< pairs and their contact tests
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

private:
    struct Body {
        Shape shape;
        Pose pose;
        Eigen::Vector3d velocity;
        Eigen::Vector3d angular_velocity;
    };

    void place_bounds();

    double width_;  ///< of the room, metres
    double radius_;
    std::vector<Body> bodies_;
    std::size_t corner_count_ = 0;
    std::vector<Aabb> bounds_;
    std::vector<BoundingSphere> balls_;
    std::unique_ptr<Broadphase> broadphase_;
};

}  // namespace terrane::tools
