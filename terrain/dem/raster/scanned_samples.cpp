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

void ScannedSamples::Square::put(ByteWriter& out) const {
    out.put(hash);
    filled.put(out);
}

ScannedSamples::Square ScannedSamples::Square::get(ByteReader& in) {
    Square square;
    square.hash = in.get<std::uint64_t>();
    square.filled = SealedRecord::get(in);
    return square;
}

Result<void> ScannedSamples::write(int columns, int rows, const Summary& summary,
                                   const GetSquare& get_square, SealedWriter& file,
                                   ByteWriter& directory) {
    ContentHasher all;
    const auto add_to_hash = [&all](auto number) {
        ByteWriter bytes;
        bytes.put(number);
        all.add(bytes.bytes());
    };
    add_to_hash(std::int32_t{columns});
    add_to_hash(std::int32_t{rows});
    for (const double number : {summary.base, summary.step, summary.rounding}) add_to_hash(number);
    add_to_hash(std::uint8_t{summary.is_integer});
    SealedTableWriter<Square> squares;
    bool is_whole = true;
    for (int y = 0; y < squares_along(rows); ++y) {
        for (int x = 0; x < squares_along(columns); ++x) {
            TERRANE_TRY(const ScannedSquare samples, get_square(x, y));
            std::vector<std::uint32_t> unfilled = samples.packed;
            for (std::size_t i = 0; i < samples.flags.size(); ++i) {
                if (samples.flags[i] != 0) unfilled[i] = no_data(summary.is_integer);
            }
            Square square{hash_of_samples(unfilled), {}};
            add_to_hash(square.hash);
            if (!samples.flags.empty()) {
                is_whole = false;
                ByteWriter content;
                content.put_each(std::span<const std::uint32_t>(samples.packed));
                content.put_each(std::span<const std::uint8_t>(samples.flags));
                TERRANE_TRY(square.filled, SealedRecord::append(file, content.bytes()));
            }
            TERRANE_TRY(squares.add(square, file));
        }
    }
    for (const double number : {summary.min_m, summary.max_m, summary.nodata_share,
                                summary.filled_share, summary.base, summary.step}) {
        directory.put(number);
    }
    directory.put(std::uint8_t{summary.is_integer});
    directory.put(summary.rounding);
    directory.put(all.value().low);
    directory.put(all.value().high);
    directory.put(std::uint8_t{is_whole});
    return squares.finish(file, directory);
}

namespace {

ScannedSamples::Summary get_summary(ByteReader& in) {
    ScannedSamples::Summary summary;
    for (double* number : {&summary.min_m, &summary.max_m, &summary.nodata_share,
                           &summary.filled_share, &summary.base, &summary.step}) {
        *number = in.get<double>();
    }
    summary.is_integer = in.get<std::uint8_t>() != 0;
    summary.rounding = in.get<double>();
    return summary;
}

}  // namespace

ScannedSamples::ScannedSamples(int columns, int rows, std::shared_ptr<const SealedReader> file,
                               ByteReader& directory)
    : columns_(columns),
      rows_(rows),
      file_(std::move(file)),
      summary_(get_summary(directory)),
      hash_{directory.get<std::uint64_t>(), directory.get<std::uint64_t>()},
      is_whole_(directory.get<std::uint8_t>() != 0),
      squares_(square_count(columns, rows), file_, directory) {}

Result<std::shared_ptr<const ScannedSamples>> ScannedSamples::read(
    int columns, int rows, std::shared_ptr<const SealedReader> file, ByteReader& directory) {
    std::shared_ptr<const ScannedSamples> made(
        new ScannedSamples(columns, rows, std::move(file), directory));
    if (directory.has_failed() || made->summary().step == 0.0) {
        return fail(ErrorCode::bad_data,
                    "\"" + made->file_->path() + "\" does not match a raster of this size");
    }
    return made;
}

Result<bool> ScannedSamples::has_nodata(int square_x, int square_y) const {
    if (is_whole_) return false;
    TERRANE_TRY(const auto square, entry(square_x, square_y));
    return square.filled.content_bytes > 0;
}

Result<bool> ScannedSamples::is_same(int square_x, int square_y,
                                     std::span<const std::uint32_t> packed) const {
    TERRANE_TRY(const auto square, entry(square_x, square_y));
    return hash_of_samples(packed) == square.hash;
}

Result<ScannedSquare> ScannedSamples::square(int square_x, int square_y) const {
    TERRANE_TRY(const auto found, entry(square_x, square_y));
    TERRANE_TRY(const auto bytes, found.filled.read(*file_));
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
