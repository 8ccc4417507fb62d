// SPDX-License-Identifier: MIT
#pragma once

#include "flight/flight_log.h"
#include "flight/flight_pictures.h"
#include "flight/frame_maker.h"

#include <nlohmann/json.hpp>

#include <optional>
#include <string>
#include <vector>

namespace terrane::tools {

/// Everything of a flight that reaches the disk: frames.csv, pictures, the film, the report. Without
/// --out nothing does, and the frames are only kept for the summary.
class FlightOutput {
public:
    /// Makes the folder, and takes away what an earlier flight left in it.
    /// Fails with io, naming the path; device_unavailable where pictures are wanted and nothing draws.
    static Result<FlightOutput> create(const FlightOptions& options, const HeightSource& source,
                                       std::vector<std::string> extra_columns = {});

    /// Draws a frame where pictures are wanted, and logs it. Fails with io.
    Result<void> add(MadeFrame frame, const View& view, std::span<const DrawnObject> objects = {});

    /// Whether the flight was watched in a window that the user closed.
    bool is_closed() const { return pictures_ && pictures_->is_closed(); }

    std::span<const FrameRecord> frames() const { return log_.frames(); }

    /// Ends all files, and writes the report: only now have they their names. Completes the summary
    /// with what drew and where it went. Fails with io.
    ///
    /// @param title of the report
    Result<void> finish(const std::string& title, nlohmann::ordered_json& summary);

private:
    FlightOutput(const FlightOptions& options, FlightLog log);

    FlightOptions options_;
    FlightLog log_;
    std::optional<FlightPictures> pictures_;
};

}  // namespace terrane::tools
