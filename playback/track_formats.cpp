// SPDX-License-Identifier: MIT
//
// Reads track files: CSV, TUM, GPX and IGC.
#include "track_formats.h"

#include <terrane/base/text.h>

#include <expat.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <iterator>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

namespace terrane::internal {

// Tracks as lines of numbers: CSV and TUM.

namespace {

std::vector<std::string_view> split(std::string_view line, std::string_view separators,
                                    bool skip_empty) {
    std::vector<std::string_view> fields;
    while (true) {
        const std::size_t end = line.find_first_of(separators);
        const std::string_view field = trimmed(line.substr(0, end));
        if (!skip_empty || !field.empty()) fields.push_back(field);
        if (end == std::string_view::npos) return fields;
        line.remove_prefix(end + 1);
    }
}

bool is_comment(std::string_view line) { return line.empty() || line.front() == '#'; }

// Indices of the columns; kNone if absent.
struct Columns {
    static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
    std::size_t time = kNone, x = kNone, y = kNone, z = kNone;
    std::size_t count = 0;
};

std::string lower_case(std::string_view text) {
    std::string lower(text);
    std::ranges::transform(lower, lower.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return lower;
}

std::size_t find_column(const std::vector<std::string>& names, std::string_view wanted,
                        std::string_view also) {
    const auto found = std::ranges::find_if(
        names, [&](const std::string& name) { return name == wanted || name == also; });
    return found == names.end() ? Columns::kNone : static_cast<std::size_t>(found - names.begin());
}

// The columns of a track's first line; notes those that are not read, if times or heights are missing.
Result<Columns> read_header(std::string_view line, long number, const std::string& path,
                            std::vector<std::string>& notes) {
    const std::vector<std::string_view> fields = split(line, ",", false);
    if (parse_number(fields.front())) {
        if (fields.size() == 4) return Columns{0, 1, 2, 3, 4};
        return refuse_line(
            path, number,
            "a track without a header has the four columns time_s,x_m,y_m,z_m, got " +
                number_text(fields.size()) + " columns");
    }
    std::vector<std::string> names;
    std::ranges::transform(fields, std::back_inserter(names), &lower_case);
    const Columns columns{
        find_column(names, "time_s", "time_s"), find_column(names, "x_m", "eye_x_m"),
        find_column(names, "y_m", "eye_y_m"), find_column(names, "z_m", "eye_z_m"), names.size()};
    if (columns.x == Columns::kNone || columns.y == Columns::kNone) {
        const bool has_latitudes = lower_case(line).find("lat") != std::string::npos;
        return refuse_line(
            path, number,
            "the header must name the columns x_m and y_m, separated by commas, got " +
                quote(line) +
                (has_latitudes ? "; latitudes are read from .gpx and .igc files" : ""));
    }
    std::string missing;
    if (columns.time == Columns::kNone) missing = "time_s";
    if (columns.z == Columns::kNone) missing += missing.empty() ? "z_m" : " or z_m";
    std::string unread;
    for (std::size_t i = 0; i < fields.size(); ++i) {
        if (i == columns.time || i == columns.x || i == columns.y || i == columns.z) continue;
        unread += (unread.empty() ? "" : ", ") + quote(fields[i]);
    }
    if (!missing.empty() && !unread.empty())
        notes.push_back("no column is named " + missing + "; not read: " + unread);
    return columns;
}

// Whether a field says that nothing was measured: it is empty or "nan".
bool is_no_value(std::string_view field) {
    return field.empty() || field == "nan" || field == "NaN" || field == "NAN";
}

bool has_any_height(const RawTrack& track) {
    return std::ranges::any_of(track.points, [](const RawPoint& p) { return p.has_height; });
}

/// Parses the whole text as a finite number.
std::optional<double> parse_plain(std::string_view text) {
    double value = 0.0;
    const char* end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data(), end, value);
    if (error != std::errc() || rest != end || !std::isfinite(value)) return std::nullopt;
    return value;
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
    if (const std::size_t slash = text.find('/'); slash != std::string_view::npos) {
        const std::optional<double> over = parse_plain(text.substr(0, slash));
        const std::optional<double> under = parse_plain(text.substr(slash + 1));
        if (!over || !under || !std::isfinite(*over / *under)) return std::nullopt;
        return *over / *under;
    }
    if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
    return parse_plain(text);
}

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view kBlanks = " \t\r\n";
    const std::size_t first = text.find_first_not_of(kBlanks);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::string quote(std::string_view value) {
    constexpr std::size_t kLongest = 40;
    std::string shown(value.substr(0, kLongest));
    for (char& c : shown) {
        if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) >= 0x7f) c = '?';
    }
    return "'" + shown + (value.size() > kLongest ? "...'" : "'");
}

