// SPDX-License-Identifier: MIT
//
// Sources: G. Turk. The PLY polygon file format, 1994. Wavefront Technologies. Object files (.obj), 1992.
#include "scene/mesh_reading.h"

#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <string_view>

namespace terrane::tools {
namespace {

constexpr std::size_t kMostPoints = std::size_t{1} << 24;

tl::unexpected<Error> bad(const std::string& path, const std::string& why) {
    return fail(ErrorCode::bad_data, fmt::format("mesh '{}': {}", path, why));
}

std::string_view next_word(std::string_view& text) {
    const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
    while (!text.empty() && blank(text.front())) text.remove_prefix(1);
    std::size_t end = 0;
    while (end < text.size() && !blank(text[end])) ++end;
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(end);
    return word;
}

std::string_view next_line(std::string_view& text) {
    const std::size_t end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    return line;
}

template <class Number>
std::optional<Number> parse(std::string_view word) {
    Number value{};
    const auto [rest, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || rest != word.data() + word.size() || word.empty()) return {};
    return value;
}

/// Points by position, and triangles of polygons.
class Builder {
public:
    void add_point(const Eigen::Vector3d& p) {
        const std::array<double, 3> key{p.x() + 0.0, p.y() + 0.0, p.z() + 0.0};
        const auto [found, is_new] =
            numbers_.try_emplace(key, static_cast<std::uint32_t>(mesh.points.size()));
        if (is_new) mesh.points.push_back(p);
        of_file_.push_back(found->second);
    }
    std::size_t point_count() const { return of_file_.size(); }
    /// False for an index that is out of range, or fewer than three corners.
    bool add_polygon(const std::vector<std::int64_t>& corners) {
        if (corners.size() < 3) return false;
        for (const std::int64_t corner : corners) {
            if (corner < 0 || corner >= static_cast<std::int64_t>(of_file_.size())) return false;
        }
        const auto at = [&](std::size_t i) {
            return of_file_[static_cast<std::size_t>(corners[i])];
        };
        for (std::size_t i = 2; i < corners.size(); ++i) {
            const std::uint32_t a = at(0), b = at(i - 1), c = at(i);
            if (a != b && b != c && c != a) mesh.triangles.push_back({a, b, c});
        }
        return true;
    }
    FileMesh mesh;

private:
    std::map<std::array<double, 3>, std::uint32_t> numbers_;
    std::vector<std::uint32_t> of_file_;
};

Result<FileMesh> parse_obj(std::string_view text, const std::string& path) {
    Builder builder;
    std::vector<std::int64_t> corners;
    for (int number = 1; !text.empty(); ++number) {
        std::string_view line = next_line(text);
        const std::string_view kind = next_word(line);
        if (kind == "v") {
            Eigen::Vector3d p;
            for (int axis = 0; axis < 3; ++axis) {
                const auto value = parse<double>(next_word(line));
                if (!value) return bad(path, fmt::format("line {} is no vertex", number));
                p[axis] = *value;
            }
            if (builder.point_count() == kMostPoints) return bad(path, "more than 2^24 vertices");
            builder.add_point(p);
        } else if (kind == "f") {
            corners.clear();
            for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
                const auto index = parse<std::int64_t>(word.substr(0, word.find('/')));
                if (!index) return bad(path, fmt::format("line {} is no face", number));
                // negative indices count from the last vertex
                corners.push_back(*index > 0
                                      ? *index - 1
                                      : static_cast<std::int64_t>(builder.point_count()) + *index);
            }
            if (!builder.add_polygon(corners))
                return bad(path, fmt::format("line {} is no face of its vertices", number));
        }
    }
    return std::move(builder.mesh);
}

/// A property of a PLY element: the size of its values, and how they are read.
struct Property {
    std::string name;
    char type = 'd';      // c, C, s, S, i, I, f or d
    char count_type = 0;  // of a list
};

std::optional<char> ply_type(std::string_view name) {
    static const std::map<std::string_view, char> types{
        {"char", 'c'},  {"int8", 'c'},    {"uchar", 'C'},  {"uint8", 'C'},
        {"short", 's'}, {"int16", 's'},   {"ushort", 'S'}, {"uint16", 'S'},
        {"int", 'i'},   {"int32", 'i'},   {"uint", 'I'},   {"uint32", 'I'},
        {"float", 'f'}, {"float32", 'f'}, {"double", 'd'}, {"float64", 'd'}};
    const auto found = types.find(name);
    return found == types.end() ? std::nullopt : std::optional<char>(found->second);
}

/// The values of a PLY file after its header.
class PlyValues {
public:
    PlyValues(std::string_view body, bool is_text) : body_(body), is_text_(is_text) {}
    std::optional<double> next(char type) {
        if (is_text_) {
            for (;;) {
                std::string_view word = next_word(line_);
                if (!word.empty()) return parse<double>(word);
                if (body_.empty()) return std::nullopt;
                line_ = next_line(body_);
            }
        }
        switch (type) {
            case 'c':
                return raw<std::int8_t>();
            case 'C':
                return raw<std::uint8_t>();
            case 's':
                return raw<std::int16_t>();
            case 'S':
                return raw<std::uint16_t>();
            case 'i':
                return raw<std::int32_t>();
            case 'I':
                return raw<std::uint32_t>();
            case 'f':
                return raw<float>();
            default:
                return raw<double>();
        }
    }

private:
    template <class Value>
    std::optional<double> raw() {
        static_assert(std::endian::native == std::endian::little, "swap the bytes");
        if (body_.size() < sizeof(Value)) return std::nullopt;
        Value value;
        std::memcpy(&value, body_.data(), sizeof value);
        body_.remove_prefix(sizeof value);
        return static_cast<double>(value);
    }
    std::string_view body_, line_;
    bool is_text_;
};

struct Element {
    std::string name;
    std::size_t count = 0;
    std::vector<Property> properties;
};

Result<FileMesh> parse_ply(std::string_view text, const std::string& path) {
    std::vector<Element> elements;
    std::optional<bool> is_text;
    bool has_ended = false;
    if (next_word(text) != "ply" && !text.starts_with("ply")) return bad(path, "it is no PLY file");
    next_line(text);
    while (!text.empty() && !has_ended) {
        std::string_view line = next_line(text);
        const std::string_view kind = next_word(line);
        if (kind == "format") {
            const std::string_view format = next_word(line);
            if (format == "ascii") is_text = true;
            if (format == "binary_little_endian") is_text = false;
        } else if (kind == "element") {
            Element& made = elements.emplace_back();
            made.name = next_word(line);
            const auto count = parse<std::size_t>(next_word(line));
            if (!count || *count > kMostPoints)
                return bad(path, "the number of element " + made.name + " is not 0 to 2^24");
            made.count = *count;
        } else if (kind == "property" && !elements.empty()) {
            Property& made = elements.back().properties.emplace_back();
            std::string_view type = next_word(line);
            if (type == "list") {
                const auto count_type = ply_type(next_word(line));
                if (!count_type) return bad(path, "a list without a type");
                made.count_type = *count_type;
                type = next_word(line);
            }
            const auto known = ply_type(type);
            if (!known) return bad(path, "unknown type " + std::string(type.substr(0, 20)));
            made.type = *known;
            made.name = next_word(line);
        }
        has_ended = kind == "end_header";
    }
    if (!has_ended || !is_text)
        return bad(path, "no header of an ascii or binary_little_endian PLY file");
    Builder builder;
    PlyValues values(text, *is_text);
    std::vector<std::int64_t> corners;
    for (const Element& element : elements) {
        for (std::size_t i = 0; i < element.count; ++i) {
            const auto ends = [&] {
                return bad(path,
                           fmt::format("it ends at {} {} of {}", element.name, i, element.count));
            };
            Eigen::Vector3d p = Eigen::Vector3d::Zero();
            for (const Property& property : element.properties) {
                std::size_t count = 1;
                if (property.count_type != 0) {
                    const auto given = values.next(property.count_type);
                    if (!given) return ends();
                    if (!(*given >= 0.0 && *given <= 1e6))
                        return bad(path, "a list of wrong length");
                    count = static_cast<std::size_t>(*given);
                }
                corners.clear();
                for (std::size_t k = 0; k < count; ++k) {
                    const auto value = values.next(property.type);
                    if (!value) return ends();
                    if (property.name == "x") p.x() = *value;
                    if (property.name == "y") p.y() = *value;
                    if (property.name == "z") p.z() = *value;
                    const bool is_index = std::abs(*value) < 1e9;
                    corners.push_back(is_index ? static_cast<std::int64_t>(*value) : -1);
                }
                if (element.name == "face" && property.count_type != 0 &&
                    property.name.starts_with("vertex_ind") && !builder.add_polygon(corners)) {
                    return bad(path, fmt::format("face {} is no face of its vertices", i));
                }
            }
            if (element.name == "vertex") builder.add_point(p);
        }
    }
    return std::move(builder.mesh);
}

}  // namespace

Result<FileMesh> read_mesh(const std::string& path) {
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(path, error);
    if (!std::filesystem::is_regular_file(status)) {
        return fail(ErrorCode::io, fmt::format("cannot open mesh '{}': {}", path,
                                               error ? error.message() : "it is not a file"));
    }
    std::ifstream file(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    if (!file.good() && !file.eof())
        return fail(ErrorCode::io, fmt::format("cannot read mesh '{}'", path));
    const std::string ending = std::filesystem::path(path).extension().string();
    if (ending == ".obj" || ending == ".OBJ") return parse_obj(text, path);
    if (ending == ".ply" || ending == ".PLY") return parse_ply(text, path);
    return bad(path, "its ending must be .obj or .ply");
}

}  // namespace terrane::tools
