// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>

#include <cstddef>
#include <memory>
#include <memory_resource>
#include <string>

namespace terrane::internal {

/// Memory on a disk, for arrays that may not fit into the machine's: a mapped file without a name. Memory that is freed
/// is not used again.
/// Threads: one at a time may allocate
class ScratchMemory {
public:
    /// Reserves the space on the disk.
    ///
    /// @param beside path of a file in the folder to use, which is created if absent
    ///
    /// Fails: io
    static Result<std::shared_ptr<ScratchMemory>> create(const std::string& beside,
                                                         std::size_t bytes);
    ScratchMemory(const ScratchMemory&) = delete;
    ScratchMemory& operator=(const ScratchMemory&) = delete;
    ~ScratchMemory();

    /// When the space on the disk is used up, ordinary memory follows.
    std::pmr::memory_resource* resource() { return &resource_; }

private:
    ScratchMemory(void* mapped, std::size_t bytes)
        : mapped_(mapped),
          bytes_(bytes),
          resource_(mapped, bytes, std::pmr::new_delete_resource()) {}

    void* mapped_;
    std::size_t bytes_;
    std::pmr::monotonic_buffer_resource resource_;
};

}  // namespace terrane::internal
