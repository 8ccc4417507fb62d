// SPDX-License-Identifier: MIT
//
// Readers of PLY, OBJ and STL. Positions are double, because a float has steps of 0.5 m at a northing of 4.5e6 m;
// truncated files are refused.
#include "program/summary.h"
#include "scene/mesh_files.h"

#include <terrane/terrain/crease_normals.h>

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
#include <limits>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

namespace terrane::tools {
namespace {

constexpr std::string_view kSpaces = " \t\r\n\v\f";

/// Removes the first line of a text and returns it without its line end.
std::string_view read_line(std::string_view& text) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
}

}  // namespace

std::string_view trimmed(std::string_view text) {
    text.remove_prefix(std::min(text.find_first_not_of(kSpaces), text.size()));
    return text.substr(0, text.find_last_not_of(kSpaces) + 1);
}

std::string_view read_word(std::string_view& text) {
    text.remove_prefix(std::min(text.find_first_not_of(kSpaces), text.size()));
    const std::string_view word = text.substr(0, text.find_first_of(kSpaces));
    text.remove_prefix(word.size());
    return word;
}

namespace {

/// Parses a word as a number, independent of the locale; absent if the word is not a number. A leading + is allowed. As
/// a floating-point number, "nan" and "inf" are accepted.
template <class Number>
std::optional<Number> number_of(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    Number value{};
    const auto [rest, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || rest != word.data() + word.size()) return std::nullopt;
    return value;
}

tl::unexpected<Error> bad(std::string message) { return fail(ErrorCode::bad_data, message); }

/// Adds the triangles of split_polygon().
void add_triangles(std::span<const TriangleMesh::Triangle> triangles,
                   std::span<const std::int64_t> corners, TriangleMesh& mesh) {
    for (const auto& [a, b, c] : triangles) {
        mesh.triangles.push_back({static_cast<std::uint32_t>(corners[a]),
                                  static_cast<std::uint32_t>(corners[b]),
                                  static_cast<std::uint32_t>(corners[c])});
    }
}

// PLY files. Source: G. Turk. The PLY Polygon File Format. Stanford, 1994; with the type names in use today.

struct PlyType {
    std::string_view name, new_name;
    std::size_t size;                  // bytes in a binary file
    double (*value)(const char* raw);  // of bytes in the machine's order
};

template <class Number>
constexpr PlyType ply_type(std::string_view name, std::string_view new_name) {
    return {name, new_name, sizeof(Number), [](const char* raw) {
                Number value{};
                std::memcpy(&value, raw, sizeof value);
                return static_cast<double>(value);
            }};
}

constexpr PlyType kPlyTypes[] = {
    ply_type<std::int8_t>("char", "int8"),    ply_type<std::uint8_t>("uchar", "uint8"),
    ply_type<std::int16_t>("short", "int16"), ply_type<std::uint16_t>("ushort", "uint16"),
    ply_type<std::int32_t>("int", "int32"),   ply_type<std::uint32_t>("uint", "uint32"),
    ply_type<float>("float", "float32"),      ply_type<double>("double", "float64")};

/// Null if there is no such type.
const PlyType* type_of(std::string_view name) {
    const auto* const found = std::ranges::find_if(
        kPlyTypes, [&](const PlyType& type) { return type.name == name || type.new_name == name; });
    return found == std::end(kPlyTypes) ? nullptr : found;
}

struct PlyProperty {
    std::string name;
    const PlyType* type = nullptr;
    const PlyType* count = nullptr;  // of a list, else null
};

struct PlyElement {
    std::string name;
    std::int64_t count = 0;
    std::vector<PlyProperty> properties;
};

struct PlyHeader {
    std::optional<std::endian> byte_order;  // absent for a text file
    std::vector<PlyElement> elements;
};

bool read_form(std::string_view name, PlyHeader& header) {
    header.byte_order.reset();
    if (name == "binary_little_endian") header.byte_order = std::endian::little;
    if (name == "binary_big_endian") header.byte_order = std::endian::big;
    return name == "ascii" || header.byte_order;
}

bool read_property(std::string_view line, PlyHeader& header) {
    std::string_view type = read_word(line);
    const bool is_list = type == "list";
    PlyProperty property;
    if (is_list) {
        property.count = type_of(read_word(line));
        type = read_word(line);
    }
    property.type = type_of(type);
    property.name = read_word(line);
    if (property.type == nullptr || is_list != (property.count != nullptr)) return false;
    if (header.elements.empty()) return false;
    header.elements.back().properties.push_back(std::move(property));
    return true;
}

/// Parses the header and removes it from the bytes.
Result<PlyHeader> read_header(std::string_view& bytes) {
    if (read_line(bytes) != "ply") return bad("its first line is not 'ply'");
    PlyHeader header;
    bool has_form = false;
    while (!bytes.empty()) {
        const std::string_view whole = read_line(bytes);
        std::string_view line = whole;
        const std::string_view keyword = read_word(line);
        bool is_good = true;
        if (keyword == "end_header") {
            if (!has_form) return bad("its header has no format");
            return header;
        }
        if (keyword == "format") {
            is_good = has_form = read_form(read_word(line), header);
        } else if (keyword == "element") {
            const std::string_view name = read_word(line);
            const auto count = number_of<std::int64_t>(read_word(line));
            is_good = count && *count >= 0;
            header.elements.push_back({std::string(name), count.value_or(0), {}});
        } else if (keyword == "property") {
            is_good = read_property(line, header);
        }
        if (!is_good) return bad(fmt::format("line '{:.60}' of its header is wrong", whole));
    }
    return bad("its header has no end");
}

/// Reads the numbers after the header, one by one.
class PlyNumbers {
public:
    PlyNumbers(std::string_view bytes, std::optional<std::endian> order)
        : bytes_(bytes), order_(order) {}

