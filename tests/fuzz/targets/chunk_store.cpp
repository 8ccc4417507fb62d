// SPDX-License-Identifier: MIT
// Baked terrains. The first byte chooses: changes to the content of a chunk or of a square of samples, to the directory
// of a store (with hashes that are right), to the whole file (support/input.h), of a function or of a raster, or to
// `terrain.json` or an index of shards.
#include "shard_format.h"
#include "store/raster_ground.h"
#include "store_format.h"
#include "store_records.h"
#include "support/input.h"

#include <terrane/store/chunk_store.h>
#include <terrane/store/shard_baker.h>
#include <terrane/terrain/chunk.h>

#include <cstdint>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

using namespace terrane;
using fuzz::require;

namespace {

using Bytes = std::vector<std::uint8_t>;

/// A baked store, its directory, its records, and the content of its first chunk.
struct Store {
    std::shared_ptr<const HeightSource> source;
    fuzz::ScratchFolder folder;
    std::string path = folder.path() + "/baked.terrane";
    Bytes file, directory, records, chunk, square;

    explicit Store(std::shared_ptr<const HeightSource> baked) : source(std::move(baked)) {
        require(ChunkStore::bake(*source, path, {.worker_count = 1}).has_value(),
                "a store is baked");
        std::ifstream in(path, std::ios::binary);
        file.assign(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
        auto reader = SealedReader::open(path, internal::kStoreKind).value();
        directory.assign(reader.directory().begin(), reader.directory().end());
        const auto read = internal::decode_directory(directory).value();
        const std::uint64_t first = read.chunks[0].offset;
        records.resize(reader.bytes() - first);
        require(reader.read(first, records).has_value(), "a store is read");
        const auto content = internal::content_of(read.lattice, read.raster, 0);
        chunk = internal::encode_chunk(*make_chunk(*source, {0, 0, 0}).value(), content);
        if (!read.raster) return;
        const std::vector<std::uint32_t> samples(kSquareColumns * kSquareRows, 0x41200000u);
        square = internal::encode_square(samples, false, kSquareColumns);
    }

    static constexpr int kSquareColumns = 40, kSquareRows = 30;
};

void decode_chunk(const Store& store, fuzz::Input& input) {
    const Bytes bytes = fuzz::patched(store.chunk, input);
    const auto chunk = internal::decode_chunk(bytes, store.source->lattice(), {0, 0, 0});
    if (!chunk) return;
    require(internal::encode_chunk(**chunk) == bytes || bytes[0] > 3, "the codec is lossless");
}

void decode_parts(const Store& store, fuzz::Input& input) {
    static_cast<void>(internal::decode_partial(fuzz::patched(store.chunk, input),
                                               internal::ChunkContent::vertex_bounds, true));
    static_cast<void>(internal::decode_square(fuzz::patched(store.square, input), false,
                                              Store::kSquareColumns, Store::kSquareRows));
}

void ask(const std::string& path) {
    const auto opened = ChunkStore::open(path);
    if (!fuzz::is_accepted(opened)) return;
    const HeightSource& source = **opened;
    const WorldRect& extent = source.extent();
    static_cast<void>(source.height(0.5 * (extent.west + extent.east), extent.south));
    static_cast<void>(source.interval(extent));
    static_cast<void>(source.rise_bound(1.0));
    const Lattice& lattice = source.lattice();
    const ChunkKey root{lattice.first_root_x, lattice.first_root_y, 0};
    static_cast<void>(make_chunk(source, root));
    if (lattice.finest_level == 1)
        static_cast<void>(make_chunk(source, {2 * root.x, 2 * root.y, 1}));
}

/// The store with a changed directory, which is read back as it is.
void read_directory(const Store& store, fuzz::Input& input) {
    const Bytes bytes = fuzz::patched(store.directory, input);
    const auto directory = internal::decode_directory(bytes);
    if (directory) require(internal::encode(*directory) == bytes, "a directory is lossless");
    const std::string path = store.folder.path() + "/changed.terrane";
    auto writer = SealedWriter::create(path, internal::kStoreKind).value();
    require(writer.append(store.records).has_value() && writer.commit(bytes).has_value(),
            "a store is written");
    ask(path);
}

/// A store in shards, its `terrain.json`, and the index of its first shard.
struct Shards {
    fuzz::ScratchFolder folder;
    std::string path = folder.path() + "/shards";
    Bytes manifest, index;
    internal::ShardExtent extent;

    explicit Shards(const HeightSource& source) {
        const auto baker = ShardBaker::create(source, path, {.worker_count = 1}).value();
        for (std::int64_t i = 0; i < baker.shard_count(); ++i)
            require(baker.bake_shard(i).has_value(), "a shard is baked");
        require(ShardBaker::combine(path).has_value(), "shards are combined");
        const auto files = open_shard_folder(path).value();
        manifest = files->read_whole("terrain.json", std::size_t{1} << 20).value();
        const auto read = internal::decode_manifest(text_of(manifest), false).value();
        extent = internal::ShardLayout(read.world).extent(0);
        index = internal::encode(internal::read_index(*files, read.shards[0], extent, {}).value());
    }

    static std::string_view text_of(const Bytes& bytes) {
        return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
    }
};

/// The store with a changed `terrain.json`, which is read back as it is.
void read_manifest(const Shards& shards, fuzz::Input& input) {
    const Bytes bytes = fuzz::patched(shards.manifest, input);
    const auto manifest = internal::decode_manifest(Shards::text_of(bytes), false);
    if (manifest) {
        const auto text = internal::encode(*manifest);
        require(text.has_value() && internal::decode_manifest(*text, false).has_value(),
                "a manifest is read back");
    }
    std::ofstream out(shards.path + "/terrain.json", std::ios::binary | std::ios::trunc);
    out.write(reinterpret_cast<const char*>(bytes.data()),
              static_cast<std::streamsize>(bytes.size()));
    out.close();
    ask(shards.path);
}

void decode_index(const Shards& shards, fuzz::Input& input) {
    const Bytes bytes = fuzz::patched(shards.index, input);
    const auto index = internal::decode_shard(bytes, shards.extent);
    if (index) require(internal::encode(*index) == bytes, "an index is lossless");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const Store of_function(fuzz::make_square(20.0, 0));
    static const Store of_raster(test::small_raster(1.25));
    fuzz::Input input(data, size);
    const int choice = input.below(8);
    if (choice > 5) {
        static const Shards shards(*test::small_raster(1.25));
        if (choice == 6) {
            read_manifest(shards, input);
        } else {
            decode_index(shards, input);
        }
        return 0;
    }
    const Store& store = choice % 2 == 0 ? of_function : of_raster;
    if (choice == 0) {
        decode_chunk(store, input);
    } else if (choice == 1) {
        decode_parts(store, input);
    } else if (choice < 4) {
        read_directory(store, input);
    } else {
        ask(store.folder.write("changed.terrane", fuzz::patched(store.file, input)));
    }
    return 0;
}
