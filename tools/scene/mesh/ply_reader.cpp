// SPDX-License-Identifier: MIT
//
// PLY files, as "The PLY Polygon File Format" (G. Turk, Stanford, 1994) has them, with the names of types in use.
#include "scene/mesh/mesh_reader.h"
#include "scene/mesh/text_numbers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace terrane::tools {
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

/// The numbers after the header, one after the other.
class PlyNumbers {
public:
    PlyNumbers(std::string_view bytes, PlyForm form) : bytes_(bytes), form_(form) {}

    /// None at the end of the file, or where a word of a text is no number.
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
            // of two pairs the first one
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
    int colour_count_ = 0, normal_count_ = 0, texture_count_ = 0;  // numbers of each
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

}  // namespace terrane::tools
