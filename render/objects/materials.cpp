// SPDX-License-Identifier: MIT
#include "objects/materials.h"

#include "base/settings_check.h"
#include "gl/shader.h"

#include <terrane/base/text.h>

#include <algorithm>
#include <array>
#include <utility>

namespace terrane::internal {
namespace {

// Texture units of texture.glsl, after kColourUnit.
constexpr GLuint kNormalUnit = 17, kRoughnessMetalUnit = 18;
// Most samples along the long axis of a pixel's footprint.
constexpr GLfloat kAnisotropy = 8.0f;

Result<void> check(const MeshMaterial& material) {
    TERRANE_TRY(check_range("normal_scale", material.normal_scale, -1e3f, 1e3f));
    TERRANE_TRY(check_range("roughness", material.roughness, 0.0f, 1.0f));
    TERRANE_TRY(check_range("metal", material.metal, 0.0f, 1.0f));
    for (const float part : material.emission) {
        TERRANE_TRY(check_range("emission", part, 0.0f, 1e6f));
    }
    return check_range("alpha_cutoff", material.alpha_cutoff.value_or(0.0f), 0.0f, 1.0f);
}

Result<void> check(const TextureImage& image, const char* name) {
    const auto is_side = [](int side) { return side >= 1 && side <= kLargestTextureSide; };
    if (is_side(image.width) && is_side(image.height) &&
        image.rgba.size() ==
            4 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)) {
        return {};
    }
    return fail(ErrorCode::invalid_argument,
                std::string(name) + " must have sides of 1 to " + number_text(kLargestTextureSide) +
                    " pixels and 4 bytes a pixel, got " + number_text(image.width) + " x " +
                    number_text(image.height) + " pixels and " + number_text(image.rgba.size()) +
                    " bytes");
}

GLint wrap_of(TextureWrap wrap) {
    switch (wrap) {
        case TextureWrap::mirror:
            return GL_MIRRORED_REPEAT;
        case TextureWrap::clamp:
            return GL_CLAMP_TO_EDGE;
        case TextureWrap::repeat:
            break;
    }
    return GL_REPEAT;
}

// Rows from the bottom, as texture coordinates count them.
std::vector<std::uint8_t> from_bottom(const TextureImage& image) {
    const std::size_t row = 4 * static_cast<std::size_t>(image.width);
    std::vector<std::uint8_t> made;
    made.reserve(image.rgba.size());
    for (std::size_t end = image.rgba.size(); end > 0; end -= row) {
        const auto at = image.rgba.begin() + static_cast<std::ptrdiff_t>(end - row);
        made.insert(made.end(), at, at + static_cast<std::ptrdiff_t>(row));
    }
    return made;
}

// The image itself, unless it is opaque everywhere: particles would be squares.
std::shared_ptr<const TextureImage> with_opacity(std::shared_ptr<const TextureImage> image) {
    for (std::size_t i = 3; i < image->rgba.size(); i += 4) {
        if (image->rgba[i] != 255) return image;
    }
    TextureImage disc = *image;
    std::size_t place = 3;
    for (int row = 0; row < disc.height; ++row) {
        const double y = (2.0 * row + 1.0) / disc.height - 1.0;
        for (int column = 0; column < disc.width; ++column) {
            const double x = (2.0 * column + 1.0) / disc.width - 1.0;
            const double opacity = std::max(1.0 - x * x - y * y, 0.0);
            disc.rgba[place] = static_cast<std::uint8_t>(255.0 * opacity + 0.5);
            place += 4;
        }
    }
    return std::make_shared<const TextureImage>(std::move(disc));
}

}  // namespace

Result<StoredMaterial> TextureStore::add(const MeshMaterial& material) {
    TERRANE_TRY(check(material));
    StoredMaterial made;
    made.numbers = material;
    made.numbers.colour_texture = made.numbers.normal_texture =
        made.numbers.roughness_metal_texture = {};
    const bool is_cut = material.alpha_cutoff.value_or(0.0f) > 0.0f;
    TERRANE_TRY(made.colour,
                find_or_add(material.colour_texture, TextureUse::colour,
                            is_cut ? material.alpha_cutoff : std::nullopt, "colour_texture"));
    TERRANE_TRY(made.normal,
                find_or_add(material.normal_texture, TextureUse::data, {}, "normal_texture"));
    TERRANE_TRY(made.roughness_metal, find_or_add(material.roughness_metal_texture,
                                                  TextureUse::data, {}, "roughness_metal_texture"));
    const auto& [red, green, blue] = material.emission;
    const bool has_emission = red > 0.0f || green > 0.0f || blue > 0.0f;
    if (made.colour) made.features |= kColourTexture;
    if (made.normal) made.features |= kNormalTexture;
    if (made.roughness_metal) made.features |= kGlossTexture;
    if (is_cut) made.features |= kCut;
    if (has_emission) made.features |= kEmission;
    // roughness and metal alone do not make a material that is drawn by a program of its own
    if (made.features != 0 &&
        (made.roughness_metal || material.roughness < 1.0f || material.metal > 0.0f))
        made.features |= kGloss;
    TERRANE_TRY(balance());
    return made;
}

