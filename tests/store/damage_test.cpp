// SPDX-License-Identifier: MIT
#include "store_files.h"
#include "support/heights/wave_heights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace terrane {
namespace damage_test {

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

    StoreFolder folder_;
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

}  // namespace damage_test
}  // namespace terrane
