// SPDX-License-Identifier: MIT
//
// Sources: the layout that openvdb::io::Archive, io::GridDescriptor and MetaMap of OpenVDB 10 read, formats 222 to 224.
#include "level_set/sampled_grid.h"
#include "level_set/sampled_shape.h"

#include <terrane/base/text.h>

#include <openvdb/io/File.h>
#include <openvdb/io/Stream.h>
#include <openvdb/version.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <exception>
#include <filesystem>
#include <fstream>
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
    /// Skips a byte string and its length.
    void skip_counted() {
        const std::uint64_t count = integer(4);
        if (count > bytes_ - position_) is_ok_ = false;
        seek(position_ + count);
    }
    /// Skips the name, type and value of each entry.
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
        return VdbOffsets::present;  // not a format that is checked here: OpenVDB reports it
    }
    reader.integer(8);  // the library's version
    const VdbOffsets offsets = reader.integer(1) != 0 ? VdbOffsets::present : VdbOffsets::absent;
    reader.seek(reader.position() + kUuidLetters);
    reader.skip_metadata();
    std::uint64_t grids = reader.integer(4);
    if (offsets == VdbOffsets::absent && grids > 1) grids = 1;
    for (std::uint64_t i = 0; i < grids && reader.is_ok(); ++i) {
        for (int name = 0; name < 3; ++name)
            reader.skip_counted();  // names of the grid, its type and its instance parent
        const std::uint64_t begin = reader.integer(8);
        reader.integer(8);  // position of the voxels
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

// Level sets from `.vdb` files.

namespace {

// Largest difference of neighbouring values, in voxels: true distances differ by at most 1.
constexpr double kMostSlope = 1.25;
// Narrowest band, in spacings: it holds both ends of every edge that crosses the surface.
constexpr double kLeastBandSpacings = 2.0;

using GridResult = Result<openvdb::FloatGrid::Ptr>;

tl::unexpected<Error> damaged(const std::string& path) {
    return fail(ErrorCode::bad_data, "cannot read \"" + path + "\": it is damaged");
}

Result<void> check_bytes(const std::string& path, double bytes, const VolumeSettings& settings) {
    if (bytes <= static_cast<double>(settings.memory_bytes)) return {};
    return fail(ErrorCode::out_of_memory, "\"" + path + "\" needs " + number_text(bytes) +
                                              " bytes, more than memory_bytes, " +
                                              number_text(settings.memory_bytes));
}

/// The grid that `file` names, checked by name, type, class and stated memory; its voxels may not have been read.
Result<openvdb::GridBase::Ptr> choose_grid(const openvdb::GridPtrVec& grids, const VolumeFile& file,
                                           const VolumeSettings& settings) {
    openvdb::GridBase::Ptr chosen;
    double bytes = 0.0;
    for (const openvdb::GridBase::Ptr& grid : grids) {
        if (const auto stated = grid->getMetadata<openvdb::Int64Metadata>("file_mem_bytes")) {
            bytes += static_cast<double>(stated->value());
        }
        if (file.grid.empty() ? grids.size() == 1 : grid->getName() == file.grid) chosen = grid;
    }
    if (chosen == nullptr) {
        return fail(ErrorCode::bad_data, "\"" + file.path + "\" has " + number_text(grids.size()) +
                                             " grids, and none is called \"" + file.grid + "\"");
    }
    if (!chosen->isType<openvdb::FloatGrid>() ||
        chosen->getGridClass() != openvdb::GRID_LEVEL_SET) {
        return fail(ErrorCode::bad_data,
                    "grid \"" + chosen->getName() + "\" of \"" + file.path +
                        "\" is no level set of floats: " + chosen->type() + ", class " +
                        openvdb::GridBase::gridClassToString(chosen->getGridClass()));
    }
    TERRANE_TRY(check_bytes(file.path, bytes, settings));
    return chosen;
}

GridResult read_grid(const VolumeFile& file, const VolumeSettings& settings) {
    std::error_code status;
    const auto file_bytes = std::filesystem::file_size(file.path, status);
    if (status)
        return fail(ErrorCode::io, "cannot read \"" + file.path + "\": " + status.message());
    TERRANE_TRY(check_bytes(file.path, static_cast<double>(file_bytes), settings));
    initialize_openvdb();
    std::ifstream in(file.path, std::ios::binary);
    if (!in) return fail(ErrorCode::io, "cannot read \"" + file.path + "\"");
    const auto offsets = check_vdb_lengths(in, file_bytes);
    if (!offsets) return damaged(file.path);
    if (*offsets == VdbOffsets::present) {
        // Checks before voxels are read. A file without offsets would be read as a whole.
        openvdb::io::File reader(file.path);
        reader.open(false);
        TERRANE_TRY(choose_grid(*reader.readAllGridMetadata(), file, settings));
    }
    // Reads through a stream that throws at the end of the file, because io::File uses lengths that it failed to read.
    in.seekg(0);
    in.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
    openvdb::io::Stream stream(in, false);
    TERRANE_TRY(const auto chosen, choose_grid(*stream.getGrids(), file, settings));
    const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(chosen);
    // Active tiles become voxels.
    const double of_voxels = 4.0 * static_cast<double>(grid->activeVoxelCount());
    const double bytes = std::max(static_cast<double>(grid->memUsage()), of_voxels);
    TERRANE_TRY(check_bytes(file.path, bytes, settings));
    grid->tree().voxelizeActiveTiles(false);
    return grid;
}

// Whether all voxels and all inside tiles are near enough to the origin that neighbouring coordinates do not overflow.
bool are_coordinates_in_range(const openvdb::FloatGrid& grid) {
    constexpr int kFarthest = 1 << 30;
    const auto is_in_range = [](const openvdb::CoordBBox& box) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            if (box.min()[axis] < -kFarthest || box.max()[axis] > kFarthest) return false;
        }
        return true;
    };
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
        if (!is_in_range(leaf->getNodeBoundingBox())) return false;
    }
    for (auto tile = grid.tree().cbeginValueOff(); tile; ++tile) {
        if (tile.isVoxelValue() || !(*tile < 0.0f)) continue;
        openvdb::CoordBBox box;
        tile.getBoundingBox(box);
        if (!is_in_range(box)) return false;
    }
    return true;
}

