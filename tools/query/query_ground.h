// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/ground.h>
#include <terrane/terrain/pager.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

namespace terrane::tools {

struct QueryGroundSettings {
    double contact_spacing = 0.0;  ///< metres; 0: the finest
    std::size_t memory_bytes = std::size_t{1} << 30;
};

/// Ground that is loaded where it is asked for, and stays until the memory ceiling needs its place.
///
/// Ask first, and load only what the answer says is absent: what is resident costs no update.
class QueryGround {
public:
    /// Fails as Pager::create().
    static Result<QueryGround> create(std::shared_ptr<const HeightSource> source,
                                      const QueryGroundSettings& settings);

    /// Changes with load().
    const Ground& ground() const { return *ground_; }

    /// Loads the ground of a rectangle, and one cell around it; it stays until let_go(). False where
    /// it does not fit beside what is held, or the source cannot be read.
    bool load(const WorldRect& region);

    /// Lets go of what load() brought: it may be evicted when something else is loaded.
    void let_go();

private:
    QueryGround(Pager pager, std::size_t max_chunks);

    Pager pager_;
    std::optional<Ground> ground_;
    std::vector<Pager::Ticket> held_;
    std::size_t max_chunks_ = 0;  ///< that fit under the ceiling
    double time_s_ = 0.0;         ///< counts loads: only order matters
};

}  // namespace terrane::tools
