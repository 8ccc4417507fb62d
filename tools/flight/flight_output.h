// SPDX-License-Identifier: MIT
#pragma once

#include "flight/pictures.h"
#include "frames/body_nodes.h"
#include "frames/flight_log.h"
#include "frames/frame_maker.h"
#include "program/output_file.h"
#include "program/progress.h"

#include <nlohmann/json.hpp>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace terrane::tools {

/// The objects and nodes of a terrain's scene. Prints a note about nodes below the ground.
///
/// @param renderer receives the meshes; null if no frames are drawn
///
/// Fails: as ObjectField::create() and ObjectField::add_nodes()
Result<std::unique_ptr<ObjectField>> make_object_field(const FlightOptions& options,
                                                       const Terrain& terrain,
                                                       TerrainRenderer* renderer);

/// All files of a flight: frames.csv, pictures, film and report. Without --out it writes none and keeps the frames for
/// the summary only.
class FlightOutput {
public:
    /// Creates the folder and removes the files of earlier runs: see OutputFolder. From then on the first Ctrl-C ends
    /// the flight after the current frame.
    ///
    /// Fails with io, naming the path; device_unavailable if pictures are requested and no device can be opened.
    static Result<FlightOutput> create(const FlightOptions& options, const Terrain& terrain,
                                       std::vector<std::string> extra_columns = {});

    /// Adds the objects and nodes of a terrain's scene, if any, to the frames of a maker, which from then on
    /// triangulates as --triangulator says. The maker must make no frame after the output's end.
    ///
    /// Fails: as ObjectField::create() and ObjectField::add_nodes()
    Result<void> add_objects(const Terrain& terrain, FrameMaker& maker);
    /// The same for frames with bodies, which are shown by the result.
    Result<BodyNodes> add_bodies(const Terrain& terrain, FrameMaker& maker);

    /// Logs a frame, and draws it if pictures are requested. Fails with io.
    Result<void> add(MadeFrame frame, const View& view);

    /// Whether the user closed the window or interrupted the program.
    bool is_closed() const { return is_interrupted() || (pictures_ && pictures_->is_closed()); }

    std::span<const FrameRecord> frames() const { return log_.frames(); }

    /// Completes all files, renames them to their final names, and writes the report. Adds renderer, samples and out to
    /// the summary, and `interrupted` if the program was interrupted.
    ///
    /// Fails with io; with cancelled, leaving no file, if the program was interrupted before the first frame.
    ///
    /// @param title of the report
    Result<void> finish(const std::string& title, nlohmann::ordered_json& summary);

    /// Call after finish(): fails if the flight was interrupted.
    ///
    /// @param frame_count planned number of frames
    CommandResult<void> verdict(std::size_t frame_count) const;

private:
    FlightOutput(const FlightOptions& options, std::shared_ptr<OutputFolder> folder, FlightLog log);
    TerrainRenderer* renderer() { return pictures_ ? &pictures_->renderer() : nullptr; }

    FlightOptions options_;
    std::shared_ptr<OutputFolder> folder_;  // null without --out
    FlightLog log_;
    std::unique_ptr<FlightPictures> pictures_;  // null: none
};

}  // namespace terrane::tools