    /// The next number; absent at the end of the file, or if the next word of a text file is not a number.
    std::optional<double> next(const PlyType& type) {
        if (!order_) return number_of<double>(read_word(bytes_));
        if (bytes_.size() < type.size) return std::nullopt;
        std::array<char, sizeof(double)> raw{};
        std::copy_n(bytes_.begin(), type.size, raw.begin());
        bytes_.remove_prefix(type.size);
        if (*order_ != std::endian::native) std::reverse(raw.begin(), raw.begin() + type.size);
        return type.value(raw.data());
    }

private:
    std::string_view bytes_;
    std::optional<std::endian> order_;
};

/// Reads the elements after the header into a mesh. Must be called for each element of the header, in order.
class PlyElements {
public:
    PlyElements(std::string_view bytes, const PlyHeader& header)
        : numbers_(bytes, header.byte_order) {}

    Result<void> read(const PlyElement& element, FileMesh& mesh) {
        const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
        if (element.name == "edge") mesh.left_out.lines += static_cast<std::size_t>(element.count);
        if ((is_vertex || is_face) && element.count > static_cast<std::int64_t>(kMostMeshParts)) {
            return bad(fmt::format("it has {} elements '{}', more than {}", element.count,
                                   element.name, kMostMeshParts));
        }
        if (element.properties.empty()) return {};
        for (std::int64_t i = 0; i < element.count; ++i) {
            if (!read_one(element)) {
                return bad(fmt::format("it ends early, or is wrong, in element {} of {} '{}'", i,
                                       element.count, element.name));
            }
            if (is_vertex) mesh.positions.push_back(point_);
            if (is_vertex) add_attributes(mesh);
            if (!is_face) continue;
            TERRANE_TRY(split_polygon(corners_, mesh, triangles_));
            add_triangles(triangles_, corners_, mesh);
        }
        return {};
    }

private:
    bool read_one(const PlyElement& element) {
        colour_count_ = normal_count_ = texture_count_ = 0;
        for (const PlyProperty& property : element.properties) {
            if (property.count == nullptr) {
                const std::optional<double> value = numbers_.next(*property.type);
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
            // if a vertex has both s, t and u, v, the first pair is used
            texture_[name == "s" || name == "u" ? 0 : 1] = static_cast<float>(value);
            ++texture_count_;
        }
    }

    void read_colour(const PlyProperty& property, double value) {
        constexpr std::array<std::string_view, 3> kNames = {"red", "green", "blue"};
        const auto* const name = std::ranges::find(kNames, property.name);
        if (name == kNames.end()) return;
        const double level = property.type->name == "uchar" ? value : 255.0 * value + 0.5;
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
            const std::optional<double> value = numbers_.next(*property.type);
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
    int colour_count_ = 0, normal_count_ = 0, texture_count_ = 0;  // of the element
    std::vector<std::int64_t> corners_;
    std::vector<TriangleMesh::Triangle> triangles_;  // of the face, indices of corners_
};

bool has_property(const PlyElement& element, std::string_view name, bool is_list) {
    return std::ranges::any_of(element.properties, [&](const PlyProperty& property) {
        return property.name == name && (property.count != nullptr) == is_list;
    });
}

Result<void> check_header(const PlyHeader& header) {
    bool has_vertices = false;
    for (const PlyElement& element : header.elements) {
        if (element.name == "vertex") {
            has_vertices = true;
            for (const char* axis : {"x", "y", "z"}) {
                if (has_property(element, axis, false)) continue;
                return bad(fmt::format("its vertices have no property {}", axis));
            }
        }
        if (element.name != "face") continue;
        if (!has_vertices) return bad("its faces come before its vertices");
        if (has_property(element, "vertex_indices", true) ||
            has_property(element, "vertex_index", true)) {
            continue;
        }
        return bad("its faces have no list vertex_indices");
    }
    if (has_vertices) return {};
    return bad("it has no vertices");
}

}  // namespace

Result<FileMesh> parse_ply(std::string_view bytes) {
    TERRANE_TRY(const PlyHeader header, read_header(bytes));
    TERRANE_TRY(check_header(header));
    FileMesh mesh;
    PlyElements elements(bytes, header);
    for (const PlyElement& element : header.elements) {
        TERRANE_TRY(elements.read(element, mesh));
    }
    const std::size_t count = mesh.positions.size();
    if (mesh.colours.size() != count) mesh.colours.clear();
    if (mesh.normals.size() != count) mesh.normals.clear();
    if (mesh.texture_coordinates.size() != count) mesh.texture_coordinates.clear();
    return mesh;
}

namespace {

/// The index, from 0, that a word such as "7" or "-1" denotes. Positive numbers count from the first of `count` items,
/// negative ones backwards from the last.
std::optional<std::int64_t> index_of(std::string_view word, std::size_t count) {
    const auto index = number_of<std::int64_t>(word);
    if (!index || *index == 0) return std::nullopt;
    return *index > 0 ? *index - 1 : *index + static_cast<std::int64_t>(count);
}

/// Removes the first `count` numbers from a line and returns them; absent if the line has fewer.
std::optional<Eigen::Vector3d> take_vector(std::string_view& line, int count) {
    Eigen::Vector3d vector = Eigen::Vector3d::Zero();
    for (int i = 0; i < count; ++i) {
        const std::optional<double> value = number_of<double>(read_word(line));
        if (!value) return std::nullopt;
        vector[i] = *value;
    }
    return vector;
}

/// Reads the lines of an OBJ file. Messages lack the line's number.
class ObjLines {
public:
    /// @param folder of the material files; absent: materials are not read
    ObjLines(bool has_attributes, std::optional<std::string> folder)
        : has_attributes_(has_attributes), folder_(std::move(folder)) {}

