// SPDX-License-Identifier: MIT
// A raster that does not exist is an error that names it, not a crash.
#include <terrane/dem/dem_heights.h>

#include <cstdio>

int main() {
    const auto source = terrane::DemHeights::open("no_such_raster.tif", {});
    if (source) return 1;
    std::printf("%s\n", source.error().message.c_str());
    return source.error().code == terrane::ErrorCode::io &&
                   source.error().message.find("no_such_raster.tif") != std::string::npos
               ? 0
               : 1;
}
