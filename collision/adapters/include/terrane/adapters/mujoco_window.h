// SPDX-License-Identifier: MIT
#pragma once

// A window of the ground that follows MuJoCo's bodies, as the data of one height field (hfield). Needs no MuJoCo
// header: the class is a template over mjModel and mjData, for any version with the members used (2.1 to 3.x).
//
// Model: one hfield geom with identity pose, alone on a mocap body; hfield_xml() writes both:
//
//     <asset> <hfield name="ground" nrow="65" ncol="65" size="32 32 100 5"/> </asset>
//     <worldbody> <body name="ground" mocap="true"> <geom type="hfield" hfield="ground"/> </body> ...
//
// Units: metres. Frame: the world's axes (z up), translated by MujocoWindowSettings::origin_world. Rows run north and
// columns east from the south-western sample, as in Terrane; the spacing 2 size[0] / (ncol - 1) must equal the ground's
// contact spacing.
// Heights: MuJoCo multiplies hfield_data, 0 to 1, by size[2] and measures upwards from the geom. 0 is the window's
// lowest ground, at which the mocap body is placed; float rounds heights by size[2] 2^-25. A window whose heights span
// more than size[2] is rejected. size[3] is the thickness of the solid below the geom. MuJoCo pushes bodies out of this
// solid but not up from below it, so choose more than the fastest body's motion per step plus its size.
// Surface: MuJoCo splits every cell along the south-west to north-east diagonal, Terrane every other cell; over the
// remaining cells the surfaces differ by up to half of the cell's twist, MujocoWindowUpdate::surface_error_m.
//
// Moving: the mocap body and hfield_data change together by whole cells, so the surface stays fixed in the world.
// MuJoCo finds contacts anew in each step and gives a mocap body no velocity: a move neither drags nor pushes bodies.
// Sizes never change, so bounding spheres, boxes and trees of the compiled model stay valid.
//
// When: before mj_step(), with mjData as the previous step left it. Do not call it in mjcb_control: that runs after the
// collision detection of the step, and four times per step with the RK4 integrator. If an update sets has_changed and
// the hfield is drawn, call mjr_uploadHField(model, context, window.hfield_id()).
//
// Absent ground: the hfield cannot have holes. Samples without ground are at the bottom (0), and the update counts
// boxes over them: the simulator should not step such a body, or should remove it. The same applies to boxes over cells
// replaced by volumes, whose mouths the heightfield closes.
//
// Threads: only the thread that calls mj_step().
// Source: MuJoCo's XML reference (asset/hfield), modeling guide ("Mocap bodies") and mjmodel.h.

#include <terrane/adapters/field_window.h>
#include <terrane/terrain/body_need.h>

#include <cmath>
#include <cstdio>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace terrane::adapters {

/// Settings of a MujocoWindow.
struct MujocoWindowSettings {
    WorldPos origin_world = WorldPos::Zero();  ///< of MuJoCo's frame, within 2^40 m
    /// The window moves if fewer cells than this lie between its edge and a body's box: GroundWindowSettings::margin.
    std::int32_t margin = 8;
};

/// Status of an update.
enum class MujocoWindowStatus {
    ok,             ///< the hfield matches the window
    no_bodies,      ///< no valid box; nothing was done
    wrong_spacing,  ///< the hfield's spacing differs from the ground's; nothing was done
    no_ground,      ///< no resident ground in the window; the hfield is flat at its bottom
    too_high,       ///< the window's heights span more than size[2]; nothing was done
};

/// Report of an update, with counts of boxes that have no ground below them.
struct MujocoWindowUpdate {
    MujocoWindowStatus status = MujocoWindowStatus::ok;  ///< whether the hfield is up to date
    bool has_changed = false;    ///< hfield_data was written: upload it if drawn
    bool covers_boxes = false;   ///< all boxes lie in the window
    int unsupported_boxes = 0;   ///< boxes over a cell that is absent, outside or not in the window
    int boxes_over_volumes = 0;  ///< boxes over a cell that volumes replace
    std::int64_t absent_cells = 0;  ///< cells not resident or outside
    double height_range = 0.0;      ///< highest minus lowest ground in the window
    /// Bound of the vertical distance between MuJoCo's surface and the contact surface over the window.
    double surface_error_m = 0.0;
};

