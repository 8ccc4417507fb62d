// SPDX-License-Identifier: MIT
#pragma once

#include "references/reference_maps.h"

#include <terrane/collision/world.h>
#include <terrane/terrain/ground.h>

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace terrane::bench {

/// The contact surface of a source, resident everywhere at its finest level. Ends the program with a message if
/// loading fails.
Ground load_ground(const std::shared_ptr<const HeightSource>& source);

/// Ground over a table, and the samples of its contact surface for other engines: rounded to quanta, which floats hold
/// exactly. Row 0 south, world (0, 0) in the south-west.
struct ContactMap {
    Ground ground;
    test::HeightTable table;
    double width() const { return table.spacing * (table.columns - 1); }
    /// Whether a place is below the ground, or beside it.
    bool is_below(const WorldPos& place) const;
};

/// Of the contact map: a square of `side` samples.
ContactMap make_contact_map(int side, double spacing);

/// The same of any table of as many columns as rows.
ContactMap make_map(const test::HeightTable& heights);

/// Shapes that are dropped, one after the other.
struct DropKind {
    std::string name;
    std::vector<Shape> shapes;
};

/// Spheres, capsules, boxes, and a mixture of them in turns: the shapes of `terrane drop`.
std::array<DropKind, 4> drop_kinds();

/// Bodies and where they start.
struct BodyDrop {
    std::vector<BodySettings> settings;
    std::vector<BodyState> states;  ///< [settings.size()]
};

/// Layers over a square in the middle of a map, 5 m above the ground, with random rotations; the shapes in turns.
///
/// @param half_width of the square, metres
/// @param distance   between neighbours and between layers, metres
/// @param velocity   of all of them, m/s
BodyDrop lay_out_drop(const ContactMap& map, std::span<const Shape> shapes, std::size_t count,
                      double half_width, double distance,
                      const Eigen::Vector3d& velocity = Eigen::Vector3d::Zero());

}  // namespace terrane::bench
