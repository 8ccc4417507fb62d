// SPDX-License-Identifier: MIT
#include "bake.h"
#include "file_io.h"
#include "shard_format.h"
#include "store_records.h"

#include <terrane/store/shard_baker.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace terrane {

using namespace internal;

// A shard's file is named by its content, which is known when it has been baked. So for each shard a small file, the
// *piece*, has the row of `terrain.json`. Pieces are in a folder whose name has the hash of the plan, so that those of
// an earlier source are not taken.

namespace {

constexpr std::string_view kPlanName = "plan.json";

Result<std::string> read_text(const ShardFiles& files, std::string_view name) {
    TERRANE_TRY(const auto bytes, files.read_whole(std::string(name), kMostManifestBytes));
    return std::string(bytes.begin(), bytes.end());
}

std::string pieces_of(std::string_view plan) {
    const auto hash =
        hash_of(std::span(reinterpret_cast<const std::uint8_t*>(plan.data()), plan.size()));
    return "pieces-" + hash.text();
}

std::string piece_name(const std::string& pieces, std::int64_t shard) {
    return pieces + "/" + std::to_string(shard) + ".json";
}

/// Reads the piece of a shard and the index of its file. Fails: io; bad_data
Result<std::pair<ShardFile, ShardIndex>> read_piece(const ShardFiles& files,
                                                    const std::string& pieces, std::int64_t shard,
                                                    const ShardExtent& extent) {
    TERRANE_TRY(const auto text, read_text(files, piece_name(pieces, shard)));
    TERRANE_TRY(const auto file, decode_row(text));
    TERRANE_TRY(auto index, read_index(files, file, extent, {}));
    return std::pair{file, std::move(index)};
}

Result<void> check_shard(std::int64_t shard, std::int64_t count) {
    if (shard >= 0 && shard < count) return {};
    return fail(ErrorCode::invalid_argument, "shard must be 0 to " + std::to_string(count - 1) +
                                                 ", got " + std::to_string(shard));
}

}  // namespace

struct ShardBaker::State {
    State(Bakeable baked, std::string folder_path, BakeSettings bake_settings)
        : bakeable(std::move(baked)),
          layout(bakeable.world),
          folder(std::move(folder_path)),
          settings(std::move(bake_settings)) {}

    Bakeable bakeable;
    ShardLayout layout;
    std::string folder;
    BakeSettings settings;
    std::shared_ptr<const ShardFiles> files;
    std::string pieces;  ///< folder in `folder`
};

ShardBaker::ShardBaker(std::unique_ptr<State> state) : state_(std::move(state)) {}
ShardBaker::ShardBaker(ShardBaker&&) noexcept = default;
ShardBaker::~ShardBaker() = default;

Result<ShardBaker> ShardBaker::create(const HeightSource& source, const std::string& folder,
                                      const BakeSettings& settings) {
    TERRANE_TRY(auto bakeable, begin_bake(source, folder, settings));
    auto state = std::make_unique<State>(std::move(bakeable), folder, settings);
    if (state->layout.count() > kMostShards) {
        return fail(ErrorCode::invalid_argument,
                    "a store has at most 1048576 shards; these levels have more");
    }
    TERRANE_TRY(const auto plan, encode(Manifest{state->bakeable.world, settings.fingerprint, {}}));
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    TERRANE_TRY(state->files, open_shard_folder(folder));
    const std::string path = folder + "/" + std::string(kPlanName);
    if (std::filesystem::exists(path)) {
        TERRANE_TRY(const auto text, read_text(*state->files, kPlanName));
        if (text != plan) {
            return fail(ErrorCode::invalid_argument,
                        "\"" + path +
                            "\" is the plan of another source or of other settings; "
                            "remove it to bake this one");
        }
    } else {
        TERRANE_TRY(write_text(path, plan));
    }
    state->pieces = pieces_of(plan);
    std::filesystem::create_directories(folder + "/" + state->pieces, error);
    if (error) {
        return fail(ErrorCode::io, "cannot make the folder \"" + folder + "/" + state->pieces +
                                       "\": " + error.message());
    }
    return ShardBaker(std::move(state));
}

std::int64_t ShardBaker::shard_count() const { return state_->layout.count(); }

bool ShardBaker::is_baked(std::int64_t shard) const {
    if (shard < 0 || shard >= shard_count()) return false;
    return read_piece(*state_->files, state_->pieces, shard, state_->layout.extent(shard))
        .has_value();
}

