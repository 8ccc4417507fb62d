// SPDX-License-Identifier: MIT
#include "conversions.h"

#include <algorithm>
#include <utility>

namespace terrane::python {
namespace {

PyObject* exception_of(ErrorCode code) {
    switch (code) {
        case ErrorCode::invalid_argument:
        case ErrorCode::bad_data:
            return PyExc_ValueError;
        case ErrorCode::io:
            return PyExc_OSError;
        case ErrorCode::out_of_memory:
            return PyExc_MemoryError;
        case ErrorCode::timed_out:
            return PyExc_TimeoutError;
        case ErrorCode::device_unavailable:
        case ErrorCode::cancelled:
            break;
    }
    return PyExc_RuntimeError;
}

}  // namespace

void raise_error(const Error& error) {
    PyErr_SetString(exception_of(error.code), error.message.c_str());
    throw py::error_already_set();
}

namespace {

constexpr int kCAndAligned = int{py::array::c_style} | int{py::detail::npy_api::NPY_ARRAY_ALIGNED_};

// Exact type only: a subclass may have a mask.
bool is_read_in_place(py::handle argument) {
    return Py_TYPE(argument.ptr()) == py::detail::npy_api::get().PyArray_Type_ &&
           py::isinstance<Doubles>(argument) &&
           (py::reinterpret_borrow<py::array>(argument).flags() & kCAndAligned) == kCAndAligned;
}

Doubles read_rows(py::handle argument, const char* name, py::ssize_t width) {
    Doubles array = read_doubles(argument, name);
    const py::ssize_t axes = array.ndim();
    if (axes >= 1 && axes <= 2 && array.shape(axes - 1) == width) return array;
    const std::string size = std::to_string(width);
    throw py::value_error(std::string(name) + " must have the shape (n, " + size + ") or (" + size +
                          ",), got " + shape_text(array));
}

Eigen::Matrix3d matrix_of_quaternion(const double* q) {
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    Eigen::Matrix3d matrix;
    matrix << w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z;
    return matrix;
}

}  // namespace

std::string shape_text(const py::array& array) {
    return py::cast<std::string>(py::str(array.attr("shape")));
}

std::vector<py::ssize_t> shape_of(const py::array& array) {
    return {array.shape(), array.shape() + array.ndim()};
}

void check_same_shape(const py::array& a, const char* a_name, const py::array& b,
                      const char* b_name) {
    if (shape_of(a) == shape_of(b)) return;
    throw py::value_error(std::string(a_name) + " and " + b_name +
                          " must have the same shape, got " + shape_text(a) + " and " +
                          shape_text(b));
}

Doubles read_doubles(py::handle argument, const char* name) {
    if (is_read_in_place(argument)) return py::reinterpret_borrow<Doubles>(argument);
    const std::string wanted = std::string(name) + " must hold real numbers, got ";
    if (argument.is_none()) throw py::type_error(wanted + "None");
    if (py::isinstance(argument, py::module_::import("numpy.ma").attr("MaskedArray")))
        throw py::type_error(wanted + "a masked array: fill it first");
    const py::array array = py::array::ensure(argument);
    if (!array)
        throw py::type_error(wanted + "a " +
                             py::cast<std::string>(py::type::of(argument).attr("__name__")));
    const char kind = array.dtype().kind();
    if (kind != 'f' && kind != 'i' && kind != 'u')
        throw py::type_error(wanted + "an array of " +
                             py::cast<std::string>(py::str(array.dtype())));
    return py::module_::import("numpy").attr("require")(array, py::dtype::of<double>(), "CA");
}

Eigen::Vector3d read_vector(py::handle argument, const char* name) {
    const Doubles array = read_doubles(argument, name);
    if (array.ndim() != 1 || array.shape(0) != 3)
        throw py::value_error(std::string(name) + " must have the shape (3,), got " +
                              shape_text(array));
    return {array.data()[0], array.data()[1], array.data()[2]};
}

std::vector<Eigen::Vector3d> read_points(py::handle argument, const char* name) {
    const Doubles array = read_doubles(argument, name);
    if (array.ndim() != 2 || array.shape(1) != 3)
        throw py::value_error(std::string(name) + " must have the shape (n, 3), got " +
                              shape_text(array));
    std::vector<Eigen::Vector3d> points(static_cast<std::size_t>(array.shape(0)));
    const double* next = array.data();
    for (Eigen::Vector3d& point : points) {
        point = {next[0], next[1], next[2]};
        next += 3;
    }
    return points;
}

std::vector<std::array<std::uint32_t, 3>> read_triangles(py::handle argument, const char* name,
                                                         std::size_t vertex_count) {
    const py::array given = py::array::ensure(argument);
    if (!given || (given.dtype().kind() != 'i' && given.dtype().kind() != 'u'))
        throw py::type_error(std::string(name) + " must hold whole numbers");
    const auto indices = py::array_t<std::int64_t, py::array::c_style>::ensure(given);
    if (indices.ndim() != 2 || indices.shape(1) != 3)
        throw py::value_error(std::string(name) + " must have the shape (m, 3), got " +
                              shape_text(indices));
    std::vector<std::array<std::uint32_t, 3>> triangles(static_cast<std::size_t>(indices.shape(0)));
    for (std::size_t i = 0; i < 3 * triangles.size(); ++i) {
        const std::int64_t index = indices.data()[i];
        if (index < 0 || index >= static_cast<std::int64_t>(vertex_count))
            throw py::value_error(std::string(name) + "[" + std::to_string(i / 3) +
                                  "] has the index " + std::to_string(index) + ", and there are " +
                                  std::to_string(vertex_count) + " vertices");
        triangles[i / 3][i % 3] = static_cast<std::uint32_t>(index);
    }
    return triangles;
}

py::array_t<std::uint8_t, py::array::c_style> read_bytes(py::handle argument, const char* name) {
    const py::array array = py::array::ensure(argument);
    const std::string wanted = std::string(name) + " must be an array of uint8, got ";
    if (!array)
        throw py::type_error(wanted + "a " +
                             py::cast<std::string>(py::type::of(argument).attr("__name__")));
    if (array.dtype().kind() != 'u' || array.dtype().itemsize() != 1)
        throw py::type_error(wanted + "an array of " +
                             py::cast<std::string>(py::str(array.dtype())));
    return py::array_t<std::uint8_t, py::array::c_style>::ensure(array);
}

Rows::Rows(const Doubles& array, const char* name, py::ssize_t width, bool is_shared)
    : array_(array),
      name_(name),
      data_(array.data()),
      count_(is_shared ? 1 : static_cast<std::size_t>(array.size() / width)),
      stride_(is_shared ? 0 : static_cast<std::size_t>(width)) {}

Rows::Rows(py::handle argument, const char* name, py::ssize_t width)
    : Rows(numbers_of(read_rows(argument, name, width), name, width)) {}

Rows Rows::numbers_of(const Doubles& array, const char* name, py::ssize_t width) {
    return Rows(array, name, width, array.ndim() == 1);
}

Rows Rows::numbers(py::handle argument, const char* name) {
    const Doubles array = read_doubles(argument, name);
    if (array.ndim() > 1)
        throw py::value_error(std::string(name) + " must have the shape (n,) or (), got " +
                              shape_text(array));
    return Rows(array, name, 1, array.ndim() == 0);
}

namespace {

// How many numbers represent a rotation: 4 or 9; 0 for None.
py::ssize_t width_of_rotation(py::handle rotation, const char* name) {
    if (rotation.is_none()) return 0;
    const Doubles array = read_doubles(rotation, name);
    const py::ssize_t axes = array.ndim();
    if (axes >= 1 && axes <= 2 && array.shape(axes - 1) == 4) return 4;
    if (axes >= 2 && axes <= 3 && array.shape(axes - 1) == 3 && array.shape(axes - 2) == 3)
        return 9;
    throw py::value_error(std::string(name) +
                          " must have the shape (n, 3, 3), (3, 3), (n, 4) or (4,), got " +
                          shape_text(array));
}

}  // namespace

Poses::Poses(py::handle position, py::handle rotation, const char* position_name,
             const char* rotation_name)
    : positions_(position, position_name, 3), rotations_(positions_) {
    const py::ssize_t width = width_of_rotation(rotation, rotation_name);
    if (width == 0) {
        static constexpr double kIdentity[] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
        rotations_.name_ = rotation_name;
        rotations_.data_ = kIdentity;
        rotations_.count_ = 1;
        rotations_.stride_ = 0;
        return;
    }
    const Doubles array = read_doubles(rotation, rotation_name);
    is_quaternion_ = width == 4;
    rotations_ = Rows(array, rotation_name, width, array.ndim() == (is_quaternion_ ? 1 : 2));
    if (!is_quaternion_) return;
    for (std::size_t i = 0; i < rotations_.count(); ++i) {
        const double* q = rotations_[i];
        const double square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
        if (!(square > 1.0 - 1e-6 && square < 1.0 + 1e-6))
            throw py::value_error(std::string(rotation_name) + "[" + std::to_string(i) +
                                  "] must be a quaternion of unit length, its square is " +
                                  std::to_string(square));
    }
}

Pose Poses::operator[](std::size_t index) const {
    Pose pose;
    pose.translation = positions_.vector(index);
    const double* row = rotations_[index];
    if (is_quaternion_) {
        pose.rotation = matrix_of_quaternion(row);
    } else {
        pose.rotation << row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8];
    }
    return pose;
}

