// SPDX-License-Identifier: MIT
#include <terrane/render/upload_levels.h>

namespace terrane {

Result<void> upload_levels(ObjectLevels& levels, std::span<const MeshMaterial> materials,
                           TerrainRenderer& renderer) {
    const MeshMaterial plain;
    if (materials.empty()) materials = {&plain, 1};
    TERRANE_TRY(levels.model.mesh, renderer.add_mesh(levels.mesh, levels.mesh_levels(), materials));
    if (!levels.model.impostor) return {};
    const Result<ImpostorId> impostor = renderer.add_impostor(levels.model.mesh);
    if (!impostor) {
        renderer.remove_mesh(levels.model.mesh);
        return tl::unexpected(impostor.error());
    }
    levels.model.impostor = *impostor;
    return {};
}

}  // namespace terrane
