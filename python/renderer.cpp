// SPDX-License-Identifier: MIT
//
// A renderer with an OpenGL context of its own; pictures are returned as arrays.
#include "conversions.h"
#include "terrain.h"

#include <terrane/render/terrain_renderer.h>

#include <pybind11/stl.h>

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace terrane::python {
namespace {

// An OpenGL context and its renderer, in order of construction.
struct Drawing {
    EglContext context;
    TerrainRenderer renderer;
};

class HeldRenderer {
public:
    explicit HeldRenderer(Drawing drawing)
        : drawing_(std::make_unique<Drawing>(std::move(drawing))) {}
    HeldRenderer(const HeldRenderer&) = delete;
    HeldRenderer& operator=(const HeldRenderer&) = delete;
    // OpenGL objects can only be freed on their own thread. If the destructor runs on another one, such as a garbage
    // collector's, they are leaked.
    ~HeldRenderer() {
        if (std::this_thread::get_id() == thread_) {
            if (drawing_ != nullptr) drawing_->context.make_current();
        } else {
            (void)drawing_.release();
        }
    }

    Drawing& use() {
        if (std::this_thread::get_id() != thread_)
            throw std::runtime_error("this Renderer belongs to the thread that made it");
        if (drawing_ == nullptr) throw py::value_error("this Renderer is closed");
        drawing_->context.make_current();
        return *drawing_;
    }
    void close() {
        if (drawing_ == nullptr) return;
        use();
        drawing_.reset();
    }
    bool is_closed() const { return drawing_ == nullptr; }

private:
    std::unique_ptr<Drawing> drawing_;
    std::thread::id thread_ = std::this_thread::get_id();
};

Colour read_colour(const std::array<float, 3>& colour) { return {colour[0], colour[1], colour[2]}; }

std::unique_ptr<HeldRenderer> make_renderer(
    int width_px, int height_px, const py::object& sun_direction, double haze_distance,
    bool wireframe, int sample_count, double tint_low, double tint_high,
    const std::array<float, 3>& horizon_colour, const std::array<float, 3>& zenith_colour,
    double shadow_distance, int shadow_texels, std::optional<double> water_level, double sun_radius,
    bool atmosphere, double exposure_stops, bool smooth_edges) {
    const RendererSettings settings{.sun_direction = read_vector(sun_direction, "sun_direction"),
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
                                    .water_level = water_level};
    EglContext context = value_or_raise(without_lock([] { return EglContext::create(); }));
    Result<TerrainRenderer> renderer = without_lock(
        [&] { return TerrainRenderer::create(context, width_px, height_px, settings); });
    return std::make_unique<HeldRenderer>(
        Drawing{std::move(context), value_or_raise(std::move(renderer))});
}

// Solids: (form, position, half extents, rotation, colour).
using SolidArgument =
    std::tuple<std::string, py::object, py::object, py::object, std::array<float, 3>>;
constexpr std::array<std::pair<const char*, DrawnObject::Form>, 3> kForms{
    {{"box", DrawnObject::Form::box},
     {"ellipsoid", DrawnObject::Form::ellipsoid},
     {"cylinder", DrawnObject::Form::cylinder}}};

std::vector<DrawnObject> read_solids(const std::vector<SolidArgument>& arguments) {
    std::vector<DrawnObject> solids;
    for (const auto& [form, position, extents, rotation, colour] : arguments) {
        solids.push_back({.form = read_choice(form, "the form of a solid", kForms),
                          .world_from_object = read_pose(position, rotation),
                          .extents = read_vector(extents, "the extents of a solid"),
                          .colour = read_colour(colour)});
    }
    return solids;
}

py::array draw(HeldRenderer& held, const Mesh& mesh, const View& view,
               const std::vector<SolidArgument>& solids) {
    const std::vector<DrawnObject> objects = read_solids(solids);
    Drawing& drawing = held.use();
    const auto use = mesh.use();
    Image image;
    value_or_raise(without_lock([&] {
        Result<void> drawn = drawing.renderer.draw(mesh.mesh, view, objects);
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

}  // namespace

void bind_renderer(py::module_& module) {
    const RendererSettings defaults;
    const Eigen::Vector3d sun = defaults.sun_direction;
    const auto colour = [](const Colour& c) { return std::array{c.red, c.green, c.blue}; };
    py::class_<HeldRenderer>(
        module, "Renderer",
        R"(Draws meshes off screen with OpenGL, without a window system. For the thread that made it, else RuntimeError; a closed
one is a ValueError. A context manager: close it on its thread, or its memory is not freed.)")
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

Raises RuntimeError where no OpenGL device opens, ValueError for a setting out of range.)")
        .def(
            "draw", &draw, py::arg("mesh"), py::arg("view"),
            py::arg("solids") = std::vector<SolidArgument>(),
            R"(Draws a frame: uint8 of shape (height, width, 3), red, green, blue, row 0 at the top. Without the lock.

mesh    of the view, before its Terrain's next update()
view    a View of the renderer's size
solids  a list of (form, position, extents, rotation, colour): "box", "ellipsoid" or "cylinder"; half extents of shape (3,), metres)")
        .def_property_readonly(
            "device", [](HeldRenderer& held) { return held.use().context.renderer_name(); },
            "Name of the OpenGL device.")
        .def("close", &HeldRenderer::close, "Frees its objects. Nothing where it is closed.")
        .def_property_readonly("closed", &HeldRenderer::is_closed, "Whether close() was called.")
        .def("__enter__", [](py::object self) { return self; })
        .def("__exit__", [](HeldRenderer& held, const py::args&) { held.close(); });
}

}  // namespace terrane::python