    Result<void> read(std::string_view line) {
        const std::string_view keyword = read_word(line);
        if (keyword == "v") return add_point(line);
        if (keyword == "f") return add_face(line);
        constexpr std::array<std::string_view, 5> kOthers = {"p", "l", "curv", "curv2", "surf"};
        if (std::ranges::find(kOthers, keyword) != kOthers.end()) ++mesh_.left_out.lines;
        if (folder_ && keyword == "mtllib") add_library(line);
        if (folder_ && keyword == "usemtl") return use_material(line);
        if (!has_attributes_ || (keyword != "vt" && keyword != "vn")) return {};
        const int count = keyword == "vt" ? 2 : 3;
        const std::optional<Eigen::Vector3d> vector = take_vector(line, count);
        if (!vector) return bad(fmt::format("{} must have {} numbers", keyword, count));
        if (keyword == "vt") texture_.emplace_back(vector->head<2>().cast<float>());
        if (keyword == "vn") normals_.emplace_back(vector->cast<float>());
        return {};
    }

    FileMesh take() {
        if (mesh_.colours.size() != mesh_.positions.size()) mesh_.colours.clear();
        return has_attributes_ ? split() : std::move(mesh_);
    }

private:
    /// The indices, from 0, of a corner's point, texture coordinate, normal and material; -1 for an attribute that it
    /// lacks.
    using Corner = std::array<std::int64_t, 4>;