tl::unexpected<Error> refuse_line(const std::string& path, long line, const std::string& what) {
    return fail(ErrorCode::bad_data, path + ": line " + number_text(line) + ": " + what);
}

void fill_unknown(const std::vector<double>& at, const std::vector<bool>& known,
                  std::vector<double>& values) {
    const std::size_t count = values.size();
    std::size_t before = count;  // index of the last known value; count: none yet
    for (std::size_t i = 0; i <= count; ++i) {
        if (i < count && !known[i]) continue;
        for (std::size_t j = before == count ? 0 : before + 1; j < i; ++j) {
            if (before == count || i == count) {
                values[j] = values[before == count ? i : before];
                continue;
            }
            const double span = at[i] - at[before];
            const double share =
                span > 0.0 ? std::clamp((at[j] - at[before]) / span, 0.0, 1.0)
                           : static_cast<double>(j - before) / static_cast<double>(i - before);
            values[j] = (1.0 - share) * values[before] + share * values[i];
        }
        before = i;
    }
}

Result<void> for_each_line(const std::string& text,
                           const std::function<Result<void>(std::string_view, long)>& take) {
    constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
    std::string_view rest = text;
    if (rest.substr(0, kByteOrderMark.size()) == kByteOrderMark) {
        rest.remove_prefix(kByteOrderMark.size());
    }
    for (long number = 1; !rest.empty(); ++number) {
        const std::size_t end = rest.find('\n');
        TERRANE_TRY(take(trimmed(rest.substr(0, end)), number));
        rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    }
    return {};
}

Result<RawTrack> read_csv(const std::string& text, const std::string& path) {
    RawTrack track;
    std::optional<Columns> columns;
    const auto take = [&](std::string_view line, long number) -> Result<void> {
        if (is_comment(line)) return {};
        if (!columns) {
            TERRANE_TRY(const Columns header, read_header(line, number, path, track.notes));
            columns = header;
            if (!parse_number(split(line, ",", false).front())) return {};
        }
        const std::vector<std::string_view> fields = split(line, ",", false);
        if (fields.size() != columns->count) {
            return refuse_line(path, number,
                               number_text(fields.size()) + " columns where the first line has " +
                                   number_text(columns->count));
        }
        RawPoint point;
        point.line = number;
        const std::array<std::pair<std::size_t, double*>, 4> wanted{{{columns->time, &point.time},
                                                                     {columns->x, &point.x},
                                                                     {columns->y, &point.y},
                                                                     {columns->z, &point.z}}};
        constexpr std::array<const char*, 4> kNames{"time_s", "x_m", "y_m", "z_m"};
        constexpr std::size_t kHeight = 3;
        for (std::size_t i = 0; i < wanted.size(); ++i) {
            if (wanted[i].first == Columns::kNone) continue;
            if (i == kHeight && is_no_value(fields[columns->z])) {
                point.has_height = false;
                continue;
            }
            const std::optional<double> value = parse_number(fields[wanted[i].first]);
            if (!value) {
                return refuse_line(path, number,
                                   std::string(kNames[i]) + " must be a finite number, got " +
                                       quote(fields[wanted[i].first]));
            }
            *wanted[i].second = *value;
        }
        track.points.push_back(point);
        return {};
    };
    TERRANE_TRY(for_each_line(text, take));
    track.has_times = columns && columns->time != Columns::kNone;
    track.has_heights = columns && columns->z != Columns::kNone && has_any_height(track);
    return track;
}

