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
    double start_radius = 0.0;  ///< of the disc around the path's start that has no crates, metres
};

/// Adds --crates.
void add_crates_option(CLI::App& app, std::size_t& count);

/// Needs that make the ground for lay_out_crates() resident; empty if there are no crates.
std::vector<BodyNeed> crate_needs(const CrateLayout& layout, const HeightSource& source);

/// Lays out boxes with half extents of 0.2 to 0.5 m and densities of 100 to 400 kg/m^3, at rest on the ground. They do
/// not overlap each other or the bodies of `obstacles`. One in four is within 1 m of the path as long as there is
/// space; the others are within 5 m, or farther if there are many. Ground steeper than 25 degrees is used only for a
/// box that finds no place on gentler ground. The same arguments give the same bits.
///
/// Fails: exit_failed if a box finds no place, because the ground is not resident, outside or occupied
CommandResult<std::vector<PlacedBody>> lay_out_crates(const CrateLayout& layout,
                                                      const Ground& ground, const World& obstacles);

/// Kinds of dropped bodies, in the order of the names of --shape. For `file` the shape is DropLayout::file_shape.
enum class DropShape { sphere, capsule, box, hull, compound, mixed, file };

struct DropLayout {
    DropShape shape = DropShape::sphere;
    double scale =
        1.0;  ///< factor of all lengths: shapes, spacing of starts, heights above the ground
    std::optional<Shape> file_shape = {};  ///< of a mesh file, already scaled
    std::size_t count = 1000;
    double speed = 0.0;  ///< downward at the start, m/s
    double spin = 0.0;   ///< rad/s, about a random axis for each body
    std::uint64_t seed = 1;
    std::optional<WorldVec2> start = {};  ///< centre, metres; absent: the extent's centre
};

/// The shape of a body. All lengths are metres times the scale. A sphere has radius 0.5; a capsule radius 0.4 and half
/// height 0.8; a box half extents 1, 2, 0.5. A hull is a stone with six corners. A compound is a hammer: its head is a
/// box, its handle a capsule. `mixed` gives a sphere, a capsule and a box in turn, by the body's index modulo 3.
Shape shape_of_body(const DropLayout& layout, std::size_t body);

/// The square over which bodies start, clipped to the extent.
WorldRect drop_area(const DropLayout& layout, const WorldRect& extent);

/// Lays out bodies on a grid over drop_area(), shifted and rotated by a hash of seed and index. Each bounding sphere is
/// 2 to 12 m (times the scale) above the highest ground below it. A body without ground below it, or touching a body of
/// `obstacles`, is moved elsewhere in the area, and omitted after 64 failed moves. Equal arguments give equal bits.
///
/// Requires the area's ground to be resident.
std::vector<PlacedBody> lay_out(const DropLayout& layout, const Ground& ground,
                                const World& obstacles);

/// The static objects of a scene in a world of bodies, as collision proxies. Scattered objects are present only near
/// dynamic bodies.
class ObjectBodies {
public:
    /// @param source  ground on which objects are scattered, including its volumes: no objects stand where a volume
    ///                replaces the heightfield
    /// @param objects of the scene; null if it has none
    ///
    /// Fails: as make_mesh_body() for a mesh with static objects, and Scatter::create()
    static Result<ObjectBodies> create(std::shared_ptr<const HeightSource> source,
                                       const SceneObjects* objects);

    /// The individually placed objects.
    std::span<const PlacedBody> placed() const { return placed_; }

    /// Call before each step: adds scattered objects near dynamic bodies, and removes those far from all dynamic
    /// bodies. An object is left out while it would overlap a dynamic body. The objects in the world depend only on the
    /// world's state: a saved and loaded world continues with the same objects.
    ///
    /// Fails: as Scatter::objects_in() and World::add()
    /// Cost:  O(bodies); after a body has moved by some metres, also O(objects near bodies)
    Result<void> follow(World& world, const Ground& ground);
    /// Call after the world was replaced by a loaded one: the next follow() takes over the scattered objects in it.
    void take_over();

private:
    struct StaticScatter {
        Scatter scatter;
        Compound shape;       // at scale 1
        double radius = 0.0;  // bounding radius of the largest object about its origin, metres
        std::map<ScatterSquare, std::vector<ScatterPoint>> squares = {};  // near bodies
    };
    // Identifies a scattered object by scatter, square and index.
    struct Key {
        std::size_t scatter = 0;
        ScatterSquare square;
        std::size_t index = 0;
        friend constexpr auto operator<=>(const Key&, const Key&) = default;
    };
    // The cube of space that contains a body's origin, and how far the body may reach soon.
    struct Surroundings {
        std::array<std::int64_t, 3> cube{};
        double reach = 0.0;  // distance from the cube's centre, metres
        friend constexpr auto operator<=>(const Surroundings&, const Surroundings&) = default;
    };

    static std::vector<Surroundings> surroundings_of(const World& world);
    Result<std::set<Key>> find_near(std::span<const Surroundings> around);
    Result<std::optional<BodyId>> add(const Key& key, World& world, const Ground& ground) const;
    const ScatterPoint& point_of(const Key& key) const;
    static std::vector<BodyId> objects_of(const World& world);

    std::vector<PlacedBody> placed_;
    std::vector<std::unique_ptr<StaticScatter>> scatters_;
    std::vector<Surroundings> around_;           // at the last selection of objects; sorted
    std::map<Key, std::optional<BodyId>> near_;  // without an id if left out because of an overlap
    bool has_followed_ = false;
};

}  // namespace terrane::tools
