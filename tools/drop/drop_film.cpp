// SPDX-License-Identifier: MIT
#include "drop/drop_film.h"

#include <utility>

namespace terrane::tools {
namespace {

constexpr float kAsleep = 0.55f;  // of its colour that a body at rest is drawn in
const std::vector<std::string> kColumns{"awake", "touching_pairs", "depth_m"};

Colour times(const Colour& colour, float share) {
    return {share * colour.red, share * colour.green, share * colour.blue};
}

// What a body looks like: at most three objects.
void add_objects(const Shape& shape, const BodyState& state, std::vector<DrawnObject>& objects) {
    using Form = DrawnObject::Form;
    const float share = state.condition == BodyCondition::asleep ? kAsleep : 1.0f;
    const Pose& pose = state.pose;
    if (const auto* sphere = std::get_if<Sphere>(&shape)) {
        objects.push_back({Form::ball, pose, Eigen::Vector3d::Constant(sphere->radius),
                           times({0.90f, 0.45f, 0.10f}, share)});
    } else if (const auto* capsule = std::get_if<Capsule>(&shape)) {
        const Colour colour = times({0.15f, 0.45f, 0.85f}, share);
        objects.push_back(
            {Form::tube, pose, {capsule->radius, capsule->radius, capsule->half_height}, colour});
        for (const double end : {-capsule->half_height, capsule->half_height}) {
            objects.push_back({Form::ball,
                               {pose.rotation, pose * Eigen::Vector3d(0.0, 0.0, end)},
                               Eigen::Vector3d::Constant(capsule->radius),
                               colour});
        }
    } else if (const auto* box = std::get_if<Box>(&shape)) {
        objects.push_back(
            {Form::box, pose, box->half_extents, times({0.93f, 0.90f, 0.82f}, share)});
    }
}

}  // namespace

DropFilm::DropFilm(const FlightOptions& options, const DropLayout& layout, FrameMaker maker,
                   FlightOutput output, DropCamera camera)
    : options_(options),
      layout_(layout),
      maker_(std::move(maker)),
      output_(std::move(output)),
      camera_(std::move(camera)) {}

Result<DropFilm> DropFilm::create(const FlightOptions& options, const DropLayout& layout,
                                  std::shared_ptr<const HeightSource> source,
                                  const BodyWorld& world) {
    Result<FrameMaker> maker = FrameMaker::create(source, frame_maker_settings(options));
    if (!maker) return tl::unexpected(maker.error());
    Result<FlightOutput> output = FlightOutput::create(options, *source, kColumns);
    if (!output) return tl::unexpected(output.error());
    DropCamera camera(source, world.states());
    maker->settle(camera.view(make_view(options.size, options.fov_deg)), {}, 0.0);
    return DropFilm(options, layout, std::move(*maker), std::move(*output), std::move(camera));
}

Result<void> DropFilm::show(const BodyWorld& world, const StepReport& report, double time) {
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
            add_objects(shape_of_body(layout_, body), world.states()[body], objects_);
        }
        const Result<void> added = output_.add(std::move(frame), view, objects_);
        if (!added) return added;
    }
}

Result<void> DropFilm::finish(const std::string& title, nlohmann::ordered_json& summary) {
    // The report shows what the frames cost too; what was dropped stays as it was counted.
    nlohmann::ordered_json of_frames = summary;
    of_frames.update(summarize(output_.frames(), options_.memory_bytes(), options_.fps));
    if (const Result<void> ended = output_.finish(title, of_frames); !ended) return ended;
    for (const char* key : {"frames", "renderer", "out"}) summary[key] = of_frames[key];
    return {};
}

}  // namespace terrane::tools
