// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace terrane::test {

/// What is wrong with the reply to one request.
struct ServerFault {
    enum class Kind {
        status,        ///< only a status line and `text` as further headers
        halt,          ///< sends the second half of the body after release()
        cut_short,     ///< closes the connection after half of the body
        drip,          ///< sends a byte of the body every 20 ms
        hang,          ///< reads the request and says nothing
        drop,          ///< closes the connection without an answer
        garbage,       ///< sends what is no HTTP
        ignore_range,  ///< status 200 and the whole file
        wrong_range,   ///< the range that begins one byte later
        wrong_total,   ///< says that the file has one byte more
        no_length,     ///< does not say how long the body is
        no_total,      ///< does not say how long the file is
        no_range,      ///< status 206 without Content-Range
        too_much,      ///< more body than the range has
        wrong_bytes,   ///< inverts one of 500 bytes, from the first on
        other_file,    ///< the range of a file that is 1000 bytes shorter, and has other bytes
        encoded,       ///< says that the body is compressed
    };
    Kind kind = Kind::status;
    int status = 0;
    std::string text;
};

/// A small HTTP/1.1 server on the loopback, whose replies can be wrong.
class HttpServer {
public:
    struct Request {
        std::string target;  // path and query
        std::optional<std::pair<std::uint64_t, std::uint64_t>> range;
        std::map<std::string, std::string> headers;  // names in lower case
    };

    HttpServer();
    ~HttpServer();
    HttpServer(const HttpServer&) = delete;
    HttpServer& operator=(const HttpServer&) = delete;

    int port() const { return port_; }
    /// Address of the folder with all files.
    std::string url() const { return "http://127.0.0.1:" + std::to_string(port_) + "/world/"; }
    void put(const std::string& name, std::vector<std::uint8_t> bytes);
    /// The next replies for a file, one after the other, are wrong.
    void fail_next(const std::string& name, std::vector<ServerFault> faults);
    /// All replies for a file are wrong.
    void fail_always(const std::string& name, ServerFault fault);
    /// This share of all other replies is wrong, 0 to 1.
    void fail_at_random(ServerFault fault, double share, std::uint64_t seed);
    /// Holds replies back until release().
    void hold();
    /// Also of replies that were halted.
    void release();

    std::vector<Request> requests() const;
    int connection_count() const { return connection_count_; }
    /// Replies that were wrong.
    int fault_count() const { return fault_count_; }
    /// Replies that the client did not wait for, or did not read to the end.
    int aborted_count() const { return aborted_count_; }

private:
    void serve();
    void serve_connection(int handle);
    bool answer(int handle, const Request& request);
    bool send_slowly(int handle, const std::string& body);
    bool send_halves(int handle, const std::string& reply, std::size_t half);
    bool is_left(int handle, int milliseconds) const;

    int listener_ = -1, port_ = 0;
    std::atomic<int> connection_count_{0}, aborted_count_{0}, fault_count_{0};
    mutable std::mutex mutex_;
    std::condition_variable released_;
    bool is_held_ = false;
    std::atomic<bool> is_released_{false};
    std::atomic<bool> is_ending_{false};
    std::map<std::string, std::string> files_;
    std::map<std::string, std::list<ServerFault>> next_faults_;
    std::map<std::string, ServerFault> faults_;
    ServerFault random_fault_;
    double random_share_ = 0.0;
    std::minstd_rand random_;
    std::vector<Request> requests_;
    std::vector<int> handles_;
    std::vector<std::thread> connections_;
    std::thread thread_;
};

}  // namespace terrane::test
