// SPDX-License-Identifier: MIT
#include "scene/gltf_materials.h"

#include "program/json_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

namespace terrane::tools::gltf {
namespace {

constexpr double kWhiteInSun = 2.0;  // see MeshMaterial::emission

Result<double> number_or(const Part& part, const char* key, double otherwise) {
    const Json* const found = part.find(key);
    if (found == nullptr) return otherwise;
    if (found->is_number()) return found->get<double>();
    return refuse(fmt::format("{}.{} must be a number, got {}", part.name, key, shown(*found)));
}

Result<float> factor(const Part& part, const char* key, double otherwise) {
    TERRANE_TRY(const double value, number_or(part, key, otherwise));
    return static_cast<float>(value > 0.0 ? std::min(value, 1.0) : 0.0);
}

std::pair<double, double> pair(const std::vector<double>& two) { return {two[0], two[1]}; }

Result<TextureWrap> wrap_of(const Part& sampler, const char* key) {
    constexpr std::size_t kRepeat = 10497, kClamp = 33071, kMirror = 33648;
    TERRANE_TRY(const std::size_t wrap, sampler.number(key, kRepeat));
    if (wrap == kClamp) return TextureWrap::clamp;
    return wrap == kMirror ? TextureWrap::mirror : TextureWrap::repeat;
}

}  // namespace

Result<void> Materials::add(const Part& primitive, const Part& attributes, std::size_t count) {
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
        TERRANE_TRY(places, document_.elements(*accessor, 2, 2, count));
        if (places.count != count)
            return refuse(fmt::format("{} has {} texture coordinates for {} points", primitive.name,
                                      places.count, count));
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

void Materials::leave_out(const std::string& texture, const std::string& why) {
    mesh_.left_out.textures.push_back(fmt::format("{}: {}", texture, why));
}

Result<Materials::Surface> Materials::make_surface(std::optional<std::size_t> index) {
    if (mesh_.surfaces.size() > std::numeric_limits<std::uint16_t>::max())
        return refuse("it has more than 65536 materials");
    Surface made = {static_cast<std::uint16_t>(mesh_.surfaces.size()), {}};
    MeshMaterial material;
    if (index) {
        TERRANE_TRY(const Part part, document_.item("materials", *index));
        TERRANE_TRY(made.placing, read_material(part, material));
    }
    mesh_.surfaces.push_back(std::move(material));
    return made;
}

Result<Materials::Placing> Materials::read_material(const Part& part, MeshMaterial& material) {
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
        material.roughness_metal_texture = texture_of(surface, "metallicRoughnessTexture", placing);
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

MaterialTexture Materials::texture_of(const Part& material, const char* key,
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

Result<MaterialTexture> Materials::read_texture(const Part& material, const char* key,
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
        if (!offset.empty()) std::tie(placing_out.offset_u, placing_out.offset_v) = pair(offset);
        if (!scale.empty()) std::tie(placing_out.scale_u, placing_out.scale_v) = pair(scale);
    }
    TERRANE_TRY(const Part texture, document_.item("textures", index));
    MaterialTexture made;
    TERRANE_TRY(const std::optional<std::size_t> sampler, texture.index("sampler"));
    if (sampler) {
        TERRANE_TRY(const Part wraps, document_.item("samplers", *sampler));
        TERRANE_TRY(made.wrap_right, wrap_of(wraps, "wrapS"));
        TERRANE_TRY(made.wrap_up, wrap_of(wraps, "wrapT"));
    }
    TERRANE_TRY(const std::size_t source, texture.number("source"));
    TERRANE_TRY(made.image, image_of(source));
    return made;
}

Result<std::shared_ptr<const TextureImage>> Materials::image_of(std::size_t index) {
    if (const auto known = images_.find(index); known != images_.end()) return known->second;
    const auto read = [&]() -> Result<std::shared_ptr<const TextureImage>> {
        TERRANE_TRY(const Part image, document_.item("images", index));
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

Result<std::shared_ptr<const TextureImage>> Materials::decode(const Part& image) {
    if (const Json* const uri = image.find("uri"); uri != nullptr) {
        if (!uri->is_string()) return refuse(image.name + ".uri must be a text");
        TERRANE_TRY(const std::string bytes,
                    document_.read_uri(image, uri->get_ref<const std::string&>()));
        return decode_image(bytes);
    }
    TERRANE_TRY(const std::size_t index, image.number("bufferView"));
    TERRANE_TRY(const std::string_view bytes, document_.view_bytes(index, image.name));
    return decode_image(bytes);
}

}  // namespace terrane::tools::gltf
