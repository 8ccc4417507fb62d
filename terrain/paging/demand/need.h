// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk_key.h>

#include <cstdint>
#include <limits>

namespace terrane::internal {

/// Why a chunk is needed, in order of priority: the smallest is loaded first.
enum class NeedClass : std::uint8_t {
    root,         ///< nothing can be drawn or stood on without it
    contact,      ///< a body or a ticket touches it, or will
    drawn,        ///< a camera's error will be above its threshold without it
    speculation,  ///< a camera's error would be, if it turned or moved in an unpredicted direction
    none,
};

/// How much a chunk is needed, and when; times in seconds from now.
struct Need {
    NeedClass why = NeedClass::none;
    double begin_s = std::numeric_limits<double>::infinity();  ///< 0: now
    /// When the need ends; infinite if beyond the horizon.
    double end_s = 0.0;
    /// Largest screen error without the chunk over the camera's threshold, from its earliest arrival on.
    double ratio = 0.0;

    bool is_needed() const { return why != NeedClass::none; }
    bool is_needed_now() const { return is_needed() && begin_s <= 0.0; }
};

/// The need of two clients together: the higher class; within a class the earlier begin, the later end,
/// the larger ratio.
inline Need combine(const Need& a, const Need& b) {
    if (a.why != b.why) return a.why < b.why ? a : b;
    return {a.why, a.begin_s < b.begin_s ? a.begin_s : b.begin_s,
            a.end_s > b.end_s ? a.end_s : b.end_s, a.ratio > b.ratio ? a.ratio : b.ratio};
}

/// An absent chunk that is needed.
struct LoadCandidate {
    ChunkKey key;
    Need need;
    /// Time left until its load must begin so that it, and the chunks that need it as their parent, are
    /// in time; seconds, negative where that is too late already.
    double slack_s = 0.0;
    bool can_wait = false;  ///< the load may be postponed to a later update
};

/// Order of loading, total: by class; late (slack_s <= 0) before the others; late ones by larger error,
/// others by smaller slack; then by level and key.
bool has_priority_over(const LoadCandidate& a, const LoadCandidate& b);

}  // namespace terrane::internal
