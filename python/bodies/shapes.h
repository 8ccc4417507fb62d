// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/shapes.h>

#include <pybind11/pybind11.h>

namespace terrane::python {

namespace py = pybind11;

/// A shape, as Python holds it. Immutable.
struct HeldShape {
    Shape shape;
};

/// Adds Shape.
void bind_shapes(py::module_& module);
/// Adds batches of contacts, distances and casts to Ground.
void bind_ground_queries(py::module_& module);
/// Adds batches of two shapes.
void bind_pairs(py::module_& module);

}  // namespace terrane::python
