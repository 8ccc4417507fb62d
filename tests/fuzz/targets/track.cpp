// SPDX-License-Identifier: MIT
// Tracks: the first byte chooses the format, the rest is the file.
#include "support/input.h"

#include <terrane/playback/track.h>

#include <array>

using namespace terrane;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const fuzz::ScratchFolder folder;
    constexpr std::array<const char*, 4> kNames{"track.csv", "track.gpx", "track.igc", "track.tum"};
    fuzz::Input input(data, size);
    const char* const name = input.one_of(kNames);
    TrackReference reference;
    reference.world_from_lonlat = [](const Eigen::Vector3d& lonlat) {
        return WorldPos((lonlat.x() - 12.5) * 80'000.0, (lonlat.y() - 41.5) * 111'000.0,
                        lonlat.z());
    };
    const Result<Track> track = read_track(folder.write(name, input.rest()), reference);
    if (!fuzz::is_accepted(track)) {
        fuzz::require(track.error().message.find('\n') == std::string::npos,
                      "the message is one line: " + track.error().message);
        return 0;
    }
    const Result<void> checked = track->validate();
    if (!checked) fuzz::require(false, "a track that is read is valid: " + checked.error().message);
    return 0;
}
