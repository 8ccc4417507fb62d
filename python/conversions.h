// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace terrane::python {

namespace py = pybind11;

/// Throws the Python exception for an error, with its message: ValueError (invalid_argument, bad_data), OSError (io),
/// MemoryError, TimeoutError, RuntimeError (device_unavailable, cancelled). Requires the interpreter lock.
[[noreturn]] void raise_error(const Error& error);

/// The value of a result; throws the exception of its error. Requires the interpreter lock.
template <class T>
T value_or_raise(Result<T> result) {
    if (!result) raise_error(result.error());
    if constexpr (!std::is_void_v<T>) return std::move(*result);
}

/// Calls a function without the interpreter lock, so that other Python threads can run.
template <class Function>
auto without_lock(Function&& function) {
    const py::gil_scoped_release released;
    return std::forward<Function>(function)();
}

namespace py = pybind11;

/// Makes an answer: a named tuple or an enumerator of terrane/answers.py.
template <class... Fields>
py::object make_answer(const char* type, Fields&&... fields) {
    return py::module_::import("terrane.answers").attr(type)(std::forward<Fields>(fields)...);
}

/// The enumerator that an argument names, such as kind="ridged".
/// Fails: ValueError that lists the names
template <class Enum, std::size_t count>
Enum read_choice(std::string_view argument, const char* name,
                 const std::array<std::pair<const char*, Enum>, count>& choices) {
    std::string known;
    for (const auto& [word, value] : choices) {
        if (argument == word) return value;
        known += (known.empty() ? "" : ", ") + std::string(word);
    }
    throw py::value_error(std::string(name) + " must be one of " + known + ", got \"" +
                          std::string(argument) + "\"");
}

// Arguments and answers as numpy arrays. For a numeric argument, a C-contiguous, aligned float64 array is read in
// place; other real numbers, other layouts and sequences are copied once. Anything but real numbers (bool, complex,
// text, objects, masked arrays) is a TypeError, a wrong shape a ValueError; both name the argument.

namespace py = pybind11;

/// Stands for a missing number in answers.
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// C-contiguous float64 numbers.
using Doubles = py::array_t<double, py::array::c_style>;

/// Reads the numbers of an argument of any shape.
/// @param name of the argument, for messages
Doubles read_doubles(py::handle argument, const char* name);

/// Reads a vector of shape (3,), finite or not.
Eigen::Vector3d read_vector(py::handle argument, const char* name);

/// Reads points or other vectors of shape (n, 3).
std::vector<Eigen::Vector3d> read_points(py::handle argument, const char* name);

/// Reads triangles: indices of vertices, whole numbers of shape (m, 3).
/// Fails: TypeError for other numbers, ValueError for another shape and for an index that no vertex has
std::vector<std::array<std::uint32_t, 3>> read_triangles(py::handle argument, const char* name,
                                                         std::size_t vertex_count);

/// Reads an array of uint8, of any shape.
py::array_t<std::uint8_t, py::array::c_style> read_bytes(py::handle argument, const char* name);

/// The shape of an array as Python prints it: "(4, 3)".
std::string shape_text(const py::array& array);

/// The shape of an array, for making another one of the same shape.
std::vector<py::ssize_t> shape_of(const py::array& array);

/// Fails: ValueError that names both arrays if their shapes differ
void check_same_shape(const py::array& a, const char* a_name, const py::array& b,
                      const char* b_name);

/// Rows of numbers: shape (n, width), or (width,) for one row shared by all elements of a batch.
class Rows {
public:
    Rows(py::handle argument, const char* name, py::ssize_t width);
    /// Numbers of shape (n,) as rows of length one; a single number is shared.
    static Rows numbers(py::handle argument, const char* name);

    const double* operator[](std::size_t index) const { return data_ + index * stride_; }
    Eigen::Vector3d vector(std::size_t index) const {
        const double* row = (*this)[index];
        return {row[0], row[1], row[2]};
    }
    std::size_t count() const { return count_; }
    bool is_shared() const { return stride_ == 0; }
    const char* name() const { return name_; }

private:
    friend class Poses;
    static Rows numbers_of(const Doubles& array, const char* name, py::ssize_t width);
    Rows(const Doubles& array, const char* name, py::ssize_t width, bool is_shared);

    Doubles array_;  // keeps the numbers alive
    const char* name_;
    const double* data_;
    std::size_t count_;
    std::size_t stride_;
};

/// Poses of shapes: positions of shape (n, 3) or (3,), and rotations: None, matrices of shape (n, 3, 3) or (3, 3), or
/// unit quaternions w, x, y, z of shape (n, 4) or (4,). Queries check that matrices are orthonormal.
class Poses {
public:
    Poses(py::handle position, py::handle rotation, const char* position_name,
          const char* rotation_name);

    Pose operator[](std::size_t index) const;
    const Rows& positions() const { return positions_; }
    const Rows& rotations() const { return rotations_; }

private:
    Rows positions_;
    Rows rotations_;
    bool is_quaternion_ = false;
};

/// Reads one pose: position of shape (3,), rotation as in Poses.
Pose read_pose(py::handle position, py::handle rotation);

/// The number of queries in a call: the number of rows of the arguments that are not shared, which must agree. If all
/// are shared there is one query, and its answer has no leading axis.
class Batch {
public:
    explicit Batch(std::initializer_list<const Rows*> arguments);
    /// The common batch of two. Fails: ValueError if both have a leading axis and their counts differ.
    static Batch common(const Batch& a, const Batch& b);

    std::size_t count() const { return count_; }
    /// Makes an array for answers: shape (n, tail...), or (tail...) without a leading axis.
    template <class T>
    py::array_t<T> make(std::initializer_list<py::ssize_t> tail = {}) const {
        std::vector<py::ssize_t> shape = lead_;
        shape.insert(shape.end(), tail.begin(), tail.end());
        return py::array_t<T>(shape);
    }

private:
    std::size_t count_ = 1;
    std::vector<py::ssize_t> lead_;
};

/// Writes a vector to three numbers.
inline void write_vector(const Eigen::Vector3d& vector, double* out) {
    out[0] = vector.x();
    out[1] = vector.y();
    out[2] = vector.z();
}

/// Writes a matrix row by row to nine numbers.
inline void write_matrix(const Eigen::Matrix3d& matrix, double* out) {
    for (Eigen::Index row = 0; row < 3; ++row)
        for (Eigen::Index column = 0; column < 3; ++column)
            out[3 * row + column] = matrix(row, column);
}

/// A vector as an array of shape (3,).
py::array_t<double> to_array(const Eigen::Vector3d& vector);
/// A matrix as an array of shape (3, 3).
py::array_t<double> to_array(const Eigen::Matrix3d& matrix);

/// A read-only array of a shape over numbers that `owner` keeps alive.
template <class T>
py::array view_of(const T* data, std::vector<py::ssize_t> shape, py::handle owner) {
    py::array_t<T> array(std::move(shape), data, owner);
    array.attr("setflags")(py::arg("write") = false);
    return array;
}

}  // namespace terrane::python
