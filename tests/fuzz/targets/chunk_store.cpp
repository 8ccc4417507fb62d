// SPDX-License-Identifier: MIT
// Baked terrains. The first byte chooses: changes to the content of a chunk, to the directory of a store (with hashes
// that are right), or to the whole file (support/input.h).
#include "store_format.h"
#include "support/input.h"

#include <terrane/store/chunk_store.h>
#include <terrane/terrain/chunk.h>

#include <fstream>
#include <iterator>
#include <vector>

using namespace terrane;
using fuzz::require;

namespace {

using Bytes = std::vector<std::uint8_t>;

/// A baked store, its directory and the content of its chunk.
struct Store {
    std::shared_ptr<const HeightSource> source = fuzz::make_square(20.0, 0);
    fuzz::ScratchFolder folder;
    std::string path = folder.path() + "/baked.terrane";
    Bytes file, directory, record, chunk;

    Store() {
        require(ChunkStore::bake(*source, path, {.worker_count = 1}).has_value(),
                "a store is baked");
        std::ifstream in(path, std::ios::binary);
        file.assign(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
        auto reader = SealedReader::open(path, internal::kStoreKind).value();
        directory.assign(reader.directory().begin(), reader.directory().end());
        const auto read = internal::decode_directory(directory).value();
        record.resize(read.chunks[0].bytes);
        require(reader.read(read.chunks[0].offset, record).has_value(), "a store is read");
        chunk = internal::encode_chunk(*make_chunk(*source, {0, 0, 0}).value());
    }
};

void decode_chunk(const Store& store, fuzz::Input& input) {
    const Bytes bytes = fuzz::patched(store.chunk, input);
    const auto chunk = internal::decode_chunk(bytes, store.source->lattice(), {0, 0, 0});
    if (!chunk) return;
    require(internal::encode_chunk(**chunk) == bytes || bytes[0] > 3, "the codec is lossless");
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
    static_cast<void>(make_chunk(source, {lattice.first_root_x, lattice.first_root_y, 0}));
}

/// The store with a changed directory, which is read back as it is.
void read_directory(const Store& store, fuzz::Input& input) {
    const Bytes bytes = fuzz::patched(store.directory, input);
    const auto directory = internal::decode_directory(bytes);
    if (directory) require(internal::encode(*directory) == bytes, "a directory is lossless");
    const std::string path = store.folder.path() + "/changed.terrane";
    auto writer = SealedWriter::create(path, internal::kStoreKind).value();
    require(writer.append(store.record).has_value() && writer.commit(bytes).has_value(),
            "a store is written");
    ask(path);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const Store store;
    fuzz::Input input(data, size);
    switch (input.below(3)) {
        case 0:
            decode_chunk(store, input);
            break;
        case 1:
            read_directory(store, input);
            break;
        default:
            ask(store.folder.write("changed.terrane", fuzz::patched(store.file, input)));
    }
    return 0;
}
