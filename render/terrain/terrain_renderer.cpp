// SPDX-License-Identifier: MIT
#include "gl/frame_resources.h"
#include "gl/gl_object.h"
#include "gl/host_state.h"
#include "gl/shader.h"
#include "light/frame_uniforms.h"
#include "light/ground_materials.h"
#include "light/ground_shade.h"
#include "light/point_lights.h"
#include "light/shadow_maps.h"
#include "light/sky_light.h"
#include "objects/scene_objects.h"
#include "terrain/ground_draws.h"
#include "terrain/ground_imagery.h"
#include "terrain/volume_draws.h"

#include <terrane/base/result.h>
#include <terrane/base/text.h>
#include <terrane/render/terrain_renderer.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace terrane {
namespace {

using namespace internal;

constexpr double kMostShadowDistance = 1e6;  // metres
constexpr double kMostHeight = 1e9;          // of water and snow, metres, up or down
constexpr double kMostRockSlope = 100.0;
constexpr int kMostAnisotropy = 16;
constexpr double kMostSunRadius = 0.05;  // radians
constexpr double kMostStops = 20.0;

Result<void> check_colour(std::string name, const Colour& colour) {
    for (const float part : {colour.red, colour.green, colour.blue}) {
        if (part >= 0.0f && part <= 1.0f) continue;
        return fail(ErrorCode::invalid_argument,
                    name.append(" must have parts from 0 to 1, got ").append(number_text(part)));
    }
    return {};
}

Result<void> check(const GroundLookSettings& look) {
    const auto refuse = [](const std::string& message) -> Result<void> {
        return fail(ErrorCode::invalid_argument, message);
    };
    if (look.snow_line && !(std::abs(*look.snow_line) <= kMostHeight))
        return refuse("snow_line must be within 1e9 m, got " + number_text(*look.snow_line));
    if (look.rock_slope && !(*look.rock_slope >= 0.0 && *look.rock_slope <= kMostRockSlope))
        return refuse("rock_slope must be 0 to 100, got " + number_text(*look.rock_slope));
    if (!(look.occlusion >= 0.0 && look.occlusion <= 1.0))
        return refuse("occlusion must be 0 to 1, got " + number_text(look.occlusion));
    if (look.anisotropy < 1 || look.anisotropy > kMostAnisotropy)
        return refuse("anisotropy must be 1 to 16, got " + std::to_string(look.anisotropy));
    return {};
}

Result<void> check(const RendererSettings& settings) {
    const auto refuse = [](const std::string& message) -> Result<void> {
        return fail(ErrorCode::invalid_argument, message);
    };
    if (!settings.sun_direction.allFinite() || !(settings.sun_direction.norm() > 0.0)) {
        return refuse("sun_direction must be finite and not zero");
    }
    if (!(settings.haze_distance > 0.0)) {
        return refuse("haze_distance must be > 0 m, got " + number_text(settings.haze_distance));
    }
    if (!std::isfinite(settings.tint_low) || !std::isfinite(settings.tint_high) ||
        !(settings.tint_high > settings.tint_low)) {
        return refuse("tint_high must be above tint_low, got " + number_text(settings.tint_high) +
                      " and " + number_text(settings.tint_low));
    }
    if (settings.sample_count < 1 || settings.sample_count > 16) {
        return refuse("sample_count must be 1 to 16, got " + std::to_string(settings.sample_count));
    }
    if (!(settings.shadow_distance >= 0.0 && settings.shadow_distance <= kMostShadowDistance)) {
        return refuse("shadow_distance must be 0 to 1e6 m, got " +
                      number_text(settings.shadow_distance));
    }
    if (!(settings.sun_radius >= 0.0 && settings.sun_radius <= kMostSunRadius)) {
        return refuse("sun_radius must be 0 to 0.05 radians, got " +
                      number_text(settings.sun_radius));
    }
    if (!(std::abs(settings.exposure_stops) <= kMostStops)) {
        return refuse("exposure_stops must be -20 to 20, got " +
                      number_text(settings.exposure_stops));
    }
    if (settings.ground_look) TERRANE_TRY(check(*settings.ground_look));
    if (settings.water_level && !(std::abs(*settings.water_level) <= kMostHeight)) {
        return refuse("water_level must be within 1e9 m, got " +
                      number_text(*settings.water_level));
    }
    if (settings.shadow_texels < kLeastShadowTexels || settings.shadow_texels > kMostShadowTexels) {
        return refuse("shadow_texels must be " + std::to_string(kLeastShadowTexels) + " to " +
                      std::to_string(kMostShadowTexels) + ", got " +
                      std::to_string(settings.shadow_texels));
    }
    TERRANE_TRY(check_colour("horizon_colour", settings.horizon_colour));
    return check_colour("zenith_colour", settings.zenith_colour);
}

// Checks the arguments of draw() before anything is drawn.
Result<void> check(const TerrainMesh& mesh, const View& view, const Framebuffer& picture) {
    TERRANE_TRY(view.validate());
    if (view.width_px != picture.width_px() || view.height_px != picture.height_px()) {
        return fail(ErrorCode::invalid_argument,
                    "the view is for " + std::to_string(view.width_px) + " x " +
                        std::to_string(view.height_px) + " pixels, the renderer for " +
                        std::to_string(picture.width_px()) + " x " +
                        std::to_string(picture.height_px()));
    }
    if (mesh.resident == nullptr && !(mesh.chunks.empty() && mesh.solids.empty())) {
        return fail(ErrorCode::invalid_argument, "the mesh has chunks, but no resident set");
    }
    for (const MeshChunk& chunk : mesh.chunks) {
        if (std::size_t{chunk.first_index} + chunk.index_count > mesh.indices.size()) {
            return fail(ErrorCode::invalid_argument,
                        "the mesh has " + std::to_string(mesh.indices.size()) +
                            " indices, a chunk's end at " +
                            std::to_string(std::size_t{chunk.first_index} + chunk.index_count));
        }
    }
    return {};
}

// The lighting of all that is not ground.
LightFeatures without_ground(LightFeatures features) {
    features.has_imagery = false;
    features.anisotropy = 0;
    return features;
}

}  // namespace

