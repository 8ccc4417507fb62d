// SPDX-License-Identifier: MIT
#include "scene/mesh_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <string_view>
#include <utility>

namespace terrane::tools {

/// Removes the first line of a text and returns it without its line end.
std::string_view take_line(std::string_view& text);

/// Removes the first word of a text and returns it; empty if there is none. Words are separated by spaces, tabs and
/// line ends.
std::string_view take_word(std::string_view& text);

/// Parses a word as a number, independent of the locale; none if it is not one. A leading + is allowed; "nan" and "inf"
/// are numbers.
std::optional<double> real_number(std::string_view word);
std::optional<std::int64_t> whole_number(std::string_view word);

namespace {

constexpr std::string_view kSpaces = " \t\r\n\v\f";

template <class Number>
std::optional<Number> number_of(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    Number value{};
    const auto [rest, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || rest != word.data() + word.size()) return std::nullopt;
    return value;
}

}  // namespace

std::string_view take_line(std::string_view& text) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
}

std::string_view take_word(std::string_view& text) {
    text.remove_prefix(std::min(text.find_first_not_of(kSpaces), text.size()));
    const std::string_view word = text.substr(0, text.find_first_of(kSpaces));
    text.remove_prefix(word.size());
    return word;
}

std::optional<double> real_number(std::string_view word) { return number_of<double>(word); }
std::optional<std::int64_t> whole_number(std::string_view word) {
    return number_of<std::int64_t>(word);
}

// PLY files. Source: G. Turk. The PLY Polygon File Format. Stanford, 1994; with the type names in use today.

namespace {

enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

struct PlyTypeName {
    std::string_view name;
    PlyType type;
};
constexpr PlyTypeName kPlyTypes[] = {
    {"char", PlyType::int8},      {"int8", PlyType::int8},       {"uchar", PlyType::uint8},
    {"uint8", PlyType::uint8},    {"short", PlyType::int16},     {"int16", PlyType::int16},
    {"ushort", PlyType::uint16},  {"uint16", PlyType::uint16},   {"int", PlyType::int32},
    {"int32", PlyType::int32},    {"uint", PlyType::uint32},     {"uint32", PlyType::uint32},
    {"float", PlyType::float32},  {"float32", PlyType::float32}, {"double", PlyType::float64},
    {"float64", PlyType::float64}};

std::optional<PlyType> type_of(std::string_view name) {
    const auto* const found = std::ranges::find(kPlyTypes, name, &PlyTypeName::name);
    if (found == std::end(kPlyTypes)) return std::nullopt;
    return found->type;
}

struct PlyProperty {
    std::string name;
    PlyType type = PlyType::float32;
    std::optional<PlyType> count;  // of a list
};

struct PlyElement {
    std::string name;
    std::int64_t count = 0;
    std::vector<PlyProperty> properties;
};

enum class PlyForm { ascii, little_endian, big_endian };

struct PlyHeader {
    PlyForm form = PlyForm::ascii;
    std::vector<PlyElement> elements;
};

tl::unexpected<Error> bad_ply(std::string message) { return fail(ErrorCode::bad_data, message); }

bool read_form(std::string_view line, PlyForm& form) {
    const std::string_view name = take_word(line);
    if (name == "ascii") form = PlyForm::ascii;
    if (name == "binary_little_endian") form = PlyForm::little_endian;
    if (name == "binary_big_endian") form = PlyForm::big_endian;
    return name == "ascii" || name.starts_with("binary_");
}

std::optional<PlyProperty> read_property(std::string_view line) {
    PlyProperty property;
    std::string_view type = take_word(line);
    if (type == "list") {
        property.count = type_of(take_word(line));
        if (!property.count) return std::nullopt;
        type = take_word(line);
    }
    const std::optional<PlyType> known = type_of(type);
    if (!known) return std::nullopt;
    property.type = *known;
    property.name = take_word(line);
    return property;
}

/// Removes the header from the bytes.
Result<PlyHeader> take_header(std::string_view& bytes) {
    if (take_line(bytes) != "ply") return bad_ply("its first line is not 'ply'");
    PlyHeader header;
    bool has_form = false;
    while (!bytes.empty()) {
        const std::string_view whole = take_line(bytes);
        std::string_view line = whole;
        const std::string_view keyword = take_word(line);
        bool is_good = true;
        if (keyword == "end_header") {
            if (!has_form) return bad_ply("its header has no format");
            return header;
        }
        if (keyword == "format") {
            is_good = has_form = read_form(line, header.form);
        } else if (keyword == "element") {
            PlyElement element;
            element.name = take_word(line);
            const std::optional<std::int64_t> count = whole_number(take_word(line));
            is_good = count && *count >= 0;
            element.count = count.value_or(0);
            header.elements.push_back(std::move(element));
        } else if (keyword == "property") {
            std::optional<PlyProperty> property = read_property(line);
            is_good = property && !header.elements.empty();
            if (is_good) header.elements.back().properties.push_back(*std::move(property));
        }
        if (!is_good) return bad_ply(fmt::format("line '{:.60}' of its header is wrong", whole));
    }
    return bad_ply("its header has no end");
}

/// Reads the numbers after the header in order.
class PlyNumbers {
public:
    PlyNumbers(std::string_view bytes, PlyForm form) : bytes_(bytes), form_(form) {}

