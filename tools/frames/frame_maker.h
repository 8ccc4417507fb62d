// SPDX-License-Identifier: MIT
#pragma once

#include "frames/flight_log.h"
#include "frames/frame_horizon.h"
#include "frames/verify.h"
#include "objects/object_field.h"

#include <terrane/scene/frame_governor.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace terrane::tools {

/// A frame. The mesh is valid until the next frame.
struct MadeFrame {
    TerrainMesh mesh;
    SceneDraws draws;  ///< of the objects of a scene
    FrameRecord record;
};

struct FrameMakerSettings {
    PagerSettings pager;
    TriangulatorSettings triangulator;
    bool verify = false;  ///< measures each frame by brute force
};

/// Runs pager and triangulator once per frame, as a simulator does, and records the cost of each frame.
class FrameMaker {
public:
    /// @param loader null: the loader threads of the pager's settings
    ///
    /// Fails as Pager::create() and Triangulator::create().
    static Result<FrameMaker> create(std::shared_ptr<const HeightSource> source,
                                     const FrameMakerSettings& settings,
                                     std::unique_ptr<ChunkLoader> loader = nullptr);

    /// Adds the objects of a scene, which share the budget of the ground from then on.
    void set_objects(std::unique_ptr<ObjectField> objects) { objects_ = std::move(objects); }

    /// Lets the budget follow the times of frames, up to the triangulator's.
    void set_governor(const FrameGovernor& governor) { governor_ = governor; }
    /// Reports the time of a frame, drawing included, to the governor.
    void add_frame_time(const FrameRecord& frame);

    /// Blocks until everything that the first frame can use is resident, or the memory ceiling is reached. Starts with
    /// a coarse error threshold and halves it, so that a small triangle budget loads no chunks that it cannot draw.
    /// Returns early where is_interrupted().
    ///
    /// @param time of the pager's clock, seconds
    void load_until_stable(const View& view, std::span<const BodyNeed> bodies, double time);

    /// Makes the frame of one time.
    ///
    /// @param camera its threshold_px is replaced by that of the previous frame
    /// @param time   of the pager's clock, seconds; must not decrease
    MadeFrame make(CameraNeed camera, std::span<const BodyNeed> bodies, double time);

    const Pager& pager() const { return pager_; }
    /// For what changes the ground between frames, such as a VolumeEditor.
    Pager& pager() { return pager_; }

private:
    FrameMaker(Pager pager, Triangulator triangulator);
    std::span<const TriangleDemand> with_kept_free(std::span<const TriangleDemand> of_objects);
    std::span<const TriangleDemand> begin_frame(const View& view, const HorizonMap* horizon);
    TerrainMesh triangulate(const View& view);

    Pager pager_;
    Triangulator triangulator_;
    std::optional<Verifier> verifier_;
    std::unique_ptr<ObjectField> objects_;  // null: none
    FrameHorizon horizon_;                  // of objects_
    std::optional<FrameGovernor> governor_;
    std::vector<TriangleDemand> demands_;  // scratch
    std::size_t budget_ = 0;
    double max_error_px_ = 1.0;
    double threshold_px_ = 1.0;
};

}  // namespace terrane::tools
