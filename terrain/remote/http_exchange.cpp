// SPDX-License-Identifier: MIT
#include "http_exchange.h"

#include <algorithm>
#include <cctype>
#include <new>
#include <utility>

namespace terrane::internal {
namespace {

constexpr long kMostRedirects = 5;
/// A server that ignores ranges sends the whole file. It is read only if the wanted part ends before this.
constexpr std::uint64_t kMostSkipped = std::uint64_t{1} << 24;
/// Bytes of an error page that are read, so that the connection can be used again.
constexpr std::uint64_t kLongestErrorPage = std::uint64_t{1} << 16;
/// Bytes per second below which a transfer has stalled.
constexpr double kLeastRate = 1000.0;

long milliseconds(double seconds) { return std::max(1L, static_cast<long>(seconds * 1000.0)); }

/// One line of printable characters.
std::string one_line(std::string text) {
    std::ranges::replace_if(
        text, [](char letter) { return letter >= 0 && letter < ' '; }, ' ');
    while (text.ends_with(' ')) text.pop_back();
    return text;
}

std::string status_text(long status) {
    switch (status) {
        case 401:
            return "status 401 (unauthorized)";
        case 403:
            return "status 403 (forbidden)";
        case 404:
            return "status 404 (not found)";
        case 408:
            return "status 408 (request timeout)";
        case 429:
            return "status 429 (too many requests)";
        case 500:
            return "status 500 (internal server error)";
        case 502:
            return "status 502 (bad gateway)";
        case 503:
            return "status 503 (service unavailable)";
        case 504:
            return "status 504 (gateway timeout)";
        default:
            return "status " + std::to_string(status);
    }
}

/// The value of a header, without the spaces around it, if the line has this name (in lower case).
std::optional<std::string> header_value(std::string_view line, std::string_view name) {
    if (line.size() <= name.size() || line[name.size()] != ':') return std::nullopt;
    for (std::size_t i = 0; i < name.size(); ++i) {
        if (std::tolower(static_cast<unsigned char>(line[i])) != name[i]) return std::nullopt;
    }
    std::string_view value = line.substr(name.size() + 1);
    while (!value.empty() && (value.front() == ' ' || value.front() == '\t'))
        value.remove_prefix(1);
    while (!value.empty() &&
           (value.back() == ' ' || value.back() == '\r' || value.back() == '\n')) {
        value.remove_suffix(1);
    }
    return std::string(value);
}

HttpFault wrong_range(std::string cause) {
    return {
        .kind = &HttpFailures::wrong_range, .code = ErrorCode::bad_data, .cause = std::move(cause)};
}

HttpFault wrong_size(std::string cause) {
    return {
        .kind = &HttpFailures::wrong_size, .code = ErrorCode::bad_data, .cause = std::move(cause)};
}

}  // namespace

HttpClient::HttpClient(HttpAddress address, const HttpSettings& settings)
    : address_(std::move(address)), settings_(settings) {
    static const CURLcode ready = curl_global_init(CURL_GLOBAL_DEFAULT);
    if (ready != CURLE_OK) throw std::bad_alloc();
    const auto add = [&](const std::string& line) {
        curl_slist* const list = curl_slist_append(headers_.get(), line.c_str());
        if (list == nullptr) throw std::bad_alloc();
        (void)headers_.release();
        headers_.reset(list);
    };
    add("Accept-Encoding: identity");
    if (!address_.is_bucket) {
        if (!settings_.authorization.empty()) add("Authorization: " + settings_.authorization);
    } else if (is_signed()) {
        // The hash of the empty body, which older versions of libcurl do not add.
        add("x-amz-content-sha256: "
            "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
        const std::string& token = settings_.s3.session_token;
        if (!token.empty()) add("x-amz-security-token: " + token);
    }
}

CURL* HttpClient::make_handle(const std::string& name) const {
    CURL* const handle = curl_easy_init();
    if (handle == nullptr) throw std::bad_alloc();
    const std::string url = address_.folder + name + address_.query;
    curl_easy_setopt(handle, CURLOPT_URL, url.c_str());
    curl_easy_setopt(handle, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(handle, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(handle, CURLOPT_FOLLOWLOCATION, 1L);
    curl_easy_setopt(handle, CURLOPT_MAXREDIRS, kMostRedirects);
    curl_easy_setopt(handle, CURLOPT_REDIR_PROTOCOLS_STR,
                     address_.is_secure ? "https" : "http,https");
    curl_easy_setopt(handle, CURLOPT_HTTP_VERSION, static_cast<long>(CURL_HTTP_VERSION_2TLS));
    // Waits to learn whether one connection takes all requests (HTTP/2). TLS tells at once, and without it none does.
    curl_easy_setopt(handle, CURLOPT_PIPEWAIT, address_.is_secure ? 1L : 0L);
    curl_easy_setopt(handle, CURLOPT_BUFFERSIZE, 1L << 17);
    curl_easy_setopt(handle, CURLOPT_TCP_KEEPALIVE, 1L);
    curl_easy_setopt(handle, CURLOPT_CONNECTTIMEOUT_MS, milliseconds(settings_.connect_timeout));
    curl_easy_setopt(handle, CURLOPT_SSL_VERIFYPEER, 1L);
    curl_easy_setopt(handle, CURLOPT_SSL_VERIFYHOST, 2L);
    curl_easy_setopt(handle, CURLOPT_USERAGENT, settings_.user_agent.c_str());
    curl_easy_setopt(handle, CURLOPT_HTTPHEADER, headers_.get());
#if LIBCURL_VERSION_NUM >= 0x075700
    // Does not wait for the thread that resolves a host's name.
    curl_easy_setopt(handle, CURLOPT_QUICK_EXIT, 1L);
#endif
    if (!settings_.certificate_file.empty()) {
        curl_easy_setopt(handle, CURLOPT_CAINFO, settings_.certificate_file.c_str());
    }
    if (settings_.use_netrc && !address_.is_bucket) {
        curl_easy_setopt(handle, CURLOPT_NETRC, static_cast<long>(CURL_NETRC_OPTIONAL));
    }
    if (is_signed()) {
        const S3Settings& s3 = settings_.s3;
        curl_easy_setopt(handle, CURLOPT_AWS_SIGV4, ("aws:amz:" + s3.region + ":s3").c_str());
        curl_easy_setopt(handle, CURLOPT_USERNAME, s3.access_key.c_str());
        curl_easy_setopt(handle, CURLOPT_PASSWORD, s3.secret_key.c_str());
    }
    if (!address_.user.empty()) curl_easy_setopt(handle, CURLOPT_USERNAME, address_.user.c_str());
    if (!address_.password.empty()) {
        curl_easy_setopt(handle, CURLOPT_PASSWORD, address_.password.c_str());
    }
    return handle;
}

HttpExchange::HttpExchange(const HttpClient& client, HttpRequest request,
                           std::function<void(std::span<const std::uint8_t>)> take)
    : client_(client),
      request_(std::move(request)),
      take_(std::move(take)),
      handle_(client.make_handle(request_.name)) {
    curl_easy_setopt(handle_, CURLOPT_ERRORBUFFER, curl_text_);
    curl_easy_setopt(handle_, CURLOPT_HEADERFUNCTION, &HttpExchange::on_header);
    curl_easy_setopt(handle_, CURLOPT_HEADERDATA, this);
    curl_easy_setopt(handle_, CURLOPT_WRITEFUNCTION, &HttpExchange::on_body);
    curl_easy_setopt(handle_, CURLOPT_WRITEDATA, this);
    if (request_.file_bytes) {
        const std::string range = std::to_string(request_.offset) + "-" +
                                  std::to_string(request_.offset + request_.bytes - 1);
        curl_easy_setopt(handle_, CURLOPT_RANGE, range.c_str());
    }
}

HttpExchange::~HttpExchange() { curl_easy_cleanup(handle_); }

long HttpExchange::status() const {
    long status = 0;
    curl_easy_getinfo(handle_, CURLINFO_RESPONSE_CODE, &status);
    return status;
}

std::optional<double> HttpExchange::latency() const {
    curl_off_t sent = 0, first_byte = 0;  // microseconds
    curl_easy_getinfo(handle_, CURLINFO_PRETRANSFER_TIME_T, &sent);
    curl_easy_getinfo(handle_, CURLINFO_STARTTRANSFER_TIME_T, &first_byte);
    if (first_byte <= 0) return std::nullopt;
    return static_cast<double>(std::max<curl_off_t>(first_byte - sent, 0)) * 1e-6;
}

bool HttpExchange::has_stalled(Clock::time_point now) {
    curl_off_t sent = 0;
    curl_easy_getinfo(handle_, CURLINFO_PRETRANSFER_TIME_T, &sent);
    if (sent <= 0) return false;  // libcurl watches the time until it is connected
    const double timeout = client_.settings().stall_timeout;
    if (window_start_ && now < *window_start_ + to_duration(timeout)) return false;
    const bool is_slow =
        window_start_ && static_cast<double>(received_ - window_received_) < kLeastRate * timeout;
    window_start_ = now;
    window_received_ = received_;
    return is_slow;
}

std::size_t HttpExchange::on_header(char* text, std::size_t unit, std::size_t count, void* self) {
    static_cast<HttpExchange*>(self)->read_header({text, unit * count});
    return unit * count;
}

void HttpExchange::read_header(std::string_view line) {
    if (line.starts_with("HTTP/")) {  // another reply, after a redirect
        content_range_.clear();
        content_encoding_.clear();
    } else if (auto range = header_value(line, "content-range")) {
        content_range_ = std::move(*range);
    } else if (auto encoding = header_value(line, "content-encoding")) {
        content_encoding_ = std::move(*encoding);
    }
}

std::size_t HttpExchange::on_body(char* bytes, std::size_t unit, std::size_t count, void* self) {
    const std::size_t size = unit * count;
    const std::span body(reinterpret_cast<const std::uint8_t*>(bytes), size);
    // Any other number than the size stops the transfer.
    return static_cast<HttpExchange*>(self)->read_body(body) ? size : size + 1;
}

bool HttpExchange::read_body(std::span<const std::uint8_t> bytes) {
    received_ += bytes.size();
    if (const long code = status(); code != 200 && code != 206) {
        return received_ <= kLongestErrorPage;
    }
    if (!std::exchange(is_checked_, true) && !check_reply()) return false;
    const std::uint64_t skipped = std::min<std::uint64_t>(skip_, bytes.size());
    skip_ -= skipped;
    bytes = bytes.subspan(skipped);
    if (!request_.file_bytes && bytes.size() > request_.bytes - taken_) {
        fault_ = wrong_size("it has more than " + std::to_string(request_.bytes) + " bytes");
        return false;
    }
    const std::uint64_t wanted = std::min<std::uint64_t>(request_.bytes - taken_, bytes.size());
    taken_ += wanted;
    if (wanted > 0) take_(bytes.first(wanted));
    is_complete_ = request_.file_bytes && taken_ == request_.bytes;
    // The rest of a whole file is not needed.
    return !is_complete_ || status() == 206 || request_.offset + taken_ == *request_.file_bytes;
}

bool HttpExchange::check_reply() {
    if (!content_encoding_.empty() && content_encoding_ != "identity") {
        fault_ = wrong_range("the body is encoded (" + one_line(content_encoding_) + ")");
        return false;
    }
    curl_off_t length = -1;
    curl_easy_getinfo(handle_, CURLINFO_CONTENT_LENGTH_DOWNLOAD_T, &length);
    const auto size_fault = [&](std::uint64_t bytes) {
        return wrong_size("it has " + std::to_string(bytes) + " bytes, not " +
                          std::to_string(*request_.file_bytes));
    };
    if (!request_.file_bytes) {
        if (status() == 206) {
            fault_ = wrong_range("a part was sent instead of the whole file");
        } else if (length >= 0 && static_cast<std::uint64_t>(length) > request_.bytes) {
            fault_ = wrong_size("it has " + std::to_string(length) + " bytes, more than " +
                                std::to_string(request_.bytes));
        }
        return !fault_;
    }
    const std::uint64_t end = request_.offset + request_.bytes;
    if (status() == 200) {
        if (length >= 0 && static_cast<std::uint64_t>(length) != *request_.file_bytes) {
            fault_ = size_fault(static_cast<std::uint64_t>(length));
        } else if (end > kMostSkipped) {
            fault_ = wrong_range("the server does not support ranges");
        }
        skip_ = request_.offset;
        has_ignored_range_ = request_.bytes < *request_.file_bytes;
        return !fault_;
    }
    const std::optional<ContentRange> range = parse_content_range(content_range_);
    if (range && range->total && *range->total != *request_.file_bytes) {
        fault_ = size_fault(*range->total);
    } else if (!range || range->first != request_.offset || range->last != end - 1) {
        fault_ =
            wrong_range("another range was sent than bytes " + std::to_string(request_.offset) +
                        "-" + std::to_string(end - 1) + " (" + one_line(content_range_) + ")");
    }
    return !fault_;
}

HttpFault HttpExchange::status_fault() const {
    const long code = status();
    HttpFault fault{.kind = &HttpFailures::refused, .cause = status_text(code)};
    if (code == 416 && request_.file_bytes) {
        return wrong_size("it does not have " + std::to_string(*request_.file_bytes) +
                          " bytes (status 416)");
    }
    if (code == 408) {
        fault.kind = &HttpFailures::timed_out;
        fault.is_transient = true;
    } else if (code == 429 || code == 503) {
        fault.kind = &HttpFailures::busy;
        fault.is_transient = true;
        curl_off_t seconds = 0;
        curl_easy_getinfo(handle_, CURLINFO_RETRY_AFTER, &seconds);
        if (seconds > 0) fault.retry_in = static_cast<double>(seconds);
    } else if (code >= 500) {
        fault.kind = &HttpFailures::server_error;
        // A server that lacks the method (501) or the version of HTTP (505) lacks it again.
        fault.is_transient = code != 501 && code != 505;
    }
    return fault;
}

HttpFault HttpExchange::stall_fault() const {
    return {.kind = &HttpFailures::timed_out,
            .code = ErrorCode::timed_out,
            .cause = received_ == 0 ? "the server does not answer" : "the server sends too slowly",
            .is_transient = true};
}

HttpFault HttpExchange::curl_fault(CURLcode code) const {
    const std::string text =
        one_line(curl_text_[0] != '\0' ? curl_text_ : curl_easy_strerror(code));
    switch (code) {
        case CURLE_COULDNT_RESOLVE_HOST:
        case CURLE_COULDNT_RESOLVE_PROXY:
            return {.kind = &HttpFailures::unresolved, .cause = text, .is_transient = true};
        case CURLE_COULDNT_CONNECT:
        case CURLE_SSL_CONNECT_ERROR:
        case CURLE_INTERFACE_FAILED:
            return {.kind = &HttpFailures::unreachable, .cause = text, .is_transient = true};
        case CURLE_OPERATION_TIMEDOUT:
            return {.kind = &HttpFailures::timed_out,
                    .code = ErrorCode::timed_out,
                    .cause = text,
                    .is_transient = true};
        case CURLE_PEER_FAILED_VERIFICATION:
        case CURLE_SSL_CACERT_BADFILE:
        case CURLE_SSL_CERTPROBLEM:
        case CURLE_SSL_ISSUER_ERROR:
            return {.kind = &HttpFailures::certificate, .cause = text};
        case CURLE_TOO_MANY_REDIRECTS:
            return {.kind = &HttpFailures::redirect,
                    .cause = "more than " + std::to_string(kMostRedirects) + " redirects"};
        default:
            break;
    }
    long redirect_count = 0;
    curl_easy_getinfo(handle_, CURLINFO_REDIRECT_COUNT, &redirect_count);
    if (redirect_count > 0 && (code == CURLE_UNSUPPORTED_PROTOCOL || code == CURLE_URL_MALFORMAT)) {
        return {.kind = &HttpFailures::redirect, .cause = "a redirect is not permitted: " + text};
    }
    return {.kind = &HttpFailures::cut_short, .cause = text, .is_transient = true};
}

std::optional<HttpFault> HttpExchange::finish(CURLcode code) {
    if (is_complete_) return std::nullopt;
    if (fault_) return std::move(fault_);
    const bool is_stopped = code == CURLE_WRITE_ERROR;  // by on_body()
    if (code != CURLE_OK && !is_stopped) return curl_fault(code);
    if (const long number = status(); number != 200 && number != 206) return status_fault();
    if (!is_checked_ && !check_reply()) return std::move(fault_);  // an empty body
    if (!request_.file_bytes) return std::nullopt;
    return HttpFault{.kind = &HttpFailures::cut_short,
                     .cause = "the reply ended after " + std::to_string(taken_) + " of " +
                              std::to_string(request_.bytes) + " bytes",
                     .is_transient = true};
}

}  // namespace terrane::internal
