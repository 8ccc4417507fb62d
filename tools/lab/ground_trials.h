// SPDX-License-Identifier: MIT
#pragma once

#include "lab/dial.h"
#include "program/command.h"

#include <terrane/collision/shapes.h>
#include <terrane/collision/world.h>
#include <terrane/render/terrain_renderer.h>
#include <terrane/terrain/ground.h>
#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/triangulator.h>
#include <terrane/terrain/view.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

namespace terrane::tools {

/// The square of a terrain that contains the bodies and queries of the dials, metres.
WorldRect trade_area(const Terrain& terrain);

/// The contact surface of trade_area() and some metres around it, entirely resident.
///
/// @param contact_spacing as PagerSettings::contact_spacing
///
/// Fails: as Pager; exit_failed if heights could not be read
CommandResult<Ground> load_contact_ground(const Terrain& terrain, double contact_spacing);

/// A sphere near the ground, with its true contact state.
struct ProbePose {
    Pose pose;             ///< world_from_shape
    bool touches = false;  ///< whether a sampled point of the true surface is inside the sphere
};

/// Random poses of a sphere near the true surface, about half of which touch it, as determined from samples of
/// HeightSource::height(). The same in every run. Fewer than `count` if a terrain has little ground.
std::vector<ProbePose> probe_poses(const Terrain& terrain, const Sphere& sphere, std::size_t count);

/// The share of pairs that `keys` and `order` rank differently; a tie in `keys` counts as different. Pairs tied in
/// `order` are excluded.
double disorder_share(const std::vector<double>& keys, const std::vector<double>& order);

/// A drop of spheres onto loaded ground.
struct DropTrial {
    std::size_t count = 100;         ///< spheres, radius 0.5 m, 1 kg
    double seconds = 1.0;            ///< simulated
    double dt = 1.0 / 60.0;          ///< of a step, seconds
    double contact_tolerance = 0.0;  ///< of a body, metres; 0: the default
    double speed = 10.0;             ///< downward at the start, m/s
    WorldSettings world{.collide_bodies = false};
};

/// Cost and errors of a drop.
struct DropFigures {
    double ms = 0.0;  ///< processor time of the calling thread in all steps, per simulated second
    double wall_ms = 0.0;       ///< the same in wall-clock time
    double max_depth_m = 0.0;   ///< deepest penetration of the contact surface
    double fell_through = 0.0;  ///< body steps deeper than their tolerance
    /// Energy gained by bodies in steps, relative to the energy lost in total. Bodies that do not collide with each
    /// other have no source of energy, so that any gain is an error.
    double drift = 0.0;
};

/// Drops spheres over the centre of a ground: the same bodies in every run.
///
/// Fails: as World; exit_failed if no body finds ground
CommandResult<DropFigures> run_drop_trial(const DropTrial& trial, const Ground& ground);

/// Cost and error of a flight.
struct FlightFigures {
    double error_px = 0.0;   ///< largest certified bound of all frames
    double triangles = 0.0;  ///< mean of the frames
    double update_ms = 0.0;  ///< Triangulator::update(), median of the frames
    double draw_ms =
        0.0;  ///< time of the first frame until the picture can be read; NaN without a device
};

/// Verifier's measurements of the same frames; the same in every run.
struct FlightTruth {
    double error_px = 0.0;    ///< largest error by brute force
    double max_pop_px = 0.0;  ///< largest movement from a frame to the next
};

/// Moments of a flight over a terrain, each with two consecutive frames. All chunks that the finest settings of the
/// dials can draw are resident, so that paging does not affect the measurements.
class FlightGround {
public:
    /// Loads the chunks, which takes seconds.
    ///
    /// Fails: as CameraPath, FrameMaker
    static CommandResult<std::shared_ptr<FlightGround>> create(const TradePlace& place);

    /// Makes all frames. Fails for settings that Triangulator::create() refuses.
    Result<FlightFigures> fly(const TriangulatorSettings& settings);
    /// Makes and measures the frames of the first moments.
    Result<FlightTruth> verify(const TriangulatorSettings& settings) const;

private:
    struct Moment {
        View view, next;  ///< 1/30 s apart
        std::shared_ptr<const ResidentSet> resident;
    };
    struct Device {
        EglContext context;  // the renderer's objects live in it
        TerrainRenderer renderer;
    };

    explicit FlightGround(std::shared_ptr<const HeightSource> source)
        : source_(std::move(source)) {}
    Result<double> draw(const TerrainMesh& mesh, const View& view);
    void open_device(bool is_quick);

    std::shared_ptr<const HeightSource> source_;
    std::vector<Moment> moments_;
    std::size_t verified_moments_ = 1;
    std::unique_ptr<Device> device_;  // null: none can be opened
};

}  // namespace terrane::tools
