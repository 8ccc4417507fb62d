// SPDX-License-Identifier: MIT
#include "support/random.h"
#include "terrain/paging/pager_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <utility>
#include <vector>

namespace terrane::storage_simulation_test {

using namespace test;

/// The random outcome of one request.
struct KnownRequest {
    ErrorCode fate = ErrorCode::invalid_argument;  ///< invalid_argument means delivered
    double seconds = 0.0;  ///< until its transfer starts, or until failure or timeout
};

/// Reference for VirtualLoader: a simulation of its storage in small equal time steps.
class StorageOracle {
public:
    struct End {
        ErrorCode fate = ErrorCode::invalid_argument;
        double begin_s = 0.0;
        double end_s = 0.0;
        double bytes = 0.0;
    };
    using Known = std::function<KnownRequest(const ChunkKey&, int times_begun)>;

    StorageOracle(const VirtualStorage& storage, double step_s, Known known)
        : storage_(storage), step_s_(step_s), known_(std::move(known)) {}

    double now() const { return now_s_; }
    bool is_idle() const { return requests_.empty() && queue_.empty(); }
    /// Time of the last completion of each key.
    const std::map<ChunkKey, End>& ends() const { return ends_; }

    void queue(const std::vector<ChunkKey>& keys) {
        queue_.assign(keys.begin(), keys.end());
        begin_queued();
    }
    void take_queue() { queue_.clear(); }
    void cancel(const ChunkKey& key) {
        for (std::size_t i = 0; i < requests_.size(); ++i) {
            if (requests_[i].key != key) continue;
            end(i, ErrorCode::cancelled);
            break;
        }
        begin_queued();
    }
    void step() {
        const double moving = static_cast<double>(
            std::count_if(requests_.begin(), requests_.end(),
                          [](const Request& request) { return request.is_moving; }));
        for (Request& request : requests_) {
            if (request.is_moving) request.bytes += storage_.bandwidth / moving * step_s_;
        }
        now_s_ += step_s_;
        for (std::size_t i = 0; i < requests_.size();) {
            Request& request = requests_[i];
            if (request.is_moving && request.bytes >= static_cast<double>(Chunk::max_bytes())) {
                end(i, request.known.fate);
            } else if (!request.is_moving && now_s_ >= request.begin_s + request.known.seconds) {
                request.is_moving = request.known.fate == ErrorCode::invalid_argument;
                if (!request.is_moving) end(i, request.known.fate);
            } else {
                ++i;
            }
        }
        begin_queued();
    }

private:
    struct Request {
        ChunkKey key;
        KnownRequest known;
        double begin_s = 0.0;
        bool is_moving = false;
        double bytes = 0.0;
    };

    void begin_queued() {
        while (!queue_.empty() && requests_.size() < static_cast<std::size_t>(storage_.slots)) {
            const ChunkKey key = queue_.front();
            queue_.pop_front();
            requests_.push_back({key, known_(key, begun_[key]++), now_s_});
        }
    }
    void end(std::size_t i, ErrorCode fate) {
        const Request& request = requests_[i];
        ends_[request.key] = {fate, request.begin_s, now_s_, request.bytes};
        requests_.erase(requests_.begin() + static_cast<std::ptrdiff_t>(i));
    }

