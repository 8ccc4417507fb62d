// SPDX-License-Identifier: MIT
#pragma once

#include "support/grounds.h"
#include "support/mesh_checks.h"

#include <terrane/terrain/chunk_loader.h>
#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <gtest/gtest.h>

#include <iterator>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

namespace terrane::test {

/// Makes load requests and tracks the bytes that they claim.
class Loads {
public:
    std::size_t bytes() const { return *count_; }
    /// Bytes claimed by `count` waiting loads.
    static std::size_t waiting_bytes(std::size_t count) { return count * Chunk::max_bytes(); }

    LoadRequest request(const ChunkKey& key) const {
        return {key, ByteClaim(count_, Chunk::max_bytes())};
    }
    std::vector<LoadRequest> requests(const std::vector<ChunkKey>& keys) const {
        std::vector<LoadRequest> requests;
        for (const ChunkKey& key : keys) requests.push_back(request(key));
        return requests;
    }

    /// Waits for `count` loads; returns them in order of completion.
    static std::vector<FinishedLoad> take(ChunkLoader& loader, std::size_t count) {
        std::vector<FinishedLoad> taken;
        while (taken.size() < count) {
            loader.wait();
            std::vector<FinishedLoad> finished = loader.take_finished();
            std::move(finished.begin(), finished.end(), std::back_inserter(taken));
        }
        return taken;
    }

    /// Waits until at most `bytes` are claimed.
    void wait_for_bytes(std::size_t most) const {
        while (bytes() > most) std::this_thread::yield();
    }

private:
    std::shared_ptr<ByteCount> count_ = std::make_shared<ByteCount>(0);
};

inline std::vector<ChunkKey> keys_of(const std::vector<LoadRequest>& requests) {
    std::vector<ChunkKey> keys;
    for (const LoadRequest& request : requests) keys.push_back(request.key);
    return keys;
}

inline std::vector<ChunkKey> keys_of(const std::vector<FinishedLoad>& loads) {
    std::vector<ChunkKey> keys;
    for (const FinishedLoad& load : loads) keys.push_back(load.key);
    return keys;
}

inline CameraNeed camera_at(const WorldPos& eye, const WorldPos& target, double threshold_px) {
    return {.view = look_at(eye, target, 1.0, 1280, 720).value(), .threshold_px = threshold_px};
}

inline bool holds(const ResidentSet& set, const ChunkKey& key) {
    return set.find_ground(key) != nullptr;
}

/// Triangulates the resident chunks and checks the mesh and its certificate.
struct Frame {
    MeshStatus status = MeshStatus::not_resident;
    double error_px = 0.0;
};
inline Frame draw(const std::shared_ptr<const ResidentSet>& set, const HeightSource& ground,
                  const View& view, double target_px) {
    Triangulator triangulator =
        Triangulator::create(ground, {.triangle_budget = 200'000, .max_error_px = target_px})
            .value();
    const TerrainMesh mesh = triangulator.update(set, view);
    if (mesh.triangle_count > 0) {
        EXPECT_EQ(find_flaw(mesh), "");
        EXPECT_LE(measure_error_px(make_soup(mesh), ground, view, 2), mesh.error_px);
    }
    return {mesh.status, mesh.error_px};
}

/// Steep hills and a camera over them; of the chunks that it needs on level 2, the one below it and one beside that.
inline constexpr double kSteepTarget_px = 6.0;
inline constexpr ChunkKey kBelow{0, 0, 2}, kBeside{1, 0, 2};
inline std::shared_ptr<const HeightSource> steep_hills(int finest_level = 3) {
    return std::make_shared<WaveHeights>(small_world(finest_level, 1.0), 120.0, 150.0);
}
inline CameraNeed steep_camera() {
    return camera_at({60, 50, 150}, {260, 240, 0}, kSteepTarget_px);
}
inline Frame draw_steep(const Pager& pager, const HeightSource& ground) {
    return draw(pager.resident(), ground, steep_camera().view, kSteepTarget_px);
}

}  // namespace terrane::test
