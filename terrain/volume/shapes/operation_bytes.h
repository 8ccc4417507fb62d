// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/store/bytes.h>
#include <terrane/volume/volume_shapes.h>

#include <optional>

namespace terrane::internal {

/// Writes an operation: op, kind of shape, its numbers, pose and voxel. Numbers keep their bits.
void put(ByteWriter& out, const VolumeOperation& operation);

/// Reads what put() wrote; none where the bytes end early or name no kind of shape. Sizes and poses are not checked.
std::optional<VolumeOperation> get_operation(ByteReader& in);

}  // namespace terrane::internal
