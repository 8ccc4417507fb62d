// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/shapes.h>
#include <terrane/terrain/result.h>

#include <string>

namespace terrane::tools {

/// The error of bodies from files where none is given, metres.
inline constexpr double kUsualProxyError = 0.02;

/// A body's shape from a mesh file: the hulls of make_collision_proxy().
///
/// @param scale       multiplies the file's points
/// @param proxy_error metres, after scaling
///
/// Fails: as read_mesh() and make_collision_proxy(); bad_data where the mesh is not closed or has no thickness, or
///        where the hulls do not reach the error. The message names the file
Result<Shape> read_mesh_body(const std::string& path, double proxy_error, double scale = 1.0);

}  // namespace terrane::tools