    /// None at the end of the file, or if a word of a text file is not a number.
    std::optional<double> next(PlyType type) {
        if (form_ == PlyForm::ascii) return real_number(take_word(bytes_));
        switch (type) {
            case PlyType::int8:
                return binary<std::int8_t>();
            case PlyType::uint8:
                return binary<std::uint8_t>();
            case PlyType::int16:
                return binary<std::int16_t>();
            case PlyType::uint16:
                return binary<std::uint16_t>();
            case PlyType::int32:
                return binary<std::int32_t>();
            case PlyType::uint32:
                return binary<std::uint32_t>();
            case PlyType::float32:
                return binary<float>();
            case PlyType::float64:
                break;
        }
        return binary<double>();
    }

private:
    template <class Number>
    std::optional<double> binary() {
        std::array<char, sizeof(Number)> raw{};
        if (bytes_.size() < raw.size()) return std::nullopt;
        std::memcpy(raw.data(), bytes_.data(), raw.size());
        bytes_.remove_prefix(raw.size());
        constexpr bool is_little = std::endian::native == std::endian::little;
        if ((form_ == PlyForm::little_endian) != is_little) std::ranges::reverse(raw);
        return static_cast<double>(std::bit_cast<Number>(raw));
    }

    std::string_view bytes_;
    PlyForm form_;
};

/// Reads one element: its number of each scalar property by position, and its list of corners.
class PlyElements {
public:
    PlyElements(std::string_view bytes, const PlyHeader& header) : numbers_(bytes, header.form) {}

    Result<void> read(const PlyElement& element, TriangleMesh& mesh) {
        const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
        if ((is_vertex || is_face) && element.count > static_cast<std::int64_t>(kMostMeshParts)) {
            return bad_ply(fmt::format("it has {} elements '{}', more than {}", element.count,
                                       element.name, kMostMeshParts));
        }
        if (element.properties.empty()) return {};
        for (std::int64_t i = 0; i < element.count; ++i) {
            if (!read_one(element)) {
                return bad_ply(fmt::format("it ends early, or is wrong, in element {} of {} '{}'",
                                           i, element.count, element.name));
            }
            if (is_vertex) mesh.positions.push_back(point_);
            if (is_vertex) add_attributes(mesh);
            if (!is_face) continue;
            if (auto added = add_polygon(corners_, mesh); !added) return added;
        }
        return {};
    }

private:
    bool read_one(const PlyElement& element) {
        colour_count_ = normal_count_ = texture_count_ = 0;
        for (const PlyProperty& property : element.properties) {
            if (!property.count) {
                const std::optional<double> value = numbers_.next(property.type);
                if (!value) return false;
                if (property.name.size() == 1 && property.name[0] >= 'x' &&
                    property.name[0] <= 'z') {
                    point_[property.name[0] - 'x'] = *value;
                }
                read_colour(property, *value);
                read_attribute(property.name, *value);
            } else if (!read_list(property)) {
                return false;
            }
        }
        return true;
    }

