// SPDX-License-Identifier: MIT
#include "bodies/contact_columns.h"

#include "values/answers.h"

#include <cmath>
#include <string>

namespace terrane::python {
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

}  // namespace terrane::python
