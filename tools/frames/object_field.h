// SPDX-License-Identifier: MIT
#pragma once

#include "scene/scene_objects.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/scene/object_model.h>
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
#include <thread>
#include <utility>
#include <vector>

namespace terrane::tools {

/// A mesh with levels of detail for a Scene.
struct ObjectLevels {
    ObjectModel model;  ///< its mesh and impostor are 0 until they are made
    TriangleMesh mesh;  ///< the vertices of all levels
    std::vector<std::vector<TriangleMesh::Triangle>> triangles;  ///< [levels that are meshes]
    /// [levels that are meshes] MeshLevel::morph_targets
    std::vector<std::vector<std::uint32_t>> morph_targets;

    /// For TerrainRenderer::add_mesh(); views of this.
    std::vector<MeshLevel> mesh_levels() const;
};

/// Contracts a mesh (ProgressiveMesh) to levels of a thousandth to a hundredth of its size that morph into each
/// other, with an impostor after them and its whole size as the error of its absence. Levels that save little are
/// left out. A mesh of many triangles has continuous levels too (ObjectModel::continuous).
///
/// Fails: invalid_argument as ProgressiveMesh::create(), and for a mesh without extent
Result<ObjectLevels> make_levels(const TriangleMesh& mesh);

/// A square that has been computed.
struct MadeSquare {
    std::size_t scatter = 0;  ///< as given to SquareMaker::request()
    ScatterSquare square;
    /// None where the source's heights could not be read.
    std::optional<std::vector<ScatterPoint>> points;
};

/// Computes squares of scatters on a thread of its own, in the order of the requests, so that frames do not wait for
/// the source.
class SquareMaker {
public:
    /// @param has_thread false: request() computes the square itself, so that every run gives the same frames
    explicit SquareMaker(bool has_thread);
    SquareMaker(const SquareMaker&) = delete;
    SquareMaker& operator=(const SquareMaker&) = delete;
    ~SquareMaker();

    /// @param scatter the caller's number of it
    /// @param from    must live until the square has been taken, or the maker is destroyed
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
    std::jthread thread_;  // last: it uses all of the above
};

/// Statistics of the objects of a frame.
struct ObjectCounts {
    std::size_t drawn = 0;
    std::size_t culled = 0;       ///< out of view
    std::size_t left_out = 0;     ///< in view, too small for the threshold
    std::size_t occluded = 0;     ///< behind the ground; in none of the others
    double occluded_share = 0.0;  ///< SceneCounts::occluded_share
    std::size_t triangles = 0;
    std::size_t failed_squares = 0;  ///< so far: their heights could not be read
    double ms = 0.0;                 ///< of squares, culling and levels together
};

struct ObjectFieldSettings {
    double max_error_px = 1.0;               ///< no object is drawn whose absence is less, > 0
    View picture;                            ///< of the frames: its size and field of view
    bool has_thread = true;                  ///< false: see SquareMaker
    std::optional<SunShadows> shadows = {};  ///< of the renderer's frames
};

/// The objects of a scene while a camera moves: squares of scatters come and go, and frames get their draws.
class ObjectField {
public:
    /// @param source   ground that scattered objects stand on, volumes included: where they replace it is no object
    /// @param renderer of the frames; null where none is drawn
    ///
    /// Fails: invalid_argument as make_levels() and Scatter::create(), with the file of the mesh; for a scatter of more
    ///        than 2^22 objects in sight; as TerrainRenderer::add_mesh()
    static Result<ObjectField> create(std::shared_ptr<const HeightSource> source,
                                      const SceneObjects& objects,
                                      const ObjectFieldSettings& settings,
                                      TerrainRenderer* renderer);

    /// Waits until all squares that a view can show are there.
    void load_all(const View& view);

    /// Whether what the ground hides may be left out: not while it can cast shadows.
    bool can_be_hidden() const { return !(shadows_ && has_shadows(*shadows_)); }

    /// Begins a frame: squares, culling. A square whose heights cannot be read stays empty, and is counted.
    ///
    /// @param horizon see Scene::begin_frame()
    std::span<const TriangleDemand> begin_frame(const View& view,
                                                const HorizonMap* horizon = nullptr);
    /// Begins the same frame again, with the objects that the ground hides.
    std::span<const TriangleDemand> begin_again(const View& view);
    /// Ends it: see Scene::end_frame().
    SceneDraws end_frame(double threshold_px);

    /// Of the last frame; before end_frame() only of what the ground hides.
    const ObjectCounts& counts() const { return counts_; }

private:
    /// A scatter and its squares in the scene.
    struct ScatteredModel {
        Scatter scatter;
        ModelId model;
        double range = 0.0;  // from which no object of it is drawn, metres
        /// Requested or in the scene; no group: requested, or without objects.
        std::map<ScatterSquare, std::optional<GroupId>> squares = {};
        std::vector<ScatterSquare> absent = {};      // to be requested, the nearest last
        std::optional<WorldPos> followed_from = {};  // where the eye was when `absent` was found
    };

    ObjectField(Scene scene, const ObjectFieldSettings& settings);
    void find_absent(ScatteredModel& scattered, const WorldPos& eye);
    void follow(const WorldPos& eye, std::size_t most_requests);
    void add_made(std::size_t most);
    std::span<const TriangleDemand> cull(const View& view, const HorizonMap* horizon);

    Scene scene_;
    double max_error_px_;
    std::optional<SunShadows> shadows_;
    std::vector<std::unique_ptr<ScatteredModel>>
        scattered_;                       // addresses stay: the maker reads their scatters
    std::unique_ptr<SquareMaker> maker_;  // after scattered_: it is destroyed first
    std::size_t pending_ = 0;             // squares requested and not taken
    std::vector<MadeSquare> made_;        // scratch
    ObjectCounts counts_;
};

}  // namespace terrane::tools
