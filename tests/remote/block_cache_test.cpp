// SPDX-License-Identifier: MIT
#include "block_cache.h"

#include "remote_files.h"
#include "store/test_files.h"
#include "support/random.h"

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <thread>

namespace terrane::block_cache_test {

using namespace test;
using internal::BlockCache;
using internal::BlockKey;

constexpr std::uint64_t kMuch = std::uint64_t{1} << 30;

BlockKey key_of(std::uint64_t number, std::uint64_t bytes = kBlock) {
    return {kShard, kMuch, number * kBlock, bytes};
}

/// Content that no other block has.
std::vector<std::uint8_t> content_of(const BlockKey& key) {
    std::vector<std::uint8_t> bytes(key.bytes);
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = byte_at(key.offset * 7 + i);
    return bytes;
}

bool holds(BlockCache& cache, const BlockKey& key) {
    const auto found = cache.find(key);
    EXPECT_TRUE(!found || *found == content_of(key)) << key.offset;
    return found.has_value();
}

/// Paths of all files, in sub-folders too.
std::vector<std::string> all_files(const std::string& folder) {
    std::vector<std::string> paths;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        if (entry.is_regular_file()) paths.push_back(entry.path().string());
    }
    return paths;
}

std::uint64_t bytes_in(const std::string& folder) {
    std::uint64_t bytes = 0;
    for (const std::string& path : all_files(folder)) bytes += std::filesystem::file_size(path);
    return bytes;
}

TEST(BlockCache, FindsWhatWasInsertedByAnother) {
    const TemporaryFolder folder;
    BlockCache first(folder.file("a/b"), kMuch), second(folder.file("a/b"), kMuch);
    EXPECT_FALSE(holds(second, key_of(1)));
    first.insert(key_of(1), content_of(key_of(1)));
    EXPECT_TRUE(holds(second, key_of(1)));
    // Each part of the key distinguishes blocks.
    EXPECT_FALSE(holds(second, key_of(2)));
    EXPECT_FALSE(holds(second, key_of(1, kBlock - 1)));
    EXPECT_FALSE(second.find({kShard, kMuch + 1, kBlock, kBlock}));
    EXPECT_FALSE(second.find({"b.shard", kMuch, kBlock, kBlock}));
    second.discard(key_of(1));
    EXPECT_FALSE(holds(first, key_of(1)));
    EXPECT_EQ(first.faults() + second.faults() + first.damaged_blocks() + second.damaged_blocks(),
              0u);
}

TEST(BlockCache, RemovesDamagedBlocks) {
    const TemporaryFolder folder;
    BlockCache cache(folder.path(), kMuch);
    const auto damage = [&](auto change) {
        cache.insert(key_of(1), content_of(key_of(1)));
        const std::string path = all_files(folder.path()).at(0);
        std::vector<char> bytes = read_file(path);
        change(bytes);
        write_file(path, bytes);
        EXPECT_FALSE(cache.find(key_of(1)));
        EXPECT_TRUE(all_files(folder.path()).empty());
    };
    const std::size_t size = kBlock + 24;
    for (const std::size_t at :
         {std::size_t{0}, std::size_t{8}, std::size_t{23}, std::size_t{24}, size - 1}) {
        damage([&](std::vector<char>& bytes) { bytes[at] = static_cast<char>(bytes[at] ^ 1); });
    }
    for (const std::size_t length :
         {std::size_t{0}, std::size_t{5}, std::size_t{24}, size - 1, size + 1}) {
        damage([&](std::vector<char>& bytes) { bytes.resize(length); });
    }
    EXPECT_EQ(cache.damaged_blocks(), 10u);

    // A block of another name: two files were exchanged.
    cache.insert(key_of(1), content_of(key_of(1)));
    const std::string path = all_files(folder.path()).at(0);
    std::filesystem::rename(path, folder.file("kept"));
    cache.insert(key_of(2), content_of(key_of(2)));
    const std::string other = all_files(folder.path()).at(0) == folder.file("kept")
                                  ? all_files(folder.path()).at(1)
                                  : all_files(folder.path()).at(0);
    std::filesystem::rename(folder.file("kept"), other);
    EXPECT_FALSE(cache.find(key_of(2)));
    EXPECT_EQ(cache.damaged_blocks(), 11u);
}

