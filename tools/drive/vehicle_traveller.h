// SPDX-License-Identifier: MIT
#pragma once

#include "dig/wheel_ruts.h"
#include "drive/traveller.h"

#include <terrane/collision/path_driver.h>
#include <terrane/terrain/height_source.h>

#include <cstdint>
#include <string>
#include <vector>

namespace terrane::tools {

/// In the order of the names of --vehicle.
enum class VehicleKind { truck, tracked, six_wheeler };
std::vector<std::string> vehicle_names();
VehicleSettings make_vehicle(VehicleKind kind);

/// Reaction to a rollover.
enum class OnRoll { stop, right };

/// A vehicle that a PathDriver drives.
class VehicleTraveller : public Traveller {
public:
    /// @param source must outlive it
    VehicleTraveller(const VehicleSettings& settings, PathDriver driver, OnRoll on_roll,
                     const HeightSource& source, const Eigen::Vector2d& start_world,
                     const Eigen::Vector2d& along_world);

    BodyNeed first_need() const override;
    Pose pose(const World& world) const override;
    Result<BodyId> enter(World& world, const Ground& ground, const World& obstacles) override;
    void control(World& world, bool goes) override;
    /// Puts it upright where it has rolled over, with OnRoll::right; again in a later step where ground is missing.
    void react(World& world, const Ground& ground, double dt) override;
    void change_ground(World& world, Pager& pager) override;
    bool has_ended(const World& world) const override;
    bool has_arrived() const override { return driver_.is_finished(); }
    bool is_supported(const World& world) const override;
    void add_supports(const World& world, std::vector<BodyId>& bodies) const override;
    std::vector<std::string> columns() const override { return {"wheels_on_ground", "tilt_deg"}; }
    std::vector<double> figures(const World& world) const override;
    void draw(const World& world, std::vector<DrawnObject>& objects) const override;

    /// Lets its wheels leave ruts; `ruts` must outlive it.
    void set_ruts(WheelRuts& ruts) { ruts_ = &ruts; }

    bool has_rolled_over() const { return has_rolled_over_; }  ///< at any time
    std::uint64_t rights() const { return rights_; }           ///< times that it was put upright

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

/// The pose of a vehicle parallel to the slope of the source at a point.
/// @param along_world heading, not zero
Pose slope_pose(const HeightSource& source, const Eigen::Vector2d& place_world,
                const Eigen::Vector2d& along_world, const VehicleSettings& settings);

/// The pose, moved vertically so that chassis and hanging wheels are at least 5 cm above the contact surface. Fails
/// where the ground there is not resident or the pose is out of range.
Result<Pose> pose_on_ground(const VehicleSettings& settings, Pose pose, const Ground& ground);

}  // namespace terrane::tools
