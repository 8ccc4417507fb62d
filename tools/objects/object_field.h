// SPDX-License-Identifier: MIT
#pragma once

#include "objects/object_levels.h"
#include "objects/square_maker.h"
#include "scene/scene_objects.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/scene/scene.h>
#include <terrane/terrain/scatter.h>

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace terrane::tools {

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
