// SPDX-License-Identifier: MIT
#pragma once

#include "frames/flight_log.h"
#include "flight/flight_pictures.h"
#include "frames/frame_maker.h"
#include "output/interrupt.h"
#include "output/output_folder.h"

#include <nlohmann/json.hpp>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace terrane::tools {

/// Everything of a flight that reaches the disk: frames.csv, pictures, the film, the report. Without
/// --out nothing does, and the frames are only kept for the summary.
class FlightOutput {
public:
    /// Makes the folder, and takes away what earlier runs wrote into it: see OutputFolder. From then on the first
    /// Ctrl-C ends the flight with the frames that there are.
    /// Fails with io, naming the path; device_unavailable where pictures are wanted and nothing draws.
    static Result<FlightOutput> create(const FlightOptions& options, const HeightSource& source,
                                       std::vector<std::string> extra_columns = {});

    /// Draws a frame where pictures are wanted, and logs it. Fails with io.
    Result<void> add(MadeFrame frame, const View& view, std::span<const DrawnObject> objects = {});

    /// Whether the flight is to end here: the user closed the window, or interrupted the program.
    bool is_closed() const { return is_interrupted() || (pictures_ && pictures_->is_closed()); }

    std::span<const FrameRecord> frames() const { return log_.frames(); }

    /// Ends all files, and writes the report: only now have they their names. Completes the summary
    /// with what drew and where it went. Fails with io.
    ///
    /// Where the program was interrupted: fails with cancelled, and leaves no file, before the first frame; else says so
    /// in the summary and the report.
    ///
    /// @param title of the report
    Result<void> finish(const std::string& title, nlohmann::ordered_json& summary);

    /// After finish(): fails where the flight was interrupted.
    ///
    /// @param frame_count that the flight would have had
    CommandResult<void> verdict(std::size_t frame_count) const;

private:
    FlightOutput(const FlightOptions& options, std::shared_ptr<OutputFolder> folder, FlightLog log);

    FlightOptions options_;
    std::shared_ptr<OutputFolder> folder_;  // null for none
    FlightLog log_;
    std::optional<FlightPictures> pictures_;
};

}  // namespace terrane::tools
