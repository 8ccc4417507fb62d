// SPDX-License-Identifier: MIT
#include <terrane/base/text.h>
#include <terrane/render/terrain_renderer.h>
#include <terrane/scene/culling.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace terrane {
namespace {

constexpr double kFieldOfView = 0.7;
constexpr int kSides = 8;
// Azimuth between successive sides, radians: not a multiple of the angle between two views.
constexpr double kTurn = 0.77;
constexpr int kVisibleLevels = 8;

struct PixelSums {
    double difference = 0.0;
    std::size_t covered = 0, different = 0;

    double mean() const {
        return difference / static_cast<double>(std::max<std::size_t>(covered, 1));
    }
    double share() const {
        return static_cast<double>(different) /
               static_cast<double>(std::max<std::size_t>(covered, 1));
    }
};

// Adds the differences of two pictures over the pixels at which either of them differs from the picture `empty`.
void add_pixels(const Image& a, const Image& b, const Image& empty, PixelSums& sums) {
    for (std::size_t i = 0; i < a.rgb.size(); i += 3) {
        int apart = 0;
        bool is_covered = false;
        for (std::size_t k = i; k < i + 3; ++k) {
            apart = std::max(apart, std::abs(int{a.rgb[k]} - int{b.rgb[k]}));
            is_covered = is_covered || a.rgb[k] != empty.rgb[k] || b.rgb[k] != empty.rgb[k];
        }
        if (!is_covered) continue;
        ++sums.covered;
        sums.difference += apart;
        sums.different += apart > kVisibleLevels ? 1 : 0;
    }
}

// An object to compare with its impostor.
struct Pair {
    MeshId mesh{};
    ImpostorId impostor{};
};

// Adds a view's differences: of the mesh to its impostor, and of the mesh to itself displaced by `shift_world`.
Result<void> add_view(TerrainRenderer& renderer, const View& view, const Pair& pair,
                      const Eigen::Vector3d& shift_world, PixelSums& of_impostor,
                      PixelSums& of_shift) {
    std::array<ObjectInstance, 2> instances;
    for (std::size_t i = 0; i < 2; ++i) {
        const Eigen::Vector3d place = static_cast<double>(i) * shift_world;
        const LocalVec offset = to_local(place, view.eye_world);
        instances[i].offset_eye = {offset.x(), offset.y(), offset.z()};
    }
    const MeshDraw mesh = {pair.mesh, 0, 0, 1}, shifted = {pair.mesh, 0, 1, 1};
    const ImpostorDraw impostor = {pair.impostor, 0, 1};
    const std::array<SceneDraws, 4> draws = {
        SceneDraws{}, SceneDraws{.instances = instances, .meshes = {&mesh, 1}},
        SceneDraws{.instances = instances, .impostors = {&impostor, 1}},
        SceneDraws{.instances = instances, .meshes = {&shifted, 1}}};
    std::array<Image, 4> images;
    for (std::size_t i = 0; i < draws.size(); ++i) {
        TERRANE_TRY(renderer.draw({}, view, draws[i]));
        images[i] = renderer.read();
    }
    add_pixels(images[1], images[2], images[0], of_impostor);
    add_pixels(images[1], images[3], images[0], of_shift);
    return {};
}

}  // namespace

Result<ImpostorError> measure_impostor(TerrainRenderer& renderer, const TriangleMesh& mesh,
                                       MeshId mesh_id, ImpostorId impostor, bool has_ring,
                                       std::span<const double> diameters_px, double accepted_px) {
    const Aabb box = bounding_box(mesh.positions);
    const Eigen::Vector3d centre = 0.5 * (box.low + box.high);
    double radius = 0.0;
    for (const Eigen::Vector3d& p : mesh.positions) radius = std::max(radius, (p - centre).norm());
    if (!(radius > 0.0))
        return fail(ErrorCode::invalid_argument, "an impostor is measured of a mesh with extent");
    if (!(accepted_px > 0.0)) {
        return fail(ErrorCode::invalid_argument,
                    "accepted_px must be > 0, got " + number_text(accepted_px));
    }
    const Image last = renderer.read();
    const int side = std::min(last.width, last.height);
    const double pixels_per_radian = 0.5 * last.height / std::tan(0.5 * kFieldOfView);
    std::vector<double> elevations{0.0};
    if (!has_ring) elevations.insert(elevations.end(), {0.6, 1.3});

    ImpostorError error;
    bool is_accepted = true;
    std::vector<double> sorted(diameters_px.begin(), diameters_px.end());
    for (const double diameter : sorted) {
        if (diameter > 0.0 && diameter <= side) continue;
        return fail(ErrorCode::invalid_argument, "a diameter must be above 0 and at most " +
                                                     number_text(side) + " px, got " +
                                                     number_text(diameter));
    }
    std::sort(sorted.begin(), sorted.end());
    for (const double diameter : sorted) {
        const double distance = 2.0 * radius * pixels_per_radian / diameter;
        PixelSums of_impostor, of_shift;
        for (const double elevation : elevations) {
            for (int i = 0; i < kSides; ++i) {
                const double azimuth = kTurn * i, level = std::cos(elevation);
                const Eigen::Vector3d back(level * std::cos(azimuth), level * std::sin(azimuth),
                                           std::sin(elevation));
                TERRANE_TRY(const View view, look_at(centre + distance * back, centre, kFieldOfView,
                                                     last.width, last.height));
                const double pixel = distance / pixels_per_radian;
                const Eigen::Vector3d shift = (view.right() + view.up) * (pixel / std::sqrt(2.0));
                TERRANE_TRY(
                    add_view(renderer, view, {mesh_id, impostor}, shift, of_impostor, of_shift));
            }
        }
        const double displacement = of_shift.mean() > 0.0 ? of_impostor.mean() / of_shift.mean()
                                                          : std::numeric_limits<double>::infinity();
        error.sizes.push_back({diameter, of_impostor.mean(), of_impostor.share(), displacement});
        is_accepted = is_accepted && displacement <= accepted_px;
        if (is_accepted) error.takeover_px = diameter;
    }
    error.error_m = error.takeover_px > 0.0 ? 2.0 * radius * accepted_px / error.takeover_px
                                            : std::numeric_limits<double>::infinity();
    return error;
}

}  // namespace terrane
