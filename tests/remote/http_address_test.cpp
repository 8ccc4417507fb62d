// SPDX-License-Identifier: MIT
#include "http_address.h"

#include <gtest/gtest.h>

namespace terrane::http_address_test {

using namespace internal;

TEST(HttpAddress, IsTheFolderOfTerrainJson) {
    for (const char* const url :
         {"https://host:81/a/b/terrain.json", "https://host:81/a/b/", "https://host:81/a/b"}) {
        const auto address = parse_http_address(url);
        ASSERT_TRUE(address.has_value()) << address.error().message;
        EXPECT_EQ(address->folder, "https://host:81/a/b/");
        EXPECT_TRUE(address->is_secure);
    }
    EXPECT_EQ(parse_http_address("http://host")->folder, "http://host/");
    EXPECT_EQ(parse_http_address("HTTP://host/terrain.json")->folder, "http://host/");
    EXPECT_EQ(parse_http_address("http://host/notterrain.json")->folder,
              "http://host/notterrain.json/");
    EXPECT_EQ(parse_http_address("http://[::1]:8/x%20y/")->folder, "http://[::1]:8/x%20y/");
    EXPECT_FALSE(parse_http_address("http://host")->is_secure);
}

TEST(HttpAddress, KeepsSecretsApart) {
    const auto address =
        parse_http_address("https://me:p%40ss@host/a/terrain.json?token=1&b=2#there");
    ASSERT_TRUE(address.has_value());
    EXPECT_EQ(address->folder, "https://host/a/");
    EXPECT_EQ(address->query, "?token=1&b=2");
    EXPECT_EQ(address->user, "me");
    EXPECT_EQ(address->password, "p@ss");
}

TEST(HttpAddress, OfABucketIsThatOfItsServer) {
    S3Settings s3;
    s3.region = "eu-central-1";
    const auto address = parse_http_address("s3://my-bucket/a/terrain.json", s3);
    ASSERT_TRUE(address.has_value()) << address.error().message;
    EXPECT_EQ(address->folder, "https://my-bucket.s3.eu-central-1.amazonaws.com/a/");
    EXPECT_TRUE(address->is_bucket);
    EXPECT_TRUE(address->is_secure);
    EXPECT_FALSE(parse_http_address("https://host/a/", s3)->is_bucket);
    EXPECT_EQ(parse_http_address("s3://my.bucket/", s3)->folder,
              "https://s3.eu-central-1.amazonaws.com/my.bucket/");
    EXPECT_EQ(parse_http_address("s3://my-bucket", s3)->folder,
              "https://my-bucket.s3.eu-central-1.amazonaws.com/");
    for (const char* const endpoint : {"http://localhost:9000", "http://localhost:9000/"}) {
        s3.endpoint = endpoint;
        EXPECT_EQ(parse_http_address("s3://my.bucket/a/", s3)->folder,
                  "http://localhost:9000/my.bucket/a/");
    }
    for (const char* const url :
         {"s3://", "s3:///a/", "s3://My-Bucket/a/", "s3://ab/a/", "s3://a..b/", "s3://.ab/",
          "s3://my-bucket:80/a/", "s3://key:secret@my-bucket/a/", "s3://my-bucket/a/?secret",
          "s3://my-bucket/a/#secret"}) {
        const auto refused = parse_http_address(url);
        ASSERT_FALSE(refused.has_value()) << url;
        EXPECT_EQ(refused.error().message.find("secret"), std::string::npos)
            << refused.error().message;
    }
    s3.endpoint = "ftp://host";
    EXPECT_FALSE(parse_http_address("s3://my-bucket/", s3).has_value());
}

TEST(HttpAddress, RefusesWhatIsNoAddressWithoutShowingSecrets) {
    for (const char* const url :
         {"", "terrain.json", "/a/terrain.json", "file:///etc/passwd", "ftp://me:secret@host/",
          "http://", "http://me:secret@host:99999/a?secret", "http://me:secret@ho st/",
          "http://me:secret/@host/\n", "https://me:sec:secret@ho[st/"}) {
        const auto address = parse_http_address(url);
        ASSERT_FALSE(address.has_value()) << url;
        EXPECT_EQ(address.error().code, ErrorCode::invalid_argument);
        const std::string& message = address.error().message;
        EXPECT_EQ(message.find("secret"), std::string::npos) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
}

TEST(HttpAddress, ShownAddressHasNoUserAndNoQuery) {
    EXPECT_EQ(shown_address("http://me:word@host/a?b#c"), "http://host/a");
    EXPECT_EQ(shown_address("http://host/a"), "http://host/a");
    EXPECT_EQ(shown_address("me:word@host"), "host");
    EXPECT_EQ(shown_address("a\nb"), "a b");
}

TEST(HttpAddress, FileNamesHaveNoFolders) {
    for (const char* const name : {"terrain.json", "0f.shard", "a_b-C.9"})
        EXPECT_TRUE(is_file_name(name));
    for (const char* const name : {"", ".", "..", "../a", "a/b", "a?b", "a b", "a%2f", ".a"}) {
        EXPECT_FALSE(is_file_name(name)) << name;
    }
}

TEST(HttpAddress, ContentRangeIsReadExactly) {
    const auto range = parse_content_range("bytes 5-9/100");
    ASSERT_TRUE(range.has_value());
    EXPECT_EQ(range->first, 5u);
    EXPECT_EQ(range->last, 9u);
    EXPECT_EQ(range->total, 100u);
    EXPECT_EQ(parse_content_range("bytes 0-0/*")->total, std::nullopt);
    for (const char* const text :
         {"", "bytes", "bytes */100", "bytes 5-4/100", "bytes 5-9/9", "bytes 5-9", "items 5-9/100",
          "bytes 5-9/100x", "bytes -9/100", "bytes 5-/100", "bytes 5-99999999999999999999/100",
          "bytes  5-9/100"}) {
        EXPECT_FALSE(parse_content_range(text).has_value()) << text;
    }
}

}  // namespace terrane::http_address_test
