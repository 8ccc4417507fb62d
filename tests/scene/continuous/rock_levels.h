// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/scene/scene.h>
#include <terrane/terrain/view.h>

#include <cstdint>
#include <vector>

namespace terrane::test {

/// A rock with continuous levels of detail, and discrete ones at errors of 0.2, 0.5 and 1.5 % of its size.
struct RockLevels {
    ObjectModel model;
    std::vector<std::vector<TriangleMesh::Triangle>> triangles;  ///< [levels that are meshes]
};

/// @param depth        20 * 4^depth triangles
/// @param has_impostor after the meshes
/// @param morphs       the meshes morph into each other
RockLevels make_rock_levels(int depth, std::uint64_t seed, bool has_impostor = true,
                            bool morphs = true);

/// By hand: pixels per metre of error at scale 1.
double factor_of(const View& view, const ObjectModel& model, const PlacedObject& object);

/// Triangles that demands grant at a threshold.
std::size_t granted(std::span<const TriangleDemand> demands, double threshold_px);

}  // namespace terrane::test
