// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/base/version.h>

#include <tl/expected.hpp>

#include <string>

namespace terrane {

/// Called when a contract is violated. Must not return. The default handler prints one line and aborts.
using AssertHandler = void (*)(const char* condition, const char* message, const char* file,
                               int line);

/// Sets the handler, null for the default one, and returns the previous one. Threads: call before any other function.
AssertHandler set_assert_handler(AssertHandler handler);

namespace internal {
/// Calls the handler with the condition, the message and the place, and aborts if the handler returns.
[[noreturn]] void assert_failed(const char* condition, const char* message, const char* file,
                                int line);
}  // namespace internal
}  // namespace terrane

#if TERRANE_ASSERTS
#define TERRANE_ASSERT(condition, message) \
    ((condition) ? (void)0                 \
                 : ::terrane::internal::assert_failed(#condition, message, __FILE__, __LINE__))
#else
#define TERRANE_ASSERT(condition, message) ((void)0)
#endif

namespace terrane {

/// The kind of an error.
enum class ErrorCode {
    invalid_argument,    ///< a setting or an input value is out of its range
    io,                  ///< a file is missing, or cannot be read or written
    bad_data,            ///< a file was read, and its content is invalid
    out_of_memory,       ///< more memory is needed than a limit or the system allows
    device_unavailable,  ///< no EGL device, or none with the required version
    cancelled,           ///< stopped on request
    timed_out,           ///< no answer within the time allowed
};

/// A failure that can occur in a correct program. `message` is one English sentence that names the
/// thing and the value, such as "octave_count must be 1 to 24, got 25".
struct Error {
    ErrorCode code = ErrorCode::invalid_argument;  ///< the kind of failure
    std::string message;  ///< one sentence that names the thing and the value
};

/// A value, or an error instead.
template <class T>
using Result = tl::expected<T, Error>;

/// Makes an error: `return fail(ErrorCode::io, "cannot open " + path);` in a function that returns a Result.
inline tl::unexpected<Error> fail(ErrorCode code, std::string message) {
    return tl::unexpected<Error>(Error{code, std::move(message)});
}

/// `TERRANE_TRY(expression);` returns the error of a Result from the calling function if there is one, and otherwise
/// continues. `TERRANE_TRY(const auto file, open(path));` also declares a variable with the value of the Result.
#define TERRANE_TRY(first, ...) \
    TERRANE_TRY_EXPAND(__VA_OPT__(VALUE), __COUNTER__, first __VA_OPT__(, ) __VA_ARGS__)
#define TERRANE_TRY_EXPAND(kind, count, ...) TERRANE_TRY_JOIN(kind, count, __VA_ARGS__)
#define TERRANE_TRY_JOIN(kind, count, ...) TERRANE_TRY_##kind(terrane_try_##count, __VA_ARGS__)
#define TERRANE_TRY_(result, expression)                        \
    do {                                                        \
        if (auto result = (expression); !result)                \
            return ::tl::unexpected(std::move(result).error()); \
    } while (false)
#define TERRANE_TRY_VALUE(result, declaration, ...)                  \
    auto result = __VA_ARGS__;                                       \
    if (!result) return ::tl::unexpected(std::move(result).error()); \
    declaration = *std::move(result)

}  // namespace terrane
