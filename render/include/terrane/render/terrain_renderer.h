// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/render/offscreen.h>
#include <terrane/scene/culling.h>
#include <terrane/scene/scene_draws.h>
#include <terrane/terrain/imagery_source.h>
#include <terrane/terrain/triangle_mesh.h>
#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace terrane {

/// A level of detail of a mesh: triangles over its vertices.
struct MeshLevel {
    std::span<const TriangleMesh::Triangle> triangles = {};  ///< indices of the mesh's vertices
    /// [vertices that the triangles have] the vertex of the next level that each one moves to, as
    /// ProgressiveMesh::geomorph_targets() says; empty: the level does not morph.
    std::span<const std::uint32_t> morph_targets = {};
};

/// Material of an object's mesh.
struct MeshMaterial {
    /// Whether back faces are drawn too, as leaves need; their normals are turned to the eye.
    bool is_two_sided = false;
    /// Red, green and blue with display gamma, 0 to 255, where the mesh has no colours.
    std::array<std::uint8_t, 3> colour{160, 160, 160};
};

/// Settings of an impostor: views of an object that are rendered in advance.
struct ImpostorSettings {
    /// Views around the object's z axis, 4 to 64. More views move less where the viewer goes around it.
    int views_around = 16;
    /// Views from level to vertically above, 1 to 16. 1: a ring, for trees that are seen from the side: the billboard
    /// turns about the object's z axis only. More: a hemisphere; from below, the level views are used.
    int views_above = 4;
    int texels =
        96;  ///< along the side of a view, 8 to 512; memory: 10.7 bytes a texel, with mipmaps
};

/// A display colour, 0 to 1.
struct Colour {
    float red = 0.0f, green = 0.0f, blue = 0.0f;  ///< with display gamma
};

/// Light, haze, tints and quality of TerrainRenderer.
struct RendererSettings {
    Eigen::Vector3d sun_direction = Eigen::Vector3d(-0.5, 0.4, 0.77);  ///< towards the sun
    double haze_distance =
        60'000.0;  ///< metres at which haze absorbs two thirds of the light; infinity: no haze
    bool wireframe = false;  ///< draws the edges of the triangles over the ground
    /// Samples per pixel, 1 to 16; a count that the device does not have is replaced by the nearest one. With 1 the
    /// edges of hills and objects are aliased, and a software rasteriser draws faster. The ground inside the edges is
    /// shaded once a pixel with any count.
    int sample_count = 4;
    double tint_low = 0.0;                ///< heights of the tints of low and
    double tint_high = 3000.0;            ///< high ground, metres
    Colour horizon{0.74f, 0.81f, 0.88f};  ///< sky at the horizon, and haze
    Colour zenith{0.22f, 0.42f, 0.72f};   ///< sky overhead
    /// Distance from the eye within which the sun casts shadows of ground and objects, metres, at most 1e6; 0: none,
    /// at no cost. They fade over its last quarter. Shadow casters are the ground's triangles of the frame, out of
    /// view too, and the objects that are passed to draw(), except particles; SceneDraws has lists of its own for
    /// casters out of view. Costs three more passes of triangles a frame.
    double shadow_distance = 0.0;
    /// Texels along the side of each of the three shadow maps, 256 to 8192. A texel of the last map is about
    /// 1.5 * shadow_distance / shadow_texels wide, of the second a quarter of that, of the first a sixteenth. The maps
    /// take 12 bytes * shadow_texels^2.
    int shadow_texels = 1024;
    /// Height of still water over all ground that is lower, and beyond the ground, metres, within 1e9; absent: none.
    /// It is drawn where ground is shaded and with each object: no triangles, no passes.
    std::optional<double> water_level = {};
    /// Imagery that is draped over the ground, in place of the tints where it has data; null: none. Read in squares on
    /// a thread, which fade in as they arrive.
    std::shared_ptr<const ImagerySource> imagery = {};
    /// Limit of the device's memory for squares of imagery, 350 KB each; the finest are left out. At least one is held.
    std::size_t imagery_bytes = std::size_t{64} << 20;
    /// draw() waits for the imagery that it shows, and nothing fades: for films and tests, not for real time.
    bool imagery_waits = false;
};

