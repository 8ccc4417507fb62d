// SPDX-License-Identifier: MIT
#include "bodies/worlds.h"
#include "ground/pager.h"
#include "values/answers.h"
#include "values/arrays.h"

#include <array>
#include <span>

namespace terrane::python {
namespace {

constexpr std::array<std::pair<const char*, BroadphaseKind>, 4> kBroadphases{
    {{"sap", BroadphaseKind::sap},
     {"grid", BroadphaseKind::grid},
     {"two_scene", BroadphaseKind::two_scene},
     {"brute", BroadphaseKind::brute}}};

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
broadphase       "sap", "grid" (bodies of similar size), "two_scene" or "brute"
worker_count     threads of step(), 1 to 64

Raises ValueError for a setting out of range.)")
        .def(
            "step", &step, py::arg("ground"), py::arg("dt"),
            R"(Moves every body by dt seconds, 0 < dt <= 10, without the lock: StepReport. ValueError for another dt.

ground  the Ground of now: a body without resident ground is parked, not dropped)")
        .def("states", &states, "Every body that there ever was: BodyStates, copies.")
        .def("needs", &needs, "What a pager must keep resident for the bodies: BodyNeeds.")
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
