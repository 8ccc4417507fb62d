// SPDX-License-Identifier: MIT
#pragma once

#include "lod/keys/key_kernels.h"
#include "lod/keys/open_chunk.h"

namespace terrane::internal {

/// Geomorphs: a vertex is displayed at
///
///   mean of its displayed ends + share * (its height - mean of its ends' heights),
///   share = clamp(full * (1 - (threshold_px / priority_px)^2), 0, 1),
///   full = ratio^2 / (ratio^2 - 1):
///
/// on its edge when it becomes active, at its height from a priority of `ratio` thresholds on. The share is linear
/// in the key.
///
/// Every set {share above some value} is closed under parents, so the displayed surface is an average of
/// conforming meshes: its error is at most the integral of the priority p over the share, along the vertices that
/// split the triangles at a point. From a share of s(p) to s(q) that is 2 full threshold^2 (1 / p - 1 / q); over all
/// shares, threshold * 2 ratio / (ratio + 1).
class Morph {
public:
    /// @param ratio >= 1; 1: vertices do not morph
    /// @param threshold_key vertices with smaller keys are active
    Morph(double ratio, float threshold_key);

    bool is_on() const { return is_on_; }

    /// Vertices with smaller keys are displayed at their heights.
    float in_place(float threshold_key) const {
        return threshold_key / static_cast<float>(ratio_ * ratio_);
    }

    /// Bound of the displayed surface's error over the threshold, if no active vertex is missing.
    double error_factor() const { return error_factor_; }

    /// The same, in thresholds, where a vertex with a priority of `excess` thresholds is missing: the vertices that
    /// split before it have at least its priority, and so at least its share.
    double error_with_missing(double excess) const;

    /// The same where the vertex is present, but morphs with the smaller priority of `shown` thresholds of its parents.
    double error_with_held(double excess, double shown) const;

    /// The same where the vertex is present, but its chunk and all chunks below have a fade of `fade`.
    double error_with_fade(double excess, double fade) const;

    /// Sets a chunk's offsets. Requires its parent's.
    void compute_offsets(OpenChunk& chunk, const KeyKernels& kernels, float quantum) const;

private:
    void morph_vertex(OpenChunk& chunk, float rise, float key, int column, int row, int to_x,
                      int to_y) const;
    void morph_coarse(OpenChunk& root, float quantum) const;
    void morph_sides(OpenChunk& chunk, float quantum) const;
    double share(double excess) const;
    double integral(double from, double to) const;

    bool is_on_ = false;
    double ratio_ = 1.0;
    double full_ = 1.0;
    double error_factor_ = 1.0;
    MorphShare share_of_;
};

}  // namespace terrane::internal
