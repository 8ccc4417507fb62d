// SPDX-License-Identifier: MIT
#pragma once

#include "frames/flight_log.h"
#include "frames/object_field.h"
#include "frames/verification.h"

#include <terrane/render/gpu_triangulator.h>
#include <terrane/scene/frame_governor.h>
#include <terrane/scene/horizon_map.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace terrane::tools {

/// Decides in which frames a horizon map, which finds objects behind the ground, is worth its cost.
///
/// A map pays if it hides at least 300 objects and at least a quarter of the objects that would otherwise be drawn; a
/// fifth is enough if the previous frame's map paid. A frame whose map does not pay hides nothing, so that trials are
/// invisible. After such a frame, and after a frame whose errors exceeded the map's limits, 32 frames have no map. The
/// decision depends on the content of earlier frames, not on their times: equal flights have equal frames.
class FrameHorizon {
public:
    /// Begins a frame. Returns its map, or null if a map is not expected to pay.
    const HorizonMap* begin(const std::shared_ptr<const ResidentSet>& resident, const View& view);

    /// Whether the frame has a map.
    bool has_map() const { return has_map_; }

    /// Whether the map pays, according to the counts of culling with it; true without a map. If false, cull again
    /// without the map.
    bool pays(const ObjectCounts& culled);

    /// Whether the errors of a mesh are within the map's limits, so that the hidden objects are behind the drawn
    /// ground; true without a map. If false, cull and triangulate again without the map.
    ///
    /// @param is_eye_above see HorizonMap::holds_for()
    bool holds_for(const TerrainMesh& mesh, std::optional<bool> is_eye_above = {});

    /// Ends the frame.
    ///
    /// @param mesh   the drawn mesh
    /// @param counts of the frame's objects
    void end(const TerrainMesh& mesh, const ObjectCounts& counts);

    /// Sets the error limits of the next map from the errors of a mesh.
    void follow(const TerrainMesh& mesh);

    /// Time to compute the map of the last frame; 0 if it had none.
    double ms() const { return ms_; }

private:
    void leave_out();

    HorizonMap map_;
    GroundError largest_;    // error limits of the next map
    bool has_map_ = false;   // whether this frame has a map
    bool has_paid_ = false;  // whether the last map paid, and held for its frame
    /// Objects drawn or hidden in the last frame; initially enough for a map.
    std::size_t object_count_ = std::numeric_limits<std::size_t>::max();
    std::size_t pause_ = 0;  // remaining frames without a map
    double ms_ = 0.0;
};

/// A completed frame. Its mesh is valid until the next frame.
struct MadeFrame {
    TerrainMesh mesh;
    SceneDraws draws;  ///< of the objects of a scene
    FrameRecord record;
};

struct FrameMakerSettings {
    PagerSettings pager;
    TriangulatorSettings triangulator;
    bool verify = false;  ///< whether each frame is measured by brute force: see Verifier
};

/// Runs pager and triangulator once per frame, as a simulator does, and records the cost of each frame.
class FrameMaker {
public:
    /// @param loader null: loader threads by the pager's settings
    ///
    /// Fails as Pager::create() and Triangulator::create().
    static Result<FrameMaker> create(std::shared_ptr<const HeightSource> source,
                                     const FrameMakerSettings& settings,
                                     std::unique_ptr<ChunkLoader> loader = nullptr);

    /// Adds the objects of a scene, which then share the ground's budget.
    void set_objects(std::unique_ptr<ObjectField> objects) { objects_ = std::move(objects); }
    /// The objects; null if there are none.
    ObjectField* objects() { return objects_.get(); }

    /// Changes budget, error target and morph ratio from the next frame on. Fails as Triangulator::create(); nothing is
    /// changed then.
    Result<void> set_triangulator(const TriangulatorSettings& settings);

    /// Makes the meshes of the following frames on a device. A frame for which that fails is made by the CPU: see
    /// FrameRecord::is_from_device.
    ///
    /// @param device with the settings of the maker; must outlive the frames; null: the CPU
    void set_device(GpuTriangulator* device) { device_ = device; }
    /// The mesh of the last frame with its triangles in memory: waits for the device if they are there. Fails as
    /// GpuTriangulator::read()
    Result<TerrainMesh> host_mesh();

    /// Controls the budget by frame times, up to the triangulator's budget.
    void set_governor(const FrameGovernor& governor) { governor_ = governor; }
    /// Reports the time of a frame, drawing included, to the governor.
    void add_frame_time(const FrameRecord& frame);

    /// Blocks until all chunks that the first frame can use are resident, or the memory ceiling is reached. Starts with
    /// a large error threshold and halves it step by step, so as not to load chunks that the triangle budget cannot
    /// draw. Returns early if is_interrupted().
    ///
    /// @param time of the pager's clock, seconds
    void load_until_stable(const View& view, std::span<const BodyNeed> bodies, double time);

    /// Makes the frame for one time.
    ///
    /// @param camera its threshold_px is replaced by that of the previous frame
    /// @param time       of the pager's clock, seconds; must not decrease
    /// @param scene_time of emitters; absent: as `time`
    MadeFrame make(CameraNeed camera, std::span<const BodyNeed> bodies, double time,
                   std::optional<double> scene_time = {});

    const Pager& pager() const { return pager_; }
    /// Access for changes of the ground between frames, such as by a VolumeEditor.
    Pager& pager() { return pager_; }

private:
    FrameMaker(std::shared_ptr<const HeightSource> source, Pager pager, Triangulator triangulator);
    std::span<const TriangleDemand> with_kept_free(std::span<const TriangleDemand> of_objects);
    std::span<const TriangleDemand> begin_frame(const View& view, const HorizonMap* horizon_map);
    TerrainMesh triangulate(const View& view);
    TerrainMesh update_mesh(const std::shared_ptr<const ResidentSet>& resident, const View& view,
                            std::span<const TriangleDemand> demands);

    std::shared_ptr<const HeightSource> source_;
    Pager pager_;
    Triangulator triangulator_;
    GpuTriangulator* device_ = nullptr;  // makes the meshes; null: triangulator_
    TerrainMesh mesh_;                   // of the last frame
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
