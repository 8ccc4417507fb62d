// SPDX-License-Identifier: MIT
#include "opening_files.h"

#include <terrane/store/bytes.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

namespace terrane::internal {
namespace {

/// The version is incremented when the bounds that are computed from the same samples change.
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
    rounding.put(fine.samples().base());
    rounding.put(fine.samples().rounding());
    hasher.add(rounding.bytes());
    constexpr int kRows = 64;
    std::vector<double> strip(static_cast<std::size_t>(grid.columns) * kRows);
    for (int row = 0; row < grid.rows; row += kRows) {
        const int rows = std::min(kRows, grid.rows - row);
        strip.resize(static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(rows));
        TERRANE_TRY(fine.samples().read(0, row, grid.columns, rows, strip));
        ByteWriter out;
        out.put_each(std::span(std::as_const(strip)));
        hasher.add(out.bytes());
    }
    return hasher.value();
}

/// Path of a cache file next to the raster, named after raster and lattice; "" if the raster is not a regular file.
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
    TERRANE_TRY(const auto key, make_key(fine));
    made.key_ = key;
    if (cache.place == DemCache::Place::beside) {
        if (std::string file = file_beside(raster_path, grid); !file.empty()) {
            made.paths_.push_back(std::move(file));
        }
    }
    if (!cache.folder.empty()) {
        made.paths_.push_back(cache.folder + "/" + key.text() + ".terrane-bounds");
    }
    return made;
}

std::optional<OpeningBounds> OpeningCache::load(const std::shared_ptr<const FineSurface>& fine) {
    for (const std::string& place : paths_) {
        const auto file = SealedReader::open(place, kKind);
        if (!file) {
            // Absent and unreadable files are not reported.
            if (file.error().code != ErrorCode::io) {
                use_.note = file.error().message + "; its bounds are made again";
            }
            continue;
        }
        ByteReader in(file->directory());
        const ContentHash key{in.get<std::uint64_t>(), in.get<std::uint64_t>()};
        if (key != key_) continue;  // stale: belongs to other heights
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

namespace {

constexpr SealedKind kScanKind{{'S', 'C', 'A', 'N'}, 2};

}  // namespace

Result<void> RasterScan::write(const std::string& path, const std::string& file_versions,
                               const RasterStore& store, const BilinearGrid& grid,
                               OpeningBounds& bounds, const GetFlags& get_flags) {
    if (!store.is_whole()) TERRANE_TRY(bounds.tiers->add_cell_flags(get_flags));
    std::error_code ignored;  // reported when the file cannot be created
    std::filesystem::create_directories(std::filesystem::path(path).parent_path(), ignored);
    TERRANE_TRY(auto file, SealedWriter::create(path, kScanKind));
    ByteWriter directory;
    directory.put_each(std::span<const std::uint8_t>(bytes_of(grid)));
    directory.put_text(file_versions);
    TERRANE_TRY(store.write(file, directory));
    TERRANE_TRY(bounds.pyramid.write_tiles(file, directory));
    ByteWriter tiers;
    TERRANE_TRY(bounds.tiers->write_tiles(file, tiers));
    TERRANE_TRY(const auto record, SealedRecord::append(file, tiers.bytes()));
    record.put(directory);
    return file.commit(directory.bytes());
}

Result<RasterScan> RasterScan::open(const std::string& path, const std::string& raster_path,
                                    const BilinearGrid& grid) {
    const auto other = [&] {
        return fail(ErrorCode::invalid_argument, "\"" + path +
                                                     "\" is the scan of another raster than \"" +
                                                     raster_path + "\", or for another lattice");
    };
    TERRANE_TRY(auto file, SealedReader::open(path, kScanKind));
    RasterScan scan;
    scan.file_ = std::make_shared<SealedReader>(std::move(file));
    ByteReader in(scan.file_->directory());
    const std::vector<std::uint8_t> wanted = bytes_of(grid);
    std::vector<std::uint8_t> found(wanted.size());
    in.get_each(std::span<std::uint8_t>(found));
    if (found != wanted) return other();
    scan.file_versions_ = in.get_text();
    TERRANE_TRY(scan.samples_, ScannedSamples::read(grid.columns, grid.rows, scan.file_, in));
    TERRANE_TRY(scan.pyramid_, HeightPyramid::read_tiles(grid, scan.file_, in));
    scan.tiers_ = SealedRecord::get(in);
    if (!in.is_done()) return other();
    return scan;
}

Result<OpeningBounds> RasterScan::bounds(const std::shared_ptr<const FineSurface>& fine) const {
    TERRANE_TRY(const auto bytes, tiers_.read(*file_));
    ByteReader in(bytes);
    TERRANE_TRY(auto tiers, BoundTiers::read_tiles(fine, file_, in, !samples_->is_whole()));
    if (!in.is_done()) {
        return fail(ErrorCode::bad_data, "\"" + file_->path() + "\" is damaged");
    }
    return OpeningBounds{*pyramid_, std::move(tiers)};
}

}  // namespace terrane::internal
