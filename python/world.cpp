// SPDX-License-Identifier: MIT
//
// The binding of World.
#include "bodies.h"
#include "conversions.h"
#include "terrain.h"

#include <array>
#include <span>
#include <string>
#include <vector>

namespace terrane::python {

// Adding bodies, and methods of a single body.

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
                // All bodies are added or none: removes those added so far.
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

// Batches of rays, and the contact events of a step.

namespace {

py::object world_rays(HeldWorld& world, const Ground& ground, const py::object& from,
                      const py::object& to, std::uint32_t layers, std::uint64_t except,
                      bool include_sensors, bool include_ground) {
    const Rows starts(from, "from_world", 3);
    const Rows ends(to, "to_world", 3);
    const Batch batch({&starts, &ends});
    auto hit = batch.make<bool>();
    auto fraction = batch.make<double>();
    auto body = batch.make<std::uint64_t>();
    auto point = batch.make<double>({3});
    auto normal = batch.make<double>({3});
    auto status = batch.make<std::int8_t>();
    bool* const hit_out = hit.mutable_data();
    double* const fraction_out = fraction.mutable_data();
    std::uint64_t* const body_out = body.mutable_data();
    double* const point_out = point.mutable_data();
    double* const normal_out = normal.mutable_data();
    std::int8_t* const status_out = status.mutable_data();
    const QueryFilter filter{.layers = layers,
                             .except = body_of(except),
                             .include_sensors = include_sensors,
                             .include_ground = include_ground};
    const auto use = world.read();
    without_lock([&] {
        const Eigen::Vector3d none = Eigen::Vector3d::Constant(kNaN);
        for (std::size_t i = 0; i < batch.count(); ++i) {
            const RayQueryAnswer answer =
                use->ray(ground, starts.vector(i), ends.vector(i), filter);
            const bool is_valid = answer.status != QueryStatus::invalid;
            hit_out[i] = is_valid && answer.hit;
            fraction_out[i] = is_valid ? answer.fraction : kNaN;
            body_out[i] = number_of(answer.body);
            write_vector(hit_out[i] ? answer.point_world : none, point_out + 3 * i);
            write_vector(hit_out[i] ? answer.normal : none, normal_out + 3 * i);
            status_out[i] = static_cast<std::int8_t>(answer.status);
        }
    });
    return make_answer("WorldRays", hit, fraction, body, point, normal, status);
}

py::object contact_events(HeldWorld& world) {
    const auto use = world.read();
    const std::span<const ContactEvent> events = use->contact_events();
    const auto count = static_cast<py::ssize_t>(events.size());
    py::array_t<std::uint64_t> a(count);
    py::array_t<std::uint64_t> b(count);
    py::array_t<std::int8_t> phase(count);
    py::array_t<bool> is_sensor(count);
    py::array_t<double> impulse({count, py::ssize_t{3}});
    py::array_t<double> normal({count, py::ssize_t{3}});
    for (std::size_t i = 0; i < events.size(); ++i) {
        const ContactEvent& event = events[i];
        a.mutable_data()[i] = number_of(event.a);
        b.mutable_data()[i] = number_of(event.b);
        phase.mutable_data()[i] = static_cast<std::int8_t>(event.phase);
        is_sensor.mutable_data()[i] = event.is_sensor;
        write_vector(event.impulse, impulse.mutable_data() + 3 * i);
        write_vector(event.normal, normal.mutable_data() + 3 * i);
    }
    return make_answer("ContactEvents", a, b, phase, is_sensor, impulse, normal);
}

}  // namespace

void bind_world_queries(WorldClass& world) {
    const QueryFilter defaults;
    world
        .def("rays", &world_rays, py::arg("ground"), py::arg("from_world"), py::arg("to_world"),
             py::kw_only(), py::arg("layers") = defaults.layers, py::arg("except_body") = kNoBody,
             py::arg("include_sensors") = defaults.include_sensors,
             py::arg("include_ground") = defaults.include_ground,
             R"(The first bodies, or ground, that segments meet: WorldRays. Without the lock.

from_world, to_world  shape (n, 3), or (3,) for one point that all share, metres
layers                sees bodies on at least one of these layers
except_body           is not seen)")
        .def("contact_events", &contact_events,
             "The contacts of the last step: ContactEvents; empty without report_contacts.");
}

namespace {

constexpr std::array<std::pair<const char*, BroadphaseKind>, 3> kBroadphases{
    {{"sap", BroadphaseKind::sap},
     {"grid", BroadphaseKind::grid},
     {"two_scene", BroadphaseKind::two_scene}}};

std::shared_ptr<HeldWorld> make_world(const py::object& gravity, double max_substep,
                                      bool allow_sleep, bool collide_bodies, bool report_contacts,
                                      bool measure_depth, const std::string& broadphase,
                                      int worker_count) {
    const WorldSettings settings{.gravity = read_vector(gravity, "gravity"),
                                 .max_substep = max_substep,
                                 .allow_sleep = allow_sleep,
                                 .collide_bodies = collide_bodies,
                                 .report_contacts = report_contacts,
                                 .measure_depth = measure_depth,
                                 .broadphase = read_choice(broadphase, "broadphase", kBroadphases),
                                 .worker_count = worker_count};
    return std::make_shared<HeldWorld>("World", value_or_raise(World::create(settings)));
}

py::object step(HeldWorld& world, const Ground& ground, double dt) {
    const auto use = world.change();
    const StepReport report = without_lock([&] { return use->step(ground, dt); });
    if (report.refused_steps > 0)
        throw py::value_error("dt must be above 0, to 10 s, got " + std::to_string(dt));
    return make_answer("StepReport", report.awake, report.parked, report.left_world, report.asleep,
                       report.touching_pairs, report.islands, report.impacts, report.simulated_time,
                       report.lost_time, report.max_depth_m, report.too_deep, report.placed_deep,
                       report.kinematic_in_ground, report.skipped_pairs);
}

BodyNeeds needs(HeldWorld& world) {
    const auto use = world.change();
    const std::span<const BodyNeed> found = use->needs();
    BodyNeeds copy{{found.begin(), found.end()}};
    for (BodyNeed& need : copy.needs) need.trajectory = {};
    return copy;
}

// Fails: ValueError if there is no body with this number
void check_body(const World& world, std::uint64_t body) {
    if (!world.contains(body_of(body)))
        throw py::value_error("body " + std::to_string(body) + " is no body of this world");
}

py::object state(HeldWorld& world, std::uint64_t body) {
    const auto use = world.read();
    check_body(*use, body);
    const BodyState& state = use->state(body_of(body));
    return make_answer("BodyState", to_array(state.pose.translation), to_array(state.pose.rotation),
                       to_array(state.velocity), to_array(state.angular_velocity),
                       condition_of(state));
}

py::object settings(HeldWorld& world, std::uint64_t body) {
    const auto use = world.read();
    check_body(*use, body);
    const BodySettings& settings = use->settings(body_of(body));
    const char* type = "";
    for (const auto& [name, value] : kTypes)
        if (value == settings.type) type = name;
    return make_answer("BodySettings", HeldShape{settings.shape}, type, settings.mass,
                       settings.friction, settings.restitution, settings.contact_tolerance,
                       settings.filter.layers, settings.filter.collides_with, settings.is_sensor,
                       settings.rotates);
}

py::object states(HeldWorld& world) {
    const auto use = world.read();
    const std::span<const BodyState> bodies = use->states();
    const auto count = static_cast<py::ssize_t>(bodies.size());
    py::array_t<std::uint64_t> body(count);
    py::array_t<double> position({count, py::ssize_t{3}});
    py::array_t<double> rotation({count, py::ssize_t{3}, py::ssize_t{3}});
    py::array_t<double> velocity({count, py::ssize_t{3}});
    py::array_t<double> angular_velocity({count, py::ssize_t{3}});
    py::array_t<std::int8_t> condition(count);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        const BodyState& state = bodies[i];
        body.mutable_data()[i] = number_of(use->id(i));
        write_vector(state.pose.translation, position.mutable_data() + 3 * i);
        write_matrix(state.pose.rotation, rotation.mutable_data() + 9 * i);
        write_vector(state.velocity, velocity.mutable_data() + 3 * i);
        write_vector(state.angular_velocity, angular_velocity.mutable_data() + 3 * i);
        condition.mutable_data()[i] = static_cast<std::int8_t>(state.condition);
    }
    return make_answer("BodyStates", body, position, rotation, velocity, angular_velocity,
                       condition);
}

py::bytes save(HeldWorld& world) {
    const auto use = world.read();
    const std::vector<std::byte> bytes = without_lock([&] { return use->save(); });
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::shared_ptr<HeldWorld> load(const py::bytes& bytes, int worker_count) {
    char* data = nullptr;
    py::ssize_t size = 0;
    if (PyBytes_AsStringAndSize(bytes.ptr(), &data, &size) != 0) throw py::error_already_set();
    const std::span<const std::byte> read(reinterpret_cast<const std::byte*>(data),
                                          static_cast<std::size_t>(size));
    Result<World> world = without_lock([&] { return World::load(read, {}, worker_count); });
    return std::make_shared<HeldWorld>("World", value_or_raise(std::move(world)));
}

}  // namespace

void bind_world(py::module_& module) {
    module.attr("NO_BODY") = kNoBody;
    const WorldSettings defaults;
    WorldClass world(module, "World",
                     R"(Rigid bodies, vehicles and characters on the ground and on each other.

Bodies are named by numbers (uint64); that of a removed body is refused. No body is ever deeper in the ground than its
tolerance. The same calls give the same bits. One thread at a time, else RuntimeError; rays() on any number of threads
while nothing else is called. A closed one is a ValueError. A context manager.)");
    world
        .def(py::init(&make_world), py::kw_only(),
             py::arg("gravity") = py::make_tuple(0.0, 0.0, -9.81),
             py::arg("max_substep") = defaults.max_substep,
             py::arg("allow_sleep") = defaults.allow_sleep,
             py::arg("collide_bodies") = defaults.collide_bodies,
             py::arg("report_contacts") = defaults.report_contacts,
             py::arg("measure_depth") = defaults.measure_depth, py::arg("broadphase") = "sap",
             py::arg("worker_count") = defaults.worker_count,
             R"(A world without bodies.

gravity          shape (3,), m/s^2
max_substep      largest substep, s, 1e-5 to 1
allow_sleep      bodies at rest are not stepped
collide_bodies   False: bodies pass through each other
report_contacts  True: step() makes contact_events()
measure_depth    step() measures StepReport.max_depth_m and too_deep
broadphase       "sap", "grid" (bodies of similar size) or "two_scene" (hulls that seldom meet)
worker_count     threads of step(), 1 to 64

Raises ValueError for a setting out of range.)")
        .def(
            "step", &step, py::arg("ground"), py::arg("dt"),
            R"(Moves every body by dt seconds, 0 < dt <= 10, without the lock: StepReport. ValueError for another dt.

ground  the Ground of now: a body without resident ground is parked, not dropped)")
        .def("state", &state, py::arg("body"), "Of a body: BodyState, copies.")
        .def("settings", &settings, py::arg("body"), "Of a body: BodySettings.")
        .def("states", &states, "All states, by the index of ids: BodyStates, copies.")
        .def("needs", &needs, "What a Terrain must keep resident for the bodies: BodyNeeds.")
        .def_property_readonly(
            "state_hash", [](HeldWorld& self) { return self.read()->state_hash(); },
            "Hash of every state's bits.")
        .def("save", &save, "The world as bytes, for load(): it goes on with the same bits.")
        .def_static("load", &load, py::arg("bytes"), py::arg("worker_count") = 1,
                    "The world of save(); ValueError for other bytes.")
        .def("close", &HeldWorld::close, "Frees it. Nothing where it is closed.")
        .def_property_readonly("closed", &HeldWorld::is_closed, "Whether close() was called.")
        .def("__enter__", [](py::object self) { return self; })
        .def("__exit__", [](HeldWorld& self, const py::args&) { self.close(); });
    bind_bodies(world);
    bind_world_queries(world);
}

}  // namespace terrane::python
