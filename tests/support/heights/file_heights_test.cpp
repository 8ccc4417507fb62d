// SPDX-License-Identifier: MIT
#include "file_heights.h"

#include "wave_heights.h"

#include <terrane/terrain/chunk.h>

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace terrane {
namespace file_heights_test {

using test::FileHeights;

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
    for (const std::size_t byte : {0u, 777u, 4103u, 4104u, 4111u}) {  // the last ones: checksum
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

}  // namespace file_heights_test
}  // namespace terrane