/// The two model elements that a MujocoWindow needs, without their enclosing elements.
struct MujocoHfieldXml {
    std::string asset;  ///< for the element `asset`
    std::string body;   ///< for the element `worldbody`
};

/// Makes the elements for a window of `cells` cells along each side.
/// @param spacing   of the ground's contact level, metres
/// @param range     largest height range of a window, metres: size[2]
/// @param thickness of the solid, metres: size[3]
inline MujocoHfieldXml hfield_xml(const std::string& name, std::int32_t cells, double spacing,
                                  double range, double thickness) {
    const auto text = [](double value) {
        char digits[32];
        std::snprintf(digits, sizeof digits, "%.17g", value);
        return std::string(digits);
    };
    const std::string side = std::to_string(cells + 1);
    const std::string half = text(0.5 * spacing * cells);
    MujocoHfieldXml xml;
    xml.asset = "<hfield name=\"" + name + "\" nrow=\"" + side + "\" ncol=\"" + side +
                "\" size=\"" + half + " " + half + " " + text(range) + " " + text(thickness) +
                "\"/>";
    xml.body = "<body name=\"" + name + "\" mocap=\"true\"><geom name=\"" + name +
               "\" type=\"hfield\" hfield=\"" + name + "\"/></body>";
    return xml;
}

/// Writes the ground around bodies into a height field of MuJoCo.
///
/// @tparam Model mjModel
/// @tparam Data  mjData
template <class Model, class Data>
class MujocoWindow {
public:
    /// @param geom_id id of the hfield geom, from mj_name2id()
    ///
    /// Fails: invalid_argument for an id that is not an hfield geom, a geom that is not alone on a mocap body, a field
    ///        of fewer than 2 x 2 samples, or settings out of range; out_of_memory
    static Result<MujocoWindow> create(const Model& model, int geom_id,
                                       const MujocoWindowSettings& settings) {
        if (geom_id < 0 || geom_id >= model.ngeom || model.geom_type[geom_id] != kHfieldGeom) {
            return fail(ErrorCode::invalid_argument,
                        "geom_id must be a geom of type hfield, got " + number_text(geom_id));
        }
        const int hfield = model.geom_dataid[geom_id];
        const int body = model.geom_bodyid[geom_id];
        const int mocap = model.body_mocapid[body];
        if (hfield < 0 || hfield >= model.nhfield || mocap < 0) {
            return fail(ErrorCode::invalid_argument,
                        "the hfield geom " + number_text(geom_id) + " must be on a mocap body");
        }
        for (int i = 0; i < 3; ++i) {
            if (model.geom_pos[3 * geom_id + i] == 0.0 &&
                model.geom_quat[4 * geom_id + 1 + i] == 0.0) {
                continue;
            }
            return fail(ErrorCode::invalid_argument, "the hfield geom " + number_text(geom_id) +
                                                         " must have no pose in its body");
        }
        TERRANE_TRY(FieldWindow field,
                    FieldWindow::create(std::int64_t{model.hfield_ncol[hfield]} - 1,
                                        std::int64_t{model.hfield_nrow[hfield]} - 1,
                                        settings.margin, settings.origin_world));
        return MujocoWindow(std::move(field), settings.origin_world, hfield, mocap);
    }

    /// The needs of all movable bodies, for Terrain::update(): the bounding sphere of each geom. mj_forward() and
    /// mj_step() write the geoms' positions to mjData; call one of them first. Valid until the next call.
    std::span<const BodyNeed> needs(const Model& model, const Data& data) {
        needs_.clear();
        for_each_geom(model, data, [&](const Eigen::Vector3d& centre_sim, double radius) {
            needs_.push_back({.centre_world = origin_world_ + centre_sim, .radius = radius});
        });
        return needs_;
    }

