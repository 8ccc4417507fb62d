// SPDX-License-Identifier: MIT
#include "support/faulty_heights.h"

#include "support/grounds.h"

#include <terrane/terrain/chunk.h>

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
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

namespace terrane::file_heights_test {

using namespace test;

constexpr ChunkKey kSouth{0, -2, 1}, kNorth{0, 1, 1};

class FileHeightsTest : public testing::Test {
protected:
    void SetUp() override { ASSERT_TRUE(FileHeights::write(path_, *ground_)); }
    void TearDown() override { std::filesystem::remove(path_); }

    Error error(const ChunkKey& key) const {
        const auto made = make_chunk(source_, key);
        EXPECT_FALSE(made);
        return made ? Error{} : made.error();
    }

    const std::string path_ =
        testing::TempDir() + "terrane_file_heights_" + std::to_string(getpid());
    const std::shared_ptr<const HeightSource> ground_ =
        std::make_shared<test::WaveHeights>(test::small_world(1, 1.0), 20.0, 90.0);
    FileHeights source_{path_, ground_};
};

TEST_F(FileHeightsTest, GivesTheChunksOfItsGround) {
    for (const ChunkKey key : {ChunkKey{-1, -1, 0}, ChunkKey{0, 0, 0}, kSouth, kNorth}) {
        const auto expected = make_chunk(*ground_, key).value(),
                   got = make_chunk(source_, key).value();
        EXPECT_EQ(got->heights, expected->heights);
        EXPECT_EQ(got->vertex_reach.low, expected->vertex_reach.low);
    }
}

TEST_F(FileHeightsTest, TellsAFileThatEndsEarlyFromRowsThatAreThere) {
    std::filesystem::resize_file(path_, FileHeights::row_offset(ground_->lattice(), 100) + 5);
    EXPECT_EQ(error(kNorth).code, ErrorCode::bad_data);
    EXPECT_NE(error(kNorth).message.find("ends in the row of y = 126"), std::string::npos);
    EXPECT_TRUE(make_chunk(source_, kSouth));
    std::filesystem::resize_file(path_, 0);
    EXPECT_EQ(error(kSouth).code, ErrorCode::bad_data);
    ASSERT_TRUE(FileHeights::write(path_, *ground_));
    EXPECT_TRUE(make_chunk(source_, kNorth));
}

TEST_F(FileHeightsTest, FindsEachByteThatIsChanged) {
    for (const std::size_t byte : {0u, 777u, 4103u, 4104u, 4111u}) {  // 4104, 4111: checksum
        ASSERT_TRUE(FileHeights::write(path_, *ground_));
        std::fstream file(path_, std::ios::binary | std::ios::in | std::ios::out);
        const auto place =
            static_cast<std::streamoff>(FileHeights::row_offset(ground_->lattice(), 200) + byte);
        file.seekg(place);
        const int before = file.get();
        file.seekp(place);
        file.put(static_cast<char>(before ^ 4));
        file.close();
        EXPECT_EQ(error(kNorth).code, ErrorCode::bad_data) << byte;
        EXPECT_NE(error(kNorth).message.find("corrupt in the row of y = 200"), std::string::npos);
        EXPECT_TRUE(make_chunk(source_, kSouth));
    }
}

TEST_F(FileHeightsTest, FailsWithoutPermissionAlsoForRoot) {
    using std::filesystem::perms;
    std::filesystem::permissions(path_, perms::none);
    source_.opens_as_nobody = geteuid() == 0;
    EXPECT_EQ(error(kNorth).code, ErrorCode::io);
    EXPECT_NE(error(kNorth).message.find("Permission denied"), std::string::npos);
    std::filesystem::permissions(path_, perms::owner_read | perms::group_read | perms::others_read);
    EXPECT_TRUE(make_chunk(source_, kNorth));
}

TEST_F(FileHeightsTest, FailsWithoutHandlesAndWithoutAFile) {
    {
        const test::NoFileHandles none;
        EXPECT_EQ(error(kNorth).code, ErrorCode::io);
        EXPECT_NE(error(kNorth).message.find("Too many open files"), std::string::npos);
    }
    EXPECT_TRUE(make_chunk(source_, kNorth));
    std::filesystem::remove(path_);
    EXPECT_EQ(error(kNorth).code, ErrorCode::io);
}

}  // namespace terrane::file_heights_test
