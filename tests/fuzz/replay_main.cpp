// SPDX-License-Identifier: MIT
// Runs a fuzz target once over each file given as an argument, and over each file of a folder: with any compiler, and
// without libFuzzer. A crash names the file, because its name is printed before.
#include "support/input.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

namespace {

namespace fs = std::filesystem;

/// The files of an argument, in the order of their names.
std::vector<fs::path> files_of(const fs::path& argument) {
    if (!fs::is_directory(argument)) return {argument};
    std::vector<fs::path> files;
    for (const fs::directory_entry& entry : fs::directory_iterator(argument)) {
        if (entry.is_regular_file()) files.push_back(entry.path());
    }
    std::ranges::sort(files);
    return files;
}

int replay(const std::vector<fs::path>& arguments) {
    std::size_t count = 0;
    for (const fs::path& argument : arguments) {
        for (const fs::path& path : files_of(argument)) {
            std::ifstream file(path, std::ios::binary);
            const std::vector<char> bytes{std::istreambuf_iterator<char>(file),
                                          std::istreambuf_iterator<char>()};
            if (!file.good() && !file.eof()) {
                std::fprintf(stderr, "cannot read '%s'\n", path.c_str());
                return 1;
            }
            std::printf("%s\n", path.c_str());
            std::fflush(stdout);
            // copied to exactly as many bytes, so that a sanitizer sees a read beyond the end
            const std::vector<std::uint8_t> copy(bytes.begin(), bytes.end());
            LLVMFuzzerTestOneInput(copy.data(), copy.size());
            ++count;
        }
    }
    std::printf("%zu inputs replayed\n", count);
    if (count == 0) std::fprintf(stderr, "no input\n");
    return count == 0 ? 1 : 0;
}

}  // namespace

int main(int argument_count, char** arguments) {
    try {
        return replay({arguments + std::min(argument_count, 1), arguments + argument_count});
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
