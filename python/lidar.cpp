// SPDX-License-Identifier: MIT
//
// Range scans of the ground and the bodies of a world.
#include "bodies.h"
#include "conversions.h"
#include "terrain.h"

#include <terrane/collision/lidar.h>

#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace terrane::python {
namespace {

using HeldLidar = Guarded<Lidar>;

std::shared_ptr<HeldLidar> make_lidar(const py::object& directions, double min_range,
                                      double max_range, int worker_count) {
    const Rows rows(directions, "directions", 3);
    std::vector<Eigen::Vector3d> vectors(rows.count());
    for (std::size_t i = 0; i < vectors.size(); ++i) vectors[i] = rows.vector(i);
    const LidarSettings settings{
        .min_range = min_range, .max_range = max_range, .worker_count = worker_count};
    return std::make_shared<HeldLidar>("Lidar", value_or_raise(Lidar::create(settings, vectors)));
}

py::object scan(HeldLidar& lidar, const Ground& ground, const py::object& position,
                const py::object& rotation, const std::shared_ptr<HeldWorld>& world,
                std::uint32_t layers, std::uint64_t except, bool include_sensors,
                bool include_ground) {
    const Pose pose = read_pose(position, rotation);
    const QueryFilter filter{.layers = layers,
                             .except = body_of(except),
                             .include_sensors = include_sensors,
                             .include_ground = include_ground};
    const auto use = lidar.change();
    std::optional<HeldWorld::Use> bodies_of;
    if (world != nullptr) bodies_of.emplace(*world, false);
    const std::size_t size = use->count();
    const auto count = static_cast<py::ssize_t>(size);
    py::array_t<double> range(count);
    py::array_t<double> point({count, py::ssize_t{3}});
    py::array_t<double> normal({count, py::ssize_t{3}});
    py::array_t<std::uint64_t> body(count);
    py::array_t<std::uint32_t> part(count);
    py::array_t<std::int8_t> status(count);
    std::vector<BodyId> bodies(size);
    std::vector<LidarStatus> statuses(size);
    const LidarArrays arrays{.ranges = {range.mutable_data(), size},
                             .points_world = {point.mutable_data(), 3 * size},
                             .normals_world = {normal.mutable_data(), 3 * size},
                             .bodies = bodies,
                             .parts = {part.mutable_data(), size},
                             .statuses = statuses};
    std::uint64_t* const body_out = body.mutable_data();
    std::int8_t* const status_out = status.mutable_data();
    value_or_raise(without_lock([&] {
        Result<void> done =
            use->scan(ground, bodies_of ? &**bodies_of : nullptr, pose, arrays, filter);
        for (std::size_t i = 0; i < size; ++i) {
            body_out[i] = number_of(bodies[i]);
            status_out[i] = static_cast<std::int8_t>(statuses[i]);
        }
        return done;
    }));
    return make_answer("LidarScan", range, point, normal, body, part, status);
}

BodyNeeds need(HeldLidar& lidar, const py::object& position, const py::object& velocity) {
    const Pose pose{Eigen::Matrix3d::Identity(), read_vector(position, "position")};
    return {{lidar.read()->need(pose, read_vector(velocity, "velocity"))}};
}

py::object make_grid(int azimuth_count, double first_azimuth, double azimuth_step,
                     int elevation_count, double first_elevation, double elevation_step) {
    const std::vector<Eigen::Vector3d> directions =
        value_or_raise(make_lidar_grid({.azimuth_count = azimuth_count,
                                        .first_azimuth = first_azimuth,
                                        .azimuth_step = azimuth_step,
                                        .elevation_count = elevation_count,
                                        .first_elevation = first_elevation,
                                        .elevation_step = elevation_step}));
    py::array_t<double> array({static_cast<py::ssize_t>(directions.size()), py::ssize_t{3}});
    double* out = array.mutable_data();
    for (const Eigen::Vector3d& direction : directions) {
        write_vector(direction, out);
        out += 3;
    }
    return array;
}

}  // namespace

void bind_lidar(py::module_& module) {
    const LidarGridSettings grid;
    module.def(
        "lidar_grid", &make_grid, py::kw_only(), py::arg("azimuth_count") = grid.azimuth_count,
        py::arg("first_azimuth") = grid.first_azimuth, py::arg("azimuth_step") = grid.azimuth_step,
        py::arg("elevation_count") = grid.elevation_count,
        py::arg("first_elevation") = grid.first_elevation,
        py::arg("elevation_step") = grid.elevation_step,
        R"(Unit directions at equal angles, in a sensor's frame: float64 of shape (elevations * azimuths, 3).

Direction (azimuth i, elevation j) is row j * azimuth_count + i. Angles in radians; azimuth 0 is x, pi / 2 is y.
Raises ValueError for what is out of range.)");
    const LidarSettings defaults;
    const QueryFilter filter;
    py::class_<HeldLidar, std::shared_ptr<HeldLidar>>(
        module, "Lidar",
        R"(A range scanner: all its rays start at one moment from one pose. Without noise, divergence and motion.

One thread at a time, else RuntimeError; a closed one is a ValueError. A context manager.)")
        .def(py::init(&make_lidar), py::arg("directions"), py::kw_only(),
             py::arg("min_range") = defaults.min_range, py::arg("max_range") = defaults.max_range,
             py::arg("worker_count") = defaults.worker_count,
             R"(A scanner with directions in its own frame.

directions    unit vectors, shape (n, 3): lidar_grid() makes them
min_range     metres; nothing nearer is seen
max_range     metres; nothing farther is seen
worker_count  threads of scan(), 1 to 64

Raises ValueError for what is out of range.)")
        .def("scan", &scan, py::arg("ground"), py::arg("position"),
             py::arg("rotation") = py::none(), py::arg("world") = py::none(), py::kw_only(),
             py::arg("layers") = filter.layers, py::arg("except_body") = kNoBody,
             py::arg("include_sensors") = filter.include_sensors,
             py::arg("include_ground") = filter.include_ground,
             R"(Scans the ground, and the bodies of a world: LidarScan. Without the lock.

position, rotation  of the sensor: shape (3,), metres; None, a matrix (3, 3) or a unit quaternion w, x, y, z
world               a World, or None for the ground alone
layers, except_body, include_sensors, include_ground  as of World.rays())")
        .def("need", &need, py::arg("position"),
             py::arg("velocity") = py::make_tuple(0.0, 0.0, 0.0),
             R"(What a Terrain must keep resident for a scan: BodyNeeds, to add to World.needs().

position  of the sensor: shape (3,), metres
velocity  of the sensor until the scan: shape (3,), metres a second, world axes)")
        .def("__len__", [](HeldLidar& self) { return self.read()->count(); })
        .def("close", &HeldLidar::close, "Stops its threads. Nothing where it is closed.")
        .def_property_readonly("closed", &HeldLidar::is_closed, "Whether close() was called.")
        .def("__enter__", [](py::object self) { return self; })
        .def("__exit__", [](HeldLidar& self, const py::args&) { self.close(); });
}

}  // namespace terrane::python
