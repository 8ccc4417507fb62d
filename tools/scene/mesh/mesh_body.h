// SPDX-License-Identifier: MIT
#pragma once

#include <terrane/collision/shapes.h>
#include <terrane/terrain/result.h>
#include <terrane/terrain/triangle_mesh.h>

#include <string>

namespace terrane::tools {

/// The error of bodies from files where none is given, metres.
inline constexpr double kUsualProxyError = 0.02;

/// A body's shape from a mesh: the hulls of make_collision_proxy().
///
/// @param file        of the mesh, for messages
/// @param proxy_error metres
///
/// Fails: as make_collision_proxy(); bad_data where the mesh is not closed or has no thickness, or where the hulls do
///        not reach the error. The message names the file
Result<Compound> make_mesh_body(const TriangleMesh& mesh, const std::string& file,
                                double proxy_error);

/// A compound of another size.
///
/// @param scale of its parts and their places, > 0
///
/// Fails: as Compound::create(), for sizes that it does not take
Result<Compound> scaled(const Compound& compound, double scale);

/// A body's shape from a mesh file.
///
/// @param scale       multiplies the file's points
/// @param proxy_error metres, after scaling
///
/// Fails: as read_mesh() and make_mesh_body()
Result<Shape> read_mesh_body(const std::string& path, double proxy_error, double scale = 1.0);

}  // namespace terrane::tools
