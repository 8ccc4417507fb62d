// SPDX-License-Identifier: MIT
#pragma once

#include "program/command.h"

#include <terrane/remote/http_files.h>

#include <nlohmann/json_fwd.hpp>

#include <memory>
#include <optional>
#include <string>

namespace terrane::tools {

/// Flags of terrains on HTTP servers.
struct HttpOptions {
    std::string cache;               ///< a folder or "off"; "": http in the user's cache folder
    std::optional<double> cache_mb;  ///< ceiling of this folder, mebibytes
};

/// Adds --http-cache and --http-cache-mb. `options` must outlive the app's parse().
void add_http_options(CLI::App& app, HttpOptions& options);

/// Whether --dem is the address of a baked terrain: of http, https or s3, ending in a slash or in /terrain.json, before
/// a query. Other addresses are rasters, for GDAL.
bool is_http_store(const std::string& dem);

/// Opens the files at an address. The environment variable TERRANE_HTTP_AUTHORIZATION has the header Authorization,
/// CURL_CA_BUNDLE the file of trusted certificates; ~/.netrc is used if it exists. Of buckets see
/// s3_settings_of_environment().
///
/// @param user_cache  the user's cache folder; "": there is none
///
/// Fails: exit_usage if the address has a user or password; exit_failed as open_http()
CommandResult<std::shared_ptr<const HttpFiles>> open_http_store(const std::string& url,
                                                                const HttpOptions& options,
                                                                const std::string& user_cache);

/// The statistics for summaries; failures that did not occur are left out.
nlohmann::ordered_json describe(const HttpStatistics& statistics);

}  // namespace terrane::tools
