// SPDX-License-Identifier: MIT
#include "remote_files.h"
#include "store/test_files.h"

#include <algorithm>
#include <filesystem>
#include <future>
#include <latch>
#include <random>
#include <set>

namespace terrane::http_files_test {

using namespace test;

constexpr std::uint64_t kFileBytes = 40 * kBlock + 123;

class HttpFilesTest : public testing::Test {
protected:
    // Proxies of the environment are not for the loopback.
    static void SetUpTestSuite() { setenv("no_proxy", "127.0.0.1,localhost", 1); }
    void SetUp() override { server_.put(kShard, file_of(kFileBytes)); }

    HttpServer server_;
};

TEST_F(HttpFilesTest, ReadsWholeFiles) {
    server_.put("terrain.json", {'{', '}'});
    server_.put("empty", {});
    const auto files = open_files(server_.url() + "terrain.json");
    EXPECT_EQ(files->place(), server_.url());
    EXPECT_TRUE(files->is_slow());
    EXPECT_TRUE(server_.requests().empty());  // opening asks for nothing
    EXPECT_EQ(files->read_whole("terrain.json", 2).value(), (std::vector<std::uint8_t>{'{', '}'}));
    server_.put("terrain.json", {'{', ' ', '}'});
    EXPECT_EQ(files->read_whole("terrain.json", 3).value().size(), 3u);  // not from a cache
    const auto too_long = files->read_whole("terrain.json", 2);
    ASSERT_FALSE(too_long.has_value());
    EXPECT_EQ(too_long.error().code, ErrorCode::bad_data);
    EXPECT_EQ(too_long.error().message,
              "cannot read \"" + server_.url() + "terrain.json\": it has 3 bytes, more than 2");
    EXPECT_TRUE(files->read_whole("empty", 0).value().empty());
    EXPECT_EQ(files->read_whole(kShard, kFileBytes).value(), file_of(kFileBytes));
    EXPECT_EQ(files->read_whole("../terrain.json", 9).error().code, ErrorCode::bad_data);
}

TEST_F(HttpFilesTest, SendsWhatTheSettingsSay) {
    HttpSettings settings = quick_settings();
    settings.user_agent = "simulator/2";
    settings.authorization = "Bearer 123";
    const std::string port = std::to_string(server_.port());
    const auto files = open_files("http://127.0.0.1:" + port + "/world/?key=9", settings);
    EXPECT_EQ(read_one(*files, 0, 5, kFileBytes), "");
    const auto with_user = open_files("http://me:word@127.0.0.1:" + port + "/world/terrain.json");
    EXPECT_EQ(read_one(*with_user, 0, 5, kFileBytes), "");
    const auto requests = server_.requests();
    ASSERT_EQ(requests.size(), 2u);
    EXPECT_EQ(requests[0].target, "/world/" + kShard + "?key=9");
    EXPECT_EQ(requests[0].headers.at("user-agent"), "simulator/2");
    EXPECT_EQ(requests[0].headers.at("authorization"), "Bearer 123");
    EXPECT_EQ(requests[0].headers.at("accept-encoding"), "identity");
    EXPECT_EQ(requests[0].headers.at("range"), "bytes=0-4095");
    EXPECT_EQ(requests[1].headers.at("authorization"), "Basic bWU6d29yZA==");
    server_.fail_always(kShard, {.status = 403, .text = {}});
    for (const auto& each : {files, with_user}) {
        const std::string error = read_one(*each, 3 * kBlock, 5, kFileBytes);
        EXPECT_EQ(error, "cannot read \"" + server_.url() + kShard + "\": status 403 (forbidden)");
        EXPECT_EQ(each->place(), server_.url());
    }
}

TEST_F(HttpFilesTest, ReadsAnyRange) {
    const auto files = open_files(server_.url());
    for (const auto& [offset, size] :
         std::vector<std::pair<std::uint64_t, std::size_t>>{{0, 0},
                                                            {kFileBytes, 0},
                                                            {0, 1},
                                                            {kFileBytes - 1, 1},
                                                            {kBlock - 1, 2},
                                                            {kBlock, kBlock},
                                                            {5, 3 * kBlock},
                                                            {kFileBytes - 200, 200},
                                                            {0, kFileBytes}}) {
        EXPECT_EQ(read_one(*files, offset, size, kFileBytes), "") << offset << ", " << size;
    }
    EXPECT_TRUE(files->read({}, {}).has_value());
}

TEST_F(HttpFilesTest, ReadsFilesOfNoAndOneByte) {
    const auto files = open_files(server_.url());
    server_.put(kShard, {});
    EXPECT_EQ(read_one(*files, 0, 0, 0), "");
    EXPECT_TRUE(server_.requests().empty());
    server_.put(kShard, file_of(1));
    EXPECT_EQ(read_one(*files, 0, 1, 1), "");
}

TEST_F(HttpFilesTest, RefusesRangesOutsideTheFile) {
    const auto files = open_files(server_.url());
    for (const auto& [offset, size] :
         std::vector<std::pair<std::uint64_t, std::size_t>>{{kFileBytes, 1},
                                                            {kFileBytes - 1, 2},
                                                            {~std::uint64_t{0}, 1},
                                                            {~std::uint64_t{0}, 0}}) {
        EXPECT_NE(read_one(*files, offset, size, kFileBytes).find("bytes"), std::string::npos);
        EXPECT_FALSE(files->discard(Read(offset, size, kFileBytes).range()));
    }
    EXPECT_TRUE(server_.requests().empty());
}

TEST_F(HttpFilesTest, MergesNeighbouringBlocksOfOneRead) {
    const auto files = open_files(server_.url());
    // 100 ranges in blocks 2 to 9, and one in block 20: three requests, as one has four blocks at most.
    std::vector<Read> reads;
    for (std::uint64_t i = 0; i < 100; ++i) {
        reads.emplace_back(2 * kBlock + (i * 77 % 100) * 8 * kBlock / 100, 300, kFileBytes);
    }
    reads.emplace_back(20 * kBlock + 7, 9, kFileBytes);
    std::vector<FileRange> ranges;
    for (const Read& read : reads) ranges.push_back(read.range());
    // One range of the 100 begins in the last 300 bytes of block 9 at most, so none needs block 10.
    ASSERT_TRUE(files->read(ranges, {}).has_value());
    for (const Read& read : reads) EXPECT_TRUE(read.is_right());
    std::set<std::pair<std::uint64_t, std::uint64_t>> sent;
    for (const auto& request : server_.requests()) sent.insert(*request.range);
    EXPECT_EQ(sent,
              (std::set<std::pair<std::uint64_t, std::uint64_t>>{{2 * kBlock, 6 * kBlock - 1},
                                                                 {6 * kBlock, 10 * kBlock - 1},
                                                                 {20 * kBlock, 21 * kBlock - 1}}));
    EXPECT_EQ(files->statistics().requests, 3u);
    EXPECT_EQ(files->statistics().bytes, 9 * kBlock);
    EXPECT_GT(files->statistics().latency, 0.0);
    EXPECT_GT(files->statistics().bandwidth, 0.0);
}

TEST_F(HttpFilesTest, MergesBlocksOfSeveralCallsThatWait) {
    HttpSettings settings = quick_settings();
    settings.connection_count = 1;
    const auto files = open_files(server_.url(), settings);
    server_.hold();
    std::vector<std::future<std::string>> calls;
    const auto read = [&](std::uint64_t block) {
        calls.push_back(std::async(std::launch::async, [&files, block] {
            // Block 30 is requested once; it also tells when the other block is waiting.
            Read first(30 * kBlock, 1, kFileBytes), second(block * kBlock, 1, kFileBytes);
            const std::vector<FileRange> ranges{first.range(), second.range()};
            const auto done = files->read(ranges, {});
            return !done ? done.error().message
                         : (first.is_right() && second.is_right() ? "" : "wrong bytes");
        }));
    };
    calls.push_back(std::async(std::launch::async,
                               [&files] { return read_one(*files, 30 * kBlock, 1, kFileBytes); }));
    ASSERT_TRUE(holds_soon([&] { return server_.requests().size() == 1; }));
    for (const std::uint64_t block : {11u, 10u, 12u, 20u}) {
        read(block);
        ASSERT_TRUE(
            holds_soon([&] { return files->statistics().shared_blocks == calls.size() - 1; }));
    }
    server_.release();
    for (auto& call : calls) EXPECT_EQ(call.get(), "");
    EXPECT_EQ(server_.requests().size(), 3u);  // block 30; blocks 10 to 12; block 20
    EXPECT_EQ(server_.connection_count(), 1);  // and all over one connection
}

TEST_F(HttpFilesTest, CallsShareOneTransfer) {
    const auto files = open_files(server_.url());
    server_.hold();
    std::vector<std::future<std::string>> calls;
    for (int i = 0; i < 8; ++i) {
        calls.push_back(std::async(std::launch::async,
                                   [&files] { return read_one(*files, 100, 5000, kFileBytes); }));
    }
    EXPECT_TRUE(holds_soon([&] { return files->statistics().shared_blocks == 14; }));
    server_.release();
    for (auto& call : calls) EXPECT_EQ(call.get(), "");
    EXPECT_EQ(server_.requests().size(), 1u);
}

TEST_F(HttpFilesTest, RequestsOfOneReadRunAtTheSameTime) {
    HttpSettings settings = quick_settings();
    settings.connection_count = 5;
    const auto files = open_files(server_.url(), settings);
    server_.hold();
    auto call = std::async(std::launch::async, [&] {
        std::vector<Read> reads;
        for (std::uint64_t i = 0; i < 8; ++i) reads.emplace_back(i * 5 * kBlock, 1, kFileBytes);
        std::vector<FileRange> ranges;
        for (const Read& read : reads) ranges.push_back(read.range());
        return files->read(ranges, {}).has_value();
    });
    EXPECT_TRUE(holds_soon([&] { return server_.requests().size() == 5; }));
    server_.release();
    EXPECT_TRUE(call.get());
    EXPECT_EQ(server_.requests().size(), 8u);
    EXPECT_LE(server_.connection_count(), 5);
}

TEST_F(HttpFilesTest, BlocksAreReadFromMemoryAndThenFromDisk) {
    const TemporaryFolder folder;
    HttpSettings settings = quick_settings();
    settings.cache_folder = folder.file("cache");
    {
        const auto files = open_files(server_.url(), settings);
        EXPECT_EQ(read_one(*files, 0, kFileBytes, kFileBytes), "");
        const std::size_t request_count = server_.requests().size();
        EXPECT_EQ(read_one(*files, 0, kFileBytes, kFileBytes), "");
        EXPECT_EQ(server_.requests().size(), request_count);
        EXPECT_EQ(files->statistics().memory_hits, 41u);
        EXPECT_EQ(files->statistics().disk_hits, 0u);
    }
    const std::size_t request_count = server_.requests().size();
    const auto files = open_files(server_.url(), settings);
    EXPECT_EQ(read_one(*files, 0, kFileBytes, kFileBytes), "");
    EXPECT_EQ(server_.requests().size(), request_count);
    EXPECT_EQ(files->statistics().disk_hits, 41u);
    EXPECT_EQ(files->statistics().requests, 0u);
    EXPECT_EQ(files->statistics().cache_faults, 0u);
}

TEST_F(HttpFilesTest, TwoObjectsShareTheDiskCache) {
    const TemporaryFolder folder;
    HttpSettings settings = quick_settings();
    settings.cache_folder = folder.path();
    const auto first = open_files(server_.url(), settings),
               second = open_files(server_.url(), settings);
    EXPECT_EQ(read_one(*first, 0, 4 * kBlock, kFileBytes), "");
    EXPECT_EQ(read_one(*second, 0, 8 * kBlock, kFileBytes), "");
    EXPECT_EQ(read_one(*first, 0, 8 * kBlock, kFileBytes), "");
    EXPECT_EQ(server_.requests().size(), 2u);
    EXPECT_EQ(first->statistics().disk_hits, 4u);
    EXPECT_EQ(second->statistics().disk_hits, 4u);
}

TEST_F(HttpFilesTest, MemoryHasACeiling) {
    HttpSettings settings = quick_settings();
    settings.memory_bytes = settings.request_bytes;  // four blocks
    settings.connection_count = 1;                   // one after the other
    const auto files = open_files(server_.url(), settings);
    EXPECT_EQ(read_one(*files, 0, 8 * kBlock, kFileBytes), "");
    EXPECT_EQ(read_one(*files, 4 * kBlock, 4 * kBlock, kFileBytes), "");
    EXPECT_EQ(files->statistics().memory_hits, 4u);
    EXPECT_EQ(read_one(*files, 0, 4 * kBlock, kFileBytes), "");
    EXPECT_EQ(files->statistics().memory_hits, 4u);
    EXPECT_EQ(files->statistics().requests, 3u);
}

TEST_F(HttpFilesTest, DiscardDropsBlocksFromMemoryAndDisk) {
    const TemporaryFolder folder;
    HttpSettings settings = quick_settings();
    settings.cache_folder = folder.path();
    server_.fail_next(kShard, {{.kind = ServerFault::Kind::wrong_bytes, .text = {}}});
    const auto files = open_files(server_.url(), settings);
    EXPECT_EQ(read_one(*files, 10, 50, kFileBytes), "");  // the first byte of the block is wrong
    EXPECT_EQ(read_one(*files, 0, 50, kFileBytes), "wrong bytes");
    EXPECT_EQ(read_one(*open_files(server_.url(), settings), 0, 50, kFileBytes), "wrong bytes");
    EXPECT_TRUE(files->discard(Read(0, 50, kFileBytes).range()));
    EXPECT_EQ(read_one(*files, 0, 50, kFileBytes), "");
    EXPECT_EQ(read_one(*open_files(server_.url(), settings), 0, 50, kFileBytes), "");
    EXPECT_EQ(server_.requests().size(), 2u);
    EXPECT_EQ(files->statistics().discarded, 1u);
}

TEST_F(HttpFilesTest, DamagedBlocksOfTheDiskAreReadAgain) {
    const TemporaryFolder folder;
    HttpSettings settings = quick_settings();
    settings.cache_folder = folder.path();
    EXPECT_EQ(read_one(*open_files(server_.url(), settings), 0, 8 * kBlock, kFileBytes), "");
    int damaged_count = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder.path())) {
        if (!entry.is_regular_file() || damaged_count == 3) continue;
        std::vector<char> bytes = read_file(entry.path());
        bytes[1000] = static_cast<char>(bytes[1000] ^ 4);
        write_file(entry.path(), bytes);
        ++damaged_count;
    }
    const auto files = open_files(server_.url(), settings);
    EXPECT_EQ(read_one(*files, 0, 8 * kBlock, kFileBytes), "");
    EXPECT_EQ(files->statistics().damaged_blocks, 3u);
    EXPECT_EQ(files->statistics().disk_hits, 5u);
    EXPECT_EQ(files->statistics().bytes, 3 * kBlock);
}

