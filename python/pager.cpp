// SPDX-License-Identifier: MIT
#include "conversions.h"
#include "guarded.h"
#include "terrain.h"

#include <terrane/terrain/ground.h>

#include <pybind11/stl.h>

namespace terrane::python {

void bind_views(py::module_& module) {
    py::class_<View>(module, "View", "What a camera sees. Immutable: look_at() makes one.")
        .def_property_readonly(
            "eye_world", [](const View& view) { return to_array(view.eye_world); },
            "The viewpoint: shape (3,), world, metres.")
        .def_property_readonly(
            "forward", [](const View& view) { return to_array(view.forward); },
            "Unit direction of view: shape (3,), world axes.")
        .def_property_readonly(
            "up", [](const View& view) { return to_array(view.up); },
            "Unit vector, square to forward: shape (3,), world axes.")
        .def_readonly("vertical_fov", &View::vertical_fov,
                      "Angle that the picture's height spans, radians.")
        .def_readonly("width_px", &View::width_px, "Width of the picture, pixels.")
        .def_readonly("height_px", &View::height_px, "Height of the picture, pixels.")
        .def_readonly("near_distance", &View::near_distance,
                      "Least distance in screen errors, metres.")
        .def_property_readonly("pixels_per_radian", &View::pixels_per_radian,
                               "Pixels of the picture's centre that one radian spans.");
    const View defaults;
    module.def(
        "look_at",
        [](const py::object& eye, const py::object& target, double vertical_fov, int width_px,
           int height_px, double near_distance) {
            View view = value_or_raise(look_at(read_vector(eye, "eye_world"),
                                               read_vector(target, "target_world"), vertical_fov,
                                               width_px, height_px));
            view.near_distance = near_distance;
            value_or_raise(check(view));
            return view;
        },
        py::arg("eye_world"), py::arg("target_world"),
        py::arg("vertical_fov") = defaults.vertical_fov, py::arg("width_px") = defaults.width_px,
        py::arg("height_px") = defaults.height_px,
        py::arg("near_distance") = defaults.near_distance,
        R"(The View from a point to another; up is north for vertical directions.

eye_world, target_world  shape (3,), metres
vertical_fov             radians, between 0 and pi
near_distance            least distance in screen errors, metres

Raises ValueError where they coincide or a value is out of range or not finite.)");
}

namespace {

// A chunk, as Python holds it.
struct HeldChunk {
    std::shared_ptr<const Chunk> chunk;
    Lattice lattice;
};

py::array_t<std::int32_t> keys_of(const Resident& resident) {
    const auto chunks = resident.set->chunks();
    py::array_t<std::int32_t> keys({static_cast<py::ssize_t>(chunks.size()), py::ssize_t{3}});
    std::int32_t* out = keys.mutable_data();
    for (const ResidentChunk& chunk : chunks) {
        *out++ = chunk->key.level;
        *out++ = chunk->key.x;
        *out++ = chunk->key.y;
    }
    return keys;
}

HeldChunk chunk_of(const Resident& resident, std::size_t index) {
    const auto chunks = resident.set->chunks();
    if (index >= chunks.size())
        throw py::index_error("there are " + std::to_string(chunks.size()) +
                              " chunks, none of index " + std::to_string(index));
    return {chunks[index], resident.set->lattice()};
}

py::object flags_of(const py::object& self) {
    const auto& chunk = *py::cast<const HeldChunk&>(self).chunk;
    if (chunk.cell_flags.empty()) return py::none();
    return view_of(chunk.cell_flags.data(), {kChunkCells, kChunkCells}, self);
}

void bind_chunk(py::module_& module) {
    py::class_<HeldChunk>(module, "Chunk",
                          "One square of 129 x 129 heights with certified bounds. Immutable.")
        .def_property_readonly(
            "key",
            [](const HeldChunk& held) {
                const ChunkKey& key = held.chunk->key;
                return py::make_tuple(key.level, key.x, key.y);
            },
            "Level (0 is the coarsest), column and row.")
        .def_property_readonly(
            "origin",
            [](const HeldChunk& held) {
                const LatticePoint& corner = held.chunk->corner;
                return py::make_tuple(held.lattice.x(corner.x), held.lattice.y(corner.y));
            },
            "World x and y of the south-western sample, metres.")
        .def_property_readonly(
            "spacing",
            [](const HeldChunk& held) {
                return held.lattice.spacing * static_cast<double>(held.chunk->step);
            },
            "Between neighbouring samples, metres.")
        .def_property_readonly(
            "quantum", [](const HeldChunk& held) { return held.lattice.quantum; },
            "Metres of one unit of heights.")
        .def_property_readonly(
            "heights",
            [](const py::object& self) {
                return view_of(py::cast<const HeldChunk&>(self).chunk->heights.data(),
                               {kChunkSamples, kChunkSamples}, self);
            },
            "A view, not a copy: int32 of shape (129, 129) in quanta, row 0 south, column 0 west; "
            "read only.")
        .def_property_readonly(
            "cell_bounds",
            [](const py::object& self) {
                return view_of(py::cast<const HeldChunk&>(self).chunk->cell_bounds.data(),
                               {kChunkCells, kChunkCells}, self);
            },
            "A view: float32 of shape (128, 128), metres: the true surface is within this of a "
            "cell; read only.")
        .def_property_readonly("cell_flags", &flags_of,
                               "A view: uint8 of shape (128, 128), bits of CellFlag; None where "
                               "all cells are ground; read only.")
        .def_property_readonly(
            "bytes", [](const HeldChunk& held) { return held.chunk->bytes(); },
            "What it counts for under the pager's ceiling.");
}

}  // namespace

void bind_resident(py::module_& module) {
    bind_chunk(module);
    py::class_<Resident>(module, "ResidentSet",
                         "A snapshot of resident chunks. Immutable; outlives its pager.")
        .def("__len__", [](const Resident& resident) { return resident.set->chunks().size(); })
        .def("chunk", &chunk_of, py::arg("index"),
             "The Chunk of an index; IndexError where there is none.")
        .def_property_readonly("keys", &keys_of,
                               "Level, column and row of each chunk: int32 of shape (n, 3), by "
                               "level, then row, then column.")
        .def_property_readonly(
            "fades",
            [](const Resident& resident) {
                const auto fades = resident.set->fades();
                return py::array_t<float>(static_cast<py::ssize_t>(fades.size()), fades.data());
            },
            "Of each chunk: float32 of shape (n,), 0 (not drawn) to 1. Ground does not fade.")
        .def_property_readonly(
            "epoch", [](const Resident& resident) { return resident.set->epoch(); },
            "Counts the changes of the pager's set: sets of one pager with equal epochs are equal.")
        .def_property_readonly(
            "has_roots", [](const Resident& resident) { return resident.set->has_roots(); },
            "Whether all root squares are resident: without them nothing is drawn.");
}

namespace {

// A pager and its required regions by ticket: Python releases them by call.
struct TicketedPager : Pager {
    explicit TicketedPager(Pager&& pager) : Pager(std::move(pager)) {}

