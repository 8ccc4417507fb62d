// SPDX-License-Identifier: MIT
#include "terrain.h"

#include "conversions.h"
#include "guarded.h"

#include <pybind11/stl.h>

#include <array>
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

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
            value_or_raise(view.validate());
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
            "What it counts for under the ceiling of a Terrain.");
}

}  // namespace

void bind_resident(py::module_& module) {
    bind_chunk(module);
    py::class_<Resident>(module, "ResidentSet",
                         "A snapshot of resident chunks. Immutable; outlives its Terrain.")
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
            "Counts the changes of the set: sets of one Terrain with equal epochs are equal.")
        .def_property_readonly(
            "has_roots", [](const Resident& resident) { return resident.set->has_roots(); },
            "Whether all root squares are resident: without them nothing is drawn.");
}

#if !TERRANE_PYTHON_RENDER
std::vector<TriangleDemand> demands_of(py::handle, const View&, double) {
    throw py::type_error("scene must be None: this Terrane was built without 'render'");
}
#endif

namespace {

// A region that a terrain keeps resident, as held by Python: a key of HeldTerrain::regions.
struct HeldRegion {
    std::shared_ptr<TerrainUse> terrain;
    std::uint64_t key;

    RegionState state() const {
        const auto use = terrain->held.read();
        const auto found = use->regions.find(key);
        return found == use->regions.end() ? RegionState::released : found->second.state();
    }
};

constexpr std::array<std::pair<const char*, PagingPolicy>, 2> kPolicies{
    {{"deadline", PagingPolicy::deadline}, {"distance", PagingPolicy::distance}}};

std::shared_ptr<TerrainUse> make_terrain(const Source& source, std::size_t memory_bytes,
                                         int worker_count, double horizon, double contact_spacing,
                                         double contact_share, const std::string& policy,
                                         double distance_radius, double load_timeout,
                                         std::size_t triangle_budget, double max_error_px,
                                         double morph_ratio, int mesh_worker_count,
                                         std::size_t open_chunks) {
    const TerrainSettings settings{.paging = {.memory_bytes = memory_bytes,
                                              .worker_count = worker_count,
                                              .horizon = horizon,
                                              .contact_spacing = contact_spacing,
                                              .contact_share = contact_share,
                                              .policy = read_choice(policy, "policy", kPolicies),
                                              .distance_radius = distance_radius,
                                              .load_timeout = load_timeout},
                                   .meshes = {.triangle_budget = triangle_budget,
                                              .max_error_px = max_error_px,
                                              .morph_ratio = morph_ratio,
                                              .worker_count = mesh_worker_count,
                                              .open_chunks = open_chunks}};
    Terrain made =
        value_or_raise(without_lock([&] { return Terrain::create(source.heights, settings); }));
    return std::shared_ptr<TerrainUse>(new TerrainUse{
        .held = {"Terrain", {.terrain = std::move(made)}}, .meshes = settings.meshes});
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

py::object frame_of(const std::shared_ptr<TerrainUse>& terrain, const Frame& frame) {
    py::tuple meshes(frame.meshes.size());
    for (std::size_t i = 0; i < frame.meshes.size(); ++i) {
        meshes[i] =
            py::cast(Mesh{.terrain = terrain, .update = terrain->updates, .mesh = frame.meshes[i]});
    }
    return make_answer("Frame", frame.ground, meshes, frame.late_chunks, frame.groundless_bodies);
}

// Terrain::update() or load().
using Advance = const Frame& (Terrain::*)(std::span<const Camera>, std::span<const BodyNeed>,
                                          double);

template <Advance advance>
py::object frame_at(const std::shared_ptr<TerrainUse>& terrain, std::vector<Camera> cameras,
                    const BodyNeeds* bodies, double time_s, const py::object& scene) {
    if (!std::isfinite(time_s)) throw py::value_error("time_s must be finite");
    std::span<const BodyNeed> needs;
    if (bodies != nullptr) needs = bodies->needs;
    std::vector<std::vector<TriangleDemand>> demands(scene.is_none() ? 0 : cameras.size());
    for (std::size_t i = 0; i < demands.size(); ++i) {
        demands[i] = demands_of(scene, cameras[i].view, terrain->meshes.max_error_px);
        cameras[i].demands = demands[i];
    }
    const auto use = terrain->held.change();
    ++terrain->updates;
    return frame_of(
        terrain, *without_lock([&] { return &(use->terrain.*advance)(cameras, needs, time_s); }));
}

HeldRegion require(const std::shared_ptr<TerrainUse>& terrain, const std::array<double, 4>& region,
                   double deadline_s) {
    const auto use = terrain->held.change();
    const std::uint64_t key = ++use->last_region;
    use->regions[key] =
        use->terrain.require({region[0], region[1], region[2], region[3]}, deadline_s);
    return {terrain, key};
}

py::object stats_of(TerrainUse& terrain) {
    const PagerStats stats = terrain.held.read()->terrain.pager().stats();
    return make_answer(
        "PagerStats", stats.resident_bytes, stats.in_flight_bytes, stats.resident_chunks,
        stats.late_chunks, stats.fading_chunks, stats.groundless_bodies, stats.peak_bytes,
        stats.loaded, stats.evicted, stats.reloaded, stats.cancelled, stats.failed, stats.timed_out,
        stats.refused_needs, stats.cut_needs, stats.over_ceiling, stats.hard_evictions,
        stats.bytes_read, stats.bytes_used, stats.bytes_awaited);
}

void bind_needs(py::module_& module) {
    py::class_<Camera>(module, "Camera", "A camera of a Terrain. Immutable.")
        .def(py::init([](const View& view, const py::object& velocity) {
                 return Camera{.view = view, .velocity = read_vector(velocity, "velocity")};
             }),
             py::arg("view"), py::arg("velocity") = py::make_tuple(0.0, 0.0, 0.0),
             R"(A camera with a view.

velocity  shape (3,), metres a second, world axes)")
        .def_readonly("view", &Camera::view, "Where it is, and what it sees.")
        .def_property_readonly(
            "velocity", [](const Camera& camera) { return to_array(camera.velocity); },
            "Shape (3,), metres a second, world axes.");
    py::class_<BodyNeeds>(module, "BodyNeeds", "Bodies that touch ground, or may soon.")
        .def(py::init(&make_needs), py::arg("centre_world"),
             py::arg("velocity") = py::make_tuple(0.0, 0.0, 0.0), py::arg("radius") = 1.0,
             R"(Bounding spheres of bodies; those of a World are its needs().

centre_world  shape (n, 3), metres
velocity      shape (n, 3) or (3,), metres a second, world axes
radius        shape (n,) or one number, metres)")
        .def(
            "__add__",
            [](BodyNeeds sum, const BodyNeeds& others) {
                sum.needs.insert(sum.needs.end(), others.needs.begin(), others.needs.end());
                return sum;
            },
            py::is_operator(), "The bodies of both.")
        .def("__len__", [](const BodyNeeds& bodies) { return bodies.needs.size(); });
    py::class_<HeldRegion>(module, "RequiredRegion",
                           "Ground that Terrain.require() keeps resident until release().")
        .def_property_readonly(
            "state",
            [](const HeldRegion& region) {
                return make_answer("RegionState", static_cast<int>(region.state()));
            },
            "What has become of the requirement: RegionState.")
        .def_property_readonly(
            "is_ready",
            [](const HeldRegion& region) { return region.state() == RegionState::ready; },
            "Whether all of its ground is resident.")
        .def(
            "release",
            [](const HeldRegion& region) {
                region.terrain->held.change()->regions.erase(region.key);
            },
            "Ends the requirement; its ground may be evicted from then on.");
}

}  // namespace

void bind_terrain(py::module_& module) {
    bind_needs(module);
    const PagerSettings paging;
    const TriangulatorSettings meshes;
    py::class_<TerrainUse, std::shared_ptr<TerrainUse>>(
        module, "Terrain",
        R"(Ground to see and to stand on: keeps the chunks resident that cameras draw and bodies touch, under a hard ceiling of
bytes, and triangulates the view of each camera within a triangle budget.

One thread at a time, else RuntimeError; a closed one is a ValueError. Grounds and resident sets outlive it, and may be
read by any thread. A context manager: close() at the end.)")
        .def(py::init(&make_terrain), py::arg("source"), py::kw_only(),
             py::arg("memory_bytes") = paging.memory_bytes,
             py::arg("worker_count") = paging.worker_count, py::arg("horizon") = paging.horizon,
             py::arg("contact_spacing") = paging.contact_spacing,
             py::arg("contact_share") = paging.contact_share, py::arg("policy") = "deadline",
             py::arg("distance_radius") = paging.distance_radius,
             py::arg("load_timeout") = paging.load_timeout,
             py::arg("triangle_budget") = meshes.triangle_budget,
             py::arg("max_error_px") = meshes.max_error_px,
             py::arg("morph_ratio") = meshes.morph_ratio,
             py::arg("mesh_worker_count") = meshes.worker_count,
             py::arg("open_chunks") = meshes.open_chunks,
             R"(The terrain of a HeightSource.

memory_bytes     ceiling of resident chunks and loads in flight together
worker_count     loader threads; 0 loads inside update(), so that every run is the same
horizon          seconds that motion is predicted, 0 to 3600
contact_spacing  ground answers at the coarsest level with at most this spacing, metres; 0: the finest
contact_share    share of the ceiling that is reserved for contact, 0 to 1
policy           "deadline", or "distance" for comparison
distance_radius  of "distance": radius over that of a camera's need
load_timeout     of a load, seconds
triangle_budget  hard limit of each camera's mesh, at least 2 for each root square
max_error_px     refinement stops below this, pixels, > 0
morph_ratio      1 (no morphing) to 16
mesh_worker_count  threads of triangulation, 1 to 64
open_chunks      refined chunks of a mesh that can be processed without allocating

Raises ValueError for a setting out of range, MemoryError where the ceiling does not hold the root squares.)")
        .def(
            "update", &frame_at<&Terrain::update>, py::arg("cameras"), py::arg("bodies"),
            py::arg("time_s"), py::arg("scene") = py::none(),
            R"(Pages and triangulates for one Frame. Never waits for loads where worker_count > 0. Without the lock.

cameras  a list of Camera, identified by their index
bodies   World.needs(), BodyNeeds or None
time_s   seconds on any clock that does not go back
scene    a Scene whose objects share the triangle budget of each mesh, or None)")
        .def("load", &frame_at<&Terrain::load>, py::arg("cameras"), py::arg("bodies"),
             py::arg("time_s"), py::arg("scene") = py::none(),
             "As update(), then loads until all needs are resident or cannot be. Blocks: for the "
             "first Frame.")
        .def("require", &require, py::arg("region"), py::arg("deadline_s") = 0.0,
             R"(Requests all ground of a rectangle at contact level, and keeps it: RequiredRegion.

region      west, south, east, north, metres
deadline_s  when it is needed, on the clock of update())")
        .def_property_readonly(
            "frame",
            [](const std::shared_ptr<TerrainUse>& terrain) {
                return frame_of(terrain, terrain->held.read()->terrain.frame());
            },
            "The Frame of the last update. Before the first one nothing is resident.")
        .def_property_readonly(
            "resident",
            [](TerrainUse& terrain) {
                return Resident{terrain.held.read()->terrain.pager().resident()};
            },
            "The ResidentSet of now: a snapshot.")
        .def_property_readonly(
            "contact_level",
            [](TerrainUse& terrain) {
                return terrain.held.read()->terrain.pager().contact_level();
            },
            "The level that ground answers at; 0 is the coarsest.")
        .def_property_readonly("stats", &stats_of, "Counts of paging: PagerStats.")
        .def_property_readonly(
            "last_failure",
            [](TerrainUse& terrain) { return terrain.held.read()->terrain.pager().last_failure(); },
            "The message of the last failed load; empty if none has failed.")
        .def(
            "close", [](TerrainUse& terrain) { terrain.held.close(); },
            "Stops its threads, frees its buffers. Nothing where it is closed.")
        .def_property_readonly(
            "closed", [](const TerrainUse& terrain) { return terrain.held.is_closed(); },
            "Whether close() was called.")
        .def("__enter__", [](py::object self) { return self; })
        .def("__exit__", [](TerrainUse& terrain, const py::args&) { terrain.held.close(); });
}

}  // namespace terrane::python