    void add_attributes(TriangleMesh& mesh) const {
        if (colour_count_ == 3) mesh.colours.push_back(colour_);
        if (normal_count_ == 3) mesh.normals.push_back(normal_);
        if (texture_count_ == 2) mesh.texture_coordinates.push_back(texture_);
    }

    void read_attribute(std::string_view name, double value) {
        if (name == "nx" || name == "ny" || name == "nz") {
            normal_[name[1] - 'x'] = static_cast<float>(value);
            ++normal_count_;
        } else if ((name == "s" || name == "u" || name == "t" || name == "v") &&
                   texture_count_ < 2) {
            // the first of two pairs
            texture_[name == "s" || name == "u" ? 0 : 1] = static_cast<float>(value);
            ++texture_count_;
        }
    }

    void read_colour(const PlyProperty& property, double value) {
        constexpr std::array<std::string_view, 3> kNames = {"red", "green", "blue"};
        const auto* const name = std::ranges::find(kNames, property.name);
        if (name == kNames.end()) return;
        const double level = property.type == PlyType::uint8 ? value : 255.0 * value + 0.5;
        if (!(level >= 0.0 && level < 256.0)) return;
        colour_[static_cast<std::size_t>(name - kNames.begin())] = static_cast<std::uint8_t>(level);
        ++colour_count_;
    }

    bool read_list(const PlyProperty& property) {
        const std::optional<double> count = numbers_.next(*property.count);
        if (!count || !(*count >= 0.0 && *count <= static_cast<double>(kMostMeshParts))) {
            return false;
        }
        const bool is_corners =
            property.name == "vertex_indices" || property.name == "vertex_index";
        if (is_corners) corners_.clear();
        for (double i = 0.0; i < *count; i += 1.0) {
            const std::optional<double> value = numbers_.next(property.type);
            if (!value || !(std::abs(*value) <= 0x1p32)) return false;
            if (is_corners) corners_.push_back(static_cast<std::int64_t>(*value));
        }
        return true;
    }

    PlyNumbers numbers_;
    Eigen::Vector3d point_ = Eigen::Vector3d::Zero();
    std::array<std::uint8_t, 4> colour_{0, 0, 0, 255};
    Eigen::Vector3f normal_ = Eigen::Vector3f::Zero();
    Eigen::Vector2f texture_ = Eigen::Vector2f::Zero();
    int colour_count_ = 0, normal_count_ = 0, texture_count_ = 0;  // count of each
    std::vector<std::int64_t> corners_;
};

bool has_property(const PlyElement& element, std::string_view name, bool is_list) {
    return std::ranges::any_of(element.properties, [&](const PlyProperty& property) {
        return property.name == name && property.count.has_value() == is_list;
    });
}

Result<void> check_header(const PlyHeader& header) {
    bool has_vertices = false;
    for (const PlyElement& element : header.elements) {
        if (element.name == "vertex") {
            has_vertices = true;
            for (const char* axis : {"x", "y", "z"}) {
                if (has_property(element, axis, false)) continue;
                return bad_ply(fmt::format("its vertices have no property {}", axis));
            }
        }
        if (element.name != "face") continue;
        if (!has_vertices) return bad_ply("its faces come before its vertices");
        if (has_property(element, "vertex_indices", true) ||
            has_property(element, "vertex_index", true)) {
            continue;
        }
        return bad_ply("its faces have no list vertex_indices");
    }
    if (has_vertices) return {};
    return bad_ply("it has no vertices");
}

}  // namespace

Result<TriangleMesh> parse_ply(std::string_view bytes) {
    const Result<PlyHeader> header = take_header(bytes);
    if (!header) return tl::unexpected<Error>(header.error());
    if (auto ok = check_header(*header); !ok) return tl::unexpected<Error>(ok.error());
    TriangleMesh mesh;
    PlyElements elements(bytes, *header);
    for (const PlyElement& element : header->elements) {
        if (auto ok = elements.read(element, mesh); !ok) return tl::unexpected<Error>(ok.error());
    }
    const std::size_t count = mesh.positions.size();
    if (mesh.colours.size() != count) mesh.colours.clear();
    if (mesh.normals.size() != count) mesh.normals.clear();
    if (mesh.texture_coordinates.size() != count) mesh.texture_coordinates.clear();
    return mesh;
}

