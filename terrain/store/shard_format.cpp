// SPDX-License-Identifier: MIT
#include "shard_format.h"

#include <terrane/store/bytes.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <type_traits>
#include <utility>

namespace terrane::internal {
namespace {

using Json = nlohmann::ordered_json;

/// Number of chunks in a subtree above a level below its root.
std::size_t chunks_above(int depth) { return ((std::size_t{1} << (2 * depth)) - 1) / 3; }

/// Every second bit of a number.
std::uint32_t even_bits(std::uint32_t number) {
    std::uint32_t bits = 0;
    for (int bit = 0; bit < 16; ++bit) bits |= (number >> (2 * bit) & 1u) << bit;
    return bits;
}

/// The place on a Z-order curve.
std::uint64_t z_order(std::uint32_t x, std::uint32_t y) {
    std::uint64_t order = 0;
    for (int bit = 0; bit < 32; ++bit) {
        order |= (std::uint64_t{x} >> bit & 1u) << (2 * bit) | (std::uint64_t{y} >> bit & 1u)
                                                                   << (2 * bit + 1);
    }
    return order;
}

}  // namespace

std::size_t ShardExtent::chunk_count() const { return chunks_above(level_count); }

ChunkKey ShardExtent::chunk_at(std::size_t index) const {
    int depth = 0;
    while (chunks_above(depth + 1) <= index) ++depth;
    const auto in_level = static_cast<std::uint32_t>(index - chunks_above(depth));
    return {static_cast<std::int32_t>(root.x * (std::int32_t{1} << depth)) +
                static_cast<std::int32_t>(even_bits(in_level)),
            static_cast<std::int32_t>(root.y * (std::int32_t{1} << depth)) +
                static_cast<std::int32_t>(even_bits(in_level >> 1)),
            static_cast<std::uint8_t>(root.level + depth)};
}

std::size_t ShardExtent::index_of(const ChunkKey& key) const {
    const int depth = key.level - root.level;
    const std::int32_t side = std::int32_t{1} << depth;
    return chunks_above(depth) +
           static_cast<std::size_t>(z_order(static_cast<std::uint32_t>(key.x - root.x * side),
                                            static_cast<std::uint32_t>(key.y - root.y * side)));
}

std::vector<SquareKey> squares_of(const ShardExtent& extent) {
    std::vector<SquareKey> squares;
    squares.reserve(extent.squares.count());
    for (int y = 0; y < extent.squares.row_count; ++y) {
        for (int x = 0; x < extent.squares.column_count; ++x) squares.push_back({x, y});
    }
    std::ranges::sort(squares, {}, [](const SquareKey& square) {
        return z_order(static_cast<std::uint32_t>(square.x), static_cast<std::uint32_t>(square.y));
    });
    for (SquareKey& square : squares) {
        square.x += extent.squares.first_column;
        square.y += extent.squares.first_row;
    }
    return squares;
}

ShardLayout::ShardLayout(const StoreWorld& world) : world_(world) {
    const Lattice& lattice = world.lattice;
    for (int last = lattice.finest_level; last >= 0;) {
        const int first = std::max(last - kShardLevels + 1, 0);
        Band band{first, last - first + 1, 0, std::int64_t{lattice.root_count_x} << first,
                  std::int64_t{lattice.root_count_y} << first};
        bands_.insert(bands_.begin(), band);
        last = first - 1;
    }
    for (Band& band : bands_) {
        band.first_shard = count_;
        const double most = static_cast<double>(band.columns) * static_cast<double>(band.rows);
        if (static_cast<double>(count_) + most > static_cast<double>(kMostShards)) {
            count_ = kMostShards + 1;
            return;
        }
        count_ += band.columns * band.rows;
    }
    if (!world.raster) return;
    // The shard column or row over which a square begins, clamped to the world.
    const BilinearGrid& grid = world.raster->grid;
    const std::int64_t side = lattice.chunk_side(bands_.back().first_level);
    const auto shards_of = [&](int first, int count, std::int64_t shards, std::int64_t low,
                               auto&& lattice_index, std::vector<std::int64_t>& out) {
        for (int i = first; i < first + count; ++i) {
            const std::int64_t from_low =
                lattice_index(std::int64_t{i} * StoredRaster::kSquareSide) - low;
            out.push_back(
                std::clamp<std::int64_t>(from_low < 0 ? 0 : from_low / side, 0, shards - 1));
        }
    };
    const auto index_at = [&](double place, double origin) {
        constexpr double kFar = 0x1p60;
        return static_cast<std::int64_t>(
            std::clamp(std::floor((place - origin) / lattice.spacing), -kFar, kFar));
    };
    shards_of(
        world.raster->squares.first_column, world.raster->squares.column_count,
        bands_.back().columns, lattice.west(),
        [&](std::int64_t column) {
            return grid.aligned ? grid.first.x + column * grid.base_step()
                                : index_at(grid.west + static_cast<double>(column) * grid.cell_x,
                                           lattice.origin_x);
        },
        shard_columns_);
    shards_of(
        world.raster->squares.first_row, world.raster->squares.row_count, bands_.back().rows,
        lattice.south(),
        [&](std::int64_t row) {
            return grid.aligned ? grid.first.y + row * grid.base_step()
                                : index_at(grid.south + static_cast<double>(row) * grid.cell_y,
                                           lattice.origin_y);
        },
        shard_rows_);
}

ShardExtent ShardLayout::extent(std::int64_t shard) const {
    auto band = bands_.begin();
    while (shard >= band->first_shard + band->columns * band->rows) ++band;
    const std::int64_t in_band = shard - band->first_shard;
    const std::int64_t x = in_band % band->columns, y = in_band / band->columns;
    const std::int64_t per_root = std::int64_t{1} << band->first_level;
    ShardExtent extent;
    extent.root = {static_cast<std::int32_t>(world_.lattice.first_root_x * per_root + x),
                   static_cast<std::int32_t>(world_.lattice.first_root_y * per_root + y),
                   static_cast<std::uint8_t>(band->first_level)};
    extent.level_count = band->level_count;
    if (!world_.raster || band != bands_.end() - 1) return extent;
    const auto range = [](const std::vector<std::int64_t>& shards, std::int64_t of, int first,
                          int& first_out, int& count_out) {
        const auto [begin, end] = std::equal_range(shards.begin(), shards.end(), of);
        first_out = first + static_cast<int>(begin - shards.begin());
        count_out = static_cast<int>(end - begin);
    };
    range(shard_columns_, x, world_.raster->squares.first_column, extent.squares.first_column,
          extent.squares.column_count);
    range(shard_rows_, y, world_.raster->squares.first_row, extent.squares.first_row,
          extent.squares.row_count);
    return extent;
}

std::int64_t ShardLayout::shard_in(const Band& band, std::int64_t x, std::int64_t y) const {
    return band.first_shard + y * band.columns + x;
}

std::int64_t ShardLayout::shard_of(const ChunkKey& key) const {
    auto band = bands_.begin();
    while (key.level >= band->first_level + band->level_count) ++band;
    const int depth = key.level - band->first_level;
    const std::int64_t per_root = std::int64_t{1} << band->first_level;
    return shard_in(*band, (key.x >> depth) - world_.lattice.first_root_x * per_root,
                    (key.y >> depth) - world_.lattice.first_root_y * per_root);
}

std::int64_t ShardLayout::shard_of(const SquareKey& square) const {
    const auto at = [](const std::vector<std::int64_t>& shards, int index, int first) {
        return shards[static_cast<std::size_t>(index - first)];
    };
    return shard_in(bands_.back(),
                    at(shard_columns_, square.x, world_.raster->squares.first_column),
                    at(shard_rows_, square.y, world_.raster->squares.first_row));
}

namespace {

/// The part of an index that does not depend on the compressor.
void put_content(ByteWriter& out, const ShardIndex& index) {
    out.put(std::int32_t{index.extent.root.level});
    out.put(index.extent.root.x);
    out.put(index.extent.root.y);
    out.put(std::int32_t{index.extent.level_count});
    for (const int number : {index.extent.squares.first_column, index.extent.squares.first_row,
                             index.extent.squares.column_count, index.extent.squares.row_count}) {
        out.put(std::int32_t{number});
    }
    out.put(index.max_error_m);
    out.put(index.steepest);
    for (const ChunkRecord& chunk : index.chunks) {
        put_hash(out, chunk.hash);
        out.put(chunk.heights.low);
        out.put(chunk.heights.high);
    }
    for (const StoredRecord& square : index.squares) put_hash(out, square.hash);
}

void put_place(ByteWriter& out, const StoredRecord& record) {
    out.put(record.offset);
    out.put(record.bytes);
}

void get_place(ByteReader& in, StoredRecord& record) {
    record.offset = in.get<std::uint64_t>();
    record.bytes = in.get<std::uint32_t>();
}

}  // namespace

std::vector<std::uint8_t> encode(const ShardIndex& index) {
    ByteWriter out;
    put_content(out, index);
    for (const ChunkRecord& chunk : index.chunks) put_place(out, chunk);
    for (const StoredRecord& square : index.squares) put_place(out, square);
    return out.bytes();
}

std::size_t encoded_bytes(const ShardExtent& extent) {
    constexpr std::size_t kBegin = 48, kChunk = 44, kSquare = 28;
    return kBegin + kChunk * extent.chunk_count() + kSquare * extent.squares.count();
}

std::string name_of(const ShardIndex& index) {
    ByteWriter out;
    put_content(out, index);
    return hash_of(out.bytes()).text();
}

Result<ShardIndex> decode_shard(std::span<const std::uint8_t> bytes, const ShardExtent& extent) {
    const auto senseless = [] {
        return fail(ErrorCode::bad_data, "the index of a shard makes no sense");
    };
    if (bytes.size() != encoded_bytes(extent)) return senseless();
    ByteReader in(bytes);
    ShardIndex index;
    index.extent = extent;
    const auto level = in.get<std::int32_t>();
    const auto x = in.get<std::int32_t>(), y = in.get<std::int32_t>();
    const auto level_count = in.get<std::int32_t>();
    std::array<std::int32_t, 4> squares{};
    in.get_each(std::span<std::int32_t>(squares));
    if (level != extent.root.level || x != extent.root.x || y != extent.root.y ||
        level_count != extent.level_count ||
        squares !=
            std::array<std::int32_t, 4>{extent.squares.first_column, extent.squares.first_row,
                                        extent.squares.column_count, extent.squares.row_count}) {
        return senseless();
    }
    index.max_error_m = in.get<double>();
    index.steepest = in.get<double>();
    index.chunks.resize(extent.chunk_count());
    for (ChunkRecord& chunk : index.chunks) {
        chunk.hash = get_hash(in);
        chunk.heights.low = in.get<double>();
        chunk.heights.high = in.get<double>();
    }
    index.squares.resize(extent.squares.count());
    for (StoredRecord& square : index.squares) square.hash = get_hash(in);
    for (ChunkRecord& chunk : index.chunks) get_place(in, chunk);
    for (StoredRecord& square : index.squares) get_place(in, square);
    if (!in.is_done()) return senseless();
    return index;
}

// JSON writes doubles with as many digits as give the same bits back. An infinite bound is written as null.

namespace {

Json json_of(const std::vector<double>& numbers) {
    Json list = Json::array();
    for (const double number : numbers) list.push_back(number);
    return list;
}

Json json_of(const StoredRaster& raster) {
    const BilinearGrid& grid = raster.grid;
    Json json;
    json["samples"] = {grid.columns, grid.rows};
    json["cell_m"] = {grid.cell_x, grid.cell_y};
    json["south_west_m"] = {grid.west, grid.south};
    json["samples_are_lattice_points"] = grid.aligned;
    json["cell_log2"] = grid.cell_log2;
    json["first"] = {grid.first.x, grid.first.y};
    json["base_m"] = raster.packing.base();
    json["step_m"] = raster.packing.step();
    json["is_integer"] = raster.packing.is_integer();
    json["rounding_m"] = raster.rounding;
    json["rises_m"] = json_of(raster.rises);
    json["squares"] = {raster.squares.first_column, raster.squares.first_row,
                       raster.squares.column_count, raster.squares.row_count};
    return json;
}

/// The members of a manifest other than the shards.
Json json_of(const StoreWorld& world, const std::string& fingerprint) {
    const Lattice& lattice = world.lattice;
    const WorldRect& extent = world.extent;
    Json json;
    json["format"] = "terrane shards";
    json["version"] = kShardKind.version;
    json["lattice"] = {{"origin_m", {lattice.origin_x, lattice.origin_y}},
                       {"spacing_m", lattice.spacing},
                       {"quantum_m", lattice.quantum},
                       {"finest_level", lattice.finest_level},
                       {"first_root", {lattice.first_root_x, lattice.first_root_y}},
                       {"root_count", {lattice.root_count_x, lattice.root_count_y}}};
    json["extent_m"] = {extent.west, extent.south, extent.east, extent.north};
    json["max_error_m"] = world.max_error_m;
    json["rises_m"] = json_of(world.rises);
    json["raster"] = world.raster ? json_of(*world.raster) : Json(nullptr);
    json["fingerprint"] = fingerprint;
    json["note"] = world.note;
    return json;
}

/// Reads members of JSON; remembers the first that is missing or of another type.
class MemberReader {
public:
    explicit MemberReader(const Json& json) : json_(json) {}

