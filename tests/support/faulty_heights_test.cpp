// SPDX-License-Identifier: MIT
#include "support/faulty_heights.h"

#include "support/grounds.h"

#include <terrane/terrain/chunk.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <new>
#include <stdexcept>
#include <thread>

namespace terrane::faulty_heights_test {

using namespace test;

constexpr ChunkKey kKey{-1, 1, 1};

std::shared_ptr<const HeightSource> hills() {
    return std::make_shared<test::WaveHeights>(test::small_world(3, 1.0), 20.0, 90.0);
}

ErrorCode code_of(const FaultRule& rule) {
    const FaultyHeights source(hills(), {rule});
    const auto made = make_chunk(source, kKey);
    return made ? ErrorCode::device_unavailable : made.error().code;  // the latter: none of them
}

TEST(FaultyHeights, GivesWhatItsGroundGivesWhereNoRuleHolds) {
    const auto ground = hills();
    const FaultyHeights source(ground, {{.fault = Fault::read_error, .chunk = ChunkKey{0, 0, 1}}});
    const auto expected = make_chunk(*ground, kKey).value(), got = make_chunk(source, kKey).value();
    EXPECT_EQ(got->heights, expected->heights);
    EXPECT_EQ(got->cell_bounds, expected->cell_bounds);
    EXPECT_EQ(make_chunk(source, {0, 0, 1}).error().code, ErrorCode::io);
    EXPECT_EQ(source.sampled(), (std::vector<ChunkKey>{kKey, {0, 0, 1}}));
    EXPECT_EQ(source.question_count(), 4);  // samples, bounds and flags; then samples
}

TEST(FaultyHeights, BreaksEachQuestionInEachWay) {
    for (const Question question : {Question::sample, Question::bounds, Question::flags}) {
        const auto of = [&](Fault fault) {
            return code_of({.fault = fault, .question = question});
        };
        EXPECT_EQ(of(Fault::read_error), ErrorCode::io);
        EXPECT_EQ(of(Fault::permission_denied), ErrorCode::io);
        EXPECT_EQ(of(Fault::truncated), ErrorCode::bad_data);
        EXPECT_THROW(of(Fault::no_memory), std::bad_alloc);
        EXPECT_THROW(of(Fault::exception), std::runtime_error);
        EXPECT_THROW(of(Fault::odd_exception), int);
        if (question != Question::flags) {
            EXPECT_EQ(of(Fault::nan), ErrorCode::bad_data);
        }
    }
    EXPECT_EQ(code_of({.fault = Fault::too_high}), ErrorCode::bad_data);
}

TEST(FaultyHeights, FindsTheChunkOfEachGridOfRootsToo) {
    for (const ChunkKey key : {ChunkKey{-1, 0, 0}, ChunkKey{0, -1, 0}, ChunkKey{-8, 7, 3}}) {
        FaultyHeights source(hills(), {{.fault = Fault::read_error,
                                        .question = Question::bounds,
                                        .chunk = key,
                                        .passes = key.level == 0 ? 6 : 0}});
        EXPECT_FALSE(make_chunk(source, key));
        for (const ChunkKey other : {ChunkKey{-1, -1, 0}, ChunkKey{-8, 6, 3}}) {
            EXPECT_TRUE(make_chunk(source, other));
        }
    }
}

TEST(FaultyHeights, CountsWhatItLetsThroughAndWhatItBreaks) {
    FaultyHeights source(
        hills(),
        {{.fault = Fault::read_error, .question = Question::sample, .passes = 2, .times = 3}});
    std::vector<bool> made;
    for (int i = 0; i < 7; ++i) made.push_back(make_chunk(source, kKey).has_value());
    EXPECT_EQ(made, (std::vector<bool>{true, true, false, false, false, true, true}));
}

TEST(FaultyHeights, BreaksGridsThatTouchAnArea) {
    const FaultyHeights source(hills(),
                               {{.fault = Fault::read_error, .area = WorldRect{10, 10, 20, 20}}});
    EXPECT_FALSE(make_chunk(source, {0, 0, 3}));
    EXPECT_FALSE(make_chunk(source, {0, 0, 0}));
    EXPECT_TRUE(make_chunk(source, {1, 0, 3}));
    EXPECT_TRUE(make_chunk(source, {0, -1, 3}));
}

TEST(FaultyHeights, BreaksTheSameShareWhateverTheOrder) {
    const auto broken = [](bool backwards) {
        const FaultyHeights source(
            hills(), {{.fault = Fault::read_error, .question = Question::sample, .share = 0.3}});
        std::vector<bool> fails(256);
        for (int i = 0; i < 256; ++i) {
            const int place = backwards ? 255 - i : i;
            fails[static_cast<std::size_t>(place)] =
                !make_chunk(source, {place % 16 - 8, place / 16 - 8, 3});
        }
        return fails;
    };
    const std::vector<bool> forwards = broken(false);
    EXPECT_EQ(forwards, broken(true));
    const auto count = std::count(forwards.begin(), forwards.end(), true);
    EXPECT_GT(count, 50);
    EXPECT_LT(count, 105);
}

TEST(FaultyHeights, HangsUntilItIsReleased) {
    FaultyHeights source(hills(), {{.fault = Fault::hang, .times = 1}});
    for (int round = 0; round < 2; ++round) {
        Result<std::shared_ptr<const Chunk>> made;
        std::thread asks([&] { made = make_chunk(source, kKey); });
        source.wait_for_hung(1);
        source.release();
        asks.join();
        EXPECT_TRUE(made && *made);
        EXPECT_TRUE(make_chunk(source, kKey));
        source.set_plan({{.fault = Fault::hang, .times = 1}});
    }
}

}  // namespace terrane::faulty_heights_test
