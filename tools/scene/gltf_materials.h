// SPDX-License-Identifier: MIT
#pragma once

#include "scene/gltf_document.h"
#include "scene/mesh_files.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

namespace terrane::tools::gltf {

/// Reads the materials that primitives use, with their textures and images.
class Materials {
public:
    /// @param document, mesh_out must outlive this object
    Materials(Document& document, FileMesh& mesh_out) : document_(document), mesh_(mesh_out) {}

    /// Adds the material of a primitive's points, and their texture coordinates, to the mesh, which has their
    /// positions: sections 3.7.2 and 3.9. Textures that cannot be read are noted in the mesh.
    ///
    /// @param count of the primitive's points, the last ones of the mesh
    Result<void> add(const Part& primitive, const Part& attributes, std::size_t count);

private:
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

    /// Notes why a texture is not drawn.
    void leave_out(const std::string& texture, const std::string& why);
    /// @param index of the material; absent: the default one
    Result<Surface> make_surface(std::optional<std::size_t> index);
    Result<Placing> read_material(const Part& part, MeshMaterial& material);
    /// The texture at a key of a material; none if there is no such key, or if it cannot be read: then noted.
    ///
    /// @param placing_out that of the material's first texture, which all of its textures must have
    MaterialTexture texture_of(const Part& material, const char* key,
                               std::optional<Placing>& placing_out);
    Result<MaterialTexture> read_texture(const Part& material, const char* key,
                                         Placing& placing_out);
    /// An image, decoded when it is first needed. The message names its file.
    Result<std::shared_ptr<const TextureImage>> image_of(std::size_t index);
    Result<std::shared_ptr<const TextureImage>> decode(const Part& image);

    Document& document_;
    FileMesh& mesh_;
    std::map<std::optional<std::size_t>, Surface> surfaces_;  // of those materials that are used
    std::map<std::size_t, Result<std::shared_ptr<const TextureImage>>> images_;
};

}  // namespace terrane::tools::gltf
