// SPDX-License-Identifier: MIT
#pragma once

#include "scene/mesh_files.h"
#include "scene/scene_nodes.h"
#include "scene/scene_objects.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/scene/object_levels.h>
#include <terrane/scene/scene.h>
#include <terrane/terrain/scatter.h>
#include <terrane/terrain/triangle_mesh.h>

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace terrane::tools {

/// A square that has been computed.
struct MadeSquare {
    std::size_t scatter = 0;  ///< as given to SquareMaker::request()
    ScatterSquare square;
    /// Absent if the source's heights could not be read.
    std::optional<std::vector<ScatterPoint>> points;
};

/// Computes squares of scatters on its own thread, in the order of the requests, so that frames do not wait for the
/// source.
class SquareMaker {
public:
    /// @param has_thread false: request() computes the square itself, so that every run gives the same frames
    explicit SquareMaker(bool has_thread);
    SquareMaker(const SquareMaker&) = delete;
    SquareMaker& operator=(const SquareMaker&) = delete;
    ~SquareMaker();

    /// @param scatter caller's index of the scatter
    /// @param from    the scatter; must live until the square has been taken or the maker is destroyed
    void request(std::size_t scatter, const Scatter& from, const ScatterSquare& square);
    /// Appends at most `most` computed squares, in the order of their requests.
    void take(std::size_t most, std::vector<MadeSquare>& made_out);
    /// Waits until all requested squares are computed.
    void finish();

private:
    struct Request {
        std::size_t scatter;
        const Scatter* from;
        ScatterSquare square;
    };
    static MadeSquare make(const Request& request);
    void run(const std::stop_token& stop);

    std::mutex mutex_;
    std::condition_variable_any changed_;
    std::deque<Request> requests_;  // the first one is being computed
    std::deque<MadeSquare> made_;
    std::jthread thread_;  // declared last: it uses all other members
};

/// The meshes and images of nodes, in a scene and on the device.
struct NodeModels {
    std::vector<ModelId> models;          ///< [SceneNodes::meshes]
    std::vector<ParticleImageId> images;  ///< [SceneNodes::images]; empty without a renderer
};

/// Statistics of the objects of a frame.
struct ObjectCounts {
    std::size_t drawn = 0;
    std::size_t culled = 0;       ///< out of view
    std::size_t left_out = 0;     ///< in view, too small for the threshold
    std::size_t occluded = 0;     ///< behind the ground; not in the other counts
    double occluded_share = 0.0;  ///< SceneCounts::occluded_share
    std::size_t triangles = 0;
    std::size_t failed_squares = 0;  ///< since creation: squares whose heights could not be read
    double ms = 0.0;                 ///< of squares, culling and levels together
};

struct ObjectFieldSettings {
    double max_error_px = 1.0;  ///< objects with a smaller error of absence are not drawn, > 0
    View picture;               ///< has the size and field of view of the frames
    bool has_thread = true;     ///< false: see SquareMaker
    std::optional<SunShadows> shadows = {};  ///< of the renderer's frames
};

/// The objects of a scene around a moving camera: adds and removes squares of scatters, and provides the draws of
/// frames.
class ObjectField {
public:
    /// @param source   ground on which objects are scattered, including its volumes: no objects stand where a volume
    ///                 replaces the heightfield
    /// @param renderer receives the meshes and impostors; null if no frames are drawn
    ///
    /// Fails: as make_object_levels(), Scatter::create() and TerrainRenderer::add_mesh(); invalid_argument for a
    ///        scatter that may have more than 2^22 objects in range. The message names the file of the mesh.
    static Result<ObjectField> create(std::shared_ptr<const HeightSource> source,
                                      const SceneObjects& objects,
                                      const ObjectFieldSettings& settings,
                                      TerrainRenderer* renderer);

    /// Adds the nodes of a scene.
    ///
    /// @param source   ground of nodes on the ground
    /// @param renderer as for create()
    ///
    /// Fails: as make_object_levels(), TerrainRenderer::add_mesh() and Scene::add(), naming the node; invalid_argument
    ///        for a node on the ground where there is none
    Result<void> add_nodes(const SceneNodes& nodes, const HeightSource& source,
                           TerrainRenderer* renderer);

    /// Adds the meshes and images of the nodes of bodies, without impostors as add_body_model(). Fails as add_nodes()
    Result<NodeModels> add_body_models(const SceneNodes& nodes, TerrainRenderer* renderer);
    /// Adds a node and its subtree below a node of the scene.
    ///
    /// @param first index of the node in `nodes`
    /// @param place of the node in the frame of `parent`
    ///
    /// Fails: as Scene::add(), naming the node; nothing is added then
    Result<std::vector<NodeId>> add_subtree(const SceneNodes& nodes, std::size_t first,
                                            const NodeModels& models, NodeId parent,
                                            const NodePlace& place);

    /// Adds the model of a body, which tumbles: without an impostor, because that shows a model from above only.
    ///
    /// @param renderer as for create()
    ///
    /// Fails: as make_object_levels() and TerrainRenderer::add_mesh()
    Result<ModelId> add_body_model(const MeshModel& model, TerrainRenderer* renderer);
    /// The scene, for nodes of bodies.
    Scene& scene() { return scene_; }

    /// Changes the shadows of the following frames: see ObjectFieldSettings::shadows.
    void set_shadows(const std::optional<SunShadows>& shadows) { shadows_ = shadows; }

    /// Sets the time of emitters: see Scene::set_time().
    void set_time(double time_s) { scene_.set_time(time_s); }

    /// Blocks until all squares in range of a view are in the scene.
    void load_all(const View& view);

    /// Whether objects behind the ground may be culled: not if objects cast shadows.
    bool can_be_hidden() const { return !(shadows_ && has_shadows(*shadows_)); }

    /// Begins a frame: updates squares and culls. A square whose heights cannot be read stays empty and is counted.
    ///
    /// @param horizon_map see Scene::begin_frame()
    std::span<const TriangleDemand> begin_frame(const View& view,
                                                const HorizonMap* horizon_map = nullptr);
    /// Restarts the frame without occlusion by the ground.
    std::span<const TriangleDemand> begin_again(const View& view);
    /// Ends the frame: see Scene::end_frame().
    SceneDraws end_frame(double threshold_px);

    /// Counts of the last frame; before end_frame() only the counts of occlusion are valid.
    const ObjectCounts& counts() const { return counts_; }
    /// A note about each node of add_nodes() that is below the heightfield as a whole.
    std::span<const std::string> buried() const { return buried_; }

private:
    /// A scatter and its squares in the scene.
    struct ScatteredModel {
        Scatter scatter;
        ModelId model;
        double range = 0.0;  // distance beyond which no object is drawn, metres
        /// Squares that are requested or in the scene; those without a node are not computed yet.
        std::map<ScatterSquare, std::optional<NodeId>> squares = {};
        std::vector<ScatterSquare> absent = {};      // to be requested, nearest last
        std::optional<WorldPos> followed_from = {};  // eye position at which `absent` was computed
    };

    ObjectField(Scene scene, const ObjectFieldSettings& settings);
    Result<std::vector<ObjectLevels>> add_models(
        std::span<const TriangleMesh> meshes, std::span<const std::vector<TriangleMesh>> coarser,
        std::span<const std::vector<MeshMaterial>> materials, std::span<const std::string> files,
        TerrainRenderer* renderer, bool has_impostors, std::vector<ModelId>& models_out);
    Result<NodeModels> add_node_models(const SceneNodes& nodes, TerrainRenderer* renderer,
                                       bool has_impostors);
    void find_absent(ScatteredModel& scattered, const WorldPos& eye);
    void follow(const WorldPos& eye, std::size_t most_requests);
    void add_made(std::size_t most);
    std::span<const TriangleDemand> cull(const View& view, const HorizonMap* horizon_map);

    Scene scene_;
    double max_error_px_;
    std::optional<SunShadows> shadows_;
    std::vector<std::unique_ptr<ScatteredModel>>
        scattered_;                       // stable addresses: the maker reads their scatters
    std::unique_ptr<SquareMaker> maker_;  // declared after scattered_: destroyed first
    std::size_t pending_ = 0;             // squares requested and not taken
    std::vector<MadeSquare> made_;        // scratch
    ObjectCounts counts_;
    std::vector<std::string> buried_;
};

}  // namespace terrane::tools
