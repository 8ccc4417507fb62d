// SPDX-License-Identifier: MIT
//
// Sources of the presets:
//   Wong. Theory of ground vehicles. 2008, chapters 1, 3 and 4: tyres on dry asphalt, peak friction 0.8 to 0.9 and 0.75
//     sliding; rolling resistance 0.012 to 0.015 on hard roads, of tracks on firm ground 0.04; drag.
//   NHTSA. Rating system for rollover resistance. Federal Register 66 FR 3388, 2001: static stability factor track / (2
//     height of the centre of mass); light trucks are at 1.0 to 1.3. A vehicle slides before it rolls where its tyres'
//     friction is below that, less what the suspension's roll takes.
//   Gillespie. Fundamentals of vehicle dynamics. 1992, chapters 4, 5 and 7: bounce frequencies of 1 to 2 Hz, damping
//     ratios of 0.2 to 0.4; drag coefficients of pickups and utility vehicles about 0.45, over 3 m^2; anti-roll bars.
// The drive force is limited by the tyres' grip on a slope, as for trucks in low gear. The default power of the tracked
// vehicle is that at the tracks of an M113 of 12 t and 158 kW, at an efficiency of 70 %.
// Deviations: power is given at the wheels, and constant over the speed, as with a gearbox of many ratios. The roll
//     axis lies on the ground: there is no suspension geometry. A track is a row of wheels of equal force; its belt has
//     no mass and no tension.
#include <terrane/collision/vehicle.h>

namespace terrane {
namespace {

CompoundPart make_cab(double x, double z, const Eigen::Vector3d& half_extents) {
    CompoundPart cab{Box{half_extents}, {}};
    cab.body_from_part.translation = {x, 0.0, z};
    return cab;
}

}  // namespace

VehicleSettings make_truck() {
    VehicleSettings truck;
    truck.bodywork.push_back(make_cab(0.7, 0.75, {0.8, 0.8, 0.35}));
    return truck;
}

VehicleSettings make_tracked() {
    VehicleSettings tracked;
    tracked.chassis_half_extents = {2.6, 1.1, 0.5};
    tracked.mass = 12e3;
    tracked.centre_of_mass_height = 0.84;
    tracked.axles.clear();
    for (int i = 0; i < 5; ++i) tracked.axles.push_back({.position = 1.8 - 0.9 * i, .track = 2.2});
    tracked.wheel_radius = 0.4;
    tracked.suspension_hertz = 1.5;
    tracked.damping_ratio = 0.6;
    tracked.tyre_friction = 0.9;
    tracked.side_grip = 0.6;
    tracked.max_drive_force = 90e3;
    tracked.max_drive_power = 110e3;
    tracked.max_brake_force = 100e3;
    tracked.rolling_resistance = 0.04;
    tracked.drag_area = 6.0;
    tracked.is_tracked = true;
    return tracked;
}

VehicleSettings make_six_wheeler() {
    VehicleSettings six;
    six.chassis_half_extents = {3.4, 1.15, 0.45};
    six.bodywork.push_back(make_cab(2.3, 1.0, {0.9, 1.1, 0.55}));
    six.mass = 9e3;
    six.centre_of_mass_height = 1.0;
    six.axles = {{.position = 2.2, .track = 2.2, .max_steer = 0.5, .anti_roll = 40e3},
                 {.position = -0.6, .track = 2.2, .max_steer = 0.15, .anti_roll = 40e3},
                 {.position = -2.2, .track = 2.2, .max_steer = 0.0, .anti_roll = 40e3}};
    six.wheel_radius = 0.55;
    six.suspension_travel = 0.4;
    six.suspension_hertz = 1.5;
    six.max_drive_force = 60e3;
    six.max_drive_power = 180e3;
    six.max_brake_force = 75e3;
    six.drag_area = 5.0;
    return six;
}

}  // namespace terrane
