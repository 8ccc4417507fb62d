// SPDX-License-Identifier: MIT
#include "raster/cancellable_work.h"
#include "raster/crs_frame.h"
#include "raster/raster_checks.h"
#include "raster/raster_reader.h"
#include "raster/raster_store.h"

#include <terrane/base/text.h>
#include <terrane/dem/surface_raster.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

namespace terrane::internal {

/// The samples of a surface raster, in 32 bits each: a material's number, or the bits of a friction as a float.
struct SurfaceSamples {
    /// Represents nodata: not a material, and not the bits of a float in range.
    static constexpr std::uint32_t kNodata = ~std::uint32_t{0};

    /// Reads all samples, from the first row of the file to the last.
    ///
    /// Fails: io; timed_out; bad_data for a sample out of range; out_of_memory above the settings' limit, before
    ///        anything is read
    static Result<SurfaceSamples> read(std::shared_ptr<const RasterReader> reader,
                                       const SurfaceRasterSettings& settings);

    std::vector<std::uint32_t> all;  ///< row by row from the south-west
    std::size_t nodata_count = 0;
};

namespace {

constexpr double kLargestMaterial = 4294967294.0;
constexpr double kLargestFriction = 1e6;

/// Packs one sample. NaN gives kNodata; a value out of range gives kNodata and sets is_wrong_out.
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
                named_raster(reader.path()) + " has a " + (is_friction ? "friction" : "material") +
                    " of " + number_text(sample) + " in " + reader.place_in_file(column, row) +
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
    // Bytes per sample of a strip: as read, a copy, and its validity.
    constexpr double kStripSample = 2 * sizeof(double) + 1;
    const double needed_bytes = sizeof(std::uint32_t) * static_cast<double>(columns) * rows +
                                kStripSample * columns * most_rows;
    TERRANE_TRY(check_memory(reader->path(), columns, rows, needed_bytes, settings.memory_bytes,
                             "SurfaceRasterSettings::memory_bytes"));
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

namespace terrane {
namespace {

using internal::RasterNumbers;
using internal::RasterReader;
using internal::SurfaceSamples;

tl::unexpected<Error> refuse_setting(const std::string& message) {
    return fail(ErrorCode::invalid_argument, message);
}

bool has_area(const WorldRect& rect, int columns, int rows) {
    const double width = rect.east - rect.west, height = rect.north - rect.south;
    return std::isfinite(width) && std::isfinite(height) && width / columns > 0.0 &&
           height / rows > 0.0;
}

/// Fails: `code` for edges that are not finite or leave no area to a sample; the message begins with a verb
Result<void> check_rect(const WorldRect& rect, int columns, int rows, ErrorCode code) {
    if (has_area(rect, columns, rows)) return {};
    return fail(code, "must be finite and have an area, got west " + number_text(rect.west) +
                          ", south " + number_text(rect.south) + ", east " +
                          number_text(rect.east) + ", north " + number_text(rect.north));
}

Result<void> check_properties(const std::string& name, const SurfaceProperties& properties) {
    if (auto ok = properties.validate(); !ok) {
        return fail(ok.error().code, name + "." + ok.error().message);
    }
    return {};
}

/// @param sorted the settings' materials, ascending by number
Result<void> check_materials(const SurfaceRasterSettings& settings,
                             const std::vector<SurfaceProperties>& sorted) {
    if (settings.numbers == SurfaceNumbers::friction && !sorted.empty()) {
        return refuse_setting("materials must be empty where the numbers are friction, got " +
                              number_text(sorted.size()));
    }
    for (std::size_t i = 0; i < settings.materials.size(); ++i) {
        const std::string name = "materials[" + number_text(i) + "]";
        TERRANE_TRY(check_properties(name, settings.materials[i]));
    }
    for (std::size_t i = 1; i < sorted.size(); ++i) {
        if (sorted[i].material != sorted[i - 1].material) continue;
        return refuse_setting("materials must list each material once, got " +
                              number_text(sorted[i].material) + " twice");
    }
    return {};
}

Result<void> check_settings(const SurfaceRasterSettings& settings) {
    TERRANE_TRY(check_properties("defaults", settings.defaults));
    if (settings.aligned_with && settings.rect) {
        return refuse_setting("aligned_with and rect exclude each other, got both");
    }
    if (settings.rect) {
        if (auto ok = check_rect(*settings.rect, 1, 1, ErrorCode::invalid_argument); !ok) {
            return fail(ok.error().code, "rect " + ok.error().message);
        }
    }
    if (settings.read_timeout > 0.0) return {};
    return refuse_setting("read_timeout must be above 0 s, got " +
                          number_text(settings.read_timeout));
}

Result<void> check_crs(const std::string& path, const DemInfo& raster, const DemInfo& dem) {
    const auto has_name = [](const DemInfo& info) {
        return !info.crs.empty() && info.crs != "unknown" && info.crs != "unnamed";
    };
    // Degrees are not compared: their lengths in metres depend on the raster's latitude, as those of Mercator's metres.
    const bool has_units = raster.geographic || raster.crs_wkt == dem.crs_wkt ||
                           (raster.metres_per_unit_x == dem.metres_per_unit_x &&
                            raster.metres_per_unit_y == dem.metres_per_unit_y);
    if (has_name(raster) && raster.crs == dem.crs && raster.geographic == dem.geographic &&
        has_units) {
        return {};
    }
    const auto name_of = [](const DemInfo& info) {
        return info.crs.empty() ? "no CRS" : "the CRS \"" + info.crs + "\"";
    };
    return refuse_setting(internal::named_raster(path) + " has " + name_of(raster) +
                          " and aligned_with " + name_of(dem) +
                          ", the same CRS with a name is needed");
}

/// The raster's outer edges in the world.
Result<WorldRect> place_of(const std::string& path, const DemInfo& raster,
                           const SurfaceRasterSettings& settings) {
    if (settings.rect) return *settings.rect;
    const double half_width = 0.5 * raster.columns * raster.cell_x;
    const double half_height = 0.5 * raster.rows * raster.cell_y;
    if (!settings.aligned_with)
        return WorldRect{-half_width, -half_height, half_width, half_height};
    const DemInfo& dem = *settings.aligned_with;
    TERRANE_TRY(check_crs(path, raster, dem));
    return internal::world_frame_of(dem).rect_of({raster.centre_x, raster.centre_y,
                                                  half_width / raster.metres_per_unit_x,
                                                  half_height / raster.metres_per_unit_y});
}

/// The last of `count` cells that starts at or before a coordinate: cell i starts at first + i * size.
std::size_t cell_at(double coordinate, double first, double size, int count) {
    double cell = std::min(std::floor((coordinate - first) / size), count - 1.0);
    // The rounded quotient may be off by one cell.
    if (cell > 0.0 && coordinate < first + cell * size) cell -= 1.0;
    if (cell + 1.0 < count && coordinate >= first + (cell + 1.0) * size) cell += 1.0;
    return static_cast<std::size_t>(cell);
}

class RasterMap final : public SurfaceMap {
public:
    /// @param materials ascending by number
    RasterMap(const SurfaceRasterInfo& info, SurfaceSamples samples,
              std::vector<SurfaceProperties> materials, const SurfaceRasterSettings& settings)
        : SurfaceMap(settings.defaults),
          rect_(info.rect),
          columns_(info.columns),
          rows_(info.rows),
          cell_x_((rect_.east - rect_.west) / columns_),
          cell_y_((rect_.north - rect_.south) / rows_),
          numbers_(settings.numbers),
          samples_(std::move(samples.all)),
          materials_(std::move(materials)) {}

