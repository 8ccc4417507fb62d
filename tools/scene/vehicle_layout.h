// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/collision/vehicle.h>

#include <cstddef>
#include <optional>
#include <vector>

namespace terrane::tools {

/// Lengths of a vehicle's form that follow from its settings; metres, in the chassis's frame.
struct VehicleLayout {
    explicit VehicleLayout(const VehicleSettings& settings);

    double wheel_width = 0.0;  ///< of a tyre or a double road wheel
    double rest = 0.0;         ///< height of the wheels' centres on flat ground at rest
    double rise = 0.0;         ///< how far wheels can rise from there
    double belt_width = 0.0;   ///< of a track
    double belt_thickness = 0.0;
    double track_side = 0.0;       ///< y of the left track's middle; 0: there are no tracks
    double sprocket_radius = 0.0;  ///< of the belt's inner side around a sprocket
    Eigen::Vector2d front_sprocket = Eigen::Vector2d::Zero();  ///< x and z of its centre
    Eigen::Vector2d rear_sprocket = Eigen::Vector2d::Zero();
    std::size_t link_count = 0;  ///< of one track
    double link_length = 0.0;    ///< between the pins, with all wheels at rest
};

}  // namespace terrane::tools