struct TerrainRenderer::State {
    std::shared_ptr<const void> context;  // declared first: must outlive all OpenGL names below
    RendererSettings settings;
    Framebuffer picture;
    GroundShade shade;
    // Programs of the ground's triangles.
    struct GroundPrograms {
        GlProgram depth, wires, marks;
    };
    GroundPrograms of_chunks, of_device;
    const GroundPrograms* ground = &of_chunks;  // of the frame's mesh
    VolumeDraws::Program solid_ground, solid_walls, solid_wires;
    GlBuffer frame_uniforms;
    std::optional<ShadowPass> shadows;       // none without shadow_distance
    std::unique_ptr<GroundImagery> imagery;  // null: none
    std::unique_ptr<SkyLight> sky;           // null without an atmosphere
    std::optional<GroundMaterials> materials;
    LightFeatures features;
    PointLights point_lights;
    double time = 0.0;
    GroundDraws draws;
    bool has_marks = false;
    bool is_hosted = false;  // in a host's context
    GroundCasters ground_casters = GroundCasters::all;
    VolumeDraws solids;
    SceneObjects scene;
    GpuTimer timer;
    DrawCounts counts;

    State(Framebuffer target, GroundShade made_shade, const std::string& lighting,
          std::size_t texture_bytes, bool is_anisotropic)
        : picture(std::move(target)),
          shade(std::move(made_shade)),
          scene(picture.sample_count(), lighting, texture_bytes, is_anisotropic) {}

    static Result<GroundPrograms> make_ground_programs(const std::string& defines);
    Result<void> make_programs(const std::string& lighting);
    Result<void> choose_programs(const TerrainMesh& mesh);
    Result<void> choose_lighting(bool has_point_lights);
    void make_buffers();
    void draw_shadows(const FrameUniforms& uniforms, const View& view);
    void draw_walls();
    void draw_marks();
    void draw_wires();
};

Result<TerrainRenderer::State::GroundPrograms> TerrainRenderer::State::make_ground_programs(
    const std::string& defines) {
    const std::string vertex = defines + std::string(terrain_vert);
    GroundPrograms made;
    TERRANE_TRY(made.depth, make_program("the terrain", vertex, depth_frag));
    TERRANE_TRY(made.wires, make_program("the wireframe", vertex, line_frag));
    TERRANE_TRY(made.marks,
                make_program("the marks of chunks", "#define MARKED\n" + vertex, ground_mark_frag));
    return made;
}

