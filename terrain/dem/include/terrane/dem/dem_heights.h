// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/height_source.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace terrane {

/// Where to cache the bounds that opening a raster computes. The key of an entry is a hash of the samples and the
/// lattice: changed heights get new bounds, and a raster file that was moved still finds its bounds in `folder`.
/// Rasters with fewer than 2^16 samples are not cached.
struct DemCache {
    /// Location of the cache.
    enum class Place {
        none,    ///< no cache
        beside,  ///< RASTER.xxxxxxxx.terrane-bounds next to the raster; `folder` if that fails
        folder,  ///< in `folder`, which is created if absent
    };
    Place place = Place::none;  ///< location of the cache
    std::string folder = {};    ///< folder of the cache; "": none
};

/// How the bands of a raster encode heights.
enum class HeightEncoding {
    automatic,  ///< the numbers of the first band; a band of colours is refused
    numbers,    ///< the numbers of the first band, even if the file declares them as colours
    terrarium,  ///< 8-bit red, green and blue: red * 256 + green + blue / 256 - 32768
    mapbox,     ///< 8-bit red, green and blue: (red * 65536 + green * 256 + blue) / 10 - 10000
};

/// The plane of a raster's world.
enum class DemProjection {
    own,  ///< that of the raster's CRS
    /// The plane that touches the ellipsoid at the raster's middle, with z along the normal there (ENU). Lengths and
    /// angles are Euclidean, and the ground falls away with the Earth's curvature. Heights of the raster are taken as
    /// heights above the ellipsoid of its CRS.
    local,
};

/// Settings of DemHeights::open(). Fixed once the source is open.
struct DemSettings {
    /// Upper limit of the lattice's finest spacing, metres; 0: the raster's cell. If cells are square in metres, the
    /// spacing is the cell's side divided by a power of two, so that samples are lattice points.
    double finest_spacing = 0.0;
    /// Factor by which the spacing may exceed `finest_spacing` if cells are square in metres, 1 to 2. With the square
    /// root of 2, the spacing is the one whose ratio to `finest_spacing` is nearest to 1.
    double spacing_tolerance = 1.0;
    /// Seed of fractal detail below the raster's resolution; absent: no detail.
    std::optional<std::uint64_t> detail_seed;
    /// Amplitude of detail relative to the raster's local roughness.
    double detail_roughness = 1.0;
    /// A damaged or unwritable cache file is not an error: see DemInfo::cache_note.
    DemCache cache = {};
    /// File with what an earlier opening found; "": none. If it is absent, opening writes it, with one more pass, and
    /// reserves about 1 byte per sample beside it while the source exists, in place of memory. Otherwise opening reads
    /// it instead of the samples, and the source needs at most about 0.5 GiB for any raster. Samples are then read by
    /// window, in squares of 256 x 256, and compared with their hashes: if the raster or settings of its numbers have
    /// changed, reading fails with bad_data. If sizes or times of its files have changed, opening compares all samples.
    /// A file of another raster or lattice is an invalid_argument. Not used for a raster that is resampled (see
    /// DemHeights).
    std::string scan_file = {};

    /// Unit of the numbers, such as "foot", in a spelling of GDAL, PROJ, EPSG or CF. Replaces the units of the band and
    /// of the vertical CRS. "": the file's; metres if it names none.
    std::string height_unit = {};
    /// Factor of all heights, after the file's scale and offset and the unit. Not 0; negative makes depths heights.
    double height_scale = 1.0;
    /// Numbers that are nodata, besides those that the file declares: before scale, offset and unit; of an encoding,
    /// the decoded heights. Absent: opening refuses a raster with numbers that are commonly nodata and far from all
    /// others, such as -9999. Empty: these are heights.
    std::optional<std::vector<double>> nodata = {};
    /// How the bands encode heights.
    HeightEncoding encoding = HeightEncoding::automatic;
    /// Side of the cells of a raster without georeferencing, metres; 0: 1 m, with a note. Also that of the cells to
    /// which a raster is resampled (see DemHeights); 0: the shorter side of its own cells at its middle. Must be 0 for
    /// other rasters.
    double cell = 0.0;
    /// The plane of the world.
    DemProjection projection = DemProjection::own;
    /// Rectangle to which the raster is cropped, in its CRS: west, south, east and north; without georeferencing,
    /// metres from the raster's south-west corner. The samples inside and the nearest ones outside are opened as if the
    /// file had no others, and others are not read. Parts of it beyond the raster are left out. Absent: no crop.
    std::optional<std::array<double, 4>> crop = {};

    /// Memory limit for opening the raster and for the source, bytes; rasters that need more are refused before they
    /// are read. A raster needs about 200 MiB, 1 byte per sample (on the disk if a scan_file is written), and 4 more
    /// bytes per sample (128 MiB if it has over 64 million samples); scattered nodata needs up to 10 bytes per sample.
    /// Not included: GDAL's cache, a twentieth of the machine's memory unless GDAL_CACHEMAX is set.
    std::size_t memory_bytes = std::size_t{2} << 30;
    /// Timeout for opening the file, and for reading each strip of about four million samples, seconds, > 0; the
    /// opening or read then fails with timed_out. Infinite: no limit. After a timeout the blocked thread continues, and
    /// the process exits without running destructors of static objects.
    double read_timeout = 60.0;
    /// Called with the completed share of the opening, 0 to 1, not decreasing; returning false cancels the opening.
    /// Called from several threads, one at a time. May be empty.
    std::function<bool(double share)> progress = {};
};

