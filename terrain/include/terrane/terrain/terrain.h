// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace terrane {

/// A camera of a Terrain. It is identified from update to update by its index in the list.
struct Camera {
    View view;                                           ///< where it is, and what it sees
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< metres a second, world axes
    /// The camera's future trajectory, if known; the rules of CameraNeed::trajectory apply.
    std::span<const CameraMoment> trajectory = {};
    /// Triangles that another renderer, such as a Scene, demands from the budget of the camera's mesh, which grants
    /// them by TerrainMesh::demand_threshold_px: see Triangulator::update(). Read during the update only.
    std::span<const TriangleDemand> demands = {};
};

/// Settings of a Terrain. Fixed once it is created.
struct TerrainSettings {
    PagerSettings paging{};         ///< memory, threads, contact spacing
    TriangulatorSettings meshes{};  ///< triangle budget and error target of each camera
    /// Friction, restitution and material by place; null: none.
    std::shared_ptr<const SurfaceMap> surface = nullptr;
};

/// The terrain at one moment: the contact surface, and a mesh for each camera.
struct Frame {
    Ground ground;  ///< the contact surface of the resident chunks: a snapshot
    /// [cameras] meshes, in the order in which update() got the cameras. Valid until the next update.
    std::span<const TerrainMesh> meshes;
    std::size_t late_chunks = 0;        ///< PagerStats::late_chunks
    std::size_t groundless_bodies = 0;  ///< bodies whose ground is not resident yet
};

/// Terrain for a simulator to draw and collide with: a pager, a triangulator for each camera, and the contact surface.
///
/// Each update() pages by the needs of cameras and bodies, triangulates the view of each camera over the resident
/// chunks, and passes the threshold of each mesh to the pager, which then loads no detail that the budget cannot show.
/// The parts may also be used separately: pager.h, triangulator.h, ground.h.
///
///     Terrain terrain = Terrain::create(source).value();
///     World world = World::create({}).value();
///     for (...) {
///         const Frame& frame = terrain.update({camera}, world.needs(), time_s);
///         world.step(frame.ground, dt);
///         draw(frame.meshes[0]);
///     }
///
/// Threads: one thread calls all functions; any thread may use the ground of a frame
class Terrain {
public:
    /// @param source the heights; shared ownership
    ///
    /// Fails: as Pager::create() and Triangulator::create()
    static Result<Terrain> create(std::shared_ptr<const HeightSource> source,
                                  const TerrainSettings& settings = {});
    Terrain(Terrain&&) noexcept;
    Terrain& operator=(Terrain&&) noexcept;
    ~Terrain();

    /// Pages and triangulates for one frame. Does not wait for loads, unless PagerSettings::worker_count is 0.
    ///
    /// @param bodies World::needs(), or the needs of the caller's own bodies
    /// @param time_s the current time, seconds, on any clock that does not go back
    ///
    /// Returns: the frame, valid until the next call of update() or load()
    const Frame& update(std::span<const Camera> cameras, std::span<const BodyNeed> bodies,
                        double time_s);
    /// The same with a list of cameras.
    const Frame& update(std::initializer_list<Camera> cameras, std::span<const BodyNeed> bodies,
                        double time_s) {
        return update(std::span(cameras.begin(), cameras.size()), bodies, time_s);
    }
    /// As update(), then loads until all needs are resident, or the ceiling or a failing source prevents it. Blocks:
    /// for the first frame.
    const Frame& load(std::span<const Camera> cameras, std::span<const BodyNeed> bodies,
                      double time_s);
    /// The same with a list of cameras.
    const Frame& load(std::initializer_list<Camera> cameras, std::span<const BodyNeed> bodies,
                      double time_s) {
        return load(std::span(cameras.begin(), cameras.size()), bodies, time_s);
    }

    /// As Pager::require(): keeps the ground of a region resident while the returned object lives.
    [[nodiscard]] RequiredRegion require(const WorldRect& region, double deadline_s);

    /// The frame of the last update. Before the first one nothing is resident.
    const Frame& frame() const;
    /// The source of the heights.
    const HeightSource& source() const;
    /// The pager: statistics, failures, replacement of chunks.
    Pager& pager();

private:
    struct State;
    explicit Terrain(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
