// SPDX-License-Identifier: MIT
#pragma once

// Project Chrono's terrain interface, chrono::vehicle::ChTerrain: height, normal and friction below a point, as queried
// by its wheels and tyres. Only instantiating ChronoTerrain needs Chrono:
//
//     using Terrain = terrane::adapters::ChronoTerrain<chrono::vehicle::ChTerrain, chrono::ChVector3d>;
//
// (Chrono before 9.0 has chrono::ChVector<> instead of ChVector3d.)
//
// Units: metres. Frame: Chrono's, with any rotation and origin; by default the world (x east, y north, z up), which is
// Chrono's ISO frame. Heights are measured along the world's vertical from the origin of Chrono's frame, as by
// ChWorldFrame::Height().
//
// Absent ground: the interface has no status. The height is ChronoTerrainSettings::absent_height, by default -infinity,
// so that no tyre touches it; the normal is the vertical, and TyreGround::counts() counts the answer by status. A
// simulator that must stop on absent ground checks counts().failed() after each step, or TyreGround::find() before it.
//
// Threads: any number of queries; set_ground() while no query runs, once per step.
// Source: the reference of ChTerrain, api.projectchrono.org, versions 6 to 9.

#include <terrane/adapters/surface_point.h>

#include <optional>
#include <utility>

namespace terrane::adapters {

/// Settings of a TyreGround.
struct ChronoTerrainSettings {
    Pose world_from_sim = {};  ///< Chrono's axes and origin in the world
    /// See surface_below(): infinite for the highest surface; finite for tunnels and bridges.
    double search_above = std::numeric_limits<double>::infinity();
    /// Height for absent ground, metres; any number, including NaN.
    double absent_height = -std::numeric_limits<double>::infinity();
    float friction = 0.8f;  ///< for ground without a surface map, and absent ground
};

/// Computes the answers of ChTerrain without Chrono.
class TyreGround {
public:
    /// The ground at one place, in Chrono's frame.
    struct Answer {
        QueryStatus status = QueryStatus::invalid;  ///< ok if there is ground
        double height = 0.0;  ///< along the vertical; absent_height without ground
        Eigen::Vector3d point_sim =
            Eigen::Vector3d::Zero();  ///< on the surface; without ground, the query point
        Eigen::Vector3d normal_sim =
            Eigen::Vector3d::Zero();  ///< unit; without ground, the vertical
        float friction = 0.0f;        ///< Coulomb
    };

    /// Fails: invalid_argument, naming the field and its value
    static Result<TyreGround> create(const ChronoTerrainSettings& settings) {
        TERRANE_TRY(check_frame(settings.world_from_sim));
        if (!(settings.search_above >= 0.0)) {
            return fail(ErrorCode::invalid_argument, "search_above must be at least 0, got " +
                                                         number_text(settings.search_above));
        }
        if (!(settings.friction >= 0.0f && settings.friction <= 1e6f)) {
            return fail(ErrorCode::invalid_argument,
                        "friction must be 0 to 1e+06, got " + number_text(settings.friction));
        }
        return TyreGround(settings);
    }

    /// Sets the ground of the following steps. Without one every answer is `not_resident`.
    void set_ground(const Ground& ground) { ground_ = ground; }
    /// The ground of the last set_ground(), or null.
    const Ground* ground() const { return ground_ ? &*ground_ : nullptr; }

    /// The ground below a point in Chrono's frame, without counting.
    Answer find(const Eigen::Vector3d& p_sim) const {
        const Pose& frame = settings_.world_from_sim;
        const Eigen::Vector3d up_sim = frame.rotation.row(2).transpose();
        Answer answer{.height = settings_.absent_height,
                      .point_sim = p_sim,
                      .normal_sim = up_sim,
                      .friction = settings_.friction};
        const WorldPos p_world = frame * p_sim;
        if (!ground_) {
            answer.status = QueryStatus::not_resident;
            return answer;
        }
        const SurfacePoint found = surface_below(*ground_, p_world, settings_.search_above);
        answer.status = found.status;
        if (found.status != QueryStatus::ok) return answer;
        answer.height = found.point_world.z() - frame.translation.z();
        answer.point_sim = frame.rotation.transpose() * (found.point_world - frame.translation);
        answer.normal_sim = frame.rotation.transpose() * found.normal_world;
        if (const auto surface = ground_->surface(p_world.x(), p_world.y())) {
            answer.friction = static_cast<float>(surface->friction);
        }
        return answer;
    }

    /// As find(), and counts the answer.
    Answer ask(const Eigen::Vector3d& p_sim) const {
        const Answer answer = find(p_sim);
        counts_.add(answer.status);
        return answer;
    }

    /// Number of answers of ask() by status.
    const StatusCounter& counts() const { return counts_; }

private:
    explicit TyreGround(const ChronoTerrainSettings& settings) : settings_(settings) {}

    ChronoTerrainSettings settings_;
    std::optional<Ground> ground_;
    mutable StatusCounter counts_;
};

/// A ChTerrain over a TyreGround. Functors registered with the base class are ignored.
///
/// @tparam Terrain chrono::vehicle::ChTerrain
/// @tparam Vector  Chrono's vector of doubles, constructed from x, y, z and read by x(), y(), z()
template <class Terrain, class Vector>
class ChronoTerrain : public Terrain {
public:
    /// Takes the TyreGround that computes the answers.
    explicit ChronoTerrain(TyreGround tyre_ground) : tyre_ground_(std::move(tyre_ground)) {}

    /// The TyreGround: set the ground of each step here, and read the counts.
    TyreGround& tyre_ground() { return tyre_ground_; }
    /// As above, read-only.
    const TyreGround& tyre_ground() const { return tyre_ground_; }

    // NOLINTBEGIN(readability-identifier-naming): Chrono's names
    /// Height below a point, metres along the vertical.
    double GetHeight(const Vector& loc) const override { return ask(loc).height; }
    /// Normal below a point, unit.
    Vector GetNormal(const Vector& loc) const override { return to_vector(ask(loc).normal_sim); }
    /// Coefficient of friction below a point.
    float GetCoefficientFriction(const Vector& loc) const override { return ask(loc).friction; }
    // NOLINTEND(readability-identifier-naming)

private:
    TyreGround::Answer ask(const Vector& loc) const {
        return tyre_ground_.ask({loc.x(), loc.y(), loc.z()});
    }
    static Vector to_vector(const Eigen::Vector3d& v) { return Vector(v.x(), v.y(), v.z()); }

    TyreGround tyre_ground_;
};

}  // namespace terrane::adapters
