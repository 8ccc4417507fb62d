// SPDX-License-Identifier: MIT
#pragma once

#include "world/world_bytes.h"

#include <terrane/collision/character.h>
#include <terrane/collision/vehicle.h>

// Settings of vehicles and characters as fields. Fields that BodySettings holds too are stored there only. Ranges are
// those of check_vehicle() and check_character().
namespace terrane::internal {

/// What a body is, besides a body.
enum class BodyRole : std::uint8_t { plain, vehicle, character };

template <class Stream>
void list_axle(Stream& stream, auto& axle) {
    stream.length("axle position", axle.position);
    stream.length("track", axle.track);
    stream.length("max_steer", axle.max_steer);
    stream.flag("is_driven", axle.is_driven);
    stream.length("anti_roll", axle.anti_roll);
}

/// Without the shapes: those are the first parts of the chassis' compound.
template <class Stream>
void list_vehicle_settings(Stream& stream, auto& settings) {
    constexpr std::size_t kAxleBytes = 33;
    stream.list("axles", settings.axles, kAxleBytes,
                [&stream](auto& axle) { list_axle(stream, axle); });
    for (auto* value :
         {&settings.centre_of_mass_height, &settings.wheel_radius, &settings.suspension_travel,
          &settings.suspension_hertz, &settings.damping_ratio, &settings.tyre_friction,
          &settings.side_grip, &settings.max_drive_force, &settings.max_drive_power,
          &settings.max_brake_force, &settings.rolling_resistance, &settings.drag_area}) {
        stream.length("vehicle setting", *value);
    }
    stream.flag("is_tracked", settings.is_tracked);
}

template <class Stream>
void list_character_settings(Stream& stream, auto& settings) {
    for (auto* value : {&settings.max_slope, &settings.max_step, &settings.strength,
                        &settings.air_acceleration}) {
        stream.length("character setting", *value);
    }
}

}  // namespace terrane::internal
