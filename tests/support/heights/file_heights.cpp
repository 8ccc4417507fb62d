// SPDX-License-Identifier: MIT
#include "file_heights.h"

#include "support/hash.h"

#include <fcntl.h>
#include <sys/fsuid.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <span>
#include <system_error>
#include <utility>
#include <vector>

namespace terrane::test {
namespace {

constexpr uid_t kNobody = 65534;

std::string trouble() { return std::error_code(errno, std::generic_category()).message(); }

std::size_t row_samples(const Lattice& lattice) {
    return static_cast<std::size_t>(lattice.east() - lattice.west() + 1);
}

// The samples of a row, and what they add up to.
struct Row {
    std::vector<double> samples;
    std::uint64_t checksum = 0;

    explicit Row(const Lattice& lattice) : samples(row_samples(lattice)) {}
    std::size_t bytes() const { return samples.size() * sizeof(double); }
    std::uint64_t compute_checksum() const {
        Hash hash;
        hash.add_all(std::span<const double>(samples));
        return hash.value();
    }
};

class OpenFile {
public:
    // The file system's user is the thread's own: others are not touched.
    OpenFile(const std::string& path, bool as_nobody) {
        const int user = as_nobody ? setfsuid(kNobody) : -1;
        handle_ = open(path.c_str(), O_RDONLY | O_CLOEXEC);
        const int error = errno;
        if (as_nobody) setfsuid(static_cast<uid_t>(user));
        errno = error;
    }
    ~OpenFile() {
        if (is_open()) close(handle_);
    }
    OpenFile(const OpenFile&) = delete;
    OpenFile& operator=(const OpenFile&) = delete;

    bool is_open() const { return handle_ >= 0; }

    // How much there was, up to `bytes`; below 0 where it cannot be read.
    std::ptrdiff_t read(void* into, std::size_t bytes, std::size_t offset) const {
        std::size_t done = 0;
        while (done < bytes) {
            const ssize_t got = pread(handle_, static_cast<char*>(into) + done, bytes - done,
                                      static_cast<off_t>(offset + done));
            if (got < 0) return got;
            if (got == 0) break;
            done += static_cast<std::size_t>(got);
        }
        return static_cast<std::ptrdiff_t>(done);
    }

private:
    int handle_ = -1;
};

}  // namespace

std::size_t FileHeights::row_offset(const Lattice& lattice, std::int64_t y) {
    return static_cast<std::size_t>(y - lattice.south()) *
           (row_samples(lattice) * sizeof(double) + sizeof(std::uint64_t));
}

Result<void> FileHeights::write(const std::string& path, const HeightSource& ground) {
    const Lattice& lattice = ground.lattice();
    std::ofstream file(path, std::ios::binary | std::ios::trunc);
    Row row(lattice);
    for (std::int64_t y = lattice.south(); y <= lattice.north(); ++y) {
        const SampleGrid grid{{lattice.west(), y}, 1, static_cast<int>(row.samples.size()), 1};
        if (const Result<void> read = ground.sample(grid, row.samples); !read) return read;
        row.checksum = row.compute_checksum();
        file.write(reinterpret_cast<const char*>(row.samples.data()),
                   static_cast<std::streamsize>(row.bytes()));
        file.write(reinterpret_cast<const char*>(&row.checksum), sizeof(row.checksum));
    }
    file.close();
    if (!file) return fail(ErrorCode::io, "cannot write " + path);
    return {};
}

FileHeights::FileHeights(std::string path, std::shared_ptr<const HeightSource> ground)
    : HeightSource(ground->lattice(), ground->extent()),
      path_(std::move(path)),
      ground_(std::move(ground)) {}

Result<void> FileHeights::sample(const SampleGrid& grid, std::span<double> heights_out) const {
    // beyond the world
    if (const Result<void> read = ground_->sample(grid, heights_out); !read) return read;
    const OpenFile file(path_, opens_as_nobody);
    if (!file.is_open()) return fail(ErrorCode::io, "cannot open " + path_ + ": " + trouble());
    Row row(lattice());
    for (int i = 0; i < grid.rows; ++i) {
        const std::int64_t y = grid.corner.y + i * grid.step;
        if (y < lattice().south() || y > lattice().north()) continue;
        const std::size_t offset = row_offset(lattice(), y);
        const std::ptrdiff_t samples = file.read(row.samples.data(), row.bytes(), offset);
        const std::ptrdiff_t checksum =
            file.read(&row.checksum, sizeof(row.checksum), offset + row.bytes());
        if (samples < 0 || checksum < 0) {
            return fail(ErrorCode::io, "cannot read " + path_ + ": " + trouble());
        }
        if (checksum < static_cast<std::ptrdiff_t>(sizeof(row.checksum))) {
            return fail(ErrorCode::bad_data,
                        path_ + " ends in the row of y = " + std::to_string(y));
        }
        if (row.checksum != row.compute_checksum()) {
            return fail(ErrorCode::bad_data,
                        path_ + " is corrupt in the row of y = " + std::to_string(y));
        }
        for (int j = 0; j < grid.columns; ++j) {
            const std::int64_t x = grid.corner.x + j * grid.step;
            if (x < lattice().west() || x > lattice().east()) continue;
            heights_out[static_cast<std::size_t>(i) * static_cast<std::size_t>(grid.columns) +
                        static_cast<std::size_t>(j)] =
                row.samples[static_cast<std::size_t>(x - lattice().west())];
        }
    }
    return {};
}

double FileHeights::height(double x, double y) const { return ground_->height(x, y); }

Result<void> FileHeights::vertex_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    return ground_->vertex_bounds(grid, bounds_out);
}

Result<void> FileHeights::cell_bounds(const SampleGrid& grid, std::span<float> bounds_out) const {
    return ground_->cell_bounds(grid, bounds_out);
}

HeightInterval FileHeights::interval(const WorldRect& rect) const {
    return ground_->interval(rect);
}

double FileHeights::rise_bound(double distance) const { return ground_->rise_bound(distance); }

NoFileHandles::NoFileHandles() {
    getrlimit(RLIMIT_NOFILE, &before_);
    rlimit none = before_;
    none.rlim_cur = 0;
    setrlimit(RLIMIT_NOFILE, &none);
}

NoFileHandles::~NoFileHandles() { setrlimit(RLIMIT_NOFILE, &before_); }

}  // namespace terrane::test
