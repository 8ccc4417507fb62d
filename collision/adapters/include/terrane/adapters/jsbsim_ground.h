// SPDX-License-Identifier: MIT
#pragma once

// JSBSim's ground interface, FGGroundCallback: height above ground, and the ground point below a place with its normal,
// velocity and angular velocity. Only instantiating JsbsimGround needs JSBSim:
//
//     using Callback = terrane::adapters::JsbsimGround<JSBSim::FGGroundCallback, JSBSim::FGLocation,
//                                                      JSBSim::FGColumnVector3>;
//     fdm.GetInertial()->SetGroundCallback(new Callback(std::move(aircraft_ground)));
//
// Units: feet (0.3048 m) and feet a second in JSBSim's arguments, metres in Terrane. Frame: ECEF, see earth_frame.h;
// "below" is along the vertical of the EarthFrame. Set JSBSim's planet to the same ellipsoid. Far from the origin the
// ground follows the earth if its raster is opened with DemProjection::local: see earth_frame.h.
//
// Heights are signed: negative below the ground, so that a penetrating wheel is pushed out.
//
// Absent ground: the interface has no status. The height above ground is +infinity (no wheel touches) and the contact
// is the location itself, unless JsbsimGroundSettings::absent_height is finite: then the ground lies at that world z.
// Answers are counted by status; see AircraftGround::counts().
//
// The ground is at rest in ECEF, which rotates with the earth: both velocities are 0.
//
// Threads: any number of queries; set_ground() while no query runs, once per step. Answers may differ in the last bits
// between machines: see earth_frame.h.
// Source: the documented interface of FGGroundCallback, JSBSim 1.1 and 1.2.

#include <terrane/adapters/earth_frame.h>
#include <terrane/adapters/surface_point.h>

#include <optional>
#include <utility>

namespace terrane::adapters {

/// Metres of an international foot.
inline constexpr double kMetresPerFoot = 0.3048;

/// Settings of an AircraftGround.
struct JsbsimGroundSettings {
    EarthFrameSettings earth = {};  ///< placement of the world on the earth
    /// See surface_below(): infinite for the highest surface; finite under bridges and in hangars.
    double search_above = std::numeric_limits<double>::infinity();
    /// World z assumed for absent ground, metres; -infinity: infinitely far below.
    double absent_height = -std::numeric_limits<double>::infinity();
};

/// Computes the answers of FGGroundCallback without JSBSim, in metres.
class AircraftGround {
public:
    /// The ground below a place, in ECEF.
    struct Answer {
        QueryStatus status = QueryStatus::invalid;  ///< ok if there is ground
        /// Signed height of the place above the ground along the vertical; +infinity without ground or absent_height.
        double height_above_ground = std::numeric_limits<double>::infinity();
        Eigen::Vector3d contact_earth = Eigen::Vector3d::Zero();  ///< on the ground below the place
        Eigen::Vector3d normal_earth = Eigen::Vector3d::UnitZ();  ///< unit
    };

    /// Fails: invalid_argument, naming the field and its value
    static Result<AircraftGround> create(const JsbsimGroundSettings& settings) {
        TERRANE_TRY(EarthFrame frame, EarthFrame::create(settings.earth));
        if (!(settings.search_above >= 0.0)) {
            return fail(ErrorCode::invalid_argument, "search_above must be at least 0, got " +
                                                         number_text(settings.search_above));
        }
        if (!(settings.absent_height < std::numeric_limits<double>::infinity())) {
            return fail(ErrorCode::invalid_argument, "absent_height must be finite or -inf, got " +
                                                         number_text(settings.absent_height));
        }
        return AircraftGround(settings, frame);
    }

    /// Sets the ground of the following steps. Without one every answer is `not_resident`.
    void set_ground(const Ground& ground) { ground_ = ground; }
    /// Placement of the world on the earth, to convert needs to the world's frame.
    const EarthFrame& earth() const { return earth_; }

