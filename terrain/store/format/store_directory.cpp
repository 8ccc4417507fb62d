// SPDX-License-Identifier: MIT
#include "format/store_directory.h"

#include "format/sha256.h"

#include <terrane/store/bytes.h>

#include <algorithm>
#include <cmath>

namespace terrane::internal {
namespace {

/// Number of chunks of all coarser levels.
std::int64_t chunks_before(const Lattice& lattice, int level) {
    const std::int64_t roots = std::int64_t{lattice.root_count_x} * lattice.root_count_y;
    return roots * (((std::int64_t{1} << (2 * level)) - 1) / 3);
}

void put_world(ByteWriter& out, const StoreDirectory& directory) {
    const Lattice& lattice = directory.lattice;
    out.put(lattice.origin_x);
    out.put(lattice.origin_y);
    out.put(lattice.spacing);
    out.put(lattice.quantum);
    out.put(std::int32_t{lattice.finest_level});
    out.put(lattice.first_root_x);
    out.put(lattice.first_root_y);
    out.put(lattice.root_count_x);
    out.put(lattice.root_count_y);
    out.put(directory.extent.west);
    out.put(directory.extent.south);
    out.put(directory.extent.east);
    out.put(directory.extent.north);
    out.put(directory.max_error_m);
    out.put_each(std::span<const double>(directory.rises));
    for (const ChunkRecord& chunk : directory.chunks) {
        out.put(chunk.hash.low);
        out.put(chunk.hash.high);
        out.put(chunk.heights.low);
        out.put(chunk.heights.high);
    }
    out.put_text(directory.note);
}

}  // namespace

std::size_t StoreDirectory::index_of(const ChunkKey& key) const {
    const std::int64_t per_root = std::int64_t{1} << key.level;
    const std::int64_t x = key.x - lattice.first_root_x * per_root;
    const std::int64_t y = key.y - lattice.first_root_y * per_root;
    return static_cast<std::size_t>(chunks_before(lattice, key.level) +
                                    y * lattice.root_count_x * per_root + x);
}

std::int64_t count_chunks(const Lattice& lattice) {
    // At most 24 levels and 2^31 x 2^31 roots: doubles do not overflow.
    const double count = static_cast<double>(lattice.root_count_x) * lattice.root_count_y *
                         std::ldexp(1.0, 2 * lattice.finest_level);
    if (count > static_cast<double>(kMostChunks)) return kMostChunks + 1;
    return std::min(chunks_before(lattice, lattice.finest_level + 1), kMostChunks + 1);
}

ChunkKey key_at(const Lattice& lattice, std::int64_t index) {
    int level = 0;
    while (chunks_before(lattice, level + 1) <= index) ++level;
    const std::int64_t per_root = std::int64_t{1} << level;
    const std::int64_t across = lattice.root_count_x * per_root;
    const std::int64_t in_level = index - chunks_before(lattice, level);
    return {static_cast<std::int32_t>(lattice.first_root_x * per_root + in_level % across),
            static_cast<std::int32_t>(lattice.first_root_y * per_root + in_level / across),
            static_cast<std::uint8_t>(level)};
}

std::vector<double> rise_distances(const Lattice& lattice) {
    constexpr double kDiagonal = 0.70710678118654757;
    constexpr int kBelow = 24, kAbove = 9;
    std::vector<double> distances;
    for (int exponent = -kBelow; exponent < lattice.finest_level + kAbove; ++exponent) {
        const double spacing = std::ldexp(lattice.spacing, exponent);
        distances.push_back(kDiagonal * spacing);
        distances.push_back(spacing);
    }
    return distances;
}

std::vector<std::uint8_t> encode(const StoreDirectory& directory) {
    ByteWriter out;
    put_world(out, directory);
    for (const ChunkRecord& chunk : directory.chunks) {
        out.put(chunk.offset);
        out.put(chunk.bytes);
    }
    return out.bytes();
}

Result<StoreDirectory> decode_directory(std::span<const std::uint8_t> bytes) {
    ByteReader in(bytes);
    StoreDirectory directory;
    Lattice& lattice = directory.lattice;
    lattice.origin_x = in.get<double>();
    lattice.origin_y = in.get<double>();
    lattice.spacing = in.get<double>();
    lattice.quantum = in.get<double>();
    lattice.finest_level = in.get<std::int32_t>();
    lattice.first_root_x = in.get<std::int32_t>();
    lattice.first_root_y = in.get<std::int32_t>();
    lattice.root_count_x = in.get<std::int32_t>();
    lattice.root_count_y = in.get<std::int32_t>();
    directory.extent.west = in.get<double>();
    directory.extent.south = in.get<double>();
    directory.extent.east = in.get<double>();
    directory.extent.north = in.get<double>();
    directory.max_error_m = in.get<double>();
    const auto senseless = [] { return fail(ErrorCode::bad_data, "the directory makes no sense"); };
    if (in.has_failed() || !check(lattice)) return senseless();
    const std::int64_t count = count_chunks(lattice);
    constexpr std::size_t kRecordBytes = 44;
    if (count > kMostChunks || static_cast<std::size_t>(count) > bytes.size() / kRecordBytes) {
        return senseless();
    }
    directory.rises.resize(rise_distances(lattice).size());
    in.get_each(std::span<double>(directory.rises));
    directory.chunks.resize(static_cast<std::size_t>(count));
    for (ChunkRecord& chunk : directory.chunks) {
        chunk.hash.low = in.get<std::uint64_t>();
        chunk.hash.high = in.get<std::uint64_t>();
        chunk.heights.low = in.get<double>();
        chunk.heights.high = in.get<double>();
    }
    directory.note = in.get_text();
    for (ChunkRecord& chunk : directory.chunks) {
        chunk.offset = in.get<std::uint64_t>();
        chunk.bytes = in.get<std::uint32_t>();
    }
    if (!in.is_done()) return senseless();
    return directory;
}

std::string sha_of(const StoreDirectory& directory) {
    ByteWriter out;
    out.put_each(std::span<const char>(kStoreKind.name));
    out.put(kStoreKind.version);
    put_world(out, directory);
    return sha256(out.bytes());
}

}  // namespace terrane::internal
