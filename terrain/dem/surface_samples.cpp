// SPDX-License-Identifier: MIT
#include "surface_samples.h"

#include "raster/guarded_calls.h"
#include "raster/raster_checks.h"
#include "raster/raster_store.h"

#include <terrane/terrain/number_text.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>
#include <utility>

namespace terrane::internal {
namespace {

constexpr double kLargestMaterial = 4294967294.0;
constexpr double kLargestFriction = 1e6;

/// Of one sample. NaN gives kNodata; so does what is out of range, with is_wrong_out.
std::uint32_t pack_sample(SurfaceNumbers numbers, double sample, bool& is_wrong_out) {
    if (std::isnan(sample)) return SurfaceSamples::kNodata;
    const bool is_friction = numbers == SurfaceNumbers::friction;
    const double most = is_friction ? kLargestFriction : kLargestMaterial;
    if (!(sample >= 0.0 && sample <= most) || (!is_friction && sample != std::floor(sample))) {
        is_wrong_out = true;
        return SurfaceSamples::kNodata;
    }
    return is_friction ? std::bit_cast<std::uint32_t>(static_cast<float>(sample))
                       : static_cast<std::uint32_t>(sample);
}

tl::unexpected<Error> wrong_sample(const RasterReader& reader, SurfaceNumbers numbers,
                                   double sample, int column, int row) {
    const bool is_friction = numbers == SurfaceNumbers::friction;
    return fail(ErrorCode::bad_data,
                "raster \"" + reader.path() + "\" has a " +
                    (is_friction ? "friction" : "material") + " of " + number_text(sample) +
                    " in " + reader.place_in_file(column, row) +
                    (is_friction ? ", possible are 0 to 1e+06"
                                 : ", possible are whole numbers of 0 to 4294967294") +
                    "; is it a nodata value that the file does not declare?");
}

/// Rows of the raster that are read at once. A read that timed out continues, so it owns its buffer.
struct Strip {
    std::shared_ptr<const RasterReader> reader;
    int south = 0, rows = 0;
    std::vector<double> samples;
    Result<void> done;
};

}  // namespace

Result<SurfaceSamples> SurfaceSamples::read(std::shared_ptr<const RasterReader> reader,
                                            const SurfaceRasterSettings& settings) {
    const int columns = reader->info().columns, rows = reader->info().rows;
    const std::size_t width = static_cast<std::size_t>(columns);
    const int most_rows = std::min(strip_rows(columns), rows);
    // Of a strip: as read, once more as a sample, and its validity.
    constexpr double kStripSample = 2 * sizeof(double) + 1;
    const double needed_bytes = sizeof(std::uint32_t) * static_cast<double>(columns) * rows +
                                kStripSample * columns * most_rows;
    if (auto ok = check_memory(reader->path(), columns, rows, needed_bytes, settings.memory_bytes,
                               "SurfaceRasterSettings::memory_bytes");
        !ok) {
        return tl::unexpected(ok.error());
    }
    SurfaceSamples samples;
    samples.all.resize(width * static_cast<std::size_t>(rows));
    GuardedCalls calls(settings.read_timeout);
    const auto strip = std::make_shared<Strip>();
    strip->reader = reader;
    const int strip_count = (rows + most_rows - 1) / most_rows;
    for (int i = 0; i < strip_count; ++i) {
        strip->south = (reader->rows_go_north() ? i : strip_count - 1 - i) * most_rows;
        strip->rows = std::min(most_rows, rows - strip->south);
        strip->samples.resize(width * static_cast<std::size_t>(strip->rows));
        const bool has_answered = calls.run([strip] {
            const int all_columns = strip->reader->info().columns;
            strip->done =
                strip->reader->read(0, strip->south, all_columns, strip->rows, strip->samples);
        });
        if (!has_answered) return stopped_answering(reader->path(), settings.read_timeout);
        if (!strip->done) return tl::unexpected(strip->done.error());
        std::size_t to = width * static_cast<std::size_t>(strip->south);
        for (std::size_t at = 0; at < strip->samples.size(); ++at, ++to) {
            bool is_wrong = false;
            samples.all[to] = pack_sample(settings.numbers, strip->samples[at], is_wrong);
            if (is_wrong) {
                return wrong_sample(*reader, settings.numbers, strip->samples[at],
                                    static_cast<int>(at % width),
                                    strip->south + static_cast<int>(at / width));
            }
            if (samples.all[to] == kNodata) ++samples.nodata_count;
        }
    }
    return samples;
}

}  // namespace terrane::internal
