// SPDX-License-Identifier: MIT
// A pager that loads on the program's own pool of threads, timed by the program's own clock.
#include <terrane/terrain/chunk_loader.h>
#include <terrane/terrain/fractal_heights.h>
#include <terrane/terrain/pager.h>

#include <algorithm>
#include <condition_variable>
#include <cstdio>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

using namespace terrane;

namespace {

// Stands for the pool that a simulator has anyway.
class Pool {
public:
    explicit Pool(int threads) {
        for (int i = 0; i < threads; ++i) {
            threads_.emplace_back([this](const std::stop_token& stop) { work(stop); });
        }
    }
    void run(std::function<void()> job) {
        const std::scoped_lock lock(mutex_);
        jobs_.push_back(std::move(job));
        changed_.notify_one();
    }

private:
    void work(const std::stop_token& stop) {
        for (;;) {
            std::unique_lock lock(mutex_);
            if (!changed_.wait(lock, stop, [this] { return !jobs_.empty(); })) return;
            const std::function<void()> job = std::move(jobs_.front());
            jobs_.pop_front();
            lock.unlock();
            job();
        }
    }

    std::mutex mutex_;
    std::condition_variable_any changed_;
    std::deque<std::function<void()>> jobs_;
    std::vector<std::jthread> threads_;
};

// At most `slots` loads are in the pool at once. The pager can still take back or reorder the requests that wait here.
class PoolLoader final : public ChunkLoader {
public:
    PoolLoader(std::shared_ptr<const HeightSource> source, Pool& pool, int slots)
        : source_(std::move(source)), pool_(pool), slots_(slots) {}
    // Cancels the jobs and waits for them, because they refer to this object.
    ~PoolLoader() override {
        std::unique_lock lock(mutex_);
        queue_.clear();
        for (auto& [key, stop] : begun_) stop.request_stop();
        finished_one_.wait(lock, [this] { return begun_.empty(); });
    }

    void advance(double /*time_s*/) override {}  // the pool has no clock of its own
    std::vector<LoadRequest> take_queue() override {
        const std::scoped_lock lock(mutex_);
        return std::exchange(queue_, {});
    }
    void queue(std::vector<LoadRequest> requests) override {
        const std::scoped_lock lock(mutex_);
        queue_ = std::move(requests);
        begin_loads();
    }
    void cancel(const ChunkKey& key) override {
        const std::scoped_lock lock(mutex_);
        if (const auto load = begun_.find(key); load != begun_.end()) load->second.request_stop();
    }
    std::vector<FinishedLoad> take_finished() override {
        const std::scoped_lock lock(mutex_);
        std::sort(finished_.begin(), finished_.end(),
                  [](const FinishedLoad& a, const FinishedLoad& b) { return a.key < b.key; });
        return std::exchange(finished_, {});
    }
    int slots() const override { return slots_; }
    void wait() override {
        std::unique_lock lock(mutex_);
        finished_one_.wait(lock, [this] { return !finished_.empty() || begun_.empty(); });
    }

private:
    // Requires the lock.
    void begin_loads() {
        while (!queue_.empty() && begun_.size() < static_cast<std::size_t>(slots_)) {
            // std::function requires a copyable callable, but a claim can only be moved
            auto request = std::make_shared<LoadRequest>(std::move(queue_.front()));
            queue_.erase(queue_.begin());
            const std::stop_token stop = begun_[request->key].get_token();
            pool_.run([this, request, stop] { load(std::move(*request), stop); });
        }
    }

    void load(LoadRequest request, const std::stop_token& stop) {
        FinishedLoad done = run_load(*source_, std::move(request), stop);
        const std::scoped_lock lock(mutex_);
        begun_.erase(done.key);
        finished_.push_back(std::move(done));
        begin_loads();
        finished_one_.notify_all();
    }

    std::shared_ptr<const HeightSource> source_;
    Pool& pool_;
    int slots_;
    std::mutex mutex_;
    std::condition_variable finished_one_;
    std::vector<LoadRequest> queue_;
    std::map<ChunkKey, std::stop_source> begun_;
    std::vector<FinishedLoad> finished_;
};

}  // namespace

int main() {
    Pool pool(2);  // outlives the pager
    const auto source = FractalHeights::create({.seed = 7}).value();
    Pager pager = Pager::create(source, {}, std::make_unique<PoolLoader>(source, pool, 4)).value();
    CameraNeed camera;
    double time_s = 0.0;  // the program's clock: any clock that does not go back
    for (int frame = 0; frame < 120; ++frame, time_s += 1.0 / 60.0) {
        const WorldPos eye(0.0, 10.0 * frame, 900.0);
        camera.view = look_at(eye, eye + Eigen::Vector3d(0, 4000, -700), 1.0, 1280, 720).value();
        pager.update({&camera, 1}, {}, time_s);
    }
    pager.finish();
    const PagerStats stats = pager.stats();
    std::printf("%zu chunks, %llu failed\n", pager.resident()->chunks().size(),
                static_cast<unsigned long long>(stats.failed));
    return pager.resident()->has_roots() && stats.failed == 0 && stats.late_chunks == 0 ? 0 : 1;
}
