// SPDX-License-Identifier: MIT
#pragma once

#include "lod/key_kernels.h"
#include "lod/screen_error.h"
#include "lod/selection.h"

#include <terrane/terrain/triangulator.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace terrane::internal {

/// Completes a chunk's bits of active vertices: areas with active centres, and midpoints on the world's border.
void mark_active(OpenChunk& chunk, const KeyKernels& kernels, float threshold);

/// Bits of the active midpoints on an area's eastern side (in the first column of the word) or northern side (in the
/// first row). These midpoints belong to the adjacent area, except at the world's border.
std::uint64_t east_side_bits(const OpenChunk& chunk, int area);
std::uint64_t north_side_bits(const OpenChunk& chunk, int area);

/// How the squares of an area are drawn: bit i of each word is for square i.
struct AreaBits {
    std::uint64_t centre = 0;  ///< the square's centre is active
    /// [side: south, east, north, west] the side has an active midpoint.
    std::uint64_t split[4] = {};
    /// [quarter: south-west, south-east, north-east, north-west] a child's centre divides the quarter; then both sides
    /// of the quarter are split.
    std::uint64_t divided[4] = {};
};
/// Requires mark_active() of the chunk, its neighbours and its open children. All zero if the area has no active
/// centre.
AreaBits area_bits(const OpenChunk& chunk, int area);

/// Geomorphs: a vertex is displayed at
///
///   mean of its displayed ends + share * (its height - mean of its ends' heights),
///   share = clamp(full * (1 - (threshold_px / priority_px)^2), 0, 1),
///   full = ratio^2 / (ratio^2 - 1).
///
/// So a vertex lies on its edge when it becomes active, and at its own height once its priority is at least `ratio`
/// thresholds. The share is linear in the key.
///
/// For any value s, the vertices whose share exceeds s are closed under parents, so the displayed surface is an average
/// of conforming meshes. Its error at a point is at most the integral over s of the priority of the next vertex there.
/// If p is the priority with share s(p), the integral from s(p) to s(q) is 2 full threshold^2 (1 / p - 1 / q), and from
/// 0 to 1 it is threshold * 2 ratio / (ratio + 1).
class Morph {
public:
    /// @param ratio >= 1; 1: vertices do not morph
    /// @param threshold_key vertices with smaller keys are active
    Morph(double ratio, float threshold_key);

    bool is_on() const { return is_on_; }

    /// The key below which vertices are displayed at their final heights.
    float in_place(float threshold_key) const {
        return threshold_key / static_cast<float>(ratio_ * ratio_);
    }

    /// Bound of the displayed surface's error, in thresholds, if no active vertex is missing.
    double error_factor() const { return error_factor_; }

    /// The same bound if a vertex with a priority of `excess` thresholds is missing: the vertices split before it have
    /// at least this priority, and so at least its share.
    double error_with_missing(double excess) const;

    /// The same bound if the vertex is present, but morphs with its parents' smaller priority of `shown` thresholds.
    double error_with_held(double excess, double shown) const;

    /// The same bound if the vertex is present, but its chunk and all chunks below have a fade of `fade`.
    double error_with_fade(double excess, double fade) const;

    /// Sets a chunk's offsets. Requires the offsets of its parent.
    void compute_offsets(OpenChunk& chunk, const KeyKernels& kernels, float threshold,
                         float quantum) const;

private:
    void morph_vertex(OpenChunk& chunk, float rise, float key, int column, int row, int to_x,
                      int to_y) const;
    void morph_coarse(OpenChunk& root, float threshold, float quantum) const;
    void morph_sides(OpenChunk& chunk, float quantum) const;
    double share(double excess) const;
    double integral(double from, double to) const;

    bool is_on_ = false;
    double ratio_ = 1.0;
    double full_ = 1.0;
    double error_factor_ = 1.0;
    MorphShare share_of_;
};

/// Number of triangles drawn with a chunk's samples. Requires mark_active() of the chunk and its children.
std::size_t count_triangles(const OpenChunk& chunk, float threshold);

/// Writes three sample indices per triangle, counter-clockwise from above, in a fixed order.
///
/// @param indices_out [3 * count_triangles()]
void emit_triangles(const OpenChunk& chunk, float threshold, std::uint16_t* indices_out);

/// Largest screen errors in view, pixels, that are caused by missing vertices.
struct ResidualError {
    double absent = 0.0;    ///< vertices of absent chunks, and vertices with absent parents
    double held = 0.0;      ///< vertices that inactive parents keep inactive
    double finest = 0.0;    ///< detail finer than the lattice
    double finest_m = 0.0;  ///< the same as a vertical distance, metres
    /// Error of the displayed surface, in thresholds, from vertices that morph late because of their parents' keys.
    double morphing = 0.0;

    void merge(const ResidualError& other) {
        absent = std::max(absent, other.absent);
        held = std::max(held, other.held);
        finest = std::max(finest, other.finest);
        finest_m = std::max(finest_m, other.finest_m);
        morphing = std::max(morphing, other.morphing);
    }
};

/// Merges the residual errors of the triangles drawn with one chunk. Requires mark_active() of the chunk and its
/// children.
///
/// @param residual in and out: errors below its values are skipped early
void find_residual_error(const OpenChunk& chunk, const VertexKeys& keys, const ScreenError& screen,
                         float threshold, const Morph& morph, ResidualError& residual);

/// Error bound of the vertices that fades suppress, pixels.
///
/// @param least_key_of least key of the vertices of the chunk at an index of the resident set, roots' coarser spacings
///                     excepted
double fading_error(const ResidentSet& resident, const Reaches& reaches, const ScreenError& screen,
                    const Morph& morph, float threshold,
                    const std::function<float(std::size_t index)>& least_key_of);

/// Key of an error target, pixels: slightly below it, so that the reported error meets the target after it is rounded
/// up.
float target_key(const ScreenError& screen, double morph_ratio, double target_px);

/// Triangles of a mesh without an active vertex.
std::size_t root_triangles(const Lattice& lattice);

/// Floors of the search for a threshold, at most the target's key: the first one, slightly above the last threshold (0:
/// there is none), and the one after a floor that was too low.
float first_floor(const ScreenError& screen, float target, float last_threshold);
float next_floor(float floor, float target);

/// The keys of demands, in their order.
void find_demand_keys(const ScreenError& screen, std::span<const TriangleDemand> demands,
                      std::vector<WeightedKey>& keys_out);
/// Sets what a mesh says of demands, of which those with keys below the threshold are granted. Requires the mesh's
/// threshold_px.
///
/// @param keys of find_demand_keys()
void grant_demands(std::span<const TriangleDemand> demands, std::span<const WeightedKey> keys,
                   float threshold, TerrainMesh& mesh_out);

/// What a frame's certified error consists of, besides the threshold. Pixels.
struct ErrorParts {
    ResidualError residual;
    double fading = 0.0;    ///< fading_error()
    double left_out = 0.0;  ///< of volumes that are not drawn: see SolidSelection
    double absent_solids = 0.0, drawn_solids = 0.0;
};
/// Sets error, threshold and status of a mesh.
void report_error(const ScreenError& screen, const Morph& morph, float threshold, double target_px,
                  bool is_certified, const ErrorParts& parts, TerrainMesh& mesh_out);

}  // namespace terrane::internal
