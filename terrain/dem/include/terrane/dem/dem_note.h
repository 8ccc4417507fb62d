// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/dem/dem_heights.h>

#include <optional>
#include <string>

namespace terrane {

/// The properties of a raster as JSON, for BakeSettings::note, so that a baked terrain has its place on the Earth.
/// Without DemInfo::notes and what numbers were taken to be. ASCII.
std::string note_of(const DemInfo& dem);

/// The properties in a note of note_of(); absent if it is another text.
std::optional<DemInfo> dem_of_note(const std::string& note);

}  // namespace terrane
