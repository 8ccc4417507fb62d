// SPDX-License-Identifier: MIT
#pragma once

#include "http_address.h"

#include <terrane/base/result.h>
#include <terrane/remote/http_files.h>

#include <curl/curl.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace terrane::internal {

using Clock = std::chrono::steady_clock;

inline Clock::duration to_duration(double seconds) {
    return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

/// What a server is asked for: bytes of a file, or the whole file.
struct HttpRequest {
    std::string name;  ///< of the file
    std::uint64_t offset = 0;
    std::uint64_t bytes = 0;  ///< of the range; of a whole file, the most that are accepted
    /// Size that the file must have; nothing: the whole file is wanted.
    std::optional<std::uint64_t> file_bytes;
};

/// Why a request failed.
struct HttpFault {
    std::uint64_t HttpFailures::*kind = nullptr;
    ErrorCode code = ErrorCode::io;
    std::string cause;                 ///< for messages: "status 404 (not found)"
    bool is_transient = false;         ///< whether repeating the request can help
    std::optional<double> retry_in{};  ///< seconds that the server wants the client to wait
};

/// What all requests of one server share: the address and options of libcurl.
class HttpClient {
public:
    HttpClient(HttpAddress address, const HttpSettings& settings);

    const HttpAddress& address() const { return address_; }
    const HttpSettings& settings() const { return settings_; }
    /// Address of a file for messages.
    std::string shown(const std::string& name) const {
        return "\"" + address_.folder + name + "\"";
    }
    /// Makes a handle with all options but the range and the callbacks.
    CURL* make_handle(const std::string& name) const;

private:
    bool is_signed() const { return address_.is_bucket && !settings_.s3.access_key.empty(); }

    struct FreeList {
        void operator()(curl_slist* list) const { curl_slist_free_all(list); }
    };
    HttpAddress address_;
    HttpSettings settings_;
    std::unique_ptr<curl_slist, FreeList> headers_;
};

/// Sends one request and checks its reply. Threads: that of the transfers
class HttpExchange {
public:
    /// @param take  is called with the wanted bytes as they arrive, in order
    HttpExchange(const HttpClient& client, HttpRequest request,
                 std::function<void(std::span<const std::uint8_t>)> take);
    ~HttpExchange();
    HttpExchange(const HttpExchange&) = delete;
    HttpExchange& operator=(const HttpExchange&) = delete;

    CURL* handle() const { return handle_; }
    /// Bytes of the reply so far, wanted or not.
    std::uint64_t received() const { return received_; }
    /// Whether the server sends the whole file in place of a part.
    bool has_ignored_range() const { return has_ignored_range_; }
    /// Seconds from the request to the first byte of the reply; nothing before that.
    std::optional<double> latency() const;
    /// Whether the server has sent too little for too long. Call it often.
    bool has_stalled(Clock::time_point now);

    /// Why the request failed, if it did. Call once, when libcurl has ended the transfer.
    std::optional<HttpFault> finish(CURLcode code);
    /// The same for a transfer that has stalled.
    HttpFault stall_fault() const;

private:
    static std::size_t on_header(char* text, std::size_t unit, std::size_t count, void* self);
    static std::size_t on_body(char* bytes, std::size_t unit, std::size_t count, void* self);
    void read_header(std::string_view line);
    bool read_body(std::span<const std::uint8_t> bytes);
    bool check_reply();
    HttpFault status_fault() const;
    HttpFault curl_fault(CURLcode code) const;
    long status() const;

    const HttpClient& client_;
    const HttpRequest request_;
    std::function<void(std::span<const std::uint8_t>)> take_;
    CURL* handle_ = nullptr;
    char curl_text_[CURL_ERROR_SIZE]{};

    // the reply
    std::string content_range_, content_encoding_;
    std::optional<HttpFault> fault_;
    bool is_checked_ = false, is_complete_ = false, has_ignored_range_ = false;
    std::uint64_t skip_ = 0;   // bytes before the wanted range
    std::uint64_t taken_ = 0;  // wanted bytes so far
    std::uint64_t received_ = 0;
    // stalls
    std::optional<Clock::time_point> window_start_;
    std::uint64_t window_received_ = 0;
};

}  // namespace terrane::internal
