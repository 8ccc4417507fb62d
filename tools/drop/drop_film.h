// SPDX-License-Identifier: MIT
#pragma once

#include "drop/drop_camera.h"
#include "flight/flight_output.h"

#include <memory>
#include <vector>

namespace terrane::tools {

/// Pictures of the bodies of a drop, with frames.csv and report.html. Has a pager of its own, so that drawing does
/// not affect the simulation.
class DropFilm {
public:
    /// @param options fps, size, fov_deg, out, png and video are used
    ///
    /// Fails as FlightOutput and FrameMaker do.
    static Result<DropFilm> create(const FlightOptions& options, const Terrain& terrain,
                                   const World& world);

    /// Makes the frames due up to `time` (seconds from the start) with the current poses. Fails with io.
    Result<void> show(const World& world, const StepReport& report, double time);

    /// Completes all files, and adds frames, renderer, samples and out to the summary. Fails with io.
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