Result<std::shared_ptr<StoredTexture>> TextureStore::add_particle_image(
    std::shared_ptr<const TextureImage> image) {
    if (image == nullptr)
        return fail(ErrorCode::invalid_argument, "an image of particles must not be null");
    TERRANE_TRY(check(*image, "image"));
    const MaterialTexture texture = {with_opacity(std::move(image)), TextureWrap::clamp,
                                     TextureWrap::clamp};
    TERRANE_TRY(auto made, find_or_add(texture, TextureUse::blended, {}, "image"));
    TERRANE_TRY(balance());
    return made;
}

void TextureStore::mark_drawn(const StoredMaterial& material) const {
    for (const auto& texture : {material.colour, material.normal, material.roughness_metal}) {
        if (texture) texture->last_drawn = frame_;
    }
}

Result<void> TextureStore::balance() {
    std::vector<TextureDemand> demands;
    const std::vector<std::shared_ptr<StoredTexture>> textures = used();
    for (const auto& texture : textures) {
        demands.push_back({.width = texture->image->width,
                           .height = texture->image->height,
                           .least_first = least_first(*texture->image),
                           .last_drawn = texture->last_drawn});
    }
    const std::vector<int> first = choose_first_mipmaps(demands, limit_);
    bool is_changed = false;
    // textures that become smaller come first, so that the limit holds in between
    for (const bool grows : {false, true}) {
        for (std::size_t i = 0; i < textures.size(); ++i) {
            StoredTexture& texture = *textures[i];
            const bool is_larger = texture.first < 0 || first[i] < texture.first;
            if (texture.first == first[i] || is_larger != grows) continue;
            set_first(texture, first[i]);
            is_changed = true;
        }
    }
    if (!is_changed) return {};
    return check_gl("keep textures of objects");
}

std::size_t TextureStore::bytes() const {
    std::size_t bytes = 0;
    for (const auto& weak : stored_) {
        if (const auto texture = weak.lock(); texture && texture->first >= 0)
            bytes += mipmap_bytes(texture->image->width, texture->image->height, texture->first);
    }
    return bytes;
}

std::size_t TextureStore::reduced_count() const {
    return static_cast<std::size_t>(std::ranges::count_if(stored_, [](const auto& weak) {
        const auto texture = weak.lock();
        return texture && texture->first > 0;
    }));
}

Result<std::shared_ptr<StoredTexture>> TextureStore::find_or_add(const MaterialTexture& texture,
                                                                 TextureUse use,
                                                                 std::optional<float> cutoff,
                                                                 const char* name) {
    if (texture.image == nullptr) return std::shared_ptr<StoredTexture>();
    TERRANE_TRY(check(*texture.image, name));
    for (const auto& each : used()) {
        if (each->image == texture.image && each->use == use && each->cutoff == cutoff &&
            each->wrap_right == texture.wrap_right && each->wrap_up == texture.wrap_up) {
            return each;
        }
    }
    auto made = std::make_shared<StoredTexture>();
    made->image = texture.image;
    made->use = use;
    made->wrap_right = texture.wrap_right;
    made->wrap_up = texture.wrap_up;
    made->cutoff = cutoff;
    made->last_drawn = frame_;  // likely to be drawn next
    stored_.push_back(made);
    return made;
}

// The textures of meshes that still exist, in the order of creation.
std::vector<std::shared_ptr<StoredTexture>> TextureStore::used() {
    std::vector<std::shared_ptr<StoredTexture>> textures;
    for (const auto& weak : stored_) {
        if (auto texture = weak.lock()) textures.push_back(std::move(texture));
    }
    if (textures.size() != stored_.size()) stored_.assign(textures.begin(), textures.end());
    return textures;
}

