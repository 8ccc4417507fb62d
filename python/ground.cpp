// SPDX-License-Identifier: MIT
#include "conversions.h"
#include "guarded.h"
#include "terrain.h"

#include <terrane/terrain/ground.h>
#include <terrane/terrain/ground_batch.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace terrane::python {

/// An output array: a new one, or a field of the caller's `out`, which must have the type, layout and shape of a new
/// one.
///
/// Fails: TypeError for another type or layout, ValueError for another shape or a read-only array
template <class T>
py::array_t<T> output(const py::object& out, const char* field,
                      const std::vector<py::ssize_t>& shape) {
    if (out.is_none()) return py::array_t<T>(shape);
    const py::object given = out.attr(field);
    const std::string name = std::string("out.") + field;
    if (!py::isinstance<py::array_t<T, py::array::c_style>>(given))
        throw py::type_error(name + " must be a C-contiguous array of " +
                             py::cast<std::string>(py::str(py::dtype::of<T>())));
    auto array = py::reinterpret_borrow<py::array_t<T>>(given);
    if (shape_of(array) != shape)
        throw py::value_error(name + " has the shape " + shape_text(array) +
                              ", which is not that of the answers");
    if (!array.writeable()) throw py::value_error(name + " is read only");
    return array;
}

/// The arrays of terrane.Heights. Threads: write() may run without the interpreter lock.
struct HeightOutputs {
    HeightOutputs(const py::object& out, const std::vector<py::ssize_t>& shape)
        : height(output<double>(out, "height", shape)),
          normal(output<double>(out, "normal", with_axis(shape))),
          error_m(output<double>(out, "error_m", shape)),
          filled(output<bool>(out, "filled", shape)),
          status(output<std::int8_t>(out, "status", shape)) {}

    /// The caller's `out`, or new Heights.
    py::object answer(const py::object& out) const {
        if (!out.is_none()) return out;
        return make_answer("Heights", height, normal, error_m, filled, status);
    }

    py::array_t<double> height, normal, error_m;
    py::array_t<bool> filled;
    py::array_t<std::int8_t> status;

private:
    static std::vector<py::ssize_t> with_axis(std::vector<py::ssize_t> shape) {
        shape.push_back(3);
        return shape;
    }
};

