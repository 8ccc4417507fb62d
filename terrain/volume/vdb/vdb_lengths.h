// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>

namespace terrane::internal {

/// Whether a `.vdb` file says where its grids lie: written by openvdb::io::File, not by openvdb::io::Stream.
enum class VdbOffsets { absent, present };

/// Checks the lengths in a `.vdb` file's header and in its grids' descriptors and metadata. OpenVDB allocates and
/// clears as many bytes as each says, up to 4 GB, before it finds that the file is shorter. Not checked: files before
/// format 222 (2013), and all but the first grid where the file does not say where they lie.
///
/// @param in    at the start of the file
/// @param bytes of the file
/// @return      nothing where a length does not fit in the file
std::optional<VdbOffsets> check_vdb_lengths(std::istream& in, std::uint64_t bytes);

}  // namespace terrane::internal
