// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace terrane {

/// How heights are computed from octaves of noise n with amplitudes a. Every kind has certified bounds; fbm has the
/// tightest. A frame's error_px was at most 3 times the measured error over fbm, and 4.5 times over the other
/// kinds (docs/triangulation.md).
enum class FractalKind : std::uint8_t {
    fbm,     ///< sum of a n: uniform roughness, heights of both signs
    ridged,  ///< sharp crests at the zeros of the noise; heights from 0 to the sum of a
    hybrid,  ///< smooth valleys and rough summits; heights from 0 to the sum of a
    warped,  ///< fbm with domain warping: folds and winding valleys
};

/// Settings of FractalHeights. Plain data with usable defaults:
/// `FractalSettings{.seed = 7, .octave_count = 12}`.
struct FractalSettings {
    std::uint64_t seed = 1;               ///< of the noise
    FractalKind kind = FractalKind::fbm;  ///< how octaves are combined
    int octave_count = 12;                ///< 1 to 24
    double amplitude = 800.0;             ///< of the first octave, metres, 0 to 1e5
    int wavelength_log2 = 12;  ///< log2 of the first octave's wavelength in metres, 0 to 24
    double gain = 0.5;         ///< ratio of the amplitudes of successive octaves, > 0 to 1
    /// Ridged and hybrid: share of an octave's amplitude that depends on the value of the previous octave, 0 (none) to
    /// 1 (all: near the floor of a deep valley all finer octaves vanish).
    double heterogeneity = 0.75;
    /// Ridged: crests are rounded where the noise is within this fraction of its range around zero, 1/64 to 1. Sharper
    /// crests need finer triangles: their curvature is inversely proportional to this fraction.
    double crest_rounding = 0.25;
    /// Warped: amplitude of the first octave of the displacement, relative to the wavelength, 0 to 1. Slopes grow by a
    /// factor of at most 1 + 6 warp (gain 0.5), and bounds become looser.
    double warp = 0.1;
    int finest_spacing_log2 = 0;  ///< log2 of the lattice spacing in metres, -16 to 16
    int root_size_log2 =
        16;  ///< log2 of a root square's side, metres; at least 7 above the spacing
    std::int32_t first_root_x = -1;  ///< the world's root squares: see Lattice
    std::int32_t first_root_y = -1;  ///< see Lattice
    std::int32_t root_count_x = 2;   ///< root squares from west to east; see Lattice
    std::int32_t root_count_y = 2;   ///< root squares from south to north; see Lattice
    std::int32_t root_window =
        0;  ///< root squares along the side of the root window; 0: all are resident; see Lattice
    /// World x of lattice point (0, 0), metres: a multiple of the side of a root square. Moves the root squares over
    /// the ground without changing heights. Use it if the lattice is fine, so that root squares are small, and the
    /// place of interest is far from the world's origin.
    double origin_x = 0.0;
    double origin_y = 0.0;  ///< world y of lattice point (0, 0), as origin_x
};

/// Fractal ground: octaves of gradient noise over 64-bit lattice coordinates with exact fractions. A seed gives the
/// same bits at any distance from the origin, with any compiler at any optimisation level. Bounds are derived
/// analytically, not measured.
class FractalHeights {
public:
    FractalHeights() = delete;

    /// Fails: invalid_argument, naming the field and its value, for settings out of range
    static Result<std::shared_ptr<const HeightSource>> create(const FractalSettings& settings);
};

/// Amplitude of the detail, and a grid of points at which the detail is 0. If these are a raster's samples, their
/// heights are kept.
struct DetailField {
    double origin_x = 0.0, origin_y = 0.0;  ///< world position of a grid point, metres
    double cell_x = 1.0, cell_y = 1.0;  ///< of the grid, metres, and wavelength of the first octave
    int columns = 0, rows = 0;          ///< number of amplitude nodes, >= 1
    double node_origin_x = 0.0, node_origin_y = 0.0;    ///< world position of node (0, 0), metres
    double node_spacing_x = 1.0, node_spacing_y = 1.0;  ///< between amplitude nodes, metres
    /// [rows * columns] from the south-west: amplitude of the first octave at the nodes, metres, >= 0; bilinear between
    /// nodes, constant beyond them.
    std::vector<float> amplitude;
};

/// Settings of add_detail().
struct DetailSettings {
    std::uint64_t seed = 1;  ///< of the noise
    int octave_count = 6;    ///< 1 to 24
    double gain = 0.5;       ///< ratio of the amplitudes of successive octaves, > 0 to 1
};

/// A source plus fractal detail. Its bounds are the sums of the bounds of both.
///
/// Fails: invalid_argument for settings out of range, or a field that is not finite
Result<std::shared_ptr<const HeightSource>> add_detail(std::shared_ptr<const HeightSource> base,
                                                       DetailField field,
                                                       const DetailSettings& settings);

}  // namespace terrane
