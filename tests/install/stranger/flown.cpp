// SPDX-License-Identifier: MIT
// A camera path over fractal ground, and one along a track from a file, without the program.
#include <terrane/playback/camera_path.h>
#include <terrane/playback/track.h>
#include <terrane/terrain/fractal_heights.h>

#include <cstdio>
#include <fstream>

int main() {
    const auto source = terrane::FractalHeights::create({.seed = 3});
    if (!source) return 1;
    const auto orbit = terrane::CameraPath::create("orbit", **source, {.seconds = 4.0});
    if (!orbit) return 2;
    const terrane::CameraPose pose = orbit->at(2.0);
    std::printf("at 2 s: %.1f %.1f %.1f\n", pose.eye_world.x(), pose.eye_world.y(),
                pose.eye_world.z());

    std::ofstream("flown.gpx") << "<gpx><trk><trkseg><trkpt lat=\"41.5\" lon=\"12.5\"/>"
                                  "<trkpt lat=\"41.51\" lon=\"12.5\"/></trkseg></trk></gpx>\n";
    terrane::TrackReference rome;
    rome.world_from_lonlat = [](const Eigen::Vector3d& lonlat) {
        return terrane::WorldPos((lonlat.x() - 12.5) * 83'000.0, (lonlat.y() - 41.5) * 111'000.0,
                                 lonlat.z());
    };
    auto track = terrane::read_track("flown.gpx", rome);
    if (!track || track->points.size() != 2) return 3;
    const auto path = terrane::CameraPath::create(std::move(*track), **source, {.speed = 50.0});
    return path && path->duration() > 20.0 ? 0 : 4;
}