namespace {

// Where a batch writes its answers.
struct HeightColumns {
    double* height;
    double* normal;
    double* error_m;
    bool* filled;
    std::int8_t* status;
};

void write_height(const HeightAnswer& answer, py::ssize_t i, const HeightColumns& out) {
    const bool is_ok = answer.status == QueryStatus::ok;
    out.height[i] = is_ok ? answer.height : kNaN;
    write_vector(is_ok ? answer.normal : Eigen::Vector3d::Constant(kNaN), out.normal + 3 * i);
    out.error_m[i] = is_ok ? answer.error_m : kNaN;
    out.filled[i] = is_ok && answer.filled;
    out.status[i] = static_cast<std::int8_t>(answer.status);
}

template <class Ask>
py::object answer_heights(const Doubles& x, const Doubles& y, const py::object& out, Ask ask) {
    check_same_shape(x, "x", y, "y");
    HeightOutputs outputs(out, shape_of(x));
    const HeightColumns columns{outputs.height.mutable_data(), outputs.normal.mutable_data(),
                                outputs.error_m.mutable_data(), outputs.filled.mutable_data(),
                                outputs.status.mutable_data()};
    const py::ssize_t count = x.size();
    without_lock([&] {
        for (py::ssize_t i = 0; i < count; ++i) write_height(ask(i), i, columns);
    });
    return outputs.answer(out);
}

py::object heights(const Ground& ground, const py::object& x, const py::object& y,
                   const py::object& out) {
    const Doubles xs = read_doubles(x, "x");
    const Doubles ys = read_doubles(y, "y");
    const double* from_x = xs.data();
    const double* from_y = ys.data();
    return answer_heights(xs, ys, out,
                          [&](py::ssize_t i) { return ground.height(from_x[i], from_y[i]); });
}

py::object heights_below(const Ground& ground, const py::object& x, const py::object& y,
                         const py::object& z, const py::object& out) {
    const Doubles xs = read_doubles(x, "x");
    const Doubles ys = read_doubles(y, "y");
    const Doubles zs = read_doubles(z, "z");
    check_same_shape(xs, "x", zs, "z");
    const double* from_x = xs.data();
    const double* from_y = ys.data();
    const double* from_z = zs.data();
    return answer_heights(xs, ys, out, [&](py::ssize_t i) {
        return ground.height_below(from_x[i], from_y[i], from_z[i]);
    });
}

py::object rays(const Ground& ground, const py::object& from, const py::object& to) {
    const Rows starts(from, "from_world", 3);
    const Rows ends(to, "to_world", 3);
    const Batch batch({&starts, &ends});
    py::array_t<double> fraction = batch.make<double>();
    py::array_t<double> point = batch.make<double>({3});
    py::array_t<double> normal = batch.make<double>({3});
    py::array_t<double> error_m = batch.make<double>();
    py::array_t<bool> filled = batch.make<bool>();
    py::array_t<std::int8_t> status = batch.make<std::int8_t>();
    double* const fraction_out = fraction.mutable_data();
    double* const point_out = point.mutable_data();
    const HeightColumns columns{fraction_out, normal.mutable_data(), error_m.mutable_data(),
                                filled.mutable_data(), status.mutable_data()};
    without_lock([&] {
        for (std::size_t i = 0; i < batch.count(); ++i) {
            const RayAnswer answer = ground.ray(starts.vector(i), ends.vector(i));
            const HeightAnswer common{answer.status, answer.fraction, answer.normal, answer.error_m,
                                      answer.filled};
            write_height(common, static_cast<py::ssize_t>(i), columns);
            const bool is_ok = answer.status == QueryStatus::ok;
            write_vector(is_ok ? answer.point_world : WorldPos::Constant(kNaN), point_out + 3 * i);
        }
    });
    return make_answer("Rays", fraction, point, normal, error_m, filled, status);
}

Ground make_ground(const Resident& resident, int contact_level) {
    const int finest = resident.set->lattice().finest_level;
    if (contact_level < 0 || contact_level > finest)
        throw py::value_error("contact_level must be 0 to " + std::to_string(finest) + ", got " +
                              std::to_string(contact_level));
    return Ground(resident.set, contact_level);
}

}  // namespace

void bind_ground(py::module_& module) {
    py::class_<Ground>(
        module, "Ground",
        R"(The contact surface of resident chunks at one level. Immutable; any number of threads; outlives its pager.

Absent ground is a status and NaN, never height 0. Batches run without the interpreter lock.)")
        .def(
            py::init(&make_ground), py::arg("resident"), py::arg("contact_level"),
            "The ground of a ResidentSet at a level; ValueError for a level that it does not have.")
        .def(
            "heights", &heights, py::arg("x"), py::arg("y"), py::kw_only(),
            py::arg("out") = py::none(),
            R"(The surface over places, the highest one where volumes fold it: Heights in the shape of x.

x, y  world, metres, of one shape (S). C-contiguous float64 arrays are read in place; others are copied once
out   Heights of a call before, whose arrays are written again

Cost: some 50 ns a place.)")
        .def("heights_below", &heights_below, py::arg("x"), py::arg("y"), py::arg("z"),
             py::kw_only(), py::arg("out") = py::none(),
             "The highest surface at or below heights z, metres: as heights(); status miss where "
             "there is none.")
        .def("rays", &rays, py::arg("from_world"), py::arg("to_world"),
             R"(The first intersections of segments with the surface, from above or below: Rays.

from_world, to_world  shape (n, 3), or (3,) for one point that all share, metres. Two of shape (3,) are one ray, and its
                      answer has no leading axis)");
}

// Multithreaded batches of heights and rays.

