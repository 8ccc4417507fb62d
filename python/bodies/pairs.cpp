// SPDX-License-Identifier: MIT
// Two shapes at many poses.
#include "bodies/contact_columns.h"
#include "bodies/shapes.h"
#include "values/answers.h"
#include "values/arrays.h"
#include "values/errors.h"

#include <terrane/collision/shape_pairs.h>

namespace terrane::python {
namespace {

py::object pair_distances(const HeldShape& a, const py::object& position_a, const HeldShape& b,
                          const py::object& position_b, const py::object& rotation_a,
                          const py::object& rotation_b) {
    const Poses poses_a(position_a, rotation_a, "position_a", "rotation_a");
    const Poses poses_b(position_b, rotation_b, "position_b", "rotation_b");
    const Batch batch(
        {&poses_a.positions(), &poses_a.rotations(), &poses_b.positions(), &poses_b.rotations()});
    auto distance = batch.make<double>();
    auto point_a = batch.make<double>({3});
    auto point_b = batch.make<double>({3});
    auto normal = batch.make<double>({3});
    auto part_a = batch.make<std::uint32_t>();
    auto part_b = batch.make<std::uint32_t>();
    auto status = batch.make<std::int8_t>();
    double* const distance_out = distance.mutable_data();
    double* const point_a_out = point_a.mutable_data();
    double* const point_b_out = point_b.mutable_data();
    double* const normal_out = normal.mutable_data();
    std::uint32_t* const part_a_out = part_a.mutable_data();
    std::uint32_t* const part_b_out = part_b.mutable_data();
    std::int8_t* const status_out = status.mutable_data();
    without_lock([&] {
        const Eigen::Vector3d none = Eigen::Vector3d::Constant(kNaN);
        for (std::size_t i = 0; i < batch.count(); ++i) {
            const PairDistanceAnswer answer =
                signed_distance(a.shape, poses_a[i], b.shape, poses_b[i]);
            const bool is_valid = answer.status != QueryStatus::invalid;
            distance_out[i] = is_valid ? answer.distance : kNaN;
            write_vector(is_valid ? answer.point_a_world : none, point_a_out + 3 * i);
            write_vector(is_valid ? answer.point_b_world : none, point_b_out + 3 * i);
            write_vector(is_valid ? answer.normal : none, normal_out + 3 * i);
            part_a_out[i] = answer.part_a;
            part_b_out[i] = answer.part_b;
            status_out[i] = static_cast<std::int8_t>(answer.status);
        }
    });
    return make_answer("PairDistances", distance, point_a, point_b, normal, part_a, part_b, status);
}

py::object pair_contacts(const HeldShape& a, const py::object& position_a, const HeldShape& b,
                         const py::object& position_b, const py::object& rotation_a,
                         const py::object& rotation_b, double margin, std::size_t max_contacts) {
    const Poses poses_a(position_a, rotation_a, "position_a", "rotation_a");
    const Poses poses_b(position_b, rotation_b, "position_b", "rotation_b");
    const Batch batch(
        {&poses_a.positions(), &poses_a.rotations(), &poses_b.positions(), &poses_b.rotations()});
    check_margin(margin, max_contacts);
    ContactColumns columns(batch.count());
    without_lock([&] {
        std::vector<PairContact> buffer(max_contacts);
        for (std::size_t i = 0; i < batch.count(); ++i) {
            const PairContactAnswer answer =
                find_contacts(a.shape, poses_a[i], b.shape, poses_b[i], margin, buffer);
            for (std::size_t j = 0; j < answer.count; ++j) {
                const PairContact& contact = buffer[j];
                columns.add(contact.point_world, contact.normal, contact.depth, contact.part_a,
                            contact.part_b);
            }
            columns.finish(i, kNaN, answer.status == QueryStatus::invalid ? kNaN : 0.0,
                           answer.status);
        }
    });
    return columns.answer();
}

py::object pair_casts(const HeldShape& a, const py::object& position_a,
                      const py::object& translation_a, const HeldShape& b,
                      const py::object& position_b, const py::object& translation_b,
                      const py::object& rotation_a, const py::object& rotation_b, double tolerance,
                      bool skip_separating) {
    const Motions motions_a(position_a, rotation_a, translation_a, py::none());
    const Motions motions_b(position_b, rotation_b, translation_b, py::none());
    const CastSettings settings{.tolerance = tolerance, .skip_separating = skip_separating};
    const Batch batch = Batch::common(motions_a.batch(), motions_b.batch());
    CastColumns columns(batch);
    without_lock([&] {
        for (std::size_t i = 0; i < batch.count(); ++i) {
            const PairCastAnswer answer =
                cast(a.shape, motions_a[i], b.shape, motions_b[i], settings);
            const PairContact contact = answer.count > 0 ? answer.contacts[0] : PairContact{};
            columns.write(i, {answer.status, answer.hit, answer.fraction, answer.started_in_contact,
                              contact.point_world, contact.normal, contact.depth, 0.0});
        }
    });
    return columns.answer();
}

}  // namespace

void bind_pairs(py::module_& module) {
    module.def("pair_distances", &pair_distances, py::arg("a"), py::arg("position_a"), py::arg("b"),
               py::arg("position_b"), py::arg("rotation_a") = py::none(),
               py::arg("rotation_b") = py::none(),
               R"(Signed distances of two shapes at many poses: PairDistances. Without the lock.

position_a, position_b  shape (n, 3) or (3,), metres
rotation_a, rotation_b  as of Ground.contacts())");
    module.def("pair_contacts", &pair_contacts, py::arg("a"), py::arg("position_a"), py::arg("b"),
               py::arg("position_b"), py::arg("rotation_a") = py::none(),
               py::arg("rotation_b") = py::none(), py::kw_only(), py::arg("margin") = 0.0,
               py::arg("max_contacts") = 16,
               "Where two shapes touch at many poses: Contacts on a, normals towards a. Without "
               "the lock.");
    module.def("pair_casts", &pair_casts, py::arg("a"), py::arg("position_a"),
               py::arg("translation_a"), py::arg("b"), py::arg("position_b"),
               py::arg("translation_b"), py::arg("rotation_a") = py::none(),
               py::arg("rotation_b") = py::none(), py::kw_only(), py::arg("tolerance") = 1e-4,
               py::arg("skip_separating") = false,
               "The first contacts of two shapes that move without turning: Casts, normals towards "
               "a. Without the lock.");
}

}  // namespace terrane::python
