// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <pybind11/pybind11.h>

#include <memory>

namespace terrane::python {

namespace py = pybind11;

/// A source of heights, as Python holds it. Immutable.
struct Source {
    std::shared_ptr<const HeightSource> heights;
    py::object info;  ///< terrane.DemInfo, terrane.StoreInfo or None
};

/// Adds HeightSource and what makes one: fractal(), and open_dem(), open_store() and bake() where they are built.
void bind_sources(py::module_& module);
/// The last three.
void bind_files(py::module_& module);

}  // namespace terrane::python
