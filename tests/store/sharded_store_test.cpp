// SPDX-License-Identifier: MIT
#include "shard_format.h"
#include "store/raster_ground.h"
#include "store/store_files.h"
#include "store/test_files.h"
#include "store_records.h"

#include <terrane/store/shard_baker.h>
#include <terrane/terrain/chunk_source.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

namespace terrane::internal::sharded_store_test {

using namespace test;

// ---- the division of a world

StoreWorld deep_world(bool is_aligned) {
    StoreWorld world;
    world.lattice.finest_level = 13;
    world.lattice.first_root_x = -1;
    world.lattice.first_root_y = 2;
    world.lattice.root_count_x = 3;
    world.lattice.root_count_y = 2;
    world.raster.emplace();
    BilinearGrid& grid = world.raster->grid;
    grid.lattice = world.lattice;
    grid.columns = 100'000;
    grid.rows = 70'000;
    grid.aligned = is_aligned;
    grid.cell_x = 1.0;
    grid.cell_y = is_aligned ? 1.0 : 1.3;
    grid.west = world.lattice.x(world.lattice.west()) + 20'000.5;
    grid.south = world.lattice.y(world.lattice.south()) - 300.0;
    grid.first = {world.lattice.west() + 20'000, world.lattice.south() - 300};
    world.raster->squares = {1, 2, 700, 500};
    return world;
}

TEST(ShardLayout, EachChunkIsInOneShardAndHasOnePlace) {
    const StoreWorld world = deep_world(true);
    const ShardLayout layout(world);
    // 3 x 2 root squares of two levels, then 12 x 8 subtrees of six levels, then 768 x 512.
    EXPECT_EQ(layout.count(), 6 + 24 * 4 + 768 * 512);
    EXPECT_EQ(layout.extent(0).level_count, 2);
    EXPECT_EQ(layout.extent(layout.count() - 1).level_count, kShardLevels);
    std::mt19937 random(7);
    std::size_t chunks = 0;
    for (int i = 0; i < 200; ++i) {
        const auto shard =
            std::uniform_int_distribution<std::int64_t>(0, layout.count() - 1)(random);
        const ShardExtent extent = layout.extent(i < 110 ? i : shard);
        std::set<ChunkKey> keys;
        for (std::size_t at = 0; at < extent.chunk_count(); ++at) {
            const ChunkKey key = extent.chunk_at(at);
            EXPECT_EQ(extent.index_of(key), at);
            EXPECT_EQ(layout.shard_of(key), i < 110 ? i : shard);
            keys.insert(key);
        }
        EXPECT_EQ(keys.size(), extent.chunk_count());
        chunks += keys.size();
    }
    EXPECT_GT(chunks, 100'000u);
}

TEST(ShardLayout, EachSquareIsInOneShard) {
    for (const bool is_aligned : {true, false}) {
        const StoreWorld world = deep_world(is_aligned);
        const ShardLayout layout(world);
        std::size_t squares = 0;
        for (std::int64_t shard = 0; shard < layout.count(); ++shard) {
            const ShardExtent extent = layout.extent(shard);
            if (extent.squares.count() == 0) continue;
            for (const SquareKey& key : squares_of(extent)) {
                EXPECT_EQ(layout.shard_of(key), shard);
                EXPECT_TRUE(world.raster->squares.contains(key));
                ++squares;
            }
        }
        EXPECT_EQ(squares, world.raster->squares.count());
    }
}

TEST(ShardLayout, AWorldOfTooManyShardsIsNotDivided) {
    StoreWorld world;
    world.lattice.finest_level = 24;
    world.lattice.root_count_x = world.lattice.root_count_y = 1000;
    EXPECT_EQ(ShardLayout(world).count(), kMostShards + 1);
}

// ---- baking and reading

/// Plans, bakes all shards and combines them.
StoreInfo bake(const HeightSource& source, const std::string& folder,
               const BakeSettings& settings = {}) {
    const auto baker = ShardBaker::create(source, folder, settings);
    EXPECT_TRUE(baker.has_value()) << (baker ? "" : baker.error().message);
    for (std::int64_t i = 0; i < baker->shard_count(); ++i) {
        const auto baked = baker->bake_shard(i);
        EXPECT_TRUE(baked.has_value()) << (baked ? "" : baked.error().message);
    }
    const auto info = ShardBaker::combine(folder);
    EXPECT_TRUE(info.has_value()) << (info ? "" : info.error().message);
    return info.value_or(StoreInfo{});
}

/// Contents of the files of a folder, by name.
std::vector<std::pair<std::string, std::vector<char>>> contents_of(const std::string& folder) {
    std::vector<std::pair<std::string, std::vector<char>>> contents;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        if (!entry.is_regular_file()) continue;
        contents.emplace_back(std::filesystem::relative(entry.path(), folder).string(),
                              read_file(entry.path().string()));
    }
    std::ranges::sort(contents);
    return contents;
}

void expect_same(const HeightSource& a, const HeightSource& b) {
    EXPECT_EQ(a.lattice(), b.lattice());
    for (const ChunkKey& key : all_keys(a.lattice())) {
        const auto one = make_chunk(a, key), other = make_chunk(b, key);
        ASSERT_TRUE(one.has_value() && other.has_value()) << other.error().message;
        EXPECT_TRUE(same_chunk(**one, **other)) << int{key.level};
        const LatticePoint corner = a.lattice().corner(key);
        const double x = a.lattice().x(corner.x), y = a.lattice().y(corner.y);
        const double side = a.lattice().level_spacing(key.level) * kChunkCells;
        const WorldRect rect{x + 0.1 * side, y, x + 0.9 * side, y + 0.5 * side};
        EXPECT_EQ(a.interval(rect).low, b.interval(rect).low);
        EXPECT_EQ(a.interval(rect).high, b.interval(rect).high);
    }
    for (const double distance : {0.0, 0.5, 3.0, 1000.0, 1e9}) {
        EXPECT_EQ(a.rise_bound(distance), b.rise_bound(distance));
    }
}

TEST(ShardedStore, HasTheChunksOfTheStoreInOneFile) {
    const std::vector<std::shared_ptr<const HeightSource>> sources{
        small_fractal(), small_raster(1.0), small_raster(1.25)};
    for (const auto& source : sources) {
        const TemporaryFolder folder;
        const StoreInfo info = bake(*source, folder.file("shards"), {.note = "Brenner"});
        const auto in_one = ChunkStore::bake(*source, folder.file("one"), {.note = "Brenner"});
        ASSERT_TRUE(in_one.has_value());
        EXPECT_EQ(info.chunk_count, in_one->chunk_count);
        EXPECT_EQ(info.max_error_m, in_one->max_error_m);
        EXPECT_TRUE(ChunkStore::is_store(folder.file("shards")));
        StoreInfo opened;
        const auto store = ChunkStore::open(folder.file("shards/terrain.json"), &opened);
        ASSERT_TRUE(store.has_value()) << store.error().message;
        EXPECT_EQ(opened.sha, info.sha);
        EXPECT_EQ(opened.note, "Brenner");
        expect_same(*open_store(folder.file("one")), **store);
    }
}

TEST(ShardedStore, HasTheSameBytesInAnyOrderFromAnyNumberOfProcesses) {
    const auto source = small_fractal();
    const TemporaryFolder folder;
    bake(*source, folder.file("a"), {.worker_count = 1});
    {
        // Two bakers that do not know of each other, backwards and forwards.
        std::vector<std::jthread> threads;
        for (const bool is_forwards : {true, false}) {
            threads.emplace_back([&, is_forwards] {
                const auto baker =
                    ShardBaker::create(*source, folder.file("b"), {.worker_count = 2});
                ASSERT_TRUE(baker.has_value()) << baker.error().message;
                for (std::int64_t i = 0; i < baker->shard_count(); ++i) {
                    const auto baked =
                        baker->bake_shard(is_forwards ? i : baker->shard_count() - 1 - i);
                    EXPECT_TRUE(baked.has_value()) << baked.error().message;
                }
            });
        }
    }
    ASSERT_TRUE(ShardBaker::combine(folder.file("b")).has_value());
    EXPECT_EQ(contents_of(folder.file("a")), contents_of(folder.file("b")));
}

TEST(ShardedStore, AShardThatWasGivenUpOrDamagedIsBakedAgain) {
    const auto source = small_fractal();
    const TemporaryFolder folder;
    const std::string path = folder.file("a");
    bool is_given_up = true;
    const auto baker =
        ShardBaker::create(*source, path, {.progress = [&](double) { return !is_given_up; }});
    ASSERT_TRUE(baker.has_value());
    const auto given_up = baker->bake_shard(0);
    ASSERT_FALSE(given_up.has_value());
    EXPECT_EQ(given_up.error().code, ErrorCode::cancelled);
    EXPECT_TRUE(files_in(path, ".shard").empty());
    const auto early = ShardBaker::combine(path);
    ASSERT_FALSE(early.has_value());
    EXPECT_NE(early.error().message.find("shard 0 of 4 is not baked"), std::string::npos)
        << early.error().message;
    is_given_up = false;
    const StoreInfo info = bake(*source, path);
    EXPECT_TRUE(baker->is_baked(0));
    EXPECT_FALSE(baker->bake_shard(0).value());

    const std::string shard = files_in(path, ".shard").front();
    const std::vector<char> whole = read_file(shard);
    std::vector<char> cut = whole;
    cut.pop_back();
    write_file(shard, cut);
    EXPECT_FALSE(ShardBaker::combine(path).has_value());
    EXPECT_EQ(bake(*source, path).sha, info.sha);
    EXPECT_EQ(read_file(shard), whole);
}

TEST(ShardedStore, IsComparedWithItsSource) {
    const TemporaryFolder folder;
    const std::string path = folder.file("a");
    const auto source = small_raster(1.25);
    bake(*source, path);
    const auto baker = ShardBaker::create(*source, path, {}).value();
    // Five chunks each; the third column of squares begins 256.75 m from the west, over the second shard.
    EXPECT_EQ(baker.verify_shard(0, 1).value(), 5 + 4);
    EXPECT_EQ(baker.verify_shard(1, 1).value(), 5 + 2);
    EXPECT_EQ(baker.verify_shard(1, 4).value(), 2 + 1);
    EXPECT_EQ(baker.verify_shard(2, 1).error().code, ErrorCode::invalid_argument);
    EXPECT_EQ(baker.verify_shard(0, 0).error().code, ErrorCode::invalid_argument);
    // A raster with the same plan and another sample
    const auto other = RasterGround::create(300, 200, 1.25, [&](int column, int row) {
        const float height = static_cast<float>(source->height(0.75 + column, 0.25 + 1.25 * row));
        return column == 40 && row == 30 ? height + 0.01f : height;
    });
    const auto of_other = ShardBaker::create(*other, path, {});
    ASSERT_TRUE(of_other.has_value()) << of_other.error().message;
    const auto differs = of_other->verify_shard(0, 1);
    ASSERT_FALSE(differs.has_value());
    EXPECT_NE(differs.error().message.find("square 0, 0 of the raster"), std::string::npos)
        << differs.error().message;
}

TEST(ShardedStore, APlanOfAnotherSourceIsRefused) {
    const TemporaryFolder folder;
    const std::string path = folder.file("a");
    ASSERT_TRUE(ShardBaker::create(*small_fractal(), path, {.fingerprint = "one"}).has_value());
    const auto other = ShardBaker::create(*small_fractal(), path, {.fingerprint = "other"});
    ASSERT_FALSE(other.has_value());
    EXPECT_NE(other.error().message.find("another source"), std::string::npos);
    EXPECT_FALSE(ShardBaker::create(*small_fractal(), path, {.note = "\xff"}).has_value());
    EXPECT_FALSE(ShardBaker::create(*small_fractal(), "/dev/null/a", {}).has_value());
}

TEST(ShardedStore, WhatIsMissingOrOfAnotherStoreIsNamed) {
    const auto source = small_fractal();
    const TemporaryFolder folder;
    const std::string path = folder.file("a");
    bake(*source, path);
    const std::vector<std::string> shards = files_in(path, ".shard");
    ASSERT_EQ(shards.size(), 4u);
    const auto errors = [&] {
        const auto store = open_store(path);
        std::set<std::string> messages;
        for (const ChunkKey& key : all_keys(source->lattice())) {
            const auto chunk = make_chunk(*store, key);
            if (!chunk) messages.insert(chunk.error().message);
        }
        return messages;
    };
    std::filesystem::copy_file(shards[0], folder.file("kept"));
    std::filesystem::remove(shards[0]);
    EXPECT_EQ(errors().size(), 1u);
    EXPECT_NE(errors().begin()->find(shards[0]), std::string::npos);
    std::filesystem::copy_file(shards[1], shards[0]);
    EXPECT_FALSE(errors().empty());
    std::filesystem::remove(shards[0]);
    std::filesystem::copy_file(folder.file("kept"), shards[0]);
    EXPECT_TRUE(errors().empty());
}

TEST(ShardedStore, AFlippedBitNeverGivesAnotherChunk) {
    const auto source = small_raster(1.25);
    const TemporaryFolder folder;
    const std::string path = folder.file("a");
    bake(*source, path);
    const std::string shard = files_in(path, ".shard").front();
    const std::vector<char> whole = read_file(shard);
    const std::vector<ChunkKey> keys = all_keys(source->lattice());
    std::vector<std::shared_ptr<const Chunk>> chunks;
    for (const ChunkKey& key : keys) chunks.push_back(*make_chunk(*source, key));
    int refused = 0;
    std::mt19937 random(3);
    for (int i = 0; i < 40; ++i) {
        // The header is not read: terrain.json has the size and the hash of the index.
        const auto at = std::uniform_int_distribution<std::size_t>(72, whole.size() - 1)(random);
        std::vector<char> damaged = whole;
        damaged[at] = static_cast<char>(damaged[at] ^ (1 << (i % 8)));
        write_file(shard, damaged);
        const auto store = open_store(path);
        // zstd has a few bits that do not change what is decompressed.
        for (std::size_t k = 0; k < keys.size(); ++k) {
            const auto chunk = make_chunk(*store, keys[k]);
            if (chunk) {
                EXPECT_TRUE(same_chunk(**chunk, *chunks[k])) << at;
            } else {
                EXPECT_EQ(chunk.error().code, ErrorCode::bad_data) << chunk.error().message;
                ++refused;
            }
        }
    }
    EXPECT_GE(refused, 40);
}

TEST(ShardedStore, AManifestThatMakesNoSenseIsRefused) {
    const TemporaryFolder folder;
    const std::string path = folder.file("a");
    bake(*small_raster(1.25), path);
    const std::vector<char> bytes = read_file(folder.file("a/terrain.json"));
    const std::string whole(bytes.begin(), bytes.end());
    ASSERT_TRUE(decode_manifest(whole, false).has_value());
    EXPECT_EQ(encode(*decode_manifest(whole, false)).value(), whole);
    const std::vector<std::pair<std::string, std::string>> changes{
        {"\"terrane shards\"", "\"other\""},
        {"\"version\":1", "\"version\":2"},
        {"\"spacing_m\":", "\"spacing_m\":-"},
        {"\"finest_level\":1", "\"finest_level\":99999999999999999999"},
        {"\"root_count\":[", "\"root_count\":[2147483647,"},
        {"\"samples\":[300", "\"samples\":[-3"},
        {"\"cell_log2\":0", "\"cell_log2\":60"},
        {"\"is_integer\":false", "\"is_integer\":3"},
        {"\"shards\":[[", "\"shards\":[[]],\"other\":[["},
        {"\"shards\":[[\"", "\"shards\":[[\"../../"},
        {"\"extent_m\":[", "\"extent\":["},
        {"{", "["},
    };
    for (const auto& [from, to] : changes) {
        std::string changed = whole;
        ASSERT_NE(changed.find(from), std::string::npos) << from;
        changed.replace(changed.find(from), from.size(), to);
        write_file(folder.file("a/terrain.json"), {changed.begin(), changed.end()});
        const auto store = ChunkStore::open(path);
        ASSERT_FALSE(store.has_value()) << from;
        EXPECT_EQ(store.error().code, ErrorCode::bad_data) << store.error().message;
    }
    std::filesystem::remove(folder.file("a/terrain.json"));
    EXPECT_FALSE(ChunkStore::is_store(path));
    EXPECT_EQ(ChunkStore::open(path).error().code, ErrorCode::io);
    // Larger than is read: nothing of its size is allocated.
    write_file(folder.file("a/terrain.json"), {});
    std::filesystem::resize_file(folder.file("a/terrain.json"), std::uintmax_t{1} << 30);
    EXPECT_EQ(ChunkStore::open(path).error().code, ErrorCode::bad_data);
}

/// Files of a folder that are slow.
class SlowFiles : public ShardFiles {
public:
    explicit SlowFiles(std::shared_ptr<const ShardFiles> files) : files_(std::move(files)) {}
    const std::string& place() const override { return files_->place(); }
    Result<std::vector<std::uint8_t>> read_whole(const std::string& name,
                                                 std::size_t most_bytes) const override {
        return files_->read_whole(name, most_bytes);
    }
    bool is_slow() const override { return true; }

protected:
    std::shared_ptr<const ShardFiles> files_;
};

/// Slow files of which the first read of each range is damaged.
class BadCache final : public SlowFiles {
public:
    using SlowFiles::SlowFiles;
    Result<void> read(std::span<const FileRange> ranges,
                      const std::stop_token& stop) const override {
        ++reads;
        auto read = files_->read(ranges, stop);
        for (const FileRange& range : ranges) {
            if (!dropped_.contains({range.name, range.offset})) range.bytes_out[0] ^= 1u;
        }
        return read;
    }
    bool discard(const FileRange& range) const override {
        return dropped_.insert({range.name, range.offset}).second;
    }

    mutable int reads = 0;

private:
    mutable std::set<std::pair<std::string, std::uint64_t>> dropped_;
};

TEST(ShardedStore, DamagedBytesOfACacheAreReadAgain) {
    const auto source = small_raster(1.25);
    const TemporaryFolder folder;
    bake(*source, folder.file("a"));
    const auto cache = std::make_shared<BadCache>(open_shard_folder(folder.file("a")).value());
    const auto store = ChunkStore::open(cache).value();
    const ChunkKey key = all_keys(store->lattice()).back();
    EXPECT_TRUE(same_chunk(**make_chunk(*source, key), **make_chunk(*store, key)));
    // Index, record and squares, each twice: the squares of a chunk are one read.
    EXPECT_EQ(cache->reads, 6);
}

TEST(ShardedStore, IntervalsOfSlowFilesComeFromMemory) {
    const auto source = small_fractal();
    const TemporaryFolder folder;
    bake(*source, folder.file("a"));
    const auto cache = std::make_shared<BadCache>(open_shard_folder(folder.file("a")).value());
    const auto store = ChunkStore::open(cache).value();
    const auto exact = open_store(folder.file("a"));
    const Lattice& lattice = store->lattice();
    for (const ChunkKey& key : all_keys(lattice)) {
        const LatticePoint corner = lattice.corner(key);
        const double side = lattice.level_spacing(key.level) * kChunkCells;
        const double x = lattice.x(corner.x), y = lattice.y(corner.y);
        const WorldRect rect{x + 0.2 * side, y + 0.2 * side, x + 0.6 * side, y + 0.6 * side};
        EXPECT_LE(store->interval(rect).low, exact->interval(rect).low);
        EXPECT_GE(store->interval(rect).high, exact->interval(rect).high);
    }
    EXPECT_EQ(cache->reads, 0);
}

/// Slow files that note what is expected and what is read.
class NotedFiles final : public SlowFiles {
public:
    using Range = std::tuple<std::string, std::uint64_t, std::uint64_t>;  // name, offset, bytes

    using SlowFiles::SlowFiles;
    Result<void> read(std::span<const FileRange> ranges,
                      const std::stop_token& stop) const override {
        for (const FileRange& range : ranges) {
            read_ranges.insert({range.name, range.offset, range.bytes_out.size()});
        }
        return files_->read(ranges, stop);
    }
    void expect(std::span<const ExpectedRange> ranges) const override {
        expected.clear();
        later.clear();
        for (const ExpectedRange& range : ranges) {
            EXPECT_LE(range.offset + range.bytes, range.file_bytes);
            (range.is_later ? later : expected).insert({range.name, range.offset, range.bytes});
        }
    }

    mutable std::set<Range> expected, later, read_ranges;
};

/// Whether the first record of a file was read.
bool has_read_first_record(const NotedFiles& files, const std::string& name) {
    constexpr std::uint64_t kHeaderBytes = 72;
    return std::ranges::any_of(files.read_ranges, [&](const NotedFiles::Range& range) {
        return std::get<0>(range) == name && std::get<1>(range) == kHeaderBytes;
    });
}

TEST(ShardedStore, ExpectsWhatItsChunksRead) {
    const std::vector<std::shared_ptr<const HeightSource>> sources{small_raster(1.25),
                                                                   small_fractal()};
    for (const auto& source : sources) {
        const TemporaryFolder folder;
        bake(*source, folder.file("a"));
        const auto files =
            std::make_shared<NotedFiles>(open_shard_folder(folder.file("a")).value());
        const auto store = ChunkStore::open(files).value();
        int first_record_count = 0;
        for (const ChunkKey& key : all_keys(store->lattice())) {
            // The first time only the indices of shards are known, and where the first record of each is.
            for (int attempt = 0; attempt < 2; ++attempt) {
                chunks_of(*store).expect_chunks({&key, 1});
                EXPECT_TRUE(files->read_ranges.empty()) << "nothing is read by expecting it";
                if (attempt > 0 || files->expected.empty()) break;
                const std::set<NotedFiles::Range> first = files->expected;
                ASSERT_TRUE(make_chunk(*store, key).has_value());
                for (const auto& [name, offset, bytes] : first) {
                    if (offset > 0) continue;
                    EXPECT_TRUE(has_read_first_record(*files, name));
                    ++first_record_count;
                }
                files->read_ranges.clear();
            }
            // Squares that an earlier chunk has read are in memory.
            const std::set<NotedFiles::Range> expected = files->expected;
            ASSERT_TRUE(make_chunk(*store, key).has_value());
            EXPECT_EQ(files->read_ranges, expected);
            files->read_ranges.clear();
        }
        EXPECT_GT(first_record_count, 0);
        const std::vector<ChunkKey> keys = all_keys(store->lattice());
        chunks_of(*store).expect_chunks(keys);
        EXPECT_GE(files->expected.size(), keys.size());
        chunks_of(*store).expect_chunks({});
        EXPECT_TRUE(files->expected.empty()) << "the last call replaces the one before";
    }
}

TEST(ShardedStore, ExpectsSiblingsLaterAndBesideTheirChunk) {
    const auto source = small_fractal();
    const TemporaryFolder folder;
    bake(*source, folder.file("a"));
    const auto files = std::make_shared<NotedFiles>(open_shard_folder(folder.file("a")).value());
    const auto store = ChunkStore::open(files).value();
    int compared_count = 0;
    for (const ChunkKey& key : all_keys(store->lattice())) {
        ASSERT_TRUE(make_chunk(*store, key).has_value());
        const auto range_of = [&](const ChunkKey& of) {
            chunks_of(*store).expect_chunks({&of, 1});
            return *files->expected.begin();
        };
        chunks_of(*store).expect_chunks({&key, 1});
        const std::set<NotedFiles::Range> later = files->later;
        if (later.empty()) continue;  // the first chunk of a shard
        std::set<NotedFiles::Range> siblings;
        for (int quadrant = 0; quadrant < 4; ++quadrant) {
            siblings.insert(range_of(key.parent().child(quadrant)));
        }
        EXPECT_EQ(siblings.erase(range_of(key)), 1u);
        EXPECT_EQ(later, siblings);
        siblings.insert(range_of(key));
        std::uint64_t end = std::get<1>(*siblings.begin());
        for (const auto& [name, offset, bytes] : siblings) {
            EXPECT_EQ(offset, end) << "records of siblings are side by side";
            end = offset + bytes;
        }
        ++compared_count;
    }
    EXPECT_GT(compared_count, 16);
}

}  // namespace terrane::internal::sharded_store_test
