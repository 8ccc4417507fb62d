// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace terrane {

/// How heights are computed from octaves of noise n of amplitude a. Every kind has certified bounds.
/// Those of fbm are the tightest: a frame's error_px was at most 3 times the measured error over it, and 4.5 times over
/// the others (docs/triangulation.md).
enum class FractalKind : std::uint8_t {
    fbm,     ///< sum of a n: the same roughness everywhere, heights of both signs
    ridged,  ///< sharp crests where the noise crosses zero; heights from 0 to the sum of a
    hybrid,  ///< smooth valleys below rough heights; heights from 0 to the sum of a
    warped,  ///< fbm with domain warping: folds and winding valleys
};

/// Settings of FractalHeights. Plain data with usable defaults; change what you need:
/// `FractalSettings{.seed = 7, .octave_count = 12}`.
struct FractalSettings {
    std::uint64_t seed = 1;               ///< of the noise
    FractalKind kind = FractalKind::fbm;  ///< how octaves make heights
    int octave_count = 12;                ///< 1 to 24
    double amplitude = 800.0;             ///< of the first octave, metres, 0 to 1e5
    int wavelength_log2 = 12;  ///< the first octave's wavelength is 2^this metres; 0 to 24
    double gain = 0.5;         ///< amplitude ratio of successive octaves, > 0 to 1
    /// Ridged and hybrid: share of an octave's amplitude that depends on the value of the previous
    /// octave, 0 (none) to 1 (all: beside a deep valley's floor all finer octaves vanish).
    double heterogeneity = 0.75;
    /// Ridged: a crest is round where the noise is within this share of its range around zero, 1/64
    /// to 1. Sharper crests need finer triangles: curvature grows with the inverse.
    double crest_rounding = 0.25;
    /// Warped: amplitude of the first octave of the displacement over the wavelength, 0 to 1. Slopes grow by a factor
    /// of at most 1 + 6 warp (gain 0.5), so bounds get looser with it.
    double warp = 0.1;
    int finest_spacing_log2 = 0;  ///< lattice spacing is 2^this metres; -16 to 16
    int root_size_log2 = 16;      ///< a root square has 2^this metres; at least 7 above the spacing
    std::int32_t first_root_x = -1;  ///< the world's root squares: see Lattice
    std::int32_t first_root_y = -1;  ///< see Lattice
    std::int32_t root_count_x = 2;   ///< root squares from west to east; see Lattice
    std::int32_t root_count_y = 2;   ///< root squares from south to north; see Lattice
    std::int32_t root_window =
        0;  ///< root squares along the window that is resident; 0: all; see Lattice
    /// World x of lattice point (0, 0), metres: a multiple of the side of a root square. Moves the root squares over
    /// the ground and changes no height: for fine lattices, whose root squares are small, far from the world's origin.
    double origin_x = 0.0;
    double origin_y = 0.0;  ///< world y of lattice point (0, 0), as origin_x
};

/// Fractal ground: octaves of gradient noise over 64-bit lattice coordinates with exact
/// fractions, so that a seed gives the same bits at any distance from the origin, with any compiler
/// at any optimisation level. Its bounds are derived, not measured.
class FractalHeights {
public:
    FractalHeights() = delete;

    /// Fails: invalid_argument, naming the field and its value, for settings out of range
    static Result<std::shared_ptr<const HeightSource>> create(const FractalSettings& settings);
};

/// The amplitude of detail, and the grid at whose points it vanishes, so that a raster's samples keep their heights.
struct DetailField {
    double origin_x = 0.0, origin_y = 0.0;  ///< world position of a grid point, metres
    double cell_x = 1.0, cell_y = 1.0;      ///< of the grid, metres: wavelength of the first octave
    int columns = 0, rows = 0;              ///< amplitude nodes, >= 1
    double node_origin_x = 0.0, node_origin_y = 0.0;    ///< world position of node (0, 0), metres
    double node_spacing_x = 1.0, node_spacing_y = 1.0;  ///< between nodes, metres
    /// [rows * columns] from the south-west: amplitude of the first octave, metres, >= 0; bilinear
    /// between nodes, constant beyond them.
    std::vector<float> amplitude;
};

/// Settings of DetailHeights. Fixed once it is created.
struct DetailSettings {
    std::uint64_t seed = 1;  ///< of the noise
    int octave_count = 6;    ///< 1 to 24
    double gain = 0.5;       ///< amplitude ratio of successive octaves, > 0 to 1
};

/// A source plus fractal detail; its bounds are the sums of both.
/// Fails: invalid_argument for settings out of range or a field that is not finite
Result<std::shared_ptr<const HeightSource>> add_detail(std::shared_ptr<const HeightSource> base,
                                                       DetailField field,
                                                       const DetailSettings& settings);

}  // namespace terrane
