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
    std::size_t culled = 0;    ///< out of view or behind the ground
    std::size_t occluded = 0;  ///< those of them that are behind the ground: SceneCounts::occluded
    std::size_t left_out = 0;  ///< in view, too small for the threshold
    std::size_t triangles = 0;
    std::size_t failed_squares = 0;  ///< so far: their heights could not be read
    double ms = 0.0;                 ///< of squares, culling and levels together
};

struct ObjectFieldSettings {
    double max_error_px = 1.0;  ///< no object is drawn whose absence is less, > 0
    View picture;               ///< of the frames: its size and field of view
    bool has_thread = true;     ///< false: see SquareMaker
    bool has_horizon =
        false;  ///< objects that the ground hides are culled: for frames without shadows
};

/// The objects of a scene while a camera moves: squares of scatters come and go, and frames get their draws.
class ObjectField {
public:
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

    /// Begins a frame: squares, culling. A square whose heights cannot be read stays empty, and is counted.
    ///
    /// @param resident        of the frame
    /// @param ground_error_px see HorizonMap::build(). Where the frame's mesh has a larger error, and
    ///                        counts().occluded is not 0, begin_again()
    std::span<const TriangleDemand> begin_frame(const View& view,
                                                const std::shared_ptr<const ResidentSet>& resident,
                                                double ground_error_px);
    /// Begins the same frame again: with the objects that the ground hides.
    std::span<const TriangleDemand> begin_again(const View& view);
    /// Ends it: see Scene::end_frame().
    SceneDraws end_frame(double threshold_px);

    /// Of the last frame; `occluded` from begin_frame() on.
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

    Scene scene_;
    double max_error_px_;
    std::optional<HorizonMap> horizon_;
    std::vector<std::unique_ptr<ScatteredModel>>
        scattered_;                       // addresses stay: the maker reads their scatters
    std::unique_ptr<SquareMaker> maker_;  // after scattered_: it is destroyed first
    std::size_t pending_ = 0;             // squares requested and not taken
    std::vector<MadeSquare> made_;        // scratch
    ObjectCounts counts_;
};

}  // namespace terrane::tools