TEST_F(HttpFilesTest, ADiskThatCannotBeWrittenIsNoFailure) {
    const TemporaryFolder folder;
    write_file(folder.file("file"), {'x'});
    HttpSettings settings = quick_settings();
    settings.cache_folder = folder.file("file");
    const auto files = open_files(server_.url(), settings);
    EXPECT_EQ(read_one(*files, 0, 4 * kBlock, kFileBytes), "");
    EXPECT_EQ(files->statistics().cache_faults, 4u);
    EXPECT_EQ(failure_count(files->statistics().failures), 0u);
}

TEST_F(HttpFilesTest, AStopEndsTheTransfer) {
    const auto files = open_files(server_.url());
    server_.fail_always(kShard, {.kind = ServerFault::Kind::drip, .text = {}});
    std::stop_source stop;
    const Read read(0, 10, kFileBytes);
    const FileRange& range = read.range();
    auto call = std::async(std::launch::async, [&] {
        return files->read({&range, 1}, stop.get_token());
    });
    ASSERT_TRUE(holds_soon([&] { return server_.requests().size() == 1; }));
    stop.request_stop();
    const auto done = call.get();
    ASSERT_FALSE(done.has_value());
    EXPECT_EQ(done.error().code, ErrorCode::cancelled);
    EXPECT_TRUE(holds_soon([&] { return server_.aborted_count() == 1; }));  // the socket is closed
    EXPECT_EQ(files->statistics().cancelled, 1u);
    // After the stop nothing is requested.
    EXPECT_EQ(files->read({&range, 1}, stop.get_token()).error().code, ErrorCode::cancelled);
    EXPECT_EQ(server_.requests().size(), 1u);
}