    template <class T>
    void get(const char* name, T& value_out) {
        if (const Json* const member = find(name)) read(*member, name, value_out);
    }
    template <class T, class... More>
    void get_list(const char* name, T& first_out, More&... more_out) {
        if (const Json* const member = find(name)) read_list(*member, name, first_out, more_out...);
    }
    template <class T, class... More>
    void read_list(const Json& list, const char* name, T& first_out, More&... more_out) {
        if (!list.is_array() || list.size() != 1 + sizeof...(more_out)) return miss(name);
        std::size_t at = 0;
        read(list[at++], name, first_out);
        (read(list[at++], name, more_out), ...);
    }
    const Json* find(const char* name) {
        if (json_.is_object()) {
            if (const auto member = json_.find(name); member != json_.end()) return &*member;
        }
        miss(name);
        return nullptr;
    }
    void miss(const char* name) {
        if (wrong_.empty()) wrong_ = name;
    }
    const std::string& wrong() const { return wrong_; }

private:
    void read(const Json& json, const char* name, double& value_out) {
        if (json.is_null()) {
            value_out = std::numeric_limits<double>::infinity();
        } else if (json.is_number()) {
            value_out = json.get<double>();
        } else {
            miss(name);
        }
    }
    template <std::integral T>
    void read(const Json& json, const char* name, T& value_out) {
        if constexpr (std::is_same_v<T, bool>) {
            if (!json.is_boolean()) return miss(name);
            value_out = json.get<bool>();
        } else {
            const bool fits =
                json.is_number_unsigned()
                    ? std::in_range<T>(json.get<std::uint64_t>())
                    : json.is_number_integer() && std::in_range<T>(json.get<std::int64_t>());
            if (!fits) return miss(name);
            value_out = json.get<T>();
        }
    }
    void read(const Json& json, const char* name, std::string& value_out) {
        if (!json.is_string()) return miss(name);
        value_out = json.get<std::string>();
    }
    /// Requires as many numbers as there are.
    void read(const Json& json, const char* name, std::vector<double>& values_out) {
        if (!json.is_array() || json.size() != values_out.size()) return miss(name);
        for (std::size_t i = 0; i < values_out.size(); ++i) read(json[i], name, values_out[i]);
    }