Result<RawTrack> read_tum(const std::string& text, const std::string& path) {
    RawTrack track;
    track.has_times = track.has_heights = track.has_orientations = true;
    const auto take = [&](std::string_view line, long number) -> Result<void> {
        if (is_comment(line)) return {};
        const std::vector<std::string_view> fields = split(line, " \t", true);
        std::array<double, 8> value{};
        if (fields.size() != value.size()) {
            return refuse_line(path, number,
                               "a pose is 8 numbers, time x y z qx qy qz qw, got " +
                                   number_text(fields.size()) + ": " + quote(line));
        }
        for (std::size_t i = 0; i < value.size(); ++i) {
            const std::optional<double> number_read = parse_number(fields[i]);
            if (!number_read) {
                return refuse_line(path, number,
                                   "a pose is 8 finite numbers, got " + quote(fields[i]));
            }
            value[i] = *number_read;
        }
        const double qx = value[4], qy = value[5], qz = value[6], qw = value[7];
        const double squared = qx * qx + qy * qy + qz * qz + qw * qw;
        if (!(std::abs(squared - 1.0) < 0.02)) {
            return refuse_line(path, number,
                               "the rotation must have length 1, got " + number_text(qx) + " " +
                                   number_text(qy) + " " + number_text(qz) + " " + number_text(qw));
        }
        // Columns of the rotation matrix: the camera's z is forward, its -y is up.
        const double s = 2.0 / squared;
        const Eigen::Vector3d forward(s * (qx * qz + qw * qy), s * (qy * qz - qw * qx),
                                      1.0 - s * (qx * qx + qy * qy));
        const Eigen::Vector3d down(s * (qx * qy - qw * qz), 1.0 - s * (qx * qx + qz * qz),
                                   s * (qy * qz + qw * qx));
        track.points.push_back(
            {number, value[0], value[1], value[2], value[3], forward, Eigen::Vector3d(-down)});
        return {};
    };
    TERRANE_TRY(for_each_line(text, take));
    return track;
}

// Tracks recorded by receivers: GPX and IGC.