TEST_F(HttpFilesTest, AStopLeavesTheTransferToOtherCalls) {
    const auto files = open_files(server_.url());
    server_.hold();
    std::stop_source stop;
    const Read read(0, 10, kFileBytes);
    const FileRange& range = read.range();
    auto stopped = std::async(std::launch::async, [&] {
        return files->read({&range, 1}, stop.get_token());
    });
    ASSERT_TRUE(holds_soon([&] { return server_.requests().size() == 1; }));
    auto other =
        std::async(std::launch::async, [&] { return read_one(*files, 5, 10, kFileBytes); });
    ASSERT_TRUE(holds_soon([&] { return files->statistics().shared_blocks == 1; }));
    stop.request_stop();
    EXPECT_EQ(stopped.get().error().code, ErrorCode::cancelled);
    server_.release();
    EXPECT_EQ(other.get(), "");
    EXPECT_EQ(server_.requests().size(), 1u);
    EXPECT_EQ(files->statistics().cancelled, 0u);
}

TEST_F(HttpFilesTest, TheDestructorDoesNotWaitForTransfers) {
    HttpSettings settings = quick_settings();
    settings.read_timeout = 0.02;
    server_.hold();
    auto files = open_files(server_.url(), settings);
    const std::string error = read_one(*files, 0, 10, kFileBytes);
    EXPECT_NE(error.find("no complete answer within 0.02 s"), std::string::npos) << error;
    files.reset();  // at once: the server holds every reply back
    EXPECT_TRUE(holds_soon(
        [&] { return server_.aborted_count() == static_cast<int>(server_.requests().size()); }));
}

