// SPDX-License-Identifier: MIT
//
// Reader of glTF 2.0 (ISO/IEC 12113:2022; its sections are named below): geometry, colours, normals and materials. The
// JSON is parsed by nlohmann::json. tinygltf 2.7 cannot replace this reader: it drops primitives that it cannot parse,
// reads beyond the end of a damaged .glb file, and refuses buffers that are longer than they must be.
#include "program/json_values.h"
#include "scene/mesh_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <deque>
#include <exception>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <tuple>
#include <utility>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kMostNodeDepth = 256, kMostJsonDepth = 64;
constexpr std::size_t kMostNumber = std::size_t{1} << 40;  // of a count or an offset
constexpr double kWhiteInSun = 2.0;                        // see MeshMaterial::emission

tl::unexpected<Error> refuse(const std::string& message) {
    return fail(ErrorCode::bad_data, message);
}

/// An object of the document and its name in messages, such as "accessors[3]".
struct Part {
    const Json* json;
    std::string name;

    /// Null if there is no such key.
    const Json* find(const char* key) const {
        const auto at = json->find(key);
        return at == json->end() ? nullptr : &*at;
    }

    Result<Part> object(const char* key) const {
        const Json* const found = find(key);
        const std::string path = name.empty() ? key : fmt::format("{}.{}", name, key);
        if (found != nullptr && found->is_object()) return Part{found, path};
        return refuse(found == nullptr
                          ? path + " is missing"
                          : fmt::format("{} must be an object, got {}", path, shown(*found)));
    }

    /// @param otherwise value if the key is absent; absent for a required key
    Result<std::size_t> number(const char* key, std::optional<std::size_t> otherwise = {}) const {
        const Json* const found = find(key);
        if (found == nullptr && otherwise) return *otherwise;
        if (found == nullptr) return refuse(fmt::format("{}.{} is missing", name, key));
        // a whole number may be written as 3.0 (section 3.3)
        if (found->is_number() && found->get<double>() >= 0.0 &&
            found->get<double>() <= static_cast<double>(kMostNumber) &&
            found->get<double>() == std::floor(found->get<double>())) {
            return static_cast<std::size_t>(found->get<double>());
        }
        return refuse(fmt::format("{}.{} must be a whole number from 0 to 2^40, got {}", name, key,
                                  shown(*found)));
    }

    /// The index at a key; absent if there is no such key.
    Result<std::optional<std::size_t>> index(const char* key) const {
        if (find(key) == nullptr) return std::optional<std::size_t>();
        TERRANE_TRY(const std::size_t found, number(key));
        return std::optional<std::size_t>(found);
    }

    /// The list of `count` numbers at a key; of any length if `count` is 0. Empty if there is no such key.
    Result<std::vector<double>> numbers(const char* key, std::size_t count) const {
        const Json* const found = find(key);
        std::vector<double> list;
        if (found == nullptr) return list;
        bool is_good = found->is_array() && (count == 0 || found->size() == count);
        for (std::size_t i = 0; is_good && i < found->size(); ++i) {
            is_good = (*found)[i].is_number();
            if (is_good) list.push_back((*found)[i].get<double>());
        }
        if (is_good) return list;
        return refuse(fmt::format("{}.{} must be a list of {}numbers, got {}", name, key,
                                  count == 0 ? "" : fmt::format("{} ", count), shown(*found)));
    }

    /// The list at a key; empty if there is no such key.
    Result<std::vector<std::size_t>> indices(const char* key) const {
        TERRANE_TRY(const std::vector<double> list, numbers(key, 0));
        std::vector<std::size_t> made;
        for (const double value : list) {
            if (!(value >= 0.0 && value <= 0x1p32 && value == std::floor(value))) {
                return refuse(fmt::format("{}.{} names element {}", name, key, value));
            }
            made.push_back(static_cast<std::size_t>(value));
        }
        return made;
    }

    /// An extension of this object; null if it has none of that name.
    const Json* extension(const char* key) const {
        const Json* const all = find("extensions");
        if (all == nullptr || !all->is_object() || !all->contains(key)) return nullptr;
        return &(*all)[key];
    }
};

/// Numbers of an accessor: `width` for each element.
struct Elements {
    std::size_t count = 0, width = 1;
    std::vector<double> values;

    Eigen::Vector3d vector(std::size_t i) const {
        return {values[width * i], values[width * i + 1], values[width * i + 2]};
    }
};

struct ComponentType {
    std::size_t size;
    double normalised_by;  // the number that means 1, section 3.11
    double (*value)(const char* raw);
};

template <class Number>
constexpr ComponentType component_type(double normalised_by) {
    return {sizeof(Number), normalised_by, [](const char* raw) {
                std::array<char, sizeof(Number)> bytes{};
                std::copy_n(raw, bytes.size(), bytes.begin());
                if (std::endian::native == std::endian::big) std::ranges::reverse(bytes);
                return static_cast<double>(std::bit_cast<Number>(bytes));
            }};
}

std::optional<ComponentType> component_type_of(std::size_t number) {
    switch (number) {
        case 5120:
            return component_type<std::int8_t>(127.0);
        case 5121:
            return component_type<std::uint8_t>(255.0);
        case 5122:
            return component_type<std::int16_t>(32767.0);
        case 5123:
            return component_type<std::uint16_t>(65535.0);
        case 5125:
            return component_type<std::uint32_t>(4294967295.0);
        case 5126:
            return component_type<float>(1.0);
        default:
            return std::nullopt;
    }
}

/// Replaces "%20" by a space, and so on; a % without two hexadecimal digits stays.
std::string percent_decoded(std::string_view text) {
    std::string made;
    for (std::size_t i = 0; i < text.size(); ++i) {
        unsigned code = 0;
        const char* const digits = text.data() + i + 1;
        if (text[i] == '%' && i + 2 < text.size() &&
            std::from_chars(digits, digits + 2, code, 16).ptr == digits + 2) {
            made += static_cast<char>(code);
            i += 2;
        } else {
            made += text[i];
        }
    }
    return made;
}

