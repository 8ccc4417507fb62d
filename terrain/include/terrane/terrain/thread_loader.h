// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/chunk_loader.h>

#include <memory>

namespace terrane {

struct ThreadLoaderSettings {
    int worker_count = 1;  ///< 1 to 256
    /// Seconds after which a load is written off and its thread replaced, > 0; more than 1e9 is as 1e9.
    double timeout = 30.0;
};

/// Loads chunks from a source on threads of its own, by a clock of its own; advance() does nothing.
///
/// Storage that hangs takes a thread with it. After the timeout the load is reported as timed_out and
/// another thread takes over; at most as many threads are replaced as there are workers, then loads wait.
/// A lost thread that comes back gives back its claim and ends; then there may be another one again.
/// Timeouts are looked at, and threads replaced, in take_finished() and wait(): a load that is done by
/// then is not late. Where the system has no thread, loads go on with those that are left.
///
/// The destructor cancels what is under way and waits for it for a second at most; a thread that hangs
/// longer is left to itself and keeps the source alive. One that was lost before is not waited for.
///
/// FinishedLoad::bytes_read is the chunk's own bytes where it was made, given up afterwards or not, and
/// 0 elsewhere.
class ThreadLoader final : public ChunkLoader {
public:
    /// Fails with invalid_argument for a setting out of its range; out_of_memory where a thread cannot
    /// be started.
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
