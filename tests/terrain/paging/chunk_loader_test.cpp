// SPDX-License-Identifier: MIT
#include "paging/chunk_loader.h"

#include "support/faulty_heights.h"
#include "support/random.h"
#include "terrain/paging/pager_scene.h"

#include <gtest/gtest.h>

#include <numeric>
#include <stop_token>
#include <string>
#include <thread>

namespace terrane::chunk_loader_test {

std::shared_ptr<const Chunk> some_chunk() {
    auto chunk = std::make_shared<Chunk>();
    chunk->heights.resize(1000);
    return chunk;
}

// After any sequence of moves the count is the sum of all claims.
TEST(ByteClaim, KeepsTheSumOfAllClaimsThroughRandomMoves) {
    SCOPED_TRACE("seed 11");
    test::Random random(11);
    const auto count = std::make_shared<ByteCount>(0);
    std::vector<ByteClaim> claims(20);
    for (int i = 0; i < 5000; ++i) {
        ByteClaim& one = claims[static_cast<std::size_t>(random.below(20))];
        ByteClaim& two = claims[static_cast<std::size_t>(random.below(20))];
        switch (random.below(4)) {
            case 0:
                one = ByteClaim(count, static_cast<std::size_t>(random.below(1000)));
                break;
            case 1:
                one = std::move(two);
                break;
            case 2:
                one.shrink(one.bytes() / 2);
                break;
            default:
                std::swap(one, two);
        }
        const std::size_t sum = std::accumulate(
            claims.begin(), claims.end(), std::size_t{0},
            [](std::size_t bytes, const ByteClaim& claim) { return bytes + claim.bytes(); });
        ASSERT_EQ(*count, sum);
    }
    claims.clear();
    EXPECT_EQ(*count, 0u);
}

TEST(Claimed, HoldsTheBytesOfTheChunkUntilItsLastOwnerReleasesIt) {
    const auto count = std::make_shared<ByteCount>(0);
    const auto chunk = some_chunk();
    auto held = claimed(chunk, ByteClaim(count, Chunk::max_bytes()));
    EXPECT_EQ(held.get(), chunk.get());
    EXPECT_EQ(*count, chunk->bytes());
    const std::weak_ptr<const Chunk> watch = held;
    auto second = held;
    held.reset();
    EXPECT_EQ(*count, chunk->bytes());
    second.reset();
    EXPECT_EQ(*count, 0u);
    EXPECT_TRUE(watch.expired());
    EXPECT_EQ(chunk.use_count(), 1);
    // a claim smaller than the chunk's bytes, as made by an owner without a ceiling
    held = claimed(chunk, ByteClaim(count, 10));
    EXPECT_EQ(*count, 10u);
    held = claimed(chunk, {});
    EXPECT_EQ(*count, 0u);
}

// The last owner releases the claim, on any thread, after the chunk's own memory.
TEST(Claimed, IsReleasedOnTheThreadOfTheLastOwner) {
    const auto count = std::make_shared<ByteCount>(0);
    for (int round = 0; round < 50; ++round) {
        std::vector<std::thread> threads;
        {
            const auto held = claimed(some_chunk(), ByteClaim(count, Chunk::max_bytes()));
            for (int i = 0; i < 4; ++i) {
                threads.emplace_back([copy = held]() mutable { copy.reset(); });
            }
        }
        for (std::thread& thread : threads) thread.join();
        ASSERT_EQ(*count, 0u);
    }
}

}  // namespace terrane::chunk_loader_test

namespace terrane::run_load_test {

using namespace test;

constexpr ChunkKey kKey{1, 2, 3};

TEST(RunLoad, GivesTheChunkWithItsClaimAndReleasesThatOfAFailedLoad) {
    struct Case {
        Fault fault;
        std::optional<ErrorCode> code;
        std::string message_part;
    };
    for (const Case& tested :
         {Case{Fault::none, std::nullopt, ""},
          Case{Fault::read_error, ErrorCode::io, "the disk cannot be read"},
          Case{Fault::nan, ErrorCode::bad_data, "nan"},
          Case{Fault::no_memory, ErrorCode::out_of_memory, ""},
          Case{Fault::exception, ErrorCode::io,
               "chunk (1, 2) of level 3 cannot be read: the source threw"},
          Case{Fault::odd_exception, ErrorCode::io, "chunk (1, 2) of level 3 cannot be read"}}) {
        const FaultyHeights source(
            std::make_shared<test::WaveHeights>(test::small_world(3, 1.0), 20.0, 90.0),
            {{.fault = tested.fault}});
        Loads loads;
        FinishedLoad done = run_load(source, loads.request(kKey));
        EXPECT_EQ(done.key, kKey);
        if (tested.code) {
            ASSERT_FALSE(done.chunk) << static_cast<int>(tested.fault);
            EXPECT_EQ(done.chunk.error().code, *tested.code);
            EXPECT_NE(done.chunk.error().message.find(tested.message_part), std::string::npos)
                << done.chunk.error().message;
            EXPECT_EQ(loads.bytes(), 0u);
        } else {
            ASSERT_TRUE(done.chunk) << done.chunk.error().message;
            EXPECT_EQ((*done.chunk)->key, kKey);
            EXPECT_EQ(done.bytes_read, (*done.chunk)->bytes());
            EXPECT_EQ(loads.bytes(), (*done.chunk)->bytes());
            done = {};
            EXPECT_EQ(loads.bytes(), 0u);
        }
    }
}

TEST(RunLoad, IsCancelledByItsToken) {
    const test::WaveHeights source(test::small_world(3, 1.0), 20.0, 90.0);
    std::stop_source stop;
    stop.request_stop();
    Loads loads;
    const FinishedLoad done = run_load(source, loads.request(kKey), stop.get_token());
    ASSERT_FALSE(done.chunk);
    EXPECT_EQ(done.chunk.error().code, ErrorCode::cancelled);
    EXPECT_EQ(source.sample_count, 0);
    EXPECT_EQ(loads.bytes(), 0u);
}

}  // namespace terrane::run_load_test
