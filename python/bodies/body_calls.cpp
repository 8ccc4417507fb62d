// SPDX-License-Identifier: MIT
// World: adding bodies, and what is done to one.
#include "bodies/shapes.h"
#include "bodies/worlds.h"
#include "values/answers.h"
#include "values/arrays.h"

#include <array>
#include <string>
#include <vector>

namespace terrane::python {
namespace {

constexpr std::array<std::pair<const char*, BodyType>, 3> kTypes{
    {{"static", BodyType::static_body},
     {"kinematic", BodyType::kinematic_body},
     {"dynamic", BodyType::dynamic_body}}};

py::object add(HeldWorld& world, const HeldShape& shape, const py::object& position,
               const py::object& rotation, const py::object& velocity,
               const py::object& angular_velocity, const std::string& type, double mass,
               double friction, double restitution, double contact_tolerance, std::uint32_t layers,
               std::uint32_t collides_with, bool is_sensor, bool rotates) {
    const Poses poses(position, rotation, "position", "rotation");
    const Rows velocities(velocity, "velocity", 3);
    const Rows spins(angular_velocity, "angular_velocity", 3);
    const Batch batch({&poses.positions(), &poses.rotations(), &velocities, &spins});
    const BodySettings settings{.shape = shape.shape,
                                .type = read_choice(type, "type", kTypes),
                                .mass = mass,
                                .friction = friction,
                                .restitution = restitution,
                                .contact_tolerance = contact_tolerance,
                                .filter = {layers, collides_with},
                                .is_sensor = is_sensor,
                                .rotates = rotates};
    py::array_t<std::uint64_t> numbers = batch.make<std::uint64_t>();
    std::uint64_t* const out = numbers.mutable_data();
    const auto use = world.change();
    const Result<void> added = without_lock([&]() -> Result<void> {
        for (std::size_t i = 0; i < batch.count(); ++i) {
            BodyState state;
            state.pose = poses[i];
            state.velocity = velocities.vector(i);
            state.angular_velocity = spins.vector(i);
            const Result<BodyId> body = use->add(settings, state);
            if (!body) {
                // all or none
                while (i > 0) (void)use->remove(body_of(out[--i]));
                return tl::unexpected(body.error());
            }
            out[i] = number_of(*body);
        }
        return {};
    });
    value_or_raise(added);
    if (numbers.ndim() == 0) return py::int_(out[0]);
    return numbers;
}

void teleport(HeldWorld& world, std::uint64_t body, const py::object& position,
              const py::object& rotation, const py::object& velocity,
              const py::object& angular_velocity) {
    BodyState state;
    state.pose = read_pose(position, rotation);
    state.velocity = read_vector(velocity, "velocity");
    state.angular_velocity = read_vector(angular_velocity, "angular_velocity");
    value_or_raise(world.change()->teleport(body_of(body), state));
}

void set_velocity(HeldWorld& world, std::uint64_t body, const py::object& velocity,
                  const py::object& angular_velocity) {
    value_or_raise(world.change()->set_velocity(body_of(body), read_vector(velocity, "velocity"),
                                                read_vector(angular_velocity, "angular_velocity")));
}

void apply_impulse(HeldWorld& world, std::uint64_t body, const py::object& impulse,
                   const py::object& point) {
    value_or_raise(world.change()->apply_impulse(body_of(body), read_vector(point, "point_world"),
                                                 read_vector(impulse, "impulse")));
}

void add_force(HeldWorld& world, std::uint64_t body, const py::object& force,
               const py::object& point) {
    const Eigen::Vector3d newtons = read_vector(force, "force");
    if (point.is_none()) {
        value_or_raise(world.change()->add_force(body_of(body), newtons));
    } else {
        value_or_raise(
            world.change()->add_force(body_of(body), read_vector(point, "point_world"), newtons));
    }
}

void move_kinematic(HeldWorld& world, std::uint64_t body, const py::object& position,
                    const py::object& rotation, double dt) {
    value_or_raise(
        world.change()->move_kinematic(body_of(body), read_pose(position, rotation), dt));
}

py::tuple zero() { return py::make_tuple(0.0, 0.0, 0.0); }

}  // namespace

void bind_bodies(WorldClass& world) {
    const BodySettings defaults;
    world
        .def("add", &add, py::arg("shape"), py::arg("position"), py::arg("rotation") = py::none(),
             py::kw_only(), py::arg("velocity") = zero(), py::arg("angular_velocity") = zero(),
             py::arg("type") = "dynamic", py::arg("mass") = defaults.mass,
             py::arg("friction") = defaults.friction, py::arg("restitution") = defaults.restitution,
             py::arg("contact_tolerance") = defaults.contact_tolerance,
             py::arg("layers") = defaults.filter.layers,
             py::arg("collides_with") = defaults.filter.collides_with,
             py::arg("is_sensor") = defaults.is_sensor, py::arg("rotates") = defaults.rotates,
             R"(Adds bodies of one kind, all or none: the number of one, or uint64 of shape (n,).

position           shape (n, 3), or (3,) for one body, metres
rotation           as of Ground.contacts()
velocity           of the centre of mass, shape (n, 3) or (3,), m/s
angular_velocity   shape (n, 3) or (3,), world axes, rad/s
type               "dynamic", "kinematic" (moves as told, infinite mass) or "static"
mass               of each, kilograms
friction           Coulomb
restitution        0 to 1
contact_tolerance  metres; 0: Shape.contact_tolerance
layers, collides_with  bits: which layers it is on, and which it collides with
is_sensor          bodies pass through it; it reports them
rotates            False: contacts and torques do not turn it

Raises ValueError for what is out of range or not finite.)")
        .def(
            "remove",
            [](HeldWorld& self, std::uint64_t body) {
                value_or_raise(self.change()->remove(body_of(body)));
            },
            py::arg("body"), "Removes a body; wakes those that touch it.")
        .def(
            "contains",
            [](HeldWorld& self, std::uint64_t body) {
                return self.read()->contains(body_of(body));
            },
            py::arg("body"), "Whether the number names a body of this world.")
        .def("teleport", &teleport, py::arg("body"), py::arg("position"),
             py::arg("rotation") = py::none(), py::kw_only(), py::arg("velocity") = zero(),
             py::arg("angular_velocity") = zero(),
             "Replaces a body's pose and velocities: nothing is cast. Arguments as of add().")
        .def("set_velocity", &set_velocity, py::arg("body"), py::arg("velocity"),
             py::arg("angular_velocity") = zero(),
             "Sets a body's velocities, m/s and rad/s, shape (3,); wakes it.")
        .def("apply_impulse", &apply_impulse, py::arg("body"), py::arg("impulse"),
             py::arg("point_world"), "Applies an impulse, N s, at a point of a dynamic body.")
        .def("add_force", &add_force, py::arg("body"), py::arg("force"),
             py::arg("point_world") = py::none(),
             "Adds a force, N, for the next step, at a point or the centre of mass.")
        .def(
            "add_torque",
            [](HeldWorld& self, std::uint64_t body, const py::object& torque) {
                value_or_raise(
                    self.change()->add_torque(body_of(body), read_vector(torque, "torque")));
            },
            py::arg("body"), py::arg("torque"), "Adds a torque, N m, for the next step.")
        .def("move_kinematic", &move_kinematic, py::arg("body"), py::arg("position"),
             py::arg("rotation") = py::none(), py::arg("dt") = 1.0 / 60.0,
             "Gives a kinematic body the velocity that brings it to a pose in the next step of dt "
             "seconds.")
        .def(
            "wake",
            [](HeldWorld& self, std::uint64_t body) {
                value_or_raise(self.change()->wake(body_of(body)));
            },
            py::arg("body"), "Wakes a body and those that it sleeps with.");
}

}  // namespace terrane::python
