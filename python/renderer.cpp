// SPDX-License-Identifier: MIT
//
// A renderer with an OpenGL context of its own; pictures are returned as arrays.
#include "renderer.h"

#include "conversions.h"
#include "scene.h"
#include "terrain.h"

#include <terrane/render/terrain_renderer.h>

#include <pybind11/stl.h>

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace terrane::python {

HeldRenderer::HeldRenderer(Drawing drawing)
    : drawing_(std::make_unique<Drawing>(std::move(drawing))) {}

HeldRenderer::~HeldRenderer() {
    if (std::this_thread::get_id() == thread_) {
        if (drawing_ != nullptr) drawing_->context.make_current();
    } else {
        (void)drawing_.release();
    }
}

Drawing& HeldRenderer::use() {
    if (std::this_thread::get_id() != thread_)
        throw std::runtime_error("this Renderer belongs to the thread that made it");
    if (drawing_ == nullptr) throw py::value_error("this Renderer is closed");
    drawing_->context.make_current();
    return *drawing_;
}

Drawing* HeldRenderer::find() {
    if (std::this_thread::get_id() != thread_ || drawing_ == nullptr) return nullptr;
    return &use();
}

void HeldRenderer::close() {
    if (drawing_ == nullptr) return;
    use();
    drawing_.reset();
}

namespace {

Colour read_colour(const std::array<float, 3>& colour) { return {colour[0], colour[1], colour[2]}; }

constexpr std::array<std::pair<const char*, GroundPalette>, 5> kPalettes{
    {{"alpine", GroundPalette::alpine},
     {"temperate", GroundPalette::temperate},
     {"desert", GroundPalette::desert},
     {"moon", GroundPalette::moon},
     {"imagery", GroundPalette::imagery}}};

std::optional<GroundLookSettings> read_look(const std::optional<std::string>& palette,
                                            std::optional<double> snow_line,
                                            std::optional<double> rock_slope, double occlusion,
                                            int anisotropy) {
    if (palette) {
        return GroundLookSettings{.palette = read_choice(*palette, "ground_look", kPalettes),
                                  .snow_line = snow_line,
                                  .rock_slope = rock_slope,
                                  .occlusion = occlusion,
                                  .anisotropy = anisotropy};
    }
    if (snow_line || rock_slope)
        throw py::value_error("snow_line and rock_slope need a ground_look, got None");
    return {};
}

std::shared_ptr<HeldRenderer> make_renderer(
    int width_px, int height_px, const py::object& sun_direction, double haze_distance,
    bool wireframe, int sample_count, double tint_low, double tint_high,
    const std::array<float, 3>& horizon_colour, const std::array<float, 3>& zenith_colour,
    double shadow_distance, int shadow_texels, std::optional<double> water_level, double sun_radius,
    bool atmosphere, double exposure_stops, bool smooth_edges, bool has_waves,
    const std::optional<std::string>& ground_look, std::optional<double> snow_line,
    std::optional<double> rock_slope, double occlusion, int anisotropy, const HeldImagery* imagery,
    std::size_t imagery_bytes, bool imagery_waits, std::size_t texture_bytes) {
    const RendererSettings settings{
        .sun_direction = read_vector(sun_direction, "sun_direction"),
        .haze_distance = haze_distance,
        .wireframe = wireframe,
        .sample_count = sample_count,
        .tint_low = tint_low,
        .tint_high = tint_high,
        .horizon_colour = read_colour(horizon_colour),
        .zenith_colour = read_colour(zenith_colour),
        .shadow_distance = shadow_distance,
        .shadow_texels = shadow_texels,
        .sun_radius = sun_radius,
        .atmosphere = atmosphere,
        .exposure_stops = exposure_stops,
        .smooth_edges = smooth_edges,
        .water_level = water_level,
        .has_waves = has_waves,
        .ground_look = read_look(ground_look, snow_line, rock_slope, occlusion, anisotropy),
        .imagery = imagery == nullptr ? nullptr : imagery->source,
        .imagery_bytes = imagery_bytes,
        .imagery_waits = imagery_waits,
        .texture_bytes = texture_bytes};
    GlContext context = value_or_raise(without_lock([] { return GlContext::create(); }));
    Result<TerrainRenderer> renderer = without_lock(
        [&] { return TerrainRenderer::create(context, width_px, height_px, settings); });
    return std::make_shared<HeldRenderer>(
        Drawing{std::move(context), value_or_raise(std::move(renderer))});
}

py::array draw(HeldRenderer& held, const Mesh& mesh, const View& view, SceneUse* scene) {
    Drawing& drawing = held.use();
    const auto use = mesh.use();
    std::optional<SceneUse::Use> of_scene;
    if (scene != nullptr) {
        of_scene.emplace(*scene, true);
        if ((*of_scene)->uploaded->renderer() != &held)
            throw py::value_error("scene is a Scene of another Renderer");
    }
    Image image;
    value_or_raise(without_lock([&] {
        SceneDraws draws;
        if (of_scene) {
            const TriangulatorSettings& settings = mesh.terrain->meshes;
            draws = draws_within((*of_scene)->scene, view, mesh.mesh, settings.triangle_budget,
                                 settings.max_error_px, drawing.renderer.shadows());
        }
        Result<void> drawn = drawing.renderer.draw(mesh.mesh, view, draws);
        if (drawn) image = drawing.renderer.read();
        return drawn;
    }));
    // The array takes ownership of the picture's memory.
    auto kept = std::make_unique<Image>(std::move(image));
    const std::vector<py::ssize_t> shape{kept->height, kept->width, 3};
    const std::uint8_t* const rgb = kept->rgb.data();
    const py::capsule owner(kept.release(), [](void* data) { delete static_cast<Image*>(data); });
    return py::array_t<std::uint8_t>(shape, rgb, owner);
}

using RendererClass = py::class_<HeldRenderer, std::shared_ptr<HeldRenderer>>;

void bind_renderer(RendererClass& renderer) {
    const RendererSettings defaults;
    const GroundLookSettings look;
    const Eigen::Vector3d sun = defaults.sun_direction;
    const auto colour = [](const Colour& c) { return std::array{c.red, c.green, c.blue}; };
    renderer
        .def(py::init(&make_renderer), py::arg("width_px"), py::arg("height_px"), py::kw_only(),
             py::arg("sun_direction") = py::make_tuple(sun.x(), sun.y(), sun.z()),
             py::arg("haze_distance") = defaults.haze_distance,
             py::arg("wireframe") = defaults.wireframe,
             py::arg("sample_count") = defaults.sample_count,
             py::arg("tint_low") = defaults.tint_low, py::arg("tint_high") = defaults.tint_high,
             py::arg("horizon_colour") = colour(defaults.horizon_colour),
             py::arg("zenith_colour") = colour(defaults.zenith_colour),
             py::arg("shadow_distance") = defaults.shadow_distance,
             py::arg("shadow_texels") = defaults.shadow_texels, py::arg("water_level") = py::none(),
             py::arg("sun_radius") = defaults.sun_radius,
             py::arg("atmosphere") = defaults.atmosphere,
             py::arg("exposure_stops") = defaults.exposure_stops,
             py::arg("smooth_edges") = defaults.smooth_edges,
             py::arg("has_waves") = defaults.has_waves, py::arg("ground_look") = py::none(),
             py::arg("snow_line") = py::none(), py::arg("rock_slope") = py::none(),
             py::arg("occlusion") = look.occlusion, py::arg("anisotropy") = look.anisotropy,
             py::arg("imagery") = py::none(), py::arg("imagery_bytes") = defaults.imagery_bytes,
             py::arg("imagery_waits") = defaults.imagery_waits,
             py::arg("texture_bytes") = defaults.texture_bytes,
             R"(A renderer of pictures of one size.

sun_direction    towards the sun, shape (3,)
haze_distance    metres at which haze absorbs two thirds of the light
wireframe        draws the edges of the triangles
sample_count     per pixel, 1 to 16
tint_low, tint_high  heights of the tints of low and high ground, metres
horizon_colour, zenith_colour  colours of the sky: red, green, blue, 0 to 1
shadow_distance  within which the sun casts shadows, metres; 0: none
shadow_texels    along a shadow map, 256 to 8192
water_level      metres; None: no water
sun_radius       angular, of penumbrae, radians, 0 to 0.05; 0: sharp shadows
atmosphere       whether sky, haze and light come from scattering in the air
exposure_stops   correction of the exposure with an atmosphere, -20 to 20
smooth_edges     whether edges are smoothed where sample_count is 1
has_waves        whether the water moves with set_time(), and has a soft shore
ground_look      materials of the ground: "alpine", "temperate", "desert", "moon" or "imagery"; None: tints
snow_line        height above which there is snow, metres; None: by the ground_look
rock_slope       slope from which ground is rock, rise over run, 0 to 100; None: by the ground_look
occlusion        share of light that hollows lose with a ground_look, 0 to 1
anisotropy       largest one of the filter of a ground_look, 1 to 16
imagery          Imagery draped over the ground, or None
imagery_bytes    limit of the device's memory for imagery
imagery_waits    whether draw() waits for the imagery that it shows, as films need
texture_bytes    limit of the device's memory for textures of objects

Raises RuntimeError where no OpenGL device opens, ValueError for a setting out of range.)")
        .def(
            "draw", &draw, py::arg("mesh"), py::arg("view"), py::arg("scene") = py::none(),
            R"(Draws a frame: uint8 of shape (height, width, 3), red, green, blue, row 0 at the top. Without the lock.

mesh   of the view, before its Terrain's next update()
view   a View of the renderer's size
scene  a Scene of this renderer, as its nodes are now; None: ground alone. Its objects take the triangles that update()
       granted them; of an update() without the scene, those that the ground left of the budget)")
        .def(
            "set_time",
            [](HeldRenderer& held, double seconds) {
                value_or_raise(held.use().renderer.set_time(seconds));
            },
            py::arg("seconds"), "Sets the time of moving water for the next pictures, seconds.")
        .def_property_readonly(
            "device", [](HeldRenderer& held) { return held.use().context.renderer_name(); },
            "Name of the OpenGL device.")
        .def("close", &HeldRenderer::close, "Frees its objects. Nothing where it is closed.")
        .def_property_readonly("closed", &HeldRenderer::is_closed, "Whether close() was called.")
        .def("__enter__", [](py::object self) { return self; })
        .def("__exit__", [](HeldRenderer& held, const py::args&) { held.close(); });
}

}  // namespace

void bind_pictures(py::module_& module) {
    // both classes first: each names the other in its signatures
    RendererClass renderer(
        module, "Renderer",
        R"(Draws meshes and scenes off screen with OpenGL, without a window system. For the thread that made it, else
RuntimeError; a closed one is a ValueError. A context manager: close it on its thread, or its memory is not freed.)");
    SceneClass scene(
        module, "Scene",
        R"(A tree of nodes with objects, levels of detail, billboards and smoke, drawn by Renderer.draw(mesh, view, scene). In
Terrain.update(..., scene=scene) its objects share the triangle budget with the ground.

One thread at a time, else RuntimeError; a closed one is a ValueError. Models are added on the renderer's thread.)");
    bind_scene(scene, module);
    bind_renderer(renderer);
}

}  // namespace terrane::python
