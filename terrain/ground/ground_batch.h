// SPDX-License-Identifier: MIT
#pragma once

#include "base/worker_team.h"

#include <terrane/terrain/chunk.h>
#include <terrane/terrain/ground.h>
#include <terrane/terrain/ground_batch.h>

#include <algorithm>
#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace terrane::internal {

/// Data of a chunk for height queries, in one cache line.
struct ChunkEntry {
    std::int64_t column = 0, row = 0;  ///< of the chunk on its level
    std::uint64_t call = 0;            ///< number of the call that wrote the entry
    /// Null if the chunk is absent, has volumes, or is not certified: its points are then answered individually.
    const std::int32_t* heights = nullptr;
    const float* cell_bounds = nullptr;
    const std::uint8_t* cell_flags = nullptr;  ///< null: all cells are ground
};

/// Direct-mapped cache of the chunks found by one thread in one call, indexed by the low bits of column and row.
class ChunkTable {
public:
    ChunkTable() : entries_(kSide * kSide) {}

    /// The entry for a chunk; it may hold another chunk.
    ChunkEntry& at(std::int64_t column, std::int64_t row) {
        return entries_[static_cast<std::size_t>(((row & (kSide - 1)) * kSide) +
                                                 (column & (kSide - 1)))];
    }

private:
    static constexpr std::int64_t kSide = 32;
    std::vector<ChunkEntry> entries_;
};

/// Sorts places by chunk, for grounds larger than the CPU caches: a counting sort by the low bits of chunk columns and
/// rows. Allocates only in the constructor.
class ChunkOrder {
public:
    /// Largest number of places.
    static constexpr std::size_t kMost = std::size_t{1} << 16;

    ChunkOrder() : buckets_(kMost), order_(kMost) {}

    /// Maps places to buckets of chunks.
    struct Grid {
        explicit Grid(const Ground& ground)
            : extent(ground.extent()),
              origin_x(ground.cell_x(0)),
              origin_y(ground.cell_y(0)),
              inverse_side(1.0 / (ground.spacing() * kChunkCells)) {}

        /// Bucket of a place; all places beyond the extent share one bucket.
        std::uint16_t bucket(double x, double y) const {
            if (!extent.contains(x, y)) return kNowhere;
            // rounding at the borders of chunks does not matter
            const auto column = static_cast<std::int64_t>((x - origin_x) * inverse_side + kShift);
            const auto row = static_cast<std::int64_t>((y - origin_y) * inverse_side + kShift);
            return static_cast<std::uint16_t>((row & (kSide - 1)) * kSide + (column & (kSide - 1)));
        }

        WorldRect extent;
        double origin_x, origin_y, inverse_side;
    };

    /// The indices of places 0 to count - 1, sorted by chunk. Empty if sorting does not pay, because most successive
    /// places share a chunk already, or all places lie in few chunks.
    ///
    /// @param count   at most kMost
    /// @param bucket_of called with an index, returns Grid::bucket() of its place
    template <class BucketOf>
    std::span<const std::uint32_t> arrange(std::size_t count, const BucketOf& bucket_of) {
        if (!is_scattered(count, bucket_of)) return {};
        std::array<std::uint32_t, kBuckets + 1> begins{};
        for (std::size_t i = 0; i < count; ++i) {
            buckets_[i] = bucket_of(i);
            ++begins[buckets_[i] + std::size_t{1}];
        }
        for (std::size_t b = 1; b <= kBuckets; ++b) begins[b] += begins[b - 1];
        for (std::size_t i = 0; i < count; ++i)
            order_[begins[buckets_[i]]++] = static_cast<std::uint32_t>(i);
        return std::span(order_).first(count);
    }

private:
    static constexpr std::int64_t kSide = 32;
    static constexpr std::uint16_t kNowhere = kSide * kSide;
    static constexpr std::size_t kBuckets = kSide * kSide + 1;
    static constexpr double kShift = 0x1p32;  // multiple of kSide; keeps indices positive

    template <class BucketOf>
    static bool is_scattered(std::size_t count, const BucketOf& bucket_of) {
        // Measured: below this many places or chunks, sorting costs more than it saves.
        constexpr std::size_t kLeastCount = 1024, kLeastChunks = 8, kPairs = 64;
        if (count < kLeastCount) return false;
        std::bitset<kBuckets> met;
        std::size_t same = 0;
        for (std::size_t pair = 0; pair < kPairs; ++pair) {
            const std::size_t i = pair * (count / kPairs);
            const std::uint16_t bucket = bucket_of(i);
            met.set(bucket);
            same += std::size_t{bucket == bucket_of(i + 1)};
        }
        return 2 * same < kPairs && met.count() > kLeastChunks;
    }

    std::vector<std::uint16_t> buckets_;
    std::vector<std::uint32_t> order_;
};

/// Fails: invalid_argument, naming the array and its length, if one is too short
Result<void> check_points(const char* name, const PointArray& points, bool has_heights);

/// Fails: invalid_argument, naming the array and its length, unless the array has no entries or `count` of them
Result<void> check_length(const char* name, std::size_t length, std::size_t count,
                          std::size_t per_item = 1);

}  // namespace terrane::internal

namespace terrane {

struct GroundBatch::State {
    explicit State(int worker_count)
        : team(worker_count), workers(static_cast<std::size_t>(worker_count)) {}

    struct Worker {
        internal::ChunkTable table;
        internal::ChunkOrder order;
    };

    /// Calls job(begin, end, worker) for slices of items 0 to count - 1. All but the last have at least `least` items.
    template <class Job>
    void run_slices(std::size_t count, std::size_t least, const Job& job) {
        // several slices per worker, so that all end at about the same time
        const std::size_t share = count / (4 * workers.size()) + 1;
        const std::size_t side = std::clamp(share, least, internal::ChunkOrder::kMost);
        team.run(count / side + (count % side != 0 ? 1 : 0), [&](std::size_t slice, int worker) {
            const std::size_t begin = slice * side;
            job(begin, begin + std::min(side, count - begin),
                workers[static_cast<std::size_t>(worker)]);
        });
    }

    internal::WorkerTeam team;
    std::vector<Worker> workers;
    std::uint64_t call = 0;  // number of calls of heights(), for the tables
    RayFan fan;              // for rays with a common origin
};

}  // namespace terrane
