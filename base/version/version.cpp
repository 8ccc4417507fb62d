// SPDX-License-Identifier: MIT
#include <terrane/terrain/version.h>

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
