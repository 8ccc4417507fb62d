// SPDX-License-Identifier: MIT
#include "extremes/extreme_row.h"
#include "extremes/rows/grounds.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace terrane::extremes {
namespace {

/// A fractal of so many chunks of the finest level a side.
FractalSettings square_settings(double chunks) {
    int chunks_log2 = 0;
    std::frexp(chunks, &chunks_log2);
    --chunks_log2;
    FractalSettings settings = fractal_settings();
    settings.octave_count = 20;
    settings.wavelength_log2 = 16;
    // Root squares of 24 levels, and at least four of them along the world.
    const int levels = std::min(chunks_log2 - 2, 24);
    settings.root_size_log2 = levels + 7;
    settings.root_count_x =
        static_cast<std::int32_t>(std::min(std::ceil(std::ldexp(chunks, -levels)), 1024.0));
    settings.first_root_x = -settings.root_count_x / 2;
    settings.root_count_y = settings.root_count_x;
    settings.first_root_y = settings.first_root_x;
    return settings;
}

/// worst_error_share() near the south-western or north-eastern corner of a world.
double share_in_corner(const HeightSource& source, bool is_north_east) {
    const WorldRect& extent = source.extent();
    const double x = is_north_east ? extent.east - 140.0 : extent.west + 140.0;
    const double y = is_north_east ? extent.north - 140.0 : extent.south + 140.0;
    const WorldRect region = square_around(x, y, 120.0);
    const Result<Ground> ground = load(source, region);
    return ground ? worst_error_share(source, *ground, region) : kNan;
}

ExtremeRow chunks_row() {
    ExtremeRow row{.name = "ChunksAlongAWorld",
                   .topic = "Size of a world",
                   .swept = "chunks of the finest level along each side of a world",
                   .promise =
                       "The true surface is within error_m of every height that the ground "
                       "answers, and neighbouring chunks have the same samples.",
                   .figure =
                       "largest |answer - true height| / error_m over 2000 places in each of "
                       "two corners",
                   .values = {0x1p10, 0x1p20, 0x1p30, 0x1p31}};
    row.measure = [](double chunks) {
        const auto source = FractalHeights::create(square_settings(chunks));
        if (!source) return kNan;
        return std::max(share_in_corner(**source, false), share_in_corner(**source, true));
    };
    row.refusal = [](double chunks) {
        return message_of(FractalHeights::create(square_settings(chunks)));
    };
    row.ends = {{0x1p31, 0x1p34, true, "root squares"}};
    row.note =
        "Without a root window a pager keeps all root squares resident: in a world of 2^31 chunks "
        "a side, 128 by 128 of them take 2 GB.";
    return row;
}

}  // namespace

std::vector<ExtremeRow> world_rows() { return {chunks_row()}; }

}  // namespace terrane::extremes
