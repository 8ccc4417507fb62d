// SPDX-License-Identifier: MIT
#include "flight/flight_output.h"

#include "flight/report.h"
#include "program/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

namespace terrane::tools {

FlightOutput::FlightOutput(const FlightOptions& options, std::shared_ptr<OutputFolder> folder,
                           FlightLog log)
    : options_(options), folder_(std::move(folder)), log_(std::move(log)) {}

Result<FlightOutput> FlightOutput::create(const FlightOptions& options, const Terrain& terrain,
                                          std::vector<std::string> extra_columns) {
    if (options.ground == GroundPalette::imagery && terrain.imagery == nullptr) {
        return fail(
            ErrorCode::invalid_argument,
            "--ground imagery needs a scene with imagery, and " + terrain.name + " has none");
    }
    std::vector<std::string> names{kFramesName, kReportName};
    if (options.video) names.emplace_back(kFilmName);
    TERRANE_TRY(std::shared_ptr<OutputFolder> folder,
                OutputFolder::open(options.out, std::move(names), options.png));
    watch_for_interrupts();
    std::unique_ptr<FlightPictures> pictures;
    if (options.has_pictures()) {
        TERRANE_TRY(FlightPictures made, FlightPictures::create(options, terrain, folder));
        pictures = std::make_unique<FlightPictures>(std::move(made));
    }
    // removes the files of earlier runs last, when nothing else can fail
    std::optional<OutputPlace> csv;
    if (folder != nullptr) {
        TERRANE_TRY(folder->clear());
        csv.emplace(folder, kFramesName);
    }
    TERRANE_TRY(FlightLog log, FlightLog::create(csv, std::move(extra_columns)));
    FlightOutput output(options, std::move(folder), std::move(log));
    output.pictures_ = std::move(pictures);
    return output;
}

Result<std::unique_ptr<ObjectField>> make_object_field(const FlightOptions& options,
                                                       const Terrain& terrain,
                                                       TerrainRenderer* renderer) {
    TERRANE_TRY(ObjectField field,
                ObjectField::create(terrain.source,
                                    terrain.objects != nullptr ? *terrain.objects : SceneObjects(),
                                    {.max_error_px = options.max_error_px,
                                     .picture = make_view(options.size, options.fov_deg),
                                     .has_thread = options.threads > 0,
                                     .shadows = renderer ? renderer->shadows() : std::nullopt},
                                    renderer));
    if (terrain.nodes != nullptr) {
        TERRANE_TRY(field.add_nodes(*terrain.nodes, *terrain.source, renderer));
        // volumes may open the ground there
        if (terrain.volumes == nullptr && !field.buried().empty()) {
            print_note(fmt::format(
                "{}{}; \"on_ground\": true counts z from the ground", field.buried()[0],
                field.buried().size() > 1
                    ? fmt::format(", and {} more nodes are below it", field.buried().size() - 1)
                    : ""));
        }
    }
    return std::make_unique<ObjectField>(std::move(field));
}

Result<void> FlightOutput::add_objects(const Terrain& terrain, FrameMaker& maker) {
    if (pictures_) maker.set_device(pictures_->triangulator());
    if (terrain.objects == nullptr && terrain.nodes == nullptr) return {};
    TERRANE_TRY(std::unique_ptr<ObjectField> objects,
                make_object_field(options_, terrain, renderer()));
    if (pictures_ && pictures_->triangulator() != nullptr)
        TERRANE_TRY(set_instance_device(*renderer(), objects->scene()));
    maker.set_objects(std::move(objects));
    return {};
}

Result<BodyNodes> FlightOutput::add_bodies(const Terrain& terrain, FrameMaker& maker) {
    if (pictures_) maker.set_device(pictures_->triangulator());
    TERRANE_TRY(std::unique_ptr<ObjectField> objects,
                make_object_field(options_, terrain, renderer()));
    if (pictures_ && pictures_->triangulator() != nullptr)
        TERRANE_TRY(set_instance_device(*renderer(), objects->scene()));
    BodyNodes bodies(*objects, renderer(), options_.shows_proxies);
    bodies.set_meshes(terrain.bodies);
    maker.set_objects(std::move(objects));
    return bodies;
}

Result<void> FlightOutput::add(MadeFrame frame, const View& view) {
    if (pictures_) {
        TERRANE_TRY(const double drawn, pictures_->add(log_.frames().size(), frame, view));
        frame.record.draw_ms = drawn;
        frame.record.add_gpu_ms(renderer()->counts().gpu_ms);
    }
    return log_.add(std::move(frame.record));
}

Result<void> FlightOutput::finish(const std::string& title, nlohmann::ordered_json& summary) {
    if (is_interrupted()) {
        if (frames().empty())
            return fail(ErrorCode::cancelled, "interrupted before the first frame");
        summary["interrupted"] = true;
    }
    summary["renderer"] = pictures_ ? pictures_->renderer_name() : "none";
    if (pictures_ && pictures_->triangulator() != nullptr)
        summary["gpu_frames"] = std::ranges::count(frames(), true, &FrameRecord::is_from_device);
    if (pictures_) summary["samples"] = pictures_->sample_count();
    if (folder_ == nullptr) return {};
    summary["out"] = options_.out;
    if (pictures_) {
        TERRANE_TRY(pictures_->finish());
    }
    TERRANE_TRY(log_.commit());
    return write_flight_report(
        OutputPlace(folder_, kReportName),
        {.title = title, .film = options_.video ? kFilmName : "", .summary = summary}, log_,
        options_.memory_bytes());
}

CommandResult<void> FlightOutput::verdict(std::size_t frame_count) const {
    if (!is_interrupted() || frames().size() >= frame_count) return {};
    return failure(fmt::format("interrupted after {} of {} frames", frames().size(), frame_count));
}

}  // namespace terrane::tools
