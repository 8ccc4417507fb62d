// SPDX-License-Identifier: MIT
// Heights and rays on several threads.
#include "ground/height_arrays.h"
#include "ground/pager.h"
#include "values/guarded.h"

#include <terrane/terrain/ground_batch.h>

#include <algorithm>
#include <memory>
#include <span>

namespace terrane::python {
namespace {

using HeldBatch = Guarded<GroundBatch>;

// numpy's bool is a byte that is 0 or 1.
std::span<std::uint8_t> bytes_of(py::array_t<bool>& array) {
    return {reinterpret_cast<std::uint8_t*>(array.mutable_data()),
            static_cast<std::size_t>(array.size())};
}

std::span<double> numbers_of(py::array_t<double>& array) {
    return {array.mutable_data(), static_cast<std::size_t>(array.size())};
}

void write_statuses(const std::vector<GroundStatus>& statuses, std::int8_t* out) {
    std::transform(statuses.begin(), statuses.end(), out,
                   [](GroundStatus status) { return static_cast<std::int8_t>(status); });
}

py::object batch_heights(HeldBatch& batch, const Ground& ground, const py::object& x,
                         const py::object& y, const py::object& out) {
    const Doubles xs = read_doubles(x, "x");
    const Doubles ys = read_doubles(y, "y");
    check_same_shape(xs, "x", ys, "y");
    HeightOutputs outputs(out, shape_of(xs));
    const auto count = static_cast<std::size_t>(xs.size());
    std::vector<GroundStatus> statuses(count);
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
    std::vector<GroundStatus> statuses(rows.count());
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
