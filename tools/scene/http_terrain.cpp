// SPDX-License-Identifier: MIT
#include "scene/http_terrain.h"

#include "program/options.h"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <string_view>
#include <utility>

namespace terrane::tools {
namespace {

// The least of HttpSettings::cache_bytes.
constexpr double kLeastCache_mb = 8.0, kMostCache_mb = 1e9;

std::string environment(const char* name) {
    const char* const value = std::getenv(name);
    return value == nullptr ? std::string() : std::string(value);
}

}  // namespace

void add_http_options(CLI::App& app, HttpOptions& options) {
    app.add_option(
           "--http-cache", options.cache,
           "Where parts of a baked terrain at an address are kept: a folder, or 'off'; without it "
           "'http' in the user's cache folder")
        ->type_name("DIR")
        ->group("Terrain");
    std::optional<double>* const ceiling = &options.cache_mb;
    app.add_option_function<std::string>(
           "--http-cache-mb",
           [ceiling](const std::string& text) {
               *ceiling = parse_number(text);
               if (!*ceiling || !(**ceiling >= kLeastCache_mb && **ceiling <= kMostCache_mb)) {
                   throw CLI::ValidationError("--http-cache-mb",
                                              fmt::format("must be {:g} to {:g}, got '{:.60}'",
                                                          kLeastCache_mb, kMostCache_mb, text));
               }
           },
           "Most disk space for them, MiB. 1024 unless said")
        ->type_name("N")
        ->group("Terrain");
}

bool is_http_store(const std::string& dem) {
    std::string address = dem.substr(0, dem.find_first_of("?#"));
    std::ranges::transform(address, address.begin(),
                           [](unsigned char c) { return std::tolower(c); });
    return (address.starts_with("http://") || address.starts_with("https://") ||
            address.starts_with("s3://")) &&
           (address.ends_with('/') || address.ends_with("/terrain.json"));
}

CommandResult<std::shared_ptr<const HttpFiles>> open_http_store(const std::string& url,
                                                                const HttpOptions& options,
                                                                const std::string& user_cache) {
    // Records and copied command lines keep the address.
    const std::size_t host = url.find("://") + 3;
    if (url.find('@') < url.find_first_of("/?#", host)) {
        return usage_error("--dem must not have a user or password; put them into ~/.netrc");
    }
    HttpSettings settings;
    if (options.cache.empty() && !user_cache.empty()) settings.cache_folder = user_cache + "/http";
    if (!options.cache.empty() && options.cache != "off") settings.cache_folder = options.cache;
    if (options.cache_mb) {
        settings.cache_bytes = static_cast<std::uint64_t>(*options.cache_mb * 1048576.0);
    }
    settings.use_netrc = true;
    settings.authorization = environment("TERRANE_HTTP_AUTHORIZATION");
    settings.certificate_file = environment("CURL_CA_BUNDLE");
    settings.s3 = s3_settings_of_environment();
    TERRANE_TRY(auto files, open_http(url, settings));
    return files;
}

nlohmann::ordered_json describe(const HttpStatistics& statistics) {
    const HttpFailures& f = statistics.failures;
    nlohmann::ordered_json failures = nlohmann::ordered_json::object();
    for (const auto& [name, count] : std::initializer_list<std::pair<const char*, std::uint64_t>>{
             {"refused", f.refused},
             {"busy", f.busy},
             {"server_error", f.server_error},
             {"cut_short", f.cut_short},
             {"wrong_range", f.wrong_range},
             {"wrong_size", f.wrong_size},
             {"timed_out", f.timed_out},
             {"unresolved", f.unresolved},
             {"unreachable", f.unreachable},
             {"certificate", f.certificate},
             {"redirect", f.redirect}}) {
        if (count > 0) failures[name] = count;
    }
    return {{"requests", statistics.requests},
            {"bytes", statistics.bytes},
            {"memory_hits", statistics.memory_hits},
            {"disk_hits", statistics.disk_hits},
            {"shared_blocks", statistics.shared_blocks},
            {"retries", statistics.retries},
            {"cancelled", statistics.cancelled},
            {"discarded", statistics.discarded},
            {"damaged_blocks", statistics.damaged_blocks},
            {"cache_faults", statistics.cache_faults},
            {"ignored_ranges", statistics.ignored_ranges},
            {"failures", failures},
            {"latency_s", statistics.latency},
            {"bytes_per_s", statistics.bandwidth}};
}

}  // namespace terrane::tools
