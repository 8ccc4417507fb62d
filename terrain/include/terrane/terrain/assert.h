// SPDX-License-Identifier: MIT
#pragma once

namespace terrane {

/// Called when a contract is violated. Must not return; the default prints one line and aborts.
using AssertHandler = void (*)(const char* condition, const char* message, const char* file,
                               int line);

/// Replaces the handler and returns the previous one. Threads: call before any other use.
AssertHandler set_assert_handler(AssertHandler handler);

namespace internal {
/// Prints the condition, the message and the place, and aborts.
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
