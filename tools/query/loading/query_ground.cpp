// SPDX-License-Identifier: MIT
#include "query/loading/query_ground.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace terrane::tools {

QueryGround::QueryGround(std::shared_ptr<const HeightSource> source, Pager pager,
                         const QueryGroundSettings& settings)
    : source_(std::move(source)),
      pager_(std::move(pager)),
      surface_(settings.surface),
      max_chunks_(settings.memory_bytes / Chunk::max_bytes()) {}

Result<QueryGround> QueryGround::create(std::shared_ptr<const HeightSource> source,
                                        const QueryGroundSettings& settings) {
    // without workers update() loads everything requested, so that no answer depends on time
    Result<Pager> pager = Pager::create(source, {.memory_bytes = settings.memory_bytes,
                                                 .worker_count = 0,
                                                 .contact_spacing = settings.contact_spacing});
    if (!pager) return tl::unexpected<Error>(pager.error());
    QueryGround made(std::move(source), std::move(*pager), settings);
    made.pager_.update({}, {}, made.time_s_);
    made.ground_.emplace(made.pager_.resident(), made.pager_.contact_level(), made.surface_);
    return made;
}

bool QueryGround::load(const WorldRect& region) {
    const WorldRect& extent = ground_->extent();
    const double margin = ground_->spacing();
    const WorldRect wanted{
        std::max(region.west - margin, extent.west), std::max(region.south - margin, extent.south),
        std::min(region.east + margin, extent.east), std::min(region.north + margin, extent.north)};
    if (!(wanted.west <= wanted.east && wanted.south <= wanted.north)) return true;
    // refuses at once what can never fit
    const double side = margin * kChunkCells;
    const double chunk_count = std::floor((wanted.east - wanted.west) / side) *
                               std::floor((wanted.north - wanted.south) / side);
    if (chunk_count > static_cast<double>(max_chunks_)) return false;

    const Pager::Ticket ticket = pager_.require(wanted, time_s_);
    held_.push_back(ticket);
    const int level = ground_->level();
    // release the old set first: chunks that only it refers to count against the memory ceiling
    ground_.reset();
    time_s_ += 1.0;
    pager_.update({}, {}, time_s_);
    if (pager_.state_of(ticket) == TicketState::failing) {
        // a chunk with volumes may turn out larger than its claim; the next load claims what it needs
        time_s_ += 1.0;
        pager_.update({}, {}, time_s_);
    }
    ground_.emplace(pager_.resident(), level, surface_);
    return pager_.is_ready(ticket);
}

void QueryGround::release() {
    for (const Pager::Ticket ticket : held_) pager_.release(ticket);
    held_.clear();
}

}  // namespace terrane::tools