    /// Moves the window to all movable bodies and writes what changed. Bodies that are not finite are ignored and count
    /// as unsupported.
    ///
    /// Allocates: when the number of geoms grows
    /// Cost:      O(geoms + cells that changed); after a move O(cells)
    MujocoWindowUpdate update(const Model& model, Data& data, const Ground& ground) {
        boxes_.clear();
        for_each_geom(model, data, [&](const Eigen::Vector3d& centre_sim, double radius) {
            const Eigen::Vector3d half = Eigen::Vector3d::Constant(radius);
            boxes_.push_back({centre_sim - half, centre_sim + half});
        });
        MujocoWindowUpdate result;
        if (!has_spacing(model, ground)) {
            result.status = MujocoWindowStatus::wrong_spacing;
            result.unsupported_boxes = static_cast<int>(boxes_.size());
            return result;
        }
        if (field_.update(ground, boxes_)) is_written_ = false;
        result.covers_boxes = field_.covers_boxes();
        if (field_.is_empty()) {
            result.status = MujocoWindowStatus::no_bodies;
            result.unsupported_boxes = static_cast<int>(boxes_.size());
            return result;
        }
        const double range = model.hfield_size[4 * hfield_ + 2];
        result.absent_cells = field_.absent_cells();
        result.height_range = field_.high() - field_.low();
        result.surface_error_m = field_.twist_to_north_east() + range * 0x1p-25;
        if (result.height_range > range) {
            result.status = MujocoWindowStatus::too_high;
        } else {
            result.status =
                field_.has_ground() ? MujocoWindowStatus::ok : MujocoWindowStatus::no_ground;
            if (!is_written_) {
                write(model, ground, range);
                result.has_changed = is_written_ = true;
            }
        }
        place(data);
        const BoxSupport support = field_.support(ground);
        result.boxes_over_volumes = support.over_volumes;
        result.unsupported_boxes = result.status == MujocoWindowStatus::ok
                                       ? support.unsupported
                                       : static_cast<int>(boxes_.size());
        return result;
    }

    /// Id of the hfield, for mjr_uploadHField().
    int hfield_id() const { return hfield_; }
    /// The samples in the hfield and the flags of its cells.
    const GroundWindow& window() const { return field_.window(); }

private:
    static constexpr int kHfieldGeom = 1;  // mjGEOM_HFIELD

    MujocoWindow(FieldWindow field, const WorldPos& origin_world, int hfield, int mocap)
        : field_(std::move(field)), origin_world_(origin_world), hfield_(hfield), mocap_(mocap) {}

    // Calls visit(centre_sim, radius) with the bounding sphere of each geom of a movable body.
    template <class Visit>
    static void for_each_geom(const Model& model, const Data& data, const Visit& visit) {
        for (int geom = 0; geom < model.ngeom; ++geom) {
            const double radius = model.geom_rbound[geom];
            if (model.body_weldid[model.geom_bodyid[geom]] == 0 || !(radius > 0.0)) continue;
            visit(Eigen::Vector3d(data.geom_xpos[3 * geom], data.geom_xpos[3 * geom + 1],
                                  data.geom_xpos[3 * geom + 2]),
                  radius);
        }
    }

    bool has_spacing(const Model& model, const Ground& ground) const {
        const GroundWindowSettings& cells = field_.window().settings();
        const double across = 2.0 * model.hfield_size[4 * hfield_] / cells.columns;
        const double along = 2.0 * model.hfield_size[4 * hfield_ + 1] / cells.rows;
        const double most = 1e-9 * ground.spacing();
        return std::abs(across - ground.spacing()) <= most &&
               std::abs(along - ground.spacing()) <= most;
    }

    void write(const Model& model, const Ground& ground, double range) {
        float* const out = model.hfield_data + model.hfield_adr[hfield_];
        const std::span<const double> heights = field_.heights();
        for (std::size_t i = 0; i < heights.size(); ++i) {
            out[i] = field_.is_ground()[i] != 0
                         ? static_cast<float>((heights[i] - field_.low()) / range)
                         : 0.0f;
        }
        middle_sim_ = field_.middle_sim(ground, field_.low());
        is_placed_ = true;
    }

    // Places the mocap body at the centre of the heights last written; in every update, because mj_resetData() moves
    // it.
    void place(Data& data) const {
        if (!is_placed_) return;
        for (int i = 0; i < 3; ++i) data.mocap_pos[3 * mocap_ + i] = middle_sim_[i];
        for (int i = 0; i < 4; ++i) data.mocap_quat[4 * mocap_ + i] = i == 0 ? 1.0 : 0.0;
    }

    FieldWindow field_;
    WorldPos origin_world_;
    int hfield_, mocap_;
    bool is_written_ = false;  // hfield_data matches the window
    bool is_placed_ = false;
    Eigen::Vector3d middle_sim_ = Eigen::Vector3d::Zero();  // centre of the heights last written
    std::vector<Aabb> boxes_;
    std::vector<BodyNeed> needs_;
};

}  // namespace terrane::adapters
