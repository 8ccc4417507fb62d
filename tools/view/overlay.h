// SPDX-License-Identifier: MIT
#pragma once

#include "flight/pictures.h"
#include "flight/window.h"
#include "frames/flight_log.h"
#include "view/live_world.h"
#include "view/map_panel.h"
#include "view/marks.h"
#include "view/timeline.h"

#include <terrane/terrain/resident_set.h>

#include <array>
#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace terrane::tools {

/// A key of the view, and what it does.
struct KeyHelp {
    const char* keys;
    const char* does;
    bool is_first = false;  ///< whether the first-run overlay names it
};
/// All keys, in the order of their importance.
std::span<const KeyHelp> key_helps();

/// Numbers of a view that the user can change while it runs.
struct ViewDials {
    double budget = 100'000.0;  ///< triangles a frame
    double max_error_px = 1.0;
    double morph_ratio = kDefaultMorphRatio;
    double memory_mb = 512.0;         ///< the pager's ceiling
    std::array<double, 2> sun_deg{};  ///< azimuth clockwise from world y, and elevation
    std::optional<double> sun_hour =
        {};  ///< of the day, UTC, where longitude is known: sets sun_deg
    bool wireframe = false;
    GroundColours colours = GroundColours::none;
    BodyMarks bodies = {};
    VehicleKind vehicle = VehicleKind::truck;
    double brush_radius = 2.0;  ///< of digs, metres
    LiveSettings live = {};
    std::vector<PlacedLight> lights = {};
    double latency_ms = 0.0;  ///< of simulated storage, as the next one
    double bandwidth_mb = std::numeric_limits<double>::infinity();  ///< MB of 10^6 bytes a second
};

/// What the overlay shows of a frame.
struct ViewFacts {
    const FrameRecord* frame = nullptr;  ///< all pointers are not null
    double draw_ms = 0.0;          ///< from the first command until the window has the picture
    double wait_ms = 0.0;          ///< for the display
    std::size_t memory_bytes = 0;  ///< the pager's ceiling
    View view;
    double altitude = 0.0;  ///< above the ground, metres; NaN if unknown

    std::string lonlat = {};               ///< of the eye; "" if unknown
    std::vector<std::string> picked = {};  ///< lines about what was clicked
    std::string note = {};                 ///< the last message
    const LiveWorld* live = nullptr;
    const World* world = nullptr;  ///< with the bodies that are shown
    std::shared_ptr<const ResidentSet> resident = {};
    std::span<const WorldPos> path = {};  ///< points of the path that is played; empty without one
    std::span<const PictureLine> lines = {};
};

/// The panels over a view: help, plots, dials, timeline and map.
class Overlay {
public:
    /// @param window must outlive the overlay; its context must be current in every call
    explicit Overlay(Window& window);
    Overlay(const Overlay&) = delete;
    Overlay& operator=(const Overlay&) = delete;
    ~Overlay();

    /// Which keys are shown.
    enum class Help { none, first, all };
    Help help = Help::first;
    bool shows_panel = true;
    bool shows_map = false;

    /// Whether a panel of the last draw() covers a point, pixels of the window, or is being dragged.
    bool takes_mouse(double x_px, double y_px) const;
    /// Share of the window that the panels of the last draw() cover, messages excluded.
    double covered_share() const;
    /// Whether text is typed into a panel.
    bool takes_keys() const;

    /// Draws all panels into the window. Changes the dials and the timeline as the user asks.
    ///
    /// @return milliseconds that it took; 0 if nothing is shown
    double draw(const ViewFacts& facts, ViewDials& dials, Timeline& timeline);

private:
    [[nodiscard]] bool begin_panel(const char* name, bool* is_open, int more_flags = 0);
    void end_panel();
    float covered_area() const;
    void take_turns(bool is_narrow);
    void draw_help();
    void draw_panel(const ViewFacts& facts, ViewDials& dials);
    void draw_figures(const ViewFacts& facts);
    void draw_dials(ViewDials& dials);
    void draw_choices(ViewDials& dials);
    void draw_notes(const ViewFacts& facts);
    void draw_timeline(Timeline& timeline);
    void draw_map(const ViewFacts& facts);

    Window& window_;
    std::deque<std::array<float, 3>> times_;   // update, draw and wait of the last frames, ms
    std::deque<std::array<float, 2>> errors_;  // certified error and target, px
    MapPanel map_;
    // for take_turns()
    bool had_map_ = false, had_help_ = false, is_panel_open_ = false, collapses_panel_ = false;
    int later_panels_ = 0;  // that this frame has not drawn yet
    float floor_ = 0.0f;    // y above which panels stay, ImGui's units
    std::vector<std::array<float, 4>>
        covered_;  // panels: left, top, right and bottom, ImGui's units
};

}  // namespace terrane::tools
