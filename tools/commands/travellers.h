// SPDX-License-Identifier: MIT
#pragma once

#include "frames/body_nodes.h"
#include "program/geometry.h"
#include "record/run_record.h"
#include "scene/vehicle_placement.h"
#include "scene/wheel_ruts.h"

#include <terrane/collision/vehicle.h>
#include <terrane/collision/world.h>
#include <terrane/playback/camera_path.h>
#include <terrane/terrain/height_source.h>
#include <terrane/terrain/pager.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace terrane::tools {

/// Names and values of the additional columns of frames.csv for a vehicle and for a character.
std::vector<std::string> vehicle_columns();
std::vector<double> vehicle_figures(const VehicleState& vehicle);
std::vector<std::string> character_columns();
std::vector<double> character_figures(const CharacterState& character);

/// How far a traveller has come along its path.
struct PathProgress {
    bool has_arrived = false;              ///< at the end of the path
    double share = 0.0;                    ///< of the path's length, 0 to 1
    double stuck_s = 0.0;                  ///< total time without progress
    std::optional<WorldVec2> stuck_world;  ///< where it was last stuck; none if it never was
};

/// A body that a Journey moves along a path: a vehicle or a character.
class Traveller {
public:
    virtual ~Traveller() = default;

    /// The need for the traveller's ground before it enters a world.
    virtual BodyNeed first_need() const = 0;
    /// The pose that a camera follows, x forward. Valid both before and after the traveller enters a world.
    virtual Pose pose(const World& world) const = 0;

    /// Adds the traveller's body to a world, at rest on the ground.
    ///
    /// @param obstacles another world, whose bodies the traveller must not touch
    /// Fails: invalid_argument if the ground is not resident, or a body occupies its position
    virtual Result<BodyId> enter(World& world, const Ground& ground, const World& obstacles) = 0;

    /// Sets the controls for the next step of `dt` seconds: to follow the path or, if `goes` is false, to stop.
    ///
    /// Returns: the controls that were set
    virtual RunAction control(World& world, bool goes, double dt) = 0;
    /// Reacts to a completed step of `dt` seconds.
    ///
    /// Returns: whether it changed the world
    virtual bool react(World& world, const Ground& ground, double dt) = 0;
    /// Changes the ground. Called before each update of the pager, in the same frame. Returns whether it has changed.
    virtual bool change_ground(World&, Pager&) { return false; }
    /// The edits of the ground in force.
    virtual std::span<const GroundEdit> ground_edits() const { return {}; }
    /// Whether the journey is over: the traveller has arrived and stopped, or cannot continue.
    virtual bool has_ended(const World& world) const = 0;
    virtual PathProgress progress() const = 0;

    /// Whether ground or a body supports the traveller.
    virtual bool is_supported(const World& world) const = 0;
    /// Appends the bodies that support the traveller.
    virtual void add_supports(const World& world, std::vector<BodyId>& bodies) const = 0;

    /// Names and values of its columns of frames.csv.
    virtual std::vector<std::string> columns() const = 0;
    virtual std::vector<double> figures(const World& world) const = 0;
    /// How it faces and has walked, if it is a character.
    virtual CharacterGait gait() const { return {}; }
    /// Shows the traveller. Fails as BodyNodes::show()
    virtual Result<void> show(const World& world, BodyNodes& nodes) const = 0;
};

/// The ground over which a path is laid for a vehicle. The steepest slope is a share of the slope on which it could
/// climb, stand across and not slide. The highest bump, between axles as far apart as its outer ones, neither touches
/// its chassis nor is beyond the travel of its suspension.
CameraPathSettings ground_limits(const VehicleSettings& settings);

/// What a vehicle does after a rollover: ends the journey, or is set upright and goes on.
enum class OnRoll { stop, right };

/// A vehicle driven by a PathDriver.
class VehicleTraveller : public Traveller {
public:
    /// @param source must outlive the traveller
    VehicleTraveller(const VehicleSettings& settings, PathDriver driver, OnRoll on_roll,
                     const HeightSource& source, const Eigen::Vector2d& start_world,
                     const Eigen::Vector2d& along_world);

