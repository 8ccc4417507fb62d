// SPDX-License-Identifier: MIT
#pragma once

#include "conversions.h"
#include "guarded.h"
#include "renderer.h"

#include <terrane/render/upload_levels.h>
#include <terrane/scene/scene.h>

#include <pybind11/pybind11.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace terrane::python {

namespace py = pybind11;

/// The meshes and impostors of a scene's models on the device. The destructor frees them if it runs on the renderer's
/// thread; otherwise the renderer does when it is closed.
class UploadedModels {
public:
    explicit UploadedModels(std::shared_ptr<HeldRenderer> renderer)
        : renderer_(std::move(renderer)) {}
    UploadedModels(const UploadedModels&) = delete;
    UploadedModels& operator=(const UploadedModels&) = delete;
    ~UploadedModels();

    /// Uploads a model's levels: see upload_levels(). Fails: RuntimeError and ValueError as HeldRenderer::use()
    Result<void> add(ObjectLevels& levels, const MeshMaterial& material);
    /// Uploads an image of particles, unless an equal one has been uploaded. Fails as add()
    Result<ParticleImageId> add(TextureImage image);
    const HeldRenderer* renderer() const { return renderer_.get(); }

private:
    std::shared_ptr<HeldRenderer> renderer_;
    std::vector<MeshId> meshes_;
    std::vector<ImpostorId> impostors_;
    std::vector<std::pair<std::shared_ptr<const TextureImage>, ParticleImageId>> images_;
};

/// A scene and its models on the device.
struct HeldScene {
    Scene scene;
    std::unique_ptr<UploadedModels> uploaded;
};

/// A scene, as held by Python.
using SceneUse = Guarded<HeldScene>;
using SceneClass = py::class_<SceneUse, std::shared_ptr<SceneUse>>;

/// A model of a scene, as held by Python. Immutable.
struct HeldModel {
    std::shared_ptr<SceneUse> scene;
    ModelId id{};
};

/// A node of a scene, as held by Python.
struct HeldNode {
    std::shared_ptr<SceneUse> scene;
    NodeId id{};
    std::shared_ptr<EmitterNode> emitter = {};  ///< of an emitter: its content, shared by copies
};

/// The draws of a scene in a view: at the threshold that the mesh of a frame granted, or at a larger one, so that mesh
/// and objects together are within a budget. Valid until the scene is used again.
///
/// @param least_px as given to demands_of()
SceneDraws draws_within(Scene& scene, const View& view, const TerrainMesh& mesh, std::size_t budget,
                        double least_px, const std::optional<SunShadows>& shadows);

/// An image: uint8 of shape (height, width, 4), row 0 at the top. @param name of the argument, for messages
TextureImage read_image(const py::object& argument, const char* name);

/// Methods of Scene, Model and Node.
void bind_scene(SceneClass& scene, py::module_& module);
/// Methods of Scene that add models, and Model.
void bind_models(SceneClass& scene, py::module_& module);
/// Methods of Scene that add nodes, and Node.
void bind_nodes(SceneClass& scene, py::module_& module);

}  // namespace terrane::python
