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

/// Casts rays from a common origin, such as those of a range sensor. Bit-identical to Ground::ray(), and faster for
/// thousands of rays: reset() bounds the ground around the origin once, and each ray skips most of its path above it.
///
/// Allocates: 300 KB in the constructor
/// Threads: ray() from any number at once; reset() from one
class RayFan {
public:
    /// Number of rays from which reset() pays off, measured (docs/batch.md).
    static constexpr std::size_t kLeastRays = 8192;

    RayFan();
    RayFan(RayFan&&) noexcept;
    RayFan& operator=(RayFan&&) noexcept;
    ~RayFan();

    /// Prepares rays from an origin. Any origin is valid: if it is not finite, or far from the ground, rays get the
    /// same answers as from Ground::ray().
    ///
    /// @param ground must outlive the rays
    /// @param reach  horizontal length of the rays, metres; longer rays are slower
    ///
    /// Allocates: nothing
    /// Cost:      as several thousand rays: see kLeastRays
    void reset(const Ground& ground, const WorldPos& origin_world, double reach);

    /// As Ground::ray(); `invalid` before the first reset().
    ///
    /// Requires: from_world is on the segment from the origin to to_world, up to rounding of coordinates
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
    /// Distance in numbers between successive points; 0: all points equal the first.
    std::size_t stride = 1;
    /// World coordinates, metres; at least (count - 1) * stride + 1 numbers each.
    std::span<const double> x{}, y{};
    /// As x and y; may be empty if z is not read.
    std::span<const double> z{};

    /// Points x y x y ..., such as the rows of a C-contiguous array of shape (count, 2).
    static PointArray interleaved_xy(std::span<const double> numbers);
    /// Points x y z x y z ..., such as the rows of a C-contiguous array of shape (count, 3).
    static PointArray interleaved_xyz(std::span<const double> numbers);
    /// One array per coordinate; the number of points is the length of x.
    static PointArray separate(std::span<const double> x, std::span<const double> y,
                               std::span<const double> z = {});
    /// One point repeated `count` times, such as the common origin of rays. Refers to the point, which must outlive it.
    static PointArray repeated(const WorldPos& point_world, std::size_t count);
};

/// Output arrays of GroundBatch::heights(); entry i belongs to point i. Each span has one entry per point, `normals`
/// has three numbers per point; empty spans are skipped. If the status is not ok, the numbers are NaN: missing ground
/// never reads as height 0.
struct HeightArrays {
    std::span<double> heights{};        ///< HeightAnswer::height
    std::span<double> normals{};        ///< [3 * count] HeightAnswer::normal: x y z x y z ...
    std::span<double> errors_m{};       ///< HeightAnswer::error_m
    std::span<QueryStatus> statuses{};  ///< HeightAnswer::status
    std::span<std::uint8_t> filled{};   ///< HeightAnswer::filled: 0 or 1
};

/// Output arrays of GroundBatch::rays(); entry i belongs to ray i. Spans and NaN are used as in HeightArrays.
struct RayArrays {
    std::span<double> fractions{};      ///< RayAnswer::fraction
    std::span<double> points_world{};   ///< [3 * count] RayAnswer::point_world: x y z x y z ...
    std::span<double> normals{};        ///< [3 * count] RayAnswer::normal: x y z x y z ...
    std::span<double> errors_m{};       ///< RayAnswer::error_m
    std::span<QueryStatus> statuses{};  ///< RayAnswer::status
    std::span<std::uint8_t> filled{};   ///< RayAnswer::filled: 0 or 1
};

/// Settings of a GroundBatch.
struct GroundBatchSettings {
    int worker_count = 1;  ///< threads, including the caller's, 1 to 64
};

/// Height and ray queries in batches. Answers are in the caller's order and bit-identical to Ground::height() and
/// Ground::ray(), for any number of workers.
///
/// Create one and reuse it: it owns the threads and buffers that calls share.
///
/// Fails:     invalid_argument, naming the array and its length, if array lengths do not match; then no output is
///            written
/// Threads:   one at a time
/// Allocates: only in create()
class GroundBatch {
public:
    /// Fails: invalid_argument for a worker_count out of range
    static Result<GroundBatch> create(const GroundBatchSettings& settings = {});
    GroundBatch(GroundBatch&&) noexcept;
    GroundBatch& operator=(GroundBatch&&) noexcept;
    ~GroundBatch();

    /// Ground::height() at each point; z of the points is not read. Empty output spans cost nothing.
    ///
    /// Cost: O(count) / workers; docs/batch.md has measured times
    Result<void> heights(const Ground& ground, const PointArray& points_world,
                         const HeightArrays& out);

    /// Ground::ray() along each segment from `from_world` to `to_world` of the same index.
    ///
    /// Requires: z of both arrays is not empty
    Result<void> rays(const Ground& ground, const PointArray& from_world,
                      const PointArray& to_world, const RayArrays& out);

private:
    struct State;
    class HeightBlocks;
    explicit GroundBatch(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

}  // namespace terrane
