// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/render/material.h>
#include <terrane/render/offscreen.h>
#include <terrane/scene/culling.h>
#include <terrane/scene/scene_draws.h>
#include <terrane/terrain/imagery_source.h>
#include <terrane/terrain/triangle_mesh.h>
#include <terrane/terrain/triangulator.h>

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace terrane {

namespace internal {
class InstanceDevice;
}

/// Settings of an impostor: views of an object that are rendered in advance.
struct ImpostorSettings {
    /// Views around the object's z axis, 4 to 64. With more views the picture jumps less as the viewer circles the
    /// object.
    int views_around = 16;
    /// Number of elevations of the views, from horizontal to vertically above, 1 to 16. With 1 the views form a ring,
    /// for trees seen from the side, and the billboard turns about the object's z axis only. With more they cover a
    /// hemisphere; an object seen from below is drawn with the horizontal views.
    int views_above = 4;
    int texels =
        96;  ///< along the side of a view, 8 to 512; each texel takes 10.7 bytes, with mipmaps
};

/// A display colour, 0 to 1.
struct Colour {
    float red = 0.0f, green = 0.0f, blue = 0.0f;  ///< with display gamma
};

/// Colours and patterns of the ground's materials.
enum class GroundPalette {
    alpine,     ///< meadows, shrub, scree and rock below snow
    temperate,  ///< woods and meadows, rock only on steep slopes
    desert,     ///< sand with ripples, dry shrub, red rock with beds
    moon,       ///< grey dust with craters
    imagery,    ///< muted colours, for ground that imagery covers for the most part
};

/// The ground in materials: turf, shrub, soil, scree, rock and snow, chosen by slope, height, curvature and moisture,
/// with detail down to millimetres that does not repeat. The textures are made in TerrainRenderer::create().
struct GroundLookSettings {
    GroundPalette palette = GroundPalette::alpine;  ///< colours and patterns
    /// Height above which snow lies on ground that is not steep, metres, within +-1e9; absent: by the palette, between
    /// tint_low and tint_high. Palettes without snow have pale sand or dust there.
    std::optional<double> snow_line = {};
    /// Slope from which the ground is rock, rise over run, 0 to 100; absent: by the palette.
    std::optional<double> rock_slope = {};
    /// Share of light that hollows lose to the ground around them, 0 to 1.
    double occlusion = 0.6;
    /// Largest anisotropy of the texture's filter, 1 to 16; a software rasteriser has 1, and other devices at most what
    /// they support. With 1 the ground is slightly blurred in the distance.
    int anisotropy = 8;
};

/// A point that shines equally in all directions. The light of a surface falls with the square of its distance, times
/// the window (1 - (distance / range)^4)^2, which ends it at the range. It casts no shadows, has no highlights and does
/// not lighten the air.
///
/// Source: B. Karis. Real Shading in Unreal Engine 4. SIGGRAPH 2013.
struct PointLight {
    WorldPos position_world = WorldPos::Zero();  ///< within 1e12 m of the origin
    /// Light of a white surface that faces the point from 1 m: red, green and blue, linear, 0 to 1e9. The unit is that
    /// of the picture before tone mapping, in which the sun without an atmosphere gives (2.75, 2.40, 1.90); exposure
    /// does not change it.
    Eigen::Vector3d intensity = Eigen::Vector3d(100.0, 100.0, 100.0);
    double range = 100.0;  ///< metres, above 0 to 1e6
};
/// The most point lights of a renderer.
inline constexpr std::size_t kMostPointLights = 8;

/// Light, haze, tints and quality of TerrainRenderer.
struct RendererSettings {
    Eigen::Vector3d sun_direction = Eigen::Vector3d(-0.5, 0.4, 0.77);  ///< towards the sun
    double haze_distance =
        60'000.0;  ///< metres over which haze absorbs two thirds of the light; infinity: no haze
    bool wireframe = false;  ///< draws the edges of the triangles over the ground
    /// Samples per pixel, 1 to 16; a count that the device does not support is replaced by the next larger supported
    /// count, or by the largest. With 1 the edges of hills and objects are aliased, but a software rasteriser draws
    /// faster. Ground away from edges is shaded once per pixel at any count.
    int sample_count = 4;
    double tint_low = 0.0;                       ///< height of the tint of low ground, metres
    double tint_high = 3000.0;                   ///< height of the tint of high ground, metres
    Colour horizon_colour{0.74f, 0.81f, 0.88f};  ///< sky at the horizon, and haze
    Colour zenith_colour{0.22f, 0.42f, 0.72f};   ///< sky overhead
    /// Distance from the eye up to which shadows are drawn on ground and objects, metres, at most 1e6; 0: no shadows,
    /// at no cost. Shadows fade over the last quarter of this distance. They are cast by all ground triangles of the
    /// frame, in view or not, and by the objects passed to draw(), except particles; SceneDraws has separate lists for
    /// casters out of view. Shadows take three more geometry passes a frame.
    double shadow_distance = 0.0;
    /// Texels along the side of each of the three shadow maps, 256 to 8192. A texel of the last map is about
    /// 1.5 * shadow_distance / shadow_texels wide, of the second a quarter of that, of the first a sixteenth. The maps
    /// take 12 bytes * shadow_texels^2.
    int shadow_texels = 1024;
    /// Angular radius of the sun, radians, 0 to 0.05, that sets the width of the penumbrae of shadows: the real sun has
    /// 0.00465. A penumbra is at most 4 texels of the shadow map wide. 0: edges as sharp as the texels.
    double sun_radius = 0.0;
    /// Whether sky, haze and the colours of light come from the scattering of sunlight in the air, for the sun's
    /// direction and the eye's altitude (z), instead of fixed colours. `haze_distance` is then that at sea level in
    /// green light: air alone has 81 km, aerosols account for the rest. `horizon_colour` and `zenith_colour` have no
    /// effect. The picture is exposed for the light of sun and sky.
    bool atmosphere = false;
    /// Correction of the exposure of an atmosphere, powers of two, -20 to 20.
    double exposure_stops = 0.0;
    /// Whether a pass smooths the edges of pictures with 1 sample per pixel.
    bool smooth_edges = false;
    /// Height of still water, metres, within +-1e9; absent: no water. The water covers all lower ground, and extends
    /// beyond the world. It is computed while ground and objects are shaded, without triangles or passes of its own.
    std::optional<double> water_level = {};
    /// Whether the water has waves that move with set_time(), and a soft shore. Ground exactly at the water's level, as
    /// seas in rasters are, is then water without a visible bottom. Without it the water is still, with a sharp edge.
    bool has_waves = false;
    /// Materials of the ground, in place of the tints; absent: the tints. They take 9.8 MB of textures and half the
    /// memory of slopes. Imagery covers their colours, and they add the detail that is finer than its texels.
    std::optional<GroundLookSettings> ground_look = {};
    /// Imagery draped over the ground, in place of the tints wherever it has data; null: no imagery. A thread reads the
    /// imagery in squares, which fade in as they arrive.
    std::shared_ptr<const ImagerySource> imagery = {};
    /// Limit of device memory for imagery squares, 350 KB each; the finest are omitted first. At least one is held.
    std::size_t imagery_bytes = std::size_t{64} << 20;
    /// Whether draw() waits for the imagery that it shows, and shows it without fades: for films and tests only.
    bool imagery_waits = false;
    /// Limit of device memory for the textures of objects. Beyond it textures lose their finest mipmaps, which halves
    /// their sides: first those drawn least recently, among these the largest. None becomes smaller than 32 pixels, so
    /// that very many textures may exceed the limit. They return as soon as they fit again.
    std::size_t texture_bytes = std::size_t{256} << 20;
};

/// Statistics of the last successful draw().
struct DrawCounts {
    std::size_t chunks_drawn = 0;   ///< chunks of the mesh that were submitted
    std::size_t chunks_culled = 0;  ///< chunks of the mesh that were not, being out of view
    std::size_t objects_drawn = 0;  ///< instances and streamed objects
    std::size_t triangles = 0;      ///< of scene objects and particles; excludes the ground
    std::size_t triangles_culled =
        0;  ///< part of `triangles`: in back-facing clusters, not submitted
    std::size_t textures_reduced =
        0;  ///< textures of objects without their finest mipmaps, for lack of memory
    std::size_t imagery_squares = 0;   ///< squares on the device
    std::size_t imagery_failures = 0;  ///< squares that the source failed to read since create()
    /// Device time of the most recent draw() whose time has been reported, at most 3 calls ago, milliseconds. Empty
    /// before the first report.
    std::optional<double> gpu_ms;
};

/// A rectangle of a framebuffer of the renderer's context, such as a window's.
struct PresentTarget {
    unsigned framebuffer = 0;         ///< OpenGL's name of it; 0: the window's
    int x = 0, y = 0;                 ///< lower left corner, pixels from that of the framebuffer
    int width_px = 0, height_px = 0;  ///< 1 or more
};

/// A colour that is drawn over ground, with display gamma.
struct GroundMark {
    Colour colour;         ///< where it is opaque
    float opacity = 0.0f;  ///< 0 to 1; 0: none
};

/// The colour of a material of the ground in TerrainRenderer::set_flat_materials().
struct FlatMaterial {
    const char* name;  ///< of the material in GroundPalette::alpine
    Colour colour;     ///< under white light that meets the ground at a right angle
};
/// The materials of GroundPalette::alpine. The materials of other palettes cover the same places, in the same order.
inline constexpr std::array<FlatMaterial, 6> kFlatMaterials{{{"turf", {0.62f, 0.83f, 0.32f}},
                                                             {"shrub", {0.10f, 0.48f, 0.25f}},
                                                             {"soil", {0.58f, 0.20f, 0.13f}},
                                                             {"scree", {0.95f, 0.72f, 0.20f}},
                                                             {"rock", {0.55f, 0.42f, 0.75f}},
                                                             {"snow", {0.93f, 0.97f, 1.00f}}}};

/// Draws meshes of a Triangulator off screen.
///
/// Keeps heights and slopes of each drawn chunk on the device while the chunk is resident. Uploads indices, and offsets
/// of morphing vertices, every frame. The eye's position is subtracted in integers before conversion to float: nothing
/// jitters far from the origin, and the shared edges of chunks of any levels are bit-identical, even while they morph.
///
/// Lighting uses slopes over a baseline of one pixel if samples that fine are resident, whichever chunk or triangle is
/// drawn there. Where a chunk ends at coarser samples, lighting blends to their slopes over half a chunk; a newly
/// resident chunk blends in over 16 calls of draw(). A picture therefore depends on earlier calls, as with the pager's
/// fades. The first picture, and the first after a jump of the eye, use all samples at once.
///
/// In a host's context (GlContext::adopt_current()) every call leaves the state of OpenGL as it finds it; device times
/// are not measured there.
///
/// Threads: the thread whose context is current, from create() to the destructor
class TerrainRenderer {
public:
    /// Fails with invalid_argument for a size below 1 or above the device's limit (at most 2^26 pixels in all) and for
    /// settings that are not finite or out of range; with device_unavailable if shaders or buffers cannot be created.
    static Result<TerrainRenderer> create(GlContext& context, int width_px, int height_px,
                                          const RendererSettings& settings);
    TerrainRenderer(TerrainRenderer&&) noexcept;
    TerrainRenderer& operator=(TerrainRenderer&&) noexcept;
    ~TerrainRenderer();

    /// Draws one frame. A mesh without triangles gives a picture of the sky.
    ///
    /// Fails with invalid_argument for a view that view.validate() refuses, whose size differs from the renderer's, or
    /// whose eye is more than 2^49 lattice spacings from the origin, and for a mesh with chunks outside its resident
    /// set or too few indices; the previous frame is then kept. Fails with device_unavailable for OpenGL errors.
    ///
    /// @param scene draw list with ids of this renderer; draw() also fails with invalid_argument for a mesh, level,
    ///              impostor, image or range that does not exist, and for numbers that are not finite or out of range
    Result<void> draw(const TerrainMesh& mesh, const View& view, const SceneDraws& scene = {});

    /// Changes the size of the following pictures, which draw() then expects. The last frame is lost.
    ///
    /// Fails: as create(); the size is kept then
    Result<void> resize(int width_px, int height_px);
    /// Moves the sun: RendererSettings::sun_direction from the next draw() on. Fails with invalid_argument for a
    /// direction that is zero or not finite.
    /// Cost: with an atmosphere its tables, about 60 ms
    Result<void> set_sun(const Eigen::Vector3d& sun_direction);
    /// Replaces the point lights, none at first, from the next draw() on. They light ground, volumes, objects,
    /// impostors and particles.
    ///
    /// Fails: invalid_argument for more than kMostPointLights and for numbers that are not finite or out of range;
    ///        device_unavailable if shaders do not compile; the lights are kept then
    /// Cost:  without lights none; the change from none to some and back compiles shaders
    Result<void> set_point_lights(std::span<const PointLight> lights);
    /// Turns RendererSettings::wireframe on or off from the next draw() on.
    void set_wireframe(bool is_on);
    /// Draws a colour over the triangles of each chunk of the heightfield, such as one for its level, from the next
    /// draw() on; null: none, at no cost. Marks are transparent to light, haze and water, and objects are before them.
    ///
    /// @param mark_of called in draw(), for chunks of the drawn mesh
    void set_ground_marks(std::function<GroundMark(const MeshChunk&)> mark_of);

    /// Draws each material of the ground in its colour of kFlatMaterials, without detail, from the next draw() on, or
    /// as before. Lit and covered by imagery as usual. No effect without RendererSettings::ground_look.
    void set_flat_materials(bool is_on);

    /// Sets the time of moving water for the following calls of draw(), seconds, 0 at first. The same time gives the
    /// same waves. Fails with invalid_argument for a time that is not finite.
    Result<void> set_time(double seconds);

    /// Uploads a mesh of objects. It stays on the device until remove_mesh() or the destructor.
    ///
    /// @param levels indexed by MeshDraw::level; empty: one level with all triangles
    ///
    /// Fails: invalid_argument as TriangleMesh::validate(), for a level with an index beyond the vertices, and for a
    ///        morphing level in which a vertex has no target; device_unavailable for OpenGL errors
    Result<MeshId> add_mesh(const TriangleMesh& mesh, std::span<const MeshLevel> levels = {},
                            const MeshMaterial& material = {});
    /// Uploads a mesh whose triangles have several materials, and the textures that no other mesh has uploaded.
    ///
    /// @param materials indexed by TriangleMesh::materials, at least one
    ///
    /// Fails: invalid_argument also for a material that does not exist, a number of a material out of range, and an
    ///        image whose size does not fit its pixels
    Result<MeshId> add_mesh(const TriangleMesh& mesh, std::span<const MeshLevel> levels,
                            std::span<const MeshMaterial> materials);
    /// Frees a mesh; no effect for an unknown id. Its impostors stay.
    void remove_mesh(MeshId mesh);

    /// Renders level 0 of a mesh from many directions, for billboards that replace the mesh at small sizes.
    ///
    /// Fails: invalid_argument for settings out of range, an unknown mesh or one without triangles; device_unavailable
    ///        for OpenGL errors
    /// Cost:  as drawing the mesh once per view at four times the size
    Result<ImpostorId> add_impostor(MeshId mesh, const ImpostorSettings& settings = {});
    /// Frees an impostor; no effect for an unknown id.
    void remove_impostor(ImpostorId impostor);

    /// Uploads an image of particles, for EmitterNode::image and Particle::image. It shares the limit texture_bytes
    /// with the textures of meshes.
    ///
    /// @param image multiplies colour and opacity of the particles; an image that is opaque everywhere has the opacity
    ///              of a soft disc
    ///
    /// Fails: invalid_argument for null and for an image whose size does not fit its pixels; device_unavailable for
    ///        OpenGL errors
    Result<ParticleImageId> add_particle_image(std::shared_ptr<const TextureImage> image);
    /// Frees an image of particles; no effect for an unknown id. draw() refuses particles that still name it.
    void remove_particle_image(ParticleImageId image);

    /// What culls a scene's instances and chooses their levels on the device: for Scene::set_device(). The first call
    /// compiles its shaders. Valid as long as the renderer.
    ///
    /// Fails: device_unavailable if the device does not compile the shaders or does not round as IEEE 754
    Result<internal::InstanceDevice*> instance_device();

    /// Sun direction and shadow distance, for Scene::begin_frame(); none if shadows are off.
    std::optional<SunShadows> shadows() const;

    /// Statistics of the last successful draw().
    const DrawCounts& counts() const;

    /// Reads the last frame back from the device.
    Image read() const;
    /// Copies the last frame into a framebuffer on the device, scaled to the rectangle: shows it in a window without
    /// reading it back. The framebuffer's colours are taken for sRGB, as the frame's are.
    ///
    /// Fails with invalid_argument for a side below 1; with device_unavailable for OpenGL errors, such as a framebuffer
    /// that does not exist or is not complete.
    Result<void> present(const PresentTarget& target);

    /// Samples per pixel in use.
    int sample_count() const;

    /// Device memory of chunks (heights and slopes), meshes, textures, impostors, shadow maps and imagery, bytes. Spare
    /// memory in the buffers of chunks, which grow by doubling, is not counted.
    std::size_t buffer_bytes() const;

private:
    struct State;
    explicit TerrainRenderer(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
};

/// Difference between the pictures of an impostor and of its mesh at one size, over the pixels covered by either.
struct ImpostorDifference {
    double diameter_px = 0.0;  ///< of the mesh's bounding sphere
    double mean = 0.0;         ///< of each pixel's largest channel difference, 0 to 255
    double share = 0.0;        ///< of pixels with a channel difference above 8, 0 to 1
    /// Displacement of the mesh that would be as visible as the impostor, pixels: `mean`, divided by the mean
    /// difference between the mesh and the same mesh displaced by one pixel along the picture's diagonal.
    double displacement_px = 0.0;
};

/// Sizes at which an impostor may replace its mesh.
struct ImpostorError {
    std::vector<ImpostorDifference> sizes;  ///< ascending by diameter
    /// Largest measured diameter such that displacement_px is at most `accepted_px` there and at all smaller measured
    /// diameters; 0 if there is none.
    double takeover_px = 0.0;
    /// For ObjectLevel::error_m: `accepted_px` in metres, at the distance at which the mesh's diameter is takeover_px.
    /// Infinity if takeover_px is 0, because the impostor is never good enough.
    double error_m = 0.0;
};

/// Compares pictures of a mesh and of its impostor, each alone in front of the sky, from 8 sides and at the elevations
/// that the impostor covers. Most of the directions lie between the impostor's views.
///
/// @param renderer     its last frame and counts are replaced
/// @param mesh         the mesh that was uploaded as `mesh_id`
/// @param has_ring     whether ImpostorSettings::views_above is 1: then pictures are compared at elevation 0 only,
///                     otherwise at 0, 34 and 74 degrees
/// @param diameters_px each above 0 and at most the shorter side of the renderer's picture
/// @param accepted_px  largest displacement accepted, > 0
///
/// Fails: invalid_argument for a mesh without extent or an argument out of range; otherwise as TerrainRenderer::draw()
/// Cost:  32 draws and picture reads per diameter for a ring, otherwise 96
Result<ImpostorError> measure_impostor(TerrainRenderer& renderer, const TriangleMesh& mesh,
                                       MeshId mesh_id, ImpostorId impostor, bool has_ring,
                                       std::span<const double> diameters_px,
                                       double accepted_px = 1.0);

}  // namespace terrane
