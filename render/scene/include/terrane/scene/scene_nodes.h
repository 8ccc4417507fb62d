// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/math.h>
#include <terrane/scene/scene_draws.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <variant>
#include <vector>

namespace terrane {

/// Identifies a node of a Scene. Never reused.
enum class NodeId : std::uint64_t {};
/// Names a model of a Scene.
enum class ModelId : std::uint32_t {};

/// A node that only places its children.
struct GroupNode {};

/// A model at the node's place. It is drawn at the level of detail that the frame's threshold asks for.
struct ModelNode {
    ModelId model{};                              ///< of the scene
    std::array<float, 3> tint{1.0f, 1.0f, 1.0f};  ///< factor of its colours
};

/// A placement of a model: position, scale and rotation in a node's frame.
struct PlacedObject {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of the object's origin, metres
    float scale = 1.0f;                                  ///< 1e-6 to 1e6
    /// Unit quaternion x, y, z, w: rotation from the object's frame to the node's.
    std::array<float, 4> rotation{0.0f, 0.0f, 0.0f, 1.0f};
    std::array<float, 3> tint{1.0f, 1.0f, 1.0f};  ///< factor of its colours
};

/// Many placements of one model, such as the trees of a chunk: culled by clusters of neighbours. Allowed below groups
/// and models only.
///
/// Memory: about 130 bytes an object
struct InstancesNode {
    ModelId model{};                    ///< of the scene
    std::vector<PlacedObject> objects;  ///< in the node's frame
};

/// Draws one of its children, chosen by distance or screen error, or two during a cross-fade. The children are levels
/// of detail, finest first, in the order in which they were added. For levels of one object that share the triangle
/// budget, see ObjectModel::levels.
struct SwitchNode {
    /// Criterion between two levels.
    enum class By : std::uint8_t {
        distance,  ///< limits are metres from the eye to the bounding sphere of all levels
        centre,    ///< limits are metres from the eye to the centre of that sphere
        error,  ///< limit i is the error of level i + 1, metres: that level is drawn if it is within the least threshold
                ///< of the frame
    };
    By by = By::error;  ///< quantity compared with the limits
    /// [levels] Limit i separates level i from level i + 1. Beyond the last limit the node draws nothing; infinity: the
    /// last level is always drawn. Positive; each at least fade_ratio times the one before.
    std::vector<double> limits;
    /// A level changes only after its limit is passed by this ratio, 1 to 2, so that levels do not alternate near a
    /// limit.
    double hysteresis = 1.0;
    /// Levels cross-fade while the limit is passed by up to this ratio, 1 to 2; 1: they switch at once. Cannot be
    /// combined with hysteresis.
    double fade_ratio = 1.0;
};

/// Turns its children towards the viewer.
struct BillboardNode {
    /// Degrees of freedom of the rotation.
    enum class Axis : std::uint8_t {
        screen,  ///< x points to the picture's right and y to its top: for smoke
        up,  ///< about its z axis only, so that x points towards the eye, whatever the viewer's up: for trees
    };
    Axis axis = Axis::screen;  ///< degrees of freedom
};

/// Soft discs, in the node's frame.
struct ParticlesNode {
    /// A disc.
    struct Disc {
        Eigen::Vector3d centre = Eigen::Vector3d::Zero();     ///< metres
        double radius = 1.0;                                  ///< metres, > 0
        std::array<float, 4> colour{1.0f, 1.0f, 1.0f, 1.0f};  ///< as Particle::colour
    };
    std::vector<Disc> discs;  ///< to move them, call set_content()
};

/// Emits particles, as smoke, dust or spray. A particle is a function of the seed, its number and the time alone
/// (Scene::set_time()), so that a seek shows the same smoke; for an emitter that moves, of its places since the
/// particle's birth too. Allowed below groups and models only. Not part of bounds and picking.
struct EmitterNode {
    double rate = 10.0;                ///< particles a second, 0 to 1e5
    std::array<double, 2> life{2, 4};  ///< least and most life of a particle, seconds, 1e-3 to 1e3
    double source_radius =
        0.1;  ///< radius of the ball of births in the node's frame, metres, 0 to 1e4
    Eigen::Vector3d velocity =
        Eigen::Vector3d::UnitZ();  ///< at birth, in the node's frame, m/s, within 1e4
    double velocity_spread =
        0.3;  ///< radius of the ball of velocities that are added at birth, m/s, 0 to 1e4
    Eigen::Vector3d wind =
        Eigen::Vector3d::Zero();  ///< velocity of the air, world axes, m/s, within 1e4
    double drag_time =
        1.0;  ///< seconds after which a particle has a quarter of its speed in the air, 1e-3 to 1e9
    /// Of gravity and buoyancy, world axes, m/s^2, within 1e4. Drag limits the speed to half a drag_time of it.
    Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
    std::array<double, 2> radius{0.2,
                                 1.0};  ///< at birth and at the end of life, metres, 1e-3 to 1e4
    /// At birth and at the end of life, as Particle::colour, 0 to 1. Particles also appear over a tenth of their life.
    std::array<std::array<float, 4>, 2> colours{
        {{0.7f, 0.7f, 0.7f, 0.5f}, {0.8f, 0.8f, 0.8f, 0.0f}}};
    /// Image of the particles, of the renderer that draws the scene (TerrainRenderer::add_particle_image()). Each
    /// particle shows it turned by a random angle of its own. soft_disc: they are soft discs.
    ParticleImageId image = ParticleImageId::soft_disc;
    /// Factor of the opacity of the particles that are born from now on, 0 to 1, for dust that depends on the speed of
    /// a wheel.
    float strength = 1.0f;
    std::size_t most_particles = 1000;  ///< the youngest ones are drawn, 1 to 65536
    std::uint64_t seed = 0;             ///< different seeds emit independently
    /// Time of the first particle, seconds; -infinity: smoke is there from the first frame on.
    double start = -std::numeric_limits<double>::infinity();
};

/// Type of a node, with its data.
using NodeContent = std::variant<GroupNode, ModelNode, InstancesNode, SwitchNode, BillboardNode,
                                 ParticlesNode, EmitterNode>;

/// Transform from a node's frame to its parent's.
struct NodePlace {
    Pose parent_from_node;  ///< rotation and position
    double scale = 1.0;     ///< 1e-6 to 1e6
};

}  // namespace terrane
