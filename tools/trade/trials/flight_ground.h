// SPDX-License-Identifier: MIT
#pragma once

#include "trade/table/dial.h"

#include <terrane/render/terrain_renderer.h>
#include <terrane/terrain/resident_set.h>
#include <terrane/terrain/triangulator.h>
#include <terrane/terrain/view.h>

#include <memory>
#include <optional>
#include <vector>

namespace terrane::tools {

/// What a flight costs and how far it is from the true surface.
struct FlightFigures {
    double error_px = 0.0;   ///< largest certified bound of all frames
    double triangles = 0.0;  ///< mean of the frames
    double update_ms = 0.0;  ///< Triangulator::update(), median of the frames
    double draw_ms =
        0.0;  ///< of the first frame until the picture can be read; NaN without a device
};

/// What Verifier measures of the same frames: the same in every run.
struct FlightTruth {
    double error_px = 0.0;    ///< largest error by brute force
    double max_pop_px = 0.0;  ///< largest movement from a frame to the next
};

/// Moments of a flight over a terrain, each with two consecutive frames and with all chunks resident that the finest
/// settings of the dials can draw. So paging has no part in what is measured here.
class FlightGround {
public:
    /// Loads the chunks: seconds.
    ///
    /// Fails: as CameraPath, FrameMaker
    static CommandResult<std::shared_ptr<FlightGround>> create(const TradePlace& place);

    /// Makes all frames. Fails with usage of settings that Triangulator::create() refuses.
    Result<FlightFigures> fly(const TriangulatorSettings& settings);
    /// Makes the frames of the first moments, and measures them.
    Result<FlightTruth> verify(const TriangulatorSettings& settings) const;

private:
    struct Moment {
        View view, next;  ///< 1/30 s apart
        std::shared_ptr<const ResidentSet> resident;
    };
    struct Device {
        EglContext context;  // the renderer's objects live in it
        TerrainRenderer renderer;
    };

    explicit FlightGround(std::shared_ptr<const HeightSource> source)
        : source_(std::move(source)) {}
    Result<double> draw(const TerrainMesh& mesh, const View& view);
    void open_device(bool is_quick);

    std::shared_ptr<const HeightSource> source_;
    std::vector<Moment> moments_;
    std::size_t verified_moments_ = 1;
    std::unique_ptr<Device> device_;  // null: none opens
};

}  // namespace terrane::tools
