// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/ground.h>
#include <terrane/terrain/math.h>

#include <cstddef>
#include <memory>

namespace terrane {

/// Rays from one point, such as those of a range sensor: the bits of Ground::ray(), in less time where there are
/// thousands of them. It bounds the ground around the point once, so that a ray begins near to where it may meet the
/// ground.
///
/// Allocates: when it is made, 300 KB
/// Threads: any number of ray() at once; one of reset()
class RayFan {
public:
    /// From so many rays on, reset() costs less than it saves: measured (docs/batch.md).
    static constexpr std::size_t kLeastRays = 8192;

    RayFan();
    RayFan(RayFan&&) noexcept;
    RayFan& operator=(RayFan&&) noexcept;
    ~RayFan();

    /// Prepares rays from a point. Any origin will do; rays from one that is not finite, or far from the ground, are
    /// answered as any others.
    ///
    /// @param ground must outlive the rays
    /// @param reach  horizontal length of the rays, metres; what is beyond costs more
    ///
    /// Allocates: nothing
    /// Cost:      as much as some thousand rays: kLeastRays
    void reset(const Ground& ground, const WorldPos& origin_world, double reach);

    /// As Ground::ray(). Before the first reset() all rays are invalid.
    ///
    /// Requires: from_world is the origin, or lies between the origin and to_world, to the rounding of coordinates
    RayAnswer ray(const WorldPos& from_world, const WorldPos& to_world) const;

    /// The ground of the last reset(), or null.
    const Ground* ground() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace terrane
