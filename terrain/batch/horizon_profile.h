// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/ground.h>

#include <cstddef>
#include <vector>

namespace terrane::internal {

/// Upper bounds of the slopes from a point to the ground around it, by azimuth and distance: which part of a ray from
/// this point certainly lies above the ground.
class HorizonProfile {
public:
    HorizonProfile() : bin_slopes_(kEntries), most_slopes_(kEntries) {}

    /// Bounds the ground around a point.
    ///
    /// @param reach horizontal distance to bound, metres, >= 0; bounds end earlier beyond kMostCells cells
    ///
    /// Allocates: nothing
    /// Cost:      O(log reach) rings of some thousand squares: `batch_benchmark`
    void build(const Ground& ground, const WorldPos& origin_world, double reach);

    /// A horizontal distance from the origin, metres, up to which every point in a direction is above the ground, by
    /// more than rounding; 0: nothing is known. All ground before it is resident.
    ///
    /// @param direction not necessarily unit
    ///
    /// Cost: O(1)
    double clear_distance(const Eigen::Vector3d& direction) const;

private:
    static constexpr std::int64_t kSectors = 512;
    static constexpr int kOctaves = 11;  // of distances
    static constexpr std::int64_t kBins = 1 + 8 * kOctaves;
    static constexpr std::size_t kEntries = static_cast<std::size_t>(kBins * kSectors);
    static constexpr double kFirstCells = 1.0;  // where the first octave begins
    static constexpr double kMostCells = kFirstCells * (1 << kOctaves);

    struct Square;
    static std::int64_t bin_of(double cells);
    static double bin_begin(std::int64_t bin);
    void add(const Square& square);
    void accumulate();

    WorldPos origin_ = WorldPos::Zero();
    double spacing_ = 1.0;
    double rounding_ = 0.0;           // of the coordinates, metres
    double reach_cells_ = 0.0;        // that the bounds cover
    std::vector<float> bin_slopes_;   // [kBins][kSectors]
    std::vector<float> most_slopes_;  // [kSectors][kBins] of all bins up to this one
};

}  // namespace terrane::internal
