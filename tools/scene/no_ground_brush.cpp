// SPDX-License-Identifier: MIT
//
// Replaces ground_brush.cpp if the program is built without terrane::volume. create() fails, so that the other
// functions are never called.
#include "scene/ground_brush.h"

namespace terrane::tools {

struct GroundBrush::State {};

GroundBrush::~GroundBrush() = default;

CommandResult<std::unique_ptr<GroundBrush>> GroundBrush::create(Terrain&) {
    return failure(
        "digging needs a program that was built with TERRANE_VOLUME, which this one was not");
}

double GroundBrush::least_radius() const { return 0.0; }
Result<void> GroundBrush::dig(const WorldPos&, double) { return {}; }
Result<void> GroundBrush::fill(const WorldPos&, double) { return {}; }
Result<void> GroundBrush::undo() { return {}; }
Aabb GroundBrush::update(Pager&) { return {}; }
std::size_t GroundBrush::waiting() const { return 0; }

}  // namespace terrane::tools