    /// Reads a material file; its name may contain spaces. Of materials with the same name the first one counts.
    void add_library(std::string_view line) {
        library_.merge(read_mtl(*folder_, std::string(trimmed(line)), mesh_.left_out));
    }

    Result<void> use_material(std::string_view line) {
        const auto [at, is_new] =
            material_of_name_.try_emplace(std::string(trimmed(line)), names_.size());
        if (is_new) names_.push_back(at->first);
        if (names_.size() > std::numeric_limits<std::uint16_t>::max())
            return bad("it has more than 65535 materials");
        material_ = static_cast<std::int64_t>(at->second);
        return {};
    }

    Result<void> add_point(std::string_view line) {
        const std::optional<Eigen::Vector3d> point = take_vector(line, 3);
        if (!point) return bad("a point needs 3 numbers");
        if (mesh_.positions.size() == kMostMeshParts) {
            return bad(fmt::format("more than {} points", kMostMeshParts));
        }
        mesh_.positions.push_back(*point);
        const std::optional<Eigen::Vector3d> colour = take_vector(line, 3);
        if (!colour || !((colour->array() >= 0.0) && (colour->array() <= 1.0)).all()) return {};
        const auto level = [&](int i) {
            return static_cast<std::uint8_t>(255.0 * (*colour)[i] + 0.5);
        };
        mesh_.colours.push_back({level(0), level(1), level(2), 255});
        return {};
    }

    Result<void> add_face(std::string_view line) {
        points_.clear();
        vertices_.clear();
        bool has_all = true;
        std::string_view rest = line;
        for (std::string_view word = read_word(rest); !word.empty(); word = read_word(rest)) {
            const auto point = index_of(word.substr(0, word.find('/')), mesh_.positions.size());
            if (!point) return bad(fmt::format("'{:.40}' is no corner of a face", word));
            points_.push_back(*point);
            if (has_attributes_ && has_all) has_all = add_vertex(word, *point);
        }
        TERRANE_TRY(split_polygon(points_, mesh_, triangles_));
        if (!has_all) {
            return bad(fmt::format(
                "'{:.40}' names a texture coordinate or normal that is not there", line));
        }
        // without attributes too: split_polygon() counts them
        add_triangles(triangles_, points_, mesh_);
        if (!has_attributes_) return {};
        for (const auto& [a, b, c] : triangles_)
            split_.triangles.push_back({vertices_[a], vertices_[b], vertices_[c]});
        return {};
    }

