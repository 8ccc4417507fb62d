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
