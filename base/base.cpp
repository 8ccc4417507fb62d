// SPDX-License-Identifier: MIT
#include <terrane/base/result.h>
#include <terrane/base/text.h>
#include <terrane/base/version.h>

#include <atomic>
#include <charconv>
#include <cstdio>
#include <cstdlib>

#ifdef __FAST_MATH__
#error "Terrane promises the same bits everywhere: do not build it with -ffast-math"
#endif

namespace terrane {
namespace {

void print_and_abort(const char* condition, const char* message, const char* file, int line) {
    std::fprintf(stderr, "%s:%d: assertion failed: %s (%s)\n", file, line, message, condition);
    std::abort();
}

std::atomic<AssertHandler> handler{&print_and_abort};

}  // namespace

AssertHandler set_assert_handler(AssertHandler replacement) {
    return handler.exchange(replacement != nullptr ? replacement : &print_and_abort);
}

namespace internal {

void assert_failed(const char* condition, const char* message, const char* file, int line) {
    handler.load()(condition, message, file, line);
    std::abort();
}

}  // namespace internal

std::string number_text(double value) {
    char text[32];
    const std::to_chars_result end =
        std::to_chars(text, text + sizeof text, value, std::chars_format::general, 6);
    return {text, end.ptr};
}

}  // namespace terrane

#define TERRANE_TEXT_OF(x) #x
#define TERRANE_TEXT(x) TERRANE_TEXT_OF(x)

namespace terrane {

const char* library_version() {
    return TERRANE_TEXT(TERRANE_VERSION_MAJOR) "." TERRANE_TEXT(
        TERRANE_VERSION_MINOR) "." TERRANE_TEXT(TERRANE_VERSION_PATCH);
}

namespace internal {

const char TERRANE_VERSIONED(library_is_version) = 0;

}  // namespace internal
}  // namespace terrane
