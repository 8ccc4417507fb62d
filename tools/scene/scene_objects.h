// SPDX-License-Identifier: MIT
#pragma once

#include "program/json_values.h"
#include "scene/mesh_files.h"

#include <terrane/dem/imagery_raster.h>
#include <terrane/dem/surface_raster.h>
#include <terrane/render/material.h>
#include <terrane/render/terrain_renderer.h>
#include <terrane/terrain/scatter.h>
#include <terrane/terrain/triangle_mesh.h>

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace terrane::tools {

/// `surface` of a scene: friction and restitution by position.
struct SceneSurface {
    std::string raster;              ///< path of a raster of friction; "" for rectangles
    std::vector<SurfaceRect> rects;  ///< the last one that contains a position applies
};

/// Parses `surface` of a scene: the path of a raster of friction, or a list of rectangles in metres of the world,
/// `[{"rect":[west,south,east,north],"friction":f,"restitution":r}..]`. Errors begin with the path of the key.
///
/// @param folder base of relative paths
Parsed<SceneSurface> read_surface(const nlohmann::ordered_json& value, const std::string& folder);

/// Names of the palettes, in the order of GroundPalette.
inline constexpr std::array<const char*, 5> kPaletteNames{"alpine", "temperate", "desert", "moon",
                                                          "imagery"};

/// `materials` of a scene: the look of the ground. Absent values are those of GroundLookSettings.
struct SceneMaterials {
    std::optional<GroundPalette> palette = {};
    std::optional<double> snow_line = {};   ///< metres
    std::optional<double> rock_slope = {};  ///< rise over run
    std::optional<double> occlusion = {};   ///< 0 to 1
};

/// Parses `materials` of a scene: `{"palette":"desert","snow_line_m":1800,"rock_slope":0.8,"occlusion":0.6}`, each
/// optional. Errors begin with the path of the key.
Parsed<SceneMaterials> read_materials(const nlohmann::ordered_json& value);

/// `water` or `water_m` of a scene.
struct SceneWater {
    double level = 0.0;                  ///< metres
    std::optional<bool> has_waves = {};  ///< absent: as the look of the picture
};

/// Parses `water` of a scene: `{"level_m":0,"waves":true}`. Errors begin with the path of the key.
Parsed<SceneWater> read_water(const nlohmann::ordered_json& value);

/// `imagery` of a scene: colours draped over the ground.
struct SceneImagery {
    std::string raster;
    ImageryRasterSettings settings = {};  ///< without aligned_with
};

/// Parses `imagery` of a scene: the path of a raster, or `{"file":"..","bands":[3,2,1],"percentiles":[2,98],
/// "gamma":1.2}`, with `limits` in place of `percentiles`. Errors begin with the path of the key.
///
/// @param folder base of relative paths
Parsed<SceneImagery> read_imagery(const nlohmann::ordered_json& value, const std::string& folder);

/// Opens the raster, placed over the DEM by its georeferencing if both have a CRS, otherwise centred on world (0, 0).
///
/// @param dem null if the terrain is not a raster
///
/// Fails as ImageryRaster::open()
Result<std::shared_ptr<const ImagerySource>> open_imagery(const SceneImagery& imagery,
                                                          const DemInfo* dem);

/// The surface as a map. A raster is placed over the DEM by its georeferencing if the DEM has a CRS, otherwise centred
/// on world (0, 0).
///
/// @param dem null if the terrain is not a raster
///
/// Fails as SurfaceRaster::open()
Result<std::shared_ptr<const SurfaceMap>> open_surface(const SceneSurface& surface,
                                                       const DemInfo* dem);

/// A mesh file that an object or a node names.
struct MeshName {
    std::string file;         ///< path
    std::string name;         ///< of the file in the scene
    double crease_deg = 0.0;  ///< largest angle between triangles that are shaded as one surface
    std::vector<std::string> levels = {};  ///< paths of coarser levels by an artist, finest first
    bool operator==(const MeshName&) const = default;
};

/// Reads `mesh`, `levels` and `crease_deg` of an object or node. @param folder base of relative paths
Parsed<MeshName> read_mesh_name(const nlohmann::ordered_json& object, const std::string& folder);
/// Default of `crease_deg`: largest angle between triangles that are shaded as one surface, degrees.
inline constexpr double kUsualCrease = 40.0;

/// Reads a mesh file with normals: the file's, or those of with_crease_normals().
///
/// Fails: as read_model() and TriangleMesh::validate()
Result<MeshModel> read_shaded_model(const std::string& path, double crease_deg = kUsualCrease);
/// A mesh that an object or node names, with the coarser levels of an artist.
struct LevelledModel : MeshModel {
    std::vector<TriangleMesh> coarser = {};  ///< their materials are indices of those of all levels
};
/// The same for the mesh that an object or node names, and for its levels.
Parsed<LevelledModel> read_named_mesh(const MeshName& name);

/// An individually placed mesh.
struct SceneObject {
    std::size_t mesh = 0;  ///< index of SceneObjects::meshes
    Pose world_from_object;
    double scale = 1.0;
    /// Error of the collision proxy, metres at scale 1; absent for an object without collisions.
    std::optional<double> proxy_error = {};
    std::size_t entry = 0;  ///< index in the scene's list
};

/// A mesh scattered over the ground.
struct SceneScatter {
    std::size_t mesh = 0;  ///< index of SceneObjects::meshes
    ScatterSettings settings;
    std::optional<double> proxy_error = {};  ///< as SceneObject::proxy_error
    std::size_t entry = 0;                   ///< index in the scene's list
};

/// `objects` of a scene.
struct SceneObjects {
    std::vector<TriangleMesh> meshes;  ///< with normals; vertices of equal positions differ in them
    /// [meshes] each indexed by TriangleMesh::materials; empty, of a mesh or of all: plain, one-sided.
    std::vector<std::vector<MeshMaterial>> materials;
    std::vector<std::vector<TriangleMesh>>
        coarser;  ///< [meshes] levels by an artist, finest first; empty, of a mesh or of all: none
    std::vector<std::string> files;  ///< [meshes] paths
    std::vector<std::string> names;  ///< [meshes] names of the files in the scene
    std::vector<SceneObject> objects;
    std::vector<SceneScatter> scatters;
};

/// Parses `objects` of a scene: a list of
/// `{"mesh":"file","crease_deg":c,"position":[x,y,z],"rotation":[w,x,y,z],"scale":s,"static":b,"proxy_error_m":e}` and
/// `{"scatter":{"mesh":"file","crease_deg":c,"per_km2":n,"slope_deg":[a,b],"height_m":[a,b],"scale":[a,b],"seed":k,
/// "static":b,"proxy_error_m":e}}`. Mesh, position and per_km2 are required. Files are read here, each once for each
/// crease angle, which is for meshes without normals (with_crease_normals()). Errors begin with the path of the key:
/// "objects[2].scatter.per_km2 must be".
///
/// @param folder base of relative paths
Parsed<SceneObjects> read_objects(const nlohmann::ordered_json& list, const std::string& folder);

/// Distance beyond which a scatter shows no object: the absence of the largest one is within an error there.
///
/// @param size        error of the absence of an object of scale 1, metres
/// @param error_angle largest screen error over the pixels per radian, > 0
/// @param extent      of the ground
///
/// Fails: invalid_argument if about 2^22 objects or more may be within that distance
Result<double> sight_range(const SceneScatter& scatter, double size, double error_angle,
                           const WorldRect& extent);

/// The pose of a scattered object, without its scale.
inline Pose pose_of(const ScatterPoint& point) {
    const double c = point.half_turn_cosine, s = point.half_turn_sine;
    Pose pose;
    pose.rotation << c * c - s * s, -2.0 * c * s, 0.0, 2.0 * c * s, c * c - s * s, 0.0, 0.0, 0.0,
        1.0;
    pose.translation = point.position_world;
    return pose;
}

}  // namespace terrane::tools
