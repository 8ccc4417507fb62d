// SPDX-License-Identifier: MIT
#pragma once

/// Version of these headers. Until 1.0 a new minor version may change layouts and signatures; a new patch may not.
#define TERRANE_VERSION_MAJOR 0
#define TERRANE_VERSION_MINOR 1  ///< see TERRANE_VERSION_MAJOR
#define TERRANE_VERSION_PATCH 0  ///< see TERRANE_VERSION_MAJOR

/// A name that only headers and libraries of the same major and minor version have in common.
#define TERRANE_VERSIONED(name) name##_0_1

namespace terrane {

/// Version of the library that is linked, "0.1.0"; that of the headers is in the macros.
const char* library_version();

namespace internal {

/// Defined by libraries of this version.
extern const char TERRANE_VERSIONED(library_is_version);

/// Headers of one version with a library of another are an error when a program is linked: one undefined reference, to
/// terrane::internal::library_is_version_0_1. Kept whatever the linker removes; 8 bytes in each program.
[[gnu::used, gnu::retain]] inline const char* const TERRANE_VERSIONED(headers_are_version) =
    &TERRANE_VERSIONED(library_is_version);

}  // namespace internal
}  // namespace terrane
