// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk_key.h>

#include <cstdint>
#include <limits>

namespace terrane::internal {

/// Why a chunk is needed; smaller goes first.
enum class NeedClass : std::uint8_t {
    root,         ///< nothing can be drawn or stood on without
    contact,      ///< a body or a ticket stands on it, or will
    drawn,        ///< a camera will see too little detail without it
    speculation,  ///< a camera may, were it to turn
    none,
};

/// How much a chunk is needed, and when: seconds from now.
struct Need {
    NeedClass why = NeedClass::none;
    double begin_s = std::numeric_limits<double>::infinity();  ///< 0: now
    /// When nobody needs it any more; infinity where that lies beyond the horizon.
    double end_s = 0.0;
    /// Largest screen error without it over what the camera asks for, from when it could be there.
    double ratio = 0.0;

    bool is_needed() const { return why != NeedClass::none; }
    bool is_needed_now() const { return is_needed() && begin_s <= 0.0; }
};

/// The need of two who need one chunk: the better class and its time.
inline Need both(const Need& a, const Need& b) {
    if (a.why != b.why) return a.why < b.why ? a : b;
    return {a.why, a.begin_s < b.begin_s ? a.begin_s : b.begin_s,
            a.end_s > b.end_s ? a.end_s : b.end_s, a.ratio > b.ratio ? a.ratio : b.ratio};
}

/// An absent chunk that is needed.
struct Wish {
    ChunkKey key;
    Need need;
    /// When its loading must begin at the latest, for it and for what waits for it, seconds from now.
    double slack_s = 0.0;
    bool can_wait = false;  ///< there is time enough for it later
};

/// Which of two goes first. What is late already: the larger error. What is not: the less slack. Late
/// before not late. Total.
bool goes_before(const Wish& a, const Wish& b);

}  // namespace terrane::internal
