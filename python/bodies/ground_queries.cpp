// SPDX-License-Identifier: MIT
// Contact of one shape at many poses with the ground.
#include "bodies/contact_columns.h"
#include "bodies/shapes.h"
#include "values/answers.h"
#include "values/arrays.h"
#include "values/errors.h"

#include <terrane/collision/ground_cast.h>

#include <limits>

namespace terrane::python {
namespace {

py::object contacts(const Ground& ground, const HeldShape& held, const py::object& position,
                    const py::object& rotation, double margin, std::size_t max_contacts) {
    const Poses poses(position, rotation, "position", "rotation");
    const Batch batch({&poses.positions(), &poses.rotations()});
    check_margin(margin, max_contacts);
    ContactColumns columns(batch.count());
    without_lock([&] {
        std::vector<Contact> buffer(max_contacts);
        for (std::size_t i = 0; i < batch.count(); ++i) {
            const ContactAnswer answer =
                find_contacts(held.shape, poses[i], ground, margin, buffer);
            const bool is_valid = answer.status != QueryStatus::invalid;
            for (std::size_t j = 0; j < answer.count; ++j) {
                const Contact& contact = buffer[j];
                columns.add(contact.point_world, contact.normal, contact.depth, contact.part, 0);
            }
            columns.finish(i, is_valid ? answer.lift : kNaN, is_valid ? answer.error_m : kNaN,
                           answer.status);
        }
    });
    return columns.answer();
}

py::object distances(const Ground& ground, const HeldShape& held, const py::object& position,
                     const py::object& rotation, double max_distance) {
    const Poses poses(position, rotation, "position", "rotation");
    const Batch batch({&poses.positions(), &poses.rotations()});
    auto distance = batch.make<double>();
    auto lower_bound = batch.make<double>();
    auto point = batch.make<double>({3});
    auto normal = batch.make<double>({3});
    auto error_m = batch.make<double>();
    auto has_ground = batch.make<bool>();
    auto status = batch.make<std::int8_t>();
    double* const distance_out = distance.mutable_data();
    double* const lower_bound_out = lower_bound.mutable_data();
    double* const point_out = point.mutable_data();
    double* const normal_out = normal.mutable_data();
    double* const error_out = error_m.mutable_data();
    bool* const ground_out = has_ground.mutable_data();
    std::int8_t* const status_out = status.mutable_data();
    without_lock([&] {
        for (std::size_t i = 0; i < batch.count(); ++i) {
            const DistanceAnswer answer =
                signed_distance(held.shape, poses[i], ground, max_distance);
            const bool is_set = answer.status != QueryStatus::invalid && answer.has_ground;
            distance_out[i] = is_set ? answer.distance : kNaN;
            lower_bound_out[i] = is_set ? answer.distance_lower_bound : kNaN;
            write_vector(is_set ? answer.point_world : WorldPos::Constant(kNaN), point_out + 3 * i);
            write_vector(is_set ? answer.normal : Eigen::Vector3d::Constant(kNaN),
                         normal_out + 3 * i);
            error_out[i] = is_set ? answer.error_m : kNaN;
            ground_out[i] = is_set;
            status_out[i] = static_cast<std::int8_t>(answer.status);
        }
    });
    return make_answer("Distances", distance, lower_bound, point, normal, error_m, has_ground,
                       status);
}

py::object casts(const Ground& ground, const HeldShape& held, const py::object& position,
                 const py::object& translation, const py::object& rotation,
                 const py::object& rotation_vector, double tolerance, bool skip_separating) {
    const Motions motions(position, rotation, translation, rotation_vector);
    const CastSettings settings{.tolerance = tolerance, .skip_separating = skip_separating};
    const Batch batch = motions.batch();
    CastColumns columns(batch);
    without_lock([&] {
        for (std::size_t i = 0; i < batch.count(); ++i) {
            const CastAnswer answer = cast(held.shape, motions[i], ground, settings);
            columns.write(i, {answer.status, answer.hit, answer.fraction, answer.started_in_contact,
                              answer.contact.point_world, answer.contact.normal,
                              answer.contact.depth, answer.error_m});
        }
    });
    return columns.answer();
}

}  // namespace

void bind_ground_queries(py::module_& module) {
    py::object ground = module.attr("Ground");
    auto type = py::reinterpret_borrow<py::class_<Ground>>(ground);
    type.def("contacts", &contacts, py::arg("shape"), py::arg("position"),
             py::arg("rotation") = py::none(), py::kw_only(), py::arg("margin") = 0.0,
             py::arg("max_contacts") = 16,
             R"(Where a shape touches the ground at many poses: Contacts.

position      shape (n, 3), or (3,) for one pose, metres
rotation      None, matrices (n, 3, 3) or (3, 3), or unit quaternions w, x, y, z of shape (n, 4) or (4,)
margin        also reports gaps up to this, metres
max_contacts  most for each pose; the deepest are kept, and the status is truncated)")
        .def("distances", &distances, py::arg("shape"), py::arg("position"),
             py::arg("rotation") = py::none(), py::kw_only(),
             py::arg("max_distance") = std::numeric_limits<double>::infinity(),
             R"(Signed distances of a shape from the ground at many poses: Distances.

position, rotation  as of contacts()
max_distance        larger gaps are not searched for, metres)")
        .def("casts", &casts, py::arg("shape"), py::arg("position"), py::arg("translation"),
             py::arg("rotation") = py::none(), py::arg("rotation_vector") = py::none(),
             py::kw_only(), py::arg("tolerance") = 1e-4, py::arg("skip_separating") = false,
             R"(The first contacts of a shape that moves and turns: Casts.

position, rotation  at the start, as of contacts()
translation         shape (n, 3) or (3,), metres, world axes
rotation_vector     None, or axis times radians of shape (n, 3) or (3,), world axes
tolerance           a hit is at a distance between 0 and this, metres, > 0
skip_separating     contacts at the start that separate do not count until they close again)");
}

}  // namespace terrane::python
