// SPDX-License-Identifier: MIT
#pragma once

#include "imagery/imagery_square.h"

#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <vector>

namespace terrane::internal {

/// A square to read.
struct ImageryRequest {
    ImagerySquare square;
    WorldRect rect;  ///< with its border
    friend bool operator==(const ImageryRequest&, const ImageryRequest&) = default;
};
/// A square that was read.
struct ImageryLoad {
    ImageryRequest request;
    std::optional<ImageryTexture> texture;  ///< absent: the source failed
};

/// Reads squares on a thread of its own, the first of the last request first.
///
/// Threads: called by the renderer's thread only
class ImageryLoader {
public:
    explicit ImageryLoader(std::shared_ptr<const ImagerySource> source);
    /// Waits for the square that is being read.
    ~ImageryLoader();

    /// Replaces the queue of squares to read.
    void request(std::vector<ImageryRequest> wanted);
    /// Squares that have been read since the last call. Never waits for the source.
    std::vector<ImageryLoad> take();
    /// Waits until all that was requested has been read.
    void finish();

private:
    void run(const std::stop_token& stop);
    ImageryLoad load(const ImageryRequest& request) const;

    std::shared_ptr<const ImagerySource> source_;
    std::mutex mutex_;
    std::condition_variable_any changed_;
    std::vector<ImageryRequest> wanted_;  // the next one is last
    std::optional<ImageryRequest> loading_;
    std::vector<ImageryLoad> loaded_;
    std::jthread thread_;  // declared last: it uses the others
};

}  // namespace terrane::internal
