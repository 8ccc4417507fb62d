// SPDX-License-Identifier: MIT
#include "drop/drop_film.h"

#include "world/body_objects.h"

#include <utility>

namespace terrane::tools {
namespace {

const std::vector<std::string> kColumns{"awake", "touching_pairs", "depth_m"};

}  // namespace

DropFilm::DropFilm(const FlightOptions& options, FrameMaker maker, FlightOutput output,
                   DropCamera camera)
    : options_(options),
      maker_(std::move(maker)),
      output_(std::move(output)),
      camera_(std::move(camera)) {}

Result<DropFilm> DropFilm::create(const FlightOptions& options, const Terrain& terrain,
                                  const World& world) {
    Result<FrameMaker> maker = FrameMaker::create(terrain.source, frame_maker_settings(options));
    if (!maker) return tl::unexpected(maker.error());
    Result<FlightOutput> output = FlightOutput::create(options, terrain, kColumns);
    if (!output) return tl::unexpected(output.error());
    DropCamera camera(terrain.source, world.states());
    maker->load_until_stable(camera.view(make_view(options.size, options.fov_deg)), {}, 0.0);
    return DropFilm(options, std::move(*maker), std::move(*output), std::move(camera));
}

Result<void> DropFilm::show(const World& world, const StepReport& report, double time) {
    const View picture = make_view(options_.size, options_.fov_deg);
    for (;;) {
        const double due = static_cast<double>(output_.frames().size()) / options_.fps;
        if (due > time) return {};
        if (due > 0.0) camera_.follow(world.states(), 1.0 / options_.fps);
        const View view = camera_.view(picture);
        MadeFrame frame = maker_.make({.view = view, .velocity = camera_.velocity()}, {}, due);
        frame.record.extra = {static_cast<double>(report.awake),
                              static_cast<double>(report.touching_pairs), report.max_depth_m};
        objects_.clear();
        for (std::size_t body = 0; body < world.states().size(); ++body) {
            add_objects(world.settings()[body].shape, world.states()[body], objects_);
        }
        const Result<void> added = output_.add(std::move(frame), view, objects_);
        if (!added) return added;
    }
}

Result<void> DropFilm::finish(const std::string& title, nlohmann::ordered_json& summary) {
    // the report also shows the cost of the frames; the summary of the drop does not
    nlohmann::ordered_json of_frames = summary;
    of_frames.update(summarize(output_.frames(), options_.memory_bytes(), options_.fps));
    if (const Result<void> ended = output_.finish(title, of_frames); !ended) return ended;
    for (const char* key : {"frames", "renderer", "samples", "out"}) summary[key] = of_frames[key];
    return {};
}

}  // namespace terrane::tools