namespace {

constexpr double kSecondsPerDay = 86'400.0;

// Days since 1970-01-01 of a Gregorian date. Source: H. Hinnant, "chrono-Compatible Low-Level Date
// Algorithms", days_from_civil().
std::int64_t days_from_civil(std::int64_t year, std::int64_t month, std::int64_t day) {
    year -= month <= 2 ? 1 : 0;
    const std::int64_t era = (year >= 0 ? year : year - 399) / 400;
    const std::int64_t year_of_era = year - era * 400;
    const std::int64_t day_of_year = (153 * (month + (month > 2 ? -3 : 9)) + 2) / 5 + day - 1;
    const std::int64_t day_of_era =
        year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
    return era * 146'097 + day_of_era - 719'468;
}

// Parses the whole text as unsigned digits.
std::optional<int> parse_digits(std::string_view text) {
    int value = 0;
    for (const char c : text) {
        if (c < '0' || c > '9') return std::nullopt;
        value = value * 10 + (c - '0');
    }
    return text.empty() ? std::nullopt : std::optional<int>(value);
}

// Parses a time such as "2008-05-04T12:52:47Z", with an optional fraction of a second and offset from UTC.
std::optional<double> parse_iso_time(std::string_view text) {
    if (text.size() < 19 || text[4] != '-' || text[7] != '-' || text[10] != 'T' ||
        text[13] != ':' || text[16] != ':') {
        return std::nullopt;
    }
    const auto year = parse_digits(text.substr(0, 4)), month = parse_digits(text.substr(5, 2)),
               day = parse_digits(text.substr(8, 2)), hour = parse_digits(text.substr(11, 2)),
               minute = parse_digits(text.substr(14, 2));
    std::string_view rest = text.substr(17);
    const std::size_t second_end = std::min(rest.find_first_of("Z+-"), rest.size());
    const auto second = parse_number(rest.substr(0, second_end));
    if (!year || !month || !day || !hour || !minute || !second || *month < 1 || *month > 12 ||
        *day < 1 || *day > 31 || *hour > 24 || *minute > 59 || *second < 0.0 || *second > 60.0) {
        return std::nullopt;
    }
    rest.remove_prefix(second_end);
    double offset = 0.0;
    if (!rest.empty() && rest != "Z") {
        if (rest.size() != 6 || rest[3] != ':') return std::nullopt;
        const auto hours = parse_digits(rest.substr(1, 2)),
                   minutes = parse_digits(rest.substr(4, 2));
        if (!hours || !minutes) return std::nullopt;
        offset = (*hours * 60.0 + *minutes) * (rest[0] == '+' ? 60.0 : -60.0);
    }
    return static_cast<double>(days_from_civil(*year, *month, *day)) * kSecondsPerDay +
           *hour * 3600.0 + *minute * 60.0 + *second - offset;
}

std::string_view without_prefix(std::string_view name) {
    const std::size_t colon = name.rfind(':');
    return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

// Elevations by which programs mark missing ones; no receiver has been there.
constexpr std::array<double, 3> kNoElevations{-9999.0, -32768.0, -99999.0};

// "3 of 60 points"
std::string share_of(std::size_t part, std::size_t whole, const char* things) {
    return number_text(part) + " of " + number_text(whole) + " " + things;
}

// State shared by the callbacks of expat.
struct GpxReading {
    XML_Parser parser = nullptr;
    std::string path;
    RawTrack track;
    std::optional<Error> error;
    bool in_point = false;
    int depth = 0;  // nesting depth inside the point
    std::string text;
    std::string fix;  // of the point: "none", "2d", "3d", "dgps", "pps"; "" if it does not say
    std::size_t without_fix = 0;
    std::string encoding;  // as the file declares it
    std::string root;      // name of the root element
    std::size_t route_points = 0, waypoints = 0;

    void refuse(const std::string& what) {
        if (error) return;
        const auto line = static_cast<long>(XML_GetCurrentLineNumber(parser));
        error = refuse_line(path, line, what).value();
        XML_StopParser(parser, XML_FALSE);
    }

    void begin_point(const XML_Char** attributes) {
        RawPoint point;
        point.line = static_cast<long>(XML_GetCurrentLineNumber(parser));
        std::optional<double> longitude, latitude;
        for (; *attributes != nullptr; attributes += 2) {
            const std::string_view name = attributes[0];
            if (name != "lat" && name != "lon") continue;
            const std::optional<double> value = parse_number(attributes[1]);
            if (!value) {
                return refuse(std::string(name) + " must be a number of degrees, got " +
                              quote(attributes[1]));
            }
            (name == "lat" ? latitude : longitude) = value;
        }
        if (!longitude || !latitude) return refuse("a trkpt needs the attributes lat and lon");
        point.x = *longitude;
        point.y = *latitude;
        point.has_time = point.has_height = false;
        track.points.push_back(point);
        in_point = true;
        depth = 0;
        fix.clear();
    }

    void end_point() {
        in_point = false;
        if (fix == "2d") track.points.back().has_height = false;
        if (fix != "none") return;
        track.points.pop_back();
        ++without_fix;
    }

    void end_child(std::string_view name) {
        const std::string_view value = trimmed(text);
        if (name == "fix") {
            fix = value;
        } else if (is_no_value(value)) {
            return;
        } else if (name == "ele") {
            const std::optional<double> height = parse_number(value);
            if (!height) return refuse("ele must be a number of metres, got " + quote(value));
            if (std::ranges::find(kNoElevations, *height) != kNoElevations.end()) return;
            track.points.back().z = *height;
            track.points.back().has_height = true;
        } else if (name == "time") {
            const std::optional<double> time = parse_iso_time(value);
            if (!time) {
                return refuse("time must be like 2008-05-04T12:52:47Z, got " + quote(value));
            }
            track.points.back().time = *time;
            track.points.back().has_time = true;
        }
    }
};

void on_declaration(void* data, const XML_Char*, const XML_Char* encoding, int) {
    if (encoding != nullptr) static_cast<GpxReading*>(data)->encoding = encoding;
}

constexpr const char* kEncodings =
    "UTF-8, UTF-16, US-ASCII, ISO-8859, windows-125x, KOI8, Macintosh and IBM code pages";

// Accepts an encoding that expat does not know, if it has one byte per character, and ASCII below 128. The numbers and
// names of a track are ASCII; other bytes, in texts that are ignored, are taken for a letter.
int on_unknown_encoding(void*, const XML_Char* name, XML_Encoding* encoding) {
    constexpr std::array<std::string_view, 9> kOneByte{"windows-125", "cp125", "iso-8859-",
                                                       "iso8859-",    "koi8-", "macintosh",
                                                       "x-mac-",      "ibm",   "cp8"};
    constexpr int kLetter = 0xC0;
    const std::string lower = lower_case(name);
    const auto begins = [&lower](std::string_view prefix) { return lower.starts_with(prefix); };
    if (std::ranges::none_of(kOneByte, begins)) return XML_STATUS_ERROR;
    for (int byte = 0; byte < 256; ++byte) encoding->map[byte] = byte < 128 ? byte : kLetter;
    encoding->data = nullptr;
    encoding->convert = nullptr;
    encoding->release = nullptr;
    return XML_STATUS_OK;
}

void on_start(void* data, const XML_Char* name, const XML_Char** attributes) {
    GpxReading& reading = *static_cast<GpxReading*>(data);
    if (reading.root.empty()) reading.root = without_prefix(name);
    if (without_prefix(name) == "rtept") ++reading.route_points;
    if (without_prefix(name) == "wpt") ++reading.waypoints;
    if (reading.in_point) {
        ++reading.depth;
        reading.text.clear();
    } else if (without_prefix(name) == "trkpt") {
        reading.begin_point(attributes);
    }
}

void on_end(void* data, const XML_Char* name) {
    GpxReading& reading = *static_cast<GpxReading*>(data);
    if (!reading.in_point) return;
    if (reading.depth == 0) {
        reading.end_point();
    } else if (--reading.depth == 0) {
        reading.end_child(without_prefix(name));
    }
}

void on_text(void* data, const XML_Char* text, int length) {
    GpxReading& reading = *static_cast<GpxReading*>(data);
    if (reading.in_point) reading.text.append(text, static_cast<std::size_t>(length));
}

// Parses 4135458N or 01257432E: degrees, minutes, thousandths of a minute, hemisphere.
std::optional<double> parse_igc_angle(std::string_view text, char positive, char negative) {
    const char hemisphere = text.back();
    const auto degrees = parse_digits(text.substr(0, text.size() - 6));
    const auto minutes = parse_digits(text.substr(text.size() - 6, 5));
    if (!degrees || !minutes || (hemisphere != positive && hemisphere != negative))
        return std::nullopt;
    const double angle = *degrees + *minutes / 60'000.0;
    return hemisphere == positive ? angle : -angle;
}

// Parses 00332 or -0012.
std::optional<double> parse_igc_altitude(std::string_view text) {
    const bool is_negative = text.front() == '-';
    const auto metres = parse_digits(text.substr(is_negative ? 1 : 0));
    if (!metres) return std::nullopt;
    return is_negative ? -*metres : *metres;
}

// What a file without track points has instead; "" if that is not known.
std::string describe_trackless(const GpxReading& reading) {
    if (reading.root != "gpx")
        return "its root element is " + quote(reading.root) + " and not 'gpx'";
    if (reading.route_points > 0) {
        return "it has a route of " + number_text(reading.route_points) +
               " points (rtept), and no track (trkpt)";
    }
    if (reading.waypoints == 0) return "it has no track (trkpt)";
    return "it has " + number_text(reading.waypoints) + " waypoints (wpt), and no track (trkpt)";
}

// What expat refused.
std::string describe_failure(const GpxReading& reading) {
    const XML_Error code = XML_GetErrorCode(reading.parser);
    if (code == XML_ERROR_UNKNOWN_ENCODING) {
        return "the encoding " + quote(reading.encoding) + " is not known; known are " + kEncodings;
    }
    if (code == XML_ERROR_INCORRECT_ENCODING)
        return "the file is not in the encoding " + quote(reading.encoding) + " that it declares";
    return std::string("no XML: ") + XML_ErrorString(code);
}

}  // namespace

Result<RawTrack> read_gpx(const std::string& text, const std::string& path) {
    const std::unique_ptr<XML_ParserStruct, void (*)(XML_Parser)> parser(XML_ParserCreate(nullptr),
                                                                         &XML_ParserFree);
    GpxReading reading;
    reading.parser = parser.get();
    reading.path = path;
    XML_SetUserData(parser.get(), &reading);
    XML_SetElementHandler(parser.get(), &on_start, &on_end);
    XML_SetCharacterDataHandler(parser.get(), &on_text);
    XML_SetXmlDeclHandler(parser.get(), &on_declaration);
    XML_SetUnknownEncodingHandler(parser.get(), &on_unknown_encoding, nullptr);

    // Parsed in pieces, because expat counts bytes in an int.
    constexpr std::size_t kPiece = std::size_t{1} << 24;
    for (std::size_t at = 0;; at += kPiece) {
        const std::size_t size = std::min(kPiece, text.size() - at);
        const bool is_last = at + size == text.size();
        const XML_Status status = XML_Parse(parser.get(), text.data() + at, static_cast<int>(size),
                                            is_last ? XML_TRUE : XML_FALSE);
        if (reading.error) return tl::unexpected(*reading.error);
        if (status != XML_STATUS_OK) {
            return refuse_line(path, static_cast<long>(XML_GetCurrentLineNumber(parser.get())),
                               describe_failure(reading));
        }
        if (is_last) break;
    }
    RawTrack track = std::move(reading.track);
    track.has_heights = has_any_height(track);
    track.has_times = std::ranges::any_of(track.points, &RawPoint::has_time);
    if (track.points.empty() && reading.without_fix == 0)
        track.notes.push_back(describe_trackless(reading));
    if (reading.without_fix > 0) {
        track.notes.push_back(
            share_of(reading.without_fix, track.points.size() + reading.without_fix, "points") +
            " are left out, because they have no fix");
    }
    return track;
}

namespace {

// The altitudes of an IGC file's fixes, metres.
struct IgcAltitudes {
    std::vector<double> times, gnss, pressure;
    std::vector<bool> is_3d;  // validity A: the GNSS altitude was measured
};

// Sets the heights of a track from the altitudes of its fixes. A GNSS altitude is measured if the fix is 3D and, in a
// file with other GNSS altitudes, not 0 at a pressure altitude far from 0. Others come from the pressure altitude,
// shifted by the difference of both in the measured fixes before and after, or else from these fixes themselves.
void set_igc_heights(const IgcAltitudes& fixes, RawTrack& track) {
    constexpr double kMostPressureError = 400.0;  // metres: of 970 to 1060 hPa at sea level
    const auto is_set = [](double altitude) { return altitude != 0.0; };
    const bool has_gnss = std::ranges::any_of(fixes.gnss, is_set);
    const bool has_pressure = std::ranges::any_of(fixes.pressure, is_set);
    const std::size_t count = fixes.times.size();
    std::vector<bool> measured(count), compared(count);
    std::vector<double> height = fixes.gnss, shift(count);
    for (std::size_t i = 0; i < count; ++i) {
        measured[i] = fixes.is_3d[i] && has_gnss &&
                      (is_set(fixes.gnss[i]) || std::abs(fixes.pressure[i]) < kMostPressureError);
        compared[i] = measured[i] && is_set(fixes.pressure[i]);
        shift[i] = fixes.gnss[i] - fixes.pressure[i];
    }
    const auto known = static_cast<std::size_t>(std::ranges::count(measured, true));
    const std::size_t missing = count - known;
    track.has_heights = known > 0 || has_gnss || has_pressure;
    if (!track.has_heights) {
        track.notes.emplace_back("no fix has an altitude");
    } else if (known == 0) {
        if (has_pressure) height = fixes.pressure;
        std::string note =
            "all fixes are 2D (validity V): heights are their GNSS altitudes all the same";
        if (has_pressure) note = "no fix has a GNSS altitude: heights are pressure altitudes";
        track.notes.push_back(std::move(note));
    } else if (missing > 0) {
        const bool can_compare = std::ranges::count(compared, true) > 0;
        if (can_compare) fill_unknown(fixes.times, compared, shift);
        std::size_t by_pressure = 0;
        for (std::size_t i = 0; i < count; ++i) {
            if (measured[i] || !can_compare || !is_set(fixes.pressure[i])) continue;
            height[i] = fixes.pressure[i] + shift[i];
            measured[i] = true;
            ++by_pressure;
        }
        fill_unknown(fixes.times, measured, height);
        track.notes.push_back(share_of(missing, count, "fixes") +
                              " have no GNSS altitude: " + number_text(by_pressure) +
                              " are filled from the pressure altitude, " +
                              number_text(missing - by_pressure) + " from the fixes around");
    }
    for (std::size_t i = 0; i < count; ++i) track.points[i].z = height[i];
}

}  // namespace

Result<RawTrack> read_igc(const std::string& text, const std::string& path) {
    RawTrack track;
    track.has_times = true;
    IgcAltitudes altitudes;
    std::size_t without_position = 0;
    double midnights = 0.0;
    const auto take = [&](std::string_view line, long number) -> Result<void> {
        if (line.empty() || line.front() != 'B') return {};
        const auto refuse = [&](const char* what) {
            return refuse_line(path, number, std::string(what) + " in the fix " + quote(line));
        };
        if (line.size() < 35) return refuse("fewer than 35 characters");
        RawPoint point;
        point.line = number;
        const auto hours = parse_digits(line.substr(1, 2)),
                   minutes = parse_digits(line.substr(3, 2)),
                   seconds = parse_digits(line.substr(5, 2));
        if (!hours || !minutes || !seconds || *hours > 23 || *minutes > 59 || *seconds > 59) {
            return refuse("no time of day");
        }
        const auto latitude = parse_igc_angle(line.substr(7, 8), 'N', 'S');
        const auto longitude = parse_igc_angle(line.substr(15, 9), 'E', 'W');
        if (!latitude || !longitude) return refuse("no latitude and longitude");
        const char validity = line[24];
        if (validity != 'A' && validity != 'V') return refuse("no validity A or V");
        const auto pressure = parse_igc_altitude(line.substr(25, 5));
        const auto gnss = parse_igc_altitude(line.substr(30, 5));
        if (!pressure || !gnss) return refuse("no altitudes");
        point.time = midnights + *hours * 3600.0 + *minutes * 60.0 + *seconds;
        if (!track.points.empty() && point.time < track.points.back().time - 0.5 * kSecondsPerDay) {
            midnights += kSecondsPerDay;  // fixes have no date: times wrap at midnight
            point.time += kSecondsPerDay;
        }
        point.x = *longitude;
        point.y = *latitude;
        if (validity == 'V' && *longitude == 0.0 && *latitude == 0.0) {
            ++without_position;  // before a receiver's first fix
            return {};
        }
        altitudes.times.push_back(point.time);
        altitudes.gnss.push_back(*gnss);
        altitudes.pressure.push_back(*pressure);
        altitudes.is_3d.push_back(validity == 'A');
        track.points.push_back(point);
        return {};
    };
    TERRANE_TRY(for_each_line(text, take));
    if (without_position > 0) {
        track.notes.push_back(
            share_of(without_position, track.points.size() + without_position, "fixes") +
            " are left out, because they have no position");
    }
    if (!track.points.empty()) set_igc_heights(altitudes, track);
    if (track.points.empty() && without_position == 0)
        track.notes.emplace_back("it has no fixes (B records)");
    return track;
}

}  // namespace terrane::internal
