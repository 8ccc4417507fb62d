// SPDX-License-Identifier: MIT
#include "tls_server.h"

namespace terrane::tls_test {

using namespace test;

constexpr std::uint64_t kFileBytes = 10 * kBlock;

class Tls : public testing::Test {
protected:
    static void SetUpTestSuite() { setenv("no_proxy", "127.0.0.1,localhost", 1); }

    TlsServer server_;
};

TEST_F(Tls, CertificatesAreChecked) {
    const std::vector<std::uint8_t> bytes = file_of(kFileBytes);
    write_file(server_.file(kShard), {bytes.begin(), bytes.end()});
    // The second certificate is for another host.
    for (const std::string host : {"localhost", "elsewhere"}) {
        if (!server_.make_certificate(host)) GTEST_SKIP() << "the program openssl was not found";
        const std::string url = server_.serve(host, "-WWW");
        HttpSettings settings = quick_settings();
        const auto untrusting = open_files(url, settings);
        const std::string error = read_one(*untrusting, 0, 10, kFileBytes);
        EXPECT_NE(error.find("certificate"), std::string::npos) << error;
        EXPECT_EQ(untrusting->statistics().failures.certificate, 1u);
        EXPECT_EQ(untrusting->statistics().retries, 0u);

        settings.certificate_file = server_.file(host + ".pem");
        const auto trusting = open_files(url, settings);
        const std::string answer = read_one(*trusting, 2 * kBlock, kBlock, kFileBytes);
        const bool is_right = host == "localhost";
        EXPECT_EQ(answer.empty(), is_right) << answer;
        EXPECT_EQ(trusting->statistics().failures.certificate, is_right ? 0u : 1u);

        settings.certificate_file = server_.file("absent.pem");
        EXPECT_NE(read_one(*open_files(url, settings), 0, 10, kFileBytes), "");
    }
}

TEST_F(Tls, NoRedirectLeadsToAnAddressWithoutTls) {
    HttpServer plain;
    plain.put(kShard, file_of(kFileBytes));
    if (!server_.make_certificate("localhost")) GTEST_SKIP() << "the program openssl was not found";
    const std::string reply =
        "HTTP/1.1 302 Found\r\nLocation: " + plain.url() + kShard + "\r\nContent-Length: 0\r\n\r\n";
    write_file(server_.file(kShard), {reply.begin(), reply.end()});
    HttpSettings settings = quick_settings();
    const std::string url = server_.serve("localhost", "-HTTP");
    settings.certificate_file = server_.file("localhost.pem");
    const auto files = open_files(url, settings);
    const std::string error = read_one(*files, 0, 10, kFileBytes);
    EXPECT_NE(error.find("a redirect is not permitted"), std::string::npos) << error;
    EXPECT_EQ(files->statistics().failures.redirect, 1u);
    EXPECT_TRUE(plain.requests().empty());
}

}  // namespace terrane::tls_test
