// SPDX-License-Identifier: MIT
#include "store_files.h"

#include <terrane/store/bytes.h>
#include <terrane/store/sealed_file.h>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <limits>

namespace terrane {
namespace sealed_file_test {

using namespace test;

constexpr SealedKind kKind{{'T', 'E', 'S', 'T'}, 3};
const std::vector<std::uint8_t> kDirectory{1, 2, 3, 4};

Result<void> write(const std::string& path, const SealedKind& kind) {
    auto file = SealedWriter::create(path, kind);
    if (!file) return tl::unexpected(file.error());
    return file->commit(kDirectory);
}

TEST(SealedFile, GivesBackWhatWasWritten) {
    const StoreFolder folder;
    const std::string path = folder.file("a");
    auto file = SealedWriter::create(path, kKind);
    ASSERT_TRUE(file.has_value());
    const std::vector<std::uint8_t> record(1000, 7);
    const auto offset = file->append(record);
    ASSERT_TRUE(offset.has_value());
    EXPECT_FALSE(std::filesystem::exists(path)) << "before it is whole";
    ASSERT_TRUE(file->commit(kDirectory).has_value());
    const auto reader = SealedReader::open(path, kKind);
    ASSERT_TRUE(reader.has_value()) << reader.error().message;
    EXPECT_TRUE(std::ranges::equal(reader->directory(), kDirectory));
    std::vector<std::uint8_t> read(record.size());
    ASSERT_TRUE(reader->read(*offset, read).has_value());
    EXPECT_EQ(read, record);
    EXPECT_FALSE(reader->read(reader->bytes() - 1, read).has_value());
    EXPECT_EQ(reader->bytes(), std::filesystem::file_size(path));
    EXPECT_EQ(file->bytes(), reader->bytes());
}

TEST(SealedFile, RefusesOtherKindsAndVersions) {
    const StoreFolder folder;
    const std::string path = folder.file("a");
    ASSERT_TRUE(write(path, kKind).has_value());
    EXPECT_TRUE(SealedReader::is_kind(path, "TEST"));
    EXPECT_FALSE(SealedReader::is_kind(path, "REST"));
    EXPECT_EQ(SealedReader::open(path, {{'R', 'E', 'S', 'T'}, 3}).error().code,
              ErrorCode::bad_data);
    const auto newer = SealedReader::open(path, {kKind.name, 4});
    ASSERT_FALSE(newer.has_value());
    EXPECT_EQ(newer.error().code, ErrorCode::bad_data);
    EXPECT_NE(newer.error().message.find("version 3"), std::string::npos) << newer.error().message;
}

TEST(SealedFile, WhatWasNotCommittedIsGone) {
    const StoreFolder folder;
    { ASSERT_TRUE(SealedWriter::create(folder.file("a"), kKind).has_value()); }
    EXPECT_EQ(folder.file_count(), 0);
}

TEST(SealedFile, APipeAndAFolderAreRefusedAtOnce) {
    const StoreFolder folder;
    const std::string pipe = folder.file("pipe");
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    EXPECT_EQ(SealedReader::open(pipe, kKind).error().code, ErrorCode::io);
    EXPECT_FALSE(SealedReader::is_kind(pipe, "TEST"));
    EXPECT_EQ(SealedWriter::create(pipe, kKind).error().code, ErrorCode::io);
    EXPECT_EQ(SealedWriter::create(folder.file(""), kKind).error().code, ErrorCode::io);
}

TEST(Bytes, AreLittleEndianAndDoNotReadBeyondTheirEnd) {
    ByteWriter out;
    out.put(std::uint32_t{0x01020304});
    out.put(-1.5);
    out.put_text("ab");
    const std::vector<std::uint8_t>& bytes = out.bytes();
    ASSERT_EQ(bytes.size(), 4u + 8u + 8u + 2u);
    EXPECT_EQ(bytes[0], 4);
    EXPECT_EQ(bytes[3], 1);
    ByteReader in(bytes);
    EXPECT_EQ(in.get<std::uint32_t>(), 0x01020304u);
    EXPECT_EQ(in.get<double>(), -1.5);
    EXPECT_EQ(in.get_text(), "ab");
    EXPECT_TRUE(in.is_done());
    EXPECT_EQ(in.get<std::uint8_t>(), 0);
    EXPECT_TRUE(in.has_failed());

    ByteWriter lie;
    lie.put(std::numeric_limits<std::uint64_t>::max());
    ByteReader believes(lie.bytes());
    EXPECT_EQ(believes.get_text(), "");
    EXPECT_TRUE(believes.has_failed());
}

}  // namespace sealed_file_test
}  // namespace terrane
