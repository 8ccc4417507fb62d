// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/remote/http_files.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace terrane::internal {

/// Where the files of a server are.
struct HttpAddress {
    /// Scheme, host, port and path up to its last slash; without user and password.
    std::string folder;
    std::string query;           ///< from the question mark on, or empty; may be a secret
    std::string user, password;  ///< decoded; empty: none
    bool is_secure = false;      ///< https
    bool is_bucket = false;      ///< of an object store: see S3Settings
};

/// Parses the address of a folder or of its terrain.json.
/// Fails: invalid_argument, without user, password and query in the message
Result<HttpAddress> parse_http_address(const std::string& url, const S3Settings& s3 = {});

/// Whether an address begins with s3://.
bool is_bucket_address(std::string_view url);

/// Whether a name is one file of a folder: letters, digits, '.', '_' and '-', not beginning with a dot.
bool is_file_name(std::string_view name);

/// The value of a header Content-Range.
struct ContentRange {
    std::uint64_t first = 0, last = 0;   ///< first and last byte
    std::optional<std::uint64_t> total;  ///< size of the file, if the server knows it
};

/// Parses "bytes 0-99/1000" and "bytes 0-99/*"; nothing if the text is something else.
std::optional<ContentRange> parse_content_range(std::string_view text);

/// An address as messages may show it: without user, password, query and fragment, and without control characters.
std::string shown_address(std::string_view url);

}  // namespace terrane::internal
