// SPDX-License-Identifier: MIT
#include "opening_cache.h"

#include <terrane/store/bytes.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

namespace terrane::internal {
namespace {

/// The version changes with every change of the bounds computed from the same samples.
constexpr SealedKind kKind{{'B', 'N', 'D', 'S'}, 1};
constexpr std::int64_t kFewSamples = std::int64_t{1} << 16;

std::vector<std::uint8_t> bytes_of(const BilinearGrid& grid) {
    ByteWriter out;
    out.put(std::int32_t{grid.columns});
    out.put(std::int32_t{grid.rows});
    out.put(grid.cell_x);
    out.put(grid.cell_y);
    out.put(grid.west);
    out.put(grid.south);
    out.put(static_cast<std::uint8_t>(grid.aligned));
    out.put(std::int32_t{grid.cell_log2});
    out.put(grid.first.x);
    out.put(grid.first.y);
    out.put(grid.lattice.origin_x);
    out.put(grid.lattice.origin_y);
    out.put(grid.lattice.spacing);
    out.put(grid.lattice.quantum);
    out.put(std::int32_t{grid.lattice.finest_level});
    out.put(grid.lattice.first_root_x);
    out.put(grid.lattice.first_root_y);
    out.put(grid.lattice.root_count_x);
    out.put(grid.lattice.root_count_y);
    return out.bytes();
}

Result<ContentHash> make_key(const FineSurface& fine) {
    const BilinearGrid& grid = fine.grid();
    ContentHasher hasher;
    hasher.add(bytes_of(grid));
    ByteWriter rounding;
    rounding.put(fine.store().base());
    rounding.put(fine.store().rounding());
    hasher.add(rounding.bytes());
    constexpr int kRows = 64;
    std::vector<double> strip(static_cast<std::size_t>(grid.columns) * kRows);
    for (int row = 0; row < grid.rows; row += kRows) {
        const int rows = std::min(kRows, grid.rows - row);
        strip.resize(static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(rows));
        if (auto read = fine.store().read(0, row, grid.columns, rows, strip); !read) {
            return tl::unexpected(read.error());
        }
        ByteWriter out;
        out.put_each(std::span(std::as_const(strip)));
        hasher.add(out.bytes());
    }
    return hasher.value();
}

/// A raster's path, made unique per lattice; "" if it is no file in a folder.
std::string file_beside(const std::string& raster_path, const BilinearGrid& grid) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(raster_path, error)) return {};
    return raster_path + "." + hash_of(bytes_of(grid)).text().substr(0, 8) + ".terrane-bounds";
}

}  // namespace

Result<OpeningCache> OpeningCache::create(const DemCache& cache, const std::string& raster_path,
                                          const FineSurface& fine) {
    OpeningCache made;
    const BilinearGrid& grid = fine.grid();
    const bool is_small = std::int64_t{grid.columns} * grid.rows < kFewSamples;
    if (cache.place == DemCache::Place::none || is_small) return made;
    const auto key = make_key(fine);
    if (!key) return tl::unexpected(key.error());
    made.key_ = *key;
    if (cache.place == DemCache::Place::beside) {
        if (std::string file = file_beside(raster_path, grid); !file.empty()) {
            made.paths_.push_back(std::move(file));
        }
    }
    if (!cache.folder.empty()) {
        made.paths_.push_back(cache.folder + "/" + key->text() + ".terrane-bounds");
    }
    return made;
}

std::optional<OpeningBounds> OpeningCache::load(const std::shared_ptr<const FineSurface>& fine) {
    for (const std::string& place : paths_) {
        const auto file = SealedReader::open(place, kKind);
        if (!file) {
            // A file that is absent or not readable is not reported.
            if (file.error().code != ErrorCode::io) {
                use_.note = file.error().message + "; its bounds are made again";
            }
            continue;
        }
        ByteReader in(file->directory());
        const ContentHash key{in.get<std::uint64_t>(), in.get<std::uint64_t>()};
        if (key != key_) continue;  // stale: of other heights
        auto pyramid = HeightPyramid::read(fine->grid(), in);
        if (!pyramid) continue;
        auto tiers = BoundTiers::read(fine, in);
        if (!tiers || !in.is_done()) continue;
        use_.is_hit = true;
        return OpeningBounds{std::move(*pyramid), std::move(*tiers)};
    }
    return std::nullopt;
}

void OpeningCache::save(const OpeningBounds& bounds) {
    if (paths_.empty()) return;
    ByteWriter out;
    out.put(key_.low);
    out.put(key_.high);
    bounds.pyramid.write(out);
    bounds.tiers->write(out);
    std::string failure;
    for (const std::string& place : paths_) {
        std::error_code ignored;  // reported when the file cannot be created
        std::filesystem::create_directories(std::filesystem::path(place).parent_path(), ignored);
        auto file = SealedWriter::create(place, kKind);
        if (file) {
            const auto done = file->commit(out.bytes());
            if (done) return;
            failure = done.error().message;
        } else {
            failure = file.error().message;
        }
    }
    if (use_.note.empty()) use_.note = failure + "; opening this raster again will take as long";
}

}  // namespace terrane::internal
