// SPDX-License-Identifier: MIT
#include "terrain/paging/pager_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <numeric>
#include <stdexcept>

namespace terrane::virtual_loader_test {

using namespace test;

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

ChunkKey key(std::int32_t x) { return {x, 0, 3}; }

Result<std::shared_ptr<const Chunk>> make(const ChunkKey& key) {
    const auto chunk = std::make_shared<Chunk>();
    chunk->key = key;
    return std::shared_ptr<const Chunk>(chunk);
}

// One chunk takes one second at full bandwidth.
double chunk_a_second() { return static_cast<double>(Chunk::max_bytes()); }

class VirtualLoaderTest : public testing::Test {
protected:
    void create(const VirtualStorage& storage) {
        loader_ = VirtualLoader::create(storage, make).value();
    }
    void queue(std::vector<std::int32_t> places) {
        std::vector<ChunkKey> keys;
        for (const std::int32_t x : places) keys.push_back(key(x));
        loader_->queue(loads_.requests(keys));
    }
    // Loads finished up to a time.
    std::vector<FinishedLoad> at(double time_s) {
        loader_->advance(time_s);
        return loader_->take_finished();
    }
    void expect_nothing(double time_s) { EXPECT_TRUE(at(time_s).empty()) << time_s << " s"; }
    void expect(const FinishedLoad& load, std::int32_t x, double seconds) {
        EXPECT_EQ(load.key, key(x));
        ASSERT_TRUE(load.chunk);
        EXPECT_EQ((*load.chunk)->key, key(x));
        EXPECT_DOUBLE_EQ(load.seconds, seconds);
        EXPECT_EQ(load.bytes_read, Chunk::max_bytes());
    }
    void expect(const FinishedLoad& load, std::int32_t x, double seconds, ErrorCode code,
                std::size_t bytes) {
        EXPECT_EQ(load.key, key(x));
        ASSERT_FALSE(load.chunk);
        EXPECT_EQ(load.chunk.error().code, code);
        EXPECT_DOUBLE_EQ(load.seconds, seconds);
        EXPECT_EQ(load.bytes_read, bytes);
    }

