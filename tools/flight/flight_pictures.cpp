// SPDX-License-Identifier: MIT
#include "flight/flight_pictures.h"

#include "frames/flight_log.h"
#include "output/interrupt.h"

#include <chrono>
#include <cmath>
#include <utility>
#include <vector>

namespace terrane::tools {
namespace {

constexpr double kLeastRelief = 1500.0;  // metres from the lowest to the highest tint

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

}  // namespace

FlightPictures::FlightPictures(EglContext context, TerrainRenderer renderer)
    : context_(std::move(context)), renderer_(std::move(renderer)) {}

Result<FlightPictures> FlightPictures::create(const FlightOptions& options, const Terrain& terrain,
                                              const std::shared_ptr<OutputFolder>& folder) {
    Result<EglContext> context = EglContext::create();
    if (!context) return tl::unexpected(context.error());
    RendererSettings settings;
    fit_tints(terrain, settings);
    settings.sample_count = options.samples > 0      ? static_cast<int>(options.samples)
                            : context->is_software() ? 1
                                                     : settings.sample_count;
    settings.shadow_distance = options.shadows;
    settings.water_level = terrain.water_m;
    settings.imagery = terrain.imagery;
    settings.imagery_waits = !options.waits_for_clock();  // films take the time that they need
    Result<TerrainRenderer> renderer =
        TerrainRenderer::create(*context, options.size.width_px, options.size.height_px, settings);
    if (!renderer) return tl::unexpected(renderer.error());
    FlightPictures pictures(std::move(*context), std::move(*renderer));
    if (options.png) pictures.picture_folder_ = folder;
    if (options.video) {
        Result<Film> film = Film::create(OutputPlace(folder, kFilmName), options.size.width_px,
                                         options.size.height_px, options.fps);
        if (!film) return tl::unexpected(film.error());
        pictures.film_.emplace(std::move(*film));
    }
    if (options.window) {
        Result<Window> window =
            Window::create("terrane", options.size.width_px, options.size.height_px);
        if (!window) return tl::unexpected(window.error());
        pictures.window_.emplace(std::move(*window));
        pictures.context_.make_current();
    }
    return pictures;
}

Result<double> FlightPictures::add(std::size_t frame, const MadeFrame& made, const View& view,
                                   std::span<const DrawnObject> objects) {
    const auto start = std::chrono::steady_clock::now();
    if (const Result<void> drawn = renderer_.draw(made.mesh, view, objects, made.draws); !drawn)
        return tl::unexpected(drawn.error());
    const Image image = renderer_.read();
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - start;
    if (window_) {
        window_->show(image);
        context_.make_current();
    }
    if (picture_folder_ != nullptr) {
        const std::string name = frame_name(frame);
        const std::string path = picture_folder_->path_of(name);
        const RemovedIfKilled part(path + ".part");  // as write_png() names it
        if (const Result<void> written = write_png(image, path); !written)
            return tl::unexpected(written.error());
        if (const Result<void> listed = picture_folder_->record(path, name); !listed)
            return tl::unexpected(listed.error());
    }
    if (film_) {
        if (const Result<void> added = film_->add(image); !added)
            return tl::unexpected(added.error());
    }
    return taken.count();
}

Result<void> FlightPictures::finish() { return film_ ? film_->finish() : Result<void>{}; }

}  // namespace terrane::tools
