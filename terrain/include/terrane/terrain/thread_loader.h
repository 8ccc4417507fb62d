// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk_loader.h>

#include <memory>

namespace terrane {

/// Settings of a ThreadLoader. Fixed once it is created.
struct ThreadLoaderSettings {
    int worker_count = 1;  ///< 1 to 256
    /// Seconds after which a load times out and its thread is replaced, > 0; clamped to 1e9.
    double timeout = 30.0;
};

/// Loads chunks from a source on threads of its own, timed by the steady clock; advance() does nothing.
///
/// Storage that hangs blocks a thread. After the timeout its load is reported as timed_out and a new thread replaces
/// it; at most worker_count hanging threads are replaced, then loads wait. A replaced thread that returns releases its
/// claim and ends, and no longer counts. Timeouts are checked, and threads replaced, in take_finished() and
/// wait(): a load that is finished by then is not late. If the system has no thread left, the remaining ones go on.
///
/// The destructor cancels loads in progress and waits for them for a second at most; a thread that hangs longer is
/// detached and keeps the source alive. Threads replaced before are not waited for.
///
/// FinishedLoad::bytes_read is the chunk's own bytes if it was made, cancelled or not, else 0.
class ThreadLoader final : public ChunkLoader {
public:
    /// Fails: invalid_argument for a setting out of its range; out_of_memory if a thread cannot be started
    static Result<std::unique_ptr<ThreadLoader>> create(std::shared_ptr<const HeightSource> source,
                                                        const ThreadLoaderSettings& settings);
    ~ThreadLoader() override;

    void advance(double time_s) override;
    std::vector<LoadRequest> take_queue() override;
    void queue(std::vector<LoadRequest> requests) override;
    void cancel(const ChunkKey& key) override;
    std::vector<FinishedLoad> take_finished() override;
    int slots() const override;
    void wait() override;

private:
    struct State;
    explicit ThreadLoader(std::shared_ptr<State> state);
    std::shared_ptr<State> state_;  // shared with the threads
};

}  // namespace terrane
