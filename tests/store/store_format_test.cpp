// SPDX-License-Identifier: MIT
#include "store_format.h"

#include "store_files.h"
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/store/bytes.h>
#include <terrane/store/sealed_file.h>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace terrane::internal::sha256_test {

std::string sha_of_text(const std::string& text) {
    return sha256(std::vector<std::uint8_t>(text.begin(), text.end()));
}

// The examples of NIST for FIPS 180-4.
TEST(Sha256, GivesWhatTheStandardSays) {
    EXPECT_EQ(sha_of_text(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    EXPECT_EQ(sha_of_text("abc"),
              "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    EXPECT_EQ(sha_of_text("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
              "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
    EXPECT_EQ(sha_of_text(std::string(1'000'000, 'a')),
              "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

}  // namespace terrane::internal::sha256_test

namespace terrane::sealed_file_test {

using namespace test;

constexpr SealedKind kKind{{'T', 'E', 'S', 'T'}, 3};
const std::vector<std::uint8_t> kDirectory{1, 2, 3, 4};

Result<void> write(const std::string& path, const SealedKind& kind) {
    auto file = SealedWriter::create(path, kind);
    if (!file) return tl::unexpected(file.error());
    return file->commit(kDirectory);
}

TEST(SealedFile, GivesBackWhatWasWritten) {
    const TemporaryFolder folder;
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
    const TemporaryFolder folder;
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
    const TemporaryFolder folder;
    { ASSERT_TRUE(SealedWriter::create(folder.file("a"), kKind).has_value()); }
    EXPECT_EQ(folder.file_count(), 0u);
}

TEST(SealedFile, APipeAndAFolderAreRefusedAtOnce) {
    const TemporaryFolder folder;
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

}  // namespace terrane::sealed_file_test

namespace terrane::internal::chunk_codec_test {

using namespace test;

TEST(ChunkCodec, GivesBackEveryBitOfAChunk) {
    const auto source = small_fractal();
    for (const ChunkKey& key : {ChunkKey{-1, 0, 0}, ChunkKey{1, -2, 1}, ChunkKey{3, 3, 2}}) {
        const Chunk chunk = **make_chunk(*source, key);
        const auto bytes = encode_chunk(chunk);
        EXPECT_LE(bytes.size(), max_encoded_bytes());
        const auto decoded = decode_chunk(bytes, source->lattice(), key);
        ASSERT_TRUE(decoded.has_value());
        EXPECT_TRUE(same_chunk(chunk, **decoded));
        EXPECT_LE((*decoded)->bytes(), Chunk::max_bytes());
    }
}

TEST(ChunkCodec, KeepsExtremesAndFlags) {
    const auto source = small_fractal();
    const ChunkKey key{0, 0, 0};
    Chunk chunk = **make_chunk(*source, key);
    Random random(3);
    for (auto& height : chunk.heights) {
        height = (random.bits() & 1) != 0 ? 2147483647 : -2147483647;
    }
    chunk.cell_flags.assign(std::size_t{kChunkCells} * kChunkCells, cell_ground);
    for (auto& flags : chunk.cell_flags) flags = static_cast<std::uint8_t>(random.below(4));
    chunk.cell_bounds[7] = std::numeric_limits<float>::infinity();
    complete_chunk(source->lattice().quantum, std::make_shared<ChunkVertices>(*chunk.vertices),
                   chunk);
    const auto bytes = encode_chunk(chunk);
    EXPECT_EQ(bytes.size(), max_encoded_bytes());
    const auto decoded = decode_chunk(bytes, source->lattice(), key);
    ASSERT_TRUE(decoded.has_value());
    EXPECT_EQ((*decoded)->heights, chunk.heights);
    EXPECT_EQ((*decoded)->cell_flags, chunk.cell_flags);
    EXPECT_EQ((*decoded)->cell_bounds, chunk.cell_bounds);
}

TEST(ChunkCodec, RefusesBytesThatAreNoChunk) {
    const auto source = small_fractal();
    const ChunkKey root{0, 0, 0}, below{0, 0, 1};
    std::vector<std::uint8_t> bytes = encode_chunk(**make_chunk(*source, root));
    EXPECT_FALSE(decode_chunk(bytes, source->lattice(), below).has_value());
    bytes.push_back(0);
    EXPECT_FALSE(decode_chunk(bytes, source->lattice(), root).has_value());
    bytes.resize(bytes.size() - 2);
    EXPECT_FALSE(decode_chunk(bytes, source->lattice(), root).has_value());
    EXPECT_FALSE(decode_chunk({}, source->lattice(), root).has_value());
}

}  // namespace terrane::internal::chunk_codec_test

namespace terrane::damage_test {

using namespace test;

class DamagedStore : public testing::Test {
protected:
    DamagedStore() {
        WaveHeights waves(lattice(), 30.0, 100.0);
        EXPECT_TRUE(ChunkStore::bake(waves, whole_, {.note = "a note"}).has_value());
        bytes_ = read_file(whole_);
        for (const ChunkKey& key : all_keys(lattice())) {
            chunks_.push_back(*make_chunk(*open_store(whole_), key));
        }
    }

    static Lattice lattice() {
        Lattice lattice = small_world(1, 2.0);
        lattice.root_count_x = lattice.root_count_y = 1;
        return lattice;
    }

    /// Whether a damaged store is refused, or answers as the whole one does.
    bool is_refused_or_right(const std::vector<char>& bytes) {
        write_file(damaged_, bytes);
        const auto store = ChunkStore::open(damaged_);
        if (!store) return store.error().code == ErrorCode::bad_data && one_line(store.error());
        ++opened_;
        if ((*store)->lattice() != lattice()) return false;
        for (const auto& chunk : chunks_) {
            const auto read = make_chunk(**store, chunk->key);
            if (read && !same_chunk(**read, *chunk)) return false;
            if (!read && !(read.error().code == ErrorCode::bad_data && one_line(read.error()))) {
                return false;
            }
        }
        return true;
    }
    static bool one_line(const Error& error) {
        return error.message.find('\n') == std::string::npos &&
               error.message.find("damaged.terrane") != std::string::npos;
    }

    TemporaryFolder folder_;
    std::string whole_ = folder_.file("whole.terrane"), damaged_ = folder_.file("damaged.terrane");
    std::vector<char> bytes_;
    std::vector<std::shared_ptr<const Chunk>> chunks_;
    int opened_ = 0;
};

TEST_F(DamagedStore, AFlippedBitIsFoundWhereverItIs) {
    // Every bit of the header, and one of every few bytes of the rest.
    constexpr std::size_t kHeader = 72, kStride = 61;
    for (std::size_t at = 0; at < bytes_.size(); at += at < kHeader ? 1 : kStride) {
        for (int bit = 0; bit < 8; ++bit) {
            if (at >= kHeader && bit != static_cast<int>(at % 8)) continue;
            std::vector<char> damaged = bytes_;
            damaged[at] = static_cast<char>(damaged[at] ^ (1 << bit));
            ASSERT_TRUE(is_refused_or_right(damaged)) << "bit " << bit << " of byte " << at;
        }
    }
    // Damage in chunks is told when they are asked for.
    EXPECT_GT(opened_, 0);
}

TEST_F(DamagedStore, ACutFileIsRefused) {
    for (std::size_t size = 0; size < bytes_.size(); size += size < 200 ? 1 : 251) {
        write_file(damaged_, {bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(size)});
        const auto store = ChunkStore::open(damaged_);
        ASSERT_FALSE(store.has_value()) << size;
        EXPECT_EQ(store.error().code, ErrorCode::bad_data) << store.error().message;
    }
}

TEST_F(DamagedStore, OverwrittenRangesAreFound) {
    for (std::size_t at = 0; at < bytes_.size(); at += 997) {
        std::vector<char> damaged = bytes_;
        std::fill(damaged.begin() + static_cast<std::ptrdiff_t>(at),
                  damaged.begin() + static_cast<std::ptrdiff_t>(std::min(at + 512, damaged.size())),
                  '\xff');
        ASSERT_TRUE(is_refused_or_right(damaged)) << at;
    }
}

TEST_F(DamagedStore, OtherFilesAreNoStores) {
    EXPECT_TRUE(ChunkStore::is_store(whole_));
    EXPECT_FALSE(ChunkStore::is_store(folder_.file("none")));
    write_file(damaged_, {'n', 'o'});
    EXPECT_FALSE(ChunkStore::is_store(damaged_));
    EXPECT_EQ(ChunkStore::open(folder_.file("none")).error().code, ErrorCode::io);
    EXPECT_EQ(ChunkStore::open("/").error().code, ErrorCode::io);
}

TEST_F(DamagedStore, AFileThatIsCutWhileItIsReadIsAnError) {
    write_file(damaged_, bytes_);
    const auto store = open_store(damaged_);
    std::filesystem::resize_file(damaged_, 100);
    for (const auto& chunk : chunks_) {
        const auto read = make_chunk(*store, chunk->key);
        ASSERT_FALSE(read.has_value());
        EXPECT_EQ(read.error().code, ErrorCode::bad_data);
    }
    EXPECT_TRUE(std::isnan(store->height(1.0, 1.0)));
    double height = 0.0;
    EXPECT_FALSE(store->sample({{0, 0}, 1, 1, 1}, {&height, 1}).has_value());
}

}  // namespace terrane::damage_test
