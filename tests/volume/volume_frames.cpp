// SPDX-License-Identifier: MIT
#include "volume/volume_frames.h"

#include "support/grounds.h"

#include <algorithm>
#include <cmath>

namespace terrane::test {
namespace {

constexpr int kSide = 1 << kFinest;  // chunks of the finest level

// Where the volumes are about, metres: 20 m inside the world if the corner is on its border.
double middle_of(int corner) { return 128.0 * corner - (corner == kSide ? 20.0 : 0.0); }

Lattice small_lattice() { return Lattice{.finest_level = kFinest}; }

VolumeShape random_shape(Random& random) {
    const double radius = random.between(1.5, 9.0);
    switch (random.below(4)) {
        case 0:
            return VolumeSphere{radius};
        case 1:
            return VolumeCapsule{radius, random.between(0.0, 20.0)};
        case 2: {
            const double width = random.between(1.5, 12.0), height = random.between(1.5, 12.0);
            return VolumeBox{{radius, width, height}};
        }
        default: {
            VolumeTube tube{{}, radius};
            Eigen::Vector3d at = Eigen::Vector3d::Zero();
            for (int i = 2 + random.below(3); i > 0; --i) {
                tube.path_shape.push_back(at);
                const double length = random.between(5.0, 60.0);
                at += length * random.direction();
            }
            return tube;
        }
    }
}

}  // namespace

std::shared_ptr<const HeightSource> random_hills(Random& random) {
    const double amplitude = random.below(4) == 0 ? 0.01 : random.between(5.0, 40.0);
    return std::make_shared<const WaveHeights>(small_lattice(), amplitude,
                                               random.between(100.0, 500.0));
}

std::vector<VolumeOperation> random_operations(Random& random, const HeightSource& ground,
                                               int corner) {
    const double middle = middle_of(corner);
    std::vector<VolumeOperation> operations;
    for (int i = 1 + random.below(4); i > 0; --i) {
        VolumeOperation& made = operations.emplace_back();
        made.voxel = 1.0;
        made.op = random.below(4) == 0 ? VolumeOp::add : VolumeOp::remove;
        made.shape = random_shape(random);
        const double x = middle + random.between(-40.0, 40.0);
        const double y = middle + random.between(-40.0, 40.0);
        const double z = ground.height(x, y) + random.between(-20.0, 8.0);
        made.world_from_shape.translation = {x, y, z};
        if (random.below(2) == 0) made.world_from_shape.rotation = random.rotation();
    }
    return operations;
}

std::shared_ptr<const Chunk> Chunks::get(const ChunkKey& key) {
    auto& chunk = made_[key];
    if (!chunk) chunk = make_chunk(source_, key).value();
    return chunk;
}

std::shared_ptr<const ResidentSet> random_residents(Random& random, Chunks& chunks,
                                                    const HeightSource& source, int corner) {
    std::map<ChunkKey, float> fades;
    const bool is_complete = random.below(3) == 0;
    const auto add = [&](ChunkKey key) {
        if (std::max(key.x, key.y) >= kSide) return;
        const float fade =
            is_complete || random.below(3) != 0 ? 1.0f : static_cast<float>(random.below(5)) / 4.0f;
        fades.try_emplace(key, fade);
        while (key.level > 0) fades.try_emplace(key = key.parent(), 1.0f);
    };
    add({0, 0, 0});
    for (const int y : {corner - 1, corner}) {
        for (const int x : {corner - 1, corner}) {
            if (is_complete || random.below(5) != 0) add({x, y, kFinest});
        }
    }
    for (int i = random.below(6); i > 0; --i) {
        add({corner - 2 + random.below(4), corner - 2 + random.below(4), kFinest});
    }
    std::vector<std::shared_ptr<const Chunk>> resident;
    std::vector<float> of_each;
    for (const auto& [key, fade] : fades) {
        resident.push_back(chunks.get(key));
        of_each.push_back(fade);
    }
    return std::make_shared<const ResidentSet>(source.lattice(), source.extent(),
                                               std::move(resident), of_each, 1);
}

View random_view(Random& random, double distance, int corner) {
    const double middle = middle_of(corner);
    for (;;) {
        const Eigen::Vector3d target(middle + random.between(-30.0, 30.0),
                                     middle + random.between(-30.0, 30.0),
                                     random.between(-30.0, 30.0));
        Eigen::Vector3d away = random.direction();
        away.z() = random.below(3) == 0 ? away.z() : std::abs(away.z());
        const auto view = look_at(target + distance * away, target, random.between(0.3, 1.8),
                                  100 + random.below(1200), 100 + random.below(900));
        if (view) return *view;
    }
}

}  // namespace terrane::test
