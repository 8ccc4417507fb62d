// SPDX-License-Identifier: MIT
//
// Chunks that are larger than their loads have claimed: loaded again with a larger claim; the ceiling holds.
#include "support/heights/wave_heights.h"

#include <terrane/terrain/composed_heights.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/solid_surface.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <thread>

namespace terrane {
namespace chunk_claims_test {

using test::WaveHeights;

constexpr std::size_t kTriangles = 20'000;

/// Hills whose chunk (0, 0) of the finest level has a solid surface of many triangles, which it does not expect.
class Surprising final : public ForwardedHeights {
public:
    explicit Surprising(std::shared_ptr<const WaveHeights> hills)
        : ForwardedHeights(std::move(hills)) {
        SolidTriangles triangles;
        triangles.vertices_world = {{1.0, 1.0, -9.0}, {2.0, 1.0, -9.0}, {1.0, 2.0, -9.0}};
        triangles.triangles.assign(kTriangles, {0, 1, 2});
        triangles.parts.assign(kTriangles, SolidPart::cavity);
        solid_ = std::make_shared<const SolidSurface>(std::move(triangles));
    }
    ChunkKey key() const { return {0, 0, static_cast<std::uint8_t>(lattice().finest_level)}; }
    /// Bytes of the surprise.
    std::size_t solid_bytes() const { return solid_->bytes(); }
    bool learns = true;

    Result<std::shared_ptr<const Chunk>> stored_chunk(const ChunkKey& wanted,
                                                      const std::stop_token& stop) const override {
        if (wanted != key()) return std::shared_ptr<const Chunk>();
        auto chunk = std::make_shared<Chunk>(**make_chunk(heights(), wanted, stop));
        chunk->solid = solid_;
        known_bytes_ = learns ? chunk->bytes() : 0;
        return std::shared_ptr<const Chunk>(std::move(chunk));
    }
    std::size_t max_chunk_bytes(const ChunkKey& wanted) const override {
        return std::max(Chunk::max_bytes(), wanted == key() ? known_bytes_.load() : 0);
    }

private:
    std::shared_ptr<const SolidSurface> solid_;
    mutable std::atomic<std::size_t> known_bytes_{0};
};

std::shared_ptr<Surprising> surprise() {
    return std::make_shared<Surprising>(
        std::make_shared<const WaveHeights>(test::small_world(3, 1.0), 20.0, 700.0));
}

// A body at the chunk; returns whether it is resident after two seconds of the clock.
bool arrives(Pager& pager, const ChunkKey& key, std::size_t ceiling) {
    BodyNeed body;
    body.centre_world = {1.0, 1.0, 0.0};
    for (int i = 0; i < 200; ++i) {
        pager.update({}, {&body, 1}, 0.01 * i);
        EXPECT_LE(pager.stats().peak_bytes, ceiling);
        if (pager.resident()->find_chunk(key) != nullptr) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
}

TEST(ChunkClaims, ALargeChunkArrivesAtItsSecondLoad) {
    for (const int workers : {0, 2}) {
        const auto source = surprise();
        const std::size_t ceiling = 40 * Chunk::max_bytes() + 2 * source->solid_bytes();
        Pager pager =
            Pager::create(source, {.memory_bytes = ceiling, .worker_count = workers}).value();
        EXPECT_TRUE(arrives(pager, source->key(), ceiling)) << pager.last_failure();
        EXPECT_EQ(pager.stats().failed, 0u);
        EXPECT_GE(pager.stats().resident_bytes, source->solid_bytes());
    }
}

TEST(ChunkClaims, ALargeChunkThatNobodyClaimsIsNotTaken) {
    const auto source = surprise();
    source->learns = false;
    const std::size_t ceiling = 100 * Chunk::max_bytes();
    Pager pager = Pager::create(source, {.memory_bytes = ceiling, .worker_count = 0}).value();
    EXPECT_FALSE(arrives(pager, source->key(), ceiling));
    EXPECT_GT(pager.stats().failed, 2u);
}

TEST(ChunkClaims, WhatDoesNotFitUnderTheCeilingIsPostponedAndCounted) {
    const auto source = surprise();
    const std::size_t ceiling = 4 * Chunk::max_bytes() + source->solid_bytes() / 2;
    Pager pager = Pager::create(source, {.memory_bytes = ceiling, .worker_count = 0}).value();
    EXPECT_FALSE(arrives(pager, source->key(), ceiling));
    EXPECT_GT(pager.stats().over_ceiling, 0u);
}

}  // namespace chunk_claims_test
}  // namespace terrane
