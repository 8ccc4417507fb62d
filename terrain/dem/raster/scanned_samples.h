// SPDX-License-Identifier: MIT
#pragma once

#include "bilinear/raster_samples.h"

#include <terrane/base/result.h>
#include <terrane/store/bytes.h>
#include <terrane/store/sealed_file.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace terrane::internal {

/// Part of a sealed file, compressed, with the hash of its content.
struct SealedRecord {
    std::uint64_t offset = 0, stored_bytes = 0, content_bytes = 0;
    ContentHash hash;

    static Result<SealedRecord> append(SealedWriter& file, std::span<const std::uint8_t> content);
    /// Fails: io; bad_data if the record is damaged
    Result<std::vector<std::uint8_t>> read(const SealedReader& file) const;

    void put(ByteWriter& out) const;
    static SealedRecord get(ByteReader& in);
};

/// Writes a table of entries with put() and get(), as SealedRecord has, to a file: pages are records of the file.
template <typename Entry>
class SealedTableWriter {
public:
    static constexpr std::size_t kPageEntries = 4096;

    /// Fails: io
    Result<void> add(const Entry& entry, SealedWriter& file) {
        entry.put(page_);
        return ++in_page_ == kPageEntries ? end_page(file) : Result<void>{};
    }
    /// Writes the last page, and to `directory` what SealedTable needs.
    /// Fails: io
    Result<void> finish(SealedWriter& file, ByteWriter& directory) {
        if (in_page_ > 0) TERRANE_TRY(end_page(file));
        for (const SealedRecord& record : pages_) record.put(directory);
        return {};
    }

private:
    Result<void> end_page(SealedWriter& file) {
        TERRANE_TRY(const auto record, SealedRecord::append(file, page_.bytes()));
        pages_.push_back(record);
        page_ = {};
        in_page_ = 0;
        return {};
    }

    ByteWriter page_;
    std::size_t in_page_ = 0;
    std::vector<SealedRecord> pages_;
};

/// Reads a table. A page is read with its first entry; the last 64 pages that were used are kept.
/// Threads: any number at once.
template <typename Entry>
class SealedTable {
public:
    /// @param count of entries
    SealedTable(std::size_t count, std::shared_ptr<const SealedReader> file, ByteReader& directory)
        : file_(std::move(file)) {
        for (std::size_t at = 0; at < count && !directory.has_failed(); at += kPageEntries) {
            pages_.push_back(SealedRecord::get(directory));
        }
    }

    /// Fails: io; bad_data if the page is damaged
    Result<Entry> get(std::size_t index) const {
        TERRANE_TRY(const auto page, cache_.get(static_cast<int>(index / kPageEntries), 0));
        if (index % kPageEntries >= page->size()) {
            return fail(ErrorCode::bad_data, "\"" + file_->path() + "\" is damaged");
        }
        return (*page)[index % kPageEntries];
    }

private:
    static constexpr std::size_t kPageEntries = SealedTableWriter<Entry>::kPageEntries;
    static constexpr std::size_t kMostPages = 64;
    using Page = std::vector<Entry>;

    Result<std::shared_ptr<const Page>> read_page(int index) const {
        TERRANE_TRY(const auto bytes, pages_[static_cast<std::size_t>(index)].read(*file_));
        auto page = std::make_shared<Page>();
        for (ByteReader in(bytes); !in.is_done() && !in.has_failed();) {
            page->push_back(Entry::get(in));
        }
        return page;
    }

    std::shared_ptr<const SealedReader> file_;
    std::vector<SealedRecord> pages_;
    TileCache<Page> cache_{kMostPages, [this](int index, int) { return read_page(index); }};
};

/// Samples of a square, filled.
struct ScannedSquare {
    std::vector<std::uint32_t> packed;  ///< [rows * columns]
    std::vector<std::uint8_t>
        flags;  ///< [rows * columns] bits of CellFlag; empty: all samples have data
};

/// What an earlier pass over a raster found, so that its samples can be read by window: a hash for each square of
/// kSide x kSide samples, which finds a raster that has changed since; and the squares with nodata, whose filling
/// depends on the whole raster.
/// Threads: any number at once.
class ScannedSamples {
public:
    static constexpr int kSide = 256;

    /// Statistics and packing of the samples.
    struct Summary {
        double min_m = 0.0, max_m = 0.0, nodata_share = 0.0, filled_share = 0.0;  ///< as in DemInfo
        double base = 0.0, step = 1.0;  ///< of the packing
        bool is_integer = false;
        double rounding = 0.0;  ///< RasterSamples::rounding()
    };
    using GetSquare = std::function<Result<ScannedSquare>(int square_x, int square_y)>;

    /// Writes hashes and the squares with nodata as records of a file, and the rest to `directory`.
    ///
    /// Fails: io; as get_square
    static Result<void> write(int columns, int rows, const Summary& summary,
                              const GetSquare& get_square, SealedWriter& file,
                              ByteWriter& directory);
    /// Fails: bad_data if the bytes do not match a raster of this size
    static Result<std::shared_ptr<const ScannedSamples>> read(
        int columns, int rows, std::shared_ptr<const SealedReader> file, ByteReader& directory);

    const Summary& summary() const { return summary_; }
    /// Hash of all samples.
    const ContentHash& hash() const { return hash_; }
    /// Whether no sample is nodata.
    bool is_whole() const { return is_whole_; }

    /// Whether a square has nodata; square() then has its samples.
    /// Fails: io; bad_data if the file is damaged; so do the functions below
    Result<bool> has_nodata(int square_x, int square_y) const;
    Result<ScannedSquare> square(int square_x, int square_y) const;
    /// Whether these are the samples of a square, with no_data() for those without data.
    Result<bool> is_same(int square_x, int square_y, std::span<const std::uint32_t> packed) const;
    /// No packed height.
    std::uint32_t no_data() const { return no_data(summary_.is_integer); }

private:
    static constexpr std::uint32_t no_data(bool is_integer) {
        return is_integer ? 0x80000000u : 0xffffffffu;  // the least integer, or a NaN
    }
    struct Square {
        std::uint64_t hash = 0;
        SealedRecord filled;  ///< empty if all samples have data

        void put(ByteWriter& out) const;
        static Square get(ByteReader& in);
    };

    ScannedSamples(int columns, int rows, std::shared_ptr<const SealedReader> file,
                   ByteReader& directory);
    static std::uint64_t hash_of_samples(std::span<const std::uint32_t> packed);
    static int squares_along(int samples) { return (samples + kSide - 1) / kSide; }
    static std::size_t square_count(int columns, int rows) {
        return static_cast<std::size_t>(squares_along(rows)) *
               static_cast<std::size_t>(squares_along(columns));
    }
    Result<Square> entry(int square_x, int square_y) const {
        return squares_.get(static_cast<std::size_t>(square_y) *
                                static_cast<std::size_t>(squares_along(columns_)) +
                            static_cast<std::size_t>(square_x));
    }

    int columns_, rows_;
    std::shared_ptr<const SealedReader> file_;
    Summary summary_;
    ContentHash hash_;
    bool is_whole_ = false;
    SealedTable<Square> squares_;  ///< row by row from the south-west
};

}  // namespace terrane::internal