    /// Adds the vertex of a corner such as "7/1/3" or "7//3". False if no earlier line defines one of its attributes.
    bool add_vertex(std::string_view word, std::int64_t point) {
        Corner corner{point, -1, -1, material_};
        const std::array<std::size_t, 3> counts{0, texture_.size(), normals_.size()};
        for (std::size_t k = 1; k < 3 && word.find('/') != std::string_view::npos; ++k) {
            word.remove_prefix(word.find('/') + 1);
            const std::string_view part = word.substr(0, word.find('/'));
            if (part.empty()) continue;
            const std::optional<std::int64_t> index = index_of(part, counts[k]);
            if (!index || *index < 0 || *index >= static_cast<std::int64_t>(counts[k]))
                return false;
            corner[k] = *index;
        }
        const auto [at, is_new] =
            numbers_.try_emplace(corner, static_cast<std::uint32_t>(corners_.size()));
        if (is_new) corners_.push_back(corner);
        vertices_.push_back(at->second);
        return true;
    }

    /// The mesh with one vertex for each combination of position and attributes.
    FileMesh split() {
        split_.left_out = mesh_.left_out;
        const bool has_texture = std::ranges::none_of(corners_, [](auto& c) { return c[1] < 0; });
        const bool has_normals = std::ranges::none_of(corners_, [](auto& c) { return c[2] < 0; });
        if (names_.size() > 1) find_materials();
        const bool has_materials = !split_.surfaces.empty();
        const bool has_textures = std::ranges::any_of(split_.surfaces, [](const MeshMaterial& m) {
            return m.colour_texture.image || m.normal_texture.image;
        });
        for (const Corner& corner : corners_) {
            const auto [point, texture, normal, material] = corner;
            const auto at = [](const auto& values, std::int64_t i) {
                return values[static_cast<std::size_t>(i)];
            };
            split_.positions.push_back(at(mesh_.positions, point));
            if (has_materials) {
                split_.materials.push_back(static_cast<std::uint16_t>(material));
                add_colour(point, at(split_.surfaces, material).colour);
            } else if (!mesh_.colours.empty()) {
                split_.colours.push_back(at(mesh_.colours, point));
            }
            if (has_texture) {
                split_.texture_coordinates.push_back(at(texture_, texture));
            } else if (has_textures) {
                split_.texture_coordinates.push_back(texture < 0 ? Eigen::Vector2f(0.0f, 0.0f)
                                                                 : at(texture_, texture));
            }
            if (has_normals) split_.normals.push_back(at(normals_, normal));
        }
        return std::move(split_);
    }

    /// The materials that faces use, in the order of `names_`.
    void find_materials() {
        for (const std::string& name : names_) {
            const auto found = library_.find(name);
            split_.surfaces.push_back(found == library_.end() ? MeshMaterial() : found->second);
        }
    }

    /// Adds the colour of a vertex: its own one times that of its material.
    void add_colour(std::int64_t point, std::array<std::uint8_t, 3> colour) {
        std::array<std::uint8_t, 4> made = {colour[0], colour[1], colour[2], 255};
        if (!mesh_.colours.empty()) {
            const auto& own = mesh_.colours[static_cast<std::size_t>(point)];
            for (std::size_t k = 0; k < 3; ++k)
                made[k] = static_cast<std::uint8_t>((made[k] * own[k] + 127) / 255);
        }
        split_.colours.push_back(made);
    }

