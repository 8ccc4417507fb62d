// SPDX-License-Identifier: MIT
#pragma once

// A window of the ground that follows bodies, as a DART HeightmapShape. Needs no DART header: the class is a template
// over dart::dynamics::HeightmapShapef or HeightmapShaped (6.9 and later).
//
//     auto shape = std::make_shared<dart::dynamics::HeightmapShapef>();
//     // on a body of a skeleton with setMobile(false): createShapeNodeWith<CollisionAspect, DynamicsAspect>(shape)
//     const auto update = window.update(*shape, ground, boxes);                 // before world->step()
//     if (update.has_changed) node->setRelativeTranslation(update.translation_sim);
//
// DART supports a HeightmapShape only in two collision detectors: Bullet (HeightmapShapef) and ODE (HeightmapShaped).
//
// Units: metres. Frame: the world's axes (z up), translated by DartWindowSettings::origin_world. DART's rows run south
// from the north-western sample, its columns run east; the shape's origin is the centre of the rectangle.
// Heights: relative to the window's lowest ground, at which the shape's frame is placed; float rounds them to 2^-24 of
// the window's range. The spacing equals the ground's contact spacing.
// Surface: the engines split every cell along the same diagonal, Terrane along alternating diagonals. The surfaces
// differ by at most half of a cell's twist (DartWindowUpdate::surface_error_m). The shape has no thickness: a body that
// moves by more than its size in a step can tunnel through it.
//
// Moving: heights and frame of the shape shift together by whole cells, so the surface stays fixed in the world. DART
// detects the new version of the shape and rebuilds the engine's shape in the next step. The skeleton does not move, so
// bodies on it are not dragged along. A rebuild costs as much as the initial build: make the window at least twice as
// wide as the distance that a body travels in a second.
//
// Absent ground: the shape cannot have holes. Samples without ground are at the window's lowest height, and the update
// counts boxes over them: the simulator should not step such a body, or should remove it. The same applies to boxes
// over cells replaced by volumes.
//
// Threads: only the thread that steps the world.
// Source: the reference of DART 6, dart::dynamics::HeightmapShape.

#include <terrane/adapters/field_window.h>

namespace terrane::adapters {

/// Settings of a DartWindow.
struct DartWindowSettings {
    std::int32_t columns = 128;                ///< cells from west to east, 1 to kMostWindowCells
    std::int32_t rows = 128;                   ///< cells from south to north, 1 to kMostWindowCells
    std::int32_t margin = 8;                   ///< as GroundWindowSettings::margin
    WorldPos origin_world = WorldPos::Zero();  ///< of DART's frame, within 2^40 m
};

/// Status of an update.
enum class DartWindowStatus {
    ok,         ///< the shape matches the window
    no_bodies,  ///< no valid box; nothing was done
    no_ground,  ///< no resident ground in the window; the shape is flat at world z = 0
};

/// Report of an update, with counts of boxes that have no ground below them.
struct DartWindowUpdate {
    DartWindowStatus status = DartWindowStatus::ok;  ///< whether the shape is up to date
    bool has_changed = false;  ///< the shape has new heights: move it to translation_sim
    Eigen::Vector3d translation_sim = Eigen::Vector3d::Zero();  ///< of the shape's frame
    bool covers_boxes = false;                                  ///< all boxes lie in the window
    int unsupported_boxes = 0;                                  ///< see BoxSupport
    int boxes_over_volumes = 0;                                 ///< see BoxSupport
    std::int64_t absent_cells = 0;                              ///< cells not resident or outside
    /// Bound of the vertical distance between the shape's surface and the contact surface, for either cell diagonal.
    double surface_error_m = 0.0;
};

/// Keeps the heights of a HeightmapShape up to date around bodies.
///
/// @tparam Shape dart::dynamics::HeightmapShape<S>
template <class Shape>
class DartWindow {
public:
    /// Fails: invalid_argument, naming the field and its value; out_of_memory
    static Result<DartWindow> create(const DartWindowSettings& settings) {
        TERRANE_TRY(FieldWindow field, FieldWindow::create(settings.columns, settings.rows,
                                                           settings.margin, settings.origin_world));
        return DartWindow(std::move(field));
    }

    /// Moves the window to the boxes of bodies and updates the shape's heights if they changed. Boxes that are not
    /// finite are ignored and count as unsupported.
    ///
    /// Cost: O(boxes + changed cells); after a change also O(cells), and DART's cost of a new shape
    DartWindowUpdate update(Shape& shape, const Ground& ground, std::span<const Aabb> boxes_sim) {
        DartWindowUpdate result;
        result.has_changed = field_.update(ground, boxes_sim);
        result.covers_boxes = field_.covers_boxes();
        if (field_.is_empty()) {
            result.status = DartWindowStatus::no_bodies;
            result.unsupported_boxes = static_cast<int>(boxes_sim.size());
            return result;
        }
        if (result.has_changed) write(shape, ground);
        result.translation_sim = translation_sim_;
        result.absent_cells = field_.absent_cells();
        result.surface_error_m = field_.twist() + (field_.high() - field_.low()) * 0x1p-24;
        result.status = field_.has_ground() ? DartWindowStatus::ok : DartWindowStatus::no_ground;
        const BoxSupport support = field_.support(ground);
        result.unsupported_boxes = support.unsupported;
        result.boxes_over_volumes = support.over_volumes;
        return result;
    }

    /// The samples in the shape and the flags of its cells.
    const GroundWindow& window() const { return field_.window(); }

private:
    explicit DartWindow(FieldWindow field) : field_(std::move(field)) {}

    void write(Shape& shape, const Ground& ground) {
        using Heights = typename Shape::HeightField;
        using Scalar = typename Heights::Scalar;
        const Eigen::Index columns = field_.window().settings().columns + 1;
        const Eigen::Index rows = field_.window().settings().rows + 1;
        Heights heights(rows, columns);
        std::size_t i = 0;
        for (Eigen::Index row = rows - 1; row >= 0; --row) {  // from the south
            for (Eigen::Index column = 0; column < columns; ++column, ++i) {
                const double height =
                    field_.is_ground()[i] != 0 ? field_.heights()[i] : field_.low();
                heights(row, column) = static_cast<Scalar>(height - field_.low());
            }
        }
        const auto spacing = static_cast<Scalar>(ground.spacing());
        shape.setScale(typename Shape::Vector3(spacing, spacing, Scalar(1)));
        shape.setHeightField(heights);
        translation_sim_ = field_.middle_sim(ground, field_.low());
    }

    FieldWindow field_;
    Eigen::Vector3d translation_sim_ = Eigen::Vector3d::Zero();
};

}  // namespace terrane::adapters
