// SPDX-License-Identifier: MIT
#include "ground/pager.h"

#include "ground/sources.h"
#include "values/answers.h"
#include "values/arrays.h"
#include "values/guarded.h"

#include <terrane/terrain/ground.h>

#include <pybind11/stl.h>

namespace terrane::python {
namespace {

using PagerUse = Guarded<Pager>;

constexpr std::array<std::pair<const char*, PagingPolicy>, 2> kPolicies{
    {{"deadline", PagingPolicy::deadline}, {"distance", PagingPolicy::distance}}};

std::shared_ptr<PagerUse> make_pager(const Source& source, std::size_t memory_bytes,
                                     int worker_count, double horizon, double contact_spacing,
                                     double contact_share, const std::string& policy,
                                     double distance_radius, double load_timeout) {
    const PagerSettings settings{.memory_bytes = memory_bytes,
                                 .worker_count = worker_count,
                                 .horizon = horizon,
                                 .contact_spacing = contact_spacing,
                                 .contact_share = contact_share,
                                 .policy = read_choice(policy, "policy", kPolicies),
                                 .distance_radius = distance_radius,
                                 .load_timeout = load_timeout};
    return std::make_shared<PagerUse>(
        "Pager",
        value_or_raise(without_lock([&] { return Pager::create(source.heights, settings); })));
}

BodyNeeds make_needs(const py::object& centre, const py::object& velocity,
                     const py::object& radius) {
    const Rows centres(centre, "centre_world", 3);
    const Rows velocities(velocity, "velocity", 3);
    const Rows radii = Rows::numbers(radius, "radius");
    const Batch batch({&centres, &velocities, &radii});
    BodyNeeds made;
    made.needs.resize(batch.count());
    for (std::size_t i = 0; i < batch.count(); ++i) {
        made.needs[i].centre_world = centres.vector(i);
        made.needs[i].velocity = velocities.vector(i);
        made.needs[i].radius = radii[i][0];
    }
    return made;
}

// A World stands for its needs().
BodyNeeds read_needs(const py::object& bodies) {
    if (bodies.is_none()) return {};
    if (py::isinstance<BodyNeeds>(bodies)) return py::cast<BodyNeeds>(bodies);
    if (py::hasattr(bodies, "needs")) return py::cast<BodyNeeds>(bodies.attr("needs")());
    throw py::type_error("bodies must be a World, BodyNeeds or None");
}

void update_pager(PagerUse& pager, double time_s, const std::vector<CameraNeed>& cameras,
                  const py::object& bodies) {
    const BodyNeeds needs = read_needs(bodies);
    if (!std::isfinite(time_s)) throw py::value_error("time_s must be finite");
    const auto use = pager.change();
    without_lock([&] { use->update(cameras, needs.needs, time_s); });
}

py::object stats_of(PagerUse& pager) {
    const PagerStats stats = pager.read()->stats();
    return make_answer(
        "PagerStats", stats.resident_bytes, stats.in_flight_bytes, stats.resident_chunks,
        stats.late_chunks, stats.fading_chunks, stats.groundless_bodies, stats.peak_bytes,
        stats.loaded, stats.evicted, stats.reloaded, stats.cancelled, stats.failed, stats.timed_out,
        stats.refused_needs, stats.cut_needs, stats.over_ceiling, stats.hard_evictions,
        stats.bytes_read, stats.bytes_used, stats.bytes_awaited);
}

void bind_needs(py::module_& module) {
    py::class_<CameraNeed>(module, "Camera", "A camera that draws: its needs for a pager.")
        .def(py::init([](const View& view, const py::object& velocity, double threshold_px) {
                 CameraNeed need;
                 need.view = view;
                 need.velocity = read_vector(velocity, "velocity");
                 need.threshold_px = threshold_px;
                 return need;
             }),
             py::arg("view"), py::arg("velocity") = py::make_tuple(0.0, 0.0, 0.0),
             py::arg("threshold_px") = 1.0,
             R"(A camera with a view.

velocity      shape (3,), metres a second, world axes
threshold_px  screen error below which no detail is needed, pixels: Mesh.threshold_px of the frame before)")
        .def_readonly("view", &CameraNeed::view, "Where it is, and what it sees.")
        .def_property_readonly(
            "velocity", [](const CameraNeed& need) { return to_array(need.velocity); },
            "Shape (3,), metres a second, world axes.")
        .def_readonly("threshold_px", &CameraNeed::threshold_px,
                      "Screen error below which no detail is needed, pixels.");
    py::class_<BodyNeeds>(module, "BodyNeeds", "Bodies that touch ground, or may soon.")
        .def(py::init(&make_needs), py::arg("centre_world"),
             py::arg("velocity") = py::make_tuple(0.0, 0.0, 0.0), py::arg("radius") = 1.0,
             R"(Bounding spheres of bodies.

centre_world  shape (n, 3), metres
velocity      shape (n, 3) or (3,), metres a second, world axes
radius        shape (n,) or one number, metres)")
        .def("__len__", [](const BodyNeeds& bodies) { return bodies.needs.size(); });
}

}  // namespace

void bind_pager(py::module_& module) {
    bind_needs(module);
    const PagerSettings defaults;
    py::class_<PagerUse, std::shared_ptr<PagerUse>>(
        module, "Pager",
        R"(Keeps the chunks resident that cameras draw and bodies touch, under a hard ceiling of bytes.

One thread at a time, else RuntimeError; a closed one is a ValueError. Its sets and grounds outlive it, and may be read by
any thread. A context manager: close() at the end.)")
        .def(py::init(&make_pager), py::arg("source"), py::kw_only(),
             py::arg("memory_bytes") = defaults.memory_bytes,
             py::arg("worker_count") = defaults.worker_count, py::arg("horizon") = defaults.horizon,
             py::arg("contact_spacing") = defaults.contact_spacing,
             py::arg("contact_share") = defaults.contact_share, py::arg("policy") = "deadline",
             py::arg("distance_radius") = defaults.distance_radius,
             py::arg("load_timeout") = defaults.load_timeout,
             R"(A pager of a source.

memory_bytes     ceiling of resident chunks and loads in flight together
worker_count     loader threads; 0 loads inside update(), so that every run is the same
horizon          seconds that motion is predicted, 0 to 3600
contact_spacing  ground answers at the coarsest level with at most this spacing, metres; 0: the finest
contact_share    share of the ceiling that is reserved for contact, 0 to 1
policy           "deadline", or "distance" for comparison
distance_radius  of "distance": radius over that of a camera's need
load_timeout     of a load, seconds

Raises ValueError for a setting out of range, MemoryError where the ceiling does not hold the root squares.)")
        .def(
            "update", &update_pager, py::arg("time_s"),
            py::arg("cameras") = std::vector<CameraNeed>(), py::arg("bodies") = py::none(),
            R"(Inserts arrived chunks, requests what is needed next, evicts. Never waits where worker_count > 0.

time_s   seconds on any clock that does not go back
cameras  a list of Camera
bodies   a World, BodyNeeds or None)")
        .def(
            "require",
            [](PagerUse& pager, const std::array<double, 4>& region, double deadline_s) {
                return pager.change()->require({region[0], region[1], region[2], region[3]},
                                               deadline_s);
            },
            py::arg("region"), py::arg("deadline_s") = 0.0,
            R"(Requests all ground of a rectangle at contact level, and keeps it until release(). Returns a ticket.

region  west, south, east, north, metres)")
        .def(
            "state_of",
            [](PagerUse& pager, Pager::Ticket ticket) {
                return make_answer("TicketState", static_cast<int>(pager.read()->state_of(ticket)));
            },
            py::arg("ticket"), "The TicketState of a required region.")
        .def(
            "is_ready",
            [](PagerUse& pager, Pager::Ticket ticket) { return pager.read()->is_ready(ticket); },
            py::arg("ticket"), "Whether all of a required region is resident.")
        .def(
            "release",
            [](PagerUse& pager, Pager::Ticket ticket) { pager.change()->release(ticket); },
            py::arg("ticket"), "Lets go of a required region.")
        .def(
            "finish",
            [](PagerUse& pager) {
                const auto use = pager.change();
                without_lock([&] { use->finish(); });
            },
            "Loads until all needs of the last update() are resident or cannot be. Blocks, without "
            "the lock.")
        .def(
            "ground",
            [](PagerUse& pager) {
                const auto use = pager.read();
                return Ground(use->resident(), use->contact_level());
            },
            "The Ground of the chunks that are resident now: a snapshot.")
        .def_property_readonly(
            "resident", [](PagerUse& pager) { return Resident{pager.read()->resident()}; },
            "The ResidentSet of now: a snapshot.")
        .def_property_readonly(
            "contact_level", [](PagerUse& pager) { return pager.read()->contact_level(); },
            "The level that ground answers at; 0 is the coarsest.")
        .def_property_readonly("stats", &stats_of, "Counts: PagerStats.")
        .def_property_readonly(
            "last_failure", [](PagerUse& pager) { return pager.read()->last_failure(); },
            "The message of the last failed load; empty if none has failed.")
        .def("close", &PagerUse::close, "Stops its threads. Nothing where it is closed.")
        .def_property_readonly("closed", &PagerUse::is_closed, "Whether close() was called.")
        .def("__enter__", [](py::object self) { return self; })
        .def("__exit__", [](PagerUse& pager, const py::args&) { pager.close(); });
}

}  // namespace terrane::python
