// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace terrane {

/// Where the bounds computed by opening a raster are cached for the next opening. The key is a hash of the samples and
/// the lattice: changed heights get new bounds, a moved or copied raster finds its own. Rasters below 2^16 samples are
/// not cached.
struct DemCache {
    /// Where the cache is kept.
    enum class Place {
        none,    ///< no cache
        beside,  ///< in the raster's folder, as RASTER.xxxxxxxx.terrane-bounds; else in `folder`
        folder,  ///< in `folder`, which is created if absent
    };
    Place place = Place::none;  ///< where bounds are kept between runs
    std::string folder = {};    ///< "": none
};

/// Settings of DemHeights::open(). Fixed once it is open.
struct DemSettings {
    /// Finest spacing of the lattice, at most, metres; 0: the raster's own cell. Where the cells
    /// are square metres, the spacing is a cell over a power of two, so that samples lie on the
    /// lattice.
    double finest_spacing = 0.0;
    /// Where the cells are square metres, the spacing may be longer than `finest_spacing` by this factor, 1 to 2: the
    /// square root of 2 takes the halving of a cell that is nearest to `finest_spacing` as a ratio.
    double spacing_tolerance = 1.0;
    /// Adds fractal detail below the raster's own resolution; absent: none.
    std::optional<std::uint64_t> detail_seed;
    /// Amplitude of detail relative to the raster's local roughness.
    double detail_roughness = 1.0;
    /// A cache file that is damaged or cannot be written is no error: see DemInfo::cache_note.
    DemCache cache = {};

    /// Limit of the memory of opening the raster and of the source, bytes; rasters that need more are refused before
    /// they are read. For each sample about 1 byte, for the first 64 million samples 4 more, and about 200 MiB
    /// besides; nodata that is scattered takes up to 10 bytes a sample of it. Not counted: the cache of GDAL, a
    /// twentieth of the machine's memory unless GDAL_CACHEMAX is set.
    std::size_t memory_bytes = std::size_t{2} << 30;
    /// Longest time for opening the file, and for reading about four million samples of it, seconds,
    /// above 0; then the opening or read fails with timed_out. Infinite: no limit. After a timeout the thread
    /// continues, and the process ends without destructors of static objects.
    double read_timeout = 60.0;
    /// Called with the share of the opening that is done, 0 to 1, not decreasing; returning false cancels the opening.
    /// Called from several threads, one at a time. May be empty.
    std::function<bool(double share)> progress = {};
};

/// Size, georeferencing and statistics of a raster.
struct DemInfo {
    int columns = 0, rows = 0;          ///< samples
    double cell_x = 0.0, cell_y = 0.0;  ///< metres
    double min_m = 0.0, max_m = 0.0;    ///< of the valid samples
    double nodata_share = 0.0;          ///< of the samples, voids included, 0 to 1
    double filled_share = 0.0;          ///< of the samples: enclosed voids that were filled
    std::string crs;                    ///< name of the raster's CRS; "" if it has none
    std::string crs_wkt;                ///< the CRS as well-known text; "" if it has none
    bool geographic = false;            ///< whether the CRS has degrees instead of lengths
    /// World (0, 0) in the raster's CRS: easting and northing, or longitude and latitude in degrees.
    double centre_x = 0.0, centre_y = 0.0;
    /// World metres per unit of the CRS: x = (X - centre_x) * metres_per_unit_x. For geographic
    /// rasters a degree at the centre's latitude, on the ellipsoid.
    double metres_per_unit_x = 1.0, metres_per_unit_y = 1.0;
    /// Largest relative error of an east-west length, at the raster's northern or southern edge;
    /// 0 where the CRS is in metres; at most 9.
    double scale_error = 0.0;
    bool from_cache = false;  ///< bounds were read from the cache: DemSettings::cache
    /// Why a cache file was refused or not written, one sentence; "" if none was.
    std::string cache_note;
};

/// Surveyed heights: the bilinear surface of a raster that GDAL reads. World (0, 0) is the centre
/// of its outer edges. Cells in degrees become metres by one factor east and one north, those of
/// the centre: lines stay lines and samples stay on a grid.
///
/// Enclosed voids are filled smoothly and flagged; nodata connected to the border, and everything
/// beyond it, is outside. NaN and infinite samples are nodata.
///
/// Bounds hold for the file's own numbers, times scale, plus offset, whatever the band's type: they include the
/// errors of packing samples into 32 bits and of doubles that are too short (64-bit whole numbers, offsets that
/// cancel).
///
/// Rasters that do not fit into memory are read by window.
class DemHeights {
public:
    DemHeights() = delete;

    /// Opens a raster, with one pass over it for its bounds.
    ///
    /// Fails: io if it cannot be opened or read, and for pipes and devices; bad_data for an empty
    ///        raster, one of a single sample, one without a valid sample, or with one beyond
    ///        kMostHeight, which is named with its position, complex numbers, cells without area or more
    ///        than 32 times as long as wide, degrees that extend beyond a pole or so near that
    ///        scale_error is above 9; invalid_argument for settings out of range; out_of_memory above
    ///        memory_bytes, or if the system has less; timed_out after read_timeout; cancelled by
    ///        `progress`. The message names the file.
    /// Cost:  linear in the samples; over cells that are not square, in the points of the lattice: per sample the
    ///        ratio of the cell's longer side to the shorter. One more pass over the file if its numbers are 32-bit
    ///        whole numbers or have 64 bits
    static Result<std::shared_ptr<const HeightSource>> open(const std::string& path,
                                                            const DemSettings& settings,
                                                            DemInfo* info_out = nullptr);
};

}  // namespace terrane
