// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/result.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace terrane {

/// 8-bit RGB, row-major from the top.
struct Image {
    int width = 0;                  ///< pixels
    int height = 0;                 ///< pixels
    std::vector<std::uint8_t> rgb;  ///< [height * width * 3]
};

/// Writes to PATH.part and renames it, so that no incomplete picture appears. Fails with io, naming the path.
Result<void> write_png(const Image& image, const std::string& path);
/// Reads a PNG file. Fails with io, naming the path.
Result<Image> read_png(const std::string& path);

}  // namespace terrane