    const Json& json_;
    std::string wrong_;
};

/// Reads the output of json_of() and sets `wrong_out` if it makes no sense.
StoredRaster raster_of(const Json& json, const Lattice& lattice, std::string& wrong_out) {
    StoredRaster raster;
    BilinearGrid& grid = raster.grid;
    grid.lattice = lattice;
    MemberReader in(json);
    in.get_list("samples", grid.columns, grid.rows);
    in.get_list("cell_m", grid.cell_x, grid.cell_y);
    in.get_list("south_west_m", grid.west, grid.south);
    in.get("samples_are_lattice_points", grid.aligned);
    in.get("cell_log2", grid.cell_log2);
    in.get_list("first", grid.first.x, grid.first.y);
    double base = 0.0, step = 0.0;
    bool is_integer = false;
    in.get("base_m", base);
    in.get("step_m", step);
    in.get("is_integer", is_integer);
    raster.packing = SamplePacking::of_parts(base, step, is_integer);
    in.get("rounding_m", raster.rounding);
    raster.rises.resize(rise_distances(lattice).size());
    in.get("rises_m", raster.rises);
    in.get_list("squares", raster.squares.first_column, raster.squares.first_row,
                raster.squares.column_count, raster.squares.row_count);
    if (!in.wrong().empty()) {
        wrong_out = "raster." + in.wrong();
    } else if (!is_valid(raster)) {
        wrong_out = "raster";
    }
    return raster;
}

bool is_shard_name(const std::string& name) {
    return name.size() == 32 && std::ranges::all_of(name, [](char c) {
               return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
           });
}

bool is_valid(const ShardFile& shard) {
    return is_shard_name(shard.name) && shard.index_bytes > 0 && shard.index_bytes < shard.bytes &&
           std::isfinite(shard.heights.low) && std::isfinite(shard.heights.high) &&
           shard.heights.low <= shard.heights.high;
}

Json json_of(const ShardFile& shard) {
    return Json::array(
        {shard.name, shard.bytes, shard.index_bytes, shard.heights.low, shard.heights.high});
}

/// Absent if the JSON is no row of a shard.
std::optional<ShardFile> shard_of(const Json& row) {
    ShardFile shard;
    MemberReader in(row);
    in.read_list(row, "shards", shard.name, shard.bytes, shard.index_bytes, shard.heights.low,
                 shard.heights.high);
    if (!in.wrong().empty() || !is_valid(shard)) return std::nullopt;
    return shard;
}

}  // namespace

std::string encode_row(const ShardFile& shard) { return json_of(shard).dump() + "\n"; }

Result<ShardFile> decode_row(std::string_view text) {
    auto shard = shard_of(Json::parse(text, nullptr, false));
    if (!shard) return fail(ErrorCode::bad_data, "the row of the shard is damaged");
    return *shard;
}

Result<std::string> encode(const Manifest& manifest) {
    Json json = json_of(manifest.world, manifest.fingerprint);
    if (!manifest.shards.empty()) {
        json["sha"] = sha_of(manifest);
        Json rows = Json::array();
        for (const ShardFile& shard : manifest.shards) {
            rows.push_back(json_of(shard));
        }
        json["shards"] = std::move(rows);
    }
    try {
        return json.dump() + "\n";
    } catch (const Json::exception&) {
        return fail(ErrorCode::invalid_argument, "note and fingerprint must be UTF-8");
    }
}

Result<Manifest> decode_manifest(std::string_view text, bool is_plan) {
    const auto bad = [](const std::string& what) { return fail(ErrorCode::bad_data, what); };
    const Json json = Json::parse(text, nullptr, false);
    MemberReader in(json);
    std::string format;
    in.get("format", format);
    if (format != "terrane shards") return bad("is no list of shards");
    std::uint32_t version = 0;
    in.get("version", version);
    if (version != kShardKind.version) {
        return bad("is of version " + std::to_string(version) + ", this program reads " +
                   std::to_string(kShardKind.version) + "; the terrain must be baked again");
    }
    Manifest manifest;
    StoreWorld& world = manifest.world;
    Lattice& lattice = world.lattice;
    if (const Json* const member = in.find("lattice")) {
        MemberReader of_lattice(*member);
        of_lattice.get_list("origin_m", lattice.origin_x, lattice.origin_y);
        of_lattice.get("spacing_m", lattice.spacing);
        of_lattice.get("quantum_m", lattice.quantum);
        of_lattice.get("finest_level", lattice.finest_level);
        of_lattice.get_list("first_root", lattice.first_root_x, lattice.first_root_y);
        of_lattice.get_list("root_count", lattice.root_count_x, lattice.root_count_y);
        if (!of_lattice.wrong().empty() || !lattice.validate()) return bad("has no valid lattice");
    }
    WorldRect& extent = world.extent;
    in.get_list("extent_m", extent.west, extent.south, extent.east, extent.north);
    in.get("max_error_m", world.max_error_m);
    if (in.wrong().empty()) world.rises.resize(rise_distances(lattice).size());
    in.get("rises_m", world.rises);
    if (const Json* const member = in.find("raster"); member != nullptr && !member->is_null()) {
        std::string wrong;
        world.raster = raster_of(*member, lattice, wrong);
        if (!wrong.empty()) in.miss(wrong.c_str());
    }
    in.get("fingerprint", manifest.fingerprint);
    in.get("note", world.note);
    if (!in.wrong().empty()) return bad("has no valid member \"" + in.wrong() + "\"");
    const std::int64_t count = ShardLayout(world).count();
    if (count > kMostShards) return bad("has more than 1048576 shards");
    if (is_plan) return manifest;
    const Json* const rows = in.find("shards");
    if (rows == nullptr || !rows->is_array() || rows->size() != static_cast<std::size_t>(count)) {
        return bad("does not have " + std::to_string(count) + " shards");
    }
    manifest.shards.reserve(rows->size());
    for (const Json& row : *rows) {
        auto shard = shard_of(row);
        if (!shard) {
            return bad("has a damaged row of shard " + std::to_string(manifest.shards.size()));
        }
        manifest.shards.push_back(std::move(*shard));
    }
    return manifest;
}

std::string sha_of(const Manifest& manifest) {
    std::string text =
        json_of(manifest.world, "").dump(-1, ' ', true, Json::error_handler_t::replace);
    for (const ShardFile& shard : manifest.shards) text += shard.name;
    return sha256(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

}  // namespace terrane::internal
