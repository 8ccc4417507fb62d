// SPDX-License-Identifier: MIT
#pragma once

// A window of the ground around MuJoCo's bodies, as the data of one height field (hfield) that moves with them. Needs
// no header of MuJoCo: the class is a template of mjModel and mjData, of any version with these members (2.1 to 3.x).
//
// Model: one hfield geom, alone on a mocap body without a pose of its own; hfield_xml() writes both:
//
//     <asset> <hfield name="ground" nrow="65" ncol="65" size="32 32 100 5"/> </asset>
//     <worldbody> <body name="ground" mocap="true"> <geom type="hfield" hfield="ground"/> </body> ...
//
// Units: metres. Frame: the world's axes (z up), translated by MujocoWindowSettings::origin_world. Rows run north and
// columns east from the south-western sample, as in Terrane; the spacing 2 size[0] / (ncol - 1) is that of the ground's
// contact level.
// Heights: MuJoCo's are hfield_data, in [0, 1], times size[2], above the geom. The window's lowest ground is 0, and the
// mocap body is at its height; float rounds them by size[2] 2^-25. A window with more than size[2] between its
// lowest and its highest ground is refused. size[3] is the thickness of the solid below the geom: MuJoCo pushes out
// what is inside a prism and nothing below it, so take more than the fastest body moves in a step, plus its size.
// Surface: MuJoCo cuts every cell from its south-western to its north-eastern corner, Terrane every other one; over
// the others the surfaces differ by up to half of the cell's twist, MujocoWindowUpdate::surface_error_m.
//
// Moving: the body is moved by whole cells and the data with it, so the surface stays where it is in the world. MuJoCo
// finds contacts anew in each step and gives a mocap body no velocity: a move neither drags nor pushes. It never
// touches sizes, so bounding spheres, boxes and trees that MuJoCo made when it compiled the model stay right.
//
// When: before mj_step(), with what the step before left in mjData. Inside mjcb_control an update comes after the
// collision of that step, and with the RK4 integrator four times in a step: call it outside. After an update with
// has_changed, mjr_uploadHField(model, context, window.hfield_id()) where the hfield is drawn.
//
// Absent ground: the hfield cannot have holes. Samples of no ground are at the bottom (0), and boxes over them are
// counted in the update: a simulator does not step such a body, or takes it out. The same goes for boxes over cells
// that volumes replace, whose mouths are closed by the heightfield here.
//
// Threads: only the thread that calls mj_step().
// Source: the documentation of MuJoCo: XML reference of asset/hfield, "Mocap bodies", and mjmodel.h.

#include <terrane/adapters/field_window.h>

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
    /// GroundWindowSettings::margin: the window moves when a body is closer to its edge than this many cells.
    std::int32_t margin = 8;
};

/// What became of an update.
enum class MujocoWindowStatus {
    ok,             ///< the hfield is the ground of the window
    no_bodies,      ///< there is no valid box: nothing was done
    wrong_spacing,  ///< the hfield's spacing is not that of the ground: nothing was done
    no_ground,      ///< no cell of the window is resident ground: the whole hfield is at its bottom
    too_high,       ///< the window's heights differ by more than size[2]: nothing was done
};

/// What an update did, and what the bodies stand on.
struct MujocoWindowUpdate {
    MujocoWindowStatus status = MujocoWindowStatus::ok;  ///< whether the hfield is up to date
    bool has_changed = false;    ///< hfield_data was written: upload it where it is drawn
    bool covers_boxes = false;   ///< all boxes lie in the window
    int unsupported_boxes = 0;   ///< boxes over a cell that is absent, outside or not in the window
    int boxes_over_volumes = 0;  ///< boxes over a cell that volumes replace
    std::int64_t absent_cells = 0;  ///< of the window, not resident or outside
    double height_range = 0.0;      ///< highest minus lowest ground of the window
    /// Bound of the vertical distance between MuJoCo's surface and the contact surface over the window's ground.
    double surface_error_m = 0.0;
};

/// The two elements of a model that a MujocoWindow needs, without the elements around them.
struct MujocoHfieldXml {
    std::string asset;  ///< for the element `asset`
    std::string body;   ///< for the element `worldbody`
};