    bool is_listed(std::uint32_t material) const { return find(material) != materials_.end(); }
    std::size_t unlisted_count() const {
        if (numbers_ == SurfaceNumbers::friction) return 0;
        return static_cast<std::size_t>(
            std::ranges::count_if(samples_, [this](std::uint32_t sample) {
                return sample != SurfaceSamples::kNodata && !is_listed(sample);
            }));
    }

private:
    std::vector<SurfaceProperties>::const_iterator find(std::uint32_t material) const {
        const auto found = std::ranges::lower_bound(materials_, material, std::ranges::less{},
                                                    &SurfaceProperties::material);
        return found != materials_.end() && found->material == material ? found : materials_.end();
    }

    SurfaceProperties properties(double x, double y) const override {
        SurfaceProperties answer = defaults();
        if (!rect_.contains(x, y)) return answer;
        const std::size_t sample_index =
            cell_at(y, rect_.south, cell_y_, rows_) * static_cast<std::size_t>(columns_) +
            cell_at(x, rect_.west, cell_x_, columns_);
        const std::uint32_t sample = samples_[sample_index];
        if (sample == SurfaceSamples::kNodata) return answer;
        if (numbers_ == SurfaceNumbers::friction) {
            answer.friction = static_cast<double>(std::bit_cast<float>(sample));
            return answer;
        }
        if (const auto row = find(sample); row != materials_.end()) return *row;
        answer.material = sample;
        return answer;
    }

    WorldRect rect_;
    int columns_, rows_;
    double cell_x_, cell_y_;
    SurfaceNumbers numbers_;
    std::vector<std::uint32_t> samples_;
    std::vector<SurfaceProperties> materials_;
};

Result<std::shared_ptr<const SurfaceMap>> open_raster(const std::string& path,
                                                      const SurfaceRasterSettings& settings,
                                                      SurfaceRasterInfo* info_out) {
    std::vector<SurfaceProperties> materials = settings.materials;
    std::ranges::sort(materials, std::ranges::less{}, &SurfaceProperties::material);
    TERRANE_TRY(check_settings(settings));
    TERRANE_TRY(check_materials(settings, materials));
    TERRANE_TRY(auto opened, RasterReader::open(path, settings.read_timeout, RasterNumbers::plain));
    const std::shared_ptr<const RasterReader> reader = std::move(opened);
    const DemInfo& raster = reader->info();
    TERRANE_TRY(const auto rect, place_of(path, raster, settings));
    if (auto ok = check_rect(rect, raster.columns, raster.rows, ErrorCode::bad_data); !ok) {
        return fail(ok.error().code, "the place of raster \"" + path + "\" " + ok.error().message);
    }
    TERRANE_TRY(auto samples, SurfaceSamples::read(reader, settings));
    const auto all = static_cast<double>(samples.all.size());
    SurfaceRasterInfo info;
    info.columns = raster.columns;
    info.rows = raster.rows;
    info.rect = rect;
    info.crs = raster.crs;
    info.nodata_share = static_cast<double>(samples.nodata_count) / all;
    auto map =
        std::make_shared<const RasterMap>(info, std::move(samples), std::move(materials), settings);
    if (info_out != nullptr) {
        info.unlisted_share = static_cast<double>(map->unlisted_count()) / all;
        *info_out = std::move(info);
    }
    return map;
}

}  // namespace

Result<std::shared_ptr<const SurfaceMap>> SurfaceRaster::open(const std::string& path,
                                                              const SurfaceRasterSettings& settings,
                                                              SurfaceRasterInfo* info_out) {
    try {
        return open_raster(path, settings, info_out);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::out_of_memory,
                    "out of memory while opening raster \"" + path + "\"");
    }
}

}  // namespace terrane