int TextureStore::least_first(const TextureImage& image) {
    if (largest_side_ == 0) glGetIntegerv(GL_MAX_TEXTURE_SIZE, &largest_side_);
    int first = 0;
    while (std::max(image.width, image.height) >> first > largest_side_) ++first;
    return first;
}

void TextureStore::set_first(StoredTexture& texture, int first) const {
    const TextureImage& image = *texture.image;
    const int count = mipmap_count(image.width, image.height) - first;
    const auto side = [&](int whole, int level) { return std::max(whole >> level, 1); };
    GlTexture made = make_texture_2d();
    const GLuint name = made.name();
    glTextureStorage2D(name, count, texture.use != TextureUse::data ? GL_SRGB8_ALPHA8 : GL_RGBA8,
                       side(image.width, first), side(image.height, first));
    glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_WRAP_S, wrap_of(texture.wrap_right));
    glTextureParameteri(name, GL_TEXTURE_WRAP_T, wrap_of(texture.wrap_up));
    if (is_anisotropic_ && (epoxy_has_gl_extension("GL_EXT_texture_filter_anisotropic") ||
                            epoxy_has_gl_extension("GL_ARB_texture_filter_anisotropic"))) {
        GLfloat most = 1.0f;
        glGetFloatv(GL_MAX_TEXTURE_MAX_ANISOTROPY, &most);
        glTextureParameterf(name, GL_TEXTURE_MAX_ANISOTROPY, std::min(kAnisotropy, most));
    }
    if (texture.first >= 0 && first > texture.first) {
        for (int level = 0; level < count; ++level) {
            glCopyImageSubData(texture.texture.name(), GL_TEXTURE_2D, first - texture.first + level,
                               0, 0, 0, name, GL_TEXTURE_2D, level, 0, 0, 0,
                               side(image.width, first + level), side(image.height, first + level),
                               1);
        }
    } else {
        const std::vector<TextureImage> mipmaps =
            make_mipmaps(image, texture.use, texture.cutoff, first);
        for (int level = 0; level < count; ++level) {
            const TextureImage& mipmap = mipmaps[static_cast<std::size_t>(level)];
            glTextureSubImage2D(name, level, 0, 0, mipmap.width, mipmap.height, GL_RGBA,
                                GL_UNSIGNED_BYTE, from_bottom(mipmap).data());
        }
    }
    texture.texture = std::move(made);
    texture.first = first;
}

std::string material_macros(unsigned features) {
    std::string text = "#define TEXTURED\n";
    constexpr std::array<std::pair<unsigned, const char*>, 6> kMacros = {
        {{kColourTexture, "COLOUR_TEXTURE"},
         {kNormalTexture, "NORMAL_TEXTURE"},
         {kGloss, "GLOSS"},
         {kGlossTexture, "GLOSS_TEXTURE"},
         {kCut, "CUT"},
         {kEmission, "EMISSION"}}};
    for (const auto& [feature, macro] : kMacros) {
        if ((features & feature) != 0) text += std::string("#define ") + macro + "\n";
    }
    return text;
}

void MaterialProgram::use(const StoredMaterial& material) const {
    glUseProgram(program.name());
    const auto& [red, green, blue] = material.numbers.emission;
    glUniform3f(emission, red, green, blue);
    glUniform4f(finish, material.numbers.roughness, material.numbers.metal,
                material.numbers.normal_scale, material.numbers.alpha_cutoff.value_or(0.0f));
    if (material.colour) glBindTextureUnit(kColourUnit, material.colour->texture.name());
    if (material.normal) glBindTextureUnit(kNormalUnit, material.normal->texture.name());
    if (material.roughness_metal)
        glBindTextureUnit(kRoughnessMetalUnit, material.roughness_metal->texture.name());
}

Result<void> MaterialPrograms::make(unsigned features) {
    const unsigned own = features & mask_;
    if (made_.contains(own)) return {};
    const std::string macros = material_macros(own);
    TERRANE_TRY(GlProgram program,
                make_program(name_, macros + vertex_,
                             macros + before_ + std::string(texture_glsl) + fragment_));
    MaterialProgram made;
    made.emission = glGetUniformLocation(program.name(), "emission");
    made.finish = glGetUniformLocation(program.name(), "finish");
    made.centre = glGetUniformLocation(program.name(), "centre");
    made.axes = glGetUniformLocation(program.name(), "axes");
    made.program = std::move(program);
    made_.emplace(own, std::move(made));
    return {};
}

}  // namespace terrane::internal
