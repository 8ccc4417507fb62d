// SPDX-License-Identifier: MIT
#pragma once

#include "scene/form_builder.h"
#include "scene/mesh_files.h"

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

// Colours of more than one part of a vehicle.
inline constexpr FormColour kOlive{0.33, 0.36, 0.24};
inline constexpr FormColour kBlack{0.07, 0.07, 0.075};
inline constexpr FormColour kRubber{0.10, 0.10, 0.10};
inline constexpr FormColour kFrame{0.14, 0.14, 0.15};
inline constexpr FormColour kSteel{0.60, 0.60, 0.61};
inline constexpr FormColour kIron{0.34, 0.33, 0.32};

/// A wheel with a tyre, tread blocks, rim and hub; see VehicleForm::wheel.
MeshModel make_tyre_wheel(const VehicleSettings& settings, const VehicleLayout& layout);
/// A double road wheel of a track.
MeshModel make_road_wheel(const VehicleSettings& settings, const VehicleLayout& layout);
/// See VehicleForm::sprocket and VehicleForm::link. Both require tracks.
MeshModel make_sprocket(const VehicleLayout& layout);
MeshModel make_link(const VehicleLayout& layout);

}  // namespace terrane::tools
