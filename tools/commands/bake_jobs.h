// SPDX-License-Identifier: MIT
#pragma once

#include "program/command.h"

#include <cstddef>
#include <string>
#include <vector>

namespace terrane::tools {

/// The number of a process among those that run the same command line.
struct Rank {
    std::size_t number = 0;  ///< from 0 on
    std::size_t count = 1;   ///< of processes
};

/// The rank that Open MPI gives this process (OMPI_COMM_WORLD_RANK and OMPI_COMM_WORLD_SIZE), or else Slurm
/// (SLURM_PROCID and SLURM_NTASKS): mpirun in a job of Slurm passes on variables of Slurm that are not the rank's.
///
/// Fails: exit_failed if there is neither, or one variable of a pair is missing or out of range
CommandResult<Rank> rank_of_process();

/// The flags of a command that were given, as words of a command line: "--levels=3".
///
/// @param left_out flags that are not wanted
std::vector<std::string> given_words(const CLI::App& command,
                                     const std::vector<std::string>& left_out);

/// Scripts for Slurm.
struct SlurmScripts {
    std::size_t job_count = 0;            ///< jobs of the array
    std::vector<std::string> paths = {};  ///< of the scripts
    std::string submit;                   ///< a line of the shell that submits them
};

/// Largest number of jobs in an array; by default Slurm allows numbers up to 1000.
inline constexpr std::size_t kMostSlurmJobs = 1000;

/// Writes bake.sbatch, an array of jobs that bake the shards of a plan, and combine.sbatch, for afterwards, into the
/// folder of the plan. They run this program in the current folder.
///
/// @param words   words of `terrane bake` that name the terrain and the folder: given_words()
/// @param threads of a job; 0: the number of CPUs that Slurm gives it
///
/// Fails: as write_file()
CommandResult<SlurmScripts> write_slurm_scripts(const std::string& folder,
                                                const std::vector<std::string>& words,
                                                std::size_t shard_count, std::size_t threads);

}  // namespace terrane::tools
