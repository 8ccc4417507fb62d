// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/vehicle.h>
#include <terrane/render/terrain_renderer.h>

#include <vector>

namespace terrane::tools {

/// Appends the solids that draw a vehicle: chassis box, bodywork, wheels, and the belts of a tracked one.
void add_vehicle_objects(const VehicleSettings& settings, const VehicleState& state,
                         std::vector<DrawnObject>& objects);

}  // namespace terrane::tools
