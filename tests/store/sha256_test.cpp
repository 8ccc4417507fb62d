// SPDX-License-Identifier: MIT
#include "store_format.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace terrane::internal {
namespace sha256_test {

std::string sha_of_text(const std::string& text) {
    return sha256(std::vector<std::uint8_t>(text.begin(), text.end()));
}

// The examples of NIST for FIPS 180-4.
TEST(Sha256, GivesWhatTheStandardSays) {
    EXPECT_EQ(sha_of_text(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    EXPECT_EQ(sha_of_text("abc"),
              "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    EXPECT_EQ(sha_of_text("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
              "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
    EXPECT_EQ(sha_of_text(std::string(1'000'000, 'a')),
              "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

}  // namespace sha256_test
}  // namespace terrane::internal