TEST_F(HttpFilesTest, ManyThreadsReadAtOnce) {
    const TemporaryFolder folder;
    HttpSettings settings = quick_settings();
    settings.cache_folder = folder.path();
    settings.memory_bytes = 16 * kBlock;
    const auto files = open_files(server_.url(), settings);
    std::latch start(64);
    std::atomic<int> right_count{0};
    {
        std::vector<std::jthread> threads;
        for (std::uint64_t thread = 0; thread < 64; ++thread) {
            threads.emplace_back([&, thread] {
                start.arrive_and_wait();
                for (std::uint64_t i = 0; i < 10; ++i) {
                    const std::uint64_t offset = (thread * 7919 + i * 104729) % (kFileBytes - 9000);
                    if (read_one(*files, offset, 9000, kFileBytes).empty()) ++right_count;
                    if (i == 5) files->discard(Read(offset, 100, kFileBytes).range());
                }
            });
        }
    }
    EXPECT_EQ(right_count, 640);
    EXPECT_EQ(failure_count(files->statistics().failures), 0u);
    EXPECT_LE(server_.connection_count(), 8);
}

TEST(OpenHttp, RefusesSettingsOutOfRange) {
    const auto refused = [](auto change) {
        HttpSettings settings;
        change(settings);
        const auto files = open_http("http://127.0.0.1/", settings);
        return files ? std::string() : files.error().message;
    };
    EXPECT_EQ(refused([](HttpSettings& s) { s.block_bytes = 5000; }),
              "block_bytes must be a power of two, got 5000");
    EXPECT_EQ(refused([](HttpSettings& s) { s.connection_count = 0; }),
              "connection_count must be 1 to 64, got 0");
    EXPECT_NE(refused([](HttpSettings& s) { s.block_bytes = 1024; }), "");
    EXPECT_NE(refused([](HttpSettings& s) { s.request_bytes = s.block_bytes - 1; }), "");
    EXPECT_NE(refused([](HttpSettings& s) { s.memory_bytes = s.request_bytes - 1; }), "");
    EXPECT_NE(refused([](HttpSettings& s) { s.cache_bytes = 63 * s.block_bytes; }), "");
    EXPECT_NE(refused([](HttpSettings& s) { s.connect_timeout = 0.0; }), "");
    EXPECT_NE(refused([](HttpSettings& s) {
                  s.stall_timeout = std::numeric_limits<double>::quiet_NaN();
              }),
              "");
    EXPECT_NE(refused([](HttpSettings& s) { s.read_timeout = 1e9; }), "");
    EXPECT_NE(refused([](HttpSettings& s) { s.retry_count = -1; }), "");
    EXPECT_NE(refused([](HttpSettings& s) { s.first_retry_delay = 0.0; }), "");
    EXPECT_NE(refused([](HttpSettings& s) { s.longest_retry_delay = 0.1; }), "");
    EXPECT_NE(refused([](HttpSettings& s) { s.authorization = "a\r\nHost: b"; }), "");
    EXPECT_NE(refused([](HttpSettings& s) { s.user_agent = "a\n"; }), "");
    EXPECT_EQ(refused([](HttpSettings&) {}), "");
}

