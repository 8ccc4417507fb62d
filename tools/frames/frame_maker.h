// SPDX-License-Identifier: MIT
#pragma once

#include "frames/flight_log.h"
#include "frames/verify.h"

#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <memory>
#include <optional>
#include <span>

namespace terrane::tools {

/// A frame that was made. The mesh is valid until the next one.
struct MadeFrame {
    TerrainMesh mesh;
    FrameRecord record;
};

struct FrameMakerSettings {
    PagerSettings pager;
    TriangulatorSettings triangulator;
    bool verify = false;  ///< measures each frame by brute force
};

/// Pager and triangulator in turns, as a simulator runs them, with what each frame cost.
class FrameMaker {
public:
    /// @param loader null for threads, as the pager's settings say
    ///
    /// Fails with what Pager and Triangulator say of the budget, the ceiling and the source.
    static Result<FrameMaker> create(std::shared_ptr<const HeightSource> source,
                                     const FrameMakerSettings& settings,
                                     std::unique_ptr<ChunkLoader> loader = nullptr);

    /// Waits until everything is there that a first frame can use, or the ceiling stops it: loads
    /// for a coarse error first and halves it, so that a small budget never loads what only a large
    /// one could draw. Ends early where is_interrupted().
    ///
    /// @param time of the pager's clock
    void load_until_stable(const View& view, std::span<const BodyNeed> bodies, double time);

    /// Makes the frame of a moment.
    ///
    /// @param camera its threshold_px is that of the frame before, whatever it says
    /// @param time   of the pager's clock, seconds; not before the frame before
    MadeFrame make(CameraNeed camera, std::span<const BodyNeed> bodies, double time);

    const Pager& pager() const { return pager_; }

private:
    FrameMaker(Pager pager, Triangulator triangulator);

    Pager pager_;
    Triangulator triangulator_;
    std::optional<Verifier> verifier_;
    std::size_t budget_ = 0;
    double max_error_px_ = 1.0;
    double threshold_px_ = 1.0;
};

}  // namespace terrane::tools
