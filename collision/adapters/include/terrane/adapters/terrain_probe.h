// SPDX-License-Identifier: MIT
#pragma once

// A terrain probe with the semantics of X-Plane's XPLMProbeTerrainXYZ: the highest ground on the vertical through a
// point, in a flight simulator's local frame. For simulators whose plug-ins expect that interface, and for plug-ins
// that replace the simulator's terrain by Terrane's. Needs no SDK: probe() fills any structure with X-Plane's members.
//
// Units: metres, metres a second. Frame: x east, y up, z south, relative to TerrainProbeSettings::origin_world. The
// interface's positions are float, so keep the origin within a few kilometres (float resolves 0.5 mm at 8 km).
//
// Result codes: hit; missed if there is no ground (beyond the extent, nodata connected to its border); error if the
// answer is unknown (ground not resident, no ground set) or the probe is invalid (not finite, wrong structure size).
// The structure is written only on a hit, so a height of 0 never means missing ground.
//
// The ground is at rest: the velocity of a hit is 0 unless the settings provide a function for it.
//
// Threads: any number of queries (the settings' functions must be thread-safe); set_ground() while no query runs.
// Source: the reference of XPLMScenery, developer.x-plane.com/sdk.

#include <terrane/adapters/surface_point.h>

#include <functional>
#include <optional>
#include <utility>

namespace terrane::adapters {

/// Results of a probe, with X-Plane's values.
enum class ProbeResult {
    hit = 0,     ///< xplm_ProbeHitTerrain
    error = 1,   ///< xplm_ProbeError: not resident, not finite, or wrong structure size
    missed = 2,  ///< xplm_ProbeMissed: no ground there
};

/// Settings of a TerrainProbe.
struct TerrainProbeSettings {
    WorldPos origin_world = WorldPos::Zero();  ///< of the local frame
    /// See surface_below(): infinite for the highest surface, like X-Plane's y probe.
    double search_above = std::numeric_limits<double>::infinity();
    /// Whether a material is water; none: all ground is dry. An exception is counted, and the ground is taken as dry.
    std::function<bool(std::uint32_t material)> is_wet = {};
    /// Velocity of the surface at a point, world axes, for example on a ship's deck; none: at rest. An exception or a
    /// velocity that is not finite is counted, and the result is an error.
    std::function<Eigen::Vector3d(const WorldPos& p_world)> velocity = {};
};

/// Probes ground in a local frame with y up.
class TerrainProbe {
public:
    /// One probe's answer, local frame.
    struct Answer {
        ProbeResult result = ProbeResult::error;    ///< as X-Plane would return
        QueryStatus status = QueryStatus::invalid;  ///< reason; ok with error if a function failed
        Eigen::Vector3d location =
            Eigen::Vector3d::Zero();  ///< on the surface; valid only for a hit, as all below
        Eigen::Vector3d normal = Eigen::Vector3d::Zero();    ///< unit
        Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< metres a second
        bool is_wet = false;                                 ///< whether the ground is water
    };

    /// Fails: invalid_argument, naming the field and its value
    static Result<TerrainProbe> create(const TerrainProbeSettings& settings) {
        Pose frame;
        frame.translation = settings.origin_world;
        if (Result<void> ok = check_frame(frame); !ok) {
            return fail(ErrorCode::invalid_argument,
                        "origin_world must be finite and within 2^40 m of the world's origin");
        }
        if (!(settings.search_above >= 0.0)) {
            return fail(ErrorCode::invalid_argument, "search_above must be at least 0, got " +
                                                         number_text(settings.search_above));
        }
        return TerrainProbe(settings);
    }

    /// Sets the ground of the following probes. Without one every probe is an error.
    void set_ground(const Ground& ground) { ground_ = ground; }
    /// Moves the local frame, as flight simulators do on long flights. Requires a finite origin.
    void set_origin(const WorldPos& origin_world) { settings_.origin_world = origin_world; }

