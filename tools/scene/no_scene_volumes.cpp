// SPDX-License-Identifier: MIT
//
// Replaces scene_volumes.cpp if the program is built without terrane::volume. read_volumes() refuses scenes with
// volumes, so that the other functions are never called.
#include "scene/scene_volumes.h"

namespace terrane::tools {

struct SceneVolumes {};
struct SceneVolumeField {};

Parsed<std::shared_ptr<const SceneVolumes>> read_volumes(const nlohmann::ordered_json& list,
                                                         const std::string&) {
    if (list.is_array() && list.empty()) return std::shared_ptr<const SceneVolumes>();
    return wrong(
        "volumes need a program that was built with TERRANE_VOLUME, which this one was not");
}

double finest_voxel(const SceneVolumes&) { return 0.0; }

Result<std::shared_ptr<const SceneVolumeField>> place_volumes(const SceneVolumes&,
                                                              const HeightSource&) {
    return std::make_shared<const SceneVolumeField>();
}

Result<std::shared_ptr<const HeightSource>> add_volumes(std::shared_ptr<const HeightSource> ground,
                                                        const SceneVolumeField&) {
    return ground;
}

nlohmann::ordered_json describe_volumes(const SceneVolumeField&) {
    return nlohmann::ordered_json::array();
}

}  // namespace terrane::tools
