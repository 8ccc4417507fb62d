// SPDX-License-Identifier: MIT
//
// Reader of glTF 2.0 (ISO/IEC 12113:2022; its sections are named here, in gltf_document and in gltf_materials): nodes,
// geometry, colours and normals. The JSON is parsed by nlohmann::json. tinygltf 2.7 cannot replace this reader: it
// drops primitives that it cannot parse, reads beyond the end of a damaged .glb file, and refuses buffers that are
// longer than they must be.
#include "program/json_values.h"
#include "scene/gltf_document.h"
#include "scene/gltf_materials.h"
#include "scene/mesh_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <string_view>
#include <tuple>
#include <utility>

namespace terrane::tools {
namespace gltf {
namespace {

constexpr int kMostNodeDepth = 256, kMostJsonDepth = 64;

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

class Reader {
public:
    /// @param binary the second chunk of a .glb file, or empty
    Reader(const Json& root, std::optional<std::string_view> binary, std::string folder,
           FileMaterials materials)
        : document_(root, binary, std::move(folder)),
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
        TERRANE_TRY(const Part asset, document_.root().object("asset"));
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
        const Json* const required = document_.root().find("extensionsRequired");
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

    /// The nodes of the default scene; without one, those of all scenes; without scenes, all nodes without a parent.
    Result<std::vector<std::size_t>> root_nodes() {
        has_visited_.assign(document_.count_of("nodes"), false);
        TERRANE_TRY(const std::optional<std::size_t> chosen, document_.root().index("scene"));
        std::vector<std::size_t> roots;
        std::vector<bool> is_listed(has_visited_.size());
        const std::size_t scene_count = document_.count_of("scenes");
        for (std::size_t i = chosen.value_or(0); i < (chosen ? *chosen + 1 : scene_count); ++i) {
            TERRANE_TRY(const Part scene, document_.item("scenes", i));
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
            TERRANE_TRY(const Part node, document_.item("nodes", i));
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
        TERRANE_TRY(const Part node, document_.item("nodes", index));
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
        TERRANE_TRY(const Part mesh, document_.item("meshes", index));
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
            TERRANE_TRY(*values, document_.elements(*accessor, width, width, kMostMeshParts));
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
            TERRANE_TRY(const Part accessor, document_.item("accessors", position));
            if (accessor.find("bufferView") == nullptr) return refuse(compressed(primitive, coder));
        }
        TERRANE_TRY(Elements points, document_.elements(position, 3, 3, kMostMeshParts));
        if (points.count > kMostMeshParts - mesh_.positions.size())
            return refuse(fmt::format("it has more than {} points", kMostMeshParts));
        TERRANE_TRY(add_morphs(primitive, "POSITION", weights, points));
        const std::size_t first = mesh_.positions.size();
        for (std::size_t i = 0; i < points.count; ++i)
            mesh_.positions.push_back(to_file * points.vector(i));
        TERRANE_TRY(add_normals(primitive, attributes, weights, to_file.linear()));
        TERRANE_TRY(add_colours(primitive, attributes));
        if (has_materials_) {
            TERRANE_TRY(materials_.add(primitive, attributes, points.count));
        }

        TERRANE_TRY(const std::optional<std::size_t> indices, primitive.index("indices"));
        std::vector<std::size_t> corners;
        if (indices) {
            TERRANE_TRY(const Elements list,
                        document_.elements(*indices, 1, 1, 3 * kMostMeshParts));
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
            TERRANE_TRY(const Elements moves,
                        document_.elements(*accessor, 3, 3, values_out.count));
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
        TERRANE_TRY(Elements normals, document_.elements(*accessor, 3, 3, count));
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
            TERRANE_TRY(const Part material, document_.item("materials", *index));
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
            TERRANE_TRY(colours, document_.elements(*accessor, 3, 4, count));
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

    static constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";
    static constexpr std::size_t kTriangles = 4, kTriangleStrip = 5, kTriangleFan = 6;

    Document document_;
    std::vector<bool> has_visited_;  // [nodes]
    FileMesh mesh_;
    bool has_colours_ = false, has_normals_ = true;
    bool has_materials_;
    Materials materials_{document_, mesh_};
};

}  // namespace
}  // namespace gltf

Result<FileMesh> parse_gltf(std::string_view bytes, const std::string& folder,
                            FileMaterials materials) {
    gltf::Chunks chunks = {bytes, std::nullopt};
    if (bytes.starts_with("glTF")) {
        TERRANE_TRY(chunks, gltf::read_chunks(bytes));
    }
    try {
        using gltf::Json;
        // what is nested deeper is left out: a message that shows it would need a stack as deep
        const Json root = Json::parse(chunks.json, [](int depth, Json::parse_event_t, Json&) {
            return depth < gltf::kMostJsonDepth;
        });
        return gltf::Reader(root, chunks.binary, folder, materials).read();
    } catch (const std::exception& error) {
        return gltf::refuse(fmt::format("it is no glTF file: {}", error.what()));
    }
}

}  // namespace terrane::tools
