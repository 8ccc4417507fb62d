// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk_loader.h>

#include <memory>
#include <utility>
#include <vector>

namespace terrane::internal {

/// Loads chunks synchronously in queue().
class InlineLoader final : public ChunkLoader {
public:
    explicit InlineLoader(std::shared_ptr<const HeightSource> source)
        : source_(std::move(source)) {}

    void advance(double) override {}
    std::vector<LoadRequest> take_queue() override { return {}; }
    void queue(std::vector<LoadRequest> requests) override;
    void cancel(const ChunkKey&) override {}
    std::vector<FinishedLoad> take_finished() override { return std::exchange(finished_, {}); }
    int slots() const override { return 256; }
    void wait() override {}

private:
    std::shared_ptr<const HeightSource> source_;
    std::vector<FinishedLoad> finished_;
};

}  // namespace terrane::internal
