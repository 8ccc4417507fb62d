// SPDX-License-Identifier: MIT
#pragma once

/// Version of these headers. Until 1.0 a new minor version may change layouts and signatures; a new patch may not.
#define TERRANE_VERSION_MAJOR 0
#define TERRANE_VERSION_MINOR 1  ///< see TERRANE_VERSION_MAJOR
#define TERRANE_VERSION_PATCH 0  ///< see TERRANE_VERSION_MAJOR

/// Appends the major and minor version to a name, so that different versions do not link with each other.
#define TERRANE_VERSIONED(name) name##_0_1

namespace terrane {

/// Version of the linked library, such as "0.1.0"; the version of the headers is in the macros.
const char* library_version();

namespace internal {

/// Defined in the library that belongs to these headers.
extern const char TERRANE_VERSIONED(library_is_version);

/// Makes linking fail if headers and library have different versions, with one undefined reference to
/// terrane::internal::library_is_version_0_1. The attributes keep the linker from removing this variable, which takes 8
/// bytes of each program.
[[gnu::used, gnu::retain]] inline const char* const TERRANE_VERSIONED(headers_are_version) =
    &TERRANE_VERSIONED(library_is_version);

}  // namespace internal
}  // namespace terrane