// ---- expected ranges

/// A range of so many blocks.
ExpectedRange blocks_at(std::uint64_t first, std::uint64_t count, bool is_later = false) {
    return {kShard, kFileBytes, first * kBlock, count * kBlock, is_later};
}

void expect(const ShardFiles& files, const std::vector<ExpectedRange>& ranges) {
    files.expect(ranges);
}

TEST_F(HttpFilesTest, ReadsExpectedBlocksBeforeTheyAreWanted) {
    const auto files = open_files(server_.url());
    // Neighbours of several ranges are one request.
    expect(*files, {blocks_at(3, 1), blocks_at(2, 1), blocks_at(4, 2)});
    ASSERT_TRUE(holds_soon([&] { return files->statistics().bytes == 4 * kBlock; }));
    EXPECT_EQ(files->statistics().requests, 1u);
    EXPECT_EQ(read_one(*files, 2 * kBlock, 4 * kBlock, kFileBytes), "");
    EXPECT_EQ(files->statistics().requests, 1u);
    EXPECT_EQ(files->statistics().memory_hits, 4u);
    // Blocks in memory are not requested again.
    expect(*files, {blocks_at(2, 4)});
    EXPECT_EQ(read_one(*files, 30 * kBlock, 9, kFileBytes), "");
    EXPECT_EQ(files->statistics().requests, 2u);
}

