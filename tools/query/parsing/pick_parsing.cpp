// SPDX-License-Identifier: MIT
#include "query/parsing/pick_parsing.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace terrane::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kUsualFov_deg = 60.0;
constexpr double kLeastFov_deg = 0.1, kMostFov_deg = 179.0;
constexpr double kUsualFar = 1e5, kMostFar = 1e9;
constexpr double kMostSide_px = 1e6;
// Least sine of the angle between `forward` and `up`.
constexpr double kLeastSine = 1e-6;

Parsed<double> read_number_or(const Json& object, const char* key, double otherwise) {
    if (!object.contains(key)) return otherwise;
    return read_number(object, key);
}

/// A direction of length 1.
Parsed<Eigen::Vector3d> read_direction(const Json& object, const char* key) {
    const auto numbers = read_array<3>(object, key);
    if (!numbers) return wrong(numbers.error());
    const auto& [x, y, z] = *numbers;
    const double most = std::max({std::abs(x), std::abs(y), std::abs(z)});
    if (!std::isfinite(x + y + z) || !(most > 0.0))
        return wrong(fmt::format("{} must be a direction, got {}", key, shown(object.at(key))));
    // scaled first: the square of a small number may be 0
    return Eigen::Vector3d((Eigen::Vector3d(x, y, z) / most).normalized());
}

Parsed<Eigen::Vector3d> read_forward(const Json& object, const WorldPos& eye_world) {
    if (object.contains("look") == object.contains("forward"))
        return wrong(object.contains("look") ? "look and forward exclude each other"
                                             : "look is missing, and forward too");
    if (object.contains("forward")) return read_direction(object, "forward");
    const Parsed<WorldPos> look = read_point(object, "look");
    if (!look) return wrong(look.error());
    const Eigen::Vector3d way = *look - eye_world;
    if (way == Eigen::Vector3d::Zero()) return wrong("eye and look must be apart");
    return Eigen::Vector3d(way.normalized());
}

/// Turns the view about `forward` until a direction is up in the picture.
Parsed<void> turn_up(const Eigen::Vector3d& up, View& view) {
    const Eigen::Vector3d right = view.forward.cross(up);
    if (!(right.norm() > kLeastSine)) return wrong("up must not be along the line of sight");
    view.up = right.normalized().cross(view.forward);
    return {};
}

Parsed<std::array<int, 2>> read_size(const Json& object) {
    const auto size = read_array<2>(object, "size");
    if (!size) return wrong(size.error());
    std::array<int, 2> pixels{};
    for (std::size_t i = 0; i < 2; ++i) {
        const double side = (*size)[i];
        if (!(side >= 1.0 && side <= kMostSide_px) || side != std::floor(side)) {
            return wrong(fmt::format("size must be two whole numbers from 1 to 1e6, got {}",
                                     shown(object.at("size"))));
        }
        pixels[i] = static_cast<int>(side);
    }
    return pixels;
}

}  // namespace

Parsed<PickQuestion> read_pick(const Json& object) {
    if (object.contains("other")) return wrong("pick is asked of the scene, not of other");
    const Parsed<WorldPos> eye = read_point(object, "eye");
    if (!eye) return wrong(eye.error());
    const Parsed<Eigen::Vector3d> forward = read_forward(object, *eye);
    if (!forward) return wrong(forward.error());
    const Parsed<double> fov_deg = read_number_or(object, "fov_deg", kUsualFov_deg);
    if (!fov_deg) return wrong(fov_deg.error());
    if (!(*fov_deg >= kLeastFov_deg && *fov_deg <= kMostFov_deg))
        return wrong(fmt::format("fov_deg must be 0.1 to 179, got {:.6g}", *fov_deg));
    const Parsed<std::array<int, 2>> size = read_size(object);
    if (!size) return wrong(size.error());
    const auto pixel = read_array<2>(object, "pixel");
    if (!pixel) return wrong(pixel.error());
    const auto [x_px, y_px] = *pixel;
    const auto [width, height] = *size;
    if (!(x_px >= 0.0 && x_px <= width && y_px >= 0.0 && y_px <= height)) {
        return wrong(fmt::format("pixel must be within the picture of {} x {}, got {}", width,
                                 height, shown(object.at("pixel"))));
    }
    const Parsed<double> far_distance = read_number_or(object, "far_m", kUsualFar);
    if (!far_distance) return wrong(far_distance.error());
    if (!(*far_distance > 0.0 && *far_distance <= kMostFar))
        return wrong(fmt::format("far_m must be above 0, at most 1e9, got {:.6g}", *far_distance));

    // from the origin: a direction loses nothing by the eye's coordinates
    Result<View> view =
        look_at(WorldPos::Zero(), *forward, *fov_deg * std::numbers::pi / 180.0, width, height);
    if (!view) return wrong(view.error().message);
    view->eye_world = *eye;
    if (object.contains("up")) {
        const Parsed<Eigen::Vector3d> up = read_direction(object, "up");
        if (!up) return wrong(up.error());
        if (auto ok = turn_up(*up, *view); !ok) return wrong(ok.error());
    }
    return PickQuestion{.view = *view, .x_px = x_px, .y_px = y_px, .far_distance = *far_distance};
}

}  // namespace terrane::tools
