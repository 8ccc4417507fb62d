// SPDX-License-Identifier: MIT
#pragma once

#include "guarded.h"

#include <terrane/terrain/imagery_source.h>
#include <terrane/terrain/terrain.h>

#include <pybind11/pybind11.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace terrane {
struct DemInfo;
}

namespace terrane::python {

namespace py = pybind11;

/// A height source, as held by Python. Immutable.
struct Source {
    std::shared_ptr<const HeightSource> heights;
    py::object info;  ///< terrane.DemInfo, terrane.StoreInfo or None
    std::function<py::object()> make_georeference = {};  ///< of a raster; empty: there is none
    std::function<py::object()> http_statistics = {};    ///< of a server; empty: there is none
    std::shared_ptr<const DemInfo> dem = {};             ///< of a raster; null: there is none
    std::string file = {};          ///< of a raster or a store; "": there is none
    std::string samples_hash = {};  ///< DemInfo::samples_hash
    std::string note = {};  ///< of a raster or a store, for BakeSettings::note; "": there is none
};

/// Imagery of a raster, as held by Python. Immutable.
struct HeldImagery {
    std::shared_ptr<const ImagerySource> source;
};

/// Adds HeightSource and functions that make one: fractal(), and, if built, open_dem(), open_store(), open_http(),
/// bake() and ShardBaker.
void bind_sources(py::module_& module);
/// Adds Imagery, and, if built, open_dem(), open_imagery(), open_store(), open_http(), bake() and ShardBaker.
void bind_files(py::module_& module);

/// Bodies that need ground, as arguments of a terrain. Their trajectories are not stored.
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

/// A terrain, with the regions that it keeps resident until Python releases them.
struct HeldTerrain {
    Terrain terrain;
    std::map<std::uint64_t, RequiredRegion> regions = {};
    std::uint64_t last_region = 0;  ///< largest key of regions so far
};

/// A terrain, as held by Python.
struct TerrainUse {
    Guarded<HeldTerrain> held;
    TriangulatorSettings meshes;            ///< of its meshes
    std::atomic<std::uint64_t> updates{0};  ///< calls of update() and load()
};

/// Adds Camera, BodyNeeds, RequiredRegion and Terrain.
void bind_terrain(py::module_& module);

/// A frame's mesh: a view of its terrain's buffers, and its arrays once they have been requested.
struct Mesh {
    std::shared_ptr<TerrainUse> terrain;
    std::uint64_t update = 0;  ///< value of TerrainUse::updates when the mesh was made
    TerrainMesh mesh;
    py::object vertices = {}, triangles = {};  ///< arrays, or null

    /// Access to the mesh while nothing changes its terrain.
    /// Fails: RuntimeError after a later update(), ValueError if the terrain is closed
    Guarded<HeldTerrain>::Use use() const;
};

/// Adds Mesh.
void bind_meshes(py::module_& module);

/// The triangles that the objects of a Scene demand in a view, where a mesh has an error of at least `least_px`.
/// Fails: TypeError if `scene` is not a Scene, ValueError if it is closed
std::vector<TriangleDemand> demands_of(py::handle scene, const View& view, double least_px);

/// Adds Renderer, Scene, Model and Node.
void bind_pictures(py::module_& module);

}  // namespace terrane::python