    bool has_attributes_;
    std::optional<std::string> folder_;
    FileMesh mesh_;   // without attributes
    FileMesh split_;  // with attributes
    std::vector<Eigen::Vector2f> texture_;
    std::vector<Eigen::Vector3f> normals_;
    std::map<Corner, std::uint32_t> numbers_;  // index of the vertex of `split_` for a corner
    std::vector<Corner> corners_;              // [vertices of split_]
    std::vector<std::int64_t> points_;         // of the current face
    std::vector<std::uint32_t> vertices_;
    std::vector<TriangleMesh::Triangle> triangles_;  // of the current face, indices of its corners
    std::map<std::string, MeshMaterial> library_;
    std::vector<std::string> names_ = {""};  // of materials; the first one is that of faces without
    std::map<std::string, std::size_t> material_of_name_;
    std::int64_t material_ = 0;  // of the current face
};

Result<FileMesh> read_obj(std::string_view text, bool has_attributes,
                          std::optional<std::string> folder = {}) {
    ObjLines lines(has_attributes, std::move(folder));
    std::string joined;
    for (std::size_t number = 1, count = 1; !text.empty(); number += count, count = 1) {
        std::string_view line = read_line(text);
        // a comment such as "# C:\models\" does not go on
        if (line.ends_with('\\') && !line.starts_with('#')) {
            joined = line;
            for (; joined.ends_with('\\') && !text.empty(); ++count) {
                joined.back() = ' ';
                joined += read_line(text);
            }
            line = joined;
        }
        if (auto ok = lines.read(line); !ok) {
            return bad(fmt::format("line {}: {}", number, ok.error().message));
        }
    }
    return lines.take();
}

}  // namespace

Result<FileMesh> parse_obj(std::string_view text) { return read_obj(text, false); }

Result<FileMesh> parse_obj_with_attributes(std::string_view text) { return read_obj(text, true); }

Result<FileMesh> parse_obj_with_materials(std::string_view text, const std::string& folder) {
    return read_obj(text, true, folder);
}

namespace {

// STL files. Source: M. Burns. Automated fabrication. 1993, section 6.5.

constexpr std::size_t kStlHeader = 80, kStlTriangle = 50;  // bytes

/// A little-endian number of 4 bytes.
template <class Number>
Number stl_number(const char* raw) {
    std::array<char, sizeof(Number)> bytes{};
    std::copy_n(raw, bytes.size(), bytes.begin());
    if (std::endian::native == std::endian::big) std::ranges::reverse(bytes);
    return std::bit_cast<Number>(bytes);
}

Result<void> add_stl_triangle(const std::array<Eigen::Vector3d, 3>& corners, FileMesh& mesh) {
    if (mesh.positions.size() + 3 > kMostMeshParts) {
        return bad(fmt::format("it has more than {} points", kMostMeshParts));
    }
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), corners.begin(), corners.end());
    mesh.triangles.push_back({first, first + 1, first + 2});
    return {};
}

/// Whether a word is the wanted one, in any case.
bool is_word(std::string_view word, std::string_view wanted) {
    return std::ranges::equal(word, wanted, {}, [](unsigned char c) { return std::tolower(c); });
}

/// Removes words from a text; false if one is not the wanted one.
bool take_words(std::string_view& text, std::initializer_list<std::string_view> words) {
    return std::ranges::all_of(
        words, [&](std::string_view wanted) { return is_word(read_word(text), wanted); });
}

Result<FileMesh> parse_stl_text(std::string_view text) {
    FileMesh mesh;
    bool is_open = false;
    for (;;) {
        const std::string_view word = read_word(text);
        if (word.empty() && !is_open) return mesh;
        if (is_word(word, is_open ? "endsolid" : "solid")) {
            read_line(text);  // the name
            is_open = !is_open;
            continue;
        }
        std::array<Eigen::Vector3d, 3> corners;
        bool is_good = is_open && is_word(word, "facet") && take_words(text, {"normal"});
        for (int i = 0; i < 3; ++i) read_word(text);
        is_good = is_good && take_words(text, {"outer", "loop"});
        for (Eigen::Vector3d& corner : corners) {
            is_good = is_good && take_words(text, {"vertex"});
            const std::optional<Eigen::Vector3d> point = take_vector(text, 3);
            is_good = is_good && point;
            if (is_good) corner = *point;
        }
        if (!is_good || !take_words(text, {"endloop", "endfacet"})) {
            return bad(fmt::format("it ends early, or is wrong, in facet {}, counted from 0",
                                   mesh.triangles.size()));
        }
        TERRANE_TRY(add_stl_triangle(corners, mesh));
    }
}

}  // namespace