/// A solid drawn with the terrain: a part of a vehicle or body.
struct DrawnObject {
    /// The solid, before `world_from_object`.
    enum class Form {
        box,   ///< from -extents to extents
        ball,  ///< ellipsoid with semi-axes extents
        tube,  ///< cylinder about z, open at its ends
    };
    Form form = Form::box;   ///< which solid is drawn
    Pose world_from_object;  ///< where its centre is, and its axes
    Eigen::Vector3d extents =
        Eigen::Vector3d::Constant(0.5);  ///< half extents along its axes, metres
    Colour colour{0.8f, 0.2f, 0.1f};     ///< before light
};

/// Statistics of the last draw().
struct DrawCounts {
    std::size_t chunks_drawn = 0;   ///< of the mesh
    std::size_t chunks_culled = 0;  ///< out of view: not submitted
    std::size_t objects_drawn = 0;  ///< instances, streamed objects and DrawnObject
    std::size_t triangles =
        0;  ///< of scene objects and particles; those of the ground are the mesh's
    std::size_t triangles_culled =
        0;                            ///< of `triangles`: in clusters that face away, not submitted
    std::size_t imagery_squares = 0;  ///< on the device
    std::size_t imagery_failures =
        0;  ///< squares that the source failed to read, since the renderer was made
    /// Milliseconds that the device took for the last draw() whose time it has reported, at most 3 calls ago; none
    /// before, and of software rasterisers, whose timers do not measure it.
    std::optional<double> gpu_ms;
};

/// Draws meshes of a Triangulator off screen.
///
/// Keeps heights and slopes of each drawn chunk on the device while the chunk is resident; uploads indices, and offsets
/// where the mesh morphs, every frame. Positions relative to the eye are subtracted in integers before conversion to
/// float: nothing jitters far from the origin, and chunks of different levels meet bit for bit, morphing included.
///
/// Light uses the slopes of the samples at the size of a pixel, as far as they are resident, whichever chunk or
/// triangle draws them. Where finer samples end it changes to the coarser ones within half a chunk, and where a chunk
/// arrives within 16 calls of draw(): a picture depends on earlier calls, as the pager's fades do. The first picture,
/// and the first after a jump of the eye, use all samples at once.
///
/// Threads: the one whose context is current, from create() to the destructor.
class TerrainRenderer {
public:
    /// Fails with invalid_argument for a size below 1 or above what the device takes (at most 2^26
    /// pixels together) and for settings that are not finite or out of range, device_unavailable
    /// where shaders or buffers cannot be made.
    static Result<TerrainRenderer> create(EglContext& context, int width_px, int height_px,
                                          const RendererSettings& settings);
    TerrainRenderer(TerrainRenderer&&) noexcept;
    TerrainRenderer& operator=(TerrainRenderer&&) noexcept;
    ~TerrainRenderer();

    /// Draws one frame. A mesh without triangles gives a picture of the sky.
    ///
    /// Fails with invalid_argument for a view that check(view) refuses, whose size is not the renderer's, or whose eye
    /// is more than 2^49 lattice spacings from the origin, and for a mesh with chunks outside its resident set or too
    /// few indices; device_unavailable for errors of OpenGL. The last frame is kept then.
    ///
    /// @param objects simple solids
    /// @param scene   objects of a scene, by ids of this renderer; also fails with invalid_argument for a mesh, level,
    ///                impostor or range that does not exist, and for numbers that are not finite or out of range
    Result<void> draw(const TerrainMesh& mesh, const View& view,
                      std::span<const DrawnObject> objects = {}, const SceneDraws& scene = {});

