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
    GeoReference reference;
    reference.is_geographic = true;
    reference.longitude = 12.5;
    reference.latitude = 41.5;
    reference.metres_per_degree_x = 80'000.0;
    reference.metres_per_degree_y = 111'000.0;
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