Result<void> TerrainRenderer::State::make_programs(const std::string& lighting) {
    TERRANE_TRY(of_chunks, make_ground_programs(""));
    TERRANE_TRY(GlProgram made_solid,
                make_program("the ground of volumes", solid_vert, depth_frag));
    TERRANE_TRY(GlProgram made_walls, make_program("the walls of volumes", solid_vert,
                                                   lighting + std::string(solid_frag)));
    TERRANE_TRY(GlProgram made_solid_wires,
                make_program("the wireframe of volumes", solid_vert, line_frag));
    solid_ground = VolumeDraws::Program(std::move(made_solid));
    solid_walls = VolumeDraws::Program(std::move(made_walls));
    solid_wires = VolumeDraws::Program(std::move(made_solid_wires));
    return {};
}

// The programs of a mesh; those of the device are compiled for its first mesh.
Result<void> TerrainRenderer::State::choose_programs(const TerrainMesh& mesh) {
    if (mesh.device != nullptr && of_device.depth.name() == 0) {
        TERRANE_TRY(of_device, make_ground_programs("#define FROM_DEVICE\n"));
    }
    ground = mesh.device != nullptr ? &of_device : &of_chunks;
    return {};
}

// Compiles the programs with or without point lights.
Result<void> TerrainRenderer::State::choose_lighting(bool has_point_lights) {
    LightFeatures wanted = features;
    wanted.point_lights = has_point_lights ? kMostPointLights : 0;
    if (wanted.point_lights == features.point_lights) return {};
    const std::string lighting = light_text(without_ground(wanted));
    TERRANE_TRY(GroundShade::Programs of_ground, shade.make_programs(light_text(wanted)));
    TERRANE_TRY(GlProgram made_walls, make_program("the walls of volumes", solid_vert,
                                                   lighting + std::string(solid_frag)));
    TERRANE_TRY(scene.set_lighting(lighting));
    shade.use(std::move(of_ground));
    solid_walls = VolumeDraws::Program(std::move(made_walls));
    features = wanted;
    return {};
}

void TerrainRenderer::State::make_buffers() {
    frame_uniforms = make_buffer();
    glNamedBufferStorage(frame_uniforms.name(), sizeof(FrameUniforms), nullptr,
                         GL_DYNAMIC_STORAGE_BIT);
    if (settings.shadow_distance > 0.0) shadows.emplace(settings);
    if (settings.atmosphere) sky = std::make_unique<SkyLight>(settings);
    if (settings.imagery != nullptr) {
        imagery = std::make_unique<GroundImagery>(settings.imagery, settings.imagery_bytes,
                                                  settings.imagery_waits);
    }
}

void TerrainRenderer::State::draw_walls() {
    if (solids.is_empty()) return;
    shade.bind_noise(1);
    solids.draw(VolumeDraws::Part::walls, solid_walls);
}

void TerrainRenderer::State::draw_marks() {
    glDepthMask(GL_FALSE);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    glUseProgram(ground->marks.name());
    draws.draw();
    glDisable(GL_BLEND);
    glDepthMask(GL_TRUE);
}

void TerrainRenderer::State::draw_wires() {
    glPolygonMode(GL_FRONT_AND_BACK, GL_LINE);
    glEnable(GL_POLYGON_OFFSET_LINE);
    glPolygonOffset(1.0f, 4.0f);  // towards the eye: depth is reversed
    glDepthMask(GL_FALSE);        // shade.frag reconstructs the ground from its depth
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    glUseProgram(ground->wires.name());
    draws.draw();
    solids.draw(VolumeDraws::Part::ground, solid_wires);
    solids.draw(VolumeDraws::Part::walls, solid_wires);
    glDisable(GL_BLEND);
    glDepthMask(GL_TRUE);
    glDisable(GL_POLYGON_OFFSET_LINE);
    glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
}

// Draws the shadow casters into the maps, and binds the maps.
void TerrainRenderer::State::draw_shadows(const FrameUniforms& uniforms, const View& view) {
    shadows->draw(uniforms, view, [&](std::size_t cascade) {
        glUseProgram(ground->depth.name());
        ShadowMaps::begin_ground();
        draws.draw_casters(cascade);
        ShadowMaps::end_ground();
        solids.draw(VolumeDraws::Part::ground, solid_ground);
        solids.draw(VolumeDraws::Part::walls, solid_ground);
        scene.draw_casters(cascade);
    });
}

