// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/resident_set.h>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

// Polar coordinates around an eye without trigonometry: sectors of azimuth and rings of distance. Directions and
// rectangles are horizontal and relative to the eye, metres.
namespace terrane::internal {

/// Number of sectors: a power of two. A sector spans 0.28 to 0.56 degrees.
inline constexpr int kSectors = 1024;

/// Azimuth in sectors, counter-clockwise from east, 0 to kSectors: the diamond angle, which increases with the angle.
/// Requires a direction that is not zero.
inline double azimuth_of(double x, double y) {
    constexpr double quarter = 0.25 * kSectors;
    if (y >= 0.0) return quarter * (x >= 0.0 ? y / (x + y) : 1.0 - x / (y - x));
    return quarter * (x < 0.0 ? 2.0 + y / (x + y) : 3.0 + x / (x - y));
}

/// Consecutive sectors, counter-clockwise; the range may wrap around the circle.
struct SectorRange {
    int first = 0;  ///< 0 to kSectors - 1
    int count = 0;  ///< 0 to kSectors

    static SectorRange all() { return {0, kSectors}; }
    /// Requires that neither range is empty.
    bool is_disjoint(const SectorRange& other) const {
        return ((other.first - first) & (kSectors - 1)) >= count &&
               ((first - other.first) & (kSectors - 1)) >= other.count;
    }
    /// Calls take(sector) with the number of each sector, a std::size_t.
    template <class Visit>
    void visit(const Visit& take) const {
        for (int i = 0; i < count; ++i)
            take(static_cast<std::size_t>((first + i) & (kSectors - 1)));
    }
};

/// The horizontal directions from `right` counter-clockwise to `left`, less than half a turn.
struct Wedge {
    Eigen::Vector2d right, left;  ///< its first and last direction, not zero

    // Bound of the rounding error of azimuths, in sectors. Coordinates up to 2e9 m are rounded by 2^-53 of their size;
    // divided by a distance of at least 1 m from the eye, and times 163 sectors per radian, that is below the bound.
    static constexpr double kRounding = 0x1p-12;

    /// All sectors that contain a direction of the wedge.
    SectorRange touched() const {
        return between(std::floor(azimuth_of(right.x(), right.y()) - kRounding),
                       std::floor(azimuth_of(left.x(), left.y()) + kRounding), 0);
    }
    /// The sectors that are entirely in the wedge.
    SectorRange covered() const {
        return between(std::floor(azimuth_of(right.x(), right.y()) + kRounding) + 1.0,
                       std::floor(azimuth_of(left.x(), left.y()) - kRounding) - 1.0, -1);
    }

private:
    // A wedge is narrower than half a turn: a difference modulo kSectors beyond any wedge stands for a negative one.
    static SectorRange between(double first, double last, int least_last) {
        const int from = static_cast<int>(first) & (kSectors - 1);
        const int steps = (static_cast<int>(last) - from) & (kSectors - 1);
        const bool is_empty = least_last < 0 && steps > kSectors * 3 / 4;
        return {from, is_empty ? 0 : steps + 1};
    }
};

/// An axis-aligned rectangle in plan, relative to the eye.
struct EyeRect {
    double west = 0.0, south = 0.0, east = 0.0, north = 0.0;

    bool contains_eye() const { return west <= 0.0 && east >= 0.0 && south <= 0.0 && north >= 0.0; }
    double squared_distance() const {
        const double x = std::max({west, -east, 0.0}), y = std::max({south, -north, 0.0});
        return x * x + y * y;
    }
    /// The wedge of directions from the eye to the rectangle, which must not contain the eye.
    Wedge wedge() const {
        if (west > 0.0) {
            if (south > 0.0) return {{east, south}, {west, north}};
            if (north < 0.0) return {{west, south}, {east, north}};
            return {{west, south}, {west, north}};
        }
        if (east < 0.0) {
            if (south > 0.0) return {{east, north}, {west, south}};
            if (north < 0.0) return {{west, north}, {east, south}};
            return {{east, north}, {east, south}};
        }
        if (south > 0.0) return {{east, south}, {west, south}};
        return {{west, north}, {east, north}};
    }
};

/// Rings of distance: kRingsPerOctave between two powers of two. The last one is unbounded, and the first is a disc.
inline constexpr int kRingsPerOctave = 16;
inline constexpr int kFirstRingLog2 = 1, kLastRingLog2 = 17;  ///< from 2 m to 131 km
inline constexpr int kRings = 2 + kRingsPerOctave * (kLastRingLog2 - kFirstRingLog2);

/// The ring that contains a distance. Exact, hence monotonic. Requires distance >= 0.
inline int ring_of(double distance) {
    constexpr int kMantissaBits = 52, kShift = kMantissaBits - std::bit_width(kRingsPerOctave - 1u);
    constexpr std::int64_t kBase = std::int64_t{1023 + kFirstRingLog2} * kRingsPerOctave - 1;
    const auto steps = static_cast<std::int64_t>(std::bit_cast<std::uint64_t>(distance) >> kShift);
    return static_cast<int>(std::clamp<std::int64_t>(steps - kBase, 0, kRings - 1));
}

struct GroundSquare;

/// Slopes of the horizon of the true surface around an eye, by ring and sector.
class HorizonRows {
public:
    using Row = std::array<float, kSectors>;

    /// For each sector, a lower bound of the largest slope of the true surface from the eye to the outer edge of a
    /// ring; valid for every direction in the sector.
    const Row& row(int ring) const { return rows_[static_cast<std::size_t>(ring)]; }

    /// Computes all rows. Requires a set with all its roots, certified chunks, and an eye inside the extent.
    ///
    /// @param in_view sectors to compute; the others become infinite
    void build(const ResidentSet& resident, const Eigen::Vector3d& eye_world,
               const SectorRange& in_view);

private:
    void visit(const GroundSquare& square);
    bool is_below_horizon(const SectorRange& touched, double slope) const;
    void add_occluder(const EyeRect& rect, const Wedge& wedge, double rise);
    void limit(const EyeRect& rect);
    void add_volumes();
    void accumulate();

    const ResidentSet* resident_ = nullptr;  // while building
    Eigen::Vector3d eye_;
    SectorRange in_view_;
    std::vector<Row> rows_;  // [kRings]
    Row highest_;            // in all rings so far, for pruning
    std::array<double, kSectors>
        limits_;  // distance up to which there is only ground without volumes
};

}  // namespace terrane::internal