std::optional<std::string> base64_decoded(std::string_view text) {
    while (text.ends_with('=')) text.remove_suffix(1);
    constexpr std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::array<int, 256> value_of{};
    value_of.fill(-1);
    for (std::size_t i = 0; i < kDigits.size(); ++i)
        value_of[static_cast<unsigned char>(kDigits[i])] = static_cast<int>(i);
    std::string made;
    made.reserve(text.size() / 4 * 3 + 2);
    std::uint32_t bits = 0;
    int bit_count = 0;
    for (const char digit : text) {
        const int value = value_of[static_cast<unsigned char>(digit)];
        if (value < 0) return std::nullopt;
        bits = bits << 6 | static_cast<std::uint32_t>(value);
        bit_count += 6;
        if (bit_count < 8) continue;
        bit_count -= 8;
        made += static_cast<char>(bits >> bit_count & 0xffu);
    }
    return made;
}

std::uint8_t to_level(double value) {
    // NaN becomes 0
    return static_cast<std::uint8_t>(255.0 * (value > 0.0 ? std::min(value, 1.0) : 0.0) + 0.5);
}

/// The level of a linear colour with display gamma.
std::uint8_t to_display(double value) {
    return to_level(std::pow(std::max(value, 0.0), 1.0 / 2.2));
}

