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

/// Where the bounds that opening a raster makes are kept for the next opening. They are found again by the
/// samples themselves and the lattice: a raster whose heights changed gets new ones, one that was moved or
/// copied keeps its own. Rasters below 2^16 samples open faster than that pays.
struct DemCache {
    enum class Place {
        none,  ///< nothing is kept, or looked for
        beside,  ///< in the raster's folder, as RASTER.xxxxxxxx.terrane-bounds; `folder` where that cannot be
        folder,  ///< in `folder`, which is made where it is absent
    };
    Place place = Place::none;
    std::string folder = {};  ///< "": nothing is kept there
};

struct DemSettings {
    /// Finest spacing of the lattice, at most, metres; 0: the raster's own cell. Where the cells
    /// are square metres, the spacing is a cell over a power of two, so that samples lie on the
    /// lattice.
    double finest_spacing = 0.0;
    /// Adds fractal detail below the raster's own resolution; absent: none.
    std::optional<std::uint64_t> detail_seed;
    /// Detail's height over the roughness that the raster has around it.
    double detail_roughness = 1.0;
    /// A file that cannot be written, or is not what it should be, is no error: see DemInfo::cache_note.
    DemCache cache = {};

    /// Most memory that opening the raster may take and the source may keep, bytes; what needs more is
    /// refused before it is read. For each sample about 1 byte, for the first 64 million samples 4
    /// more, and about 200 MiB besides; nodata that is scattered takes up to 10 bytes a sample of it.
    /// Not counted: the cache of GDAL, a twentieth of the machine's memory unless GDAL_CACHEMAX is set.
    std::size_t memory_bytes = std::size_t{2} << 30;
    /// Longest time for opening the file, and for reading about four million samples of it, seconds,
    /// above 0; after it the raster has stopped answering. Infinity: waits for ever. Where a read was
    /// given up, its thread goes on, and the process ends without destructors of static objects.
    double read_timeout = 60.0;
    /// Is told the share of the opening that is done, 0 to 1, never less than before; false stops the
    /// opening. Called from several threads, one at a time. Empty: nobody is told.
    std::function<bool(double share)> progress = {};
};

/// What a raster is and where it lies.
struct DemInfo {
    int columns = 0, rows = 0;
    double cell_x = 0.0, cell_y = 0.0;  ///< metres
    double min_m = 0.0, max_m = 0.0;    ///< of the valid samples
    double nodata_share = 0.0;          ///< of the samples, voids included, 0 to 1
    double filled_share = 0.0;          ///< of the samples: enclosed voids that were filled
    std::string crs;                    ///< name of the raster's CRS; "" where it has none
    bool geographic = false;
    /// Where world (0, 0) lies in the raster's CRS: easting and northing, or longitude and latitude
    /// in degrees.
    double centre_x = 0.0, centre_y = 0.0;
    /// World metres for one unit of the CRS: x = (X - centre_x) * metres_per_unit_x. For geographic
    /// rasters a degree at the centre's latitude, on the ellipsoid.
    double metres_per_unit_x = 1.0, metres_per_unit_y = 1.0;
    /// Largest relative error of an east-west length, at the raster's northern or southern edge;
    /// 0 where the CRS is in metres; at most 9.
    double scale_error = 0.0;
    bool from_cache = false;  ///< bounds were not made, but read: DemSettings::cache
    /// Why a file of the cache was refused or not written, one sentence; "" where nothing went wrong.
    std::string cache_note;
};

/// Surveyed heights: the bilinear surface of any raster that GDAL reads. World (0, 0) is the centre
/// of its outer edges. Cells in degrees become metres by one factor east and one north, those of
/// the centre: lines stay lines and samples stay on a grid.
///
/// Enclosed voids are filled smoothly and flagged; nodata connected to the border, and everything
/// beyond it, is outside. NaN and infinite samples are nodata.
///
/// Bounds hold for the file's own numbers, times scale, plus offset, whatever the band's type: what
/// is lost where samples are held in 32 bits, and where doubles are too short (64-bit whole numbers,
/// offsets that cancel), is part of them.
///
/// Rasters that do not fit in memory are read by window.
class DemHeights {
public:
    DemHeights() = delete;

    /// Opens a raster and makes one pass over it for its bounds.
    ///
    /// Fails: io where it cannot be opened or read, and for pipes and devices; bad_data for an empty
    ///        raster, one of a single sample, one without a valid sample, or with one beyond
    ///        kMostHeight, which is named with its place, complex numbers, cells without area or more
    ///        than 32 times as long as wide, degrees that reach beyond a pole or so near that
    ///        scale_error is above 9; invalid_argument for settings out of range; out_of_memory above
    ///        memory_bytes, or where the system has less; timed_out after read_timeout; cancelled by
    ///        `progress`. The message names the file.
    /// Cost:  linear in the samples; over cells that are not square, in the points of the lattice: as
    ///        many for a sample as the cell's longer side is times the shorter. One more pass over the
    ///        file where its numbers are 32-bit whole numbers or have 64 bits
    static Result<std::shared_ptr<const HeightSource>> open(const std::string& path,
                                                            const DemSettings& settings,
                                                            DemInfo* info_out = nullptr);
};

}  // namespace terrane
