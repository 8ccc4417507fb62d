// SPDX-License-Identifier: MIT
#pragma once

#include "lab/measure.h"

#include <terrane/collision/broadphase.h>
#include <terrane/collision/shapes.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace terrane::tools {

/// Cells of the dense grid along each axis of its room.
inline constexpr std::size_t kDenseCells = 40;

/// Broadphases of a crowd: the library's, the published study's, and variants of those.
enum class CrowdScheme {
    sap,        ///< BroadphaseKind::sap
    grid,       ///< BroadphaseKind::grid
    two_scene,  ///< BroadphaseKind::two_scene, of cubes that contain a body at any rotation
    brute,      ///< compares every pair of boxes
    hashed,     ///< a hashed grid with cells as wide as the mean distance between bodies
    dense,  ///< a dense grid of 40^3 cells, all cleared in each update; a body is in every cell of its box
    centroid,  ///< the published dense grid: a body is in the cell of its centre; compares bounding spheres
};

/// The schemes in order.
inline constexpr std::array kCrowdSchemes{
    CrowdScheme::sap,    CrowdScheme::grid,  CrowdScheme::two_scene, CrowdScheme::brute,
    CrowdScheme::hashed, CrowdScheme::dense, CrowdScheme::centroid};

/// `sap`, `grid`, `two-scene`, `brute`, `hashed`, `dense` or `centroid`.
std::string_view to_string(CrowdScheme scheme);

/// Whether a scheme is given the cubes around the bodies' bounding spheres instead of their boxes.
constexpr bool is_of_cubes(CrowdScheme scheme) {
    return scheme == CrowdScheme::two_scene || scheme == CrowdScheme::centroid;
}

/// Makes a scheme's broadphase for bodies in a room, the cube from the origin to `width` along each axis, metres.
/// Bodies outside are found too, but slowly by `hashed`, `dense` and `centroid`. Its pairs are those of overlapping
/// bounds; of `centroid`, those of overlapping spheres in cubes.
std::unique_ptr<Broadphase> make_scheme(CrowdScheme scheme, double width, std::size_t body_count);

/// Moving bodies that pass through each other in a cubic room.
struct CrowdLayout {
    std::size_t count = 50;
    double detail =
        3.0;  ///< mean number of rings of corners between the poles; each body has 2 or more
    double detail_deviation =
        1.0;  ///< standard deviation of this number, which is uniformly distributed over the bodies
    double radius = 1.0;  ///< of the sphere through the corners, metres
    /// Ratio of the largest to the smallest of 100 radii in geometric progression around `radius`.
    double size_spread = 1.0;
    /// The number of bodies of at least some radius is proportional to radius^-size_power: 0 gives equal numbers of
    /// each radius, 2.5 the sizes of fragments (J. Dohnanyi. Collisional model of asteroids and their debris. 1969).
    double size_power = 0.0;
    double aspect = 1.0;     ///< length over width of a body
    bool is_dented = false;  ///< whether bodies are not convex
    double room = 0.0;       ///< width of the room, metres; 0: determined by `share`
    double share = 0.02;     ///< share of the room's volume filled by the spheres, 0 to 1
    double speed = 1.0;      ///< metres a second
    double spin = 1.0;       ///< radians a second
    CrowdScheme scheme = CrowdScheme::sap;
    std::uint64_t seed = 1;
};

/// Sums over one or more queries of a crowd.
struct CrowdTotals {
    std::size_t queries = 0;
    std::size_t positive_queries = 0;  ///< with at least one touching pair
    double query_ms = 0.0;             ///< time of finding pairs and testing them for contact
    double positive_ms = 0.0;          ///< time of the positive queries
    double boxes_ms = 0.0;     ///< time of the boxes of all bodies, or their cubes: is_of_cubes()
    double update_ms = 0.0;    ///< time of Broadphase::update(), without the boxes
    std::size_t boxes = 0;     ///< exact boxes that were computed
    std::size_t pairs = 0;     ///< pairs with overlapping boxes; of `centroid`, spheres
    std::size_t touching = 0;  ///< pairs in contact
    std::uint64_t candidates = 0;  ///< pairs that the broadphase compared

    void add(const CrowdTotals& other);
    /// The mean of a sum over the queries; 0 without queries.
    double mean(auto sum) const { return ratio_or_zero(sum, queries); }
    double mean_query_ms() const { return mean(query_ms); }
    double mean_boxes_ms() const { return mean(boxes_ms); }
    /// Mean time of boxes and broadphase.
    double mean_update_ms() const { return mean(boxes_ms + update_ms); }
    /// Mean time of an update and a query.
    double mean_step_ms() const { return mean_query_ms() + mean_update_ms(); }
    /// Mean time of the broadphase alone.
    double mean_broadphase_ms() const { return mean(update_ms); }
    double mean_pairs() const { return mean(pairs); }
    /// Mean time of a positive query; 0 if there was none.
    double mean_positive_ms() const { return ratio_or_zero(positive_ms, positive_queries); }
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
    CrowdTotals query();

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
    std::span<const BodyPair> find_pairs();

    double width_ = 0.0;  ///< of the room, metres
    CrowdScheme scheme_;
    std::vector<Body> bodies_;
    std::size_t corner_count_ = 0;
    std::vector<Aabb> bounds_;  ///< boxes of the bodies, or cubes: is_of_cubes()
    LazyBoxes boxes_;           ///< for two scenes
    std::unique_ptr<Broadphase> broadphase_;
};

/// Alternates queries of a crowd and moves by dt seconds.
///
/// @param goes_on called before each query except the first; returns false to end the run
CrowdTotals run_crowd(Crowd& crowd, double dt,
                      const std::function<bool(const CrowdTotals&)>& goes_on);

}  // namespace terrane::tools
