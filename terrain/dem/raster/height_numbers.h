// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/dem/dem_heights.h>

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

class GDALDataset;

namespace terrane::internal {

/// Meaning of a raster's numbers.
enum class RasterNumbers {
    heights,  ///< in metres or another unit, which is converted; ground control points: interpolated
    plain,  ///< without a unit, possibly codes; a rotated raster is resampled by nearest neighbour
};

/// The settings of DemSettings that state what a raster's numbers mean, and where they are: see there.
struct NumberReading {
    std::string unit = {};
    double scale = 1.0;
    std::optional<std::vector<double>> nodata = {};
    HeightEncoding encoding = HeightEncoding::automatic;
    double cell = 0.0;
    DemProjection projection = DemProjection::own;
    std::optional<std::array<double, 4>> crop = {};
};

/// Fails: invalid_argument for settings out of range
Result<NumberReading> number_reading(const DemSettings& settings);

/// How the samples of a raster become heights. The number of a sample is that of the first band; of an encoding, the
/// three bytes as one whole number.
struct BandNumbers {
    /// A height is scale * number + offset, in metres; for RasterNumbers::plain without a unit.
    double scale = 1.0, offset = 0.0;
    /// Likewise, for the numbers of DemSettings::nodata, which of an encoding are the decoded heights.
    double nodata_scale = 1.0, nodata_offset = 0.0;
    std::array<int, 3> bands{1, 0, 0};  ///< of red, green and blue; {1, 0, 0}: not encoded
    bool is_signed_byte = false;      ///< bytes of 128 and above stand for numbers from -128 to -1
    std::vector<double> nodata = {};  ///< numbers that GDAL's mask may show as valid

    bool is_encoded() const { return bands[1] != 0; }
    /// Whether numbers differ from what GDAL reads from the band.
    bool is_decoded() const { return is_encoded() || is_signed_byte || !nodata.empty(); }
};

/// Reads the metadata that decides what the numbers mean: the bands' colours, the type, unit, axis and nodata. Sets the
/// texts of `info_out`.
///
/// @param raster its path
///
/// Fails: bad_data if the file does not say what its numbers mean; the message says which setting would. No sample is
///        read
Result<BandNumbers> read_meaning(const std::string& raster, GDALDataset& dataset,
                                 RasterNumbers numbers, const NumberReading& reading,
                                 DemInfo& info_out);

/// The bands declared as red, green and blue, else the first three, else the first.
std::vector<int> bands_by_colour(GDALDataset& dataset);

/// The dataset's geotransform; absent if it has none. GDAL's default, 0,1,0,0,0,1, is none, because programs write it
/// to files without georeferencing.
std::optional<std::array<double, 6>> geotransform_of(GDALDataset& dataset);

/// The lowest and the highest distinct heights of a raster, to find nodata that the file does not declare.
class ExtremeHeights {
public:
    struct Height {
        double height = 0.0;
        std::size_t index = 0;  ///< of one of its samples, row by row from the south-west
    };

    void add(double height, std::size_t index) {
        if (lowest_.is_new(height)) lowest_.insert({height, index});
        if (highest_.is_new(-height)) highest_.insert({-height, index});
    }
    /// The heights whose numbers are commonly nodata, each farther from the next height than all others are from each
    /// other.
    ///
    /// @param scale, offset metres per number, metres
    std::vector<Height> undeclared_nodata(double scale, double offset) const;

private:
    // Ascending, without repetition.
    struct Few {
        static constexpr std::size_t kMost = 4;
        std::array<Height, kMost> all{};
        std::size_t count = 0;

        bool is_new(double height) const {
            return count < kMost ? count == 0 || height != all[0].height
                                 : height < all[kMost - 1].height && height != all[0].height;
        }
        void insert(const Height& added);
    };
    Few lowest_, highest_;  ///< of heights, and of heights times -1
};

/// The number of a height, rounded to a whole number if it differs only by the rounding of scale and offset.
double number_of(double height, double scale, double offset);

/// A number with as many digits as it needs, in the C locale.
std::string exact_text(double value);

/// West, south, east and north, separated by commas.
std::string crop_text(const std::array<double, 4>& crop);

}  // namespace terrane::internal
