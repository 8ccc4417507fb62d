// SPDX-License-Identifier: MIT
#include "ground/height_arrays.h"
#include "ground/pager.h"
#include "values/errors.h"

#include <terrane/terrain/ground.h>

namespace terrane::python {
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
    const bool is_ok = answer.status == GroundStatus::ok;
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
            const bool is_ok = answer.status == GroundStatus::ok;
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

}  // namespace terrane::python