namespace {

// Software rasterisers filter anisotropic textures, but slowly.
int anisotropy_of(const GlContext& context, const GroundLookSettings& look) {
    if (context.is_software()) return 1;
    GLfloat most = 1.0f;
    glGetFloatv(GL_MAX_TEXTURE_MAX_ANISOTROPY, &most);
    return std::clamp(look.anisotropy, 1, static_cast<int>(most));
}

}  // namespace

TerrainRenderer::TerrainRenderer(std::unique_ptr<State> state) : state_(std::move(state)) {}
TerrainRenderer::TerrainRenderer(TerrainRenderer&&) noexcept = default;
TerrainRenderer& TerrainRenderer::operator=(TerrainRenderer&&) noexcept = default;
TerrainRenderer::~TerrainRenderer() = default;

Result<TerrainRenderer> TerrainRenderer::create(GlContext& context, int width_px, int height_px,
                                                const RendererSettings& settings) {
    TERRANE_TRY(check(settings));
    const HostState host(context.is_adopted());
    TERRANE_TRY(Framebuffer picture,
                Framebuffer::create(width_px, height_px, settings.sample_count,
                                    settings.smooth_edges, settings.ground_look.has_value()));
    const bool has_shadows = settings.shadow_distance > 0.0;
    const LightFeatures features = {
        .cascades = has_shadows ? kCascades : 0,
        .has_penumbra = settings.sun_radius > 0.0,
        .has_atmosphere = settings.atmosphere,
        .has_water = settings.water_level.has_value(),
        .has_waves = settings.has_waves,
        .has_imagery = settings.imagery != nullptr,
        .anisotropy = settings.ground_look ? anisotropy_of(context, *settings.ground_look) : 0};
    const std::string lighting = light_text(without_ground(features));
    TERRANE_TRY(GroundShade shade,
                GroundShade::create(picture.sample_count(), light_text(features),
                                    picture.is_smoothed(), settings.ground_look.has_value()));
    auto state = std::make_unique<State>(std::move(picture), std::move(shade), lighting,
                                         settings.texture_bytes, !context.is_software());
    state->context = context.keep_alive();
    state->settings = settings;
    state->features = features;
    state->is_hosted = context.is_adopted();
    if (context.is_software()) state->ground_casters = GroundCasters::backs;
    if (settings.ground_look) state->materials.emplace(settings, features.anisotropy);
    TERRANE_TRY(state->make_programs(lighting));
    state->make_buffers();
    TERRANE_TRY(check_gl("set up the renderer"));
    return TerrainRenderer(std::move(state));
}

