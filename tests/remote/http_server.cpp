// SPDX-License-Identifier: MIT
#include "http_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <sstream>

namespace terrane::test {
namespace {

bool send_all(int handle, const std::string& text) {
    std::size_t done = 0;
    while (done < text.size()) {
        const ssize_t count = send(handle, text.data() + done, text.size() - done, MSG_NOSIGNAL);
        if (count <= 0) return false;
        done += static_cast<std::size_t>(count);
    }
    return true;
}

HttpServer::Request parse(const std::string& text) {
    HttpServer::Request request;
    std::istringstream lines(text);
    std::string line;
    std::getline(lines, line);
    std::istringstream(line) >> line >> request.target;
    while (std::getline(lines, line) && line.size() > 1) {
        const std::size_t colon = line.find(':');
        std::string name = line.substr(0, colon);
        std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
        request.headers[name] = line.substr(colon + 2, line.size() - colon - 3);
    }
    unsigned long long first = 0, last = 0;
    if (const auto range = request.headers.find("range");
        range != request.headers.end() &&
        std::sscanf(range->second.c_str(), "bytes=%llu-%llu", &first, &last) == 2) {
        request.range = {first, last};
    }
    return request;
}

}  // namespace

HttpServer::HttpServer() {
    listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    if (bind(listener_, reinterpret_cast<const sockaddr*>(&address), size) != 0 ||
        listen(listener_, 128) != 0 ||
        getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
        std::perror("http_server");
        std::abort();
    }
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { serve(); });
}

HttpServer::~HttpServer() {
    is_ending_ = true;
    release();
    shutdown(listener_, SHUT_RDWR);
    thread_.join();
    close(listener_);
    {
        const std::lock_guard lock(mutex_);
        for (const int handle : handles_) shutdown(handle, SHUT_RDWR);
    }
    for (std::thread& connection : connections_) connection.join();
}

void HttpServer::put(const std::string& name, std::vector<std::uint8_t> bytes) {
    const std::lock_guard lock(mutex_);
    files_[name].assign(bytes.begin(), bytes.end());
}

void HttpServer::fail_next(const std::string& name, std::vector<ServerFault> faults) {
    const std::lock_guard lock(mutex_);
    next_faults_[name].assign(faults.begin(), faults.end());
}

void HttpServer::fail_always(const std::string& name, ServerFault fault) {
    const std::lock_guard lock(mutex_);
    faults_[name] = std::move(fault);
}

void HttpServer::fail_at_random(ServerFault fault, double share, std::uint64_t seed) {
    const std::lock_guard lock(mutex_);
    random_fault_ = std::move(fault);
    random_share_ = share;
    random_.seed(static_cast<std::minstd_rand::result_type>(seed));
}

void HttpServer::hold() {
    const std::lock_guard lock(mutex_);
    is_held_ = true;
}

void HttpServer::release() {
    const std::lock_guard lock(mutex_);
    is_held_ = false;
    is_released_ = true;
    released_.notify_all();
}

std::vector<HttpServer::Request> HttpServer::requests() const {
    const std::lock_guard lock(mutex_);
    return requests_;
}

void HttpServer::serve() {
    for (;;) {
        const int handle = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
        if (handle < 0) return;
        ++connection_count_;
        const std::lock_guard lock(mutex_);
        handles_.push_back(handle);
        connections_.emplace_back([this, handle] { serve_connection(handle); });
    }
}

void HttpServer::serve_connection(int handle) {
    std::string text;
    for (;;) {
        const std::size_t end = text.find("\r\n\r\n");
        if (end == std::string::npos) {
            char bytes[4096];
            const ssize_t count = recv(handle, bytes, sizeof(bytes), 0);
            if (count <= 0) break;
            text.append(bytes, static_cast<std::size_t>(count));
            continue;
        }
        const Request request = parse(text.substr(0, end + 4));
        text.erase(0, end + 4);
        if (!answer(handle, request)) break;
    }
    const std::lock_guard lock(mutex_);
    std::erase(handles_, handle);
    close(handle);
}

bool HttpServer::is_left(int handle, int milliseconds) const {
    pollfd wait{handle, POLLIN | POLLRDHUP, 0};
    return poll(&wait, 1, milliseconds) > 0;
}

bool HttpServer::send_slowly(int handle, const std::string& body) {
    for (const char letter : body) {
        if (is_ending_) return false;
        if (is_left(handle, 20) || !send_all(handle, std::string(1, letter))) {
            ++aborted_count_;
            return false;
        }
    }
    return true;
}

