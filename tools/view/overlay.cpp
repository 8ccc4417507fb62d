// SPDX-License-Identifier: MIT
#include "view/overlay.h"

#include "view/widgets.h"

#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <imgui.h>
#include <imgui_impl_glfw.h>
#include <imgui_impl_opengl3.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

namespace terrane::tools {
namespace {

constexpr std::size_t kPlotted = 180;   // frames
constexpr float kPlotHigh = 26.0f;      // pixels
constexpr float kMargin = 10.0f;        // pixels between panels and the window's edges
constexpr float kNarrow = 700.0f;       // width of a window in which the panel starts collapsed
constexpr float kMostCovered = 0.5f;    // share of the window that panels cover
constexpr float kLeastHigh = 60.0f;     // of a panel
constexpr float kReserved = 34'000.0f;  // area for each panel that is drawn later
constexpr float kPanelOpacity = 0.78f;
constexpr int kPanelFlags = ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings;
// of the dials of simulated storage
constexpr double kMostLatency_ms = 2000.0;
constexpr double kLeastBandwidth_mb = 0.1, kMostBandwidth_mb = 1000.0;
constexpr float kMapSide = 260.0f,
                kMapShare = 0.4f;  // of the map, and of the window's shorter side

constexpr std::array<KeyHelp, 33> kKeys{{
    {"W A S D", "fly, walk or drive", true},
    {"right mouse", "look around (hold)", true},
    {"wheel", "faster or slower; nearer in an orbit", true},
    {"double click", "fly there", true},
    {"Tab", "camera, walker, vehicle", true},
    {"F", "throw a crate", true},
    {"left mouse", "pull a body; on the ground: what is here?", true},
    {"X / C / Z", "dig, fill and undo at the cursor", true},
    {"Space", "play or pause; drag the timeline to seek", true},
    {"F1", "all keys", true},
    {"F2", "panel of figures and dials"},
    {"M", "map"},
    {"E / Q", "up and down"},
    {"Shift", "five times as fast; run"},
    {"J", "jump, as a walker"},
    {"B", "brake, as a driver"},
    {"U", "put the vehicle on its wheels"},
    {"O", "orbit the point at the cursor, or stop"},
    {"H", "back to the start"},
    {"N", "look along true north"},
    {"1 to 9", "go to a bookmark; with Ctrl set it"},
    {", and .", "a frame back or forth"},
    {"[ and ]", "slower or faster playback"},
    {"L", "loop the playback"},
    {"P", "back onto the path"},
    {"Y", "hold it: the shadow at the cursor follows, and the sun"},
    {"V / I", "a point light at the cursor; remove the last"},
    {"G", "colours of the ground: levels, chunks, error, late, materials"},
    {"T", "wireframe"},
    {"F11", "full screen"},
    {"Escape", "hide the keys; then close the window"},
    {"F12 / R", "picture, film"},
    {"K", "copy as command"},
}};

void show_bar(const char* label, double value, double most, const std::string& text) {
    ImGui::ProgressBar(most > 0.0 ? static_cast<float>(std::min(1.0, value / most)) : 0.0f,
                       ImVec2(ImGui::CalcItemWidth(), 0.0f), text.c_str());
    ImGui::SameLine();
    ImGui::TextUnformatted(label);
}

void slider(const char* label, double& value, double low, double high, const char* format) {
    ImGui::SliderScalar(label, ImGuiDataType_Double, &value, &low, &high, format);
}

// The colours of the ground's materials, three a line.
void draw_legend() {
    constexpr std::size_t kColumns = 3;
    for (std::size_t i = 0; i < kFlatMaterials.size(); ++i) {
        const auto& [name, colour] = kFlatMaterials[i];
        if (i % kColumns > 0) {
            ImGui::SameLine(static_cast<float>(i % kColumns) * ImGui::CalcItemWidth() / 2.0f);
        }
        ImGui::ColorButton(name, ImVec4(colour.red, colour.green, colour.blue, 1.0f),
                           ImGuiColorEditFlags_NoTooltip | ImGuiColorEditFlags_NoDragDrop,
                           ImVec2(ImGui::GetFontSize(), ImGui::GetFontSize()));
        ImGui::SameLine();
        ImGui::TextUnformatted(name);
    }
}

template <std::size_t n>
void plot(const char* label, const std::deque<std::array<float, n>>& values, std::size_t column) {
    std::vector<float> column_values;
    for (const std::array<float, n>& row : values) column_values.push_back(row[column]);
    float most = 0.0f;
    for (const float value : column_values)
        if (std::isfinite(value)) most = std::max(most, value);
    const std::string text =
        column_values.empty() ? "" : fmt::format("{:.2f}", column_values.back());
    ImGui::PlotLines(label, column_values.data(), static_cast<int>(column_values.size()), 0,
                     text.c_str(), 0.0f, 1.1f * most, ImVec2(ImGui::CalcItemWidth(), kPlotHigh));
}

}  // namespace

std::span<const KeyHelp> key_helps() { return kKeys; }

Overlay::Overlay(Window& window) : window_(window) {
    IMGUI_CHECKVERSION();
    ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;  // writes no file
    io.LogFilename = nullptr;
    ImGui::StyleColorsDark();
    const auto scale = static_cast<float>(window.content_scale());
    // so that the panel fits into a window of 720 lines
    ImGui::GetStyle().FramePadding.y = 2.0f;
    ImGui::GetStyle().ItemSpacing.y = 3.0f;
    ImGui::GetStyle().ScaleAllSizes(scale);
    io.FontGlobalScale = scale;
    ImGui_ImplGlfw_InitForOpenGL(window.handle(), true);
    map_.reserve_texture();
    io.KeyMap[ImGuiKey_Tab] = -1;  // of the view: in a panel it would edit the next dial
    ImGui_ImplOpenGL3_Init("#version 450 core");
}

Overlay::~Overlay() {
    ImGui_ImplOpenGL3_Shutdown();
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
}

// Begins a panel. It scrolls if it would reach the timeline, or with the others cover too much of the window. Returns
// whether it is open, so that it has contents.
bool Overlay::begin_panel(const char* name, bool* is_open, int more_flags) {
    struct Room {
        ImVec2 most;
        float area;
    };
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    Room room{ImVec2(size.x - 2.0f * kMargin, floor_ - kMargin),
              kMostCovered * size.x * size.y - covered_area() -
                  kReserved * static_cast<float>(later_panels_)};
    const auto limit = [](ImGuiSizeCallbackData* data) {
        const auto& [most, area] = *static_cast<const Room*>(data->UserData);
        ImVec2& wanted = data->DesiredSize;
        wanted.x = std::min(wanted.x, std::max(1.0f, most.x));
        const float high = std::min(most.y, area / std::max(1.0f, wanted.x));
        wanted.y = std::min(wanted.y, std::max(kLeastHigh, high));
    };
    constexpr float kAny = std::numeric_limits<float>::max();
    ImGui::SetNextWindowSizeConstraints(ImVec2(0.0f, 0.0f), ImVec2(kAny, kAny), limit, &room);
    ImGui::SetNextWindowBgAlpha(kPanelOpacity);
    return ImGui::Begin(name, is_open, kPanelFlags | more_flags);
}

void Overlay::end_panel() {
    const ImVec2 low = ImGui::GetWindowPos(), size = ImGui::GetWindowSize();
    covered_.push_back({low.x, low.y, low.x + size.x, low.y + size.y});
    ImGui::End();
}

// Of all panels of this frame so far, ImGui's units.
float Overlay::covered_area() const {
    float sum = 0.0f;
    for (const auto& [left, top, right, bottom] : covered_) sum += (right - left) * (bottom - top);
    return sum;
}

double Overlay::covered_share() const {
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    return static_cast<double>(covered_area() / std::max(1.0f, size.x * size.y));
}

bool Overlay::takes_mouse(double x_px, double y_px) const {
    if (ImGui::IsAnyItemActive()) return true;
    const ImVec2 scale = ImGui::GetIO().DisplayFramebufferScale;
    const double x = x_px / static_cast<double>(std::max(scale.x, 1e-3f));
    const double y = y_px / static_cast<double>(std::max(scale.y, 1e-3f));
    return std::ranges::any_of(covered_, [&](const std::array<float, 4>& panel) {
        const auto edge = [&](std::size_t i) { return static_cast<double>(panel[i]); };
        return x >= edge(0) && y >= edge(1) && x < edge(2) && y < edge(3);
    });
}

bool Overlay::takes_keys() const { return ImGui::GetIO().WantTextInput; }

double Overlay::draw(const ViewFacts& facts, ViewDials& dials, Timeline& timeline) {
    const FrameRecord& frame = *facts.frame;
    times_.push_back({static_cast<float>(frame.update_ms), static_cast<float>(facts.draw_ms),
                      static_cast<float>(facts.wait_ms)});
    errors_.push_back({static_cast<float>(frame.error_px), static_cast<float>(frame.max_error_px)});
    if (times_.size() > kPlotted) times_.pop_front();
    if (errors_.size() > kPlotted) errors_.pop_front();
    const bool has_notes = !facts.picked.empty() || !facts.note.empty();
    if (help == Help::none && !shows_panel && !shows_map && !has_notes && facts.lines.empty()) {
        covered_.clear();
        return 0.0;
    }
    if (window_.width_px() < 1 || window_.height_px() < 1) return 0.0;
    covered_.clear();
    const auto start = std::chrono::steady_clock::now();
    ImGui_ImplOpenGL3_NewFrame();
    if (shows_map) map_.refresh(facts);
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
    ImDrawList* const back = ImGui::GetBackgroundDrawList();
    // from pixels of the picture, which fills the window, to ImGui's units
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    const float x_scale = size.x / static_cast<float>(std::max(1, facts.view.width_px));
    const float y_scale = size.y / static_cast<float>(std::max(1, facts.view.height_px));
    for (const PictureLine& line : facts.lines) {
        back->AddLine(ImVec2(line.ends[0] * x_scale, line.ends[1] * y_scale),
                      ImVec2(line.ends[2] * x_scale, line.ends[3] * y_scale),
                      colour_of(line.colour), 1.5f);
    }
    floor_ = size.y - kMargin;
    take_turns(size.x < kNarrow);
    later_panels_ = (shows_map ? 1 : 0) + (help != Help::none ? 1 : 0);
    // the first ones have the most room
    if (shows_panel) {
        draw_timeline(timeline);
        draw_panel(facts, dials);
    }
    if (shows_map) draw_map(facts);
    if (help != Help::none) draw_help();
    if (has_notes) draw_notes(facts);
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

// In a narrow window panel, map and keys take turns: the one that was opened last is shown.
void Overlay::take_turns(bool is_narrow) {
    const bool has_help = help != Help::none;
    const bool opens_map = shows_map && !had_map_, opens_help = has_help && !had_help_;
    if (is_narrow && opens_map) help = Help::none;
    if (is_narrow && opens_help && !opens_map) shows_map = false;
    collapses_panel_ = is_narrow && (opens_map || opens_help);
    had_map_ = shows_map;
    had_help_ = help != Help::none;
}

void Overlay::draw_help() {
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos(ImVec2(size.x - kMargin, kMargin), ImGuiCond_Always,
                            ImVec2(1.0f, 0.0f));
    bool is_open = true;
    --later_panels_;
    const bool has_contents = begin_panel(help == Help::first ? "Ten keys" : "Keys", &is_open);
    if (has_contents && ImGui::BeginTable("keys", 2)) {
        for (const KeyHelp& key : kKeys) {
            if (help == Help::first && !key.is_first) continue;
            ImGui::TableNextRow();
            ImGui::TableNextColumn();
            const ImVec4 colour =
                key.is_first ? ImVec4(1.0f, 0.85f, 0.3f, 1.0f) : ImVec4(0.8f, 0.8f, 0.8f, 1.0f);
            ImGui::TextColored(colour, "%s", key.keys);
            ImGui::TableNextColumn();
            ImGui::TextUnformatted(key.does);
        }
        ImGui::EndTable();
    }
    end_panel();
    if (!is_open) help = Help::none;
}

void Overlay::draw_panel(const ViewFacts& facts, ViewDials& dials) {
    ImGui::SetNextWindowPos(ImVec2(kMargin, kMargin), ImGuiCond_FirstUseEver);
    const bool is_narrow = ImGui::GetIO().DisplaySize.x < kNarrow;
    ImGui::SetNextWindowCollapsed(is_narrow, ImGuiCond_FirstUseEver);
    if (collapses_panel_) ImGui::SetNextWindowCollapsed(true);
    const bool has_contents = begin_panel("Terrane", &shows_panel);
    const bool was_open = std::exchange(is_panel_open_, !ImGui::IsWindowCollapsed());
    if (has_contents) {
        if (is_narrow && is_panel_open_ && !was_open) {
            help = Help::none;
            shows_map = false;
        }
        ImGui::PushItemWidth(170.0f * static_cast<float>(window_.content_scale()));
        draw_figures(facts);
        draw_dials(dials);
        draw_choices(dials);
        ImGui::PopItemWidth();
    }
    end_panel();
}

void Overlay::draw_figures(const ViewFacts& facts) {
    const FrameRecord& frame = *facts.frame;
    const WorldPos& eye = facts.view.eye_world;
    ImGui::Text("eye %.1f, %.1f, %.1f m", eye.x(), eye.y(), eye.z());
    if (std::isfinite(facts.altitude)) {
        ImGui::SameLine();
        ImGui::Text("  %.1f m above ground", facts.altitude);
    }
    if (!facts.lonlat.empty()) ImGui::TextUnformatted(facts.lonlat.c_str());
    ImGui::Separator();
    ImGui::TextUnformatted("Frame, ms");
    plot("update", times_, 0);
    plot("draw", times_, 1);
    plot("wait", times_, 2);
    show_bar("triangles", static_cast<double>(frame.triangles), static_cast<double>(frame.budget),
             fmt::format("{} of {}", frame.triangles, frame.budget));
    show_bar("memory", static_cast<double>(frame.paging.resident_bytes),
             static_cast<double>(facts.memory_bytes),
             fmt::format("{:.1f} of {:.0f} MB",
                         static_cast<double>(frame.paging.resident_bytes) * 0x1p-20,
                         static_cast<double>(facts.memory_bytes) * 0x1p-20));
    plot("error, px", errors_, 0);
    ImGui::Text("certified %.3f px, target %.3g px: %s", frame.error_px, frame.max_error_px,
                name_of(frame.status));
    ImGui::Text("late chunks %zu, resident %zu", frame.paging.late_chunks,
                frame.paging.resident_chunks);
    if (frame.has_objects) {
        ImGui::Text("objects %zu with %zu triangles", frame.objects_drawn, frame.object_triangles);
    }
    const auto count = [&](BodyCondition condition) {
        return std::ranges::count(facts.world->states(), condition, &BodyState::condition);
    };
    ImGui::Text("bodies: %td awake, %td asleep, %td parked", count(BodyCondition::awake),
                count(BodyCondition::asleep), count(BodyCondition::parked));
    ImGui::Text("deepest %.4f m, fell through %llu", facts.live->totals().max_depth_m,
                static_cast<unsigned long long>(facts.live->totals().fell_through));
}

// What was picked, and the last message, over the middle of the window's upper edge.
void Overlay::draw_notes(const ViewFacts& facts) {
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos(ImVec2(0.5f * size.x, kMargin), ImGuiCond_Always, ImVec2(0.5f, 0.0f));
    ImGui::SetNextWindowBgAlpha(kPanelOpacity);
    ImGui::Begin("Notes", nullptr,
                 kPanelFlags | ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_NoFocusOnAppearing);
    ImGui::PushTextWrapPos(0.45f * size.x);
    for (const std::string& line : facts.picked) ImGui::TextUnformatted(line.c_str());
    if (!facts.note.empty())
        ImGui::TextColored(ImVec4(1.0f, 0.85f, 0.3f, 1.0f), "%s", facts.note.c_str());
    ImGui::PopTextWrapPos();
    ImGui::End();
}

void Overlay::draw_dials(ViewDials& dials) {
    if (!ImGui::CollapsingHeader("Dials", ImGuiTreeNodeFlags_DefaultOpen)) return;
    log_slider("budget", dials.budget, 1000.0, 4e6, "%.0f");
    log_slider("target, px", dials.max_error_px, 0.1, 32.0, "%.2f");
    log_slider("morph ratio", dials.morph_ratio, 1.0, 16.0, "%.2f");
    log_slider("memory, MB", dials.memory_mb, 4.0, 16384.0, "%.0f");
    slider("sun azimuth", dials.sun_deg[0], 0.0, 360.0, "%.0f deg");
    slider("sun elevation", dials.sun_deg[1], -5.0, 90.0, "%.0f deg");
    if (dials.sun_hour) slider("sun, UTC", *dials.sun_hour, 0.0, 24.0, "%.1f h");
    log_slider("brush, m", dials.brush_radius, 0.1, 1000.0, "%.1f");
    ImGui::SliderInt(
        "substeps", &dials.live.substeps, 1, LiveSettings::kMostSubsteps,
        fmt::format("%d of {:.1f} ms", 1e3 * LiveWorld::kStep / dials.live.substeps).c_str(),
        ImGuiSliderFlags_AlwaysClamp);
    double tolerance_mm = 1e3 * dials.live.contact_tolerance;
    if (log_slider("tolerance, mm", tolerance_mm, 0.1, 100.0, "%.1f"))
        dials.live.contact_tolerance = 1e-3 * tolerance_mm;
    slider("latency, ms", dials.latency_ms, 0.0, kMostLatency_ms, "%.0f");
    // at the right end there is no limit
    double bandwidth = std::min(dials.bandwidth_mb, kMostBandwidth_mb);
    const bool is_limited = bandwidth < kMostBandwidth_mb;
    if (log_slider("storage, MB/s", bandwidth, kLeastBandwidth_mb, kMostBandwidth_mb,
                   is_limited ? "%.1f" : "no limit")) {
        dials.bandwidth_mb =
            bandwidth < kMostBandwidth_mb ? bandwidth : std::numeric_limits<double>::infinity();
    }
    for (std::size_t i = 0; i < dials.lights.size(); ++i) {
        log_slider(fmt::format("light {}", i + 1).c_str(), dials.lights[i].strength, 1.0, 1e5,
                   "%.3g");
    }
}

void Overlay::draw_choices(ViewDials& dials) {
    if (!ImGui::CollapsingHeader("Show", ImGuiTreeNodeFlags_DefaultOpen)) return;
    int colours = static_cast<int>(dials.colours);
    ImGui::Combo("ground", &colours, kGroundColourNames.data(),
                 static_cast<int>(kGroundColourNames.size()));
    dials.colours = static_cast<GroundColours>(colours);
    if (dials.colours == GroundColours::materials) draw_legend();
    ImGui::Checkbox("wireframe", &dials.wireframe);
    ImGui::SameLine();
    ImGui::Checkbox("contacts", &dials.bodies.contacts);
    ImGui::SameLine();
    ImGui::Checkbox("bounds", &dials.bodies.bounds);
    ImGui::SameLine();
    ImGui::Checkbox("needs", &dials.bodies.needs);
    int vehicle = static_cast<int>(dials.vehicle);
    const std::vector<std::string> names = vehicle_names();
    ImGui::Combo(
        "vehicle", &vehicle,
        [](void* data, int row, const char** text_out) {
            *text_out =
                (*static_cast<const std::vector<std::string>*>(data))[static_cast<std::size_t>(row)]
                    .c_str();
            return true;
        },
        const_cast<std::vector<std::string>*>(&names), static_cast<int>(names.size()));
    dials.vehicle = static_cast<VehicleKind>(vehicle);
}

void Overlay::draw_timeline(Timeline& timeline) {
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos(ImVec2(0.5f * size.x, size.y - kMargin), ImGuiCond_Always,
                            ImVec2(0.5f, 1.0f));
    // without a title it is always open
    (void)begin_panel("Timeline", nullptr, ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoMove);
    if (ImGui::Button(timeline.is_playing() ? "Pause" : "Play ")) timeline.toggle();
    ImGui::SameLine();
    if (std::isfinite(timeline.last())) {
        double time = timeline.time(), low = timeline.first(), high = timeline.last();
        ImGui::SetNextItemWidth(std::max(80.0f, 0.5f * size.x));
        if (ImGui::SliderScalar("##time", ImGuiDataType_Double, &time, &low, &high, "%.2f s")) {
            timeline.pause();
            timeline.seek(time);
        }
    } else {
        ImGui::Text("%.2f s", timeline.time());
    }
    ImGui::SameLine();
    double rate = timeline.rate();
    ImGui::SetNextItemWidth(90.0f);
    if (log_slider("##rate", rate, Timeline::kLeastRate, Timeline::kMostRate, "%.2gx"))
        timeline.set_rate(rate);
    if (std::isfinite(timeline.duration())) {
        bool loops = timeline.loops();
        ImGui::SameLine();
        if (ImGui::Checkbox("loop", &loops)) timeline.set_loops(loops);
    }
    floor_ = ImGui::GetWindowPos().y - 0.5f * kMargin;
    end_panel();
}

void Overlay::draw_map(const ViewFacts& facts) {
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos(ImVec2(size.x - kMargin, floor_), ImGuiCond_FirstUseEver,
                            ImVec2(1.0f, 1.0f));
    --later_panels_;
    if (begin_panel("Map", &shows_map))
        map_.draw(facts, std::min(kMapSide, kMapShare * std::min(size.x, size.y)));
    end_panel();
}

}  // namespace terrane::tools