    /// Keeps a mesh of objects on the device, until remove_mesh() or the destructor.
    ///
    /// @param levels MeshDraw::level of them; none: one level, all triangles
    ///
    /// Fails: invalid_argument as check(TriangleMesh), for an index of a level beyond the vertices, and for a level
    ///        that morphs but has no target for one of its vertices;
    ///        device_unavailable for errors of OpenGL
    Result<MeshId> add_mesh(const TriangleMesh& mesh, std::span<const MeshLevel> levels = {},
                            const MeshMaterial& material = {});
    /// Frees a mesh; nothing where there is none of that name. Its impostors stay.
    void remove_mesh(MeshId mesh);

    /// Makes pictures of level 0 of a mesh from many directions, which stand for it where it is small.
    ///
    /// Fails: invalid_argument for settings out of range, an unknown mesh or one without triangles; device_unavailable
    ///        for errors of OpenGL
    /// Cost:  as drawing the mesh once for each view, four times as large
    Result<ImpostorId> add_impostor(MeshId mesh, const ImpostorSettings& settings = {});
    /// Frees an impostor; nothing where there is none of that name.
    void remove_impostor(ImpostorId impostor);

    /// Sun and distance of its shadows, for Scene::begin_frame() and SceneGraph::collect(); none where it draws none.
    std::optional<SunShadows> shadows() const;

    /// Of the last frame that draw() did not fail for.
    const DrawCounts& counts() const;

    /// The last frame.
    Image read() const;

    /// Samples per pixel in use.
    int sample_count() const;

    /// Bytes of heights and slopes of chunks, meshes, impostors, shadow maps and imagery on the device. Chunks' buffers
    /// grow by doubling and may be larger.
    std::size_t buffer_bytes() const;

private:
    struct State;
    explicit TerrainRenderer(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

/// Difference between pictures of an impostor and of its mesh at one size, over the pixels that either covers.
struct ImpostorDifference {
    double diameter_px = 0.0;  ///< of the mesh's bounding sphere
    double mean = 0.0;         ///< of the largest difference of a pixel's channels, 0 to 255
    double share = 0.0;        ///< of pixels with a channel that differs by more than 8, 0 to 1
    /// `mean` over that of the mesh and the same mesh displaced by a pixel along the picture's diagonal: a displacement
    /// of the mesh's picture, pixels, that would be seen as much.
    double displacement_px = 0.0;
};

/// When an impostor may stand for its mesh.
struct ImpostorError {
    std::vector<ImpostorDifference> sizes;  ///< by diameter, the smallest first
    /// Largest diameter asked for up to which, smaller ones included, displacement_px is at most the accepted one; 0:
    /// none.
    double takeover_px = 0.0;
    /// For ObjectLevel::error_m: the accepted displacement where the mesh's diameter is takeover_px, metres. Infinity
    /// where takeover_px is 0: the impostor is never good enough.
    double error_m = 0.0;
};

/// Draws a mesh and its impostor alone before the sky, from 8 sides and at the elevations that the impostor is for, and
/// compares. Most of the directions lie between the impostor's views.
///
/// @param renderer     its last frame is replaced, and its counts
/// @param mesh         that `mesh_id` was made from
/// @param has_ring     whether ImpostorSettings::views_above is 1: from level alone, else from 0, 34 and 74 degrees
///                     above
/// @param diameters_px each above 0 and at most the shorter side of the renderer's picture
/// @param accepted_px  largest displacement accepted, > 0
///
/// Fails: invalid_argument for a mesh without extent, an argument out of range and as TerrainRenderer::draw()
/// Cost:  32 or 96 draws and reads of a picture for each diameter
Result<ImpostorError> measure_impostor(TerrainRenderer& renderer, const TriangleMesh& mesh,
                                       MeshId mesh_id, ImpostorId impostor, bool has_ring,
                                       std::span<const double> diameters_px,
                                       double accepted_px = 1.0);

}  // namespace terrane
