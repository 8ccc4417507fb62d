// SPDX-License-Identifier: MIT
#include "view/viewer.h"

#include <terrane/terrain/view.h>

#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <utility>

namespace terrane::tools {
namespace {

constexpr double kRadiansPerPixel = 0.004;  // of a mouse that looks around
constexpr double kDoubleClick = 0.35;       // seconds
constexpr double kFarthestPick = 1e5;       // metres
constexpr double kNearPick = 2000.0;        // metres, up to which the contact surface is asked
constexpr double kFlyShare = 0.15;          // of the distance, left after a flight to a point
constexpr double kThrowSpeed = 18.0;        // m/s
constexpr double kBrushShare = 0.7;         // of the distance, that a brush reaches at most
constexpr double kWalkSpeed = 2.0, kRunSpeed = 6.0;  // m/s
constexpr double kHandBrakeSpeed = 1.0;              // m/s
constexpr double kNoteTime = 4.0;                    // seconds for which a message is shown

// of a held shadow
constexpr double kShadowShare = 0.25;  // of the distance from the eye: to what casts it, if unknown
constexpr double kLeastCaster = 0.5;   // metres from the shadow to what casts it
constexpr double kLeastSun = 1.0;      // elevation, degrees

// of a point light that is placed
constexpr double kLightShare = 0.05;       // of the distance from the eye: its height
constexpr double kLeastLightHeight = 2.0;  // metres
constexpr double kLightOnGround = 10.0;    // of white below it

const char* name_of(BodyCondition condition) {
    switch (condition) {
        case BodyCondition::awake:
            return "awake";
        case BodyCondition::asleep:
            return "asleep";
        case BodyCondition::parked:
            return "parked";
        case BodyCondition::left_world:
            return "left the world";
        case BodyCondition::fixed:
            return "fixed";
        case BodyCondition::removed:
            break;
    }
    return "removed";
}

}  // namespace

void Viewer::say(std::string note) {
    note_ = std::move(note);
    note_until_ = clock_ + kNoteTime;
}

std::string Viewer::lonlat_text(const WorldPos& p_world) const {
    if (!georeference_) return "";
    const Eigen::Vector3d lonlat = georeference_->lonlat_from_world(p_world);
    if (!lonlat.allFinite()) return "";
    return fmt::format("lon {:.6f}, lat {:.6f}", lonlat.x(), lonlat.y());
}

// Frees the camera from the path where it is.
void Viewer::leave_path() {
    if (!follows_path_) return;
    camera_.jump_to(played_pose());
    follows_path_ = false;
}

// Removes walker or vehicle.
void Viewer::leave_body() {
    if (live_.being() == Being::camera) return;
    live_.leave();
    history_.change(live_);
}

// Puts the camera at a pose, off the path.
void Viewer::go(const CameraPose& pose) {
    leave_body();
    follows_path_ = false;
    camera_.jump_to(pose);
}

std::optional<Viewer::Pick> Viewer::pick(double x_px, double y_px) {
    const View view = view_now();
    const Eigen::Vector3d along = direction_through(view, x_px, y_px);
    const WorldPos& eye = view.eye_world;
    const Ground ground = maker_.pager().ground(terrain_.surface);
    Pick pick;
    double nearest = kFarthestPick;
    const RayQueryAnswer body =
        shown_world().ray(ground, eye, eye + kNearPick * along, {.include_ground = false});
    if (body.hit) nearest = body.fraction * kNearPick;
    const RayAnswer near = ground.ray(eye, eye + kNearPick * along);
    std::optional<WorldPos> on_ground;
    if (near.status == QueryStatus::ok) on_ground = near.point_world;
    // beyond the contact surface that is resident, what is drawn
    if (near.status != QueryStatus::ok) {
        if (const std::optional<MeshHit> drawn =
                first_on_mesh(host_mesh(), eye, along, kFarthestPick))
            on_ground = drawn->point_world;
    }
    bool is_ground = false;
    if (on_ground && (*on_ground - eye).norm() < nearest) {
        nearest = (*on_ground - eye).norm();
        is_ground = true;
    }
    if (picker_) {
        const auto found = picker_->ray(eye, eye + std::min(nearest, kNearPick) * along, 1.0);
        if (found && *found) {
            const PickedObject& object = **found;
            pick.point_world = object.point_world;
            pick.lines = {fmt::format("object {}, scale {:.3g}",
                                      terrain_.objects->names[object.mesh], object.scale),
                          fmt::format("at {:.2f}, {:.2f}, {:.2f} m", object.point_world.x(),
                                      object.point_world.y(), object.point_world.z())};
            return pick;
        }
    }
    if (!is_ground && !body.hit) return std::nullopt;
    pick.point_world = is_ground ? *on_ground : body.point_world;
    const WorldPos& p = pick.point_world;
    pick.is_ground = is_ground;
    if (is_ground) {
        pick.lines.push_back(fmt::format("ground {:.2f}, {:.2f}, {:.2f} m", p.x(), p.y(), p.z()));
        if (near.status == QueryStatus::ok) {
            const double slope = std::acos(std::clamp(near.normal.z(), -1.0, 1.0));
            pick.lines.push_back(
                fmt::format("within {:.3f} m of the true surface, slope {:.0f} deg", near.error_m,
                            slope * 180.0 / std::numbers::pi));
        }
    } else {
        const BodyState& state = shown_world().state(body.body);
        const BodySettings& settings = shown_world().settings(body.body);
        pick.body = body.body;
        pick.lines.push_back(fmt::format("body {}: {}, {:.4g} kg", body.body.index,
                                         name_of(state.condition), settings.mass));
        pick.lines.push_back(fmt::format("at {:.2f}, {:.2f}, {:.2f} m, {:.2f} m/s", p.x(), p.y(),
                                         p.z(), state.velocity.norm()));
    }
    if (std::string lonlat = lonlat_text(p); !lonlat.empty()) pick.lines.push_back(lonlat);
    return pick;
}

// The finest resident chunk at a point of the ground, and the one that draws it.
std::vector<std::string> Viewer::chunk_lines(const WorldPos& p_world) {
    std::vector<std::string> lines;
    const auto text = [](const Chunk& chunk, const Lattice& lattice) {
        const ChunkKey& key = chunk.key;
        return fmt::format("level {}, chunk {}, {}, samples {:.4g} m apart", key.level, key.x,
                           key.y, lattice.level_spacing(key.level));
    };
    const ResidentSet& resident = *maker_.pager().resident();
    if (const Chunk* const finest = finest_chunk_at(resident, p_world.head<2>()))
        lines.push_back("resident: " + text(*finest, resident.lattice()));
    const View view = view_now();
    const Eigen::Vector3d along = (p_world - view.eye_world).normalized();
    const std::optional<MeshHit> drawn =
        first_on_mesh(host_mesh(), view.eye_world, along, kFarthestPick);
    if (!drawn) return lines;
    lines.push_back("drawn: " + text(*drawn->chunk, mesh_.resident->lattice()));
    if (drawn->ground == nullptr) {
        lines.back() += ", a volume";
    } else {
        const double error = chunk_error_px(mesh_, *drawn->ground, view, applied_.morph_ratio);
        lines.back() += fmt::format(", within {:.2f} px", std::min(error, mesh_.error_px));
    }
    return lines;
}

// Places a point light over what is at the cursor.
void Viewer::place_light() {
    const std::optional<Pick> at = pick(input_.x, input_.y);
    if (!at) {
        say("no ground at the cursor");
    } else if (dials_.lights.size() == kMostPointLights) {
        say(fmt::format("there can be {} point lights", kMostPointLights));
    } else {
        const double distance = (at->point_world - view_now().eye_world).norm();
        const double height = std::max(kLeastLightHeight, kLightShare * distance);
        const double strength = kLightOnGround * height * height;
        dials_.lights.push_back({at->point_world + WorldPos(0.0, 0.0, height), strength});
        say(fmt::format("point light {} of {}, {:.3g} m up, strength {:.3g}", dials_.lights.size(),
                        kMostPointLights, height, strength));
    }
}

void Viewer::remove_light() {
    if (dials_.lights.empty()) {
        say("there is no point light: V places one");
        return;
    }
    dials_.lights.pop_back();
    say(fmt::format("{} point lights", dials_.lights.size()));
}

// Takes hold of the shadow at the cursor: that of the first thing towards the sun or, without one, of a point there.
void Viewer::hold_shadow() {
    const std::optional<Pick> at = pick(input_.x, input_.y);
    if (!at) {
        say("no ground at the cursor");
        return;
    }
    const Eigen::Vector3d sun =
        sun_direction({dials_.sun_deg[0], std::max(dials_.sun_deg[1], kLeastSun)});
    double distance = kShadowShare * (at->point_world - view_now().eye_world).norm();
    const WorldPos from = at->point_world + kLeastCaster * sun, to = from + kNearPick * sun;
    const Ground ground = maker_.pager().ground(terrain_.surface);
    if (const RayQueryAnswer met = shown_world().ray(ground, from, to); met.hit)
        distance = kLeastCaster + met.fraction * kNearPick;
    if (picker_) {
        if (const auto met = picker_->ray(from, to, 1.0); met && *met)
            distance = ((*met)->point_world - at->point_world).norm();
    }
    held_shadow_ = HeldShadow{at->point_world + distance * sun, at->point_world.z()};
}

// Turns the sun so that the held shadow falls at the cursor.
void Viewer::drag_shadow() {
    const WorldPos eye = view_now().eye_world;
    const Eigen::Vector3d along = direction_through(view_now(), input_.x, input_.y);
    const double distance = (held_shadow_->height - eye.z()) / along.z();
    if (!(distance > 0.0 && distance < kFarthestPick)) return;
    dials_.sun_deg = sun_dials(held_shadow_->caster_world - (eye + distance * along));
    dials_.sun_deg[1] = std::max(dials_.sun_deg[1], kLeastSun);
    say(fmt::format("sun at azimuth {:.0f}, elevation {:.0f} deg", dials_.sun_deg[0],
                    dials_.sun_deg[1]));
}

CameraControls Viewer::camera_controls(const WindowInput& input, double) const {
    const auto axis = [&input](int plus, int minus) {
        return (input.is_held(plus) ? 1.0 : 0.0) - (input.is_held(minus) ? 1.0 : 0.0);
    };
    CameraControls controls;
    controls.move = {axis(GLFW_KEY_D, GLFW_KEY_A) + input.left_stick[0],
                     axis(GLFW_KEY_W, GLFW_KEY_S) + input.left_stick[1],
                     axis(GLFW_KEY_E, GLFW_KEY_Q)};
    controls.move = controls.move.cwiseMax(-1.0).cwiseMin(1.0);
    controls.is_fast = input.is_held(GLFW_KEY_LEFT_SHIFT) || input.is_held(GLFW_KEY_RIGHT_SHIFT);
    if (!overlay_->takes_mouse(input.x, input.y)) {
        controls.wheel = input.wheel;
        if (input.held_buttons.contains(GLFW_MOUSE_BUTTON_RIGHT)) {
            controls.turn = kRadiansPerPixel * input.moved_x;
            controls.lift = -kRadiansPerPixel * input.moved_y;
        }
    }
    return controls;
}

// Passes held keys and the mouse on to the camera, walker or vehicle.
void Viewer::steer(const WindowInput& input, double dt) {
    const CameraControls controls = camera_controls(input, dt);
    is_steering_ = live_.grabbed().is_valid();
    if (live_.being() == Being::camera) {
        const bool is_moved =
            !controls.move.isZero() || controls.turn != 0.0 || controls.lift != 0.0;
        if (follows_path_ && is_moved) {
            leave_path();
            say("off the path: P returns to it");
        }
        if (follows_path_) return;
        camera_.move(
            controls, dt, altitude(camera_.pose().eye_world),
            [this](const WorldPos& from, const WorldPos& to) { return stopped(from, to); });
        if (controls.wheel != 0.0 && !camera_.is_orbiting())
            say(fmt::format("speed x{:.2g}", camera_.speed_factor()));
        return;
    }
    if (!timeline_.is_playing() && !controls.move.isZero()) say("paused: Space plays");
    if (live_.is_waiting()) return;
    const bool has_key = input.is_held(GLFW_KEY_B) || input.is_held(GLFW_KEY_J);
    is_steering_ = is_steering_ || has_key || !controls.move.isZero() || controls.turn != 0.0 ||
                   input.triggers[0] + input.triggers[1] > 0.0;
    if (live_.being() == Being::driver) {
        live_.turn_camera(controls.turn);
        // a vehicle that nobody drives stays where it is
        const bool is_left = controls.move.y() == 0.0 && live_.velocity().norm() < kHandBrakeSpeed;
        const double brake = input.is_held(GLFW_KEY_B) || is_left ? 1.0 : 0.0;
        const double pedals = input.triggers[1] - input.triggers[0];
        live_.steer(VehicleControls{.throttle = std::clamp(controls.move.y() + pedals, -1.0, 1.0),
                                    .brake = brake,
                                    .steer = -controls.move.x()});
        return;
    }
    live_.turn(-controls.turn);
    const Pose pose = live_.pose();
    const Eigen::Vector2d ahead = pose.rotation.col(0).head<2>();
    const Eigen::Vector2d right(ahead.y(), -ahead.x());
    const double speed = controls.is_fast ? kRunSpeed : kWalkSpeed;
    const Eigen::Vector2d wanted = controls.move.y() * ahead + controls.move.x() * right;
    live_.steer(WorldVec2(speed * (wanted.norm() > 1.0 ? wanted.normalized() : wanted)),
                input.is_held(GLFW_KEY_J));
}

void Viewer::change_being() {
    const View view = view_now();
    leave_path();
    const WorldVec2 place = live_.being() == Being::camera || live_.is_waiting()
                                ? WorldVec2(view.eye_world.head<2>())
                                : WorldVec2(live_.pose().translation.head<2>());
    switch (live_.being()) {
        case Being::camera:
            live_.walk(place, view.eye_world.z(), view.forward.head<2>());
            history_.change(live_);
            say("walker: W A S D, Shift runs, J jumps");
            break;
        case Being::walker:
            live_.drive(dials_.vehicle, place, view.eye_world.z(), view.forward.head<2>());
            history_.change(live_);
            say("vehicle: W A S D, B brakes, U puts it on its wheels");
            break;
        case Being::driver: {
            CameraPose pose;
            pose.eye_world = view.eye_world;
            pose.forward = view.forward;
            go(pose);
            say("camera");
            break;
        }
    }
    if (!timeline_.is_playing()) timeline_.play();
}

bool Viewer::can_dig() {
    if (!settings_.why_no_brush.empty()) say(settings_.why_no_brush);
    return settings_.why_no_brush.empty();
}

void Viewer::dig(bool fills) {
    if (!can_dig()) return;
    const std::optional<Pick> at = pick(input_.x, input_.y);
    if (!at || at->body.is_valid()) {
        say("no ground at the cursor");
        return;
    }
    const double radius = std::max(dials_.brush_radius, brush_->least_radius());
    // the eye would be in the hole
    if (radius > kBrushShare * (at->point_world - view_now().eye_world).norm()) {
        say(fmt::format(
            "too near for a brush of {:.3g} m: the ground takes balls of {:.3g} m or more", radius,
            brush_->least_radius()));
        return;
    }
    const Result<void> done = brush_->add({fills, at->point_world, at->point_world, radius});
    if (done) history_.change(live_);  // before the ground does: it is not that of the future
    say(done ? fmt::format("{} {:.3g} m", fills ? "filled" : "dug", radius) : done.error().message);
}

void Viewer::undo_dig() {
    if (!can_dig()) return;
    const Result<void> undone = brush_->undo();
    if (undone) history_.change(live_);
    say(undone ? "undone" : "nothing to undo");
}

// A name in the folder that no file has.
std::string Viewer::free_name(const std::string& ending) const {
    for (int number = 1;; ++number) {
        std::string name = fmt::format("{}/terrane_{:04}.{}", settings_.folder, number, ending);
        if (!std::filesystem::exists(name)) return name;
    }
}

void Viewer::take_picture() {
    const std::string name = free_name("png");
    const Result<void> written = write_png(renderer_.read(), name);
    say(written ? "wrote " + name : written.error().message);
}

void Viewer::end_film() {
    if (!film_) return;
    const Result<void> finished = film_->finish();
    film_.reset();
    say(finished ? "the film is complete" : finished.error().message);
}

void Viewer::toggle_film() {
    if (film_) {
        end_film();
        return;
    }
    const std::string name = free_name("mp4");
    if (picture_.width_px % 2 != 0 || picture_.height_px % 2 != 0) {
        say("a film needs a window of even width and height");
        return;
    }
    Result<Film> film = Film::create(name, picture_.width_px, picture_.height_px, kFilmRate);
    if (!film) {
        say(film.error().message);
        return;
    }
    film_.emplace(*std::move(film));
    film_time_ = film_clock_ = 0.0;
    say("films " + name + " until R");
}

Result<void> Viewer::react_to_key(const WindowInput::Press& key) {
    const bool has_control = (key.mods & GLFW_MOD_CONTROL) != 0;
    const bool is_digit = key.number >= GLFW_KEY_1 && key.number <= GLFW_KEY_9;
    // keys of the window manager
    if ((key.mods & (GLFW_MOD_ALT | GLFW_MOD_SUPER)) != 0 || (has_control && !is_digit)) return {};
    if (is_digit) {
        const CameraPlace place = place_now();
        if (has_control) {
            bookmarks_[key.number] = {.eye_world = place.eye_world, .forward = view_now().forward};
            say(fmt::format("bookmark {}", key.number - GLFW_KEY_0));
        } else if (bookmarks_.contains(key.number)) {
            go(bookmarks_[key.number]);
        } else {
            say(fmt::format("no bookmark {}: Ctrl sets it", key.number - GLFW_KEY_0));
        }
        return {};
    }
    switch (key.number) {
        case GLFW_KEY_ESCAPE:
            if (std::exchange(overlay_->help, Overlay::Help::none) == Overlay::Help::none)
                window_.close();
            break;
        case GLFW_KEY_F1:
            overlay_->help =
                overlay_->help == Overlay::Help::all ? Overlay::Help::none : Overlay::Help::all;
            break;
        case GLFW_KEY_F2:
            overlay_->shows_panel = !overlay_->shows_panel;
            break;
        case GLFW_KEY_M:
            overlay_->shows_map = !overlay_->shows_map;
            break;
        case GLFW_KEY_TAB:
            change_being();
            break;
        case GLFW_KEY_F: {
            const View view = view_now();
            const Eigen::Vector3d along = direction_through(view, input_.x, input_.y);
            TERRANE_TRY(live_.throw_crate(view.eye_world + 2.0 * along,
                                          kThrowSpeed * along + live_.velocity()));
            history_.change(live_);
            break;
        }
        case GLFW_KEY_X:
        case GLFW_KEY_C:
            dig(key.number == GLFW_KEY_C);
            break;
        case GLFW_KEY_Z:
            undo_dig();
            break;
        case GLFW_KEY_SPACE:
            timeline_.toggle();
            break;
        case GLFW_KEY_COMMA:
        case GLFW_KEY_PERIOD:
            timeline_.step((key.number == GLFW_KEY_PERIOD ? 1.0 : -1.0) / frame_rate_);
            if (!has_playback() && key.number == GLFW_KEY_PERIOD)
                TERRANE_TRY(simulate(1.0 / frame_rate_));
            break;
        case GLFW_KEY_LEFT_BRACKET:
            timeline_.set_rate(0.5 * timeline_.rate());
            break;
        case GLFW_KEY_RIGHT_BRACKET:
            timeline_.set_rate(2.0 * timeline_.rate());
            break;
        case GLFW_KEY_L:
            timeline_.set_loops(!timeline_.loops());
            break;
        case GLFW_KEY_P:
            if (!has_playback()) {
                say("there is no path: --path or --replay plays one");
            } else {
                leave_body();
                follows_path_ = true;
            }
            break;
        case GLFW_KEY_O:
            if (camera_.is_orbiting()) {
                camera_.stop_orbit();
            } else if (const std::optional<Pick> at = pick(input_.x, input_.y)) {
                leave_path();
                camera_.orbit(at->point_world);
            }
            break;
        case GLFW_KEY_H:
            go(home_);
            break;
        case GLFW_KEY_N: {
            const WorldPos eye = view_now().eye_world;
            const double convergence =
                georeference_ ? georeference_->scale_at(eye.x(), eye.y()).convergence : 0.0;
            camera_.look_along(std::isfinite(convergence) ? -convergence : 0.0);
            break;
        }
        case GLFW_KEY_U:
            live_.right(maker_.pager().ground(terrain_.surface));
            history_.change(live_);
            break;
        case GLFW_KEY_Y:
            hold_shadow();
            break;
        case GLFW_KEY_V:
            place_light();
            break;
        case GLFW_KEY_I:
            remove_light();
            break;
        case GLFW_KEY_G: {
            // without materials the last ones are left out
            const std::size_t count =
                kGroundColourNames.size() - (options_.has_materials() ? 0 : 1);
            const std::size_t next = (static_cast<std::size_t>(dials_.colours) + 1) % count;
            dials_.colours = static_cast<GroundColours>(next);
            say(fmt::format("colours of the ground: {}", kGroundColourNames[next]));
            break;
        }
        case GLFW_KEY_T:
            dials_.wireframe = !dials_.wireframe;
            break;
        case GLFW_KEY_F11:
            window_.set_full_screen(!window_.is_full_screen());
            break;
        case GLFW_KEY_F12:
            take_picture();
            break;
        case GLFW_KEY_R:
            toggle_film();
            break;
        case GLFW_KEY_K: {
            const std::string command = settings_.command_of(
                place_now(), {picture_.width_px, picture_.height_px}, dials_.lights);
            window_.set_clipboard(command);
            say(command);
            break;
        }
        default:
            break;
    }
    return {};
}

void Viewer::react_to_button(const WindowInput::Press& button) {
    if (button.number != GLFW_MOUSE_BUTTON_LEFT) return;
    ++click_count_;
    const std::optional<Pick> at = pick(button.x, button.y);
    const bool is_double = clock_ - std::exchange(last_click_, clock_) < kDoubleClick;
    picked_.clear();
    if (!at) return;
    picked_ = at->lines;
    if (at->is_ground) {
        const std::vector<std::string> of_chunks = chunk_lines(at->point_world);
        picked_.insert(picked_.end(), of_chunks.begin(), of_chunks.end());
    }
    if (at->body.is_valid()) {
        if (!replay_) live_.grab(at->body, at->point_world);
        grab_distance_ = (at->point_world - view_now().eye_world).norm();
        return;
    }
    if (is_double && live_.being() == Being::camera) {
        leave_path();
        const double distance = (at->point_world - camera_.pose().eye_world).norm();
        camera_.fly_to(at->point_world, std::max(kFlyShare * distance, 10.0));
    }
}

Result<void> Viewer::react(const WindowInput& input, double dt) {
    input_ = input;
    if (!overlay_->takes_keys())
        for (const WindowInput::Press& key : input.keys) TERRANE_TRY(react_to_key(key));
    for (const WindowInput::Press& button : input.buttons)
        if (!overlay_->takes_mouse(button.x, button.y)) react_to_button(button);
    if (live_.grabbed().is_valid()) {
        const View view = view_now();
        if (input.held_buttons.contains(GLFW_MOUSE_BUTTON_LEFT)) {
            live_.pull_to(view.eye_world +
                          grab_distance_ * direction_through(view, input.x, input.y));
        } else {
            live_.let_go();
        }
    }
    if (!input.is_held(GLFW_KEY_Y)) held_shadow_.reset();
    if (held_shadow_ && (input.moved_x != 0.0 || input.moved_y != 0.0)) drag_shadow();
    steer(input, dt);
    return {};
}

}  // namespace terrane::tools