    VirtualStorage storage_;
    double step_s_;
    Known known_;
    double now_s_ = 0.0;
    std::deque<ChunkKey> queue_;
    std::vector<Request> requests_;
    std::map<ChunkKey, int> begun_;
    std::map<ChunkKey, End> ends_;
};

// VirtualLoader on random schedules, against a time-stepped simulation and against runs with other step sizes.

constexpr double kStep = 0x1p-19;  // step of the oracle
constexpr double kLook = 0x1p-9;   // interval of take_finished()
constexpr int kKeys = 40;

Result<std::shared_ptr<const Chunk>> make(const ChunkKey& key) {
    const auto chunk = std::make_shared<Chunk>();
    chunk->key = key;
    return std::shared_ptr<const Chunk>(chunk);
}

VirtualStorage random_storage(Random& random) {
    return {.latency = random.between(0.0, 0.05),
            .latency_spread = random.between(0.0, 1.5),
            .bandwidth = random.between(5e6, 5e7),
            .slots = 1 + random.below(8),
            .failure_share = 0.1,
            .hang_share = 0.05,
            .timeout = random.between(0.05, 0.2),
            .seed = random.bits()};
}

// Calls of a pager at one time.
struct Call {
    double time_s = 0.0;
    std::vector<ChunkKey> cancelled;
    std::vector<ChunkKey> queued;  // replaces the queue
};

std::vector<Call> random_calls(Random& random) {
    std::vector<Call> calls;
    double time_s = 0.0;
    std::int32_t next = 0;
    while (next < kKeys) {
        Call& call = calls.emplace_back();
        time_s += std::floor(random.between(0.0, 0.2) / kStep) * kStep;
        call.time_s = time_s;
        for (int i = random.below(4); i > 0 && next > 0; --i) {
            call.cancelled.push_back({random.below(next), 0, 0});
        }
        for (int i = random.below(9); i > 0; --i) call.queued.push_back({next++, 0, 0});
    }
    return calls;
}

// Outcome of a request alone, with infinite bandwidth.
KnownRequest probe(VirtualStorage storage, const ChunkKey& key, int times_begun) {
    storage.bandwidth = std::numeric_limits<double>::infinity();
    const auto loader = VirtualLoader::create(storage, make).value();
    KnownRequest known;
    for (int i = 0; i <= times_begun; ++i) {
        loader->queue(Loads().requests({key}));
        const FinishedLoad load = std::move(Loads::take(*loader, 1).front());
        known.seconds = load.seconds;
        known.fate = load.chunk ? ErrorCode::invalid_argument : load.chunk.error().code;
    }
    return known;
}

struct Seen {
    FinishedLoad load;
    double after_s = 0.0, until_s = 0.0;
};

// Makes the calls; `look` returns the step size.
template <class Look>
std::map<ChunkKey, Seen> play(ChunkLoader& loader, const Loads& loads,
                              const std::vector<Call>& calls, double end_s, const Look& look) {
    std::map<ChunkKey, Seen> seen;
    double now_s = 0.0;
    const auto go_to = [&](double time_s) {
        while (now_s < time_s) {
            const double after_s = now_s;
            now_s = std::min(time_s, now_s + look());
            loader.advance(now_s);
            for (FinishedLoad& load : loader.take_finished()) {
                const ChunkKey key = load.key;
                EXPECT_FALSE(seen.contains(key));
                seen[key] = {std::move(load), after_s, now_s};
            }
        }
    };
    for (const Call& call : calls) {
        go_to(call.time_s);
        loader.take_queue();
        for (const ChunkKey& key : call.cancelled) loader.cancel(key);
        loader.queue(loads.requests(call.queued));
    }
    go_to(end_s);
    return seen;
}

TEST(VirtualLoaderSchedule, EqualsThatOfATimeSteppedSimulation) {
    const auto seeds = static_cast<std::uint64_t>(few_or_many(8, 24));
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
        SeededRandom random(seed);
        const VirtualStorage storage = random_storage(random);
        const std::vector<Call> calls = random_calls(random);

        StorageOracle oracle(storage, kStep, [&](const ChunkKey& key, int times) {
            return probe(storage, key, times);
        });
        for (const Call& call : calls) {
            while (oracle.now() < call.time_s) oracle.step();
            oracle.take_queue();
            for (const ChunkKey& key : call.cancelled) oracle.cancel(key);
            oracle.queue(call.queued);
        }
        while (!oracle.is_idle()) oracle.step();

        const Loads loads;
        const auto loader = VirtualLoader::create(storage, make).value();
        const auto seen = play(*loader, loads, calls, oracle.now() + 1.0, [] { return kLook; });

        // every event of the oracle is up to a step late, and delays later ones
        const double tolerance_s = 3.0 * kKeys * kStep;
        ASSERT_EQ(seen.size(), oracle.ends().size());
        for (const auto& [key, end] : oracle.ends()) {
            SCOPED_TRACE(testing::Message() << "key " << key.x);
            ASSERT_TRUE(seen.contains(key));
            const auto& [load, after_s, until_s] = seen.at(key);
            EXPECT_EQ(load.chunk ? ErrorCode::invalid_argument : load.chunk.error().code, end.fate);
            EXPECT_NEAR(load.seconds, end.end_s - end.begin_s, tolerance_s);
            EXPECT_GT(end.end_s, after_s - tolerance_s);
            EXPECT_LT(end.end_s, until_s + tolerance_s);
            EXPECT_NEAR(static_cast<double>(load.bytes_read), end.bytes,
                        storage.bandwidth * tolerance_s + 1.0);
        }
    }
}

// Bit for bit, except for the time when a load is taken.
TEST(VirtualLoaderSchedule, IsIndependentOfTheStepSize) {
    const auto seeds = static_cast<std::uint64_t>(few_or_many(16, 40));
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
        SeededRandom random(seed);
        const VirtualStorage storage = random_storage(random);
        const std::vector<Call> calls = random_calls(random);
        const auto hash_of = [&](const auto& look) {
            const Loads loads;
            const auto loader = VirtualLoader::create(storage, make).value();
            test::Hash hash;
            for (const auto& [key, seen] : play(*loader, loads, calls, 1000.0, look)) {
                hash.add(key.x);
                hash.add(seen.load.seconds);
                hash.add(seen.load.bytes_read);
                hash.add(seen.load.chunk ? ErrorCode::invalid_argument
                                         : seen.load.chunk.error().code);
            }
            loader->advance(0.0);  // no effect
            EXPECT_EQ(loads.bytes(), 0u);
            return hash.value();
        };
        const std::uint64_t expected = hash_of([] { return 1e9; });
        EXPECT_EQ(hash_of([] { return 1e9; }), expected);
        EXPECT_EQ(hash_of([] { return 0.01; }), expected);
        Random steps(seed);
        EXPECT_EQ(hash_of([&] { return steps.below(9) > 0 ? steps.between(0.0, 1e-3) : 50.0; }),
                  expected);
    }
}

}  // namespace terrane::storage_simulation_test
