// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/broadphase.h>
#include <terrane/collision/shapes.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace terrane::tools {

/// Many bodies that fly through each other in a closed room.
struct CrowdLayout {
    std::size_t count = 50;
    double detail = 3.0;  ///< rings of corners of a body between its poles, mean; at least 2 each
    double detail_deviation = 1.0;  ///< of the same over the bodies
    double radius = 1.0;            ///< of the ball that the corners lie on, metres
    double share = 0.02;            ///< of the room that the balls take, 0 to 1
    double speed = 1.0;             ///< metres a second
    double spin = 1.0;              ///< radians a second
    BroadphaseKind broadphase = BroadphaseKind::sap;
    std::uint64_t seed = 1;
};

/// What one look at all bodies found and cost.
struct CrowdQuery {
    double update_ms = 0.0;        ///< bounds, and the broadphase's order
    double query_ms = 0.0;         ///< pairs, and which of them touch
    std::size_t pairs = 0;         ///< whose boxes overlap
    std::size_t touching = 0;      ///< of them
    std::uint64_t candidates = 0;  ///< pairs that the broadphase compared
};

/// Sphere-like polyhedra, each with its own rings of 2 x detail corners, that move straight, turn evenly, and
/// are thrown back by the walls of a cube.
///
/// The same layout gives the same poses and counts, run after run.
class Crowd {
public:
    explicit Crowd(const CrowdLayout& layout);

    /// Moves all bodies by a time, seconds.
    void move(double dt);
    /// Finds which bodies touch.
    CrowdQuery query();

    /// Corners of all bodies together.
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
