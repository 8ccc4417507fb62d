// SPDX-License-Identifier: MIT
#include "bodies.h"
#include "conversions.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/query.h>
#include <terrane/collision/shape_pairs.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace terrane::python {

/// Fails: ValueError for a margin that is negative or not finite, or for zero or more than 2^20 contacts
void check_margin(double margin, std::size_t max_contacts);

/// Growing arrays of terrane.Contacts. Threads: only answer() requires the interpreter lock.
class ContactColumns {
public:
    explicit ContactColumns(std::size_t pose_count);

    void add(const WorldPos& point_world, const Eigen::Vector3d& normal, double depth,
             std::uint32_t part, std::uint32_t part_b);
    /// Completes the contacts of a pose; call for poses in ascending order.
    void finish(std::size_t pose, double lift, double error_m, QueryStatus status);

    py::object answer() const;

private:
    std::vector<std::int64_t> first_;
    std::vector<double> points_, normals_, depths_, lifts_, errors_;
    std::vector<std::uint32_t> parts_, parts_b_;
    std::vector<std::int8_t> statuses_;
};

/// Arguments of casts: motions of a shape.
class Motions {
public:
    Motions(py::handle position, py::handle rotation, py::handle translation,
            py::handle rotation_vector);

    Motion operator[](std::size_t index) const;
    Batch batch() const {
        return Batch({&start_.positions(), &start_.rotations(), &translations_, &turns_});
    }

private:
    Poses start_;
    Rows translations_;
    Rows turns_;
};

/// The answer of one cast.
struct CastRow {
    QueryStatus status;
    bool hit;
    double fraction;
    bool started_in_contact;
    WorldPos point_world;
    Eigen::Vector3d normal;
    double depth;
    double error_m;
};

/// The arrays of terrane.Casts. Threads: as ContactColumns.
class CastColumns {
public:
    explicit CastColumns(const Batch& batch);
    void write(std::size_t index, const CastRow& row);
    py::object answer() const;

private:
    py::array_t<bool> hit_, started_;
    py::array_t<double> fraction_, point_, normal_, depth_, error_;
    py::array_t<std::int8_t> status_;
    bool* hit_out_;
    bool* started_out_;
    double* fraction_out_;
    double* point_out_;
    double* normal_out_;
    double* depth_out_;
    double* error_out_;
    std::int8_t* status_out_;
};

namespace {

template <class T>
py::array_t<T> column_of(const std::vector<T>& numbers, py::ssize_t width = 1) {
    const auto rows = static_cast<py::ssize_t>(numbers.size()) / width;
    if (width == 1) return py::array_t<T>(rows, numbers.data());
    return py::array_t<T>({rows, width}, numbers.data());
}

void append(std::vector<double>& numbers, const Eigen::Vector3d& vector) {
    numbers.insert(numbers.end(), {vector.x(), vector.y(), vector.z()});
}

}  // namespace

void check_margin(double margin, std::size_t max_contacts) {
    if (!(margin >= 0.0) || !std::isfinite(margin))
        throw py::value_error("margin must be finite and at least 0, got " +
                              std::to_string(margin));
    constexpr std::size_t kMost = std::size_t{1} << 20;
    if (max_contacts < 1 || max_contacts > kMost)
        throw py::value_error("max_contacts must be 1 to 1048576, got " +
                              std::to_string(max_contacts));
}

ContactColumns::ContactColumns(std::size_t pose_count)
    : first_(1, 0), lifts_(pose_count), errors_(pose_count), statuses_(pose_count) {
    first_.reserve(pose_count + 1);
}

void ContactColumns::add(const WorldPos& point_world, const Eigen::Vector3d& normal, double depth,
                         std::uint32_t part, std::uint32_t part_b) {
    append(points_, point_world);
    append(normals_, normal);
    depths_.push_back(depth);
    parts_.push_back(part);
    parts_b_.push_back(part_b);
}

void ContactColumns::finish(std::size_t pose, double lift, double error_m, QueryStatus status) {
    first_.push_back(static_cast<std::int64_t>(depths_.size()));
    lifts_[pose] = lift;
    errors_[pose] = error_m;
    statuses_[pose] = static_cast<std::int8_t>(status);
}

py::object ContactColumns::answer() const {
    return make_answer("Contacts", column_of(first_), column_of(points_, 3), column_of(normals_, 3),
                       column_of(depths_), column_of(parts_), column_of(parts_b_),
                       column_of(lifts_), column_of(errors_), column_of(statuses_));
}

namespace {

Rows read_turns(py::handle rotation_vector) {
    if (!rotation_vector.is_none()) return Rows(rotation_vector, "rotation_vector", 3);
    return Rows(py::make_tuple(0.0, 0.0, 0.0), "rotation_vector", 3);
}

}  // namespace

Motions::Motions(py::handle position, py::handle rotation, py::handle translation,
                 py::handle rotation_vector)
    : start_(position, rotation, "position", "rotation"),
      translations_(translation, "translation", 3),
      turns_(read_turns(rotation_vector)) {}

Motion Motions::operator[](std::size_t index) const {
    return {.start = start_[index],
            .translation = translations_.vector(index),
            .rotation_vector = turns_.vector(index)};
}

CastColumns::CastColumns(const Batch& batch)
    : hit_(batch.make<bool>()),
      started_(batch.make<bool>()),
      fraction_(batch.make<double>()),
      point_(batch.make<double>({3})),
      normal_(batch.make<double>({3})),
      depth_(batch.make<double>()),
      error_(batch.make<double>()),
      status_(batch.make<std::int8_t>()),
      hit_out_(hit_.mutable_data()),
      started_out_(started_.mutable_data()),
      fraction_out_(fraction_.mutable_data()),
      point_out_(point_.mutable_data()),
      normal_out_(normal_.mutable_data()),
      depth_out_(depth_.mutable_data()),
      error_out_(error_.mutable_data()),
      status_out_(status_.mutable_data()) {}

void CastColumns::write(std::size_t index, const CastRow& row) {
    const bool is_valid = row.status != QueryStatus::invalid;
    const bool is_hit = is_valid && row.hit;
    hit_out_[index] = is_hit;
    started_out_[index] = is_valid && row.started_in_contact;
    fraction_out_[index] = is_valid ? row.fraction : kNaN;
    write_vector(is_hit ? row.point_world : WorldPos::Constant(kNaN), point_out_ + 3 * index);
    write_vector(is_hit ? row.normal : Eigen::Vector3d::Constant(kNaN), normal_out_ + 3 * index);
    depth_out_[index] = is_hit ? row.depth : kNaN;
    error_out_[index] = is_valid ? row.error_m : kNaN;
    status_out_[index] = static_cast<std::int8_t>(row.status);
}

py::object CastColumns::answer() const {
    return make_answer("Casts", hit_, fraction_, started_, point_, normal_, depth_, error_,
                       status_);
}

// Contacts of one shape at many poses with the ground.

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

// Queries of two shapes at many poses.

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