TEST(BlockCache, StaysBelowItsCeilingAndKeepsWhatIsUsed) {
    const TemporaryFolder folder;
    const std::uint64_t ceiling = 64 * kBlock;
    std::filesystem::create_directories(folder.file("ab"));
    write_file(folder.file("ab/letter.txt"), {'x'});
    write_file(folder.file("ab/0123456789abcdef0123456789abcdef.txt"), {'x'});
    // Four objects share the folder, as four processes would.
    std::vector<std::unique_ptr<BlockCache>> caches;
    for (int i = 0; i < 4; ++i)
        caches.push_back(std::make_unique<BlockCache>(folder.path(), ceiling));
    for (std::uint64_t i = 0; i < 200; ++i) {
        caches[i % 4]->insert(key_of(i), content_of(key_of(i)));
        EXPECT_TRUE(holds(*caches[(i + 1) % 4], key_of(0))) << i;
        ASSERT_LE(bytes_in(folder.path()), ceiling);
    }
    EXPECT_TRUE(holds(*caches[0], key_of(199)));
    EXPECT_FALSE(holds(*caches[0], key_of(1)));
    // More than half of the ceiling is in use.
    EXPECT_GT(bytes_in(folder.path()), ceiling / 2);
    EXPECT_TRUE(std::filesystem::exists(folder.file("ab/letter.txt")));
    EXPECT_TRUE(std::filesystem::exists(folder.file("ab/0123456789abcdef0123456789abcdef.txt")));
}

TEST(BlockCache, CountsWhatItCannotWrite) {
    const TemporaryFolder folder;
    write_file(folder.file("file"), {'x'});
    BlockCache no_folder(folder.file("file"), kMuch);
    no_folder.insert(key_of(1), content_of(key_of(1)));
    EXPECT_FALSE(no_folder.find(key_of(1)));
    no_folder.discard(key_of(1));
    EXPECT_EQ(no_folder.faults(), 1u);

    BlockCache cache(folder.file("cache"), kMuch);
    {
        const FullDisk full(kBlock / 2);
        cache.insert(key_of(1), content_of(key_of(1)));
    }
    EXPECT_EQ(cache.faults(), 1u);
    EXPECT_FALSE(cache.find(key_of(1)));
    EXPECT_TRUE(all_files(folder.file("cache")).empty());  // nothing is left behind
    cache.insert(key_of(1), content_of(key_of(1)));
    EXPECT_TRUE(holds(cache, key_of(1)));

    BlockCache none("", kMuch);
    none.insert(key_of(1), content_of(key_of(1)));
    EXPECT_FALSE(none.find(key_of(1)));
    none.discard(key_of(1));
    EXPECT_EQ(none.faults(), 0u);
}

TEST(BlockCache, ServesManyThreads) {
    const TemporaryFolder folder;
    BlockCache cache(folder.path(), 64 * kBlock);
    std::vector<std::jthread> threads;
    for (int thread = 0; thread < 8; ++thread) {
        threads.emplace_back([&cache, thread] {
            for (std::uint64_t i = 0; i < 60; ++i) {
                const BlockKey key = key_of((i * 7 + static_cast<std::uint64_t>(thread)) % 90);
                if (!holds(cache, key)) cache.insert(key, content_of(key));
                if (i % 9 == 0) cache.discard(key);
            }
        });
    }
    threads.clear();
    EXPECT_EQ(cache.damaged_blocks(), 0u);
    EXPECT_EQ(cache.faults(), 0u);
}

// Processes are killed while they write. What they leave is complete, or is not found.
TEST(BlockCache, NoWrongByteAfterAKill) {
    const TemporaryFolder folder;
    const std::uint64_t ceiling = 64 * kBlock, key_count = 60;
    const int kill_count = few_or_many(20, 100);
    std::uint64_t found_count = 0;
    for (int i = 0; i < kill_count; ++i) {
        const pid_t child = fork();
        ASSERT_GE(child, 0);
        if (child == 0) {
            BlockCache cache(folder.path(), ceiling);
            for (std::uint64_t k = static_cast<std::uint64_t>(i);; ++k) {
                const BlockKey key = key_of(k % key_count);
                cache.insert(key, content_of(key));
            }
        }
        BlockCache cache(folder.path(), ceiling);
        // The first one lives until it has written something, the others at different times after that.
        EXPECT_TRUE(holds_soon(
            [&] { return holds(cache, key_of(static_cast<std::uint64_t>(i) % key_count)); }));
        usleep(static_cast<useconds_t>(i * 137 % 3000));
        kill(child, SIGKILL);
        waitpid(child, nullptr, 0);
        for (std::uint64_t k = 0; k < key_count; ++k)
            if (holds(cache, key_of(k))) ++found_count;
        EXPECT_EQ(cache.damaged_blocks(), 0u);
        EXPECT_LE(bytes_in(folder.path()), ceiling);
    }
    EXPECT_GT(found_count, static_cast<std::uint64_t>(kill_count));
    std::printf("%d kills, %llu blocks found, %zu files\n", kill_count,
                static_cast<unsigned long long>(found_count), all_files(folder.path()).size());
}

}  // namespace terrane::block_cache_test
