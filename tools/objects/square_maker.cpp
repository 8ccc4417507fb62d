// SPDX-License-Identifier: MIT
#include "objects/square_maker.h"

#include <utility>

namespace terrane::tools {

SquareMaker::SquareMaker(bool has_thread) {
    if (has_thread) thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

SquareMaker::~SquareMaker() = default;

MadeSquare SquareMaker::make(const Request& request) {
    MadeSquare made = {request.scatter, request.square, {}};
    Result<std::vector<ScatterPoint>> points = request.from->objects_in(request.square);
    if (points) made.points = *std::move(points);
    return made;
}

void SquareMaker::run(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (changed_.wait(lock, stop, [&] { return !requests_.empty(); })) {
        const Request request = requests_.front();
        lock.unlock();
        MadeSquare made = make(request);
        lock.lock();
        made_.push_back(std::move(made));
        requests_.pop_front();
        changed_.notify_all();
        if (stop.stop_requested()) return;
    }
}

void SquareMaker::request(std::size_t scatter, const Scatter& from, const ScatterSquare& square) {
    const Request request = {scatter, &from, square};
    if (!thread_.joinable()) {
        made_.push_back(make(request));
        return;
    }
    const std::lock_guard lock(mutex_);
    requests_.push_back(request);
    changed_.notify_all();
}

void SquareMaker::take(std::size_t most, std::vector<MadeSquare>& made_out) {
    const std::lock_guard lock(mutex_);
    for (; most > 0 && !made_.empty(); --most) {
        made_out.push_back(std::move(made_.front()));
        made_.pop_front();
    }
}

void SquareMaker::finish() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return requests_.empty(); });
}

}  // namespace terrane::tools
