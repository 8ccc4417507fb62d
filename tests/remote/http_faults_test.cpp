// SPDX-License-Identifier: MIT
#include "remote_files.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <ostream>

namespace terrane::http_faults_test {

using namespace test;
using Kind = ServerFault::Kind;

constexpr std::uint64_t kFileBytes = 10 * kBlock;

struct Case {
    const char* name;
    ServerFault fault;
    std::uint64_t HttpFailures::*kind;  // null: no failure
    bool is_repeated;
    const char* message;  // part of it
    ErrorCode code = ErrorCode::io;

    friend void PrintTo(const Case& fault_case, std::ostream* out) { *out << fault_case.name; }
};

const std::array kCases{
    Case{"Status404",
         {Kind::status, 404, ""},
         &HttpFailures::refused,
         false,
         ": status 404 (not found)"},
    Case{"Status403",
         {Kind::status, 403, ""},
         &HttpFailures::refused,
         false,
         ": status 403 (forbidden)"},
    Case{"Status304", {Kind::status, 304, ""}, &HttpFailures::refused, false, ": status 304"},
    Case{"Status416",
         {Kind::status, 416, ""},
         &HttpFailures::wrong_size,
         false,
         "it does not have 40960 bytes",
         ErrorCode::bad_data},
    Case{"Status408", {Kind::status, 408, ""}, &HttpFailures::timed_out, true, ": status 408"},
    Case{"Status429",
         {Kind::status, 429, ""},
         &HttpFailures::busy,
         true,
         ": status 429 (too many requests)"},
    Case{"Status500", {Kind::status, 500, ""}, &HttpFailures::server_error, true, ": status 500"},
    Case{"Status501", {Kind::status, 501, ""}, &HttpFailures::server_error, false, ": status 501"},
    Case{"Status503", {Kind::status, 503, ""}, &HttpFailures::busy, true, ": status 503"},
    Case{"CutShort", {Kind::cut_short, 0, ""}, &HttpFailures::cut_short, true, "2048"},
    Case{"Drip",
         {Kind::drip, 0, ""},
         &HttpFailures::timed_out,
         true,
         ": the server sends too slowly",
         ErrorCode::timed_out},
    Case{"Hang",
         {Kind::hang, 0, ""},
         &HttpFailures::timed_out,
         true,
         ": the server does not answer",
         ErrorCode::timed_out},
    Case{"Drop", {Kind::drop, 0, ""}, &HttpFailures::cut_short, true, ": Empty reply from server"},
    Case{"Garbage", {Kind::garbage, 0, ""}, &HttpFailures::cut_short, true, "HTTP/0.9"},
    Case{"WrongRange",
         {Kind::wrong_range, 0, ""},
         &HttpFailures::wrong_range,
         false,
         "another range was sent than bytes 8192-12287 (bytes 8193-12288/40960)",
         ErrorCode::bad_data},
    Case{"NoRange",
         {Kind::no_range, 0, ""},
         &HttpFailures::wrong_range,
         false,
         "another range was sent",
         ErrorCode::bad_data},
    Case{"WrongTotal",
         {Kind::wrong_total, 0, ""},
         &HttpFailures::wrong_size,
         false,
         "it has 40961 bytes, not 40960",
         ErrorCode::bad_data},
    Case{"Encoded",
         {Kind::encoded, 0, ""},
         &HttpFailures::wrong_range,
         false,
         "the body is encoded (gzip)",
         ErrorCode::bad_data},
    Case{"RedirectLoop",
         {Kind::status, 302, "Location: /world/" + kShard + "\r\n"},
         &HttpFailures::redirect,
         false,
         "more than 5 redirects"},
    Case{"RedirectToFile",
         {Kind::status, 302, "Location: file:///etc/passwd\r\n"},
         &HttpFailures::redirect,
         false,
         "a redirect is not permitted"},
    Case{"RedirectToFtp",
         {Kind::status, 302, "Location: ftp://127.0.0.1/a\r\n"},
         &HttpFailures::redirect,
         false,
         "a redirect is not permitted"},
    Case{"RedirectToNowhere",
         {Kind::status, 302, ""},
         &HttpFailures::refused,
         false,
         ": status 302"},
};

/// Stalls are found soon. A reply of the test's server may take as long as the machine is busy.
HttpSettings impatient_settings(const Case& each) {
    HttpSettings settings = quick_settings();
    if (each.fault.kind == Kind::drip || each.fault.kind == Kind::hang)
        settings.stall_timeout = 0.1;
    settings.retry_count = 2;
    return settings;
}

class HttpFaults : public testing::TestWithParam<Case> {
protected:
    static void SetUpTestSuite() { setenv("no_proxy", "127.0.0.1,localhost", 1); }
    void SetUp() override { server_.put(kShard, file_of(kFileBytes)); }