/// Size, georeferencing and statistics of a raster.
struct DemInfo {
    int columns = 0, rows = 0;          ///< samples
    double cell_x = 0.0, cell_y = 0.0;  ///< metres
    double min_m = 0.0, max_m = 0.0;    ///< range of the valid samples
    double nodata_share = 0.0;          ///< share of samples without data, voids included, 0 to 1
    double filled_share = 0.0;          ///< share of samples in enclosed voids, which were filled
    std::string crs;                    ///< name of the raster's CRS; "" if it has none
    /// The CRS as well-known text; "" if it has none. With DemProjection::local, the orthographic projection onto the
    /// tangent plane, in which points of the ellipsoid have their world x and y.
    std::string crs_wkt;
    DemProjection projection = DemProjection::own;  ///< as DemSettings::projection
    /// With DemProjection::local, where the plane touches the ellipsoid: degrees, from the CRS's prime meridian.
    double middle_longitude = 0.0, middle_latitude = 0.0;
    bool geographic = false;  ///< whether the CRS is in degrees or another unit of angles
    /// World (0, 0) in the raster's CRS: easting and northing, or longitude and latitude, in its units.
    double centre_x = 0.0, centre_y = 0.0;
    /// World metres per unit of the CRS: x = (X - centre_x) * metres_per_unit_x. For geographic rasters, per degree or
    /// other unit at the centre's latitude, on the ellipsoid. For Mercator's projections, and others that distort
    /// lengths at the centre by more than 5 percent, metres on the ellipsoid per unit at the centre.
    double metres_per_unit_x = 1.0, metres_per_unit_y = 1.0;
    /// Bound of the relative error of lengths, in any direction, anywhere on the raster: of the distance in the plane
    /// between two places up to 20 km apart against the geodesic on the ellipsoid of WGS 84. It counts the distortion
    /// of the projection; places outside the projection are left out. Of a longer line the error may exceed it a little
    /// if its geodesic leaves the raster. About 9 at most if the CRS is geographic; 0 without a CRS.
    double scale_error = 0.0;
    /// Of a raster that is resampled, the largest vertical distance from the raster's own surface, metres; bounds of
    /// the source include that of their neighbourhood. 0: not resampled.
    double resampling_error = 0.0;
    /// What each of these was taken to be, and from where: "Int16", "foot, from the band", "up, assumed",
    /// "-9999, declared", "geotransform".
    std::string numbers, height_unit, vertical_axis, nodata, placement;
    /// Assumptions about the meaning of the file, one sentence each; empty if the file says it all.
    std::vector<std::string> notes;
    bool from_cache = false;  ///< whether bounds were read from the cache: DemSettings::cache
    /// Why a cache file was refused or not written, one sentence; "" if none was.
    std::string cache_note;
    /// Hash of all samples, if DemSettings::scan_file was written or read: 32 hexadecimal digits. Otherwise "".
    std::string samples_hash;
};

/// Surveyed heights: the bilinear surface of a raster that GDAL reads. World (0, 0) is the centre of the raster's outer
/// edges. Cells in degrees are converted to metres by two constants, the lengths of a degree east and north at the
/// centre: straight lines stay straight, and samples stay on a grid.
///
/// Enclosed voids are filled smoothly and flagged; nodata connected to the border, and everything beyond the border, is
/// outside. NaN and infinite samples are nodata.
///
/// Bounds hold for the file's exact numbers times scale plus offset, whatever the band's type. They include the
/// rounding of samples to 32 bits, of 64-bit integers to double, and of sums in which the offset cancels.
///
/// A raster whose rows and columns are not parallel to x and y (its geotransform turns by no multiple of 90 degrees, or
/// shears, or ground control points place it), and every raster with DemProjection::local, is resampled to square
/// cells. Its surface is then bilinear between the new samples, which are points of the raster's own bilinear surface,
/// and bounds include the distance from that surface, computed cell by cell. Cells that the raster's edge crosses are
/// ground; its voids are filled anew. Control points place it by the polynomials that GDAL fits to them.
///
/// Rasters that do not fit into memory are read by window.
class DemHeights {
public:
    DemHeights() = delete;

    /// Opens a raster, with one pass over it for its bounds.
    ///
    /// Fails: io if it cannot be opened or read, and for pipes and devices; bad_data for a raster with fewer than 2 x 2
    ///        samples or no valid one, a sample beyond kMostHeight (the message gives its position), undeclared nodata
    ///        (DemSettings::nodata), colours, an unknown unit, several subdatasets, complex numbers,
    ///        cells without area or more than 32 times as long as wide, a crop outside the raster or with fewer than
    ///        2 x 2 samples, and a geographic raster that extends beyond a pole or has a scale_error above 9;
    ///        for DemProjection::local, a raster without a place on the Earth, one that extends more than 60 degrees
    ///        from its middle, and slopes that overhang in the plane;
    ///        invalid_argument for settings out of range; out_of_memory above memory_bytes, or if the system has less;
    ///        timed_out after read_timeout; cancelled by `progress`. The message names the file.
    /// Cost:  linear in the samples. If cells are not square, also in the ratio of a cell's longer side to its shorter
    ///        one. Bands of 32-bit integers or 64-bit numbers need a second pass over the file
    static Result<std::shared_ptr<const HeightSource>> open(const std::string& path,
                                                            const DemSettings& settings,
                                                            DemInfo* info_out = nullptr);
};

}  // namespace terrane
