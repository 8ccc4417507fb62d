// SPDX-License-Identifier: MIT
#include "loads.h"
#include "support/heights/faulty_heights.h"
#include "support/heights/wave_heights.h"

#include <terrane/terrain/chunk_loader.h>

#include <gtest/gtest.h>

#include <stop_token>

namespace terrane {
namespace run_load_test {

using test::Fault;
using test::FaultyHeights;
using test::Loads;

constexpr ChunkKey kKey{1, 2, 3};

TEST(RunLoad, GivesTheChunkWithItsClaimAndReleasesThatOfAFailedLoad) {
    struct Case {
        Fault fault;
        std::optional<ErrorCode> code;
    };
    for (const Case& tested :
         {Case{Fault::none, std::nullopt}, Case{Fault::read_error, ErrorCode::io},
          Case{Fault::nan, ErrorCode::bad_data}, Case{Fault::no_memory, ErrorCode::out_of_memory},
          Case{Fault::exception, ErrorCode::io}, Case{Fault::odd_exception, ErrorCode::io}}) {
        const FaultyHeights source(
            std::make_shared<test::WaveHeights>(test::small_world(3, 1.0), 20.0, 90.0),
            {{.fault = tested.fault}});
        Loads loads;
        FinishedLoad done = run_load(source, loads.request(kKey));
        EXPECT_EQ(done.key, kKey);
        if (tested.code) {
            ASSERT_FALSE(done.chunk) << static_cast<int>(tested.fault);
            EXPECT_EQ(done.chunk.error().code, *tested.code);
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

}  // namespace run_load_test
}  // namespace terrane
