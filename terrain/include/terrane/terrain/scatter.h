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
    /// Expected objects per km2 of ground where slope and height allow, above 0, at most 1e6.
    double per_km2 = 1000.0;
    double min_slope = 0.0;                 ///< radians, 0 to pi / 2
    double max_slope = 1.5707963267948966;  ///< radians, >= min_slope, at most pi / 2
    double min_height = -std::numeric_limits<double>::infinity();  ///< world z, metres
    double max_height =
        std::numeric_limits<double>::infinity();  ///< world z, metres, >= min_height
    double min_scale = 0.8;                       ///< of the objects' size, 1e-3 to 1e3
    double max_scale = 1.25;  ///< >= min_scale; each scale in between is as likely as any other
    std::uint64_t seed = 0;   ///< other seeds give independent placements
};

/// The placement of a scattered object, upright.
struct ScatterPoint {
    WorldPos position_world = WorldPos::Zero();  ///< on the contact surface of the finest spacing
    double scale = 1.0;                          ///< of all lengths of the object
    /// Half of the turn about z: cosine and sine. The quaternion x, y, z, w is (0, 0, sine, cosine).
    double half_turn_cosine = 1.0, half_turn_sine = 0.0;
};

/// A square of a scatter, counted from lattice point (0, 0): the unit in which its objects come and go.
struct ScatterSquare {
    std::int32_t x = 0;  ///< column
    std::int32_t y = 0;  ///< row
    friend constexpr auto operator<=>(const ScatterSquare&, const ScatterSquare&) = default;
};

/// The squares of a rectangle, both corners included.
struct ScatterRange {
    ScatterSquare low, high;  ///< the south-western and the north-eastern square
};

/// Scatters objects over the ground of a source by jittered sampling: one candidate for each cell of a grid, at a
/// random place in it (R. Cook, Stochastic Sampling in Computer Graphics, ACM TOG 5(1), 1986), kept with the
/// probability that gives the density, and dropped where slope or height do not allow it.
///
/// A square's objects depend on the source, the settings and the square alone: not on what is resident, nor on other
/// squares. The same bits with every compiler.
///
/// Threads: any number at once
class Scatter {
public:
    /// Cells along the side of a square.
    static constexpr int kSquareCells = 16;

    /// Fails: invalid_argument, naming the field and its value, for settings out of range, and for more than 4096
    ///        expected objects in a cell of the finest spacing
    static Result<Scatter> create(std::shared_ptr<const HeightSource> source,
                                  const ScatterSettings& settings);

    /// Side of a square, metres.
    double square_side() const;
    /// The square that contains a place.
    ///
    /// Requires a place within 2^30 squares of the lattice's origin
    ScatterSquare square_at(double x, double y) const;
    /// The squares that have ground within a horizontal distance of a place, and perhaps more; none where there is
    /// none.
    ///
    /// @param distance metres, >= 0; may be infinite
    std::optional<ScatterRange> squares_within(const WorldPos& p_world, double distance) const;
    /// The closed rectangle of a square, metres.
    WorldRect rect_of(const ScatterSquare& square) const;
    /// Least distance of a place from the ground of a square, metres; infinity where the square is outside the extent.
    double distance_to(const ScatterSquare& square, const WorldPos& p_world) const;

    /// The objects of a square, in the order of their cells. Slopes and heights are those of the candidate's cell,
    /// whose two triangles are cut as those of a chunk; objects outside the extent, on cells that are no ground, and on
    /// cells of the finest spacing with a corner in a volume (HeightSource::is_in_volume()), are left out.
    ///
    /// Fails: as HeightSource::sample(); bad_data for heights that are not finite
    /// Cost:  about one sample of the source for each candidate, and four for each object
    Result<std::vector<ScatterPoint>> objects_in(const ScatterSquare& square) const;

private:
    Scatter(std::shared_ptr<const HeightSource> source, const ScatterSettings& settings);

    std::shared_ptr<const HeightSource> source_;
    ScatterSettings settings_;
    std::int64_t cell_step_ = 1;                                // finest spacings along a cell
    int per_cell_ = 1;                                          // candidates
    double probability_ = 1.0;                                  // of a candidate
    double min_squared_slope_ = 0.0, max_squared_slope_ = 0.0;  // of tangents
};

}  // namespace terrane
