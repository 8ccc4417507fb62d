// SPDX-License-Identifier: MIT
#include "support/faulty_heights.h"
#include "support/random.h"
#include "terrain/paging/pager_scene.h"

#include <terrane/terrain/composed_heights.h>

#include <gtest/gtest.h>
#include <pthread.h>

#include <limits>
#include <set>

namespace terrane::thread_loader_test {

using namespace test;

constexpr ChunkKey kA{0, 0, 3}, kB{1, 0, 3}, kC{2, 0, 3}, kRoot{0, 0, 0};

std::shared_ptr<FaultyHeights> hills(std::vector<FaultRule> plan = {}) {
    return std::make_shared<FaultyHeights>(
        std::make_shared<test::WaveHeights>(test::small_world(3, 1.0), 20.0, 90.0),
        std::move(plan));
}

std::unique_ptr<ThreadLoader> loader_of(std::shared_ptr<const HeightSource> source,
                                        int worker_count = 1, double timeout = 1000.0) {
    return ThreadLoader::create(std::move(source),
                                {.worker_count = worker_count, .timeout = timeout})
        .value();
}

/// Notes which chunks are expected.
class NotedHeights final : public ForwardedHeights {
public:
    explicit NotedHeights(std::shared_ptr<const HeightSource> heights)
        : ForwardedHeights(std::move(heights)) {}
    void expect_chunks(std::span<const ChunkKey> keys) const override {
        expected.assign(keys.begin(), keys.end());
    }