/// @param cells     of the window along each side
/// @param spacing   of the ground's contact level, metres
/// @param range     the most that heights of a window differ, metres: size[2]
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
    /// @param geom_id of the hfield geom, from mj_name2id()
    ///
    /// Fails: invalid_argument for an id that is no hfield geom, a geom that is not alone on a mocap body, a field of
    ///        fewer than 2 x 2 samples, settings out of range; out_of_memory
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
        Result<FieldWindow> field = FieldWindow::create(std::int64_t{model.hfield_ncol[hfield]} - 1,
                                                        std::int64_t{model.hfield_nrow[hfield]} - 1,
                                                        settings.margin, settings.origin_world);
        if (!field) return tl::unexpected(field.error());
        return MujocoWindow(std::move(*field), hfield, mocap);
    }

    /// The boxes around all bodies that can move, from the bounding spheres of their geoms at mjData's present
    /// positions (those of the last mj_forward() or mj_step()).
    static void find_body_boxes(const Model& model, const Data& data,
                                std::vector<Aabb>& boxes_out) {
        boxes_out.clear();
        for (int geom = 0; geom < model.ngeom; ++geom) {
            const double radius = model.geom_rbound[geom];
            if (model.body_weldid[model.geom_bodyid[geom]] == 0 || !(radius > 0.0)) continue;
            const Eigen::Vector3d centre(data.geom_xpos[3 * geom], data.geom_xpos[3 * geom + 1],
                                         data.geom_xpos[3 * geom + 2]);
            const Eigen::Vector3d half = Eigen::Vector3d::Constant(radius);
            boxes_out.push_back({centre - half, centre + half});
        }
    }

    /// Moves the window to all bodies that can move, and writes what changed.
    ///
    /// Allocates: where the number of geoms grows
    /// Cost:      O(geoms + cells that changed); after a move O(cells)
    MujocoWindowUpdate update(const Model& model, Data& data, const Ground& ground) {
        find_body_boxes(model, data, boxes_);
        return update(model, data, ground, boxes_);
    }

    /// The same for given boxes, MuJoCo's frame. Boxes that are not finite are ignored and count as unsupported.
    MujocoWindowUpdate update(const Model& model, Data& data, const Ground& ground,
                              std::span<const Aabb> boxes_sim) {
        MujocoWindowUpdate result;
        if (!has_spacing(model, ground)) {
            result.status = MujocoWindowStatus::wrong_spacing;
            result.unsupported_boxes = static_cast<int>(boxes_sim.size());
            return result;
        }
        if (field_.update(ground, boxes_sim)) is_written_ = false;
        result.covers_boxes = field_.covers_boxes();
        if (field_.is_empty()) {
            result.status = MujocoWindowStatus::no_bodies;
            result.unsupported_boxes = static_cast<int>(boxes_sim.size());
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
                                       : static_cast<int>(boxes_sim.size());
        return result;
    }

    /// For mjr_uploadHField().
    int hfield_id() const { return hfield_; }
    /// The samples that the hfield holds, and what its cells are.
    const GroundWindow& window() const { return field_.window(); }

private:
    static constexpr int kHfieldGeom = 1;  // mjGEOM_HFIELD

    MujocoWindow(FieldWindow field, int hfield, int mocap)
        : field_(std::move(field)), hfield_(hfield), mocap_(mocap) {}

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

    // The mocap body in the middle of what was written last; again in each update, because mj_resetData() moves it.
    void place(Data& data) const {
        if (!is_placed_) return;
        for (int i = 0; i < 3; ++i) data.mocap_pos[3 * mocap_ + i] = middle_sim_[i];
        for (int i = 0; i < 4; ++i) data.mocap_quat[4 * mocap_ + i] = i == 0 ? 1.0 : 0.0;
    }

    FieldWindow field_;
    int hfield_, mocap_;
    bool is_written_ = false;  // hfield_data is that of the window
    bool is_placed_ = false;
    Eigen::Vector3d middle_sim_ = Eigen::Vector3d::Zero();  // of what was written, at its 0
    std::vector<Aabb> boxes_;
};

}  // namespace terrane::adapters
