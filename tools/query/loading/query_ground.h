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
    std::shared_ptr<const SurfaceMap> surface = {};  ///< of the ground; null: none
};

/// Ground loaded on demand; evicted only when the memory ceiling requires it.
///
/// Query first and load() only where the answer is not_resident: resident ground costs no update.
class QueryGround {
public:
    /// Fails as Pager::create().
    static Result<QueryGround> create(std::shared_ptr<const HeightSource> source,
                                      const QueryGroundSettings& settings);

    /// Where the ground is loaded from.
    const HeightSource& source() const { return *source_; }

    /// Replaced by load().
    const Ground& ground() const { return *ground_; }

    /// Loads the ground of a rectangle and one cell around it, and keeps it until release(). False where it does not
    /// fit in memory together with what is kept, or the source cannot be read.
    bool load(const WorldRect& region);

    /// Allows eviction of everything loaded.
    void release();

private:
    QueryGround(std::shared_ptr<const HeightSource> source, Pager pager,
                const QueryGroundSettings& settings);

    std::shared_ptr<const HeightSource> source_;
    Pager pager_;
    std::shared_ptr<const SurfaceMap> surface_;
    std::optional<Ground> ground_;
    std::vector<Pager::Ticket> held_;
    std::size_t max_chunks_ = 0;  ///< capacity of the memory ceiling
    double time_s_ = 0.0;         ///< number of loads: only the order matters
};

}  // namespace terrane::tools
