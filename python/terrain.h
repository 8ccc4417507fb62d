// SPDX-License-Identifier: MIT
#pragma once

#include "guarded.h"

#include <terrane/terrain/height_source.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <pybind11/pybind11.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

namespace terrane::python {

namespace py = pybind11;

/// A height source, as held by Python. Immutable.
struct Source {
    std::shared_ptr<const HeightSource> heights;
    py::object info;  ///< terrane.DemInfo, terrane.StoreInfo or None
};

/// Adds HeightSource and functions that make one: fractal(), and, if built, open_dem(), open_store() and bake().
void bind_sources(py::module_& module);
/// Adds open_dem(), open_store() and bake().
void bind_files(py::module_& module);

namespace py = pybind11;

/// Bodies that need ground, as arguments of a pager. Their trajectories are not stored.
struct BodyNeeds {
    std::vector<BodyNeed> needs;
};

/// Resident chunks, as held by Python. Immutable.
struct Resident {
    std::shared_ptr<const ResidentSet> set;
};

/// Adds View and look_at().
void bind_views(py::module_& module);
/// Adds ResidentSet and Chunk.
void bind_resident(py::module_& module);
/// Adds Ground and its batches of heights and rays.
void bind_ground(py::module_& module);
/// Adds GroundBatch.
void bind_batches(py::module_& module);
/// Adds Camera, BodyNeeds and Pager.
void bind_pager(py::module_& module);

/// A triangulator with the source that it reads.
struct HeldTriangulator {
    std::shared_ptr<const HeightSource> source;
    Triangulator triangulator;
};

/// A triangulator, as held by Python.
struct MeshMaker {
    Guarded<HeldTriangulator> held;
    std::atomic<std::uint64_t> updates{0};  ///< calls of update()
};

/// A frame's mesh: a view of its triangulator's buffers, and its arrays once they have been requested.
struct Mesh {
    std::shared_ptr<MeshMaker> maker;
    std::uint64_t update = 0;  ///< value of MeshMaker::updates that made it
    TerrainMesh mesh;
    py::object vertices, triangles;  ///< arrays, or null

    /// Access to the mesh while nothing changes its triangulator.
    /// Fails: RuntimeError after a later update(), ValueError if the triangulator is closed
    Guarded<HeldTriangulator>::Use use() const;
};

/// Adds Triangulator and Mesh.
void bind_meshes(py::module_& module);

/// Adds Renderer.
void bind_renderer(pybind11::module_& module);

}  // namespace terrane::python