/// Whether an extension may be required although it is not read, because it concerns only how surfaces look.
bool is_of_surface(std::string_view extension) {
    constexpr std::array<std::string_view, 5> kPrefixes = {
        "KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "EXT_lights_"};
    return std::ranges::any_of(
        kPrefixes, [&](std::string_view prefix) { return extension.starts_with(prefix); });
}

class GltfReader {
public:
    /// @param binary the second chunk of a .glb file, or empty
    GltfReader(const Json& root, std::optional<std::string_view> binary, std::string folder,
               FileMaterials materials)
        : root_{&root, ""},
          binary_(binary),
          folder_(std::move(folder)),
          has_materials_(materials == FileMaterials::with) {}

    Result<FileMesh> read() {
        TERRANE_TRY(check_version());
        TERRANE_TRY(check_extensions());
        // glTF has y up
        Eigen::Affine3d to_z_up = Eigen::Affine3d::Identity();
        to_z_up.linear() << 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0;
        TERRANE_TRY(const std::vector<std::size_t> roots, root_nodes());
        for (const std::size_t node : roots) {
            TERRANE_TRY(add_node(node, to_z_up, 0));
        }
        if (!has_colours_) mesh_.colours.clear();
        if (!has_normals_) mesh_.normals.clear();
        return std::move(mesh_);
    }

private:
    Result<void> check_version() const {
        TERRANE_TRY(const Part asset, root_.object("asset"));
        for (const char* key : {"version", "minVersion"}) {
            const Json* const version = asset.find(key);
            if (version == nullptr && key == std::string_view("minVersion")) continue;
            const bool is_good = version != nullptr && version->is_string() &&
                                 (version->get<std::string>() == "2.0" ||
                                  (key == std::string_view("version") &&
                                   version->get<std::string>().starts_with("2.")));
            if (is_good) continue;
            return refuse(fmt::format("only glTF 2.0 is read, asset.{} is {}", key,
                                      version == nullptr ? "missing" : shown(*version)));
        }
        return {};
    }

    Result<void> check_extensions() const {
        const Json* const required = root_.find("extensionsRequired");
        if (required == nullptr) return {};
        std::vector<std::string> unknown;
        for (const Json& each : *required) {
            const std::string name = each.is_string() ? each.get<std::string>() : shown(each);
            if (name == "KHR_mesh_quantization" || name == kInstancing || is_of_surface(name))
                continue;
            unknown.push_back(name);
        }
        if (unknown.empty()) return {};
        return refuse(
            fmt::format("it requires {}, which {} not read; known are "
                        "KHR_mesh_quantization and {}",
                        fmt::join(unknown, ", "), unknown.size() == 1 ? "is" : "are", kInstancing));
    }

    /// An element of a list of the document: item("nodes", 2) is nodes[2].
    Result<Part> item(const char* list, std::size_t i) const {
        const Json* const all = root_.find(list);
        const std::size_t count = all != nullptr && all->is_array() ? all->size() : 0;
        if (i >= count) return refuse(fmt::format("it names {}[{}] of {}", list, i, count));
        const std::string name = fmt::format("{}[{}]", list, i);
        if (!(*all)[i].is_object())
            return refuse(fmt::format("{} must be an object, got {}", name, shown((*all)[i])));
        return Part{&(*all)[i], name};
    }

    std::size_t count_of(const char* list) const {
        const Json* const all = root_.find(list);
        return all != nullptr && all->is_array() ? all->size() : 0;
    }

    /// The nodes of the default scene; without one, those of all scenes; without scenes, all nodes without a parent.
    Result<std::vector<std::size_t>> root_nodes() {
        has_visited_.assign(count_of("nodes"), false);
        TERRANE_TRY(const std::optional<std::size_t> chosen, root_.index("scene"));
        std::vector<std::size_t> roots;
        std::vector<bool> is_listed(has_visited_.size());
        const std::size_t scene_count = count_of("scenes");
        for (std::size_t i = chosen.value_or(0); i < (chosen ? *chosen + 1 : scene_count); ++i) {
            TERRANE_TRY(const Part scene, item("scenes", i));
            TERRANE_TRY(const std::vector<std::size_t> nodes, scene.indices("nodes"));
            for (const std::size_t node : nodes) {
                // a root may be in several scenes
                if (node < is_listed.size() && is_listed[node]) continue;
                if (node < is_listed.size()) is_listed[node] = true;
                roots.push_back(node);
            }
        }
        if (chosen || scene_count > 0) return roots;
        std::vector<bool> is_child(has_visited_.size());
        for (std::size_t i = 0; i < is_child.size(); ++i) {
            TERRANE_TRY(const Part node, item("nodes", i));
            TERRANE_TRY(const std::vector<std::size_t> children, node.indices("children"));
            for (const std::size_t child : children) {
                if (child < is_child.size()) is_child[child] = true;
            }
        }
        for (std::size_t i = 0; i < is_child.size(); ++i) {
            if (!is_child[i]) roots.push_back(i);
        }
        if (roots.empty() && !is_child.empty()) return refuse("each of its nodes is a child");
        return roots;
    }

    Result<void> add_node(std::size_t index, const Eigen::Affine3d& parent, int depth) {
        TERRANE_TRY(const Part node, item("nodes", index));
        if (depth > kMostNodeDepth)
            return refuse(fmt::format("its nodes are nested deeper than {}", kMostNodeDepth));
        if (has_visited_[index])
            return refuse(fmt::format("{} has two parents, or is its own ancestor", node.name));
        has_visited_[index] = true;
        TERRANE_TRY(const Eigen::Affine3d own, transform_of(node));
        const Eigen::Affine3d to_file = parent * own;
        TERRANE_TRY(const std::optional<std::size_t> mesh, node.index("mesh"));
        if (mesh) {
            if (node.find("skin") != nullptr) ++mesh_.left_out.skins;
            TERRANE_TRY(add_instances(node, *mesh, to_file));
        }
        TERRANE_TRY(const std::vector<std::size_t> children, node.indices("children"));
        for (const std::size_t child : children) {
            TERRANE_TRY(add_node(child, to_file, depth + 1));
        }
        return {};
    }

    /// Section 3.5.3: a matrix by columns, or translation, rotation (x, y, z, w) and scale.
    static Result<Eigen::Affine3d> transform_of(const Part& node) {
        TERRANE_TRY(const std::vector<double> m, node.numbers("matrix", 16));
        TERRANE_TRY(const std::vector<double> t, node.numbers("translation", 3));
        TERRANE_TRY(const std::vector<double> r, node.numbers("rotation", 4));
        TERRANE_TRY(const std::vector<double> s, node.numbers("scale", 3));
        if (m.empty()) {
            return placed(node.name,
                          t.empty() ? Eigen::Vector3d(0, 0, 0) : Eigen::Vector3d(t.data()),
                          r.empty() ? Eigen::Vector4d(0, 0, 0, 1) : Eigen::Vector4d(r.data()),
                          s.empty() ? Eigen::Vector3d(1, 1, 1) : Eigen::Vector3d(s.data()));
        }
        if (m[3] != 0.0 || m[7] != 0.0 || m[11] != 0.0 || m[15] != 1.0)
            return refuse(node.name + ".matrix must have the last row 0, 0, 0, 1");
        Eigen::Affine3d affine = Eigen::Affine3d::Identity();
        affine.matrix() = Eigen::Map<const Eigen::Matrix4d>(m.data());
        return affine;
    }

    static Result<Eigen::Affine3d> placed(const std::string& name,
                                          const Eigen::Vector3d& translation,
                                          const Eigen::Vector4d& xyzw,
                                          const Eigen::Vector3d& scale) {
        const double length = xyzw.norm();
        // quantised to 8 bits, a rotation has a length of 1 to 1 %
        if (!(std::abs(length - 1.0) < 0.05)) {
            return refuse(
                fmt::format("{}: a rotation must have the length 1, got {:.6g}", name, length));
        }
        const Eigen::Quaterniond rotation(xyzw[3] / length, xyzw[0] / length, xyzw[1] / length,
                                          xyzw[2] / length);
        Eigen::Affine3d affine = Eigen::Affine3d::Identity();
        affine.linear() = rotation.toRotationMatrix() * scale.asDiagonal();
        affine.translation() = translation;
        return affine;
    }

    /// Adds a mesh once, or once for each instance of EXT_mesh_gpu_instancing.
    Result<void> add_instances(const Part& node, std::size_t index,
                               const Eigen::Affine3d& to_file) {
        TERRANE_TRY(const Part mesh, item("meshes", index));
        const Json* const extension = node.extension(kInstancing);
        if (extension == nullptr) return add_mesh(node, mesh, to_file);
        const Part instancing{extension, fmt::format("{}.extensions.{}", node.name, kInstancing)};
        TERRANE_TRY(const Part attributes, instancing.object("attributes"));
        std::optional<Elements> translations, rotations, scales;
        std::optional<std::size_t> count;
        for (const auto& [key, width, values] :
             {std::tuple("TRANSLATION", 3u, &translations), std::tuple("ROTATION", 4u, &rotations),
              std::tuple("SCALE", 3u, &scales)}) {
            TERRANE_TRY(const std::optional<std::size_t> accessor, attributes.index(key));
            if (!accessor) continue;
            TERRANE_TRY(*values, elements(*accessor, width, width, kMostMeshParts));
            if (count.value_or((*values)->count) != (*values)->count)
                return refuse(attributes.name + " differ in their number of instances");
            count = (*values)->count;
        }
        if (!count) return refuse(attributes.name + " place no instance");
        for (std::size_t i = 0; i < *count; ++i) {
            Eigen::Vector4d xyzw(0.0, 0.0, 0.0, 1.0);
            if (rotations) xyzw = Eigen::Vector4d(rotations->values.data() + 4 * i);
            TERRANE_TRY(const Eigen::Affine3d own,
                        placed(attributes.name,
                               translations ? translations->vector(i) : Eigen::Vector3d(0, 0, 0),
                               xyzw, scales ? scales->vector(i) : Eigen::Vector3d(1, 1, 1)));
            TERRANE_TRY(add_mesh(node, mesh, to_file * own));
        }
        return {};
    }

    Result<void> add_mesh(const Part& node, const Part& mesh, const Eigen::Affine3d& to_file) {
        TERRANE_TRY(std::vector<double> weights, node.numbers("weights", 0));
        if (weights.empty()) {
            TERRANE_TRY(weights, mesh.numbers("weights", 0));
        }
        const Json* const primitives = mesh.find("primitives");
        if (primitives == nullptr || !primitives->is_array())
            return refuse(mesh.name + ".primitives must be a list");
        for (std::size_t i = 0; i < primitives->size(); ++i) {
            const Part primitive{&(*primitives)[i], fmt::format("{}.primitives[{}]", mesh.name, i)};
            TERRANE_TRY(add_primitive(primitive, weights, to_file));
        }
        return {};
    }

    Result<void> add_primitive(const Part& primitive, const std::vector<double>& weights,
                               const Eigen::Affine3d& to_file) {
        TERRANE_TRY(const std::size_t mode, primitive.number("mode", kTriangles));
        if (mode > kTriangleFan)
            return refuse(fmt::format("{}.mode must be 0 to 6, got {}", primitive.name, mode));
        if (mode < kTriangles) {
            ++mesh_.left_out.lines;
            return {};
        }
        TERRANE_TRY(const Part attributes, primitive.object("attributes"));
        TERRANE_TRY(const std::size_t position, attributes.number("POSITION"));
        if (const char* const coder = "KHR_draco_mesh_compression";
            primitive.extension(coder) != nullptr) {
            TERRANE_TRY(const Part accessor, item("accessors", position));
            if (accessor.find("bufferView") == nullptr) return refuse(compressed(primitive, coder));
        }
        TERRANE_TRY(Elements points, elements(position, 3, 3, kMostMeshParts));
        if (points.count > kMostMeshParts - mesh_.positions.size())
            return refuse(fmt::format("it has more than {} points", kMostMeshParts));
        TERRANE_TRY(add_morphs(primitive, "POSITION", weights, points));
        const std::size_t first = mesh_.positions.size();
        for (std::size_t i = 0; i < points.count; ++i)
            mesh_.positions.push_back(to_file * points.vector(i));
        TERRANE_TRY(add_normals(primitive, attributes, weights, to_file.linear()));
        TERRANE_TRY(add_colours(primitive, attributes));
        if (has_materials_) {
            TERRANE_TRY(add_material(primitive, attributes, points.count));
        }

        TERRANE_TRY(const std::optional<std::size_t> indices, primitive.index("indices"));
        std::vector<std::size_t> corners;
        if (indices) {
            TERRANE_TRY(const Elements list, elements(*indices, 1, 1, 3 * kMostMeshParts));
            for (const double value : list.values) {
                if (!(value >= 0.0 && value < static_cast<double>(points.count))) {
                    return refuse(fmt::format("{} names point {} of {}", primitive.name, value,
                                              points.count));
                }
                corners.push_back(first + static_cast<std::size_t>(value));
            }
        } else {
            for (std::size_t i = 0; i < points.count; ++i) corners.push_back(first + i);
        }
        return add_triangles(primitive, mode, corners, to_file.linear().determinant() < 0.0);
    }

    Result<void> add_triangles(const Part& primitive, std::size_t mode,
                               const std::vector<std::size_t>& corners, bool is_mirrored) {
        const std::size_t count = corners.size();
        if (count < 3 || (mode == kTriangles && count % 3 != 0)) {
            return refuse(fmt::format("{} has {} corners, {}", primitive.name, count,
                                      count < 3 ? "fewer than 3" : "which is no multiple of 3"));
        }
        const std::size_t made = mode == kTriangles ? count / 3 : count - 2;
        if (made > kMostMeshParts - mesh_.triangles.size())
            return refuse(fmt::format("it has more than {} triangles", kMostMeshParts));
        for (std::size_t i = 0; i < made; ++i) {
            std::array<std::size_t, 3> at = {3 * i, 3 * i + 1, 3 * i + 2};
            // section 3.7.2.1: every second triangle of a strip is turned
            if (mode == kTriangleStrip) at = {i, i + 1 + i % 2, i + 2 - i % 2};
            if (mode == kTriangleFan) at = {0, i + 1, i + 2};
            if (is_mirrored) std::swap(at[1], at[2]);
            mesh_.triangles.push_back({static_cast<std::uint32_t>(corners[at[0]]),
                                       static_cast<std::uint32_t>(corners[at[1]]),
                                       static_cast<std::uint32_t>(corners[at[2]])});
        }
        return {};
    }

    /// Section 3.7.2.2: adds the displacements of a primitive's morph targets times their weights.
    Result<void> add_morphs(const Part& primitive, const char* attribute,
                            const std::vector<double>& weights, Elements& values_out) {
        const Json* const targets = primitive.find("targets");
        const std::size_t count = targets != nullptr && targets->is_array() ? targets->size() : 0;
        if (!weights.empty() && weights.size() != count) {
            return refuse(fmt::format("{} has {} morph targets, and {} weights", primitive.name,
                                      count, weights.size()));
        }
        for (std::size_t k = 0; k < weights.size(); ++k) {
            if (weights[k] == 0.0) continue;
            const Part target{&(*targets)[k], fmt::format("{}.targets[{}]", primitive.name, k)};
            TERRANE_TRY(const std::optional<std::size_t> accessor, target.index(attribute));
            if (!accessor) continue;
            TERRANE_TRY(const Elements moves, elements(*accessor, 3, 3, values_out.count));
            if (moves.count != values_out.count)
                return refuse(fmt::format("{} moves {} of {} points", target.name, moves.count,
                                          values_out.count));
            for (std::size_t i = 0; i < moves.values.size(); ++i)
                values_out.values[i] += weights[k] * moves.values[i];
        }
        return {};
    }

    Result<void> add_normals(const Part& primitive, const Part& attributes,
                             const std::vector<double>& weights, const Eigen::Matrix3d& linear) {
        const std::size_t count = mesh_.positions.size() - mesh_.normals.size();
        TERRANE_TRY(const std::optional<std::size_t> accessor, attributes.index("NORMAL"));
        if (!accessor) {
            has_normals_ = false;
            mesh_.normals.resize(mesh_.positions.size(), Eigen::Vector3f::UnitZ());
            return {};
        }
        TERRANE_TRY(Elements normals, elements(*accessor, 3, 3, count));
        if (normals.count != count)
            return refuse(fmt::format("{} has {} normals for {} points", primitive.name,
                                      normals.count, count));
        TERRANE_TRY(add_morphs(primitive, "NORMAL", weights, normals));
        // cofactors: the inverse transposed, times the determinant
        Eigen::Matrix3d cofactors;
        for (int k = 0; k < 3; ++k)
            cofactors.col(k) = linear.col((k + 1) % 3).cross(linear.col((k + 2) % 3));
        if (linear.determinant() < 0.0) cofactors = -cofactors;
        for (std::size_t i = 0; i < count; ++i) {
            const Eigen::Vector3d normal = cofactors * normals.vector(i);
            const double length = normal.norm();
            mesh_.normals.push_back(length > 0.0 ? Eigen::Vector3f((normal / length).cast<float>())
                                                 : Eigen::Vector3f(0.0f, 0.0f, 1.0f));
        }
        return {};
    }

    /// Section 3.9.2: the colour of a vertex times the base colour of the material, both linear.
    Result<void> add_colours(const Part& primitive, const Part& attributes) {
        std::vector<double> base = {1.0, 1.0, 1.0, 1.0};
        TERRANE_TRY(const std::optional<std::size_t> index, primitive.index("material"));
        if (index) {
            TERRANE_TRY(const Part material, item("materials", *index));
            if (material.find("pbrMetallicRoughness") != nullptr) {
                TERRANE_TRY(const Part surface, material.object("pbrMetallicRoughness"));
                TERRANE_TRY(const std::vector<double> factor,
                            surface.numbers("baseColorFactor", 4));
                if (!factor.empty()) base = factor;
            }
            has_colours_ = true;
        }
        const std::size_t count = mesh_.positions.size() - mesh_.colours.size();
        TERRANE_TRY(const std::optional<std::size_t> accessor, attributes.index("COLOR_0"));
        Elements colours;
        if (accessor) {
            TERRANE_TRY(colours, elements(*accessor, 3, 4, count));
            if (colours.count != count)
                return refuse(fmt::format("{} has {} colours for {} points", primitive.name,
                                          colours.count, count));
            has_colours_ = true;
        }
        for (std::size_t i = 0; i < count; ++i) {
            std::array<double, 4> colour = {base[0], base[1], base[2], base[3]};
            for (std::size_t k = 0; accessor && k < colours.width; ++k)
                colour[k] *= colours.values[colours.width * i + k];
            mesh_.colours.push_back({to_display(colour[0]), to_display(colour[1]),
                                     to_display(colour[2]), to_level(colour[3])});
        }
        return {};
    }

    /// How a texture uses the texture coordinates: their set, and the transformation of KHR_texture_transform.
    struct Placing {
        std::size_t set = 0;
        double scale_u = 1.0, scale_v = 1.0, rotation = 0.0, offset_u = 0.0, offset_v = 0.0;
        friend bool operator==(const Placing&, const Placing&) = default;
    };

    /// A material, and the placing of its textures.
    struct Surface {
        std::uint16_t index = 0;  // in mesh_.surfaces
        Placing placing;
    };

    /// Sections 3.7.2 and 3.9: the material of a primitive's points, and their texture coordinates.
    Result<void> add_material(const Part& primitive, const Part& attributes, std::size_t count) {
        TERRANE_TRY(const std::optional<std::size_t> index, primitive.index("material"));
        auto found = surfaces_.find(index);
        if (found == surfaces_.end()) {
            TERRANE_TRY(const Surface made, make_surface(index));
            found = surfaces_.emplace(index, made).first;
        }
        const Placing& placing = found->second.placing;
        mesh_.materials.resize(mesh_.positions.size(), found->second.index);
        const std::string key = fmt::format("TEXCOORD_{}", placing.set);
        TERRANE_TRY(const std::optional<std::size_t> accessor, attributes.index(key.c_str()));
        Elements places;
        if (accessor) {
            TERRANE_TRY(places, elements(*accessor, 2, 2, count));
            if (places.count != count)
                return refuse(fmt::format("{} has {} texture coordinates for {} points",
                                          primitive.name, places.count, count));
        } else {
            places.values.assign(2 * count, 0.0);
        }
        const double c = std::cos(placing.rotation), s = std::sin(placing.rotation);
        for (std::size_t i = 0; i < count; ++i) {
            const double u = placing.scale_u * places.values[2 * i],
                         v = placing.scale_v * places.values[2 * i + 1];
            // v points down in glTF
            mesh_.texture_coordinates.emplace_back(
                static_cast<float>(c * u + s * v + placing.offset_u),
                static_cast<float>(1.0 - (c * v - s * u + placing.offset_v)));
        }
        return {};
    }

    /// Notes why a texture is not drawn.
    void leave_out(const std::string& texture, const std::string& why) {
        mesh_.left_out.textures.push_back(fmt::format("{}: {}", texture, why));
    }

    /// @param index of the material; absent: the default one
    Result<Surface> make_surface(std::optional<std::size_t> index) {
        if (mesh_.surfaces.size() > std::numeric_limits<std::uint16_t>::max())
            return refuse("it has more than 65536 materials");
        Surface made = {static_cast<std::uint16_t>(mesh_.surfaces.size()), {}};
        MeshMaterial material;
        if (index) {
            TERRANE_TRY(const Part part, item("materials", *index));
            TERRANE_TRY(made.placing, read_material(part, material));
        }
        mesh_.surfaces.push_back(std::move(material));
        return made;
    }

    Result<Placing> read_material(const Part& part, MeshMaterial& material) {
        const Json* const two_sided = part.find("doubleSided");
        material.is_two_sided = two_sided != nullptr && *two_sided == true;
        material.metal = 1.0f;  // section 5.22
        double opacity = 1.0;
        std::optional<Placing> placing;
        if (part.find("pbrMetallicRoughness") != nullptr) {
            TERRANE_TRY(const Part surface, part.object("pbrMetallicRoughness"));
            TERRANE_TRY(material.roughness, factor(surface, "roughnessFactor", 1.0));
            TERRANE_TRY(material.metal, factor(surface, "metallicFactor", 1.0));
            TERRANE_TRY(const std::vector<double> base, surface.numbers("baseColorFactor", 4));
            if (!base.empty()) opacity = base[3];
            material.colour_texture = texture_of(surface, "baseColorTexture", placing);
            material.roughness_metal_texture =
                texture_of(surface, "metallicRoughnessTexture", placing);
        }
        material.normal_texture = texture_of(part, "normalTexture", placing);
        if (material.normal_texture.image) {
            TERRANE_TRY(const Part normal, part.object("normalTexture"));
            TERRANE_TRY(const double scale, number_or(normal, "scale", 1.0));
            material.normal_scale = static_cast<float>(std::clamp(scale, -1e3, 1e3));
        }
        // with a texture of emission the factor alone would light the whole surface
        if (part.find("emissiveTexture") == nullptr) {
            TERRANE_TRY(const std::vector<double> emission, part.numbers("emissiveFactor", 3));
            for (std::size_t k = 0; k < emission.size(); ++k)
                material.emission[k] =
                    static_cast<float>(kWhiteInSun * std::clamp(emission[k], 0.0, 1.0));
        }
        const Json* const mode = part.find("alphaMode");
        if (mode != nullptr && *mode == "MASK") {
            TERRANE_TRY(const double cutoff, number_or(part, "alphaCutoff", 0.5));
            material.alpha_cutoff = static_cast<float>(std::clamp(cutoff, 0.0, 1.0));
        } else if (mode != nullptr && *mode == "BLEND" && material.colour_texture.image) {
            // where the texture has half its opacity
            material.alpha_cutoff = static_cast<float>(0.5 * std::clamp(opacity, 0.0, 1.0));
            ++mesh_.left_out.blended;
        }
        return placing.value_or(Placing{});
    }

    static Result<double> number_or(const Part& part, const char* key, double otherwise) {
        const Json* const found = part.find(key);
        if (found == nullptr) return otherwise;
        if (found->is_number()) return found->get<double>();
        return refuse(fmt::format("{}.{} must be a number, got {}", part.name, key, shown(*found)));
    }

    static Result<float> factor(const Part& part, const char* key, double otherwise) {
        TERRANE_TRY(const double value, number_or(part, key, otherwise));
        return static_cast<float>(value > 0.0 ? std::min(value, 1.0) : 0.0);
    }

    /// The texture at a key of a material; none if there is no such key, or if it cannot be read: then noted.
    ///
    /// @param placing_out that of the material's first texture, which all of its textures must have
    MaterialTexture texture_of(const Part& material, const char* key,
                               std::optional<Placing>& placing_out) {
        if (material.find(key) == nullptr) return {};
        Placing placing;
        Result<MaterialTexture> texture = read_texture(material, key, placing);
        if (!texture) {
            leave_out(fmt::format("{}.{}", material.name, key), texture.error().message);
            return {};
        }
        if (placing_out.value_or(placing) != placing) {
            leave_out(fmt::format("{}.{}", material.name, key),
                      "its coordinates differ from those of the material's first texture");
            return {};
        }
        placing_out = placing;
        return *std::move(texture);
    }

    Result<MaterialTexture> read_texture(const Part& material, const char* key,
                                         Placing& placing_out) {
        TERRANE_TRY(const Part info, material.object(key));
        TERRANE_TRY(const std::size_t index, info.number("index"));
        TERRANE_TRY(placing_out.set, info.number("texCoord", 0));
        if (const Json* const found = info.extension("KHR_texture_transform"); found != nullptr) {
            const Part transform{found, info.name + ".extensions.KHR_texture_transform"};
            if (!found->is_object()) return refuse(transform.name + " must be an object");
            TERRANE_TRY(const std::vector<double> offset, transform.numbers("offset", 2));
            TERRANE_TRY(const std::vector<double> scale, transform.numbers("scale", 2));
            TERRANE_TRY(placing_out.rotation, number_or(transform, "rotation", 0.0));
            TERRANE_TRY(placing_out.set, transform.number("texCoord", placing_out.set));
            if (!offset.empty())
                std::tie(placing_out.offset_u, placing_out.offset_v) = pair(offset);
            if (!scale.empty()) std::tie(placing_out.scale_u, placing_out.scale_v) = pair(scale);
        }
        TERRANE_TRY(const Part texture, item("textures", index));
        MaterialTexture made;
        TERRANE_TRY(const std::optional<std::size_t> sampler, texture.index("sampler"));
        if (sampler) {
            TERRANE_TRY(const Part wraps, item("samplers", *sampler));
            TERRANE_TRY(made.wrap_right, wrap_of(wraps, "wrapS"));
            TERRANE_TRY(made.wrap_up, wrap_of(wraps, "wrapT"));
        }
        TERRANE_TRY(const std::size_t source, texture.number("source"));
        TERRANE_TRY(made.image, image_of(source));
        return made;
    }

    static std::pair<double, double> pair(const std::vector<double>& two) {
        return {two[0], two[1]};
    }

    static Result<TextureWrap> wrap_of(const Part& sampler, const char* key) {
        constexpr std::size_t kRepeat = 10497, kClamp = 33071, kMirror = 33648;
        TERRANE_TRY(const std::size_t wrap, sampler.number(key, kRepeat));
        if (wrap == kClamp) return TextureWrap::clamp;
        return wrap == kMirror ? TextureWrap::mirror : TextureWrap::repeat;
    }

    /// An image, decoded when it is first needed. The message names its file.
    Result<std::shared_ptr<const TextureImage>> image_of(std::size_t index) {
        if (const auto known = images_.find(index); known != images_.end()) return known->second;
        const auto read = [&]() -> Result<std::shared_ptr<const TextureImage>> {
            TERRANE_TRY(const Part image, item("images", index));
            const Json* const uri = image.find("uri");
            std::string name = image.name;
            if (uri != nullptr && uri->is_string() && !uri->get<std::string>().starts_with("data:"))
                name = uri->get<std::string>();
            Result<std::shared_ptr<const TextureImage>> decoded = decode(image);
            if (decoded) return decoded;
            return refuse(fmt::format("'{:.60}': {}", name, decoded.error().message));
        };
        return images_.emplace(index, read()).first->second;
    }

    Result<std::shared_ptr<const TextureImage>> decode(const Part& image) {
        if (const Json* const uri = image.find("uri"); uri != nullptr) {
            if (!uri->is_string()) return refuse(image.name + ".uri must be a text");
            TERRANE_TRY(const std::string bytes,
                        read_uri(image, uri->get_ref<const std::string&>()));
            return decode_image(bytes);
        }
        TERRANE_TRY(const std::size_t index, image.number("bufferView"));
        TERRANE_TRY(const Part view, item("bufferViews", index));
        TERRANE_TRY(const std::size_t length, view.number("byteLength"));
        // as an accessor of `length` bytes
        const Json bytes_of_view = {{"bufferView", index}};
        TERRANE_TRY(const auto first, rows({&bytes_of_view, image.name}, length, 1));
        return decode_image({first.first, length});
    }

    /// The numbers of an accessor, section 3.6.2, whose elements have from `least` to `most_width` components.
    ///
    /// @param most_count largest number of elements: checked before memory is allocated
    Result<Elements> elements(std::size_t index, std::size_t least, std::size_t most_width,
                              std::size_t most_count) {
        TERRANE_TRY(const Part accessor, item("accessors", index));
        const Json* const type_name = accessor.find("type");
        constexpr std::array<std::string_view, 4> kTypes = {"SCALAR", "VEC2", "VEC3", "VEC4"};
        const auto* const type =
            type_name == nullptr || !type_name->is_string()
                ? kTypes.end()
                : std::ranges::find(kTypes, type_name->get_ref<const std::string&>());
        Elements made;
        made.width = static_cast<std::size_t>(type - kTypes.begin()) + 1;
        if (made.width < least || made.width > most_width) {
            return refuse(fmt::format("{}.type must be {}{}, got {}", accessor.name,
                                      kTypes[least - 1], most_width > least ? " or VEC4" : "",
                                      type_name == nullptr ? "nothing" : shown(*type_name)));
        }
        TERRANE_TRY(made.count, accessor.number("count"));
        if (made.count > most_count) {
            return refuse(fmt::format("{} has {} elements, more than {}", accessor.name, made.count,
                                      most_count));
        }
        TERRANE_TRY(const ComponentType component, component_of(accessor));
        const Json* const normalized = accessor.find("normalized");
        if (normalized != nullptr && !normalized->is_boolean())
            return refuse(accessor.name + ".normalized must be true or false");
        const bool is_normalised = normalized != nullptr && normalized->get<bool>();
        const auto value_at = [&](const char* raw) {
            const double value = component.value(raw);
            return is_normalised ? std::max(value / component.normalised_by, -1.0) : value;
        };
        const std::size_t size = made.width * component.size;
        // without a buffer view all are 0
        const char* raw = nullptr;
        std::size_t stride = 0;
        if (accessor.find("bufferView") != nullptr) {
            TERRANE_TRY(std::tie(raw, stride), rows(accessor, made.count, size));
        }
        made.values.assign(made.count * made.width, 0.0);
        for (std::size_t i = 0; raw != nullptr && i < made.count; ++i) {
            for (std::size_t k = 0; k < made.width; ++k)
                made.values[made.width * i + k] = value_at(raw + i * stride + k * component.size);
        }
        if (accessor.find("sparse") == nullptr) return made;

        TERRANE_TRY(const Part sparse, accessor.object("sparse"));
        TERRANE_TRY(const std::size_t changed, sparse.number("count"));
        TERRANE_TRY(const Part places, sparse.object("indices"));
        TERRANE_TRY(const Part values, sparse.object("values"));
        if (changed > made.count) {
            return refuse(
                fmt::format("{} changes {} of {} elements", sparse.name, changed, made.count));
        }
        TERRANE_TRY(const ComponentType place, component_of(places));
        TERRANE_TRY(const auto place_rows, rows(places, changed, place.size));
        TERRANE_TRY(const auto value_rows, rows(values, changed, size));
        for (std::size_t i = 0; i < changed; ++i) {
            const double at = place.value(place_rows.first + i * place_rows.second);
            if (!(at >= 0.0 && at < static_cast<double>(made.count)))
                return refuse(
                    fmt::format("{} names element {} of {}", places.name, at, made.count));
            for (std::size_t k = 0; k < made.width; ++k) {
                made.values[made.width * static_cast<std::size_t>(at) + k] =
                    value_at(value_rows.first + i * value_rows.second + k * component.size);
            }
        }
        return made;
    }

    static Result<ComponentType> component_of(const Part& part) {
        TERRANE_TRY(const std::size_t number, part.number("componentType"));
        const std::optional<ComponentType> type = component_type_of(number);
        if (type) return *type;
        return refuse(
            fmt::format("{}.componentType must be one of 5120 to 5126 without 5124, got {}",
                        part.name, number));
    }

    /// The first byte of `count` elements of `size` bytes, and the distance from one to the next.
    ///
    /// @param part an accessor or a part of one, with bufferView and byteOffset
    Result<std::pair<const char*, std::size_t>> rows(const Part& part, std::size_t count,
                                                     std::size_t size) {
        TERRANE_TRY(const std::size_t view_index, part.number("bufferView"));
        TERRANE_TRY(const std::size_t offset, part.number("byteOffset", 0));
        TERRANE_TRY(const Part view, item("bufferViews", view_index));
        TERRANE_TRY(const std::size_t buffer_index, view.number("buffer"));
        TERRANE_TRY(const std::size_t view_offset, view.number("byteOffset", 0));
        TERRANE_TRY(const std::size_t view_length, view.number("byteLength"));
        TERRANE_TRY(const std::size_t stride, view.number("byteStride", size));
        if (stride < size || stride > 252 + size) {
            return refuse(
                fmt::format("{}.byteStride must be {} to 252, got {}", view.name, size, stride));
        }
        TERRANE_TRY(const std::string_view bytes, buffer_bytes(buffer_index, view));
        if (view_offset + view_length > bytes.size()) {
            return refuse(fmt::format("{} ends at byte {} of {}", view.name,
                                      view_offset + view_length, bytes.size()));
        }
        const std::size_t needed = count == 0 ? 0 : offset + stride * (count - 1) + size;
        if (needed > view_length) {
            return refuse(fmt::format("{} ends at byte {} of {}, which has {}", part.name, needed,
                                      view.name, view_length));
        }
        return std::pair(bytes.data() + view_offset + offset, stride);
    }

    static std::string compressed(const Part& part, const char* extension) {
        return fmt::format("{} is compressed by {}, which is not read", part.name, extension);
    }

    /// @param view the buffer view that needs it
    Result<std::string_view> buffer_bytes(std::size_t index, const Part& view) {
        if (const auto known = buffers_.find(index); known != buffers_.end()) return known->second;
        TERRANE_TRY(const Part buffer, item("buffers", index));
        TERRANE_TRY(const std::size_t length, buffer.number("byteLength"));
        const Json* const uri = buffer.find("uri");
        std::string_view bytes;
        if (uri != nullptr) {
            if (!uri->is_string()) return refuse(buffer.name + ".uri must be a text");
            TERRANE_TRY(std::string read, read_uri(buffer, uri->get_ref<const std::string&>()));
            bytes = owned_.emplace_back(std::move(read));
        } else if (index == 0 && binary_) {
            bytes = *binary_;
        } else {
            for (const char* coder : {"EXT_meshopt_compression", "KHR_meshopt_compression"}) {
                if (view.extension(coder) != nullptr) return refuse(compressed(view, coder));
            }
            return refuse(buffer.name + " has no uri");
        }
        if (bytes.size() < length) {
            return refuse(fmt::format("{} has {} bytes, fewer than its byteLength {}", buffer.name,
                                      bytes.size(), length));
        }
        return buffers_[index] = bytes.substr(0, length);
    }

    Result<std::string> read_uri(const Part& buffer, const std::string& uri) const {
        if (uri.starts_with("data:")) {
            const std::size_t comma = std::min(uri.find(','), uri.size() - 1);
            const std::string_view kind = std::string_view(uri).substr(0, comma);
            const std::string_view data = std::string_view(uri).substr(comma + 1);
            if (!kind.ends_with(";base64")) return percent_decoded(data);
            std::optional<std::string> bytes = base64_decoded(data);
            if (!bytes) return refuse(buffer.name + ".uri is no base64");
            return *std::move(bytes);
        }
        const std::filesystem::path name(percent_decoded(uri));
        if (uri.find(':') != std::string::npos || !is_path_below(name)) {
            return refuse(fmt::format(
                "{}.uri '{:.60}' is not read: buffers must be in the file's folder or below it",
                buffer.name, uri));
        }
        Result<std::string> bytes =
            read_whole_file((std::filesystem::path(folder_) / name).string());
        if (bytes) return bytes;
        return fail(ErrorCode::io, fmt::format("{}: '{}' beside it cannot be read: {}", buffer.name,
                                               name.string(), bytes.error().message));
    }

    static constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";
    static constexpr std::size_t kTriangles = 4, kTriangleStrip = 5, kTriangleFan = 6;

    Part root_;
    std::optional<std::string_view> binary_;
    std::string folder_;
    std::map<std::size_t, std::string_view> buffers_;  // those that have been needed
    std::deque<std::string> owned_;                    // their bytes
    std::vector<bool> has_visited_;                    // [nodes]
    FileMesh mesh_;
    bool has_colours_ = false, has_normals_ = true;
    bool has_materials_;
    std::map<std::optional<std::size_t>, Surface> surfaces_;  // of those materials that are used
    std::map<std::size_t, Result<std::shared_ptr<const TextureImage>>> images_;
};

/// The first two chunks of a .glb file, section 4.4.
Result<std::pair<std::string_view, std::optional<std::string_view>>> read_chunks(
    std::string_view bytes) {
    const auto word = [&](std::size_t at) {
        std::uint32_t value = 0;
        for (std::size_t i = 4; i-- > 0;)
            value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
        return value;
    };
    constexpr std::uint32_t kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;
    if (bytes.size() < 20 || word(8) < 20 || word(8) > bytes.size())
        return refuse("it is no GLB file, or ends early");
    if (word(4) != 2) return refuse(fmt::format("only glTF 2.0 is read, got version {}", word(4)));
    bytes = bytes.substr(0, word(8));
    const std::size_t json_size = word(12);
    if (word(16) != kJsonChunk || json_size > bytes.size() - 20)
        return refuse("its first chunk is no JSON, or ends early");
    const std::string_view json = bytes.substr(20, json_size);
    const std::size_t second = 20 + json_size;
    if (bytes.size() - second < 8 || word(second + 4) != kBinaryChunk)
        return std::pair(json, std::optional<std::string_view>());
    if (word(second) > bytes.size() - second - 8) return refuse("its second chunk ends early");
    return std::pair(json, std::optional(bytes.substr(second + 8, word(second))));
}

}  // namespace

Result<FileMesh> parse_gltf(std::string_view bytes, const std::string& folder,
                            FileMaterials materials) {
    std::pair<std::string_view, std::optional<std::string_view>> chunks = {bytes, std::nullopt};
    if (bytes.starts_with("glTF")) {
        TERRANE_TRY(chunks, read_chunks(bytes));
    }
    try {
        // what is nested deeper is left out: a message that shows it would need a stack as deep
        const Json root = Json::parse(chunks.first, [](int depth, Json::parse_event_t, Json&) {
            return depth < kMostJsonDepth;
        });
        return GltfReader(root, chunks.second, folder, materials).read();
    } catch (const std::exception& error) {
        return refuse(fmt::format("it is no glTF file: {}", error.what()));
    }
}

}  // namespace terrane::tools
