// SPDX-License-Identifier: MIT
#pragma once

#include "ground/column/local_ground.h"
#include "ground/heightfield/contact_patches.h"

namespace terrane::internal {

/// Pairs the features of a separated shape with the features of one triangle at a time.
class FeaturePairs {
public:
    /// @param shape       after the translation, separated
    /// @param translation the translation that was applied, metres
    /// @param reach       gaps up to this are paired, metres
    /// @param margin      contacts whose gap at the untranslated pose is up to this are kept, metres
    FeaturePairs(const LocalGround& local, const LocalShape& shape,
                 const Eigen::Vector3d& translation, double reach, double margin,
                 std::uint32_t part, ContactPatches& patches)
        : local_(local),
          shape_(shape),
          translation_(translation),
          reach_(reach),
          margin_(margin),
          // Without a translation, a round shape may overlap the ground down to its core.
          least_(shape.kind == ShapeKind::round && length(translation) == 0.0 ? -shape.radius
                                                                              : -kTouch),
          part_(part),
          patches_(patches) {}

    /// Adds the contacts with a triangle to the patches.
    void pair(const Triangle& triangle);

private:
    void pair_round(const Triangle& triangle);
    void pair_box(const Triangle& triangle);
    void pair_box_face(const Triangle& triangle);
    void pair_box_corners(const Triangle& triangle);
    void pair_box_edges(const Triangle& triangle);
    void pair_hull(const Triangle& triangle);
    double pair_hull_along(const Eigen::Vector3d& n, const Triangle& triangle);

    /// The axis with the largest gap within the ground's normal cone.
    Separation find_separation_in_cone(const Triangle& triangle) const;
    void add(const Eigen::Vector3d& on_shape, const Eigen::Vector3d& n, double gap,
             const ShapeFeature& feature);

    const LocalGround& local_;
    const LocalShape& shape_;
    Eigen::Vector3d translation_;
    double reach_;
    double margin_;
    double least_;  ///< smallest gap that is paired, metres
    std::uint32_t part_;
    ContactPatches& patches_;
};

/// Finds the contacts of a box with some cells: see find_patches(). Of each cell it tests the faces, the diagonal, the
/// southern and western sides and the south-western corner.
///
/// @param window      holds the cells and one more on each side
/// @param cells       all cells under the box's bounds widened by the margin, or some of them
/// @param translation separates the box
/// @param reach       largest gap of the translated box at which features are paired, metres
void find_box_patches(const LocalGround& local, const LocalWindow& window, const CellRange& cells,
                      const LocalShape& box, std::uint32_t part, const Eigen::Vector3d& translation,
                      double margin, double reach, ContactPatches& patches);

/// Finds the contacts of a sphere or capsule with some cells: see find_patches(). Of each cell it tests the faces, the
/// diagonal, the southern and western sides and the south-western corner.
///
/// @param window      holds the cells and one more on each side
/// @param cells       all cells under the bounds widened by the margin, or some of them
/// @param shape       radius > kThin
/// @param translation separates the shape; may be zero if its core is clear of the ground
/// @param reach       largest gap of the translated shape at which features are paired, metres
void find_round_patches(const LocalGround& local, const LocalWindow& window, const CellRange& cells,
                        const LocalShape& shape, std::uint32_t part,
                        const Eigen::Vector3d& translation, double margin, double reach,
                        ContactPatches& patches);

/// Radius below which directions between closest points may be dominated by rounding, metres.
inline constexpr double kThin = 1e-6;

}  // namespace terrane::internal