Result<bool> ShardBaker::bake_shard(std::int64_t shard) const {
    TERRANE_TRY(check_shard(shard, shard_count()));
    if (is_baked(shard)) return false;
    const Bakeable& bakeable = state_->bakeable;
    const BakeSettings& settings = state_->settings;
    ShardIndex index;
    index.extent = state_->layout.extent(shard);
    const std::string begun = state_->folder + "/shard-" + std::to_string(shard);
    TERRANE_TRY(auto file, SealedWriter::create(begun, kShardKind));
    const int worker_count = worker_count_of(settings);
    const auto begin = [&](double share) -> Result<void> {
        if (!settings.progress || settings.progress(share)) return {};
        return fail(ErrorCode::cancelled, "shard " + std::to_string(shard) + " was given up");
    };
    TERRANE_TRY(
        const Extremes extremes,
        bake_chunks(
            bakeable, worker_count, index.extent.chunk_count(),
            [&](std::size_t i) { return index.extent.chunk_at(i); }, begin, file, index.chunks));
    index.max_error_m = extremes.max_error_m;
    index.steepest = extremes.steepest;
    const std::vector<SquareKey> squares = squares_of(index.extent);
    if (!squares.empty()) {
        TERRANE_TRY(bake_squares(
            bakeable, worker_count, squares.size(), [&](std::size_t i) { return squares[i]; }, file,
            index.squares));
    }
    ShardFile row;
    row.name = name_of(index);
    row.heights = index.chunks.front().heights;
    const std::uint64_t records_end = file.bytes();
    file.set_path(state_->folder + "/" + row.file_name());
    TERRANE_TRY(file.commit(encode(index)));
    row.bytes = file.bytes();
    row.index_bytes = static_cast<std::uint32_t>(row.bytes - records_end);
    TERRANE_TRY(
        write_text(state_->folder + "/" + piece_name(state_->pieces, shard), encode_row(row)));
    return true;
}

Result<std::int64_t> ShardBaker::verify_shard(std::int64_t shard, std::int64_t every) const {
    TERRANE_TRY(check_shard(shard, shard_count()));
    if (every < 1) {
        return fail(ErrorCode::invalid_argument,
                    "every must be at least 1, got " + std::to_string(every));
    }
    const ShardExtent extent = state_->layout.extent(shard);
    TERRANE_TRY(const auto piece, read_piece(*state_->files, state_->pieces, shard, extent));
    const ShardFile& row = piece.first;
    const ShardIndex& index = piece.second;
    const Bakeable& bakeable = state_->bakeable;
    const auto compare = [&](const StoredRecord& stored, const ContentHash& made,
                             std::size_t most_bytes, const std::string& what) -> Result<void> {
        TERRANE_TRY(const bool is_whole, is_whole_record(*state_->files, row, stored, most_bytes));
        if (is_whole && stored.hash == made) return {};
        return fail(ErrorCode::bad_data, "\"" + state_->folder + "/" + row.file_name() +
                                             "\": " + what + " is not that of the terrain");
    };
    std::int64_t compared = 0;
    const auto step = static_cast<std::size_t>(every);
    for (std::size_t i = 0; i < index.chunks.size(); i += step) {
        const ChunkKey key = extent.chunk_at(i);
        const Baked baked = bake_chunk(bakeable, key);
        if (baked.error) return tl::unexpected(*baked.error);
        TERRANE_TRY(compare(index.chunks[i], baked.record.hash, max_encoded_bytes(),
                            "chunk " + std::to_string(key.x) + ", " + std::to_string(key.y) +
                                " of level " + std::to_string(key.level)));
        ++compared;
    }
    const std::vector<SquareKey> squares = squares_of(extent);
    for (std::size_t i = 0; i < squares.size(); i += step) {
        const BakedSquare baked = bake_square(bakeable, squares[i]);
        if (baked.error) return tl::unexpected(*baked.error);
        TERRANE_TRY(compare(index.squares[i], baked.hash, max_square_bytes(),
                            "square " + std::to_string(squares[i].x) + ", " +
                                std::to_string(squares[i].y) + " of the raster"));
        ++compared;
    }
    return compared;
}

Result<StoreInfo> ShardBaker::combine(const std::string& folder) {
    TERRANE_TRY(const auto files, open_shard_folder(folder));
    TERRANE_TRY(const auto plan, read_text(*files, kPlanName));
    auto read = decode_manifest(plan, true);
    if (!read) {
        return fail(read.error().code,
                    "\"" + folder + "/" + std::string(kPlanName) + "\" " + read.error().message);
    }
    Manifest& manifest = *read;
    const ShardLayout layout(manifest.world);
    const std::string pieces = pieces_of(plan);
    double steepest = 0.0;
    for (std::int64_t shard = 0; shard < layout.count(); ++shard) {
        auto piece = read_piece(*files, pieces, shard, layout.extent(shard));
        if (!piece) {
            return fail(ErrorCode::bad_data, "\"" + folder + "\": shard " + std::to_string(shard) +
                                                 " of " + std::to_string(layout.count()) +
                                                 " is not baked: " + piece.error().message);
        }
        auto& [file, index] = *piece;
        manifest.shards.push_back(std::move(file));
        manifest.world.max_error_m = std::max(manifest.world.max_error_m, index.max_error_m);
        steepest = std::max(steepest, index.steepest);
    }
    manifest.world.rises =
        find_rises(manifest.world.lattice, std::move(manifest.world.rises), steepest);
    TERRANE_TRY(const auto text, encode(manifest));
    TERRANE_TRY(write_text(folder + "/" + std::string(kManifestName), text));
    return info_of(manifest);
}

}  // namespace terrane