Result<FileMesh> parse_stl(std::string_view bytes) {
    // many binary files begin with "solid" as well: only their size tells them from a text
    const bool has_count = bytes.size() >= kStlHeader + 4;
    const std::uint64_t count =
        has_count ? stl_number<std::uint32_t>(bytes.data() + kStlHeader) : 0;
    const std::uint64_t size = kStlHeader + 4 + kStlTriangle * count;
    if (!has_count || size != bytes.size()) {
        std::string_view text = bytes;
        if (take_words(text, {"solid"}) && bytes.find('\0') == bytes.npos) {
            TERRANE_TRY(FileMesh mesh, parse_stl_text(bytes));
            join_vertices(mesh);
            return mesh;
        }
        if (!has_count) return bad("it is no STL file, or ends early");
        return bad(fmt::format("it has {} bytes; a binary STL file of {} triangles has {}",
                               bytes.size(), count, size));
    }
    FileMesh mesh;
    for (std::uint64_t i = 0; i < count; ++i) {
        const char* raw =
            bytes.data() + kStlHeader + 4 + kStlTriangle * i + 12;  // after the normal
        std::array<Eigen::Vector3d, 3> corners;
        for (Eigen::Vector3d& corner : corners) {
            for (int axis = 0; axis < 3; ++axis, raw += 4)
                corner[axis] = double{stl_number<float>(raw)};
        }
        TERRANE_TRY(add_stl_triangle(corners, mesh));
    }
    join_vertices(mesh);
    return mesh;
}