namespace {

tl::unexpected<Error> bad_line(std::size_t number, std::string_view what) {
    return fail(ErrorCode::bad_data, fmt::format("line {}: {}", number, what));
}

/// The point of "7", "7/1", "7//3" or "-1/..": counted from 0. Negative numbers count back from the last point.
std::optional<std::int64_t> corner_of(std::string_view word, std::size_t point_count) {
    const std::optional<std::int64_t> index = whole_number(word.substr(0, word.find('/')));
    if (!index || *index == 0) return std::nullopt;
    return *index > 0 ? *index - 1 : *index + static_cast<std::int64_t>(point_count);
}

/// Adds the colour after a position, if any.
void add_colour(std::string_view line, TriangleMesh& mesh) {
    std::array<std::uint8_t, 4> colour{0, 0, 0, 255};
    for (std::size_t i = 0; i < 3; ++i) {
        const std::optional<double> value = real_number(take_word(line));
        if (!value || !(*value >= 0.0 && *value <= 1.0)) return;
        colour[i] = static_cast<std::uint8_t>(255.0 * *value + 0.5);
    }
    mesh.colours.push_back(colour);
}

}  // namespace

Result<TriangleMesh> parse_obj(std::string_view text) {
    TriangleMesh mesh;
    std::vector<std::int64_t> corners;
    for (std::size_t number = 1; !text.empty(); ++number) {
        std::string_view line = take_line(text);
        const std::string_view keyword = take_word(line);
        if (keyword == "v") {
            Eigen::Vector3d point;
            for (int axis = 0; axis < 3; ++axis) {
                const std::optional<double> value = real_number(take_word(line));
                if (!value) return bad_line(number, "a point needs 3 numbers");
                point[axis] = *value;
            }
            if (mesh.positions.size() == kMostMeshParts) {
                return bad_line(number, fmt::format("more than {} points", kMostMeshParts));
            }
            mesh.positions.push_back(point);
            add_colour(line, mesh);
        } else if (keyword == "f") {
            corners.clear();
            for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
                const auto corner = corner_of(word, mesh.positions.size());
                if (!corner) {
                    return bad_line(number, fmt::format("'{:.40}' is no corner of a face", word));
                }
                corners.push_back(*corner);
            }
            if (auto added = add_polygon(corners, mesh); !added) {
                return bad_line(number, added.error().message);
            }
        }
    }
    if (mesh.colours.size() != mesh.positions.size()) mesh.colours.clear();
    return mesh;
}

namespace {

/// Indices from 0: point, texture coordinate, normal; -1 if a corner has none.
using ObjCorner = std::array<std::int64_t, 3>;

/// The corners of a line f. False if one refers to an attribute not defined before it.
bool take_corners(std::string_view line, const std::array<std::size_t, 3>& counts,
                  std::vector<ObjCorner>& corners_out) {
    corners_out.clear();
    for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
        ObjCorner corner{-1, -1, -1};
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t end = word.find('/');
            const std::string_view part = word.substr(0, end);
            if (!part.empty()) {
                const std::optional<std::int64_t> index = whole_number(part);
                if (!index || *index == 0) return false;
                const auto count = static_cast<std::int64_t>(counts[k]);
                corner[k] = *index > 0 ? *index - 1 : *index + count;
                if (corner[k] < 0 || corner[k] >= count) return false;
            }
            if (end == std::string_view::npos) break;
            word.remove_prefix(end + 1);
        }
        corners_out.push_back(corner);
    }
    return true;
}

/// The numbers of all lines with a keyword, `count` of each.
///
/// Fails: bad_data, naming the line, if one has fewer
Result<std::vector<std::array<float, 3>>> take_vectors(std::string_view text,
                                                       std::string_view wanted, std::size_t count) {
    std::vector<std::array<float, 3>> vectors;
    for (std::size_t number = 1; !text.empty(); ++number) {
        std::string_view line = take_line(text);
        if (take_word(line) != wanted) continue;
        std::array<float, 3> vector{};
        for (std::size_t k = 0; k < count; ++k) {
            const std::optional<double> value = real_number(take_word(line));
            if (!value) {
                return fail(ErrorCode::bad_data,
                            fmt::format("line {}: {} must have {} numbers", number, wanted, count));
            }
            vector[k] = static_cast<float>(*value);
        }
        vectors.push_back(vector);
    }
    return vectors;
}

}  // namespace