TEST_F(HttpFilesTest, LaterBlocksAreReadOnlyWithTheirNeighbours) {
    const auto files = open_files(server_.url());
    expect(*files, {blocks_at(10, 1), blocks_at(9, 1, true), blocks_at(11, 2, true),
                    blocks_at(20, 2, true), blocks_at(10, 1, true)});
    ASSERT_TRUE(holds_soon([&] { return files->statistics().bytes == 4 * kBlock; }));
    EXPECT_EQ(read_one(*files, 9 * kBlock, 4 * kBlock, kFileBytes), "");
    EXPECT_EQ(files->statistics().memory_hits, 4u);
    ASSERT_EQ(server_.requests().size(), 1u);
    EXPECT_EQ(server_.requests()[0].range, std::pair(9 * kBlock, 13 * kBlock - 1));
    // A call that waits for one of them is a request, and takes its neighbour along.
    EXPECT_EQ(read_one(*files, 20 * kBlock, 9, kFileBytes), "");
    ASSERT_TRUE(holds_soon([&] { return files->statistics().bytes == 6 * kBlock; }));
    EXPECT_EQ(files->statistics().requests, 2u);
    // What has become urgent is one too.
    expect(*files, {blocks_at(30, 1, true)});
    expect(*files, {blocks_at(30, 1)});
    ASSERT_TRUE(holds_soon([&] { return files->statistics().bytes == 7 * kBlock; }));
}

TEST_F(HttpFilesTest, LaterBlocksAreLeftOutWhereManyRequestsRun) {
    const auto files = open_files(server_.url());
    server_.hold();
    std::vector<ExpectedRange> ranges;
    for (std::uint64_t i = 0; i < 6; ++i) ranges.push_back(blocks_at(6 * i, 1));
    for (std::uint64_t i = 0; i < 6; ++i) ranges.push_back(blocks_at(6 * i + 1, 2, true));
    expect(*files, ranges);
    ASSERT_TRUE(holds_soon([&] { return server_.requests().size() == 6; }));
    server_.release();
    // The first three: then more than two of the eight connections are busy.
    ASSERT_TRUE(holds_soon([&] { return files->statistics().bytes == (6 + 3 * 2) * kBlock; }));
    std::size_t long_count = 0;
    for (const auto& request : server_.requests()) {
        long_count += request.range->second - request.range->first == 3 * kBlock - 1 ? 1u : 0u;
    }
    EXPECT_EQ(long_count, 3u);
}

