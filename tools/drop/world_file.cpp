// SPDX-License-Identifier: MIT
#include "drop/world_file.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <vector>

namespace terrane::tools {

Result<World> restore_world(const std::string& path, int worker_count) {
    // a folder opens as a stream without content: check first
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(path, error);
    if (!std::filesystem::is_regular_file(status)) {
        return fail(ErrorCode::io, "cannot restore '" + path +
                                       "': " + (error ? error.message() : "it is not a file"));
    }
    std::ifstream file(path, std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(file),
                                  std::istreambuf_iterator<char>()};
    if (!file.good() && !file.eof()) {
        return fail(ErrorCode::io, "cannot restore '" + path + "': it cannot be read");
    }
    Result<World> world = World::load(std::as_bytes(std::span(bytes)), {}, worker_count);
    if (!world) {
        return fail(world.error().code, "cannot restore '" + path + "': " + world.error().message);
    }
    return world;
}

}  // namespace terrane::tools
