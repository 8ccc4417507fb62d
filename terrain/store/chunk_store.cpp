// SPDX-License-Identifier: MIT
#include "chunk_reader.h"
#include "stored_heights.h"

#include <terrane/store/chunk_store.h>

#include <string_view>
#include <utility>

namespace terrane {

using namespace internal;

Result<std::shared_ptr<const HeightSource>> ChunkStore::open(const std::string& path,
                                                             StoreInfo* info_out) {
    auto file = SealedReader::open(path, kStoreKind);
    if (!file) return tl::unexpected(file.error());
    auto directory = decode_directory(file->directory());
    if (!directory) {
        return fail(directory.error().code, "\"" + path + "\": " + directory.error().message);
    }
    file->drop_directory();
    if (info_out != nullptr) {
        *info_out = {static_cast<std::int64_t>(directory->chunks.size()), file->bytes(),
                     directory->max_error_m, sha_of(*directory), directory->note};
    }
    return std::make_shared<const StoredHeights>(
        std::make_unique<const ChunkReader>(std::move(*file), std::move(*directory)));
}

bool ChunkStore::is_store(const std::string& path) {
    return SealedReader::is_kind(path,
                                 std::string_view(kStoreKind.name.data(), kStoreKind.name.size()));
}

}  // namespace terrane