TEST_F(HttpFilesTest, ARequestThatHasDeliveredABlockIsReadToItsEnd) {
    const auto files = open_files(server_.url());
    server_.fail_next(kShard, {{.kind = ServerFault::Kind::halt, .text = {}}});
    expect(*files, {blocks_at(7, 1), blocks_at(8, 3, true)});
    ASSERT_TRUE(holds_soon([&] { return files->statistics().bytes == 2 * kBlock; }));
    EXPECT_EQ(read_one(*files, 7 * kBlock, kBlock, kFileBytes), "");
    expect(*files, {});
    EXPECT_EQ(read_one(*files, 20 * kBlock, 9, kFileBytes), "");  // requested after expect()
    server_.release();
    ASSERT_TRUE(holds_soon([&] { return files->statistics().bytes == 5 * kBlock; }));
    EXPECT_EQ(read_one(*files, 8 * kBlock, 3 * kBlock, kFileBytes), "");
    EXPECT_EQ(files->statistics().requests, 2u);
    EXPECT_EQ(files->statistics().cancelled, 0u);
}

TEST_F(HttpFilesTest, WrongExpectedRangesAreLeftOut) {
    const auto files = open_files(server_.url());
    expect(*files, {{"../secret", 9, 0, 9},
                    {kShard, kFileBytes, kFileBytes + 1, 1},
                    {kShard, kFileBytes, 3, kFileBytes},
                    {kShard, kFileBytes, ~std::uint64_t{0}, ~std::uint64_t{0}},
                    {kShard, kFileBytes, 7, 0},
                    blocks_at(40, 0),
                    {kShard, kFileBytes, 40 * kBlock, 123}});
    ASSERT_TRUE(holds_soon([&] { return files->statistics().bytes == 123; }));
    EXPECT_EQ(server_.requests().size(), 1u);
}

TEST_F(HttpFilesTest, ACallSharesTheRequestOfAnExpectedBlock) {
    const auto files = open_files(server_.url());
    server_.hold();
    expect(*files, {blocks_at(7, 1)});
    ASSERT_TRUE(holds_soon([&] { return server_.requests().size() == 1; }));
    auto call = std::async(std::launch::async,
                           [&] { return read_one(*files, 7 * kBlock + 5, 9, kFileBytes); });
    ASSERT_TRUE(holds_soon([&] { return files->statistics().shared_blocks == 1; }));
    expect(*files, {});  // the call still waits
    server_.release();
    EXPECT_EQ(call.get(), "");
    EXPECT_EQ(server_.requests().size(), 1u);
    EXPECT_EQ(files->statistics().cancelled, 0u);
}

TEST_F(HttpFilesTest, BlocksThatAreExpectedNoMoreAreGivenUp) {
    HttpSettings settings = quick_settings();
    settings.connection_count = 1;
    const auto files = open_files(server_.url(), settings);
    server_.hold();
    expect(*files, {blocks_at(7, 1), blocks_at(20, 1)});
    ASSERT_TRUE(holds_soon([&] { return server_.requests().size() == 1; }));
    expect(*files, {blocks_at(30, 1)});
    ASSERT_TRUE(holds_soon([&] { return files->statistics().cancelled == 1; }));
    server_.release();
    ASSERT_TRUE(holds_soon([&] { return files->statistics().bytes == kBlock; }));
    std::set<std::uint64_t> begins;
    for (const auto& request : server_.requests()) begins.insert(request.range->first / kBlock);
    EXPECT_EQ(begins, (std::set<std::uint64_t>{7, 30})) << "block 20 was never requested";
}