bool HttpServer::send_halves(int handle, const std::string& reply, std::size_t half) {
    if (!send_all(handle, reply.substr(0, half))) return false;
    while (!is_released_ && !is_ending_) {
        if (!is_left(handle, 5)) continue;
        ++aborted_count_;
        return false;
    }
    return send_all(handle, reply.substr(half));
}

bool HttpServer::answer(int handle, const Request& request) {
    const std::string path = request.target.substr(0, request.target.find('?'));
    const std::string name = path.substr(path.rfind('/') + 1);
    std::optional<ServerFault> fault;
    std::optional<std::string> file;
    {
        std::unique_lock lock(mutex_);
        requests_.push_back(request);
        while (is_held_) {
            lock.unlock();
            if (is_left(handle, 5)) {
                ++aborted_count_;
                return false;
            }
            lock.lock();
        }
        if (auto& faults = next_faults_[name]; !faults.empty()) {
            fault = faults.front();
            faults.pop_front();
        } else if (const auto always = faults_.find(name); always != faults_.end()) {
            fault = always->second;
        } else if (static_cast<double>(random_() % 4096) < random_share_ * 4096.0) {
            fault = random_fault_;
        }
        if (fault) ++fault_count_;
        if (const auto found = files_.find(name); found != files_.end()) file = found->second;
    }
    using Kind = ServerFault::Kind;
    const auto is = [&](Kind kind) { return fault && fault->kind == kind; };
    if (is(Kind::hang)) {
        while (!is_ending_ && !is_left(handle, 5)) continue;
        if (!is_ending_) ++aborted_count_;
        return false;
    }
    if (is(Kind::drop)) return false;
    if (is(Kind::garbage)) {
        send_all(handle, "SSH-2.0-none\r\n\r\n");
        return false;
    }
    if (is(Kind::status) || !file) {
        const int status = file ? fault->status : 404;
        return send_all(handle, "HTTP/1.1 " + std::to_string(status) + " no\r\n" +
                                    (fault ? fault->text : "") + "Content-Length: 3\r\n\r\nno\n");
    }
    std::string body = *file;
    std::uint64_t first = 0, last = body.size() - 1;
    const bool is_part = request.range && !is(Kind::ignore_range);
    if (is_part) {
        std::tie(first, last) = *request.range;
        if (first >= body.size()) {
            return send_all(handle, "HTTP/1.1 416 no\r\nContent-Range: bytes */" +
                                        std::to_string(body.size()) +
                                        "\r\nContent-Length: 0\r\n\r\n");
        }
        if (is(Kind::wrong_range)) ++first, ++last;
        last = std::min<std::uint64_t>(last, body.size() - 1);
        if (is(Kind::too_much)) last += 1000;
        body = body.substr(first, last + 1 - first);
    }
    const std::size_t step = is(Kind::other_file) ? 1 : 500;
    for (std::size_t i = 0; i < body.size() && (is(Kind::wrong_bytes) || step == 1); i += step) {
        body[i] = static_cast<char>(~body[i]);
    }
    std::string head = is_part ? "HTTP/1.1 206 part\r\n" : "HTTP/1.1 200 whole\r\n";
    if (is_part && !is(Kind::no_range)) {
        const std::string total =
            is(Kind::no_total) ? "*"
                               : std::to_string(file->size() + (is(Kind::wrong_total) ? 1 : 0) -
                                                (is(Kind::other_file) ? 1000 : 0));
        head += "Content-Range: bytes " + std::to_string(first) + "-" +
                std::to_string(request.range->second + (is(Kind::wrong_range) ? 1 : 0)) + "/" +
                total + "\r\n";
    }
    if (is(Kind::encoded)) head += "Content-Encoding: gzip\r\n";
    if (is(Kind::no_length)) {  // it ends with the connection
        send_all(handle, head + "\r\n" + body);
        return false;
    }
    head += "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n";
    if (is(Kind::halt)) return send_halves(handle, head + body, head.size() + body.size() / 2);
    if (is(Kind::drip)) return send_all(handle, head) && send_slowly(handle, body);
    if (is(Kind::cut_short)) {
        send_all(handle, head + body.substr(0, body.size() / 2));
        return false;
    }
    if (!send_all(handle, head + body)) {
        ++aborted_count_;
        return false;
    }
    return true;
}

}  // namespace terrane::test
