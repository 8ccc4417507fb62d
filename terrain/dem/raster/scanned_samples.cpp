// SPDX-License-Identifier: MIT
#include "raster/scanned_samples.h"

#include <algorithm>
#include <utility>

namespace terrane::internal {

Result<SealedRecord> SealedRecord::append(SealedWriter& file,
                                          std::span<const std::uint8_t> content) {
    const std::vector<std::uint8_t> stored = compress(content, 1);
    SealedRecord record;
    TERRANE_TRY(record.offset, file.append(stored));
    record.stored_bytes = stored.size();
    record.content_bytes = content.size();
    record.hash = hash_of(content);
    return record;
}

Result<std::vector<std::uint8_t>> SealedRecord::read(const SealedReader& file) const {
    std::vector<std::uint8_t> stored(static_cast<std::size_t>(stored_bytes));
    TERRANE_TRY(file.read(offset, stored));
    std::vector<std::uint8_t> content(static_cast<std::size_t>(content_bytes));
    const Result<std::size_t> size = decompress(stored, content);
    if (!size || *size != content.size() || hash_of(content) != hash) {
        return fail(ErrorCode::bad_data, "\"" + file.path() + "\" is damaged");
    }
    return content;
}

void SealedRecord::put(ByteWriter& out) const {
    out.put(offset);
    out.put(stored_bytes);
    out.put(content_bytes);
    out.put(hash.low);
    out.put(hash.high);
}

SealedRecord SealedRecord::get(ByteReader& in) {
    SealedRecord record;
    record.offset = in.get<std::uint64_t>();
    record.stored_bytes = in.get<std::uint64_t>();
    record.content_bytes = in.get<std::uint64_t>();
    record.hash.low = in.get<std::uint64_t>();
    record.hash.high = in.get<std::uint64_t>();
    return record;
}

std::uint64_t ScannedSamples::hash_of_samples(std::span<const std::uint32_t> packed) {
    ByteWriter bytes;
    bytes.put_each(packed);
    return hash_of(bytes.bytes()).low;
}

Result<void> ScannedSamples::write(int columns, int rows, const Summary& summary,
                                   const GetSquare& get_square, SealedWriter& file,
                                   ByteWriter& directory) {
    ScannedSamples made(columns, rows);
    for (int y = 0; y < squares_along(rows); ++y) {
        for (int x = 0; x < squares_along(columns); ++x) {
            TERRANE_TRY(const ScannedSquare square, get_square(x, y));
            std::vector<std::uint32_t> unfilled = square.packed;
            for (std::size_t i = 0; i < square.flags.size(); ++i) {
                if (square.flags[i] != 0) unfilled[i] = no_data(summary.is_integer);
            }
            made.hashes_.push_back(hash_of_samples(unfilled));
            if (square.flags.empty()) continue;
            ByteWriter content;
            content.put_each(std::span<const std::uint32_t>(square.packed));
            content.put_each(std::span<const std::uint8_t>(square.flags));
            TERRANE_TRY(const auto record, SealedRecord::append(file, content.bytes()));
            made.voids_.emplace(made.index_of(x, y), record);
        }
    }
    for (const double number : {summary.min_m, summary.max_m, summary.nodata_share,
                                summary.filled_share, summary.base, summary.step}) {
        directory.put(number);
    }
    directory.put(std::uint8_t{summary.is_integer});
    directory.put(summary.rounding);
    directory.put_each(std::span<const std::uint64_t>(made.hashes_));
    directory.put(static_cast<std::uint64_t>(made.voids_.size()));
    for (const auto& [index, record] : made.voids_) {
        directory.put(static_cast<std::uint64_t>(index));
        record.put(directory);
    }
    return {};
}

Result<std::shared_ptr<const ScannedSamples>> ScannedSamples::read(
    int columns, int rows, std::shared_ptr<const SealedReader> file, ByteReader& directory) {
    std::shared_ptr<ScannedSamples> made(new ScannedSamples(columns, rows));
    made->file_ = std::move(file);
    Summary& summary = made->summary_;
    for (double* number : {&summary.min_m, &summary.max_m, &summary.nodata_share,
                           &summary.filled_share, &summary.base, &summary.step}) {
        *number = directory.get<double>();
    }
    summary.is_integer = directory.get<std::uint8_t>() != 0;
    summary.rounding = directory.get<double>();
    made->hashes_.resize(static_cast<std::size_t>(squares_along(columns)) *
                         static_cast<std::size_t>(squares_along(rows)));
    directory.get_each(std::span<std::uint64_t>(made->hashes_));
    const auto count = directory.get<std::uint64_t>();
    for (std::uint64_t i = 0; i < count && !directory.has_failed(); ++i) {
        const auto index = directory.get<std::uint64_t>();
        made->voids_.emplace(static_cast<std::size_t>(index), SealedRecord::get(directory));
    }
    if (directory.has_failed() || summary.step == 0.0) {
        return fail(ErrorCode::bad_data,
                    "\"" + made->file_->path() + "\" does not match a raster of this size");
    }
    return std::shared_ptr<const ScannedSamples>(std::move(made));
}

ContentHash ScannedSamples::hash() const {
    ByteWriter bytes;
    bytes.put(std::int32_t{columns_});
    bytes.put(std::int32_t{rows_});
    for (const double number : {summary_.base, summary_.step, summary_.rounding}) {
        bytes.put(number);
    }
    bytes.put(std::uint8_t{summary_.is_integer});
    bytes.put_each(std::span<const std::uint64_t>(hashes_));
    return hash_of(bytes.bytes());
}

Result<ScannedSquare> ScannedSamples::square(int square_x, int square_y) const {
    TERRANE_TRY(const auto bytes, voids_.at(index_of(square_x, square_y)).read(*file_));
    const std::size_t size =
        static_cast<std::size_t>(std::min(kSide, columns_ - square_x * kSide)) *
        static_cast<std::size_t>(std::min(kSide, rows_ - square_y * kSide));
    ScannedSquare square;
    square.packed.resize(size);
    square.flags.resize(size);
    ByteReader in(bytes);
    in.get_each(std::span<std::uint32_t>(square.packed));
    in.get_each(std::span<std::uint8_t>(square.flags));
    if (!in.is_done()) {
        return fail(ErrorCode::bad_data, "\"" + file_->path() + "\" is damaged");
    }
    return square;
}

}  // namespace terrane::internal