namespace {

using HeldBatch = Guarded<GroundBatch>;

// An element of a numpy bool array is a byte that is 0 or 1.
std::span<std::uint8_t> bytes_of(py::array_t<bool>& array) {
    return {reinterpret_cast<std::uint8_t*>(array.mutable_data()),
            static_cast<std::size_t>(array.size())};
}

std::span<double> numbers_of(py::array_t<double>& array) {
    return {array.mutable_data(), static_cast<std::size_t>(array.size())};
}

void write_statuses(const std::vector<QueryStatus>& statuses, std::int8_t* out) {
    std::transform(statuses.begin(), statuses.end(), out,
                   [](QueryStatus status) { return static_cast<std::int8_t>(status); });
}

py::object batch_heights(HeldBatch& batch, const Ground& ground, const py::object& x,
                         const py::object& y, const py::object& out) {
    const Doubles xs = read_doubles(x, "x");
    const Doubles ys = read_doubles(y, "y");
    check_same_shape(xs, "x", ys, "y");
    HeightOutputs outputs(out, shape_of(xs));
    const auto count = static_cast<std::size_t>(xs.size());
    std::vector<QueryStatus> statuses(count);
    const PointArray points = PointArray::separate({xs.data(), count}, {ys.data(), count});
    const HeightArrays arrays{.heights = numbers_of(outputs.height),
                              .normals = numbers_of(outputs.normal),
                              .errors_m = numbers_of(outputs.error_m),
                              .statuses = statuses,
                              .filled = bytes_of(outputs.filled)};
    std::int8_t* const status_out = outputs.status.mutable_data();
    const auto use = batch.change();
    value_or_raise(without_lock([&] {
        Result<void> done = use->heights(ground, points, arrays);
        write_statuses(statuses, status_out);
        return done;
    }));
    return outputs.answer(out);
}

PointArray points_of(const Rows& rows, const WorldPos& shared, std::size_t count) {
    if (rows.is_shared()) return PointArray::repeated(shared, count);
    return PointArray::interleaved_xyz({rows[0], 3 * count});
}

py::object batch_rays(HeldBatch& batch, const Ground& ground, const py::object& from,
                      const py::object& to) {
    const Rows starts(from, "from_world", 3);
    const Rows ends(to, "to_world", 3);
    const Batch rows({&starts, &ends});
    auto fraction = rows.make<double>();
    auto point = rows.make<double>({3});
    auto normal = rows.make<double>({3});
    auto error_m = rows.make<double>();
    auto filled = rows.make<bool>();
    auto status = rows.make<std::int8_t>();
    std::vector<QueryStatus> statuses(rows.count());
    const WorldPos start = starts.is_shared() ? starts.vector(0) : WorldPos::Zero();
    const WorldPos end = ends.is_shared() ? ends.vector(0) : WorldPos::Zero();
    const PointArray from_points = points_of(starts, start, rows.count());
    const PointArray to_points = points_of(ends, end, rows.count());
    const RayArrays arrays{.fractions = numbers_of(fraction),
                           .points_world = numbers_of(point),
                           .normals = numbers_of(normal),
                           .errors_m = numbers_of(error_m),
                           .statuses = statuses,
                           .filled = bytes_of(filled)};
    std::int8_t* const status_out = status.mutable_data();
    const auto use = batch.change();
    value_or_raise(without_lock([&] {
        Result<void> done = use->rays(ground, from_points, to_points, arrays);
        write_statuses(statuses, status_out);
        return done;
    }));
    return make_answer("Rays", fraction, point, normal, error_m, filled, status);
}

}  // namespace

void bind_batches(py::module_& module) {
    py::class_<HeldBatch, std::shared_ptr<HeldBatch>>(
        module, "GroundBatch",
        R"(Heights and rays of many points on several threads: the answers of Ground.heights() and Ground.rays(), bit for bit.

Keep one and use it again. One thread at a time, else RuntimeError; a closed one is a ValueError. A context manager.)")
        .def(py::init([](int worker_count) {
                 return std::make_shared<HeldBatch>(
                     "GroundBatch",
                     value_or_raise(GroundBatch::create({.worker_count = worker_count})));
             }),
             py::kw_only(), py::arg("worker_count") = 1,
             "A batch with threads of its own, the caller's included, 1 to 64; ValueError out of "
             "range.")
        .def("heights", &batch_heights, py::arg("ground"), py::arg("x"), py::arg("y"),
             py::kw_only(), py::arg("out") = py::none(),
             "As Ground.heights(): Heights. Without the lock.")
        .def("rays", &batch_rays, py::arg("ground"), py::arg("from_world"), py::arg("to_world"),
             "As Ground.rays(): Rays. Without the lock.")
        .def("close", &HeldBatch::close, "Stops its threads. Nothing where it is closed.")
        .def_property_readonly("closed", &HeldBatch::is_closed, "Whether close() was called.")
        .def("__enter__", [](py::object self) { return self; })
        .def("__exit__", [](HeldBatch& self, const py::args&) { self.close(); });
}

}  // namespace terrane::python
