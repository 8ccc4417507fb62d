// SPDX-License-Identifier: MIT
#pragma once

#include "program/json_values.h"

#include <terrane/render/material.h>
#include <terrane/scene/scene_nodes.h>
#include <terrane/terrain/triangle_mesh.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace terrane::tools {

/// A mesh of a node: index of SceneNodes::meshes.
struct MeshOfNode {
    std::size_t mesh = 0;
};

/// A node of a scene.
struct SceneNode {
    std::string path;                        ///< in the file, for messages: "nodes[2].children[0]"
    std::optional<std::size_t> parent = {};  ///< index of SceneNodes::nodes; none: world or body
    NodePlace place;
    bool is_on_ground = false;  ///< whether z is a height above the ground; only without a parent
    std::variant<GroupNode, MeshOfNode, SwitchNode, BillboardNode, EmitterNode> content = {};
    /// Of an emitter: index of SceneNodes::images; none: soft discs.
    std::optional<std::size_t> image = {};
};

/// `nodes` of a scene, or the nodes of its bodies.
struct SceneNodes {
    std::vector<TriangleMesh> meshes;  ///< with normals
    /// [meshes] each indexed by TriangleMesh::materials; empty: plain, one-sided.
    std::vector<std::vector<MeshMaterial>> materials;
    std::vector<std::vector<TriangleMesh>> coarser;  ///< [meshes] see SceneObjects::coarser
    std::vector<std::string> files;  ///< [meshes] paths; of a primitive the path of its node
    std::vector<std::shared_ptr<const TextureImage>> images;  ///< of particles
    std::vector<SceneNode> nodes;                             ///< each with its subtree behind it
};

/// Parses `nodes` of a scene: a list of nodes, each with `position`, `rotation`, `scale`, `on_ground`, `children` and
/// one content at most: `mesh` with `levels` and `crease_deg`; `sphere`, `box`, `capsule` or `cylinder` with `colour`;
/// `sprite`; `switch`; `billboard`; `emitter`. A sprite becomes a billboard with a child that has the picture. Files
/// are read here, meshes once for each crease angle, images once. Errors begin with the path of the key:
/// "nodes[2].children[0].switch.limits must be".
///
/// @param folder base of relative paths
Parsed<SceneNodes> read_nodes(const nlohmann::ordered_json& list, const std::string& folder);

/// Parses `node` of the bodies of a scene: a node as of read_nodes() in the frame of its body, at its origin if
/// `position` is absent, and not on the ground. Errors begin with the path of the key: "bodies[2].node.children[0]".
///
/// @param bodies    objects
/// @param roots_out [bodies] index of the node in SceneNodes::nodes; none: the body has no node
Parsed<SceneNodes> read_body_nodes(const nlohmann::ordered_json& bodies, const std::string& folder,
                                   std::vector<std::optional<std::size_t>>& roots_out);

}  // namespace terrane::tools