    /// Probes the vertical through a point of the local frame.
    Answer probe(const Eigen::Vector3d& p_local) const {
        Answer answer;
        answer.status = ground_ ? QueryStatus::invalid : QueryStatus::not_resident;
        if (ground_) answer = probe_ground(p_local);
        counts_.add(answer.status);
        return answer;
    }

    /// Probes and fills a structure with X-Plane's members: structSize, set by the caller to the structure's size;
    /// floats locationX to locationZ, normalX to normalZ, velocityX to velocityZ; is_wet. A null pointer or another
    /// size is an error.
    template <class Info>
    ProbeResult probe(float x, float y, float z, Info* info_out) const {
        if (info_out == nullptr || info_out->structSize != static_cast<int>(sizeof(Info))) {
            counts_.add(QueryStatus::invalid);
            return ProbeResult::error;
        }
        const Answer answer = probe(Eigen::Vector3d(x, y, z));
        if (answer.result != ProbeResult::hit) return answer.result;
        info_out->locationX = static_cast<float>(answer.location.x());
        info_out->locationY = static_cast<float>(answer.location.y());
        info_out->locationZ = static_cast<float>(answer.location.z());
        info_out->normalX = static_cast<float>(answer.normal.x());
        info_out->normalY = static_cast<float>(answer.normal.y());
        info_out->normalZ = static_cast<float>(answer.normal.z());
        info_out->velocityX = static_cast<float>(answer.velocity.x());
        info_out->velocityY = static_cast<float>(answer.velocity.y());
        info_out->velocityZ = static_cast<float>(answer.velocity.z());
        info_out->is_wet = answer.is_wet ? 1 : 0;
        return answer.result;
    }

    /// Number of probes by status.
    const StatusCounter& counts() const { return counts_; }
    /// Number of probes in which a function of the settings threw or returned a velocity that was not finite.
    std::uint64_t fault_count() const { return faults_.of(QueryStatus::invalid); }

private:
    explicit TerrainProbe(const TerrainProbeSettings& settings) : settings_(settings) {}

    static Eigen::Vector3d local_from_world(const Eigen::Vector3d& v) {
        return {v.x(), v.z(), -v.y()};
    }

    Answer probe_ground(const Eigen::Vector3d& p_local) const {
        Answer answer;
        const WorldPos p_world =
            settings_.origin_world + WorldPos(p_local.x(), -p_local.z(), p_local.y());
        const SurfacePoint found = surface_below(*ground_, p_world, settings_.search_above);
        answer.status = found.status;
        if (found.status == QueryStatus::outside || found.status == QueryStatus::miss) {
            answer.result = ProbeResult::missed;
        }
        if (found.status != QueryStatus::ok) return answer;
        if (!ask_functions(found.point_world, answer)) return answer;
        answer.location = local_from_world(found.point_world - settings_.origin_world);
        answer.normal = local_from_world(found.normal_world);
        answer.result = ProbeResult::hit;
        return answer;
    }

    // Returns false if the velocity function failed.
    bool ask_functions(const WorldPos& p_world, Answer& answer) const {
        answer.velocity = Eigen::Vector3d::Zero();
        if (settings_.is_wet) {
            try {
                const auto surface = ground_->surface(p_world.x(), p_world.y());
                answer.is_wet = surface && settings_.is_wet(surface->material);
            } catch (...) {
                faults_.add(QueryStatus::invalid);
            }
        }
        if (!settings_.velocity) return true;
        try {
            answer.velocity = local_from_world(settings_.velocity(p_world));
            if (answer.velocity.allFinite()) return true;
        } catch (...) {
            // treated like a velocity that is not finite
        }
        faults_.add(QueryStatus::invalid);
        return false;
    }

    TerrainProbeSettings settings_;
    std::optional<Ground> ground_;
    mutable StatusCounter counts_, faults_;
};

}  // namespace terrane::adapters
