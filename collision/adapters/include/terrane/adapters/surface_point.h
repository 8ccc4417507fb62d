// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/base/text.h>
#include <terrane/terrain/ground.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace terrane::adapters {

/// The contact surface on the vertical through a point.
struct SurfacePoint {
    QueryStatus status = QueryStatus::invalid;  ///< the other fields are defined only if ok
    WorldPos point_world = WorldPos::Zero();    ///< on the surface
    Eigen::Vector3d normal_world = Eigen::Vector3d::UnitZ();  ///< unit, pointing out of the solid
    double error_m = 0.0;  ///< the true surface is within this of the point's height
};

/// Finds the contact surface for interfaces that query the ground below a point.
///
/// With an infinite `search_above`, or while no volume is resident, the answer is Ground::height(): the highest
/// surface, whatever the point's z. Otherwise it is the highest floor (a surface with normal z > 0) at or below the
/// point's z plus `search_above`, so that a wheel in a tunnel gets the tunnel's floor. Choose `search_above` above the
/// wheel's penetration and below the clearance under a ceiling; a point deeper in the solid gets a lower floor, or
/// `miss`.
///
/// @param search_above metres, >= 0, or infinite
///
/// Threads:   any number
/// Allocates: nothing
inline SurfacePoint surface_below(const Ground& ground, const WorldPos& p_world,
                                  double search_above) {
    if (!p_world.allFinite()) return {};
    const auto as_point = [&p_world](const HeightAnswer& answer) {
        SurfacePoint found;
        found.status = answer.status;
        if (answer.status != QueryStatus::ok) return found;
        found.point_world = WorldPos(p_world.x(), p_world.y(), answer.height);
        found.normal_world = answer.normal;
        found.error_m = answer.error_m;
        return found;
    };
    if (!ground.has_solids() || std::isinf(search_above)) {
        return as_point(ground.height(p_world.x(), p_world.y()));
    }
    constexpr int kMostCeilings = 256;  // more surfaces on one vertical than volumes produce
    double z = p_world.z() + search_above;
    for (int i = 0; i < kMostCeilings; ++i) {
        const HeightAnswer answer = ground.height_below(p_world.x(), p_world.y(), z);
        if (answer.status != QueryStatus::ok || answer.normal.z() > 0.0) return as_point(answer);
        z = std::nextafter(answer.height, -std::numeric_limits<double>::infinity());
    }
    return {.status = QueryStatus::miss};
}

/// Counts answers by status, to report absent ground from interfaces that return only a number. Threads: any number.
class StatusCounter {
public:
    StatusCounter() = default;
    StatusCounter(const StatusCounter& other) { *this = other; }
    StatusCounter& operator=(const StatusCounter& other) {
        for (std::size_t i = 0; i < counts_.size(); ++i) counts_[i] = other.counts_[i].load();
        return *this;
    }
    ~StatusCounter() = default;

    /// Adds one answer.
    void add(QueryStatus status) {
        counts_[static_cast<std::size_t>(status)].fetch_add(1, std::memory_order_relaxed);
    }
    /// Number of answers with a status.
    std::uint64_t of(QueryStatus status) const {
        return counts_[static_cast<std::size_t>(status)].load(std::memory_order_relaxed);
    }
    /// Number of answers that were not ok.
    std::uint64_t failed() const {
        std::uint64_t sum = 0;
        for (std::size_t i = 1; i < counts_.size(); ++i) sum += counts_[i].load();
        return sum;
    }

private:
    std::array<std::atomic<std::uint64_t>, 6> counts_{};  // by QueryStatus; ok is 0
};
static_assert(static_cast<int>(QueryStatus::ok) == 0 &&
              static_cast<int>(QueryStatus::invalid) == 5);

/// Checks that a pose is valid as a simulator's frame.
///
/// Fails: invalid_argument for a rotation that is not orthonormal and right-handed to 1e-9, and for a translation that
///        is not finite or beyond 2^40 m
inline Result<void> check_frame(const Pose& world_from_sim) {
    const Eigen::Matrix3d& r = world_from_sim.rotation;
    const double skew = (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    if (!(skew <= 1e-9) || !(r.determinant() > 0.0)) {
        return fail(
            ErrorCode::invalid_argument,
            "world_from_sim.rotation must be orthonormal and right-handed to 1e-9, is off by " +
                number_text(skew) + " with determinant " + number_text(r.determinant()));
    }
    for (int i = 0; i < 3; ++i) {
        if (!(std::abs(world_from_sim.translation[i]) <= 0x1p40)) {
            return fail(ErrorCode::invalid_argument,
                        "world_from_sim.translation must be within 2^40 m, got " +
                            number_text(world_from_sim.translation[i]));
        }
    }
    return {};
}

}  // namespace terrane::adapters
