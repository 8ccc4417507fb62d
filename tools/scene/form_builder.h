// SPDX-License-Identifier: MIT
#pragma once

#include "scene/mesh_files.h"

#include <terrane/base/math.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace terrane::tools {

/// The half space normal . p <= offset; the normal has unit length.
struct HalfSpace {
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
    double offset = 0.0;
};

/// The half space whose border passes through a point; the normal points out of it and may have any length.
HalfSpace half_space(const Eigen::Vector3d& normal, const Eigen::Vector3d& point);
/// The six half spaces of an axis-aligned box: +x, -x, +y, -y, +z, -z.
std::vector<HalfSpace> box_planes(const Eigen::Vector3d& low, const Eigen::Vector3d& high);

/// A convex polygon, counter-clockwise seen from outside.
using Polygon3 = std::vector<Eigen::Vector3d>;

/// The face of a convex solid in one of its planes, with all edges moved inwards; empty if nothing is left.
///
/// @param planes of the solid, bounded
/// @param inset  metres in the direction of the neighbouring planes' normals, >= 0
Polygon3 face_of(std::span<const HalfSpace> planes, std::size_t face, double inset);
/// The part of a convex polygon in a half space.
Polygon3 clipped(const Polygon3& polygon, const HalfSpace& kept);

/// A point of a profile that is turned about an axis: metres from the axis and along it.
struct RingPoint {
    double radius = 0.0, along = 0.0;
};

/// Materials that all forms share, as indices of form_materials().
enum class FormMaterial : std::uint16_t {
    matt,       ///< rubber, plastic, cloth
    paint,      ///< glossy
    glass,      ///< dark and smooth
    steel,      ///< bare metal
    head_lamp,  ///< white light
    tail_lamp,  ///< red light
    indicator,  ///< amber light
};
/// The materials in the order of FormMaterial.
std::vector<MeshMaterial> form_materials();

/// Red, green, blue with display gamma, 0 to 1.
using FormColour = std::array<double, 3>;

/// A colour between two: the first at 0, the second at 1.
FormColour mixed(const FormColour& a, const FormColour& b, double share);

/// The pose of a part whose z axis has a direction of any length.
Pose along_axis(const Eigen::Vector3d& place, const Eigen::Vector3d& axis);

/// Builds the mesh of a form from closed parts. Every part has the current paint; lengths are metres in the form's
/// frame.
class FormBuilder {
public:
    /// Sets material and colour of the following parts.
    void set_paint(FormMaterial material, const FormColour& colour);
    /// Sets the frame of the following parts.
    void set_frame(const Pose& form_from_part) { frame_ = form_from_part; }

    /// Adds a convex solid with rounded edges: chamfers whose normals go from one face's to the other's, so that faces
    /// look flat and edges round. The bevel is reduced until every face keeps its edges. Nothing for a flat solid.
    ///
    /// @param planes of which three meet in every corner; with a bevel, faces that meet at 60 degrees or more
    /// @param bevel  metres by which faces shrink, as in face_of(); 0: sharp edges
    void add_solid(std::span<const HalfSpace> planes, double bevel);
    /// Adds an axis-aligned box as add_solid().
    void add_box(const Eigen::Vector3d& low, const Eigen::Vector3d& high, double bevel = 0.0);
    /// Adds a plate on a convex polygon: a prism that is also sunk by its height. Nothing for less than a triangle.
    void add_plate(const Polygon3& polygon, double height, double bevel = 0.0);
    /// Adds a surface of revolution about the part's z axis. Outside is to the right of the profile's direction with
    /// the radius to the right and z up. Edges of the profile below about 45 degrees are shaded as round.
    void add_turned(std::span<const RingPoint> profile, int segments);
    /// Adds a tube between cross-sections of equally many points, counter-clockwise seen against its direction, with
    /// flat ends. Edges below 40 degrees are shaded as round.
    void add_loft(std::span<const Polygon3> sections);
    /// Adds triangles with outward normals and the current paint: positions, normals and triangles are used.
    void add_mesh(const TriangleMesh& mesh);

    /// Number of vertices, to be given to mirror_since().
    std::size_t vertex_count() const { return model_.mesh.positions.size(); }
    /// Adds mirror images, in the plane y = 0, of all triangles of vertices from `first` on.
    void mirror_since(std::size_t first);

    /// The model; `tone` gives the factor of a vertex's colour by position and normal.
    MeshModel finish(
        const std::function<FormColour(const Eigen::Vector3d&, const Eigen::Vector3f&)>& tone = {});

private:
    std::uint32_t add_vertex(const Eigen::Vector3d& position, const Eigen::Vector3d& normal);
    void add_polygon(std::span<const std::uint32_t> corners);

    MeshModel model_;
    Pose frame_;
    std::array<std::uint8_t, 4> colour_{160, 160, 160, 255};
    FormMaterial material_ = FormMaterial::matt;
};

}  // namespace terrane::tools