    BodyNeed first_need() const override;
    Pose pose(const World& world) const override;
    Result<BodyId> enter(World& world, const Ground& ground, const World& obstacles) override;
    RunAction control(World& world, bool goes, double dt) override;
    /// With OnRoll::right, sets the vehicle upright after a rollover; tries again in the next step if ground is not
    /// resident.
    bool react(World& world, const Ground& ground, double dt) override;
    bool change_ground(World& world, Pager& pager) override;
    std::span<const GroundEdit> ground_edits() const override;
    bool has_ended(const World& world) const override;
    PathProgress progress() const override;
    bool is_supported(const World& world) const override;
    void add_supports(const World& world, std::vector<BodyId>& bodies) const override;
    std::vector<std::string> columns() const override { return vehicle_columns(); }
    std::vector<double> figures(const World& world) const override;
    Result<void> show(const World& world, BodyNodes& nodes) const override;

    /// Makes the wheels leave ruts. `ruts` must outlive the traveller.
    void set_ruts(WheelRuts& ruts) { ruts_ = &ruts; }

    bool has_rolled_over() const { return has_rolled_over_; }  ///< at any time
    std::uint64_t rights() const { return rights_; }  ///< how often the vehicle was set upright

private:
    const VehicleState& state(const World& world) const { return *world.vehicle(body_); }

    VehicleSettings settings_;
    PathDriver driver_;
    OnRoll on_roll_;
    const HeightSource& source_;
    Pose start_;
    BodyId body_{};
    WheelRuts* ruts_ = nullptr;
    bool has_rolled_over_ = false;
    std::uint64_t rights_ = 0;
};

/// A character that walks along a polyline, towards the point 2 m ahead. When blocked it detours to one side for some
/// time, then to the other, each time for longer.
class CharacterTraveller : public Traveller {
public:
    /// @param source must outlive the traveller
    /// @param speed  wanted speed, m/s
    CharacterTraveller(const CharacterSettings& settings, Polyline path, double speed,
                       const HeightSource& source);

    BodyNeed first_need() const override;
    Pose pose(const World& world) const override;
    Result<BodyId> enter(World& world, const Ground& ground, const World& obstacles) override;
    RunAction control(World& world, bool goes, double dt) override;
    bool react(World& world, const Ground& ground, double dt) override;
    bool has_ended(const World& world) const override;
    PathProgress progress() const override;
    bool is_supported(const World& world) const override { return state(world).stands; }
    void add_supports(const World& world, std::vector<BodyId>& bodies) const override;
    std::vector<std::string> columns() const override { return character_columns(); }
    std::vector<double> figures(const World& world) const override;
    CharacterGait gait() const override { return gait_; }
    Result<void> show(const World& world, BodyNodes& nodes) const override;

private:
    const CharacterState& state(const World& world) const { return *world.character(body_); }
    Eigen::Vector2d wanted_direction(const Eigen::Vector2d& here) const;
    bool has_arrived() const;
    bool is_stuck() const;

    CharacterSettings settings_;
    Polyline path_;
    double speed_;
    WorldPos start_ = WorldPos::Zero();
    CharacterGait gait_;
    CharacterControls controls_;  // of the last step
    BodyId body_{};
    double along_ = 0.0;       // metres along the path to the nearest point; never decreases
    double stuck_time_ = 0.0;  // seconds without progress or detour
    double still_time_ = 0.0;  // seconds without progress
    double total_stuck_time_ = 0.0;
    std::optional<WorldVec2> stuck_world_;
    double stuck_along_ = 0.0;    // `along_` at the start of the last detour
    double detour_length_ = 0.0;  // duration of the last detour, seconds; 0 when past the obstacle
    double detour_time_ = 0.0;    // seconds left of a detour
    double detour_side_ = -1.0;   // 1: left
};

}  // namespace terrane::tools
