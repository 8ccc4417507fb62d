// SPDX-License-Identifier: MIT
//
// ThreadLoader with storage that hangs. Loads that do not hang are much faster than the timeout.
#include "loads.h"
#include "support/heights/faulty_heights.h"
#include "support/heights/wave_heights.h"

#include <terrane/terrain/chunk_loader.h>

#include <gtest/gtest.h>
#include <pthread.h>

#include <limits>

namespace terrane {
namespace hung_storage_test {

using test::Fault;
using test::FaultRule;
using test::FaultyHeights;
using test::keys_of;
using test::Loads;

constexpr ChunkKey kA{0, 0, 3}, kB{1, 0, 3}, kC{2, 0, 3}, kD{3, 0, 3};

std::shared_ptr<FaultyHeights> hills(std::vector<FaultRule> plan) {
    return std::make_shared<FaultyHeights>(
        std::make_shared<test::WaveHeights>(test::small_world(3, 1.0), 20.0, 90.0),
        std::move(plan));
}

std::unique_ptr<ThreadLoader> loader_of(std::shared_ptr<const HeightSource> source,
                                        int worker_count, double timeout = 0.5) {
    return ThreadLoader::create(std::move(source),
                                {.worker_count = worker_count, .timeout = timeout})
        .value();
}

void expect_timed_out(const FinishedLoad& load, const ChunkKey& key) {
    EXPECT_EQ(load.key, key);
    ASSERT_FALSE(load.chunk);
    EXPECT_EQ(load.chunk.error().code, ErrorCode::timed_out);
    EXPECT_EQ(load.bytes_read, 0u);
}

// The detached thread releases its claim and then the source.
void expect_all_back(const Loads& loads, const std::shared_ptr<FaultyHeights>& source) {
    loads.wait_for_bytes(0);
    while (source.use_count() > 1) std::this_thread::yield();
}

TEST(HungStorage, IsReportedAndItsThreadReplaced) {
    const auto source = hills({{.fault = Fault::hang, .chunk = kA}});
    Loads loads;
    auto loader = loader_of(source, 1);
    loader->queue(loads.requests({kA, kB}));
    const std::vector<FinishedLoad> finished = Loads::take(*loader, 2);
    expect_timed_out(finished[0], kA);
    EXPECT_EQ(finished[0].chunk.error().message, "chunk (0, 0) of level 3 was not read in 0.5 s");
    EXPECT_GE(finished[0].seconds, 0.5);
    EXPECT_EQ(finished[1].key, kB);
    ASSERT_TRUE(finished[1].chunk);
    // its claim is held until the storage answers
    const std::size_t own = (*finished[1].chunk)->bytes();
    EXPECT_EQ(loads.bytes(), Loads::waiting_bytes(1) + own);
    source->release();
    loads.wait_for_bytes(own);
    EXPECT_TRUE(loader->take_finished().empty());
    // the same key again, on the remaining thread
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
    for (int i = 0; i < 100; ++i) {  // nothing can begin, so wait() returns
        loader->wait();
        EXPECT_TRUE(loader->take_finished().empty());
    }
    std::vector<LoadRequest> waiting = loader->take_queue();
    EXPECT_EQ(keys_of(waiting), (std::vector<ChunkKey>{{4, 0, 3}, {5, 0, 3}}));
    EXPECT_EQ(loads.bytes(), Loads::waiting_bytes(6));
    loader->queue(std::move(waiting));
    source->release();
    loads.wait_for_bytes(Loads::waiting_bytes(2));
    // threads may be replaced again; on a stalled machine they may time out
    EXPECT_EQ(Loads::take(*loader, 2).size(), 2u);
    loader.reset();
    expect_all_back(loads, source);
}

TEST(HungStorage, DoesNotBlockItsOwner) {
    const auto source = hills({{.fault = Fault::hang}});
    Loads loads;
    const auto loader = loader_of(source, 2, 1000.0);
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
    auto loader = loader_of(source, 2, 1000.0);
    loader->queue(loads.requests({kA, kB, kC, kD}));
    source->wait_for_hung(2);
    loader.reset();
    EXPECT_EQ(loads.bytes(), Loads::waiting_bytes(2));  // queued claims were released
    const int questions = source->question_count();
    source->release();
    expect_all_back(loads, source);
    EXPECT_EQ(source->question_count(), questions);  // it was cancelled
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

// Answers within the second that the destructor waits.
TEST(HungStorage, IsWaitedForUpToASecond) {
    const auto source = hills({{.fault = Fault::hang}});
    Loads loads;
    auto loader = loader_of(source, 3, 1000.0);
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
        // all hang: releases them, and the next ones hang again
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

// While it lives, no thread can start: its stack size exceeds all memory.
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
    auto loader = loader_of(source, 2);
    {
        const NoThreads none;
        const auto refused = ThreadLoader::create(source, {.worker_count = 3});
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::out_of_memory);
        EXPECT_EQ(refused.error().message.find("loader thread 1 of 3 cannot start: "), 0u);
        loader->queue(loads.requests({kA}));
        expect_timed_out(Loads::take(*loader, 1).front(), kA);
        loader->queue(loads.requests({kB, kC}));  // another thread is left
        for (const FinishedLoad& load : Loads::take(*loader, 2)) EXPECT_TRUE(load.chunk);
    }
    // the lost one is replaced as soon as a thread can start: two at once again
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

}  // namespace hung_storage_test
}  // namespace terrane
