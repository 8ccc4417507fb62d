// SPDX-License-Identifier: MIT
#include "flight/pictures.h"

#include "frames/flight_log.h"
#include "program/progress.h"

#include <terrane/base/text.h>
#include <terrane/dem/georeference.h>
#include <terrane/render/sun_position.h>

#include <GLFW/glfw3.h>

#include <chrono>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

constexpr double kSunRadius = 0.00465;  // angular, radians
// Haze distance of a clear day, metres: an aerosol optical depth of 0.05, and a visual range of 71 km.
constexpr double kClearDay = 20'000.0;
constexpr double kLeastRelief =
    1500.0;  // least height difference of lowest and highest tint, metres

const Eigen::Vector3d kLightColour(1.0, 0.86, 0.66);  // of point lights
constexpr double kLeastLight = 0.01;                  // at the end of their range

// Fits the tint range to the 2nd to 98th percentile of the heights.
void fit_tints(const Terrain& terrain, RendererSettings& settings) {
    constexpr int kProbes = 48;
    const HeightSource& source = *terrain.source;
    const WorldRect extent = work_region(terrain);
    std::vector<double> heights;
    for (int i = 0; i < kProbes * kProbes; ++i) {
        const int column = i % kProbes, row = i / kProbes;
        const double x = extent.west + (extent.east - extent.west) * (column + 0.5) / kProbes;
        const double y = extent.south + (extent.north - extent.south) * (row + 0.5) / kProbes;
        const double height = source.height(x, y);
        if (std::isfinite(height)) heights.push_back(height);
    }
    settings.tint_low = percentile(heights, 0.02);
    // no snow tint on low hills
    settings.tint_high = std::max(percentile(heights, 0.98), settings.tint_low + kLeastRelief);
}

// Direction to the sun that the options ask for; the renderer's default without one. Fails as georeference_of(), and
// with invalid_argument for a place without longitude.
Result<Eigen::Vector3d> sun_of(const FlightOptions& options, const Terrain& terrain) {
    if (options.sun_deg) {
        const double degree = std::numbers::pi / 180.0;
        return direction_to_sun({options.sun_deg->x() * degree, options.sun_deg->y() * degree});
    }
    const std::optional<double> time = parse_time(options.sun_time);
    if (!time) return RendererSettings().sun_direction;
    const Result<Georeference> georeference = georeference_of(terrain);
    if (!georeference) {
        return fail(ErrorCode::invalid_argument,
                    "--sun-time needs a raster with a CRS: " + georeference.error().message);
    }
    const WorldVec2 place = start_of(terrain);
    const Eigen::Vector3d lonlat = georeference->lonlat_from_world({place.x(), place.y(), 0.0});
    const double convergence = georeference->scale_at(place.x(), place.y()).convergence;
    if (!std::isfinite(lonlat.x()) || !std::isfinite(lonlat.y()) || !std::isfinite(convergence)) {
        return fail(ErrorCode::invalid_argument, "--sun-time: the place at " +
                                                     number_text(place.x()) + ", " +
                                                     number_text(place.y()) + " has no longitude");
    }
    return direction_to_sun(sun_position(*time, lonlat.x(), lonlat.y()), convergence);
}

// The ground's materials by the options and, where these say nothing, by the scene.
std::optional<GroundLookSettings> look_of(const FlightOptions& options, const Terrain& terrain) {
    if (!options.has_materials() && !terrain.materials) return {};
    const SceneMaterials of_scene = terrain.materials.value_or(SceneMaterials());
    GroundLookSettings look;
    look.palette = options.ground     ? *options.ground
                   : of_scene.palette ? *of_scene.palette
                   : terrain.imagery  ? GroundPalette::imagery
                                      : GroundPalette::alpine;
    const std::optional<double> snow_line = given(options.snow_line);
    look.snow_line = snow_line ? snow_line : of_scene.snow_line;
    look.rock_slope = of_scene.rock_slope;
    look.occlusion = of_scene.occlusion.value_or(look.occlusion);
    return look;
}

}  // namespace

Result<RendererSettings> picture_settings(const FlightOptions& options, const Terrain& terrain,
                                          bool is_software) {
    RendererSettings settings;
    fit_tints(terrain, settings);
    settings.sample_count = options.samples > 0 ? static_cast<int>(options.samples)
                            : is_software       ? 1
                                                : settings.sample_count;
    settings.shadow_distance = options.shadow_distance();
    TERRANE_TRY(settings.sun_direction, sun_of(options, terrain));
    if (options.look == Look::full) {
        settings.atmosphere = true;
        settings.smooth_edges = true;
        settings.sun_radius = kSunRadius;
        settings.haze_distance = kClearDay;
    }
    settings.has_waves = options.look == Look::full;
    if (terrain.water) {
        settings.water_level = terrain.water->level;
        settings.has_waves = terrain.water->has_waves.value_or(settings.has_waves);
    }
    if (!std::isnan(options.water_m)) settings.water_level = options.water_m;
    settings.ground_look = look_of(options, terrain);
    settings.imagery = terrain.imagery;
    settings.imagery_waits = !options.waits_for_clock();  // films need not keep real time
    return settings;
}

