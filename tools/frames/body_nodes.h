// SPDX-License-Identifier: MIT
#pragma once

#include "frames/object_field.h"
#include "scene/scene_bodies.h"
#include "scene/vehicle_forms.h"

#include <terrane/collision/vehicle.h>
#include <terrane/collision/world.h>
#include <terrane/scene/scene.h>

#include <array>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace terrane::tools {

/// Factor of the colours of a node.
using Tint = std::array<float, 3>;

/// Shows bodies, a vehicle and a character as nodes of the scene of an ObjectField, so that they share the triangle
/// budget, culling and shadows of its objects. Call show() for each frame before it is made.
class BodyNodes {
public:
    /// @param field    must outlive the nodes
    /// @param renderer receives the meshes, and must outlive the nodes; null if no frames are drawn
    /// @param proxies  whether bodies are shown as their collision shapes, also those with a mesh of their own
    BodyNodes(ObjectField& field, TerrainRenderer* renderer, bool proxies)
        : field_(&field), renderer_(renderer), shows_proxies_(proxies) {}

    /// Makes all bodies of a shape look like a mesh file.
    ///
    /// @param scale multiplies the file's points
    void set_mesh(const Shape& shape, const std::string& path, double scale = 1.0);
    /// The same for those bodies of a scene that have a mesh.
    void set_meshes(std::span<const PlacedBody> bodies);
    /// Makes a body look like the node of a body of a scene; no effect if that has none.
    ///
    /// @param body as for show(), before the first call for this body
    void set_node(std::size_t body, const PlacedBody& of_scene);

    /// Places the node of a body at its pose; sleeping bodies are darker, static ones grey. Hides a body that has left
    /// the world or was removed.
    ///
    /// @param body  identifies the body in later calls; its shape must stay the same
    ///
    /// Fails: as make_shape_mesh(), read_model(), make_object_levels(), TerrainRenderer::add_mesh(),
    ///        ObjectField::add_body_models() and ObjectField::add_subtree()
    Result<void> show(std::size_t body, const Shape& shape, const BodyState& state,
                      const Tint& tint = {1.0f, 1.0f, 1.0f});

    /// Hides a body, if it is shown.
    void remove(std::size_t body);
    /// One more than the largest body that is shown; 0 without bodies.
    std::size_t body_end() const { return bodies_.empty() ? 0 : bodies_.rbegin()->first + 1; }

    /// Shows the vehicle, with exhaust and dust. Fails as show()
    Result<void> show(const VehicleSettings& settings, const VehicleState& state);
    /// Hides the vehicle, if there is one.
    void remove_vehicle();

    /// Shows the character in a step of its walk: see character_part_poses(). Fails as show()
    Result<void> show(const CharacterSettings& settings, const Pose& pose_world, double walked,
                      double speed);
    /// Hides the character, if there is one.
    void remove_character();

private:
    /// A node that is moved, with the models in its subtree.
    struct Part {
        NodeId node{};
        Tint tint{};
        std::vector<std::pair<NodeId, ModelId>> models;
    };
    /// The look of a body: see PlacedBody::node.
    struct NodeOfBody {
        std::shared_ptr<const SceneNodes> nodes;
        std::size_t first = 0;
    };
    struct Form {
        Shape shape;
        std::string mesh_file = {};         // "": the look of the shape
        double scale = 1.0;                 // of the mesh
        std::optional<ModelId> model = {};  // none: not shown yet
    };
    /// The models of a vehicle, which stay when it is removed.
    struct VehicleLook {
        VehicleSettings settings;
        ModelId body{}, wheel{};
        std::optional<ModelId> link = {}, sprocket = {};
        std::optional<Eigen::Vector3d> exhaust = {};  // place on the body; none for proxies
        Eigen::Vector3d exhaust_direction = Eigen::Vector3d::Zero();
    };
    struct Vehicle {
        const VehicleLook* look = nullptr;
        Part body;
        std::vector<Part> wheels, links, sprockets;
        std::optional<NodeId> exhaust;  // none for proxies
        Eigen::Vector3d exhaust_direction = Eigen::Vector3d::Zero();
        std::vector<NodeId> dust;  // [wheels]
    };

    Result<MeshModel> look_of(const Form& form) const;
    Result<ModelId> model_of(const Shape& shape);
    Result<Part> add(ModelId model);
    Result<Part> add(const NodeOfBody& look);
    Result<void> add(ModelId model, std::size_t count, std::vector<Part>& parts_out);
    void remove(std::vector<Part>& parts);
    Result<void> place(std::vector<Part>& parts, std::span<const Pose> poses_world);
    Result<void> place(Part& part, const Pose& pose_world, const Tint& tint);
    Result<const VehicleLook*> look_of(const VehicleSettings& settings);
    Result<void> add_character(const CharacterSettings& settings);
    Result<void> add_vehicle(const VehicleSettings& settings, const VehicleState& state);
    Result<void> show_smoke(const VehicleSettings& settings, const VehicleState& state);

    ObjectField* field_;
    TerrainRenderer* renderer_;
    bool shows_proxies_;
    std::vector<Form> forms_;  // of different shapes
    std::map<std::size_t, NodeOfBody> nodes_of_bodies_;
    std::map<std::shared_ptr<const SceneNodes>, NodeModels> node_models_;
    std::map<std::size_t, Part> bodies_;
    std::vector<std::unique_ptr<const VehicleLook>> vehicle_looks_;
    std::optional<Vehicle> vehicle_;
    std::vector<ModelId> character_models_;
    std::vector<Part> character_;
};

}  // namespace terrane::tools
