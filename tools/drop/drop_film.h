// SPDX-License-Identifier: MIT
#pragma once

#include "drop/drop_camera.h"
#include "flight/flight_output.h"

#include <memory>
#include <vector>

namespace terrane::tools {

/// Pictures of falling bodies, and frames.csv and report.html beside them. Has loaders of its own: what is
/// drawn changes nothing of what falls.
class DropFilm {
public:
    /// @param options fps, size, fov_deg, out, png and video are used
    ///
    /// Fails as FlightOutput and FrameMaker do.
    static Result<DropFilm> create(const FlightOptions& options,
                                   std::shared_ptr<const HeightSource> source,
                                   const BodyWorld& world);

    /// Makes the frames that are due by a time, seconds from the start, with the bodies where they are. Fails with io.
    Result<void> show(const BodyWorld& world, const StepReport& report, double time);

    /// Ends all files, and completes the summary with frames, renderer and out. Fails with io.
    Result<void> finish(const std::string& title, nlohmann::ordered_json& summary);

private:
    DropFilm(const FlightOptions& options, FrameMaker maker, FlightOutput output,
             DropCamera camera);

    FlightOptions options_;
    FrameMaker maker_;
    FlightOutput output_;
    DropCamera camera_;
    std::vector<DrawnObject> objects_;
};

}  // namespace terrane::tools
