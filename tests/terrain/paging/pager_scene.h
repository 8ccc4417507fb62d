// SPDX-License-Identifier: MIT
#pragma once

#include "support/heights/wave_heights.h"
#include "support/mesh_checks.h"

#include <terrane/terrain/pager.h>
#include <terrane/terrain/triangulator.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

namespace terrane::test {

inline CameraNeed camera_at(const WorldPos& eye, const WorldPos& target, double threshold_px) {
    return {.view = look_at(eye, target, 1.0, 1280, 720).value(), .threshold_px = threshold_px};
}

inline bool holds(const ResidentSet& set, const ChunkKey& key) {
    return set.find(key) != ResidentSet::kNone;
}

/// Makes a frame of the resident chunks, and checks its mesh and its certificate.
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

}  // namespace terrane::test
