// SPDX-License-Identifier: MIT
//
// Included by sources that are compiled once for each SimdLevel: contains only plain data, no inline functions.
#pragma once

#include "base/simd_level.h"

#include <stdint.h>

namespace terrane::internal {

/// Most columns that kernels process at once: a multiple of the widest vector, and at least the samples of a chunk row.
inline constexpr int kMaxNoiseColumns = 136;
/// Columns are processed in whole groups of the widest level's lanes.
inline constexpr int kNoiseGroup = 8;
/// Rounded cosines of the directions of gradients: cos((2 k + 1) pi / 64) for k = 0 to 15. No gradient lies along an
/// axis or a diagonal; the other three quadrants are mirrored.
constexpr double kNoiseCosines[16] = {
    0.9987954562051724,  0.989176509964781,   0.970031253194544,   0.9415440651830208,
    0.9039892931234433,  0.8577286100002721,  0.8032075314806449,  0.7409511253549591,
    0.6715589548470183,  0.5956993044924335,  0.5141027441932217,  0.4275550934302822,
    0.33688985339222005, 0.24298017990326398, 0.14673047445536175, 0.049067674327418126};

/// Factors that map noise, which lies within +-sqrt(1/2), to +-1 and to +-1/2.
inline constexpr double kNoiseToUnit = 1.4142135623730951, kNoiseToHalf = 0.7071067811865476;

/// Multipliers of the hashes: of a node's index along an axis, and of the combination of two such hashes.
inline constexpr uint64_t kMixFirst = 0xbf58476d1ce4e5b9u, kMixSecond = 0x94d049bb133111ebu;
inline constexpr uint64_t kNodeFirst = 0xd6e8feb86659fd93u, kNodeSecond = 0x9e3779b97f4a7c15u;

/// One octave along an axis of integer units: a cell has 2^shift units.
struct NoiseAxis {
    uint64_t key = 0;
    uint64_t offset = 0;  ///< added to every coordinate, units
    int shift = 0;        ///< 1 to 51
    double cells_per_unit = 0.0;
};

/// One octave in the plane.
struct NoiseOctave {
    NoiseAxis x, y;
    double amplitude = 0.0;
};

/// Gradients of a row of nodes. Has space for two nodes per column, and for reading a group past the end.
struct NoiseNodes {
    static constexpr int kMax = 2 * kMaxNoiseColumns + 2 * kNoiseGroup;
    alignas(64) double x[kMax];
    alignas(64) double y[kMax];
};

/// A run: groups of lanes that look up their nodes together, either one group or several whose columns lie in one cell.
struct NoiseRun {
    int first;     ///< first node of a near run
    int end;       ///< column after the last one of the run
    bool is_near;  ///< all lower and upper nodes of the run fit into one vector
};

/// The kernels' data for a grid's columns on one octave. Uninitialised: written before it is read.
struct NoiseColumnData {
    int column_count;  ///< arrange() rounds it up to whole vectors
    int node_count;    ///< a multiple of two vectors, or of one vector with eight lanes
    /// Offset from a column's lower node to its upper one: 1 if columns share nodes, else the number of columns.
    int upper;
    uint64_t cell_mask;  ///< node indices are taken modulo cell_mask + 1
    alignas(64) uint64_t cells[kMaxNoiseColumns];
    alignas(64) double fractions[kMaxNoiseColumns];
    alignas(64) double fades[kMaxNoiseColumns];
    bool is_direct;  ///< column i's lower node is node i, for every column
    bool is_picked;  ///< if not direct: whether each group is a near run
    int run_count;   ///< if neither: number of runs, from the first column to the last
    NoiseRun runs[kMaxNoiseColumns];
    alignas(
        64) uint64_t lanes[kMaxNoiseColumns];  ///< lower nodes, in the layout of the level's kernel
    alignas(64) uint64_t hashes[NoiseNodes::kMax];
    NoiseNodes nodes[2];  ///< rows of nodes below and above a row of samples
};

/// Contributions of nodes to a row of samples: gradients blended along y, as linear functions of x. A load that spans
/// recent stores stalls the processor: find the next row before adding this one.
struct NoiseRow {
    alignas(64) double slopes[NoiseNodes::kMax];
    alignas(64) double offsets[NoiseNodes::kMax];
};

/// Shape of a multifractal: fractal_surface.h defines the numbers.
struct MultifractalShape {
    double crest = 1.0;
    double half_over_crest = 0.5;
    double heterogeneity = 0.0;
    double homogeneity = 1.0;  ///< 1 - heterogeneity
};

/// Largest number of points that kernels process at once: those of a patch of a warped grid.
inline constexpr int kMaxNoisePoints = 768;

/// Arbitrary points in the plane, in units.
struct NoisePoints {
    int count;  ///< a multiple of kNoiseGroup, at most kMaxNoisePoints
    alignas(64) uint64_t x[kMaxNoisePoints];
    alignas(64) uint64_t y[kMaxNoisePoints];
    alignas(64) double rest_x[kMaxNoisePoints];  ///< fraction of a unit, 0 to 1
    alignas(64) double rest_y[kMaxNoisePoints];
    /// Low corner and size of the smallest rectangle around the points' whole units.
    uint64_t low_x, low_y, extent_x, extent_y;
};

/// The inner loops of noise. Rows of sums and weights have column_count values and are 64-byte aligned. At every level,
/// results are bit-identical to noise() in noise.h.
struct NoiseKernels {
    /// Sets cells and fractions of columns at `first`, `first + step`, ... units.
    void (*place)(NoiseColumnData& columns, const NoiseAxis& axis, uint64_t first, uint64_t step);
    /// Sets the data that depend on cells and fractions, which must be filled to the end of a vector.
    void (*arrange)(NoiseColumnData& columns, uint64_t axis_key);
    /// Gradients of the columns' nodes in the row of nodes with this hash.
    void (*find_gradients)(const NoiseColumnData& columns, uint64_t row_hash,
                           NoiseNodes& nodes_out);
    /// Blends two rows of nodes for a row of samples between them.
    void (*blend)(const NoiseColumnData& columns, const NoiseNodes& low, const NoiseNodes& high,
                  double fraction, double fade, NoiseRow& row_out);
    /// Adds amplitude * noise to the sums.
    void (*add)(const NoiseColumnData& columns, const NoiseRow& row, double amplitude,
                double* sums);
    /// Adds an octave of a multifractal and updates the weights for the next octave.
    void (*add_ridged)(const NoiseColumnData& columns, const NoiseRow& row, double amplitude,
                       const MultifractalShape& shape, double* weights, double* sums);
    void (*add_hybrid)(const NoiseColumnData& columns, const NoiseRow& row, double amplitude,
                       const MultifractalShape& shape, double* weights, double* sums);
    /// Moves `count` points, a multiple of kNoiseGroup, starting at `first`, by (x, y) metres.
    ///
    /// @param units_per_metre  a power of two; the displacement in units must be below 2^50
    void (*move)(NoisePoints& points, int first, int count, double units_per_metre, const double* x,
                 const double* y);
    /// Sets the rectangle around the points.
    void (*enclose)(NoisePoints& points);
    /// Adds amplitude * noise at the points. Requires enclose().
    void (*add_points)(const NoiseOctave& octave, const NoisePoints& points, double* sums);
};

/// Requires a level that this machine supports.
const NoiseKernels& noise_kernels(SimdLevel level);

extern const NoiseKernels kNoiseKernelsBaseline;
#if defined(__x86_64__)
extern const NoiseKernels kNoiseKernelsAvx2;
extern const NoiseKernels kNoiseKernelsAvx512;
#endif

}  // namespace terrane::internal
