// SPDX-License-Identifier: MIT
#pragma once

#include "flight/film.h"
#include "flight/flight_options.h"
#include "flight/window.h"

#include <terrane/render/terrain_renderer.h>

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace terrane::tools {

/// The settings of the pictures that options ask for. Fails as georeference_of(), and with invalid_argument for a place
/// without longitude.
///
/// @param is_software see GlContext::is_software()
Result<RendererSettings> picture_settings(const FlightOptions& options, const Terrain& terrain,
                                          bool is_software);

/// A point light of pictures.
struct PlacedLight {
    WorldPos position_world = WorldPos::Zero();
    double strength = 0.0;  ///< the red of PointLight::intensity
    friend bool operator==(const PlacedLight&, const PlacedLight&) = default;
};

/// The point lights of the options. Fails with invalid_argument for a place without ground.
Result<std::vector<PlacedLight>> placed_lights(const FlightOptions& options,
                                               const HeightSource& source);
/// The inverse: the value of --light for a light.
LightPlace light_place(const PlacedLight& light, const HeightSource& source);

/// Gives lights to a renderer. They are warm white, and end where 1 % of white would be left.
/// Fails as TerrainRenderer::set_point_lights()
Result<void> set_lights(TerrainRenderer& renderer, std::span<const PlacedLight> lights);

/// The triangulator that --triangulator chooses for a context; none for the CPU.
///
/// Fails as GpuTriangulator::create(), unless the choice is automatic
Result<std::optional<GpuTriangulator>> make_device_triangulator(const FlightOptions& options,
                                                                const GlContext& context,
                                                                const HeightSource& source);

/// Gives the instances of a scene to the renderer's device, beside a device that triangulates.
///
/// Fails as TerrainRenderer::instance_device()
Result<void> set_instance_device(TerrainRenderer& renderer, Scene& scene);

/// Draws frames, off screen or in a window, and writes them as PNG files and as a film, according to the options.
class FlightPictures {
public:
    /// Fails with device_unavailable if no device can be opened, io if the film cannot be created.
    ///
    /// @param folder of pictures and film; null if there are none
    static Result<FlightPictures> create(const FlightOptions& options, const Terrain& terrain,
                                         const std::shared_ptr<OutputFolder>& folder);

    /// Draws a frame and writes it. Fails with io.
    ///
    /// @return milliseconds from the draw call until the picture has been read, or shown if there are no files
    Result<double> add(std::size_t frame, const MadeFrame& made, const View& view);

    /// The renderer, for adding meshes of objects.
    TerrainRenderer& renderer() { return renderer_; }
    /// What triangulates on the device; null if the CPU does.
    GpuTriangulator* triangulator() { return triangulator_ ? &*triangulator_ : nullptr; }

    /// Whether the user closed the window.
    bool is_closed() const { return window_ && window_->is_closed(); }

    /// Completes the film. Fails with io.
    Result<void> finish();

    /// Samples per pixel.
    int sample_count() const { return renderer_.sample_count(); }

    const std::string& renderer_name() const { return context_.renderer_name(); }

private:
    FlightPictures(std::optional<Window> window, GlContext context, TerrainRenderer renderer,
                   double fps);

    std::optional<Window> window_;  // whose context the renderer draws in, if there is one
    GlContext context_;             // the renderer's objects live in it
    TerrainRenderer renderer_;
    std::optional<GpuTriangulator> triangulator_;
    double fps_;
    std::optional<Film> film_;
    std::shared_ptr<OutputFolder> picture_folder_;  // null without --png
};

/// Name of the film beside frames.csv.
inline constexpr const char* kFilmName = "flight.mp4";

}  // namespace terrane::tools
