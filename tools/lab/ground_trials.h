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

/// The square of a terrain that bodies and questions of the dials are in, metres.
WorldRect trade_area(const Terrain& terrain);

/// The contact surface of trade_area() and some metres around it, all of it resident.
///
/// @param contact_spacing as PagerSettings::contact_spacing
///
/// Fails: as Pager; exit_failed where heights could not be read
CommandResult<Ground> load_contact_ground(const Terrain& terrain, double contact_spacing);

/// A sphere near the ground, and what is true of it.
struct ProbePose {
    Pose pose;             ///< world_from_shape
    bool touches = false;  ///< a sampled point of the true surface is inside of the sphere
};

/// Random poses of a sphere near the true surface, about half of which touch it, and whether they do, from samples of
/// HeightSource::height(). The same in every run. Fewer than wanted where a terrain has little ground.
std::vector<ProbePose> probe_poses(const Terrain& terrain, const Sphere& sphere, std::size_t count);

/// The share of pairs of `order` that `keys` does not order alike; a pair that `keys` leaves equal counts. Pairs that
/// are equal in `order` are left out.
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

/// What a drop costs, and what it gets wrong.
struct DropFigures {
    double ms = 0.0;            ///< of the calling thread in all steps, a simulated second
    double wall_ms = 0.0;       ///< the same by the clock on the wall
    double max_depth_m = 0.0;   ///< deepest penetration of the contact surface
    double fell_through = 0.0;  ///< body steps deeper than their tolerance
    /// Energy that bodies gained in steps, over what they lost in all. Where they do not collide with each other,
    /// nothing gives them energy, and it is an error.
    double drift = 0.0;
};

/// Drops spheres above the middle of a ground: the same bodies in every run.
///
/// Fails: as World; exit_failed where no body finds ground
CommandResult<DropFigures> run_drop_trial(const DropTrial& trial, const Ground& ground);

/// What a flight costs and how far it is from the true surface.
struct FlightFigures {
    double error_px = 0.0;   ///< largest certified bound of all frames
    double triangles = 0.0;  ///< mean of the frames
    double update_ms = 0.0;  ///< Triangulator::update(), median of the frames
    double draw_ms =
        0.0;  ///< of the first frame until the picture can be read; NaN without a device
};

/// What Verifier measures of the same frames: the same in every run.
struct FlightTruth {
    double error_px = 0.0;    ///< largest error by brute force
    double max_pop_px = 0.0;  ///< largest movement from a frame to the next
};

/// Moments of a flight over a terrain, each with two consecutive frames and with all chunks resident that the finest
/// settings of the dials can draw. So paging has no part in what is measured here.
class FlightGround {
public:
    /// Loads the chunks: seconds.
    ///
    /// Fails: as CameraPath, FrameMaker
    static CommandResult<std::shared_ptr<FlightGround>> create(const TradePlace& place);

    /// Makes all frames. Fails with usage of settings that Triangulator::create() refuses.
    Result<FlightFigures> fly(const TriangulatorSettings& settings);
    /// Makes the frames of the first moments, and measures them.
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
    std::unique_ptr<Device> device_;  // null: none opens
};

}  // namespace terrane::tools
