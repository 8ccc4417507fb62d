// SPDX-License-Identifier: MIT
// Sources: the layout that openvdb::io::Archive, io::GridDescriptor and MetaMap of OpenVDB 10 read, formats 222 to 224.
#include "vdb/vdb_lengths.h"

#include <openvdb/version.h>

#include <array>
#include <cstddef>
#include <istream>

namespace terrane::internal {
namespace {

class LengthReader {
public:
    LengthReader(std::istream& in, std::uint64_t bytes) : in_(in), bytes_(bytes) {}

    bool is_ok() const { return is_ok_; }
    std::uint64_t position() const { return position_; }

    /// A little-endian integer; 0 beyond the end.
    std::uint64_t integer(std::size_t size) {
        std::array<unsigned char, 8> read{};
        if (size > bytes_ - position_) {
            is_ok_ = false;
            return 0;
        }
        for (std::size_t i = 0; i < size; ++i) read[i] = static_cast<unsigned char>(in_.get());
        position_ += size;
        is_ok_ = is_ok_ && !in_.fail();
        std::uint64_t value = 0;
        for (std::size_t i = size; i > 0; --i) value = value << 8 | read[i - 1];
        return value;
    }
    void seek(std::uint64_t position) {
        is_ok_ = is_ok_ && position <= bytes_;
        if (!is_ok_) return;
        position_ = position;
        in_.seekg(static_cast<std::streamoff>(position));
    }
    /// Bytes after their number.
    void skip_counted() {
        const std::uint64_t count = integer(4);
        if (count > bytes_ - position_) is_ok_ = false;
        seek(position_ + count);
    }
    /// Name, type and value of each entry.
    void skip_metadata() {
        const std::uint64_t count = integer(4);
        for (std::uint64_t i = 0; i < 3 * count && is_ok_; ++i) skip_counted();
    }

private:
    std::istream& in_;
    std::uint64_t bytes_;
    std::uint64_t position_ = 0;
    bool is_ok_ = true;
};

}  // namespace

std::optional<VdbOffsets> check_vdb_lengths(std::istream& in, std::uint64_t bytes) {
    constexpr std::uint64_t kUuidLetters = 36;
    LengthReader reader(in, bytes);
    const bool is_vdb = reader.integer(8) == openvdb::OPENVDB_MAGIC;
    const std::uint64_t version = reader.integer(4);
    if (!is_vdb || version < openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION) {
        return VdbOffsets::present;  // OpenVDB says what it is
    }
    reader.integer(8);  // the library's version
    const VdbOffsets offsets = reader.integer(1) != 0 ? VdbOffsets::present : VdbOffsets::absent;
    reader.seek(reader.position() + kUuidLetters);
    reader.skip_metadata();
    std::uint64_t grids = reader.integer(4);
    if (offsets == VdbOffsets::absent && grids > 1) grids = 1;
    for (std::uint64_t i = 0; i < grids && reader.is_ok(); ++i) {
        for (int name = 0; name < 3; ++name)
            reader.skip_counted();  // the grid's, its type's, its source's
        const std::uint64_t begin = reader.integer(8);
        reader.integer(8);  // of the voxels
        const std::uint64_t end = reader.integer(8);
        const std::uint64_t after = reader.position();
        if (offsets == VdbOffsets::present) reader.seek(begin);
        reader.integer(4);  // compression
        reader.skip_metadata();
        reader.skip_counted();  // the transform's type
        if (offsets == VdbOffsets::absent) break;
        if (end < after) return std::nullopt;
        reader.seek(end);
    }
    if (!reader.is_ok()) return std::nullopt;
    return offsets;
}

}  // namespace terrane::internal