Result<void> TerrainRenderer::draw(const TerrainMesh& mesh, const View& view,
                                   const SceneDraws& scene) {
    State& state = *state_;
    const HostState host(state.is_hosted);
    TERRANE_TRY(check(mesh, view, state.picture));
    // the sky does not depend on the lattice
    const Lattice lattice = mesh.resident == nullptr ? Lattice{} : mesh.resident->lattice();
    EyeFrame eye;
    if (mesh.resident != nullptr) {
        TERRANE_TRY(const EyeFrame made, make_eye_frame(lattice, view.eye_world));
        eye = made;
    }
    std::span<const SunCascade> cascades;
    if (state.shadows) {
        state.shadows->prepare(view);
        cascades = state.shadows->cascades();
    }
    TERRANE_TRY(state.choose_programs(mesh));
    TERRANE_TRY(state.scene.prepare(scene, view, cascades));
    const GroundCulling culling =
        state.settings.wireframe ? GroundCulling::none : GroundCulling::view;
    TERRANE_TRY(state.draws.prepare(mesh, view, eye, culling, cascades, state.ground_casters));
    if (mesh.resident != nullptr) {
        TERRANE_TRY(state.shade.prepare(mesh.resident, view, eye));
        if (state.materials) {
            state.materials->prepare(lattice, eye);
            state.materials->bind();
        }
        if (state.imagery) {
            TERRANE_TRY(state.imagery->prepare(*mesh.resident, view));
            state.imagery->bind();
        }
    }
    TERRANE_TRY(state.solids.prepare(mesh, eye));
    const bool has_overlay = state.settings.wireframe || state.has_marks ||
                             !state.solids.is_empty() || !state.scene.is_empty();

    const FrameUniforms uniforms =
        make_frame_uniforms(state.settings, lattice, view, eye, state.time);
    glNamedBufferSubData(state.frame_uniforms.name(), 0, sizeof(uniforms), &uniforms);

    if (state.sky) {
        state.sky->prepare(view.eye_world.z());
        state.sky->bind();
    }

    if (!state.point_lights.is_empty()) state.point_lights.bind(view.eye_world);

    state.timer.begin();
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GEQUAL);
    glClearDepth(0.0);
    if (state.shadows) state.draw_shadows(uniforms, view);
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, state.frame_uniforms.name());
    if (state.settings.water_level) state.shade.bind_noise(7);
    state.picture.bind_depth();
    glClear(GL_DEPTH_BUFFER_BIT);
    glUseProgram(state.ground->depth.name());
    // hills hide their back faces; where volumes open the ground, the eye may see them
    const bool hides_backs = mesh.solids.empty() && is_above_ground(mesh, view.eye_world);
    if (hides_backs) glEnable(GL_CULL_FACE);
    state.draws.draw();
    glDisable(GL_CULL_FACE);
    state.solids.draw(VolumeDraws::Part::ground, state.solid_ground);
    if (has_overlay) {
        state.picture.bind_depth_and_overlay();
        glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
        glClear(GL_COLOR_BUFFER_BIT);
        state.draw_walls();
        if (state.has_marks) state.draw_marks();
        if (state.settings.wireframe) state.draw_wires();
        state.scene.draw_solid();
        state.scene.draw_particles(state.picture);
    }
    state.scene.finish();
    state.draws.finish();
    state.shade.draw(state.picture, has_overlay);
    state.timer.end();
    if (mesh.resident != nullptr) {
        state.shade.finish();
        if (state.imagery) state.imagery->finish();
    }
    TERRANE_TRY(check_gl("draw the terrain"));
    state.counts = {.chunks_drawn = state.draws.drawn_count(),
                    .chunks_culled = state.draws.culled_count(),
                    .objects_drawn = state.scene.object_count(),
                    .triangles = state.scene.triangle_count(),
                    .triangles_culled = state.scene.culled_triangle_count(),
                    .textures_reduced = state.scene.reduced_texture_count(),
                    .imagery_squares = state.imagery ? state.imagery->square_count() : 0,
                    .imagery_failures = state.imagery ? state.imagery->failure_count() : 0,
                    .gpu_ms = state.timer.last_ms()};
    return {};
}

Result<void> TerrainRenderer::resize(int width_px, int height_px) {
    State& state = *state_;
    if (width_px == state.picture.width_px() && height_px == state.picture.height_px()) return {};
    const HostState host(state.is_hosted);
    const RendererSettings& settings = state.settings;
    TERRANE_TRY(state.picture,
                Framebuffer::create(width_px, height_px, state.picture.sample_count(),
                                    settings.smooth_edges, settings.ground_look.has_value()));
    return check_gl("change the size of pictures");
}

Result<void> TerrainRenderer::set_sun(const Eigen::Vector3d& sun_direction) {
    State& state = *state_;
    RendererSettings changed = state.settings;
    changed.sun_direction = sun_direction;
    TERRANE_TRY(check(changed));
    const HostState host(state.is_hosted);
    state.settings = std::move(changed);
    if (state.shadows) state.shadows.emplace(state.settings);
    if (state.sky) state.sky = std::make_unique<SkyLight>(state.settings);
    return check_gl("move the sun");
}

Result<void> TerrainRenderer::set_point_lights(std::span<const PointLight> lights) {
    State& state = *state_;
    TERRANE_TRY(check_point_lights(lights));
    const HostState host(state.is_hosted);
    TERRANE_TRY(state.choose_lighting(!lights.empty()));
    state.point_lights.set(lights);
    return check_gl("set the point lights");
}

void TerrainRenderer::set_wireframe(bool is_on) { state_->settings.wireframe = is_on; }

