// SPDX-License-Identifier: MIT
//
// Replaces wheel_ruts.cpp if the program is built without terrane::volume. create() fails, so that the other functions
// are never called.
#include "scene/wheel_ruts.h"

namespace terrane::tools {

struct WheelRuts::State {};

WheelRuts::~WheelRuts() = default;

CommandResult<std::unique_ptr<WheelRuts>> WheelRuts::create(Terrain&, int) {
    return failure(
        "--ruts need a program that was built with TERRANE_VOLUME, which this one was not");
}

void WheelRuts::roll(const VehicleState&, double, const Ground&) {}
Aabb WheelRuts::update(Pager&) { return {}; }
std::uint64_t WheelRuts::digs() const { return 0; }

}  // namespace terrane::tools