    /// The ground below a place in ECEF, without counting. `invalid` if the place is not finite, is deeper in the earth
    /// than geodetic_from_earth() permits, or too far around the earth for a tangent plane.
    Answer find(const Eigen::Vector3d& p_earth) const {
        Answer answer;
        answer.contact_earth = p_earth;
        const std::optional<WorldPos> p_world = earth_.world_from_earth(p_earth);
        if (!p_world) {
            if (p_earth.allFinite() && p_earth.squaredNorm() > 0.0) {
                answer.normal_earth = p_earth.stableNormalized();
            }
            return answer;
        }
        answer.normal_earth = earth_.up_earth(*p_world);
        SurfacePoint found{.status = QueryStatus::not_resident};
        if (ground_) found = surface_below(*ground_, *p_world, settings_.search_above);
        answer.status = found.status;
        if (found.status == QueryStatus::ok) {
            answer.normal_earth =
                earth_.normal_earth_from_world(found.point_world, found.normal_world);
        } else {
            if (!std::isfinite(settings_.absent_height)) return answer;
            found.point_world = WorldPos(p_world->x(), p_world->y(), settings_.absent_height);
        }
        answer.height_above_ground = p_world->z() - found.point_world.z();
        answer.contact_earth = earth_.earth_from_world(found.point_world);
        return answer;
    }

    /// As find(), and counts the answer.
    Answer ask(const Eigen::Vector3d& p_earth) const {
        const Answer answer = find(p_earth);
        counts_.add(answer.status);
        return answer;
    }

    /// Number of answers of ask() by status.
    const StatusCounter& counts() const { return counts_; }

private:
    AircraftGround(const JsbsimGroundSettings& settings, const EarthFrame& earth)
        : settings_(settings), earth_(earth) {}

    JsbsimGroundSettings settings_;
    EarthFrame earth_;
    std::optional<Ground> ground_;
    mutable StatusCounter counts_;
};

/// A FGGroundCallback over an AircraftGround.
///
/// @tparam Callback JSBSim::FGGroundCallback
/// @tparam Location JSBSim::FGLocation: coordinates by location(1) to (3), assigned from a Vector, feet
/// @tparam Vector   JSBSim::FGColumnVector3, made of three numbers
template <class Callback, class Location, class Vector>
class JsbsimGround : public Callback {
public:
    /// Takes the AircraftGround that computes the answers.
    explicit JsbsimGround(AircraftGround aircraft_ground)
        : aircraft_ground_(std::move(aircraft_ground)) {}

    /// The AircraftGround: set the ground of each step here, and read the counts.
    AircraftGround& aircraft_ground() { return aircraft_ground_; }
    /// As above, read-only.
    const AircraftGround& aircraft_ground() const { return aircraft_ground_; }

    // NOLINTBEGIN(readability-identifier-naming): JSBSim's names
    using Callback::GetAGLevel;
    /// Height above ground, feet. The time is ignored: the ground is at rest.
    double GetAGLevel(double, const Location& location, Location& contact, Vector& normal,
                      Vector& velocity, Vector& angular_velocity) const override {
        const AircraftGround::Answer answer = aircraft_ground_.ask(
            kMetresPerFoot * Eigen::Vector3d(location(1), location(2), location(3)));
        contact = location;  // copies the ellipsoid too
        if (answer.status == QueryStatus::ok || std::isfinite(answer.height_above_ground)) {
            contact = to_vector(answer.contact_earth / kMetresPerFoot);
        }
        normal = to_vector(answer.normal_earth);
        velocity = angular_velocity = Vector(0.0, 0.0, 0.0);
        return answer.height_above_ground / kMetresPerFoot;
    }
    // NOLINTEND(readability-identifier-naming)

private:
    static Vector to_vector(const Eigen::Vector3d& v) { return Vector(v.x(), v.y(), v.z()); }

    AircraftGround aircraft_ground_;
};

}  // namespace terrane::adapters