void TerrainRenderer::set_ground_marks(std::function<GroundMark(const MeshChunk&)> mark_of) {
    state_->has_marks = mark_of != nullptr;
    if (mark_of == nullptr) {
        state_->draws.set_marks(nullptr);
        return;
    }
    state_->draws.set_marks([mark_of = std::move(mark_of)](const MeshChunk& chunk) {
        const GroundMark mark = mark_of(chunk);
        const auto byte = [](float value) {
            return static_cast<std::uint8_t>(255.0f * std::clamp(value, 0.0f, 1.0f) + 0.5f);
        };
        return MarkBytes{byte(mark.colour.red), byte(mark.colour.green), byte(mark.colour.blue),
                         byte(mark.opacity)};
    });
}

void TerrainRenderer::set_flat_materials(bool is_on) {
    if (state_->materials) state_->materials->set_flat(state_->settings, is_on);
}

Result<void> TerrainRenderer::set_time(double seconds) {
    if (!std::isfinite(seconds))
        return fail(ErrorCode::invalid_argument,
                    "the time must be finite, got " + number_text(seconds));
    state_->time = seconds;
    return {};
}

Result<MeshId> TerrainRenderer::add_mesh(const TriangleMesh& mesh,
                                         std::span<const MeshLevel> levels,
                                         const MeshMaterial& material) {
    return add_mesh(mesh, levels, std::span(&material, 1));
}

Result<MeshId> TerrainRenderer::add_mesh(const TriangleMesh& mesh,
                                         std::span<const MeshLevel> levels,
                                         std::span<const MeshMaterial> materials) {
    const HostState host(state_->is_hosted);
    return state_->scene.add_mesh(mesh, levels, materials);
}

void TerrainRenderer::remove_mesh(MeshId mesh) {
    const HostState host(state_->is_hosted);
    state_->scene.remove_mesh(mesh);
}

Result<ImpostorId> TerrainRenderer::add_impostor(MeshId mesh, const ImpostorSettings& settings) {
    const HostState host(state_->is_hosted);
    return state_->scene.add_impostor(mesh, settings);
}

void TerrainRenderer::remove_impostor(ImpostorId impostor) {
    const HostState host(state_->is_hosted);
    state_->scene.remove_impostor(impostor);
}

Result<ParticleImageId> TerrainRenderer::add_particle_image(
    std::shared_ptr<const TextureImage> image) {
    const HostState host(state_->is_hosted);
    return state_->scene.add_particle_image(std::move(image));
}

void TerrainRenderer::remove_particle_image(ParticleImageId image) {
    const HostState host(state_->is_hosted);
    state_->scene.remove_particle_image(image);
}

Result<InstanceDevice*> TerrainRenderer::instance_device() {
    TERRANE_TRY(GpuInstances* const made, state_->scene.instance_device(state_->is_hosted));
    return made;
}

std::optional<SunShadows> TerrainRenderer::shadows() const {
    const RendererSettings& settings = state_->settings;
    if (!(settings.shadow_distance > 0.0)) return {};
    return SunShadows{.sun_direction = settings.sun_direction,
                      .distance = settings.shadow_distance};
}

const DrawCounts& TerrainRenderer::counts() const { return state_->counts; }

Image TerrainRenderer::read() const {
    const HostState host(state_->is_hosted);
    return state_->picture.read();
}

Result<void> TerrainRenderer::present(const PresentTarget& target) {
    if (target.width_px < 1 || target.height_px < 1) {
        return fail(ErrorCode::invalid_argument,
                    "the sides of a rectangle must be at least 1 pixel, got " +
                        std::to_string(target.width_px) + " x " + std::to_string(target.height_px));
    }
    const HostState host(state_->is_hosted);
    state_->picture.copy_to(target.framebuffer, target.x, target.y, target.width_px,
                            target.height_px);
    return check_gl("show the picture");
}

int TerrainRenderer::sample_count() const { return state_->picture.sample_count(); }

std::size_t TerrainRenderer::buffer_bytes() const {
    return state_->draws.pool().bytes() + state_->solids.bytes() + state_->shade.light().bytes() +
           state_->scene.bytes() + (state_->shadows ? state_->shadows->bytes() : 0) +
           (state_->imagery ? state_->imagery->bytes() : 0) +
           (state_->sky ? state_->sky->bytes() : 0) +
           (state_->materials ? state_->materials->bytes() : 0);
}

}  // namespace terrane
