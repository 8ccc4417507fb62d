// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/world.h>
#include <terrane/render/terrain_renderer.h>
#include <terrane/terrain/body_need.h>
#include <terrane/terrain/pager.h>

#include <string>
#include <vector>

namespace terrane::tools {

/// A body that a Journey moves along a path: a vehicle or a character.
class Traveller {
public:
    virtual ~Traveller() = default;

    /// Its need before it is in a world.
    virtual BodyNeed first_need() const = 0;
    /// Where a camera looks, before and after it is in a world: x forward.
    virtual Pose pose(const World& world) const = 0;

    /// Adds its body to a world, at rest on the ground.
    ///
    /// @param obstacles another world, whose bodies it must not touch
    /// Fails: invalid_argument where the ground is not resident, or a body is in its place
    virtual Result<BodyId> enter(World& world, const Ground& ground, const World& obstacles) = 0;

    /// Controls for the next step of a world that it is in: along the path, or, without `goes`, at rest.
    virtual void control(World& world, bool goes) = 0;
    /// Reacts to a step of `dt` seconds.
    virtual void react(World& world, const Ground& ground, double dt) = 0;
    /// Changes the ground: before each update of the pager, in the same frame.
    virtual void change_ground(World&, Pager&) {}
    /// Whether nothing more will happen.
    virtual bool has_ended(const World& world) const = 0;
    /// Whether the end of the path was reached.
    virtual bool has_arrived() const = 0;

    /// Whether it stands on anything.
    virtual bool is_supported(const World& world) const = 0;
    /// Appends the bodies that it stands on; none for the ground.
    virtual void add_supports(const World& world, std::vector<BodyId>& bodies) const = 0;

    /// Names and values of further columns of frames.csv.
    virtual std::vector<std::string> columns() const = 0;
    virtual std::vector<double> figures(const World& world) const = 0;
    /// Appends the solids that draw it.
    virtual void draw(const World& world, std::vector<DrawnObject>& objects) const = 0;
};

}  // namespace terrane::tools
