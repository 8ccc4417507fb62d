// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/result.h>

#include <cstdint>
#include <functional>
#include <mutex>
#include <string>

namespace terrane::internal {

/// Reports the progress of opening a raster to the caller, which may cancel it.
class OpeningProgress {
public:
    /// @param report  as DemSettings::progress; may be empty
    OpeningProgress(std::string path, std::function<bool(double)> report)
        : path_(std::move(path)), report_(std::move(report)) {}

    /// Begins a stage of some steps that ends at a share of the whole opening, 0 to 1.
    void begin(double end, std::int64_t steps);

    /// Completes a step.
    ///
    /// Fails:   cancelled if the caller stops the opening
    /// Threads: any
    Result<void> step();

private:
    const std::string path_;
    const std::function<bool(double)> report_;
    std::mutex mutex_;
    double from_ = 0.0, to_ = 0.0;
    std::int64_t done_ = 0, steps_ = 1;
    bool cancelled_ = false;
};

}  // namespace terrane::internal
