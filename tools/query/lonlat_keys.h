// SPDX-License-Identifier: MIT
#pragma once

#include "program/json_values.h"
#include "query/questions.h"
#include "scene/terrain_options.h"

#include <terrane/dem/georeference.h>

#include <nlohmann/json.hpp>

#include <optional>

namespace terrane::tools {

/// Longitudes and latitudes in lines of `terrane query`: degrees in WGS 84.
///
/// `lonlat`, [longitude, latitude], stands for the keys x and y of a question; [longitude, latitude, z] stands for its
/// position. `from_lonlat`, `to_lonlat`, `eye_lonlat` and `look_lonlat` stand for from, to, eye and look. z is that of
/// the world. The answer to a question with such a key, or with "lonlat": true, has the longitude and latitude of its
/// point, or of x and y, at `lonlat`.
class LonlatKeys {
public:
    /// @param terrain must outlive the object
    explicit LonlatKeys(const Terrain& terrain) : terrain_(terrain) {}

    /// Replaces the keys of a line by world positions. Returns whether the answer has a longitude and latitude. The
    /// first line with such a key opens the georeference.
    Parsed<bool> replace(nlohmann::ordered_json& question);
    /// Adds the longitude and latitude to an answer.
    void add_to(nlohmann::ordered_json& answer, const Question& question) const;

private:
    Parsed<WorldPos> place(const nlohmann::ordered_json& object, const std::string& key,
                           std::size_t count);
    Parsed<bool> replace_in(nlohmann::ordered_json& object);

    const Terrain& terrain_;
    std::optional<Result<Georeference>> georeference_;
};

}  // namespace terrane::tools