TEST_F(HttpFilesTest, CallsThatWaitComeBeforeExpectedBlocks) {
    HttpSettings settings = quick_settings();
    settings.connection_count = 4;
    const auto files = open_files(server_.url(), settings);
    server_.hold();
    std::vector<ExpectedRange> many;
    for (std::uint64_t i = 0; i < 12; ++i) many.push_back(blocks_at(3 * i, 1));
    expect(*files, many);
    ASSERT_TRUE(holds_soon([&] { return server_.requests().size() == 3; }));
    // One connection is left for calls.
    auto call = std::async(std::launch::async,
                           [&] { return read_one(*files, 38 * kBlock, 9, kFileBytes); });
    ASSERT_TRUE(holds_soon([&] { return server_.requests().size() == 4; }));
    EXPECT_EQ(server_.requests().back().range->first, 38 * kBlock);
    server_.release();
    EXPECT_EQ(call.get(), "");
    ASSERT_TRUE(holds_soon([&] { return files->statistics().bytes == 13 * kBlock; }));
}

TEST_F(HttpFilesTest, AFailingServerIsNotAskedAgainForExpectedBlocks) {
    HttpSettings settings = quick_settings();
    settings.longest_retry_delay = 3600.0;
    const auto files = open_files(server_.url(), settings);
    server_.fail_always(kShard, {.status = 500, .text = {}});
    for (int i = 0; i < 200; ++i) {
        expect(*files, {blocks_at(7, 1), blocks_at(20, 1)});
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_LE(server_.requests().size(), 2u);
    ASSERT_TRUE(holds_soon([&] { return failure_count(files->statistics().failures) > 0; }));
    // A call has its own requests.
    server_.fail_always(kShard, {.kind = ServerFault::Kind::wrong_bytes, .text = {}});
    EXPECT_EQ(read_one(*files, 7 * kBlock, 9, kFileBytes), "wrong bytes");
}

TEST_F(HttpFilesTest, ExpectedBlocksReachTheDiskCacheAndComeFromIt) {
    const TemporaryFolder folder;
    HttpSettings settings = quick_settings();
    settings.cache_folder = folder.file("cache");
    {
        const auto files = open_files(server_.url(), settings);
        expect(*files, {blocks_at(7, 2)});
        ASSERT_TRUE(holds_soon([&] { return files->statistics().bytes == 2 * kBlock; }));
        EXPECT_EQ(read_one(*files, 7 * kBlock, 2 * kBlock, kFileBytes), "");
    }
    const auto files = open_files(server_.url(), settings);
    expect(*files, {blocks_at(7, 2)});
    EXPECT_EQ(read_one(*files, 7 * kBlock, 2 * kBlock, kFileBytes), "");
    EXPECT_EQ(files->statistics().requests, 0u);
    EXPECT_EQ(files->statistics().disk_hits, 2u);
}

TEST_F(HttpFilesTest, RandomExpectationsAndCallsGiveTheRightBytes) {
    const TemporaryFolder folder;
    HttpSettings settings = quick_settings();
    settings.memory_bytes = 8 * kBlock;
    settings.cache_folder = folder.file("cache");
    settings.connection_count = 3;
    const auto files = open_files(server_.url(), settings);
    std::vector<std::future<int>> threads;
    for (unsigned seed = 0; seed < 4; ++seed) {
        threads.push_back(std::async(std::launch::async, [&files, seed] {
            std::minstd_rand random(seed + 1);
            int wrong = 0;
            for (int i = 0; i < 150; ++i) {
                std::vector<ExpectedRange> ranges;
                for (auto k = random() % 6; k > 0; --k) {
                    ranges.push_back(blocks_at(random() % 36, 1 + random() % 4, random() % 2 == 0));
                }
                if (seed % 2 == 0) expect(*files, ranges);
                std::stop_source stop;
                const Read read(random() % (36 * kBlock), 1 + random() % (3 * kBlock), kFileBytes);
                const FileRange& range = read.range();
                if (random() % 8 == 0) stop.request_stop();
                const auto done = files->read({&range, 1}, stop.get_token());
                if (done ? !read.is_right() : done.error().code != ErrorCode::cancelled) ++wrong;
            }
            return wrong;
        }));
    }
    for (auto& thread : threads) EXPECT_EQ(thread.get(), 0);
}

}  // namespace terrane::http_files_test