Result<TriangleMesh> parse_obj_with_attributes(std::string_view text) {
    // Checks everything except attributes, and yields the same fans of triangles.
    Result<TriangleMesh> plain = parse_obj(text);
    if (!plain) return plain;
    const auto texture = take_vectors(text, "vt", 2), normals = take_vectors(text, "vn", 3);
    if (!texture) return tl::unexpected<Error>(texture.error());
    if (!normals) return tl::unexpected<Error>(normals.error());
    TriangleMesh mesh;
    std::map<ObjCorner, std::uint32_t> numbers;
    std::vector<ObjCorner> used, corners;
    bool has_texture = true, has_normals = true;
    std::array<std::size_t, 3> so_far{};
    for (std::size_t number = 1; !text.empty(); ++number) {
        std::string_view line = take_line(text);
        const std::string_view keyword = take_word(line);
        so_far[0] += static_cast<std::size_t>(keyword == "v");
        so_far[1] += static_cast<std::size_t>(keyword == "vt");
        so_far[2] += static_cast<std::size_t>(keyword == "vn");
        if (keyword != "f") continue;
        if (!take_corners(line, so_far, corners)) {
            return fail(ErrorCode::bad_data,
                        fmt::format("line {}: '{:.40}' names a texture coordinate or normal that "
                                    "is not there",
                                    number, line));
        }
        std::vector<std::uint32_t> vertices;
        for (const ObjCorner& corner : corners) {
            has_texture = has_texture && corner[1] >= 0;
            has_normals = has_normals && corner[2] >= 0;
            const auto [at, is_new] =
                numbers.try_emplace(corner, static_cast<std::uint32_t>(used.size()));
            if (is_new) used.push_back(corner);
            vertices.push_back(at->second);
        }
        for (std::size_t i = 2; i < vertices.size(); ++i)
            mesh.triangles.push_back({vertices[0], vertices[i - 1], vertices[i]});
    }
    for (const ObjCorner& corner : used) {
        const auto point = static_cast<std::size_t>(corner[0]);
        mesh.positions.push_back(plain->positions[point]);
        if (!plain->colours.empty()) mesh.colours.push_back(plain->colours[point]);
        if (has_texture && !texture->empty()) {
            const auto& t = (*texture)[static_cast<std::size_t>(corner[1])];
            mesh.texture_coordinates.emplace_back(t[0], t[1]);
        }
        if (has_normals && !normals->empty()) {
            const auto& n = (*normals)[static_cast<std::size_t>(corner[2])];
            mesh.normals.emplace_back(n[0], n[1], n[2]);
        }
    }
    return mesh;
}

