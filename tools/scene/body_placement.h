// SPDX-License-Identifier: MIT
#pragma once

#include "program/command.h"
#include "program/geometry.h"
#include "scene/scene_bodies.h"
#include "scene/scene_objects.h"

#include <terrane/terrain/ground.h>
#include <terrane/terrain/height_source.h>
#include <terrane/terrain/pager.h>

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}

namespace terrane::tools {

/// Crates on and beside a path.
struct CrateLayout {
    Polyline path;
    std::size_t count = 0;
    std::uint64_t seed = 1;
    double start_radius = 0.0;  ///< of a disc around the path's start without crates, metres
};

/// Adds --crates.
void add_crates_option(CLI::App& app, std::size_t& count);

/// The pager's needs for lay_out_crates(); none without crates.
std::vector<BodyNeed> crate_needs(const CrateLayout& layout, const HeightSource& source);

/// Boxes with half extents of 0.2 to 0.5 m and 100 to 400 kg/m^3, at rest on the ground and not overlapping each other
/// or the bodies of `obstacles`. One in four is within 1 m of the path as long as there is space, the others within 5
/// m, or farther if there are many. The same arguments give the same bits. Ground steeper than 25 degrees is used only
/// if there is no other.
///
/// Fails: exit_failed if ground is not resident or outside, or too little of it is free
CommandResult<std::vector<PlacedBody>> lay_out_crates(const CrateLayout& layout,
                                                      const Ground& ground, const World& obstacles);

/// In the order of the names of --shape; `file` is DropLayout::file_shape.
enum class DropShape { sphere, capsule, box, hull, compound, mixed, file };

struct DropLayout {
    DropShape shape = DropShape::sphere;
    double scale =
        1.0;  ///< factor of all lengths: shapes, spacing of starts, heights above the ground
    std::optional<Shape> file_shape = {};  ///< of a mesh file, already scaled
    std::size_t count = 1000;
    double speed = 0.0;  ///< downward at the start, m/s
    double spin = 0.0;   ///< rad/s, about a random axis of each body
    std::uint64_t seed = 1;
    std::optional<WorldVec2> start = {};  ///< centre, metres; absent: the extent's centre
};

/// Sphere of radius 0.5; capsule of radius 0.4 and half height 0.8; box of half extents 1, 2, 0.5; hull: a stone of six
/// corners; compound: a hammer, whose head is a box and whose handle is a capsule; each times the scale. Mixed
/// alternates the first three, by the body's index modulo 3.
Shape shape_of_body(const DropLayout& layout, std::size_t body);

/// The square over which bodies start, clipped to the extent.
WorldRect drop_area(const DropLayout& layout, const WorldRect& extent);

/// Bodies on a grid over drop_area(), shifted and rotated by a hash of seed and index, each 2 to 12 m (times the
/// scale) above the ground below it. The same arguments give the same bits. A body without ground below it, or
/// overlapping a body of `obstacles`, is moved elsewhere in the area, and omitted after kTries failed positions.
///
/// Requires the area's ground to be resident.
std::vector<PlacedBody> lay_out(const DropLayout& layout, const Ground& ground,
                                const World& obstacles);

/// The static objects of a scene in a world of bodies, as collision proxies. Scattered objects are present only near
/// dynamic bodies.
class ObjectBodies {
public:
    /// @param source  ground of scattered objects, including volumes: no objects stand where volumes replace it
    /// @param objects of the scene; null: none
    ///
    /// Fails: as make_mesh_body() for a mesh with static objects, and Scatter::create()
    static Result<ObjectBodies> create(std::shared_ptr<const HeightSource> source,
                                       const SceneObjects* objects);

    /// The individually placed objects.
    std::span<const PlacedBody> placed() const { return placed_; }

    /// Call before each step: adds scattered objects near dynamic bodies, and removes those far from all. An object is
    /// left out while it would overlap a dynamic body. The objects in the world depend only on the world's state: a
    /// saved and loaded world continues with the same ones.
    ///
    /// Fails: as Scatter::objects_in() and World::add()
    /// Cost:  O(bodies); after a body has moved by some metres, also O(objects near bodies)
    Result<void> follow(World& world, const Ground& ground);

private:
    struct StaticScatter {
        Scatter scatter;
        Compound shape;       // at scale 1
        double radius = 0.0;  // of the largest object, about its origin, metres
        std::map<ScatterSquare, std::vector<ScatterPoint>> squares = {};  // near bodies
    };
    // Identifies a scattered object by scatter, square and index.
    struct Key {
        std::size_t scatter = 0;
        ScatterSquare square;
        std::size_t index = 0;
        friend constexpr auto operator<=>(const Key&, const Key&) = default;
    };
    // The cube of space that contains a body, and a bound of its motion.
    struct Surroundings {
        std::array<std::int64_t, 3> cube{};
        double reach = 0.0;  // metres from the cube's centre
        friend constexpr auto operator<=>(const Surroundings&, const Surroundings&) = default;
    };

    static std::vector<Surroundings> surroundings_of(const World& world);
    Result<std::set<Key>> find_near(std::span<const Surroundings> around);
    Result<std::optional<BodyId>> add(const Key& key, World& world, const Ground& ground);

    std::vector<PlacedBody> placed_;
    std::vector<std::unique_ptr<StaticScatter>> scatters_;
    std::vector<Surroundings> around_;           // at the last selection of objects; sorted
    std::map<Key, std::optional<BodyId>> near_;  // none: left out because of an overlap
    bool has_followed_ = false;
    // Scattered objects of a loaded world, by position, until the first follow() takes them over.
    std::map<std::array<double, 3>, BodyId> loaded_;
};

}  // namespace terrane::tools
