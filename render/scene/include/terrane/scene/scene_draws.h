// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/triangle_mesh.h>

#include <array>
#include <cstdint>
#include <span>

namespace terrane {

/// Identifies a mesh of the renderer that created it.
enum class MeshId : std::uint32_t {};
/// Identifies an impostor of the renderer that created it.
enum class ImpostorId : std::uint32_t {};
/// Identifies an image of particles of the renderer that created it.
enum class ParticleImageId : std::uint32_t {
    soft_disc = 0,  ///< no image
};

/// A level of detail of a mesh: triangles that use the mesh's vertices.
struct MeshLevel {
    std::span<const TriangleMesh::Triangle> triangles = {};  ///< indices of the mesh's vertices
    /// For each vertex of the triangles, by its index, the vertex of the next level that it moves to: see
    /// ProgressiveMesh::geomorph_targets(). Empty: the level does not morph.
    std::span<const std::uint32_t> morph_targets = {};
};

/// Transform, coverage and tint of an instance, in the layout of the GPU's buffer.
struct ObjectInstance {
    std::array<float, 3> offset_eye{};  ///< object's origin minus the eye, world axes, metres
    float scale = 1.0f;                 ///< > 0, of all three axes
    /// Unit quaternion x, y, z, w: rotation from the object's frame to world axes.
    std::array<float, 4> rotation{0.0f, 0.0f, 0.0f, 1.0f};
    /// Share of the instance's pixels that is drawn, for cross-fades, -1 to 2. Each pixel has a threshold in [0, 1).
    /// 0 to 1: draws pixels with a threshold below coverage. Negative: draws pixels with a threshold of at least
    /// 1 + coverage, so that c and c - 1 together draw every pixel once. 1 to 2: draws every pixel; the vertices of a
    /// level that morphs are interpolated towards the next level with weight coverage - 1.
    float coverage = 1.0f;
    std::array<float, 3> tint{1.0f, 1.0f, 1.0f};  ///< factor of the colours
};
static_assert(sizeof(ObjectInstance) == 48);

/// Instances of one level of detail of a mesh.
struct MeshDraw {
    MeshId mesh{};                     ///< of the renderer
    std::uint32_t level = 0;           ///< of the mesh's levels of detail
    std::uint32_t first_instance = 0;  ///< in SceneDraws::instances
    std::uint32_t instance_count = 0;  ///< instances of this draw
};

/// Instances of an impostor: two triangles each.
struct ImpostorDraw {
    ImpostorId impostor{};             ///< of the renderer
    std::uint32_t first_instance = 0;  ///< in SceneDraws::instances
    std::uint32_t instance_count = 0;  ///< instances of this draw
};

/// One object with its own triangles in this frame, for continuous levels of detail and geomorphs.
struct StreamedDraw {
    MeshId mesh{};  ///< source of the vertices' attributes
    /// [vertices of the mesh] positions in the object's frame, metres; empty: the mesh's own.
    std::span<const Eigen::Vector3f> positions = {};
    std::span<const TriangleMesh::Triangle> triangles = {};  ///< indices of the mesh's vertices
    std::uint32_t instance = 0;                              ///< in SceneDraws::instances
};

/// A soft disc, or an image, that faces the viewer, for smoke or dust: two triangles.
struct Particle {
    std::array<float, 3> offset_eye{};  ///< centre minus the eye, world axes, metres
    float radius = 1.0f;                ///< metres; half the side of an image
    /// Red, green, blue with display gamma, and opacity at the centre; they multiply colour and opacity of an image.
    std::array<float, 4> colour{1.0f, 1.0f, 1.0f, 1.0f};
    float turn = 0.0f;  ///< rotation of the image in the picture, radians, counter-clockwise
    ParticleImageId image = ParticleImageId::soft_disc;  ///< of the renderer
};
static_assert(sizeof(Particle) == 40);

/// Instances that are on a device: see Scene::set_device().
struct DeviceInstances;

/// The draw list of a scene for one frame: spans of the scene's buffers.
struct SceneDraws {
    std::span<const ObjectInstance> instances = {};  ///< referred to by the draws
    std::span<const MeshDraw> meshes = {};           ///< levels of detail
    std::span<const StreamedDraw> streamed = {};     ///< objects with triangles of their own
    std::span<const ImpostorDraw> impostors = {};    ///< billboards
    std::span<const Particle> particles = {};        ///< sorted from far to near
    /// Shadow casters out of view: drawn into shadow maps only, ignored without shadows.
    std::span<const MeshDraw> caster_meshes = {};
    std::span<const ImpostorDraw> caster_impostors = {};  ///< billboards among the casters
    /// Not null: further draws, whose first_instance counts in these instances.
    const DeviceInstances* device = nullptr;
    std::span<const MeshDraw> device_meshes = {};         ///< levels of detail on the device
    std::span<const ImpostorDraw> device_impostors = {};  ///< billboards on the device
};

}  // namespace terrane
