// SPDX-License-Identifier: MIT
#include "http_address.h"

#include <curl/curl.h>

#include <algorithm>
#include <charconv>
#include <memory>

namespace terrane::internal {
namespace {

struct FreeUrl {
    void operator()(CURLU* url) const { curl_url_cleanup(url); }
};

/// A part of an address; empty if there is none.
std::string part_of(CURLU* url, CURLUPart part, unsigned flags = 0) {
    char* text = nullptr;
    if (curl_url_get(url, part, &text, flags) != CURLUE_OK) return {};
    std::string copy(text);
    curl_free(text);
    return copy;
}

/// Reads a number at the front of the text and removes it.
bool take_number(std::string_view& text, std::uint64_t& number_out) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number_out);
    if (error != std::errc{}) return false;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    return true;
}

bool take_letter(std::string_view& text, char letter) {
    if (!text.starts_with(letter)) return false;
    text.remove_prefix(1);
    return true;
}

constexpr std::string_view kBucketScheme = "s3://";

tl::unexpected<Error> refuse_address(const std::string& url, const std::string& cause) {
    return fail(ErrorCode::invalid_argument,
                "cannot open \"" + shown_address(url) + "\": " + cause);
}

/// Whether a text can be the name of a bucket: 3 to 63 lower-case letters, digits, hyphens and dots.
bool is_bucket_name(std::string_view name) {
    constexpr std::size_t kLeast = 3, kMost = 63;
    return name.size() >= kLeast && name.size() <= kMost && name.front() != '.' &&
           name.back() != '.' && name.find("..") == std::string_view::npos &&
           std::ranges::all_of(name, [](char letter) {
               return (letter >= 'a' && letter <= 'z') || (letter >= '0' && letter <= '9') ||
                      letter == '-' || letter == '.';
           });
}

/// The address of a folder in a bucket, as https or, with an endpoint, as its scheme.
Result<std::string> address_of_bucket(const std::string& url, const S3Settings& s3) {
    const std::string place = url.substr(kBucketScheme.size());
    if (place.find_first_of("?#@") != std::string::npos) {
        return refuse_address(url, "the address of a bucket has no user, query or fragment");
    }
    const std::string bucket = place.substr(0, place.find('/'));
    const std::string path = place.substr(bucket.size());
    if (!is_bucket_name(bucket)) {
        return refuse_address(url,
                              "a bucket has a name of 3 to 63 lower-case letters, digits, "
                              "hyphens and dots");
    }
    if (!s3.endpoint.empty()) {
        const std::size_t end = s3.endpoint.find_last_not_of('/');
        return s3.endpoint.substr(0, end + 1) + "/" + bucket + path;
    }
    const bool has_dots = bucket.find('.') != std::string::npos;  // no certificate is for its host
    return has_dots ? "https://s3." + s3.region + ".amazonaws.com/" + bucket + path
                    : "https://" + bucket + ".s3." + s3.region + ".amazonaws.com" + path;
}

}  // namespace

Result<HttpAddress> parse_http_address(const std::string& url, const S3Settings& s3) {
    if (is_bucket_address(url)) {
        TERRANE_TRY(const auto server_url, address_of_bucket(url, s3));
        TERRANE_TRY(auto address, parse_http_address(server_url));
        address.is_bucket = true;
        return address;
    }
    const std::unique_ptr<CURLU, FreeUrl> parsed(curl_url());
    const auto refuse = [&](const std::string& cause) { return refuse_address(url, cause); };
    if (const CURLUcode code = curl_url_set(parsed.get(), CURLUPART_URL, url.c_str(), 0);
        code != CURLUE_OK) {
        return refuse(std::string("it is no address of http, https or s3 (") +
                      curl_url_strerror(code) + ")");
    }
    const std::string scheme = part_of(parsed.get(), CURLUPART_SCHEME);
    if (scheme != "http" && scheme != "https")
        return refuse("it is no address of http, https or s3");

    HttpAddress address;
    address.is_secure = scheme == "https";
    address.user = part_of(parsed.get(), CURLUPART_USER, CURLU_URLDECODE);
    address.password = part_of(parsed.get(), CURLUPART_PASSWORD, CURLU_URLDECODE);
    address.query = part_of(parsed.get(), CURLUPART_QUERY);
    if (!address.query.empty()) address.query.insert(0, "?");

    std::string path = part_of(parsed.get(), CURLUPART_PATH);
    constexpr std::string_view kFile = "/terrain.json";
    if (path.ends_with(kFile)) {
        path.resize(path.size() - kFile.size() + 1);
    } else if (!path.ends_with('/')) {
        path += '/';
    }
    for (const CURLUPart part : {CURLUPART_USER, CURLUPART_PASSWORD, CURLUPART_OPTIONS,
                                 CURLUPART_QUERY, CURLUPART_FRAGMENT}) {
        curl_url_set(parsed.get(), part, nullptr, 0);
    }
    curl_url_set(parsed.get(), CURLUPART_PATH, path.c_str(), 0);
    address.folder = part_of(parsed.get(), CURLUPART_URL);
    return address;
}

bool is_bucket_address(std::string_view url) { return url.starts_with(kBucketScheme); }

bool is_file_name(std::string_view name) {
    return !name.empty() && name.front() != '.' && std::ranges::all_of(name, [](char letter) {
        return (letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z') ||
               (letter >= '0' && letter <= '9') || letter == '.' || letter == '_' || letter == '-';
    });
}

std::optional<ContentRange> parse_content_range(std::string_view text) {
    constexpr std::string_view kUnit = "bytes ";
    if (!text.starts_with(kUnit)) return std::nullopt;
    text.remove_prefix(kUnit.size());
    ContentRange range;
    if (!take_number(text, range.first) || !take_letter(text, '-') ||
        !take_number(text, range.last) || !take_letter(text, '/') || range.last < range.first) {
        return std::nullopt;
    }
    if (text == "*") return range;
    std::uint64_t total = 0;
    if (!take_number(text, total) || !text.empty() || total <= range.last) return std::nullopt;
    range.total = total;
    return range;
}

std::string shown_address(std::string_view url) {
    std::string shown(url.substr(0, url.find_first_of("?#")));
    const std::size_t scheme_end = shown.find("://");
    const std::size_t host = scheme_end == std::string::npos ? 0 : scheme_end + 3;
    // The last @ before the path: a password that is not encoded may contain others, or slashes.
    if (const std::size_t at = shown.rfind('@'); at != std::string::npos && at >= host) {
        shown.erase(host, at + 1 - host);
    }
    std::ranges::replace_if(
        shown, [](char letter) { return letter >= 0 && letter < ' '; }, ' ');
    return shown;
}

}  // namespace terrane::internal
