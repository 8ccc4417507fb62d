// SPDX-License-Identifier: MIT
#pragma once

#include "values/guarded.h"

#include <terrane/terrain/triangulator.h>

#include <atomic>
#include <cstdint>
#include <memory>

namespace terrane::python {

/// A triangulator with the source that it asks.
struct HeldTriangulator {
    std::shared_ptr<const HeightSource> source;
    Triangulator triangulator;
};

/// A triangulator, as Python holds it.
struct MeshMaker {
    Guarded<HeldTriangulator> held;
    std::atomic<std::uint64_t> updates{0};  ///< calls of update()
};

/// A frame's mesh: a view of its triangulator's buffers, and its arrays once they have been asked for.
struct Mesh {
    std::shared_ptr<MeshMaker> maker;
    std::uint64_t update = 0;  ///< MeshMaker::updates that it was made by
    TerrainMesh mesh;
    py::object vertices, triangles;  ///< arrays, or null

    /// The mesh while nothing changes its triangulator.
    /// Fails: RuntimeError after a later update(), ValueError where the triangulator is closed
    Guarded<HeldTriangulator>::Use use() const;
};

/// Adds Triangulator and Mesh.
void bind_meshes(py::module_& module);

}  // namespace terrane::python
