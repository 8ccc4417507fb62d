// SPDX-License-Identifier: MIT
#pragma once

#include "drive/traveller.h"
#include "world/polyline.h"

#include <terrane/terrain/height_source.h>

#include <string>
#include <vector>

namespace terrane::tools {

/// A character that walks along a line, towards the point 2 m ahead. Where it gets no farther it turns to one side for
/// some time, then to the other one, each time for longer.
class CharacterTraveller : public Traveller {
public:
    /// @param source must outlive it
    /// @param speed  wanted, m/s
    CharacterTraveller(const CharacterSettings& settings, Polyline path, double speed,
                       const HeightSource& source);

    BodyNeed first_need() const override;
    Pose pose(const World& world) const override;
    Result<BodyId> enter(World& world, const Ground& ground, const World& obstacles) override;
    void control(World& world, bool goes) override;
    void react(World& world, const Ground& ground, double dt) override;
    bool has_ended(const World& world) const override;
    bool has_arrived() const override;
    bool is_supported(const World& world) const override { return state(world).stands; }
    void add_supports(const World& world, std::vector<BodyId>& bodies) const override;
    std::vector<std::string> columns() const override { return {"stands"}; }
    std::vector<double> figures(const World& world) const override;
    void draw(const World& world, std::vector<DrawnObject>& objects) const override;

private:
    const CharacterState& state(const World& world) const { return *world.character(body_); }
    Eigen::Vector2d wanted_direction(const Eigen::Vector2d& here) const;

    CharacterSettings settings_;
    Polyline path_;
    double speed_;
    WorldPos start_ = WorldPos::Zero();
    Eigen::Vector2d heading_;
    BodyId body_{};
    double along_ = 0.0;          // farthest point of the path that it was nearest to
    double stuck_time_ = 0.0;     // seconds without progress
    double stuck_along_ = 0.0;    // of the last place without progress
    double detour_length_ = 0.0;  // seconds of the last detour there
    double detour_time_ = 0.0;    // seconds left of a detour
    double detour_side_ = -1.0;   // 1: left
};

}  // namespace terrane::tools