    mutable std::vector<ChunkKey> expected;
};

TEST(ThreadLoader, ExpectsTheChunksOfLoadsInProgressAndOfTheQueue) {
    const auto hung = hills({{.fault = Fault::hang, .times = 1}});
    const auto source = std::make_shared<NotedHeights>(hung);
    Loads loads;
    auto loader = loader_of(source);
    loader->queue(loads.requests({kA, kB}));
    EXPECT_EQ(source->expected, (std::vector<ChunkKey>{kA, kB}));
    hung->wait_for_hung(1);
    loader->take_queue();
    loader->queue(loads.requests({kC}));
    EXPECT_EQ(source->expected, (std::vector<ChunkKey>{kA, kC}));
    hung->release();
    EXPECT_EQ(Loads::take(*loader, 2).size(), 2u);
    loader->queue({});
    EXPECT_TRUE(source->expected.empty());
    loader->queue(loads.requests({kB}));
    EXPECT_EQ(source->expected, std::vector<ChunkKey>{kB});
    loader.reset();
    EXPECT_TRUE(source->expected.empty());
}

TEST(ThreadLoader, LoadsTheChunksOfMakeChunkInTheOrderOfTheQueue) {
    const auto source = hills();
    Loads loads;
    const auto loader = loader_of(source);
    const std::vector<ChunkKey> keys{kC, kA, kRoot, kB};
    loader->queue(loads.requests(keys));
    std::vector<FinishedLoad> finished = Loads::take(*loader, 4);
    EXPECT_EQ(source->sampled(), keys);
    std::size_t bytes = 0;
    for (const FinishedLoad& load : finished) {
        ASSERT_TRUE(load.chunk);
        const auto expected = make_chunk(*source, load.key).value();
        EXPECT_EQ((*load.chunk)->key, load.key);
        EXPECT_EQ((*load.chunk)->heights, expected->heights);
        EXPECT_EQ((*load.chunk)->cell_bounds, expected->cell_bounds);
        EXPECT_EQ(load.bytes_read, expected->bytes());
        EXPECT_GE(load.seconds, 0.0);
        bytes += expected->bytes();
    }
    EXPECT_EQ(loads.bytes(), bytes);
    finished.clear();
    EXPECT_EQ(loads.bytes(), 0u);
}

TEST(ThreadLoader, ReturnsFinishedLoadsInTheOrderOfKeys) {
    const auto source = hills({{.fault = Fault::hang, .chunk = kRoot}});
    Loads loads;
    const auto loader = loader_of(source);
    loader->queue(loads.requests({kC, kA, kB, kRoot}));
    source->wait_for_hung(1);  // the others have finished
    EXPECT_EQ(keys_of(loader->take_finished()), (std::vector<ChunkKey>{kA, kB, kC}));
    EXPECT_TRUE(loader->take_finished().empty());
    EXPECT_EQ(loads.bytes(), Loads::waiting_bytes(1));
    source->release();
}

TEST(ThreadLoader, RunsAsManyLoadsAtOnceAsItHasThreads) {
    const auto source = hills({{.fault = Fault::hang}});
    Loads loads;
    const auto loader = loader_of(source, 3);
    EXPECT_EQ(loader->slots(), 3);
    loader->queue(loads.requests({kA, kB, kC, kRoot}));
    source->wait_for_hung(3);
    EXPECT_EQ(keys_of(loader->take_queue()), std::vector<ChunkKey>{kRoot});
    EXPECT_EQ(loads.bytes(), Loads::waiting_bytes(3));
    source->release();
    EXPECT_EQ(Loads::take(*loader, 3).size(), 3u);
    EXPECT_EQ(loads.bytes(), 0u);
}

TEST(ThreadLoader, ReportsEachFaultAndReleasesItsBytes) {
    const std::vector<std::pair<Fault, ErrorCode>> faults{
        {Fault::read_error, ErrorCode::io},      {Fault::permission_denied, ErrorCode::io},
        {Fault::truncated, ErrorCode::bad_data}, {Fault::nan, ErrorCode::bad_data},
        {Fault::too_high, ErrorCode::bad_data},  {Fault::no_memory, ErrorCode::out_of_memory},
        {Fault::exception, ErrorCode::io},       {Fault::odd_exception, ErrorCode::io}};
    const auto source = hills();
    Loads loads;
    const auto loader = loader_of(source, 2);
    for (const auto& [fault, code] : faults) {
        SCOPED_TRACE(testing::Message() << "fault " << static_cast<int>(fault));
        source->set_plan({{.fault = fault, .question = Question::sample}});
        loader->queue(loads.requests({kA, kB, kRoot}));
        for (const FinishedLoad& load : Loads::take(*loader, 3)) {
            ASSERT_FALSE(load.chunk);
            EXPECT_EQ(load.chunk.error().code, code);
            EXPECT_FALSE(load.chunk.error().message.empty());
            EXPECT_EQ(load.bytes_read, 0u);
        }
        EXPECT_EQ(loads.bytes(), 0u);
    }
    source->set_plan({});
    loader->queue(loads.requests({kA}));
    EXPECT_TRUE(Loads::take(*loader, 1).front().chunk);
}

TEST(ThreadLoader, BeginsNoLoadThatWasTakenBack) {
    const auto source = hills({{.fault = Fault::hang, .times = 1}});
    Loads loads;
    const auto loader = loader_of(source);
    loader->queue(loads.requests({kA, kC, kB}));
    source->wait_for_hung(1);
    loader->cancel(kB);  // not started: ignored
    std::vector<LoadRequest> queued = loader->take_queue();
    EXPECT_EQ(keys_of(queued), (std::vector<ChunkKey>{kC, kB}));
    source->release();
    EXPECT_EQ(keys_of(Loads::take(*loader, 1)), std::vector<ChunkKey>{kA});
    loader->wait();  // returns at once
    EXPECT_EQ(source->sampled().size(), 1u);
    EXPECT_EQ(loads.bytes(), Loads::waiting_bytes(2));
    loader->queue(std::move(queued));
    for (const FinishedLoad& load : Loads::take(*loader, 2)) EXPECT_TRUE(load.chunk);
    EXPECT_EQ(loads.bytes(), 0u);
}

// A cancelled load ends at the next call of the source.
TEST(ThreadLoader, CancelsALoadThatHasBegun) {
    for (const Question question : {Question::sample, Question::bounds, Question::flags}) {
        const auto source = hills({{.fault = Fault::hang, .question = question, .chunk = kA}});
        Loads loads;
        const auto loader = loader_of(source, 2);
        loader->queue(loads.requests({kA, kB}));
        source->wait_for_hung(1);
        loader->cancel(kA);
        EXPECT_EQ(keys_of(Loads::take(*loader, 1)), std::vector<ChunkKey>{kB});
        EXPECT_TRUE(loader->take_finished().empty());  // the source has not answered yet
        EXPECT_EQ(loads.bytes(), Loads::waiting_bytes(1));
        const int questions = source->question_count();
        source->release();
        const FinishedLoad given_up = std::move(Loads::take(*loader, 1).front());
        EXPECT_EQ(given_up.key, kA);
        ASSERT_FALSE(given_up.chunk);
        EXPECT_EQ(given_up.chunk.error().code, ErrorCode::cancelled);
        EXPECT_EQ(given_up.chunk.error().message, "chunk (0, 0) of level 3 was given up");
        EXPECT_EQ(source->question_count(), questions);
        EXPECT_EQ(loads.bytes(), 0u);
    }
}

TEST(ThreadLoader, IgnoresCancellingFinishedOrUnknownLoads) {
    const auto source = hills({{.fault = Fault::hang, .chunk = kB}});
    Loads loads;
    const auto loader = loader_of(source);
    loader->cancel(kA);
    loader->queue(loads.requests({kA, kB}));
    source->wait_for_hung(1);
    loader->cancel(kA);
    loader->cancel(kC);
    const std::vector<FinishedLoad> finished = loader->take_finished();
    ASSERT_EQ(keys_of(finished), std::vector<ChunkKey>{kA});
    EXPECT_TRUE(finished.front().chunk);
    loader->cancel(kA);
    source->release();
    EXPECT_TRUE(Loads::take(*loader, 1).front().chunk);
}

TEST(ThreadLoader, DoesNotWaitWithoutLoads) {
    const auto loader = loader_of(hills(), 4);
    loader->wait();
    loader->queue({});
    loader->wait();
    EXPECT_TRUE(loader->take_queue().empty());
    EXPECT_TRUE(loader->take_finished().empty());
    loader->advance(std::numeric_limits<double>::quiet_NaN());
}

TEST(ThreadLoader, StopsDuringALoadAndReleasesAllClaims) {
    for (int round = 0; round < 40; ++round) {
        const auto source = hills({{.delay = std::chrono::milliseconds(round % 3)}});
        Loads loads;
        auto loader = loader_of(source, 1 + round % 4);
        loader->queue(loads.requests({kC, kA, kRoot, kB}));
        std::this_thread::sleep_for(std::chrono::milliseconds(round % 8));
        loader.reset();
        ASSERT_EQ(loads.bytes(), 0u) << "round " << round;
        ASSERT_EQ(source.use_count(), 1);
    }
}

TEST(ThreadLoader, RefusesSettingsOutOfRange) {
    const auto refuses = [](std::shared_ptr<const HeightSource> source,
                            const ThreadLoaderSettings& settings) {
        const auto loader = ThreadLoader::create(std::move(source), settings);
        return !loader && loader.error().code == ErrorCode::invalid_argument;
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinite = std::numeric_limits<double>::infinity();
    EXPECT_TRUE(refuses(nullptr, {}));
    EXPECT_TRUE(refuses(hills(), {.worker_count = 0}));
    EXPECT_TRUE(refuses(hills(), {.worker_count = -1}));
    EXPECT_TRUE(refuses(hills(), {.worker_count = 257}));
    EXPECT_TRUE(refuses(hills(), {.timeout = 0.0}));
    EXPECT_TRUE(refuses(hills(), {.timeout = -infinite}));
    EXPECT_TRUE(refuses(hills(), {.timeout = nan}));
    EXPECT_FALSE(refuses(hills(), {.worker_count = 64, .timeout = infinite}));
}

// Random sequences of calls: each load finishes exactly once with its outcome, and all bytes are released.
TEST(ThreadLoader, FinishesEveryLoadOnceUnderRandomCalls) {
    for (const std::uint64_t seed : {1u, 2u, 3u, 4u}) {
        test::SeededRandom random(seed);
        const auto source = hills({{.fault = Fault::read_error, .share = 0.1, .seed = 1},
                                   {.fault = Fault::nan, .share = 0.1, .seed = 2},
                                   {.fault = Fault::exception, .share = 0.05, .seed = 3},
                                   {.fault = Fault::no_memory, .share = 0.05, .seed = 4},
                                   {.delay = std::chrono::milliseconds(1), .share = 0.2}});
        Loads loads;
        const auto loader = loader_of(source, 1 + random.below(4));
        std::set<ChunkKey> under_way, cancelled;
        std::vector<std::shared_ptr<const Chunk>> kept;
        const auto take = [&] {
            for (FinishedLoad& load : loader->take_finished()) {
                EXPECT_EQ(under_way.erase(load.key), 1u);
                if (load.chunk) {
                    EXPECT_EQ((*load.chunk)->key, load.key);
                    if (random.below(4) == 0) kept.push_back(std::move(*load.chunk));
                } else if (load.chunk.error().code == ErrorCode::cancelled) {
                    EXPECT_TRUE(cancelled.contains(load.key));
                }
                cancelled.erase(load.key);
            }
        };
        for (int step = 0; step < 300; ++step) {
            switch (random.below(5)) {
                case 0: {
                    for (const LoadRequest& request : loader->take_queue()) {
                        EXPECT_EQ(under_way.erase(request.key), 1u);
                    }
                    std::vector<ChunkKey> keys;
                    for (int i = random.below(12); i > 0; --i) {
                        const ChunkKey key{random.below(16) - 8, random.below(16) - 8, 3};
                        if (under_way.insert(key).second) keys.push_back(key);
                    }
                    loader->queue(loads.requests(keys));
                    break;
                }
                case 1:
                    for (const ChunkKey& key : under_way) {
                        if (random.below(3) > 0) continue;
                        loader->cancel(key);
                        cancelled.insert(key);
                    }
                    break;
                case 2:
                    loader->wait();
                    break;
                case 3:
                    kept.clear();
                    break;
                default:
                    take();
            }
        }
        while (!under_way.empty()) {
            loader->wait();
            take();
        }
        kept.clear();
        EXPECT_EQ(loads.bytes(), 0u);
    }
}

}  // namespace terrane::thread_loader_test

// ThreadLoader over hanging storage. Loads that do not hang take far less than the timeout.

namespace terrane::hung_storage_test {

using namespace test;
using thread_loader_test::hills;
using thread_loader_test::kA;
using thread_loader_test::kB;
using thread_loader_test::kC;
using thread_loader_test::loader_of;

constexpr ChunkKey kD{3, 0, 3};

void expect_timed_out(const FinishedLoad& load, const ChunkKey& key) {
    EXPECT_EQ(load.key, key);
    ASSERT_FALSE(load.chunk);
    EXPECT_EQ(load.chunk.error().code, ErrorCode::timed_out);
    EXPECT_EQ(load.bytes_read, 0u);
}

// The detached thread releases its claim, then the source.
void expect_all_back(const Loads& loads, const std::shared_ptr<FaultyHeights>& source) {
    loads.wait_for_bytes(0);
    while (source.use_count() > 1) std::this_thread::yield();
}

TEST(HungStorage, IsReportedAndItsThreadReplaced) {
    const auto source = hills({{.fault = Fault::hang, .chunk = kA}});
    Loads loads;
    auto loader = loader_of(source, 1, 0.5);
    loader->queue(loads.requests({kA, kB}));
    const std::vector<FinishedLoad> finished = Loads::take(*loader, 2);
    expect_timed_out(finished[0], kA);
    EXPECT_EQ(finished[0].chunk.error().message, "chunk (0, 0) of level 3 was not read in 0.5 s");
    EXPECT_GE(finished[0].seconds, 0.5);
    EXPECT_EQ(finished[1].key, kB);
    ASSERT_TRUE(finished[1].chunk);
    // the claim is held until the storage returns
    const std::size_t own = (*finished[1].chunk)->bytes();
    EXPECT_EQ(loads.bytes(), Loads::waiting_bytes(1) + own);
    source->release();
    loads.wait_for_bytes(own);
    EXPECT_TRUE(loader->take_finished().empty());
    // the same key again on the remaining thread
    loader->queue(loads.requests({kA}));
    EXPECT_TRUE(Loads::take(*loader, 1).front().chunk);
    loader.reset();
}

TEST(HungStorage, BlocksAtMostTwiceTheWorkersThenLoadsWait) {
    const auto source = hills({{.fault = Fault::hang}});
    Loads loads;
    auto loader = loader_of(source, 2, 0.05);
    loader->queue(loads.requests({kA, kB, kC, kD, {4, 0, 3}, {5, 0, 3}}));
    const std::vector<FinishedLoad> hung = Loads::take(*loader, 4);
    for (const FinishedLoad& load : hung) expect_timed_out(load, load.key);
    source->wait_for_hung(4);
    for (int i = 0; i < 100; ++i) {  // no load can start, so wait() returns
        loader->wait();
        EXPECT_TRUE(loader->take_finished().empty());
    }
    std::vector<LoadRequest> waiting = loader->take_queue();
    EXPECT_EQ(keys_of(waiting), (std::vector<ChunkKey>{{4, 0, 3}, {5, 0, 3}}));
    EXPECT_EQ(loads.bytes(), Loads::waiting_bytes(6));
    loader->queue(std::move(waiting));
    source->release();
    loads.wait_for_bytes(Loads::waiting_bytes(2));
    // threads may be replaced again; on a stalled machine loads may time out
    EXPECT_EQ(Loads::take(*loader, 2).size(), 2u);
    loader.reset();
    expect_all_back(loads, source);
}

TEST(HungStorage, DoesNotBlockItsOwner) {
    const auto source = hills({{.fault = Fault::hang}});
    Loads loads;
    const auto loader = loader_of(source, 2);
    loader->queue(loads.requests({kA, kB, kC}));
    source->wait_for_hung(2);
    for (int i = 0; i < 1000; ++i) {
        loader->advance(i);
        EXPECT_TRUE(loader->take_finished().empty());
        loader->cancel(kA);
        loader->queue(loader->take_queue());
    }
    source->release();
    EXPECT_EQ(Loads::take(*loader, 3).size(), 3u);
    EXPECT_EQ(loads.bytes(), 0u);
}

TEST(HungStorage, TimesOutCancelledLoads) {
    const auto source = hills({{.fault = Fault::hang}});
    Loads loads;
    auto loader = loader_of(source, 1, 0.05);
    loader->queue(loads.requests({kA}));
    source->wait_for_hung(1);
    loader->cancel(kA);
    expect_timed_out(Loads::take(*loader, 1).front(), kA);
    loader->cancel(kA);
    source->release();
    loads.wait_for_bytes(0);
    EXPECT_TRUE(loader->take_finished().empty());
}

TEST(HungStorage, IsDetachedWhenItsLoaderIsDestroyed) {
    const auto source = hills({{.fault = Fault::hang}});
    Loads loads;
    auto loader = loader_of(source, 2);
    loader->queue(loads.requests({kA, kB, kC, kD}));
    source->wait_for_hung(2);
    loader.reset();
    EXPECT_EQ(loads.bytes(), Loads::waiting_bytes(2));  // queued claims were released
    const int questions = source->question_count();
    source->release();
    expect_all_back(loads, source);
    EXPECT_EQ(source->question_count(), questions);  // the load was cancelled
}

TEST(HungStorage, IsNotWaitedForTwice) {
    const auto source = hills({{.fault = Fault::hang, .chunk = kA}});
    Loads loads;
    auto loader = loader_of(source, 1, 0.05);
    loader->queue(loads.requests({kA}));
    expect_timed_out(Loads::take(*loader, 1).front(), kA);
    loader.reset();
    EXPECT_EQ(loads.bytes(), Loads::waiting_bytes(1));
    source->release();
    expect_all_back(loads, source);
}

// The storage returns within the second that the destructor waits.
TEST(HungStorage, IsWaitedForUpToASecond) {
    const auto source = hills({{.fault = Fault::hang}});
    Loads loads;
    auto loader = loader_of(source, 3);
    loader->queue(loads.requests({kA, kB, kC}));
    source->wait_for_hung(3);
    std::thread answers([&] { source->release(); });
    loader.reset();
    answers.join();
    expect_all_back(loads, source);
}

TEST(HungStorage, MayReturnInAnyOrder) {
    const auto source = hills({{.fault = Fault::hang, .share = 0.4}});
    Loads loads;
    auto loader = loader_of(source, 3, 0.1);
    std::vector<ChunkKey> keys;
    for (std::int32_t i = -8; i < 8; ++i) keys.push_back({i, i, 3});
    loader->queue(loads.requests(keys));
    std::size_t ended = 0;
    while (ended < keys.size()) {
        loader->wait();
        const std::vector<FinishedLoad> finished = loader->take_finished();
        ended += finished.size();
        // all loads hang: releases them; later ones hang again
        if (finished.empty()) {
            source->release();
            source->set_plan({{.fault = Fault::hang, .share = 0.4, .seed = ended}});
        }
    }
    EXPECT_EQ(ended, keys.size());
    source->release();
    loader.reset();
    expect_all_back(loads, source);
}

// During its lifetime no thread can start, because its stack would exceed all memory.
class NoThreads {
public:
    NoThreads() {
        pthread_getattr_default_np(&before_);
        pthread_attr_t huge;
        pthread_getattr_default_np(&huge);
        pthread_attr_setstacksize(&huge, std::size_t{1} << 46);
        pthread_setattr_default_np(&huge);
        pthread_attr_destroy(&huge);
    }
    ~NoThreads() {
        pthread_setattr_default_np(&before_);
        pthread_attr_destroy(&before_);
    }
    NoThreads(const NoThreads&) = delete;
    NoThreads& operator=(const NoThreads&) = delete;

private:
    pthread_attr_t before_{};
};

TEST(HungStorage, DoesNotFailIfNoThreadCanStart) {
    const auto source = hills({{.fault = Fault::hang, .chunk = kA}});
    Loads loads;
    auto loader = loader_of(source, 2, 0.5);
    {
        const NoThreads none;
        const auto refused = ThreadLoader::create(source, {.worker_count = 3});
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::out_of_memory);
        EXPECT_EQ(refused.error().message.find("loader thread 1 of 3 cannot start: "), 0u);
        loader->queue(loads.requests({kA}));
        expect_timed_out(Loads::take(*loader, 1).front(), kA);
        loader->queue(loads.requests({kB, kC}));  // one thread is left
        for (const FinishedLoad& load : Loads::take(*loader, 2)) EXPECT_TRUE(load.chunk);
    }
    // the lost thread is replaced once threads can start: two run concurrently again
    source->set_plan({{.fault = Fault::hang, .chunk = kC}});
    loader->queue(loads.requests({kC, kB}));
    std::vector<FinishedLoad> finished = Loads::take(*loader, 2);
    EXPECT_EQ(finished[0].key, kB);
    expect_timed_out(finished[1], kC);
    finished.clear();
    source->release();
    loader.reset();
    expect_all_back(loads, source);
}

}  // namespace terrane::hung_storage_test
