// SPDX-License-Identifier: MIT
#include "store_format.h"

#include "raster_ground.h"
#include "store_files.h"
#include "support/grounds.h"
#include "support/random.h"

#include <terrane/store/bytes.h>
#include <terrane/store/sealed_file.h>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <utility>
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
    for (const char* part : {"version 3", "reads 4", "written again"}) {
        EXPECT_NE(newer.error().message.find(part), std::string::npos) << newer.error().message;
    }
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

TEST(HashOfFile, IsThatOfItsBytes) {
    const TemporaryFolder folder;
    const std::string path = folder.file("a");
    for (const std::size_t size : {0u, 1u, 1u << 20, (1u << 20) + 1, 5'000'000u}) {
        std::vector<char> bytes(size);
        for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<char>(i % 251);
        write_file(path, bytes);
        const auto hash = hash_of_file(path);
        ASSERT_TRUE(hash.has_value()) << hash.error().message;
        EXPECT_EQ(*hash, hash_of({reinterpret_cast<const std::uint8_t*>(bytes.data()), size}));
    }
    EXPECT_EQ(hash_of_file(folder.file("none")).error().code, ErrorCode::io);
    EXPECT_EQ(hash_of_file(folder.file("")).error().code, ErrorCode::io);
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

namespace terrane::internal::square_codec_test {

using namespace test;

/// Samples of a square as packed floats.
std::vector<std::uint32_t> pack(const std::function<float(int)>& sample_at, int count) {
    std::vector<std::uint32_t> packed;
    for (int i = 0; i < count; ++i) packed.push_back(std::bit_cast<std::uint32_t>(sample_at(i)));
    return packed;
}

TEST(SquareCodec, GivesBackEveryBitOfASample) {
    constexpr int kColumns = 40, kRows = 25, kCount = kColumns * kRows;
    Random random(9);
    const std::vector<std::pair<bool, std::vector<std::uint32_t>>> squares{
        {false, pack([](int i) { return static_cast<float>(i * i % 997 - 400); }, kCount)},
        {false, pack([](int i) { return static_cast<float>(0.01 * (i * 31 % 777)); }, kCount)},
        {false, pack([](int i) { return static_cast<float>(i) / 256.0f - 1.0f; }, kCount)},
        {false, pack([](int i) { return i % 2 == 0 ? 0.0f : -0.0f; }, kCount)},
        {false, pack([](int i) { return static_cast<float>(std::sin(i) * 1e-40); }, kCount)},
        {false, pack([](int i) { return static_cast<float>(std::sin(i) * 1e30); }, kCount)},
        {false,
         pack([&](int) { return std::bit_cast<float>(std::uint32_t(random.bits())); }, kCount)},
        {true,
         pack([&](int) { return std::bit_cast<float>(std::uint32_t(random.bits())); }, kCount)},
    };
    for (const auto& [is_integer, packed] : squares) {
        const auto bytes = encode_square(packed, is_integer, kColumns);
        EXPECT_LE(bytes.size(), max_square_bytes());
        const auto decoded = decode_square(bytes, is_integer, kColumns, kRows);
        ASSERT_TRUE(decoded.has_value());
        EXPECT_EQ(*decoded, packed);
    }
}

TEST(SquareCodec, DecimalsTakeHalfTheBytesOfOtherFloats) {
    constexpr int kSide = StoredRaster::kSquareSide;
    const auto stored_bytes = [](double step) {
        Random random(4);
        const auto packed = pack(
            [&](int i) {
                const double height =
                    200.0 + 3.0 * std::sin(0.07 * (i % kSide)) + random.between(0.0, 0.05);
                return static_cast<float>(std::floor(height / step) * step);
            },
            kSide * kSide);
        return compress(encode_square(packed, false, kSide)).size();
    };
    EXPECT_LT(2 * stored_bytes(0.01), stored_bytes(0.0100001));
}

TEST(SquareCodec, RefusesBytesThatAreNoSquare) {
    const auto packed = pack([](int i) { return static_cast<float>(i); }, 12);
    std::vector<std::uint8_t> bytes = encode_square(packed, false, 4);
    EXPECT_TRUE(decode_square(bytes, false, 4, 3).has_value());
    EXPECT_FALSE(decode_square(bytes, false, 4, 4).has_value());
    EXPECT_FALSE(decode_square(bytes, true, 4, 3).has_value()) << "integers are not divided";
    bytes[0] = 200;
    EXPECT_FALSE(decode_square(bytes, false, 4, 3).has_value());
    bytes.pop_back();
    EXPECT_FALSE(decode_square(bytes, false, 4, 3).has_value());
    EXPECT_FALSE(decode_square({}, false, 4, 3).has_value());
}

}  // namespace terrane::internal::square_codec_test

namespace terrane::internal::directory_test {

using namespace test;

StoreDirectory directory_of(const TemporaryFolder& folder, double cell_y) {
    const std::string path = folder.file("a.terrane");
    EXPECT_TRUE(ChunkStore::bake(*small_raster(cell_y), path, {}).has_value());
    return decode_directory(SealedReader::open(path, kStoreKind).value().directory()).value();
}

TEST(Directory, RefusesARasterThatMakesNoSense) {
    const TemporaryFolder folder;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const std::vector<std::function<void(StoredRaster&)>> changes{
        [](StoredRaster& raster) { raster.grid.columns = 1; },
        [](StoredRaster& raster) { raster.grid.rows = -5; },
        [](StoredRaster& raster) { raster.grid.cell_x = 0.5; },
        [](StoredRaster& raster) { raster.grid.cell_y = -1.0; },
        [&](StoredRaster& raster) { raster.grid.cell_y = nan; },
        [](StoredRaster& raster) { raster.grid.cell_log2 = 60; },
        [](StoredRaster& raster) { raster.grid.cell_log2 = 1; },
        [&](StoredRaster& raster) {
            raster.grid.west = nan;
            raster.grid.first.x = std::numeric_limits<std::int64_t>::min();
        },
        [](StoredRaster& raster) { raster.packing = SamplePacking::of_parts(0.0, 0.0, false); },
        [&](StoredRaster& raster) { raster.packing = SamplePacking::of_parts(nan, 1.0, false); },
        [](StoredRaster& raster) { raster.rounding = -1.0; },
        [](StoredRaster& raster) { raster.squares.first_column = -1; },
        [](StoredRaster& raster) { raster.squares.column_count += 1; },
        [](StoredRaster& raster) { raster.squares.row_count = 0; },
    };
    for (const double cell_y : {1.0, 1.25}) {
        const StoreDirectory whole = directory_of(folder, cell_y);
        ASSERT_TRUE(whole.raster.has_value());
        const auto read = decode_directory(encode(whole));
        ASSERT_TRUE(read.has_value());
        EXPECT_EQ(encode(*read), encode(whole));
        for (std::size_t i = 0; i < changes.size(); ++i) {
            StoreDirectory changed = whole;
            changes[i](*changed.raster);
            const auto refused = decode_directory(encode(changed));
            ASSERT_FALSE(refused.has_value()) << i;
            EXPECT_EQ(refused.error().code, ErrorCode::bad_data);
        }
    }
}

}  // namespace terrane::internal::directory_test

namespace terrane::damage_test {

using namespace test;

class DamagedStore : public testing::Test {
protected:
    DamagedStore() { hold(WaveHeights(lattice(), 30.0, 100.0)); }

    /// Bakes the whole store from a source.
    void hold(const HeightSource& source) {
        EXPECT_TRUE(ChunkStore::bake(source, whole_, {.note = "a note"}).has_value());
        bytes_ = read_file(whole_);
        const auto store = open_store(whole_);
        lattice_ = store->lattice();
        chunks_.clear();
        for (const ChunkKey& key : all_keys(lattice_)) chunks_.push_back(*make_chunk(*store, key));
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
        if ((*store)->lattice() != lattice_) return false;
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
    Lattice lattice_;
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

TEST_F(DamagedStore, DamageToTheSamplesOfARasterIsFound) {
    hold(*small_raster(1.25));
    for (std::size_t at = 72; at < bytes_.size(); at += 4999) {
        std::vector<char> damaged = bytes_;
        damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
        ASSERT_TRUE(is_refused_or_right(damaged)) << at;
    }
    EXPECT_GT(opened_, 0);
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
