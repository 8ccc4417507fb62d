// SPDX-License-Identifier: MIT
#pragma once

#include "flight/film.h"
#include "flight/flight_options.h"

#include <terrane/collision/vehicle.h>
#include <terrane/collision/world.h>
#include <terrane/render/terrain_renderer.h>

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace terrane::tools {

/// Appends the solids that show a body; a hull is shown by its edges. Sleeping bodies are darker, static ones grey.
void add_objects(const Shape& shape, const BodyState& state, std::vector<DrawnObject>& objects);

/// Appends the solids that show a shape, in one colour.
void add_objects(const Shape& shape, const Pose& pose, const Colour& colour,
                 std::vector<DrawnObject>& objects);

/// Appends the solids that show a vehicle: chassis box, bodywork, wheels, and the belts of a tracked vehicle.
void add_vehicle_objects(const VehicleSettings& settings, const VehicleState& state,
                         std::vector<DrawnObject>& objects);

/// Draws frames off screen; writes them as PNG files and as a film, and shows them in a window, according to the
/// options.
class FlightPictures {
public:
    /// Fails with device_unavailable if no device can be opened, io if the film cannot be created.
    ///
    /// @param folder of pictures and film; null if there are none
    static Result<FlightPictures> create(const FlightOptions& options, const Terrain& terrain,
                                         const std::shared_ptr<OutputFolder>& folder);

    /// Draws a frame and writes it. Fails with io.
    ///
    /// @return milliseconds from the draw call until the picture has been read
    Result<double> add(std::size_t frame, const MadeFrame& made, const View& view,
                       std::span<const DrawnObject> objects = {});

    /// The renderer, for adding meshes of objects.
    TerrainRenderer& renderer() { return renderer_; }

    /// Whether the user closed the window.
    bool is_closed() const { return window_ && window_->is_closed(); }

    /// Completes the film. Fails with io.
    Result<void> finish();

    /// Samples per pixel.
    int sample_count() const { return renderer_.sample_count(); }

    const std::string& renderer_name() const { return context_.renderer_name(); }

private:
    FlightPictures(EglContext context, TerrainRenderer renderer, double fps);

    EglContext context_;  // the renderer's objects live in it
    TerrainRenderer renderer_;
    double fps_;
    std::optional<Film> film_;
    std::optional<Window> window_;
    std::shared_ptr<OutputFolder> picture_folder_;  // null without --png
};

/// Name of the film beside frames.csv.
inline constexpr const char* kFilmName = "flight.mp4";

}  // namespace terrane::tools
