// SPDX-License-Identifier: MIT
#pragma once

#include <pybind11/pybind11.h>

namespace terrane::python {

/// Adds Renderer.
void bind_renderer(pybind11::module_& module);

}  // namespace terrane::python
