// SPDX-License-Identifier: MIT
// The extension module terrane._terrane, which terrane/__init__.py imports into the package.
#include "bodies.h"
#include "terrain.h"

#include <pybind11/pybind11.h>

PYBIND11_MODULE(_terrane, module) {
    namespace python = terrane::python;
    module.doc() = "Terrane's C++ library. Import terrane instead.";
    module.attr("__version__") = TERRANE_PYTHON_VERSION;
    python::bind_sources(module);
    python::bind_views(module);
    python::bind_resident(module);
    python::bind_ground(module);
    python::bind_batches(module);
    python::bind_meshes(module);
    python::bind_terrain(module);
    python::bind_shapes(module);
    python::bind_ground_queries(module);
    python::bind_pairs(module);
    python::bind_world(module);
    python::bind_vehicles(module);
    python::bind_lidar(module);
    pybind11::list components;
    for (const char* name : {"terrain", "collision"}) components.append(name);
    if (TERRANE_PYTHON_STORE) components.append("store");
    if (TERRANE_PYTHON_DEM) components.append("dem");
#if TERRANE_PYTHON_RENDER
    python::bind_renderer(module);
    components.append("render");
#endif
    module.attr("components") = pybind11::tuple(components);
}
