// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace terrane::fuzz {

/// A folder of this process for readers that take paths, removed at the end of the process.
class ScratchFolder {
public:
    ScratchFolder();
    ~ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;

    const std::string& path() const { return path_; }
    /// Writes or replaces a file; aborts where that fails. Returns its path.
    std::string write(const std::string& name, std::span<const std::uint8_t> bytes) const;
    std::string write(const std::string& name, std::string_view text) const;

private:
    std::string path_;
};

}  // namespace terrane::fuzz