Result<std::vector<PlacedLight>> placed_lights(const FlightOptions& options,
                                               const HeightSource& source) {
    std::vector<PlacedLight> lights;
    for (const LightPlace& light : options.lights) {
        const double x = light.place.x(), y = light.place.y(), ground = source.height(x, y);
        if (!std::isfinite(ground)) {
            return fail(ErrorCode::invalid_argument,
                        "--light: there is no ground at " + number_text(x) + ", " + number_text(y));
        }
        lights.push_back({{x, y, ground + light.height}, light.strength});
    }
    return lights;
}

LightPlace light_place(const PlacedLight& light, const HeightSource& source) {
    const WorldPos& p = light.position_world;
    return {p.head<2>(), p.z() - source.height(p.x(), p.y()), light.strength};
}

Result<void> set_lights(TerrainRenderer& renderer, std::span<const PlacedLight> lights) {
    std::vector<PointLight> points;
    for (const PlacedLight& light : lights) {
        points.push_back({.position_world = light.position_world,
                          .intensity = light.strength * kLightColour,
                          .range = std::sqrt(light.strength / kLeastLight)});
    }
    return renderer.set_point_lights(points);
}

Result<std::optional<GpuTriangulator>> make_device_triangulator(const FlightOptions& options,
                                                                const GlContext& context,
                                                                const HeightSource& source) {
    using Made = std::optional<GpuTriangulator>;
    const bool is_automatic = options.triangulator == TriangulatorChoice::automatic;
    if (options.triangulator == TriangulatorChoice::cpu || (is_automatic && context.is_software()))
        return Made();
    Result<GpuTriangulator> made =
        GpuTriangulator::create(context, source, frame_maker_settings(options).triangulator);
    if (made) return Made(*std::move(made));
    if (is_automatic) return Made();
    return fail(made.error().code, "--triangulator gpu: " + made.error().message);
}

Result<void> set_instance_device(TerrainRenderer& renderer, Scene& scene) {
    TERRANE_TRY(internal::InstanceDevice* const device, renderer.instance_device());
    scene.set_device(device);
    return {};
}

FlightPictures::FlightPictures(std::optional<Window> window, GlContext context,
                               TerrainRenderer renderer, double fps)
    : window_(std::move(window)),
      context_(std::move(context)),
      renderer_(std::move(renderer)),
      fps_(fps) {}

Result<FlightPictures> FlightPictures::create(const FlightOptions& options, const Terrain& terrain,
                                              const std::shared_ptr<OutputFolder>& folder) {
    std::optional<Window> window;
    if (options.window) {
        TERRANE_TRY(window,
                    Window::create("terrane", options.size.width_px, options.size.height_px));
    }
    TERRANE_TRY(GlContext context, window ? GlContext::adopt_current() : GlContext::create());
    TERRANE_TRY(const RendererSettings settings,
                picture_settings(options, terrain, context.is_software()));
    TERRANE_TRY(
        TerrainRenderer renderer,
        TerrainRenderer::create(context, options.size.width_px, options.size.height_px, settings));
    TERRANE_TRY(const std::vector<PlacedLight> lights, placed_lights(options, *terrain.source));
    TERRANE_TRY(set_lights(renderer, lights));
    FlightPictures pictures(std::move(window), std::move(context), std::move(renderer),
                            options.fps);
    TERRANE_TRY(pictures.triangulator_,
                make_device_triangulator(options, pictures.context_, *terrain.source));
    if (options.png) pictures.picture_folder_ = folder;
    if (options.video) {
        TERRANE_TRY(Film film, Film::create(OutputPlace(folder, kFilmName), options.size.width_px,
                                            options.size.height_px, options.fps));
        pictures.film_.emplace(std::move(film));
    }
    return pictures;
}

Result<double> FlightPictures::add(std::size_t frame, const MadeFrame& made, const View& view) {
    const auto start = std::chrono::steady_clock::now();
    TERRANE_TRY(renderer_.set_time(static_cast<double>(frame) / fps_));
    TERRANE_TRY(renderer_.draw(made.mesh, view, made.draws));
    const bool has_files = picture_folder_ != nullptr || film_;
    const Image image = has_files || !window_ ? renderer_.read() : Image();
    if (window_) {
        TERRANE_TRY(window_->draw(renderer_));
        TERRANE_TRY(window_->show());
        for (const WindowInput::Press& key : window_->take_input().keys) {
            if (key.number == GLFW_KEY_ESCAPE) window_->close();
        }
    }
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - start;
    if (picture_folder_ != nullptr) {
        const std::string name = frame_name(frame);
        const std::string path = picture_folder_->path_of(name);
        const RemovedIfKilled part(path + ".part");  // the name that write_png() uses
        TERRANE_TRY(write_png(image, path));
        TERRANE_TRY(picture_folder_->record(path, name));
    }
    if (film_) {
        TERRANE_TRY(film_->add(image));
    }
    return taken.count();
}

Result<void> FlightPictures::finish() { return film_ ? film_->finish() : Result<void>{}; }

}  // namespace terrane::tools
