// SPDX-License-Identifier: MIT
#pragma once

#include "base/worker_team.h"
#include "batch/chunk_table.h"

#include <terrane/terrain/ground_batch.h>

#include <vector>

namespace terrane {

struct GroundBatch::State {
    explicit State(int worker_count)
        : team(worker_count), tables(static_cast<std::size_t>(worker_count)) {}

    internal::WorkerTeam team;
    std::vector<internal::ChunkTable> tables;  // one for each worker
    std::uint32_t call = 0;                    // number of the call, for the tables
};

}  // namespace terrane
