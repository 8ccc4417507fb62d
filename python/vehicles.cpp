// SPDX-License-Identifier: MIT
//
// World: vehicles, characters, and a driver along a path.
#include "bodies.h"
#include "conversions.h"

#include <terrane/collision/vehicle.h>

#include <pybind11/stl.h>

#include <string>
#include <vector>

namespace terrane::python {
namespace {

// The vehicle with a number. Fails: ValueError if there is none.
const VehicleState& vehicle_of(const World& world, std::uint64_t body) {
    const VehicleState* vehicle = world.vehicle(body_of(body));
    if (vehicle == nullptr)
        throw py::value_error("body " + std::to_string(body) + " is no vehicle of this world");
    return *vehicle;
}

py::object vehicle(HeldWorld& world, std::uint64_t body) {
    const auto use = world.read();
    const VehicleState& state = vehicle_of(*use, body);
    const auto count = static_cast<py::ssize_t>(state.wheels.size());
    py::array_t<double> centre({count, py::ssize_t{3}});
    py::array_t<double> compression(count);
    py::array_t<double> spin(count);
    py::array_t<double> steer(count);
    py::array_t<bool> in_contact(count);
    py::array_t<double> load(count);
    for (std::size_t i = 0; i < state.wheels.size(); ++i) {
        const WheelState& wheel = state.wheels[i];
        write_vector(wheel.centre_world, centre.mutable_data() + 3 * i);
        compression.mutable_data()[i] = wheel.compression;
        spin.mutable_data()[i] = wheel.spin;
        steer.mutable_data()[i] = wheel.steer;
        in_contact.mutable_data()[i] = wheel.in_contact;
        load.mutable_data()[i] = wheel.load;
    }
    const BodyState& chassis = state.chassis;
    return make_answer("Vehicle", to_array(chassis.pose.translation),
                       to_array(chassis.pose.rotation), to_array(chassis.velocity),
                       to_array(chassis.angular_velocity), condition_of(chassis),
                       state.is_rolled_over, centre, compression, spin, steer, in_contact, load);
}

std::uint64_t add_character(HeldWorld& world, const py::object& position, double radius,
                            double half_height, double mass, double max_slope, double max_step,
                            double strength, double air_acceleration, double contact_tolerance) {
    const CharacterSettings settings{.radius = radius,
                                     .half_height = half_height,
                                     .mass = mass,
                                     .max_slope = max_slope,
                                     .max_step = max_step,
                                     .strength = strength,
                                     .air_acceleration = air_acceleration,
                                     .contact_tolerance = contact_tolerance};
    const WorldPos place = read_vector(position, "position");
    return number_of(value_or_raise(world.change()->add_character(settings, place)));
}

py::object character(HeldWorld& world, std::uint64_t body) {
    const auto use = world.read();
    const CharacterState* state = use->character(body_of(body));
    if (state == nullptr)
        throw py::value_error("body " + std::to_string(body) + " is no character of this world");
    return make_answer("Character", to_array(state->body.pose.translation),
                       to_array(state->body.velocity), state->stands, number_of(state->support),
                       to_array(state->normal), condition_of(state->body));
}

void bind_vehicle_settings(py::module_& module) {
    const auto settings =
        py::class_<VehicleSettings>(
            module, "VehicleSettings",
            R"(A vehicle on wheels. Fields can be set; World.add_vehicle() checks and copies them.

Frame: x forward, y left, z up, origin at the centre of the chassis box, which is the centre of mass.)")
            .def(py::init<>(), "The light truck of make_truck(), without a cab.");
    const auto field = [&](const char* name, auto member, const char* doc) {
        py::class_<VehicleSettings>(settings).def_readwrite(name, member, doc);
    };
    using S = VehicleSettings;
    field("mass", &S::mass, "Kilograms, wheels included.");
    field("centre_of_mass_height", &S::centre_of_mass_height, "Above flat ground at rest, metres.");
    field("wheel_radius", &S::wheel_radius, "Metres.");
    field("suspension_travel", &S::suspension_travel, "From hanging to compressed, metres.");
    field("suspension_hertz", &S::suspension_hertz, "Natural frequency of the bounce, Hz.");
    field("damping_ratio", &S::damping_ratio, "Of the bounce; 1 is critical.");
    field("tyre_friction", &S::tyre_friction, "Coulomb, along the rolling direction.");
    field("side_grip", &S::side_grip, "Friction across it over that along it, 0.01 to 1.");
    field("max_drive_force", &S::max_drive_force, "Of all wheels at low speed, N.");
    field("max_drive_power", &S::max_drive_power, "At all wheels, W.");
    field("max_brake_force", &S::max_brake_force, "Of all wheels, N.");
    field("rolling_resistance", &S::rolling_resistance, "Force against the roll over the load.");
    field("drag_area", &S::drag_area, "Drag coefficient times frontal area, m^2.");
    field("is_tracked", &S::is_tracked, "The wheels of a side are a belt.");
    field("friction", &S::friction, "Of the chassis, Coulomb.");
    field("restitution", &S::restitution, "Of the chassis, 0 to 1.");
    py::class_<VehicleSettings>(settings)
        .def_property(
            "chassis_half_extents",
            [](const S& self) { return to_array(self.chassis_half_extents); },
            [](S& self, const py::object& value) {
                self.chassis_half_extents = read_vector(value, "chassis_half_extents");
            },
            "Of the box that collides: shape (3,), metres.")
        .def_property(
            "axles",
            [](const S& self) {
                py::list axles;
                for (const AxleSettings& axle : self.axles)
                    axles.append(py::make_tuple(axle.position, axle.track, axle.max_steer,
                                                axle.is_driven, axle.anti_roll));
                return axles;
            },
            [](S& self,
               const std::vector<std::tuple<double, double, double, bool, double>>& axles) {
                self.axles.clear();
                for (const auto& [position, track, max_steer, is_driven, anti_roll] : axles)
                    self.axles.push_back({position, track, max_steer, is_driven, anti_roll});
            },
            "From front to rear: tuples (position, track, max_steer, is_driven, anti_roll), "
            "metres, radians, N/m.");
    module.def("make_truck", &make_truck, "A light truck on four wheels with a cab.");
    module.def("make_tracked", &make_tracked,
               "A carrier of 12 t on two tracks of five wheels each.");
    module.def("make_six_wheeler", &make_six_wheeler, "An off-road truck of 9 t on six wheels.");
}

std::unique_ptr<PathDriver> make_driver(const py::object& points, double cruise_speed,
                                        double lateral_acceleration, double deceleration) {
    const Rows rows(points, "points_world", 2);
    std::vector<Eigen::Vector2d> path(rows.count());
    for (std::size_t i = 0; i < path.size(); ++i) path[i] = {rows[i][0], rows[i][1]};
    const PathDriverSettings settings{.cruise_speed = cruise_speed,
                                      .lateral_acceleration = lateral_acceleration,
                                      .deceleration = deceleration};
    return std::make_unique<PathDriver>(
        value_or_raise(PathDriver::create(std::move(path), settings)));
}

void bind_driver(py::module_& module) {
    const PathDriverSettings defaults;
    py::class_<PathDriver>(
        module, "PathDriver",
        "Drives a vehicle along a polyline. One thread at a time: calls hold the lock.")
        .def(py::init(&make_driver), py::arg("points_world"), py::kw_only(),
             py::arg("cruise_speed") = defaults.cruise_speed,
             py::arg("lateral_acceleration") = defaults.lateral_acceleration,
             py::arg("deceleration") = defaults.deceleration,
             R"(A driver along points.

points_world          x and y in the order of travel, shape (n, 2), metres
cruise_speed          largest speed, m/s
lateral_acceleration  largest in corners, m/s^2
deceleration          ahead of corners and the end, m/s^2

Raises ValueError for fewer than two distinct points, and for what is out of range.)")
        .def(
            "drive",
            [](PathDriver& driver, HeldWorld& world, std::uint64_t body, double dt) {
                const auto use = world.change();
                const VehicleState& state = vehicle_of(*use, body);
                const VehicleControls controls =
                    driver.drive(*use->vehicle_settings(body_of(body)), state, dt);
                value_or_raise(use->set_controls(body_of(body), controls));
                return make_answer("DriverStatus", static_cast<int>(driver.status()));
            },
            py::arg("world"), py::arg("body"), py::arg("dt"),
            "Sets the controls of a vehicle of a world for its next step, dt seconds after the "
            "previous call: "
            "DriverStatus.")
        .def_property_readonly(
            "status",
            [](const PathDriver& driver) {
                return make_answer("DriverStatus", static_cast<int>(driver.status()));
            },
            "As of the last drive(): DriverStatus.")
        .def_property_readonly("path_share", &PathDriver::path_share,
                               "Share of the path's length that the vehicle has passed, 0 to 1.")
        .def_property_readonly("stuck_time", &PathDriver::stuck_time,
                               "Total time that the vehicle was stuck, seconds.")
        .def_property_readonly(
            "stuck_place",
            [](const PathDriver& driver) -> py::object {
                const std::optional<WorldVec2> place = driver.stuck_place_world();
                return place ? py::object(py::make_tuple(place->x(), place->y())) : py::none();
            },
            "x and y where the vehicle was last found to be stuck, metres, or None.");
}

}  // namespace

void bind_vehicles(py::module_& module) {
    bind_vehicle_settings(module);
    bind_driver(module);
    const CharacterSettings defaults;
    auto world = py::reinterpret_borrow<WorldClass>(module.attr("World"));
    world
        .def(
            "add_vehicle",
            [](HeldWorld& self, const VehicleSettings& settings, const py::object& position,
               const py::object& rotation) {
                const Pose pose = read_pose(position, rotation);
                return number_of(value_or_raise(self.change()->add_vehicle(settings, pose)));
            },
            py::arg("settings"), py::arg("position"), py::arg("rotation") = py::none(),
            "Adds a vehicle, with the pose of its chassis as of add(): its number. ValueError for "
            "a setting out of range.")
        .def(
            "set_controls",
            [](HeldWorld& self, std::uint64_t body, double throttle, double brake, double steer) {
                const VehicleControls controls{
                    .throttle = throttle, .brake = brake, .steer = steer};
                value_or_raise(self.change()->set_controls(body_of(body), controls));
            },
            py::arg("body"), py::arg("throttle") = 0.0, py::arg("brake") = 0.0,
            py::arg("steer") = 0.0,
            "Controls of a vehicle from the next step on: throttle and steer (left) -1 to 1, brake "
            "0 to 1.")
        .def("vehicle", &vehicle, py::arg("body"),
             "State of a vehicle after the last step: Vehicle, copies. ValueError where the body "
             "is none.")
        .def("add_character", &add_character, py::arg("position"), py::kw_only(),
             py::arg("radius") = defaults.radius, py::arg("half_height") = defaults.half_height,
             py::arg("mass") = defaults.mass, py::arg("max_slope") = defaults.max_slope,
             py::arg("max_step") = defaults.max_step, py::arg("strength") = defaults.strength,
             py::arg("air_acceleration") = defaults.air_acceleration,
             py::arg("contact_tolerance") = defaults.contact_tolerance,
             R"(Adds a walking upright capsule: its number.

position          of its centre, shape (3,), metres
radius, half_height  it is 2 * (radius + half_height) tall, metres
mass              kilograms
max_slope         radians; it slides down steeper slopes
max_step          higher steps are obstacles, metres
strength          largest force of its feet, N
air_acceleration  m/s^2

Raises ValueError for what is out of range.)")
        .def(
            "walk",
            [](HeldWorld& self, std::uint64_t body, std::pair<double, double> velocity,
               double jump_speed) {
                CharacterControls controls;
                controls.velocity = {velocity.first, velocity.second};
                controls.jump_speed = jump_speed;
                value_or_raise(self.change()->set_controls(body_of(body), controls));
            },
            py::arg("body"), py::arg("velocity"), py::arg("jump_speed") = 0.0,
            "What a character is asked to do: world x and y velocity, m/s, and a jump, m/s upward.")
        .def("character", &character, py::arg("body"),
             "State of a character: Character, copies. ValueError where the body is none.");
}

}  // namespace terrane::python
