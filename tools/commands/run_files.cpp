// SPDX-License-Identifier: MIT
#include "commands/run_files.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <string_view>
#include <utility>

namespace terrane::tools {
namespace {

constexpr std::array<std::string_view, 3> kChoices{"--dem", "--seed", "--scene"};
// These depend on the machine, not on the terrain.
constexpr std::array<std::string_view, 4> kMachineFlags{"--cache", "--dem-memory-mb",
                                                        "--http-cache", "--http-cache-mb"};

std::vector<const CLI::Option*> terrain_flags_of(const CLI::App& command) {
    return command.get_options([](const CLI::Option* option) {
        return option->get_group() == "Terrain" &&
               std::ranges::find(kMachineFlags, option->get_name()) == kMachineFlags.end();
    });
}

}  // namespace

void add_record_option(CLI::App& app, std::string& path) {
    app.add_option("--record", path,
                   "Record the run in a small file, which 'terrane fly --replay' shows again bit "
                   "for bit. A file of that name is replaced")
        ->type_name("FILE");
}

Result<std::optional<RunRecorder>> begin_record(const std::string& path, const CLI::App& command,
                                                const Terrain& terrain, RunSettings settings) {
    if (path.empty()) return std::optional<RunRecorder>();
    settings.terrain = identify(terrain);
    for (const CLI::Option* flag : terrain_flags_of(command)) {
        if (flag->count() == 0) continue;
        settings.terrain_flags.push_back(flag->get_name());
        for (const std::string& value : flag->results()) {
            // The query of an address may be a secret.
            const bool is_address = terrain.http != nullptr && flag->get_name() == "--dem";
            settings.terrain_flags.push_back(is_address ? terrain.name : value);
        }
    }
    TERRANE_TRY(RunRecorder recorder, RunRecorder::create(path, std::move(settings)));
    return std::optional<RunRecorder>(std::move(recorder));
}

Result<void> end_record(std::optional<RunRecorder>& recorder,
                        std::optional<std::uint64_t> state_hash, nlohmann::ordered_json& summary) {
    if (!recorder) return {};
    TERRANE_TRY(recorder->commit());
    summary["record"] = recorder->path();
    if (state_hash) summary["state_hash"] = hash_text(*state_hash);
    return {};
}

std::string hash_text(std::uint64_t state_hash) { return fmt::format("{:016x}", state_hash); }

bool chooses_terrain(const CLI::App& command) {
    return std::ranges::any_of(
        kChoices, [&](std::string_view flag) { return is_given(command, std::string(flag)); });
}

std::vector<std::string> terrain_detail_flags(const CLI::App& command) {
    std::vector<std::string> flags;
    for (const CLI::Option* flag : terrain_flags_of(command)) flags.push_back(flag->get_name());
    return flags;
}

std::optional<double> dig_spacing_of(const RunRecord& record) {
    const double spacing = record.settings().dig_spacing;
    return spacing > 0.0 ? std::optional(spacing) : std::nullopt;
}

CommandResult<TerrainOptions> terrain_options_of(const RunRecord& record,
                                                 const TerrainOptions& given) {
    TerrainOptions options;
    CLI::App app("the terrain of a record", given.command);
    add_terrain_options(app, options, {});
    std::vector<std::string> words = record.settings().terrain_flags;
    std::ranges::reverse(words);  // as CLI11 takes them
    try {
        app.parse(words);
    } catch (const CLI::ParseError& error) {
        return failure(
            fmt::format("the record '{}' has a terrain that this program cannot open: {}",
                        record.path(), error.what()));
    }
    options.scene_parts = given.scene_parts;
    options.cache = given.cache;
    options.http = given.http;
    options.dem_memory_mb = given.dem_memory_mb;
    return options;
}

}  // namespace terrane::tools
