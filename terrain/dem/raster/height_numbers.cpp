// SPDX-License-Identifier: MIT
//
// What the numbers of a raster mean: type, encoding, unit, axis, nodata and placement, each with its source.
//
// Sources: EPSG Geodetic Parameter Dataset and PROJ (units of length); CF Conventions 1.10, section 4.3.1 (`positive`)
//          and the UDUNITS-2 names; Tilezen Joerd (Terrarium encoding); Mapbox Terrain-RGB.
#include "raster/height_numbers.h"

#include "raster/raster_checks.h"

#include <terrane/base/text.h>

#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string_view>
#include <utility>

namespace terrane::internal {

std::string exact_text(double value) {
    char text[40];
    for (int digits = 6; digits <= 17; ++digits) {
        CPLsnprintf(text, sizeof text, "%.*g", digits, value);
        if (CPLAtof(text) == value) break;
    }
    return text;
}

namespace {

constexpr double kFoot = 0.3048, kSurveyFoot = 1200.0 / 3937.0;
/// Metres per square second and metre: geopotential per geopotential height (WMO).
constexpr double kStandardGravity = 9.80665;

/// A unit of height.
struct HeightUnit {
    std::string_view name;
    double metres;
    /// Spellings as compact_unit() writes them, with blanks between; a plural s is optional.
    std::string_view spellings;
    bool is_geopotential = false;
};

constexpr auto kHeightUnits = std::to_array<HeightUnit>({
    {"metre", 1.0, "m metre meter mtr masl mamsl"},
    {"kilometre", 1e3, "km kilometre kilometer"},
    {"hectometre", 1e2, "hm hectometre hectometer"},
    {"decametre", 10.0, "dam decametre decameter dekametre dekameter"},
    {"decimetre", 0.1, "dm decimetre decimeter"},
    {"centimetre", 0.01, "cm centimetre centimeter"},
    {"millimetre", 0.001, "mm millimetre millimeter"},
    {"foot", kFoot,
     "ft foot feet ift intft ftint internationalfoot internationalfeet footinternational "
     "feetinternational footintl feetintl intlfoot intlfeet"},
    {"US survey foot", kSurveyFoot,
     "usft ftus sft usfoot usfeet footus feetus ussft surveyfoot surveyfeet ussurveyfoot "
     "ussurveyfeet ussurveyft footussurvey feetussurvey ftussurvey"},
    {"yard", 0.9144, "yd yard internationalyard"},
    {"inch", 0.0254, "in inch inches internationalinch"},
    {"fathom", 1.8288, "fath fathom ftm internationalfathom"},
    {"chain", 20.1168, "ch chain internationalchain"},
    {"link", 0.201168, "link internationallink"},
    {"mile", 1609.344, "mi mile statutemile internationalmile internationalstatutemile"},
    {"nautical mile", 1852.0, "nmi kmi nauticalmile internationalnauticalmile"},
    {"US survey inch", kSurveyFoot / 12.0, "usin ussurveyinch ussurveyorsinch"},
    {"US survey yard", kSurveyFoot * 3.0, "usyd ussurveyyard ussurveyorsyard"},
    {"US survey chain", kSurveyFoot * 66.0, "usch ussurveychain ussurveyorschain"},
    {"US survey mile", kSurveyFoot * 5280.0, "usmi ussurveymile ussurveyorsstatutemile"},
    {"Indian foot", 0.30479841, "indft indianfoot indianfoot1937"},
    {"Indian yard", 0.91439523, "indyd indianyard indianyard1937"},
    {"Indian chain", 20.11669506, "indch indianchain"},
    {"Clarke's foot", 0.3047972654, "clarkefoot clarke'sfoot"},
    {"British foot (Sears 1922)", 12.0 / 39.370147, "britishfootsears1922"},
    {"Gold Coast foot", 6378300.0 / 20926201.0, "goldcoastfoot"},
    {"German legal metre", 1.0000135965, "germanlegalmetre germanlegalmeter"},
    {"geopotential metre", 1.0, "gpm geopotentialmetre geopotentialmeter", true},
    {"geopotential decametre", 10.0, "gpdam dagpm", true},
    {"m2 s-2 (geopotential)", 1.0 / kStandardGravity, "m2s-2 m2/s2 m²s⁻² m²/s² j/kg jkg-1", true},
});

/// A unit's name without what spellings differ in: case, brackets, blanks, * ^ _ . and hyphens that are no minus.
std::string compact_unit(std::string_view name) {
    std::string compact;
    for (std::size_t i = 0; i < name.size(); ++i) {
        const auto letter = static_cast<unsigned char>(name[i]);
        const bool is_minus = letter == '-' && i + 1 < name.size() &&
                              std::isdigit(static_cast<unsigned char>(name[i + 1])) != 0;
        if (is_minus) compact += '-';
        if (std::isspace(letter) != 0 ||
            std::string_view("[](){}*^_.-").find(name[i]) != std::string_view::npos) {
            continue;
        }
        compact += static_cast<char>(std::tolower(letter));
    }
    return compact;
}

/// Null for an unknown name.
const HeightUnit* find_unit(std::string_view name) {
    const std::string compact = compact_unit(name);
    if (compact.empty()) return nullptr;
    const bool has_plural = compact.size() > 2 && compact.back() == 's';
    const std::string singular = has_plural ? compact.substr(0, compact.size() - 1) : compact;
    for (const HeightUnit& unit : kHeightUnits) {
        std::string_view spellings = unit.spellings;
        while (!spellings.empty()) {
            const std::string_view spelling = spellings.substr(0, spellings.find(' '));
            if (spelling == compact || spelling == singular) return &unit;
            spellings.remove_prefix(std::min(spelling.size() + 1, spellings.size()));
        }
    }
    return nullptr;
}

std::string known_units() {
    std::string known;
    for (const HeightUnit& unit : kHeightUnits) {
        if (!known.empty()) known += ", ";
        known += unit.name;
    }
    return known;
}

std::string quoted_name(std::string_view text) {
    std::string name = "\"";
    name += text;
    name += '"';
    return name;
}

bool equals_ignoring_case(const char* text, const char* word) {
    return text != nullptr && EQUAL(text, word);
}

Result<void> check_colours(const std::string& raster, GDALDataset& dataset) {
    const GDALColorInterp colour = dataset.GetRasterBand(1)->GetColorInterpretation();
    if (colour == GCI_Undefined || colour == GCI_GrayIndex) return {};
    const std::string declared = colour == GCI_PaletteIndex
                                     ? "indices of a colour table"
                                     : GDALGetColorInterpretationName(colour);
    return fail(ErrorCode::bad_data,
                named_raster(raster) + " has colours, not heights: its first band is declared as " +
                    declared +
                    "; if the colours encode heights, give --encoding terrarium or mapbox; if the "
                    "band's numbers "
                    "are heights, give --encoding numbers (DemSettings::encoding)");
}

/// Sets the bands, scale and offset of an encoding.
Result<void> read_encoding(const std::string& raster, GDALDataset& dataset, HeightEncoding encoding,
                           BandNumbers& numbers_out) {
    const bool is_terrarium = encoding == HeightEncoding::terrarium;
    const std::string name = is_terrarium ? "the Terrarium encoding" : "the Mapbox encoding";
    const std::vector<int> bands = bands_by_colour(dataset);
    if (bands.size() != 3) {
        return fail(ErrorCode::bad_data, named_raster(raster) + " has " +
                                             number_text(dataset.GetRasterCount()) + " bands, " +
                                             name + " needs red, green and blue");
    }
    for (std::size_t i = 0; i < 3; ++i) {
        const GDALDataType type = dataset.GetRasterBand(bands[i])->GetRasterDataType();
        if (type != GDT_Byte) {
            return fail(ErrorCode::bad_data, named_raster(raster) + " has " +
                                                 GDALGetDataTypeName(type) + " samples in band " +
                                                 number_text(bands[i]) + ", " + name +
                                                 " needs 8-bit ones");
        }
        numbers_out.bands[i] = bands[i];
    }
    const char* compression = dataset.GetMetadataItem("COMPRESSION", "IMAGE_STRUCTURE");
    const char* loss = dataset.GetMetadataItem("COMPRESSION_REVERSIBILITY", "IMAGE_STRUCTURE");
    const std::string_view packed = compression != nullptr ? compression : "";
    if (packed.find("JPEG") != std::string_view::npos || equals_ignoring_case(loss, "LOSSY")) {
        return fail(ErrorCode::bad_data, named_raster(raster) + " is compressed with loss (" +
                                             std::string(packed) + "), " + name +
                                             " needs the exact colours");
    }
    numbers_out.scale = is_terrarium ? 1.0 / 256.0 : 0.1;
    numbers_out.offset = is_terrarium ? -32768.0 : -10000.0;
    return {};
}

/// Unit and direction of heights, each with its source.
struct Vertical {
    double metres = 1.0;  ///< per unit
    std::string unit = "metre, assumed";
    bool is_down = false;
    std::string axis = "up, assumed";
};

/// The unit and the direction of the vertical axis of the CRS; those of Vertical without such an axis.
Vertical vertical_of(const OGRSpatialReference* crs) {
    Vertical vertical;
    if (crs == nullptr) return vertical;
    const bool is_vertical = crs->IsVertical() != 0;
    const bool is_compound = crs->IsCompound() != 0;
    if (!is_vertical && !is_compound && crs->GetAxesCount() < 3) return vertical;
    OGRAxisOrientation orientation = OAO_Other;
    double metres = 0.0;
    const int axis = is_compound || !is_vertical ? 2 : 0;
#if GDAL_VERSION_NUM >= GDAL_COMPUTE_VERSION(3, 4, 0)
    crs->GetAxis(nullptr, axis, &orientation, &metres);
#else
    crs->GetAxis(nullptr, axis, &orientation);
#endif
    const char* unit_name = nullptr;
    if (is_vertical || is_compound) {
        metres =
            crs->GetTargetLinearUnits(is_compound ? "COMPD_CS|VERT_CS" : "VERT_CS", &unit_name);
    }
    if (!(metres > 0.0)) metres = 1.0;
    const char* crs_name = is_compound ? crs->GetAttrValue("COMPD_CS|VERT_CS") : crs->GetName();
    const std::string from = std::string(", from the ") +
                             (is_compound || is_vertical ? "vertical" : "3D") + " CRS" +
                             (crs_name != nullptr ? " " + quoted_name(crs_name) : std::string());
    vertical.metres = metres;
    std::string name = unit_name != nullptr ? unit_name : "";
    if (name.empty()) name = metres == 1.0 ? "metre" : exact_text(metres) + " m";
    vertical.unit = name + from;
    if (orientation == OAO_Down || orientation == OAO_Up) {
        vertical.is_down = orientation == OAO_Down;
        vertical.axis = (vertical.is_down ? "down" : "up") + from;
    }
    return vertical;
}

/// The direction that the band's attributes state; nothing if they state none.
void read_band_axis(GDALRasterBand& band, Vertical& vertical_out) {
    const char* positive = band.GetMetadataItem("positive");
    if (equals_ignoring_case(positive, "up") || equals_ignoring_case(positive, "down")) {
        vertical_out.is_down = EQUAL(positive, "down");
        vertical_out.axis = std::string(vertical_out.is_down ? "down" : "up") +
                            ", from the band's attribute positive";
        return;
    }
    const char* name = band.GetMetadataItem("standard_name");
    const std::string_view standard = name != nullptr ? name : "";
    if (standard != "depth" && !standard.starts_with("depth_") &&
        !standard.starts_with("sea_floor_depth_"))
        return;
    vertical_out.is_down = true;
    vertical_out.axis = "down, from the band's standard_name " + quoted_name(standard);
}

/// Unit and direction of the heights.
Result<Vertical> read_vertical(const std::string& raster, GDALDataset& dataset,
                               const NumberReading& reading, std::vector<std::string>& notes_out) {
    GDALRasterBand& band = *dataset.GetRasterBand(1);
    Vertical vertical = vertical_of(dataset.GetSpatialRef());
    read_band_axis(band, vertical);
    const bool is_depth = equals_ignoring_case(band.GetDescription(), "depth");
    if (is_depth && vertical.axis == Vertical().axis && reading.scale > 0.0) {
        notes_out.push_back(named_raster(raster) +
                            " calls its band \"depth\", and no metadata says that it is positive "
                            "downward: its numbers "
                            "are taken as heights; give --height-scale -1 if they are depths");
    }
    const std::string band_unit = band.GetUnitType();
    const HeightUnit* unit = nullptr;
    if (!reading.unit.empty()) {
        unit = find_unit(reading.unit);  // checked by number_reading()
        vertical.unit = std::string(unit->name) + ", as set";
    } else if (!compact_unit(band_unit).empty()) {
        unit = find_unit(band_unit);
        if (unit == nullptr) {
            return fail(ErrorCode::bad_data,
                        named_raster(raster) + " has numbers in " + quoted_name(band_unit) +
                            ", which is no unit of height; give it as --height-unit "
                            "(DemSettings::height_unit), known are " +
                            known_units());
        }
        const bool has_other =
            vertical.unit != Vertical().unit && std::fabs(vertical.metres - unit->metres) > 1e-12;
        if (has_other) {
            notes_out.push_back(named_raster(raster) + " names two units of height, " +
                                vertical.unit + ", and " + quoted_name(band_unit) +
                                ", from the band, which is used");
        }
        vertical.unit = std::string(unit->name) + ", from the band";
    }
    if (unit == nullptr) return vertical;
    vertical.metres = unit->metres;
    if (unit->is_geopotential) {
        notes_out.push_back(named_raster(raster) +
                            " has geopotential heights, which are used as heights; they differ by "
                            "up to 0.6 % below "
                            "20 km");
    }
    return vertical;
}

void read_nodata(GDALRasterBand& band, const NumberReading& reading, BandNumbers& numbers_out,
                 DemInfo& info_out) {
    std::string& text = info_out.nodata;
    int is_declared = 0;
    double declared = band.GetNoDataValue(&is_declared);
    if (is_declared != 0) {
        if (numbers_out.is_signed_byte) {
            if (declared > 127.0) declared -= 256.0;
            numbers_out.nodata.push_back(declared);
        }
        text = exact_text(declared) + ", declared";
    }
    const int flags = band.GetMaskFlags();
    if ((flags & (GMF_ALL_VALID | GMF_NODATA)) == 0) {
        text += text.empty() ? "" : "; ";
        text += (flags & GMF_ALPHA) != 0 ? "where the alpha band is 0" : "where the mask band is 0";
    }
    for (const double value : reading.nodata.value_or(std::vector<double>())) {
        const double number = numbers_out.is_encoded()
                                  ? std::round((value - numbers_out.offset) / numbers_out.scale)
                                  : value;
        const bool is_float = !numbers_out.is_encoded() && band.GetRasterDataType() == GDT_Float32;
        numbers_out.nodata.push_back(is_float ? static_cast<double>(static_cast<float>(number))
                                              : number);
        text += (text.empty() ? "" : "; ") + exact_text(value) + ", as set";
    }
    if (text.empty()) text = "none";
}

/// Notes on data of the file that are not read.
void note_ignored(const std::string& raster, GDALDataset& dataset, const BandNumbers& numbers,
                  std::vector<std::string>& notes_out) {
    int others = 0;
    for (int band = 2; band <= dataset.GetRasterCount(); ++band) {
        others += dataset.GetRasterBand(band)->GetColorInterpretation() == GCI_AlphaBand ? 0 : 1;
    }
    if (others > 0 && !numbers.is_encoded()) {
        notes_out.push_back(
            named_raster(raster) + " has " + number_text(dataset.GetRasterCount()) +
            " bands, of which the first is read; \"vrt://FILE?bands=2\" names the second");
    }
}

/// Whether a number is one that programs use as nodata.
bool is_common_nodata(double number) {
    constexpr std::array kLimits{32767.0,      32768.0,      65535.0,
                                 2147483647.0, 2147483648.0, 4294967295.0};
    const double size = std::fabs(number);
    if (std::ranges::find(kLimits, size) != kLimits.end()) return true;
    // -999, -9999, 9999, -10000, -99999 and so on.
    for (double power = 1e3; power < 1e12; power *= 10.0) {
        if (size == power - 1.0) return number < 0.0 || power > 1e3;
        if (number == -power) return power > 1e3;
    }
    return false;
}

}  // namespace

double number_of(double height, double scale, double offset) {
    const double number = (height - offset) / scale;
    const double whole = std::round(number);
    return std::fabs(number - whole) <= 1e-9 * std::max(1.0, std::fabs(number)) ? whole : number;
}

void ExtremeHeights::Few::insert(const Height& added) {
    std::size_t at = 0;
    while (at < count && all[at].height < added.height) ++at;
    if (at < count && all[at].height == added.height) return;
    count = std::min(count + 1, kMost);
    for (std::size_t i = count - 1; i > at; --i) all[i] = all[i - 1];
    all[at] = added;
}

std::vector<ExtremeHeights::Height> ExtremeHeights::undeclared_nodata(double scale,
                                                                      double offset) const {
    std::vector<Height> found;
    // Index of the first height that is kept, from either end.
    std::array<std::size_t, 2> kept{0, 0};
    for (int pass = 0; pass < 4; ++pass) {
        const auto end = static_cast<std::size_t>(pass % 2);
        const Few& from = end == 0 ? lowest_ : highest_;
        const Few& other = end == 0 ? highest_ : lowest_;
        const double sign = end == 0 ? 1.0 : -1.0;
        for (std::size_t& i = kept[end]; i + 1 < from.count; ++i) {
            const double next = from.all[i + 1].height;
            const double range = -other.all[kept[1 - end]].height - next;
            if (!is_common_nodata(number_of(sign * from.all[i].height, scale, offset)) ||
                range < 0.0 || next - from.all[i].height <= range) {
                break;
            }
            found.push_back({sign * from.all[i].height, from.all[i].index});
        }
    }
    return found;
}

Result<NumberReading> number_reading(const DemSettings& settings) {
    const auto out_of_range = [](const std::string& message) {
        return fail(ErrorCode::invalid_argument, message);
    };
    if (!settings.height_unit.empty() && find_unit(settings.height_unit) == nullptr) {
        return out_of_range("height_unit must be one of " + known_units() + ", got " +
                            quoted_name(settings.height_unit));
    }
    if (!std::isfinite(settings.height_scale) || settings.height_scale == 0.0) {
        return out_of_range("height_scale must be finite and not 0, got " +
                            number_text(settings.height_scale));
    }
    if (!(settings.cell >= 0.0) || !std::isfinite(settings.cell)) {
        return out_of_range("cell must be 0 or above, got " + number_text(settings.cell));
    }
    if (settings.crop) {
        const auto& [west, south, east, north] = *settings.crop;
        const bool is_finite =
            std::ranges::all_of(*settings.crop, [](double value) { return std::isfinite(value); });
        if (!is_finite || !(west < east) || !(south < north)) {
            return out_of_range(
                "crop must be west,south,east,north with west below east and "
                "south below north, got " +
                crop_text(*settings.crop));
        }
    }
    return NumberReading{settings.height_unit, settings.height_scale, settings.nodata,
                         settings.encoding,    settings.cell,         settings.projection,
                         settings.crop};
}

Result<BandNumbers> read_meaning(const std::string& raster, GDALDataset& dataset,
                                 RasterNumbers numbers, const NumberReading& reading,
                                 DemInfo& info_out) {
    GDALRasterBand& band = *dataset.GetRasterBand(1);
    TERRANE_TRY(check_band(raster, band));
    if (numbers == RasterNumbers::heights && reading.encoding == HeightEncoding::automatic) {
        TERRANE_TRY(check_colours(raster, dataset));
    }
    BandNumbers meaning;
    meaning.scale = band.GetScale();
    meaning.offset = band.GetOffset();
    info_out.numbers = GDALGetDataTypeName(band.GetRasterDataType());
    // GDAL has had a type for signed bytes since 3.7.
    meaning.is_signed_byte =
        band.GetRasterDataType() == GDT_Byte &&
        equals_ignoring_case(band.GetMetadataItem("PIXELTYPE", "IMAGE_STRUCTURE"), "SIGNEDBYTE");
    if (meaning.is_signed_byte) info_out.numbers = "signed bytes, from PIXELTYPE=SIGNEDBYTE";
    Vertical vertical;
    if (numbers == RasterNumbers::heights) {
        TERRANE_TRY(vertical, read_vertical(raster, dataset, reading, info_out.notes));
    }
    if (reading.encoding == HeightEncoding::terrarium ||
        reading.encoding == HeightEncoding::mapbox) {
        TERRANE_TRY(read_encoding(raster, dataset, reading.encoding, meaning));
        info_out.numbers = reading.encoding == HeightEncoding::terrarium
                               ? "Terrarium encoding, as set"
                               : "Mapbox encoding, as set";
        if (vertical.unit == Vertical().unit) vertical.unit = "metre, from the encoding";
    }
    read_nodata(band, reading, meaning, info_out);
    note_ignored(raster, dataset, meaning, info_out.notes);
    if (numbers == RasterNumbers::plain) return meaning;
    info_out.height_unit = vertical.unit;
    if (reading.scale != 1.0)
        info_out.height_unit += "; times " + exact_text(reading.scale) + ", as set";
    info_out.vertical_axis = vertical.axis;
    const double metres = vertical.metres * (vertical.is_down ? -1.0 : 1.0) * reading.scale;
    meaning.scale *= metres;
    // Adding 0 turns -0 into 0.
    meaning.offset = meaning.offset * metres + 0.0;
    meaning.nodata_scale = meaning.is_encoded() ? metres : meaning.scale;
    meaning.nodata_offset = meaning.is_encoded() ? 0.0 : meaning.offset;
    return meaning;
}

std::string crop_text(const std::array<double, 4>& crop) {
    std::string text;
    for (const double side : crop) {
        if (!text.empty()) text += ',';
        text += exact_text(side);
    }
    return text;
}

std::vector<int> bands_by_colour(GDALDataset& dataset) {
    std::vector<int> found(3, 0);
    for (int band = 1; band <= dataset.GetRasterCount(); ++band) {
        const GDALColorInterp colour = dataset.GetRasterBand(band)->GetColorInterpretation();
        if (colour == GCI_RedBand) found[0] = band;
        if (colour == GCI_GreenBand) found[1] = band;
        if (colour == GCI_BlueBand) found[2] = band;
    }
    if (std::ranges::find(found, 0) == found.end()) return found;
    return dataset.GetRasterCount() >= 3 ? std::vector<int>{1, 2, 3} : std::vector<int>{1};
}

std::optional<std::array<double, 6>> geotransform_of(GDALDataset& dataset) {
    constexpr std::array<double, 6> kNone{0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
    std::array<double, 6> transform{};
    if (dataset.GetGeoTransform(transform.data()) != CE_None || transform == kNone)
        return std::nullopt;
    return transform;
}

}  // namespace terrane::internal
