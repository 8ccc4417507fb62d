// SPDX-License-Identifier: MIT
#include "commands/bake_jobs.h"

#include "program/output_file.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string_view>
#include <system_error>

namespace terrane::tools {
namespace {

/// A pair of environment variables with the number of a process and the number of processes.
struct RankVariables {
    const char* number;
    const char* count;
};
constexpr RankVariables kOpenMpi{"OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"};
constexpr RankVariables kSlurm{"SLURM_PROCID", "SLURM_NTASKS"};

/// The whole number in a variable that is set.
CommandResult<std::size_t> read_number(const char* name, std::size_t low, std::size_t high) {
    const std::string_view text = std::getenv(name);
    std::size_t value = 0;
    const char* const end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data(), end, value);
    if (error == std::errc() && rest == end && value >= low && value <= high) return value;
    return failure(fmt::format("{} must be {} to {}, got '{:.60}'", name, low, high, text));
}

/// Absent if neither variable is set.
CommandResult<std::optional<Rank>> read_rank(const RankVariables& names) {
    const bool has_number = std::getenv(names.number) != nullptr;
    const bool has_count = std::getenv(names.count) != nullptr;
    if (!has_number && !has_count) return std::optional<Rank>();
    if (!has_number || !has_count) {
        return failure(fmt::format("{} is set, but not {}", has_number ? names.number : names.count,
                                   has_number ? names.count : names.number));
    }
    constexpr std::size_t kMostProcesses = std::size_t{1} << 31;
    Rank rank;
    TERRANE_TRY(rank.count, read_number(names.count, 1, kMostProcesses));
    TERRANE_TRY(rank.number, read_number(names.number, 0, rank.count - 1));
    return rank;
}

/// A word for the shell.
std::string shell_word(std::string_view word) {
    std::string text = "'";
    for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return text + "'";
}

}  // namespace

CommandResult<Rank> rank_of_process() {
    for (const RankVariables& names : {kOpenMpi, kSlurm}) {
        TERRANE_TRY(const std::optional<Rank> rank, read_rank(names));
        if (rank) return *rank;
    }
    return failure(
        fmt::format("--shard mine needs a rank: {} and {} of Open MPI, or {} and {} of Slurm",
                    kOpenMpi.number, kOpenMpi.count, kSlurm.number, kSlurm.count));
}

std::vector<std::string> given_words(const CLI::App& command,
                                     const std::vector<std::string>& left_out) {
    std::vector<std::string> words;
    for (const CLI::Option* const option : command.get_options()) {
        const std::string name = option->get_name();
        if (option->count() == 0 || std::ranges::find(left_out, name) != left_out.end()) continue;
        const bool is_flag = option->get_expected_max() == 0;
        words.push_back(is_flag ? name
                                : fmt::format("{}={}", name, fmt::join(option->results(), ",")));
    }
    return words;
}

CommandResult<SlurmScripts> write_slurm_scripts(const std::string& folder,
                                                const std::vector<std::string>& words,
                                                std::size_t shard_count, std::size_t threads) {
    std::error_code error;
    const std::string current = std::filesystem::current_path(error).string();
    if (error) return failure("the current folder has no path: " + error.message());
    const std::string program = std::filesystem::read_symlink("/proc/self/exe", error).string();
    if (error) return failure("the program has no path: " + error.message());

    SlurmScripts scripts;
    scripts.job_count = std::min(shard_count, kMostSlurmJobs);
    std::string command;
    for (const std::string& word : words) command += " " + shell_word(word);
    std::string bake = fmt::format(
        "#!/bin/sh\n"
        "#SBATCH --job-name=terrane-bake\n"
        "#SBATCH --array=0-{}\n"
        "#SBATCH --requeue\n",
        scripts.job_count - 1);
    if (threads > 0) bake += fmt::format("#SBATCH --cpus-per-task={}\n", threads);
    bake += fmt::format(
        "# Bakes {} shards in {} jobs. Complete shards are kept.\n"
        "cd {} || exit 1\n"
        "first=$((SLURM_ARRAY_TASK_ID * {} / {}))\n"
        "last=$(((SLURM_ARRAY_TASK_ID + 1) * {} / {} - 1))\n"
        "exec {} bake{} --threads={} --shard=\"$(seq -s, \"$first\" \"$last\")\"\n",
        shard_count, scripts.job_count, shell_word(current), shard_count, scripts.job_count,
        shard_count, scripts.job_count, shell_word(program), command,
        threads > 0 ? std::to_string(threads) : "\"${SLURM_CPUS_PER_TASK:-1}\"");
    const std::string combine = fmt::format(
        "#!/bin/sh\n"
        "#SBATCH --job-name=terrane-combine\n"
        "#SBATCH --kill-on-invalid-dep=yes\n"
        "cd {} || exit 1\n"
        "exec {} bake {} --combine\n",
        shell_word(current), shell_word(program), shell_word("--out=" + folder));
    scripts.paths = {folder + "/bake.sbatch", folder + "/combine.sbatch"};
    TERRANE_TRY(write_file(scripts.paths[0], bake));
    TERRANE_TRY(write_file(scripts.paths[1], combine));
    scripts.submit =
        fmt::format("job=$(sbatch --parsable {}) && sbatch --dependency=afterok:$job {}",
                    shell_word(scripts.paths[0]), shell_word(scripts.paths[1]));
    return scripts;
}

}  // namespace terrane::tools