namespace {

constexpr std::uintmax_t kMostBytes = std::uintmax_t{1} << 30;

/// Makes corners refer to the first of equal points, and drops triangles that become degenerate.
void weld_points(TriangleMesh& mesh) {
    const auto less = [&](std::uint32_t a, std::uint32_t b) {
        const Eigen::Vector3d &p = mesh.positions[a], &q = mesh.positions[b];
        return std::lexicographical_compare(p.data(), p.data() + 3, q.data(), q.data() + 3);
    };
    std::vector<std::uint32_t> order(mesh.positions.size()), first(mesh.positions.size());
    std::iota(order.begin(), order.end(), 0u);
    // NaN has no order; the check of points refuses such a mesh later
    if (std::ranges::any_of(mesh.positions, [](const auto& p) { return p != p; })) return;
    std::ranges::stable_sort(order, less);
    for (std::size_t i = 0; i < order.size(); ++i) {
        const bool is_same = i > 0 && mesh.positions[order[i - 1]] == mesh.positions[order[i]];
        first[order[i]] = is_same ? first[order[i - 1]] : order[i];
    }
    for (auto& triangle : mesh.triangles) {
        for (std::uint32_t& corner : triangle) corner = first[corner];
    }
    std::erase_if(mesh.triangles,
                  [](const auto& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
}

Result<std::string> read_bytes(const std::string& path) {
    const auto cannot = [&](const std::string& why) {
        return fail(ErrorCode::io, fmt::format("cannot read mesh '{}': {}", path, why));
    };
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(path, error);
    if (!std::filesystem::is_regular_file(status)) {
        return cannot(error ? error.message() : "it is not a file");
    }
    if (const auto size = std::filesystem::file_size(path, error); error || size > kMostBytes) {
        return cannot(error ? error.message() : fmt::format("{} bytes, more than 2^30", size));
    }
    std::ifstream file(path, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    if (!file.good() && !file.eof()) return cannot("it cannot be opened");
    return bytes;
}

}  // namespace

Result<void> add_polygon(const std::vector<std::int64_t>& corners, TriangleMesh& mesh) {
    const auto wrong = [](std::string message) { return fail(ErrorCode::bad_data, message); };
    if (corners.size() < 3) {
        return wrong(fmt::format("a face has {} corners, fewer than 3", corners.size()));
    }
    const auto point_count = static_cast<std::int64_t>(mesh.positions.size());
    for (const std::int64_t corner : corners) {
        if (corner >= 0 && corner < point_count) continue;
        return wrong(fmt::format("a face names point {} of {}", corner, point_count));
    }
    if (corners.size() - 2 > kMostMeshParts - mesh.triangles.size()) {
        return wrong(fmt::format("it has more than {} triangles", kMostMeshParts));
    }
    for (std::size_t i = 2; i < corners.size(); ++i) {
        mesh.triangles.push_back({static_cast<std::uint32_t>(corners[0]),
                                  static_cast<std::uint32_t>(corners[i - 1]),
                                  static_cast<std::uint32_t>(corners[i])});
    }
    return {};
}

namespace {

/// @param parse Result<TriangleMesh>(std::string_view bytes, const std::string& ending)
template <class Parse>
Result<TriangleMesh> read_file(const std::string& path, const Parse& parse) {
    std::string ending = std::filesystem::path(path).extension().string();
    std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
    constexpr std::array<std::string_view, 5> kEndings = {".ply", ".obj", ".glb", ".gltf", ".stl"};
    if (std::ranges::find(kEndings, ending) == kEndings.end()) {
        return fail(ErrorCode::bad_data,
                    fmt::format("mesh '{}' must be a .ply, .obj, .glb, .gltf or .stl file", path));
    }
    const Result<std::string> bytes = read_bytes(path);
    if (!bytes) return tl::unexpected<Error>(bytes.error());
    Result<TriangleMesh> mesh = parse(*bytes, ending);
    if (!mesh) {
        return fail(mesh.error().code,
                    fmt::format("cannot read mesh '{}': {}", path, mesh.error().message));
    }
    if (!mesh->triangles.empty()) return mesh;
    return fail(ErrorCode::bad_data, fmt::format("mesh '{}' has no triangle", path));
}

}  // namespace

Result<TriangleMesh> read_mesh(const std::string& path) {
    return read_file(
        path, [](std::string_view bytes, const std::string& ending) -> Result<TriangleMesh> {
            Result<TriangleMesh> mesh = ending == ".ply" ? parse_ply(bytes)
                                        : ending == ".obj"
                                            ? parse_obj(bytes)
                                            : parse_with_assimp(bytes, ending.substr(1));
            if (!mesh) return mesh;
            mesh->normals.clear();
            mesh->texture_coordinates.clear();
            weld_points(*mesh);
            return mesh;
        });
}

Result<TriangleMesh> read_mesh_with_attributes(const std::string& path) {
    return read_file(path,
                     [](std::string_view bytes, const std::string& ending) -> Result<TriangleMesh> {
                         if (ending == ".ply") return parse_ply(bytes);
                         if (ending == ".obj") return parse_obj_with_attributes(bytes);
                         Result<TriangleMesh> mesh = parse_with_assimp(bytes, ending.substr(1));
                         if (mesh) weld_points(*mesh);
                         return mesh;
                     });
}

}  // namespace terrane::tools