    std::map<std::uint64_t, RequiredRegion> regions = {};
    std::uint64_t next_ticket = 1;

    RegionState state_of(std::uint64_t ticket) const {
        const auto found = regions.find(ticket);
        return found == regions.end() ? RegionState::released : found->second.state();
    }
};
using PagerUse = Guarded<TicketedPager>;

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
    return std::make_shared<PagerUse>("Pager", TicketedPager(value_or_raise(without_lock([&] {
                                          return Pager::create(source.heights, settings);
                                      }))));
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
                const auto use = pager.change();
                const std::uint64_t ticket = use->next_ticket++;
                use->regions[ticket] =
                    use->require({region[0], region[1], region[2], region[3]}, deadline_s);
                return ticket;
            },
            py::arg("region"), py::arg("deadline_s") = 0.0,
            R"(Requests all ground of a rectangle at contact level, and keeps it until release(). Returns a ticket.

region  west, south, east, north, metres)")
        .def(
            "state_of",
            [](PagerUse& pager, std::uint64_t ticket) {
                return make_answer("RegionState", static_cast<int>(pager.read()->state_of(ticket)));
            },
            py::arg("ticket"), "The RegionState of a required region.")
        .def(
            "is_ready",
            [](PagerUse& pager, std::uint64_t ticket) {
                return pager.read()->state_of(ticket) == RegionState::ready;
            },
            py::arg("ticket"), "Whether all of a required region is resident.")
        .def(
            "release",
            [](PagerUse& pager, std::uint64_t ticket) { pager.change()->regions.erase(ticket); },
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
                return use->ground();
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
