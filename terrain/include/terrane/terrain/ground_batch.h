// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>
#include <terrane/terrain/ground.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

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

/// Points in the caller's memory, not copied: coordinate x of point i is x[i * stride], and so on.
struct PointArray {
    std::size_t count = 0;  ///< number of points
    /// Numbers from one point to the next; 0: all points are the first one.
    std::size_t stride = 1;
    /// World, metres; at least (count - 1) * stride + 1 numbers each.
    std::span<const double> x{}, y{};
    /// The same; may be empty where the heights of the points are not read.
    std::span<const double> z{};

    /// Points x y x y ..., such as the rows of a C-contiguous array of shape (count, 2).
    static PointArray interleaved_xy(std::span<const double> numbers);
    /// Points x y z x y z ..., such as the rows of a C-contiguous array of shape (count, 3).
    static PointArray interleaved_xyz(std::span<const double> numbers);
    /// One array for each coordinate. There are as many points as x has numbers.
    static PointArray separate(std::span<const double> x, std::span<const double> y,
                               std::span<const double> z = {});
    /// One point, `count` times: the common start of rays. Refers to the point, which must outlive it.
    static PointArray repeated(const WorldPos& point_world, std::size_t count);
};

/// Where answers of GroundBatch::heights() are written: entry i is of point i. Each span has one entry for each point,
/// `normals` has three numbers; an empty span is not written. Where the status is not ok, the numbers are NaN, so that
/// missing ground is never height 0.
struct HeightArrays {
    std::span<double> heights{};         ///< HeightAnswer::height
    std::span<double> normals{};         ///< [3 * count] HeightAnswer::normal: x y z x y z ...
    std::span<double> errors_m{};        ///< HeightAnswer::error_m
    std::span<GroundStatus> statuses{};  ///< HeightAnswer::status
    std::span<std::uint8_t> filled{};    ///< HeightAnswer::filled: 0 or 1
};

/// Where answers of GroundBatch::rays() are written: entry i is of ray i. Spans and NaN as in HeightArrays.
struct RayArrays {
    std::span<double> fractions{};       ///< RayAnswer::fraction
    std::span<double> points_world{};    ///< [3 * count] RayAnswer::point_world: x y z x y z ...
    std::span<double> normals{};         ///< [3 * count] RayAnswer::normal: x y z x y z ...
    std::span<double> errors_m{};        ///< RayAnswer::error_m
    std::span<GroundStatus> statuses{};  ///< RayAnswer::status
    std::span<std::uint8_t> filled{};    ///< RayAnswer::filled: 0 or 1
};

/// Settings of a GroundBatch.
struct GroundBatchSettings {
    int worker_count = 1;  ///< threads that answer, the caller's included, 1 to 64
};

/// Heights and rays of many points at once: the bits of Ground::height() and Ground::ray() for each of them, in the
/// caller's order, with any number of workers.
///
/// Keep one and use it again: it owns the threads and the memory that calls share.
///
/// Fails:     invalid_argument, naming the array and its length, where the lengths of arrays do not agree; nothing is
///            written then
/// Threads:   one at a time
/// Allocates: create() alone
class GroundBatch {
public:
    /// Fails: invalid_argument for a worker_count out of range
    static Result<GroundBatch> create(const GroundBatchSettings& settings = {});
    GroundBatch(GroundBatch&&) noexcept;
    GroundBatch& operator=(GroundBatch&&) noexcept;
    ~GroundBatch();

    /// Ground::height() of each point; z of the points is not read. Outputs that are not asked for cost nothing.
    ///
    /// Cost: O(count) / workers; docs/batch.md has measured times
    Result<void> heights(const Ground& ground, const PointArray& points_world,
                         const HeightArrays& out);

    /// Ground::ray() of each segment from a point of `from_world` to the point of `to_world` of the same index.
    ///
    /// Requires: both have z
    Result<void> rays(const Ground& ground, const PointArray& from_world,
                      const PointArray& to_world, const RayArrays& out);

private:
    struct State;
    class HeightBlocks;
    explicit GroundBatch(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
