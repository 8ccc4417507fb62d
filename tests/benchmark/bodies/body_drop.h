// SPDX-License-Identifier: MIT
#pragma once

#include "benchmark/contact/contact_workload.h"

#include <terrane/collision/world.h>

#include <span>
#include <vector>

namespace terrane::bench {

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
