// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/terrain/scatter.h>

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace terrane::tools {

/// A square that has been computed.
struct MadeSquare {
    std::size_t scatter = 0;  ///< as given to SquareMaker::request()
    ScatterSquare square;
    /// None where the source's heights could not be read.
    std::optional<std::vector<ScatterPoint>> points;
};

/// Computes squares of scatters on a thread of its own, in the order of the requests, so that frames do not wait for
/// the source.
class SquareMaker {
public:
    /// @param has_thread false: request() computes the square itself, so that every run gives the same frames
    explicit SquareMaker(bool has_thread);
    SquareMaker(const SquareMaker&) = delete;
    SquareMaker& operator=(const SquareMaker&) = delete;
    ~SquareMaker();

    /// @param scatter the caller's number of it
    /// @param from    must live until the square has been taken, or the maker is destroyed
    void request(std::size_t scatter, const Scatter& from, const ScatterSquare& square);
    /// Appends at most `most` computed squares, in the order of their requests.
    void take(std::size_t most, std::vector<MadeSquare>& made_out);
    /// Waits until all requested squares are computed.
    void finish();

private:
    struct Request {
        std::size_t scatter;
        const Scatter* from;
        ScatterSquare square;
    };
    static MadeSquare make(const Request& request);
    void run(const std::stop_token& stop);

    std::mutex mutex_;
    std::condition_variable_any changed_;
    std::deque<Request> requests_;  // the first one is being computed
    std::deque<MadeSquare> made_;
    std::jthread thread_;  // last: it uses all of the above
};

}  // namespace terrane::tools