    HttpServer server_;
};

TEST_P(HttpFaults, EndsInOneClearLine) {
    const Case& each = GetParam();
    const auto files = open_files(server_.url(), impatient_settings(each));
    server_.fail_always(kShard, each.fault);
    const Read read(2 * kBlock, 100, kFileBytes);
    const FileRange& range = read.range();
    const auto done = files->read({&range, 1}, {});
    ASSERT_FALSE(done.has_value());
    const std::string& message = done.error().message;
    EXPECT_EQ(done.error().code, each.code);
    EXPECT_EQ(message.find("cannot read \"" + server_.url() + kShard + "\": "), 0u) << message;
    EXPECT_NE(message.find(each.message), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    const HttpStatistics statistics = files->statistics();
    const std::uint64_t tries = each.is_repeated ? 3 : 1;
    EXPECT_EQ(statistics.failures.*each.kind, tries);
    EXPECT_EQ(failure_count(statistics.failures), tries);
    EXPECT_EQ(statistics.retries, tries - 1);
    EXPECT_EQ(statistics.requests, tries);
    const bool is_loop = std::string_view(each.name) == "RedirectLoop";
    EXPECT_EQ(server_.requests().size(), is_loop ? 6 : tries);
    EXPECT_EQ(message.find("(3 tries)") != std::string::npos, each.is_repeated) << message;
}

TEST_P(HttpFaults, AreOverWhenTheServerRecovers) {
    const Case& each = GetParam();
    const auto files = open_files(server_.url(), impatient_settings(each));
    server_.fail_next(kShard, {each.fault});
    const std::string error = read_one(*files, 0, kFileBytes, kFileBytes);
    const bool is_over = each.is_repeated || std::string_view(each.name) == "RedirectLoop";
    EXPECT_EQ(error.empty(), is_over) << error;
    EXPECT_EQ(read_one(*files, 0, kFileBytes, kFileBytes), "");
}

INSTANTIATE_TEST_SUITE_P(All, HttpFaults, testing::ValuesIn(kCases),
                         [](const auto& each) { return std::string(each.param.name); });

class HttpReplies : public HttpFaults {};

TEST_F(HttpReplies, APartialBodyKeepsItsCompleteBlocks) {
    const auto files = open_files(server_.url());
    server_.fail_next(kShard, {{.kind = Kind::cut_short, .text = {}}});
    EXPECT_EQ(read_one(*files, 0, 4 * kBlock, kFileBytes), "");
    const auto requests = server_.requests();
    ASSERT_EQ(requests.size(), 2u);
    EXPECT_EQ(requests[1].range,
              (std::pair<std::uint64_t, std::uint64_t>(2 * kBlock, 4 * kBlock - 1)));
}

TEST_F(HttpReplies, AServerWithoutRangesSendsMoreThanIsTaken) {
    const auto files = open_files(server_.url());
    server_.fail_always(kShard, {.kind = Kind::ignore_range, .text = {}});
    EXPECT_EQ(read_one(*files, 3 * kBlock + 5, 10, kFileBytes), "");
    EXPECT_EQ(files->statistics().ignored_ranges, 1u);
    EXPECT_EQ(read_one(*files, 0, kFileBytes, kFileBytes), "");
    EXPECT_EQ(failure_count(files->statistics().failures), 0u);
    // The whole file in one request is no part.
    const auto whole = open_files(server_.url());
    server_.put(kShard, file_of(kBlock));
    EXPECT_EQ(read_one(*whole, 0, kBlock, kBlock), "");
    EXPECT_EQ(whole->statistics().ignored_ranges, 0u);
    server_.put(kShard, file_of(kFileBytes));
    // A file of another size, and a position to which too much would have to be read.
    EXPECT_NE(read_one(*files, 0, 10, kFileBytes + 1).find("it has 40960 bytes, not 40961"),
              std::string::npos);
    const std::uint64_t large = (std::uint64_t{1} << 24) + kBlock;
    server_.put(kShard, file_of(large));
    EXPECT_EQ(read_one(*files, 20, 10, large), "");
    const std::string error = read_one(*files, large - 1, 1, large);
    EXPECT_NE(error.find("the server does not support ranges"), std::string::npos) << error;
    EXPECT_LT(files->statistics().bytes, large);  // the transfer was stopped
}

TEST_F(HttpReplies, ALengthThatTheServerDoesNotKnowIsNotNeeded) {
    const auto files = open_files(server_.url());
    server_.fail_always(kShard, {.kind = Kind::no_total, .text = {}});
    EXPECT_EQ(read_one(*files, 0, kFileBytes, kFileBytes), "");
    server_.fail_always(kShard, {.kind = Kind::too_much, .text = {}});
    EXPECT_EQ(read_one(*files, 100, 10, kFileBytes), "");
}

TEST_F(HttpReplies, ABodyWithoutALengthEndsWithTheConnection) {
    const auto files = open_files(server_.url());
    server_.fail_always(kShard, {.kind = Kind::no_length, .text = {}});
    EXPECT_EQ(read_one(*files, 0, kFileBytes, kFileBytes), "");
    EXPECT_EQ(files->read_whole(kShard, kFileBytes).value(), file_of(kFileBytes));
    const auto too_long = files->read_whole(kShard, 10);
    ASSERT_FALSE(too_long.has_value());
    EXPECT_EQ(too_long.error().code, ErrorCode::bad_data);
    EXPECT_NE(too_long.error().message.find("it has more than 10 bytes"), std::string::npos);
}

TEST_F(HttpReplies, RetryAfterIsObeyedByAllRequests) {
    HttpSettings settings = quick_settings();
    settings.read_timeout = 10.0;
    const auto files = open_files(server_.url(), settings);
    server_.fail_next(kShard, {{Kind::status, 503, "Retry-After: 1\r\n"}});
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(read_one(*files, 0, 10, kFileBytes), "");
    EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::seconds(1));
    EXPECT_EQ(files->statistics().failures.busy, 1u);
    // A wish beyond the deadline fails at once, and so do later reads, without a request.
    server_.fail_next(kShard, {{Kind::status, 429, "Retry-After: 3600\r\n"}});
    const std::string error = read_one(*files, 5 * kBlock, 10, kFileBytes);
    EXPECT_NE(error.find("status 429 (too many requests), to be retried after 3600 s"),
              std::string::npos)
        << error;
    EXPECT_EQ(error.find("no complete answer"), std::string::npos) << error;
    const std::size_t request_count = server_.requests().size();
    const std::string later = read_one(*files, 9 * kBlock, 10, kFileBytes);
    EXPECT_NE(later.find("the server is busy, and wants no request for "), std::string::npos)
        << later;
    EXPECT_EQ(files->read_whole(kShard, kFileBytes).error().code, ErrorCode::io);
    EXPECT_EQ(server_.requests().size(), request_count);
    EXPECT_EQ(read_one(*files, 0, 10, kFileBytes), "");  // from memory
}

TEST_F(HttpReplies, TheDeadlineEndsRepetitions) {
    HttpSettings settings = quick_settings();
    settings.read_timeout = 0.2;
    settings.retry_count = 100;
    settings.first_retry_delay = settings.longest_retry_delay = 0.03;
    const auto files = open_files(server_.url(), settings);
    server_.fail_always(kShard, {Kind::status, 500, ""});
    const std::string error = read_one(*files, 0, 10, kFileBytes);
    EXPECT_NE(error.find("status 500"), std::string::npos) << error;
    EXPECT_LT(server_.requests().size(), 10u);
}

TEST_F(HttpReplies, WholeFilesAreRepeatedToo) {
    const auto files = open_files(server_.url());
    server_.fail_next(kShard,
                      {{Kind::status, 500, ""}, {Kind::cut_short, 0, ""}, {Kind::drop, 0, ""}});
    EXPECT_EQ(files->read_whole(kShard, kFileBytes).value(), file_of(kFileBytes));
    EXPECT_EQ(files->statistics().retries, 3u);
}

TEST_F(HttpReplies, RedirectsAreFollowed) {
    server_.put("moved", file_of(kFileBytes));
    server_.fail_always(kShard, {Kind::status, 301, "Location: moved\r\n"});
    EXPECT_EQ(read_one(*open_files(server_.url()), 0, kFileBytes, kFileBytes), "");
}

TEST_F(HttpReplies, AHostThatDoesNotResolveIsNamed) {
    HttpSettings settings = quick_settings();
    settings.retry_count = 0;
    const auto files = open_files("http://me:secret@no-such-host.invalid/a/?secret", settings);
    const std::string error = read_one(*files, 0, 10, kFileBytes);
    EXPECT_NE(error.find("no-such-host.invalid"), std::string::npos) << error;
    EXPECT_EQ(error.find("secret"), std::string::npos) << error;
    EXPECT_EQ(files->statistics().failures.unresolved, 1u) << error;
}

TEST_F(HttpReplies, ARefusedConnectionIsRepeated) {
    const int port = HttpServer().port();  // closed again
    HttpSettings settings = quick_settings();
    settings.retry_count = 2;
    const auto files = open_files("http://127.0.0.1:" + std::to_string(port) + "/", settings);
    const std::string error = read_one(*files, 0, 10, kFileBytes);
    EXPECT_NE(error.find("(3 tries)"), std::string::npos) << error;
    EXPECT_EQ(files->statistics().failures.unreachable, 3u);
}

// A socket that listens, whose connections nobody accepts: TLS waits for an answer.
TEST_F(HttpReplies, AConnectionThatHangsTimesOut) {
    const int listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    ASSERT_EQ(bind(listener, reinterpret_cast<const sockaddr*>(&address), size), 0);
    ASSERT_EQ(listen(listener, 4), 0);
    getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
    HttpSettings settings = quick_settings();
    settings.connect_timeout = 0.1;
    settings.retry_count = 1;
    const auto files =
        open_files("https://127.0.0.1:" + std::to_string(ntohs(address.sin_port)) + "/", settings);
    const Read read(0, 10, kFileBytes);
    const FileRange& range = read.range();
    const auto done = files->read({&range, 1}, {});
    EXPECT_EQ(done.error().code, ErrorCode::timed_out) << done.error().message;
    EXPECT_EQ(files->statistics().failures.timed_out, 2u);
    close(listener);
}

}  // namespace terrane::http_faults_test
