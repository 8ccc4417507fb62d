// SPDX-License-Identifier: MIT
#include "raster/scratch_memory.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>

namespace terrane::internal {

Result<std::shared_ptr<ScratchMemory>> ScratchMemory::create(const std::string& beside,
                                                             std::size_t bytes) {
    const auto refused = [&](int cause) {
        return fail(ErrorCode::io, "cannot reserve " + std::to_string((bytes >> 20) + 1) +
                                       " MiB beside \"" + beside +
                                       "\" for scanning: " + std::strerror(cause));
    };
    std::error_code ignored;  // reported when the file cannot be created
    std::filesystem::create_directories(std::filesystem::path(beside).parent_path(), ignored);
    std::string path = beside + ".partial-XXXXXX";
    const int handle = mkostemp(path.data(), O_CLOEXEC);
    if (handle < 0) return refused(errno);
    unlink(path.c_str());
    // Without reserved space, writing to the mapping of a full disk would end the program.
    int cause = posix_fallocate(handle, 0, static_cast<off_t>(bytes));
    void* mapped = MAP_FAILED;
    if (cause == 0) {
        mapped = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, handle, 0);
        if (mapped == MAP_FAILED) cause = errno;
    }
    close(handle);
    if (cause != 0) return refused(cause);
    return std::shared_ptr<ScratchMemory>(new ScratchMemory(mapped, bytes));
}

ScratchMemory::~ScratchMemory() { munmap(mapped_, bytes_); }

}  // namespace terrane::internal