namespace {

constexpr std::uintmax_t kMostBytes = std::uintmax_t{1} << 30;

void drop_flat_triangles(FileMesh& mesh) {
    const std::vector<std::uint32_t> first = first_at_position(mesh);
    mesh.left_out.flat_triangles += std::erase_if(mesh.triangles, [&](const auto& t) {
        return first[t[0]] == first[t[1]] || first[t[1]] == first[t[2]] ||
               first[t[2]] == first[t[0]];
    });
}

void print_losses(const std::string& path, const MeshLosses& left_out) {
    std::vector<std::string> parts;
    const auto add = [&](std::size_t count, std::string_view thing, std::string_view fate) {
        if (count > 0)
            parts.push_back(fmt::format("{} {}{} {}", count, thing, count == 1 ? "" : "s", fate));
    };
    add(left_out.flat_triangles, "triangle", "without area dropped");
    add(left_out.crossing_faces, "self-crossing face", "split into triangles that overlap");
    add(left_out.lines, "element", "left out: points, lines or curves");
    add(left_out.skins, "skin", "ignored: joints do not bend the mesh");
    add(left_out.blended, "material", "cut where its opacity is half, instead of blended");
    for (const std::string& texture : left_out.textures)
        parts.push_back(texture + ": drawn in plain colour");
    if (!parts.empty()) print_note(fmt::format("mesh '{}': {}", path, fmt::join(parts, "; ")));
}

Result<FileMesh> parse_file(const std::string& path, bool has_attributes, FileMaterials materials) {
    const std::filesystem::path name(path);
    std::string ending = name.extension().string();
    std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
    constexpr std::array<std::string_view, 5> kEndings = {".ply", ".obj", ".glb", ".gltf", ".stl"};
    if (std::ranges::find(kEndings, ending) == kEndings.end()) {
        return bad("it must be a .ply, .obj, .glb, .gltf or .stl file");
    }
    TERRANE_TRY(const std::string bytes, read_whole_file(path));
    if (ending == ".ply") return parse_ply(bytes);
    const std::string folder = name.parent_path().string();
    if (ending == ".obj" && materials == FileMaterials::with)
        return parse_obj_with_materials(bytes, folder);
    if (ending == ".obj") return read_obj(bytes, has_attributes);
    if (ending == ".stl") return parse_stl(bytes);
    return parse_gltf(bytes, folder, materials);
}

Result<FileMesh> read_file(const std::string& path, bool has_attributes,
                           FileMaterials materials = FileMaterials::without) {
    Result<FileMesh> mesh = parse_file(path, has_attributes, materials);
    if (!mesh) {
        return fail(mesh.error().code,
                    fmt::format("cannot read mesh '{}': {}", path, mesh.error().message));
    }
    drop_flat_triangles(*mesh);
    if (mesh->triangles.empty()) return bad(fmt::format("mesh '{}' has no triangle", path));
    print_losses(path, mesh->left_out);
    if (!has_attributes) join_vertices(*mesh);
    return mesh;
}

bool has_texture(const MeshMaterial& material) {
    return material.colour_texture.image || material.normal_texture.image ||
           material.roughness_metal_texture.image;
}

/// Whether a material is drawn by the colours of the vertices alone.
bool is_plain(const MeshMaterial& material) {
    const auto& [red, green, blue] = material.emission;
    return !has_texture(material) && !material.alpha_cutoff && red + green + blue == 0.0f;
}

/// Joins plain materials, which differ only in the colours of their vertices, and drops what then has no use.
void join_materials(FileMesh& mesh) {
    std::vector<std::uint16_t> joined;  // [surfaces] new index
    std::vector<MeshMaterial> kept;
    std::array<std::optional<std::uint16_t>, 2> plain;  // one-sided, two-sided
    for (const MeshMaterial& material : mesh.surfaces) {
        std::optional<std::uint16_t>& same = plain[material.is_two_sided ? 1 : 0];
        if (!is_plain(material) || !same) {
            const auto index = static_cast<std::uint16_t>(kept.size());
            if (is_plain(material)) same = index;
            joined.push_back(index);
            kept.push_back(material);
        } else {
            joined.push_back(*same);
        }
    }
    for (std::uint16_t& material : mesh.materials) material = joined[material];
    mesh.surfaces = std::move(kept);
    if (std::ranges::none_of(mesh.surfaces, has_texture)) mesh.texture_coordinates.clear();
    const bool is_default = std::ranges::all_of(mesh.surfaces, [](const MeshMaterial& material) {
        return is_plain(material) && !material.is_two_sided;
    });
    if (is_default) mesh.surfaces.clear();
    if (mesh.surfaces.size() < 2) mesh.materials.clear();
}

}  // namespace

Result<std::string> read_whole_file(const std::string& path) {
    const auto cannot = [&](const std::string& why) { return fail(ErrorCode::io, why); };
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
    if (!file) return cannot("it cannot be opened");
    return bytes;
}

void join_vertices(TriangleMesh& mesh) {
    const std::vector<std::uint32_t> first = first_at_position(mesh);
    for (auto& triangle : mesh.triangles) {
        for (std::uint32_t& corner : triangle) corner = first[corner];
    }
    mesh.normals.clear();
    mesh.texture_coordinates.clear();
}

Result<TriangleMesh> read_mesh(const std::string& path) {
    TERRANE_TRY(FileMesh mesh, read_file(path, false));
    return TriangleMesh(std::move(mesh));
}

Result<TriangleMesh> read_mesh_with_attributes(const std::string& path) {
    TERRANE_TRY(FileMesh mesh, read_file(path, true));
    return TriangleMesh(std::move(mesh));
}

Result<MeshModel> read_model(const std::string& path) {
    TERRANE_TRY(FileMesh mesh, read_file(path, true, FileMaterials::with));
    join_materials(mesh);
    std::vector<MeshMaterial> materials = std::move(mesh.surfaces);
    return MeshModel{TriangleMesh(std::move(mesh)), std::move(materials)};
}

}  // namespace terrane::tools
