// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/result.h>
#include <terrane/store/shard_files.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace terrane {

/// Access to a bucket of an object store, for addresses such as s3://bucket/folder/. Requests are signed by libcurl
/// (AWS Signature Version 4), 7.87 or later.
struct S3Settings {
    std::string region = "us-east-1";  ///< of the bucket
    /// Address of a server other than Amazon's, such as "https://minio.example:9000", whose folders are its buckets;
    /// empty: Amazon's.
    std::string endpoint;
    std::string access_key;     ///< empty: requests are not signed, for public buckets
    std::string secret_key;     ///< belongs to the access key
    std::string session_token;  ///< of temporary keys; empty: none
};

/// The settings of the environment variables that Amazon's programs use: AWS_REGION, else AWS_DEFAULT_REGION;
/// AWS_ENDPOINT_URL_S3, else AWS_ENDPOINT_URL; AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_SESSION_TOKEN.
/// Threads: not beside a change of the environment
S3Settings s3_settings_of_environment();

/// How the files of a server are read. Times are in seconds.
struct HttpSettings {
    /// Folder of the disk cache, made if it is absent; empty: none. Processes may share it.
    std::string cache_folder;
    /// Ceiling of the disk cache; 64 blocks or more. Blocks that have not been read for the longest time are removed.
    std::uint64_t cache_bytes = std::uint64_t{1} << 30;
    /// Ceiling of the blocks kept in memory. Each read() holds up to 16 MiB more.
    std::size_t memory_bytes = std::size_t{1} << 25;
    /// Files are read in blocks of this size.
    std::size_t block_bytes = std::size_t{1} << 17;
    /// Most bytes of neighbouring blocks in one request.
    std::size_t request_bytes = std::size_t{1} << 20;
    int connection_count = 8;       ///< most requests at the same time
    double connect_timeout = 10.0;  ///< to resolve, connect and negotiate TLS
    /// A request that gets less than 1000 bytes/s for so long is repeated.
    double stall_timeout = 10.0;
    double read_timeout = 60.0;        ///< deadline of one read(), with all repetitions
    int retry_count = 4;               ///< repetitions of a failed request
    double first_retry_delay = 0.25;   ///< before the first repetition; it doubles with each
    double longest_retry_delay = 8.0;  ///< limit of this delay
    bool use_netrc = false;            ///< user and password from ~/.netrc
    /// Value of the header Authorization, such as "Bearer ..."; empty: none.
    std::string authorization;
    std::string certificate_file;  ///< PEM file of trusted certificates; empty: those of the system
    std::string user_agent = "terrane/0.1";  ///< value of the header User-Agent
    /// Access to buckets; only for addresses that begin with s3:, for which netrc and authorization are not used.
    S3Settings s3 = {};
};

/// Requests that failed, by cause. Each repetition that fails counts.
struct HttpFailures {
    /// Status 4xx, except 408, 416 and 429, or another that is no success.
    std::uint64_t refused = 0;
    std::uint64_t busy = 0;          ///< status 429 or 503
    std::uint64_t server_error = 0;  ///< other status 5xx
    std::uint64_t cut_short = 0;     ///< the reply ended early or was no HTTP
    /// Not the requested range, the whole of a large file, or an encoded body.
    std::uint64_t wrong_range = 0;
    std::uint64_t wrong_size = 0;   ///< the file is not as long as it must be
    std::uint64_t timed_out = 0;    ///< no connection, or no data, in time; status 408
    std::uint64_t unresolved = 0;   ///< the host's name does not resolve
    std::uint64_t unreachable = 0;  ///< the connection was refused or lost
    std::uint64_t certificate = 0;  ///< the certificate is not trusted, or is for another host
    std::uint64_t redirect = 0;  ///< too many redirects, or one to an address that is not permitted
    friend bool operator==(const HttpFailures&, const HttpFailures&) = default;
};

/// What was read so far, and what went wrong.
struct HttpStatistics {
    std::uint64_t requests = 0;     ///< requests that were sent
    std::uint64_t bytes = 0;        ///< bytes of replies, without headers
    std::uint64_t memory_hits = 0;  ///< blocks found in memory
    std::uint64_t disk_hits = 0;    ///< blocks found in the disk cache
    std::uint64_t shared_blocks =
        0;                        ///< blocks that another read() or expect() had already requested
    std::uint64_t retries = 0;    ///< failed requests whose blocks were requested again
    std::uint64_t cancelled = 0;  ///< requests that were stopped because nobody waited any more
    std::uint64_t discarded = 0;  ///< calls of discard(): the reader found damage
    std::uint64_t damaged_blocks = 0;  ///< blocks of the disk cache, removed for a wrong checksum
    std::uint64_t cache_faults = 0;    ///< blocks that could not be written to the disk cache
    /// Replies with the whole file in place of a part, which was taken from them.
    std::uint64_t ignored_ranges = 0;
    HttpFailures failures;  ///< failed requests, by cause
    /// Seconds from a request to the first byte of its reply, an average of about the last eight; 0: none yet.
    double latency = 0.0;
    /// Bytes per second of all requests together, over about the last two seconds in which some ran; 0: none yet.
    double bandwidth = 0.0;
};

/// The files of an HTTP server. Blocks that were read are kept in memory and in the disk cache.
///
/// Threads: any number at once; one thread of the object does all transfers. The object must outlive its calls.
class HttpFiles : public ShardFiles {
public:
    /// Counts since open_http().
    virtual HttpStatistics statistics() const = 0;
};

/// Opens the files of a server. `url` is the address of their folder or of its terrain.json: of http, https, or a
/// bucket (S3Settings).
///
/// Up to five redirects are followed, to http and https alone, and never from https to http. User, password and query
/// of the address are sent to the server, but are in no message. A request that failed is repeated after a delay if
/// that can help: status 408, 429 and 5xx, a reply cut short, a timeout, a lost connection. read_whole() uses no cache.
///
/// Fails: invalid_argument if the address or a setting is wrong
/// Cost:  starts a thread; does not contact the server, and does not touch the disk
Result<std::shared_ptr<const HttpFiles>> open_http(const std::string& url,
                                                   const HttpSettings& settings = {});

}  // namespace terrane