    Loads loads_;
    std::unique_ptr<VirtualLoader> loader_;
};

TEST_F(VirtualLoaderTest, DeliversAfterTheLatencyAtItsShareOfTheBandwidth) {
    create({.latency = 0.25, .bandwidth = chunk_a_second(), .slots = 2});
    queue({1});
    EXPECT_EQ(loads_.bytes(), Loads::waiting_bytes(1));
    expect_nothing(1.249);
    auto finished = at(1.25);
    ASSERT_EQ(finished.size(), 1u);
    expect(finished[0], 1, 1.25);
    EXPECT_EQ(loads_.bytes(), (*finished[0].chunk)->bytes());
    // 2 runs alone for half a second and then shares with 3, so that its second half takes a second; then 3, half
    // transferred, runs alone
    at(10.0);
    queue({2});
    at(10.5);
    queue({3});
    expect_nothing(11.749);
    finished = at(11.75);
    ASSERT_EQ(finished.size(), 1u);
    expect(finished[0], 2, 1.75);
    expect_nothing(12.249);
    finished = at(12.25);
    ASSERT_EQ(finished.size(), 1u);
    expect(finished[0], 3, 1.75);
    finished.clear();
    EXPECT_EQ(loads_.bytes(), 0u);
}

TEST_F(VirtualLoaderTest, BeginsNoLoadThatWasTakenBack) {
    create({.latency = 1.0, .slots = 2});
    queue({1, 2, 3, 4});
    loader_->cancel(key(4));  // not started: ignored
    std::vector<LoadRequest> queued = loader_->take_queue();
    EXPECT_EQ(keys_of(queued), (std::vector<ChunkKey>{key(3), key(4)}));
    EXPECT_EQ(keys_of(at(50.0)), (std::vector<ChunkKey>{key(1), key(2)}));
    loader_->wait();
    expect_nothing(60.0);
    EXPECT_EQ(loads_.bytes(), Loads::waiting_bytes(2));
    loader_->queue(std::move(queued));
    EXPECT_EQ(at(70.0).size(), 2u);
    EXPECT_EQ(loads_.bytes(), 0u);
}

TEST_F(VirtualLoaderTest, FailsAfterTheLatencyAndHangsUntilTheTimeout) {
    create({.latency = 0.5, .bandwidth = 1.0, .slots = 1, .failure_share = 1.0});
    queue({1, 2});
    auto finished = at(1.0);
    ASSERT_EQ(finished.size(), 2u);
    expect(finished[0], 1, 0.5, ErrorCode::io, 0);
    expect(finished[1], 2, 0.5, ErrorCode::io, 0);
    create({.latency = 0.5, .slots = 1, .hang_share = 1.0, .timeout = 3.0});
    queue({1, 2});
    expect_nothing(2.999);
    finished = at(1e9);
    ASSERT_EQ(finished.size(), 2u);
    expect(finished[0], 1, 3.0, ErrorCode::timed_out, 0);
    EXPECT_EQ(finished[0].chunk.error().message, "chunk (1, 0) of level 3 was not read in 3 s");
    expect(finished[1], 2, 3.0, ErrorCode::timed_out, 0);
    queue({3});
    at(1e9 + 1.0);
    loader_->cancel(key(99));  // not known: ignored
    loader_->cancel(key(3));
    loader_->cancel(key(3));
    finished = loader_->take_finished();
    ASSERT_EQ(finished.size(), 1u);
    expect(finished[0], 3, 1.0, ErrorCode::cancelled, 0);
    EXPECT_EQ(finished[0].chunk.error().message, "chunk (3, 0) of level 3 was given up");
    EXPECT_EQ(loads_.bytes(), 0u);
}

TEST_F(VirtualLoaderTest, DrawsFailuresBySeedKeyAndNumberOfAttempts) {
    const auto fates = [&](std::uint64_t seed) {
        create({.latency = 1.0,
                .bandwidth = kInfinite,
                .slots = 1024,
                .failure_share = 0.3,
                .hang_share = 0.2,
                .timeout = 7.0,
                .seed = seed});
        std::vector<std::int32_t> places(1000);
        std::iota(places.begin(), places.end(), -500);
        std::vector<ErrorCode> codes;
        for (const double time_s : {10.0, 20.0}) {
            queue(places);
            for (const FinishedLoad& load : at(time_s)) {
                codes.push_back(load.chunk ? ErrorCode::invalid_argument : load.chunk.error().code);
            }
        }
        return codes;
    };
    const std::vector<ErrorCode> codes = fates(1);
    ASSERT_EQ(codes.size(), 2000u);
    EXPECT_EQ(codes, fates(1));
    EXPECT_NE(codes, fates(2));
    const auto count = [&](ErrorCode code) {
        return static_cast<int>(std::count(codes.begin(), codes.end(), code));
    };
    EXPECT_NEAR(count(ErrorCode::io), 600, 105);  // 5 standard deviations
    EXPECT_NEAR(count(ErrorCode::timed_out), 400, 90);
    EXPECT_FALSE(std::equal(codes.begin(), codes.begin() + 1000, codes.begin() + 1000));
}

TEST_F(VirtualLoaderTest, SpreadsLatenciesEvenlyInPowersOfTwo) {
    std::vector<std::int32_t> places(1000);
    std::iota(places.begin(), places.end(), 0);
    const auto latencies = [&](double spread) {
        create({.latency = 3.0, .latency_spread = spread, .bandwidth = kInfinite, .slots = 1024});
        queue(places);
        std::vector<double> seconds;
        for (const FinishedLoad& load : at(1e6)) seconds.push_back(load.seconds);
        return seconds;
    };
    const std::vector<double> narrow = latencies(1.0), wide = latencies(2.5), none = latencies(0.0);
    ASSERT_EQ(wide.size(), 1000u);
    std::vector<int> counts(10);
    for (std::size_t i = 0; i < 1000; ++i) {
        const double s = std::log2(wide[i] / 3.0) / 2.5;
        EXPECT_NEAR(std::log2(narrow[i] / 3.0), s, 1e-14);  // the same random numbers
        EXPECT_EQ(none[i], 3.0);
        ASSERT_GE(s, -1.0 - 1e-14);
        ASSERT_LT(s, 1.0 + 1e-14);
        ++counts[static_cast<std::size_t>(std::clamp(5.0 + 5.0 * s, 0.0, 9.0))];
    }
    for (const int count : counts) EXPECT_NEAR(count, 100, 48);  // 5 standard deviations
}

TEST_F(VirtualLoaderTest, FinishesAtOnceWithoutLatencyAndTransferTime) {
    create({.latency = 0.0, .bandwidth = kInfinite, .slots = 1});
    queue({3, 1, 2});
    EXPECT_TRUE(loader_->take_finished().empty());  // its clock has not advanced
    const auto finished = at(0.0);
    ASSERT_EQ(finished.size(), 3u);
    for (int x = 1; x <= 3; ++x) expect(finished[static_cast<std::size_t>(x - 1)], x, 0.0);
}

TEST_F(VirtualLoaderTest, IgnoresTimesThatAreNotFiniteOrGoBack) {
    create({.latency = 1.0, .bandwidth = kInfinite, .slots = 1});
    queue({1, 2});
    for (const double time_s : {kNan, kInfinite, -kInfinite, -1.0, 0.0}) expect_nothing(time_s);
    EXPECT_EQ(at(1.0).size(), 1u);
    expect_nothing(0.5);
    EXPECT_EQ(at(2.0).size(), 1u);
    expect_nothing(1e9);
    queue({3});
    expect_nothing(1e9 + 0.75);
    auto finished = at(1e9 + 1.0);
    ASSERT_EQ(finished.size(), 1u);
    expect(finished[0], 3, 1.0);
}

TEST_F(VirtualLoaderTest, AdvancesToTheNextCompletionInWait) {
    create({.latency = 1.0, .bandwidth = kInfinite, .slots = 2, .hang_share = 0.0});
    loader_->wait();  // returns at once
    queue({1, 2, 3});
    at(0.25);
    loader_->wait();
    loader_->wait();  // one load has finished
    EXPECT_EQ(keys_of(loader_->take_finished()), (std::vector<ChunkKey>{key(1), key(2)}));
    expect_nothing(0.5);  // its clock is 0.75 s ahead
    expect_nothing(1.0);
    queue({4});
    loader_->wait();
    EXPECT_EQ(keys_of(loader_->take_finished()), std::vector<ChunkKey>{key(3)});
    expect_nothing(1.5);  // 1 s ahead
    const auto finished = at(1.75);
    ASSERT_EQ(finished.size(), 1u);
    expect(finished[0], 4, 1.0);
    create({.latency = 1.0, .slots = 1, .hang_share = 1.0, .timeout = 1e9});
    queue({5});
    loader_->wait();
    EXPECT_EQ(loader_->take_finished().front().chunk.error().code, ErrorCode::timed_out);
}

TEST_F(VirtualLoaderTest, MakesEachChunkOnceWhenItsLoadFinishes) {
    std::vector<ChunkKey> made;
    loader_ =
        VirtualLoader::create({.latency = 1.0, .bandwidth = kInfinite, .slots = 2},
                              [&](const ChunkKey& asked) -> Result<std::shared_ptr<const Chunk>> {
                                  made.push_back(asked);
                                  if (asked == key(2)) return fail(ErrorCode::bad_data, "no");
                                  if (asked == key(3)) throw std::bad_alloc();
                                  if (asked == key(4)) throw std::runtime_error("burns");
                                  return make(asked);
                              })
            .value();
    queue({4, 3, 2, 1});
    at(0.999);
    EXPECT_TRUE(made.empty());
    EXPECT_EQ(at(1.0).size(), 2u);
    loader_->cancel(key(1));
    EXPECT_EQ(loader_->take_finished().size(), 1u);
    queue({1});
    const auto finished = at(5.0);
    EXPECT_EQ(made, (std::vector<ChunkKey>{key(4), key(3), key(2), key(1)}));
    ASSERT_EQ(finished.size(), 2u);
    EXPECT_TRUE(finished[0].chunk);
    EXPECT_EQ(finished[1].chunk.error().code, ErrorCode::bad_data);
    EXPECT_EQ(loads_.bytes(), (*finished[0].chunk)->bytes());
}

TEST_F(VirtualLoaderTest, ReleasesAllBytesWhenDestroyed) {
    create({.latency = 0.5, .bandwidth = chunk_a_second(), .slots = 2, .hang_share = 0.3});
    queue({1, 2, 3, 4, 5, 6, 7, 8});
    loader_->advance(4.0);
    EXPECT_GT(loads_.bytes(), 0u);
    loader_.reset();
    EXPECT_EQ(loads_.bytes(), 0u);
}

TEST_F(VirtualLoaderTest, RefusesSettingsOutOfRange) {
    const auto refuses = [](const VirtualStorage& storage) {
        const auto loader = VirtualLoader::create(storage, make);
        return !loader && loader.error().code == ErrorCode::invalid_argument;
    };
    EXPECT_FALSE(refuses({}));
    EXPECT_FALSE(refuses({.failure_share = 0.9, .hang_share = 0.1}));
    for (const double wrong : {-1.0, kNan, kInfinite, -kInfinite}) {
        EXPECT_TRUE(refuses({.latency = wrong}));
        EXPECT_TRUE(refuses({.latency_spread = wrong}));
        EXPECT_EQ(refuses({.bandwidth = wrong}), wrong != kInfinite);
        EXPECT_TRUE(refuses({.failure_share = wrong}));
        EXPECT_TRUE(refuses({.hang_share = wrong}));
        EXPECT_TRUE(refuses({.timeout = wrong}));
    }
    EXPECT_TRUE(refuses({.bandwidth = 0.0}));
    EXPECT_TRUE(refuses({.slots = 0}));
    EXPECT_TRUE(refuses({.slots = 1025}));
    EXPECT_TRUE(refuses({.failure_share = 0.6, .hang_share = 0.6}));
    EXPECT_TRUE(refuses({.timeout = 0.0}));
    EXPECT_FALSE(VirtualLoader::create({}, nullptr));
}

}  // namespace terrane::virtual_loader_test
