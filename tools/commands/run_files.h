// SPDX-License-Identifier: MIT
#pragma once

#include "program/command.h"
#include "record/run_record.h"
#include "scene/terrain_options.h"

#include <nlohmann/json.hpp>

#include <optional>
#include <string>
#include <vector>

namespace terrane::tools {

/// Adds --record.
void add_record_option(CLI::App& app, std::string& path);

/// Begins the record of a run; none if `path` is "".
///
/// @param command  with the flags of the run's terrain
/// @param settings its terrain and terrain_flags are replaced
///
/// Fails: as RunRecorder::create()
Result<std::optional<RunRecorder>> begin_record(const std::string& path, const CLI::App& command,
                                                const Terrain& terrain, RunSettings settings);

/// Completes a record, if there is one, and adds record and state_hash to the summary. Fails: as RunRecorder::commit()
///
/// @param state_hash World::state_hash() at the end of the run; absent for a run without bodies
Result<void> end_record(std::optional<RunRecorder>& recorder,
                        std::optional<std::uint64_t> state_hash, nlohmann::ordered_json& summary);

/// World::state_hash() as text.
std::string hash_text(std::uint64_t state_hash);

/// Whether a command line chooses a terrain: --dem, --seed or --scene.
bool chooses_terrain(const CLI::App& command);
/// The flags of a terrain that have no effect without such a choice: all but those of caches and --dem-memory-mb.
std::vector<std::string> terrain_detail_flags(const CLI::App& command);

/// The terrain options of a record.
///
/// @param given of the command line: its command, scene parts, caches and memory limit are used
///
/// Fails: exit_failed if a flag of the record is no flag of a terrain
CommandResult<TerrainOptions> terrain_options_of(const RunRecord& record,
                                                 const TerrainOptions& given);

/// TerrainOptions::dig_spacing of a record.
std::optional<double> dig_spacing_of(const RunRecord& record);

}  // namespace terrane::tools
