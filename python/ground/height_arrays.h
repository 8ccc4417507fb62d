// SPDX-License-Identifier: MIT
#pragma once

#include "values/answers.h"
#include "values/arrays.h"

#include <terrane/terrain/ground.h>

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace terrane::python {

/// An array that answers are written to: a new one, or a field of the caller's `out`, which must be as the new one.
///
/// Fails: TypeError for another type or layout, ValueError for another shape or one that is read only
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

/// The arrays of terrane.Heights. Threads: write() without the interpreter lock.
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

}  // namespace terrane::python
