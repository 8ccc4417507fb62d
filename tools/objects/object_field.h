// SPDX-License-Identifier: MIT
#pragma once

#include "objects/object_levels.h"
#include "scene/scene_objects.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/scene/scene.h>
#include <terrane/terrain/scatter.h>

#include <cstddef>
#include <map>
#include <memory>
#include <span>
#include <vector>

namespace terrane::tools {

/// What a frame has of objects.
struct ObjectCounts {
    std::size_t drawn = 0;
    std::size_t culled = 0;    ///< out of view
    std::size_t left_out = 0;  ///< in view, too small for the threshold
    std::size_t triangles = 0;
    std::size_t failed_squares = 0;  ///< so far
    double ms = 0.0;                 ///< of squares, culling and levels together
};

/// The objects of a scene while a camera moves: squares of scatters come and go, and frames get their draws. Squares
/// are made in begin_frame(), two a frame at most, so that the same views give the same frames.
class ObjectField {
public:
    /// @param renderer of the frames; null where none is drawn
    ///
    /// Fails: invalid_argument as make_levels() and Scatter::create(), with "objects[2]" where a mesh or scatter is
    ///        meant; for a scatter of more than 2^22 objects in sight; as TerrainRenderer::add_mesh()
    static Result<ObjectField> create(std::shared_ptr<const HeightSource> source,
                                      const SceneObjects& objects, double max_error_px,
                                      const View& picture, TerrainRenderer* renderer);

    /// Makes all squares that a view can show.
    void load_all(const View& view);

    /// Begins a frame: squares, culling. A square whose heights cannot be read stays empty, and is counted.
    std::span<const TriangleDemand> begin_frame(const View& view);
    /// Ends it: see Scene::end_frame().
    SceneDraws end_frame(double threshold_px);

    /// Of the last frame.
    const ObjectCounts& counts() const { return counts_; }

private:
    /// A scatter and its squares in the scene.
    struct Strewn {
        Scatter scatter;
        ModelId model;
        double range;  // from which no object of it is drawn, metres
        std::map<ScatterSquare, GroupId> squares;
        bool is_complete =
            false;  // all squares in range of `followed_from`, and a little more, are there
        WorldPos followed_from = WorldPos::Zero();
    };

    ObjectField(Scene scene, double max_error_px)
        : scene_(std::move(scene)), max_error_px_(max_error_px) {}
    void follow(Strewn& strewn, const View& view, std::size_t most_squares);
    void add_square(Strewn& strewn, const ScatterSquare& square);

    Scene scene_;
    double max_error_px_;  // no object is drawn whose absence is less
    std::vector<Strewn> strewn_;
    ObjectCounts counts_;
};

}  // namespace terrane::tools
