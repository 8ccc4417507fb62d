// SPDX-License-Identifier: MIT
#include <terrane/terrain/assert.h>

#include <atomic>
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
}  // namespace terrane