// Whether neighbouring values differ by at most 5/4 voxel, and regions without voxels border on voxels and on each
// other without a change of sign.
bool are_distances(const openvdb::FloatGrid& grid) {
    const double most = kMostSlope * grid.voxelSize()[0], band = double{grid.background()};
    auto values = grid.getConstAccessor();
    const auto agree = [&](float a, float b) {
        return std::abs(double{a} - double{b}) <= most && std::abs(double{a}) <= 1.001 * band;
    };
    for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
        for (auto voxel = leaf->cbeginValueAll(); voxel; ++voxel) {
            const openvdb::Coord at = voxel.getCoord();
            for (std::size_t axis = 0; axis < 3; ++axis) {
                for (const int step : {-1, 1}) {
                    openvdb::Coord beside = at;
                    beside[axis] += step;
                    if (!agree(*voxel, values.getValue(beside))) return false;
                }
            }
        }
    }
    // An inside region borders on voxels, which have been compared, or on other inside regions.
    for (auto tile = grid.tree().cbeginValueOff(); tile; ++tile) {
        if (tile.isVoxelValue() || !(*tile < 0.0f)) continue;
        openvdb::CoordBBox box;
        tile.getBoundingBox(box);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
            for (const int plane : {box.min()[axis] - 1, box.max()[axis] + 1}) {
                openvdb::Coord beside;
                beside[axis] = plane;
                for (beside[u] = box.min()[u]; beside[u] <= box.max()[u]; beside[u] += 8) {
                    for (beside[v] = box.min()[v]; beside[v] <= box.max()[v]; beside[v] += 8) {
                        if (values.probeConstLeaf(beside) == nullptr &&
                            !(values.getValue(beside) < 0.0f)) {
                            return false;
                        }
                    }
                }
            }
        }
    }
    return true;
}

Result<void> check_shape(const openvdb::FloatGrid& grid, const std::string& path, double spacing) {
    if (grid.activeVoxelCount() == 0)
        return fail(ErrorCode::bad_data, "\"" + path + "\" has no active voxels");
    if (!grid.transform().isLinear() || !grid.hasUniformVoxels()) {
        return fail(ErrorCode::bad_data, "\"" + path + "\" has voxels that are not cubes");
    }
    const double band = double{grid.background()};
    if (!(band >= kLeastBandSpacings * spacing) || !std::isfinite(band)) {
        return fail(ErrorCode::bad_data, "the band of \"" + path + "\" is " + number_text(band) +
                                             " m wide, less than two spacings of " +
                                             number_text(spacing) + " m");
    }
    if (!are_coordinates_in_range(grid)) {
        return fail(ErrorCode::bad_data, "\"" + path + "\" has voxels with indices beyond 2^30");
    }
    if (are_distances(grid)) return {};
    return fail(ErrorCode::bad_data, "\"" + path + "\" does not hold signed distances");
}

}  // namespace

Result<std::shared_ptr<const SampledShape>> SampledShape::of_file(const VolumeFile& file,
                                                                  const Pose& world_from_shape,
                                                                  double spacing,
                                                                  const VolumeSettings& settings) {
    try {
        TERRANE_TRY(auto read, read_grid(file, settings));
        const openvdb::FloatGrid::Ptr grid = read;
        TERRANE_TRY(check_shape(*grid, file.path, spacing));
        const openvdb::Vec3d origin = grid->worldToIndex(openvdb::Vec3d(0.0));
        Eigen::Matrix3d index_from_shape;
        for (int axis = 0; axis < 3; ++axis) {
            openvdb::Vec3d unit(0.0);
            unit[axis] = 1.0;
            const openvdb::Vec3d column = grid->worldToIndex(unit) - origin;
            index_from_shape.col(axis) = Eigen::Vector3d(column[0], column[1], column[2]);
        }
        // rows times the inverse rotation: index_from_shape * rotation^T
        Eigen::Matrix3d index_from_offset;
        for (int row = 0; row < 3; ++row) {
            index_from_offset.row(row) =
                rotated(world_from_shape.rotation, index_from_shape.row(row)).transpose();
        }
        const double voxel = grid->voxelSize()[0], band = double{grid->background()};
        return std::make_shared<const SampledShape>(std::make_unique<Grid>(
            Grid{grid, index_from_offset, world_from_shape.translation,
                 Eigen::Vector3d(origin[0], origin[1], origin[2]), voxel, band}));
    } catch (const std::bad_alloc&) {
        // Lengths were checked against the file's size, so a length within it must be wrong.
        return damaged(file.path);
    } catch (const std::exception& error) {
        return fail(ErrorCode::bad_data, "cannot read \"" + file.path + "\": " + error.what());
    }
}

}  // namespace terrane::internal