Pose read_pose(py::handle position, py::handle rotation) {
    const Poses poses(position, rotation, "position", "rotation");
    if (!poses.positions().is_shared() || !poses.rotations().is_shared())
        throw py::value_error("position and rotation must be one pose, not several");
    return poses[0];
}

Batch::Batch(std::initializer_list<const Rows*> arguments) {
    const Rows* first = nullptr;
    for (const Rows* rows : arguments) {
        if (rows == nullptr || rows->is_shared()) continue;
        if (first == nullptr) {
            first = rows;
        } else if (rows->count() != first->count()) {
            throw py::value_error(std::string(first->name()) + " has " +
                                  std::to_string(first->count()) + " rows, " + rows->name() +
                                  " has " + std::to_string(rows->count()));
        }
    }
    if (first == nullptr) return;
    count_ = first->count();
    lead_ = {static_cast<py::ssize_t>(count_)};
}

Batch Batch::common(const Batch& a, const Batch& b) {
    if (a.lead_.empty()) return b;
    if (!b.lead_.empty() && a.count_ != b.count_)
        throw py::value_error("the arguments of a have " + std::to_string(a.count_) +
                              " rows, those of b " + std::to_string(b.count_));
    return a;
}

py::array_t<double> to_array(const Eigen::Vector3d& vector) {
    py::array_t<double> array(3);
    write_vector(vector, array.mutable_data());
    return array;
}

py::array_t<double> to_array(const Eigen::Matrix3d& matrix) {
    py::array_t<double> array({3, 3});
    write_matrix(matrix, array.mutable_data());
    return array;
}

}  // namespace terrane::python
