// SPDX-License-Identifier: MIT
#pragma once

#include "query/loading/path_clip.h"
#include "query/loading/query_ground.h"

#include <algorithm>
#include <cstddef>
#include <vector>

// Questions whose ground is loaded where the answer needs it.
namespace terrane::tools {

/// Whether an answer needs ground that is not resident.
template <class Answer>
bool is_absent(const Answer& answer) {
    return answer.status == decltype(answer.status)::not_resident;
}

/// Calls `ask`; where ground around a shape is not resident, loads it and calls `ask` again.
template <class Ask>
auto ask_around(QueryGround& ground, const WorldPos& centre_world, double reach, Ask ask) {
    auto answer = ask();
    if (is_absent(answer)) {
        ground.load({centre_world.x() - reach, centre_world.y() - reach, centre_world.x() + reach,
                     centre_world.y() + reach});
        answer = ask();
    }
    return answer;
}

/// Calls `ask` while loading ground along a segment in growing batches, until the answer is complete: a motion that
/// ends early at the ground loads nothing beyond.
template <class Ask>
auto ask_along(QueryGround& ground, const WorldPos& from_world, const WorldPos& to_world,
               double reach, Ask ask) {
    auto answer = ask();
    if (!is_absent(answer)) return answer;
    const double side = ground.ground().spacing() * kChunkCells;
    const std::vector<WorldRect> pieces =
        cut_path(from_world, to_world, reach, side, ground.ground().extent());
    std::size_t batch = 1;
    for (std::size_t next = 0; next < pieces.size() && is_absent(answer); batch *= 2) {
        for (std::size_t end = std::min(next + batch, pieces.size()); next < end; ++next) {
            if (!ground.load(pieces[next])) return ask();
        }
        answer = ask();
    }
    return answer;
}

}  // namespace terrane::tools
