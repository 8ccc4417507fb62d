// SPDX-License-Identifier: MIT
#pragma once

#include "lod/keys/key_kernels.h"
#include "lod/keys/open_chunk.h"

namespace terrane::internal {

/// How vertices slide in: a vertex stands at
///
///   mean of its displayed ends + share * (its height - mean of its ends' heights),
///   share = clamp(full * (1 - (threshold_px / priority_px)^2), 0, 1),
///   full = ratio^2 / (ratio^2 - 1),
///
/// flat where it has just become active, in place where its priority is `ratio` thresholds. The
/// share is linear in the key.
///
/// Every set of vertices with a share above some value is closed under parents, so the displayed
/// surface is a mean of conforming meshes: its error is at most the integral of the priority p over
/// the share, along the vertices that divide a place. From a share of s(p) to s(q) that is
/// 2 full threshold^2 (1 / p - 1 / q); over all of it, threshold * 2 ratio / (ratio + 1).
class Morph {
public:
    /// @param ratio >= 1; 1: vertices do not morph
    /// @param threshold_key vertices with keys below it are active
    Morph(double ratio, float threshold_key);

    bool is_on() const { return is_on_; }

    /// Vertices with keys below it are in place.
    float in_place(float threshold_key) const {
        return threshold_key / static_cast<float>(ratio_ * ratio_);
    }

    /// Error of the displayed surface over the threshold, where everything wanted is there.
    double spread() const { return spread_; }

    /// Bound on the error, in thresholds, where a vertex of a priority of `excess` thresholds is
    /// missing: what is divided before it has at least its priority, and so at least its share.
    double with_missing(double excess) const;

    /// The same where it is there, but slides with a priority of `shown` thresholds, because one that it
    /// waits for has no more.
    double with_held(double excess, double shown) const;

    /// The same where the missing vertex is there, but its chunk and all below it have faded in by
    /// `fade` only.
    double with_fade(double excess, double fade) const;

    /// Fills a chunk's offsets, from its parent's.
    void slide(OpenChunk& chunk, const KeyKernels& kernels, float quantum) const;

private:
    void slide_vertex(OpenChunk& chunk, float rise, float key, int column, int row, int to_x,
                      int to_y) const;
    void slide_coarse(OpenChunk& root, float quantum) const;
    void slide_sides(OpenChunk& chunk, float quantum) const;
    double share(double excess) const;
    double integral(double from, double to) const;

    bool is_on_ = false;
    double ratio_ = 1.0;
    double full_ = 1.0;
    double spread_ = 1.0;
    SlideShare share_of_;
};

}  // namespace terrane::internal
