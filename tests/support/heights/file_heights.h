// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <sys/resource.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace terrane::test {

/// A source whose samples are in a file that is opened, read and closed in every call: for tests that truncate it,
/// change a byte, or remove it. Bounds, and samples beyond the world, are those of the ground that it was
/// written from.
///
/// The file: row by row from the south of the world's lattice points, eight bytes each, and behind each row a
/// checksum of eight bytes.
class FileHeights final : public HeightSource {
public:
    /// Writes the samples of a ground, replacing the file.
    ///
    /// Fails: io if it cannot be written
    static Result<void> write(const std::string& path, const HeightSource& ground);
    /// Offset of the record of a row of lattice points.
    static std::size_t row_offset(const Lattice& lattice, std::int64_t y);

    FileHeights(std::string path, std::shared_ptr<const HeightSource> ground);

    /// Fails: io where the file cannot be opened or read; bad_data where it ends early, or a row does
    ///        not have its checksum
    Result<void> sample(const SampleGrid& grid, std::span<double> heights_out) const override;

    double height(double x, double y) const override;
    Result<void> vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    Result<void> cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const override;
    HeightInterval interval(const WorldRect& rect) const override;
    double rise_bound(double distance) const override;

    /// Opens the file as an unprivileged user, if this process may change its user: root ignores permissions.
    std::atomic<bool> opens_as_nobody{false};

private:
    std::string path_;
    std::shared_ptr<const HeightSource> ground_;
};

/// While it lives, this process has no free file handles.
class NoFileHandles {
public:
    NoFileHandles();
    ~NoFileHandles();
    NoFileHandles(const NoFileHandles&) = delete;
    NoFileHandles& operator=(const NoFileHandles&) = delete;

private:
    rlimit before_{};
};

}  // namespace terrane::test
