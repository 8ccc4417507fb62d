// SPDX-License-Identifier: MIT
#pragma once

#include "gl/gl_object.h"
#include "objects/mipmaps.h"

#include <terrane/base/result.h>
#include <terrane/render/material.h>

#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terrane::internal {

// What a material has besides the vertices' colours: bits, each with a macro of texture.glsl.
inline constexpr unsigned kColourTexture = 1, kNormalTexture = 2;
inline constexpr unsigned kGloss = 4;         ///< roughness below 1, or metal
inline constexpr unsigned kGlossTexture = 8;  ///< with kGloss
inline constexpr unsigned kCut = 16, kEmission = 32;

/// A texture on the device, and its image, from which mipmaps that were dropped are made again.
struct StoredTexture {
    std::shared_ptr<const TextureImage> image;
    TextureUse use = TextureUse::colour;
    TextureWrap wrap_right = TextureWrap::repeat, wrap_up = TextureWrap::repeat;
    std::optional<float> cutoff;
    GlTexture texture;  ///< mipmaps from `first` on
    int first = -1;     ///< -1: none yet
    std::uint64_t last_drawn = 0;
};

/// A material on the device.
struct StoredMaterial {
    MeshMaterial numbers;   ///< without its images
    unsigned features = 0;  ///< 0: drawn by the vertices' colours
    std::shared_ptr<StoredTexture> colour, normal, roughness_metal;  ///< null: none
};

/// Texture unit of colours: beyond the units of light, water and air (`binding` in shaders/).
inline constexpr GLuint kColourUnit = 16;

/// Keeps textures on the device within a limit.
class TextureStore {
public:
    /// @param is_anisotropic whether textures are filtered anisotropically: not by software rasterisers, because
    ///                       llvmpipe of Mesa 22.3 then blurs enlarged textures
    TextureStore(std::size_t limit, bool is_anisotropic)
        : limit_(limit), is_anisotropic_(is_anisotropic) {}

    /// Checks a material and uploads its textures.
    ///
    /// Fails: invalid_argument, naming the number or texture, for one that is out of range, or whose pixels do not fit
    ///        its size; device_unavailable if OpenGL reports an error
    Result<StoredMaterial> add(const MeshMaterial& material);

    /// Uploads an image of particles. If it is opaque everywhere, it gets the opacity of a soft disc.
    ///
    /// Fails: as add()
    Result<std::shared_ptr<StoredTexture>> add_particle_image(
        std::shared_ptr<const TextureImage> image);

    /// Begins a frame; then come mark_drawn() for each material and image that it draws, and balance().
    void begin_frame() { ++frame_; }
    void mark_drawn(const StoredMaterial& material) const;
    void mark_drawn(StoredTexture& texture) const { texture.last_drawn = frame_; }
    /// Gives each texture the mipmaps that the limit allows.
    ///
    /// Fails: device_unavailable if OpenGL reports an error
    Result<void> balance();

    std::size_t bytes() const;
    /// Number of textures without their finest mipmaps.
    std::size_t reduced_count() const;

private:
    Result<std::shared_ptr<StoredTexture>> find_or_add(const MaterialTexture& texture,
                                                       TextureUse use, std::optional<float> cutoff,
                                                       const char* name);
    std::vector<std::shared_ptr<StoredTexture>> used();
    int least_first(const TextureImage& image);
    void set_first(StoredTexture& texture, int first) const;

    std::size_t limit_;
    bool is_anisotropic_;
    std::uint64_t frame_ = 0;
    int largest_side_ = 0;                              // of the device; 0: not queried yet
    std::vector<std::weak_ptr<StoredTexture>> stored_;  // in the order of creation
};

/// Text to prepend to both shaders of a program for a material: macros.
std::string material_macros(unsigned features);

/// A program that draws a material, and its uniforms.
struct MaterialProgram {
    GlProgram program;
    GLint emission = -1, finish = -1;
    GLint centre = -1, axes = -1;  ///< of impostor_bake.vert

    /// Makes the program current and binds a material: numbers and textures.
    void use(const StoredMaterial& material) const;
};

/// Programs for materials, each made when it is first needed.
class MaterialPrograms {
public:
    /// @param mask     features that matter to these programs
    /// @param fragment without texture.glsl
    MaterialPrograms(std::string name, unsigned mask, std::string vertex, std::string before,
                     std::string fragment)
        : name_(std::move(name)),
          mask_(mask),
          vertex_(std::move(vertex)),
          before_(std::move(before)),
          fragment_(std::move(fragment)) {}

    /// Fails: device_unavailable if the program does not compile
    Result<void> make(unsigned features);
    /// REQUIRES: make() has succeeded for these features
    const MaterialProgram& of(unsigned features) const { return made_.at(features & mask_); }

private:
    std::string name_;
    unsigned mask_;
    std::string vertex_, before_, fragment_;
    std::map<unsigned, MaterialProgram> made_;
};

}  // namespace terrane::internal
