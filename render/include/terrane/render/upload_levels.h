// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/render/terrain_renderer.h>
#include <terrane/scene/object_levels.h>

#include <span>

namespace terrane {

/// Uploads the levels of a model and, if it has one, makes its impostor; sets their ids in `levels.model`, which is
/// then ready for Scene::add_model().
///
/// @param materials indexed by TriangleMesh::materials; empty: plain, one-sided
///
/// Fails: as TerrainRenderer::add_mesh() and TerrainRenderer::add_impostor(); nothing is uploaded then
Result<void> upload_levels(ObjectLevels& levels, std::span<const MeshMaterial> materials,
                           TerrainRenderer& renderer);

}  // namespace terrane
