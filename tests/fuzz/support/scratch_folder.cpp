// SPDX-License-Identifier: MIT
#include "support/scratch_folder.h"

#include "support/input.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace terrane::fuzz {

ScratchFolder::ScratchFolder()
    : path_((std::filesystem::temp_directory_path() / ("terrane_fuzz_" + std::to_string(getpid())))
                .string()) {
    std::error_code error;
    std::filesystem::create_directories(path_, error);
    require(!error, "a folder for files: " + path_);
}

ScratchFolder::~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

std::string ScratchFolder::write(const std::string& name,
                                 std::span<const std::uint8_t> bytes) const {
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): bytes as characters
    return write(name, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

std::string ScratchFolder::write(const std::string& name, std::string_view text) const {
    std::string path = path_ + "/" + name;
    std::ofstream file(path, std::ios::binary);
    file.write(text.data(), static_cast<std::streamsize>(text.size()));
    file.close();
    require(file.good(), "a file for the input: " + path);
    return path;
}

}  // namespace terrane::fuzz
