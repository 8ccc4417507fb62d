// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/base/result.h>
#include <terrane/terrain/height_source.h>

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

namespace terrane {

/// Density, slope, height and scale of scattered objects. Fixed once the scatter is created.
struct ScatterSettings {
    /// Expected objects per km2 of ground whose slope and height are in range. Above 0, at most 1e6.
    double per_km2 = 1000.0;
    double min_slope = 0.0;                 ///< radians, 0 to pi / 2
    double max_slope = 1.5707963267948966;  ///< radians, >= min_slope, at most pi / 2
    double min_height = -std::numeric_limits<double>::infinity();  ///< world z, metres
    double max_height =
        std::numeric_limits<double>::infinity();  ///< world z, metres, >= min_height
    double min_scale = 0.8;                       ///< relative to the object's size, 1e-3 to 1e3
    double max_scale = 1.25;  ///< >= min_scale; scales are uniformly distributed
    std::uint64_t seed = 0;   ///< different seeds give independent placements
};

/// The placement of a scattered object, upright.
struct ScatterPoint {
    WorldPos position_world = WorldPos::Zero();  ///< on the contact surface of the finest spacing
    double scale = 1.0;                          ///< factor on the object's lengths
    /// Cosine and sine of half the angle of rotation about z. The quaternion x, y, z, w is (0, 0, sine, cosine).
    double half_turn_cosine = 1.0, half_turn_sine = 0.0;
};

/// A square of a scatter, counted from lattice point (0, 0): the unit in which objects are created and dropped.
struct ScatterSquare {
    std::int32_t x = 0;  ///< column
    std::int32_t y = 0;  ///< row
    friend constexpr auto operator<=>(const ScatterSquare&, const ScatterSquare&) = default;
};

/// A rectangle of squares, both corners included.
struct ScatterRange {
    ScatterSquare low, high;  ///< the south-western and the north-eastern square
};

/// Scatters objects over the ground of a source by jittered sampling (R. Cook, Stochastic Sampling in Computer
/// Graphics, ACM TOG 5(1), 1986): each cell of a grid has candidates at random positions. A candidate is kept with the
/// probability that gives the density, and dropped if the slope or height is out of range.
///
/// A square's objects depend only on the source, the settings and the square, not on what is resident or on other
/// squares. They are bit-identical with every compiler.
///
/// Threads: any number at once
class Scatter {
public:
    /// Cells along the side of a square.
    static constexpr int kSquareCells = 16;

    /// Fails: invalid_argument, naming the field and its value, for settings out of range, or for more than 4096
    ///        expected objects in a cell of the finest spacing
    static Result<Scatter> create(std::shared_ptr<const HeightSource> source,
                                  const ScatterSettings& settings);

    /// Side of a square, metres.
    double square_side() const;
    /// The square that contains a position.
    ///
    /// Requires a position within 2^30 squares of the lattice's origin
    ScatterSquare square_at(double x, double y) const;
    /// The squares that have ground within a horizontal distance of a position, and possibly more; absent if none has.
    ///
    /// @param distance metres, >= 0; may be infinite
    std::optional<ScatterRange> squares_within(const WorldPos& p_world, double distance) const;
    /// The closed rectangle of a square, metres.
    WorldRect rect_of(const ScatterSquare& square) const;
    /// Least distance of a position from the ground in a square, metres; infinity if the square is outside the extent.
    double distance_to(const ScatterSquare& square, const WorldPos& p_world) const;

    /// The objects of a square, in the order of their cells. Slope and height are those of the triangle under the
    /// candidate; its cell is cut like a cell of a chunk. Leaves out objects outside the extent, on cells that are not
    /// ground, and on cells of the finest spacing with a corner in a volume (ChunkSource::is_in_volume()).
    ///
    /// Fails: as HeightSource::sample(); bad_data for heights that are not finite
    /// Cost:  about one sample of the source per candidate, and four per object
    Result<std::vector<ScatterPoint>> objects_in(const ScatterSquare& square) const;

private:
    Scatter(std::shared_ptr<const HeightSource> source, const ScatterSettings& settings);

    std::shared_ptr<const HeightSource> source_;
    ScatterSettings settings_;
    std::int64_t cell_step_ = 1;                                // finest spacings along a cell
    int per_cell_ = 1;                                          // candidates per cell
    double probability_ = 1.0;                                  // of keeping a candidate
    double min_squared_slope_ = 0.0, max_squared_slope_ = 0.0;  // squares of tangents
};

}  // namespace terrane
