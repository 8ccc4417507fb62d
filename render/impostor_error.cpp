// SPDX-License-Identifier: MIT
#include <terrane/render/impostor_error.h>
#include <terrane/scene/bounds.h>
#include <terrane/terrain/number_text.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace terrane {
namespace {

constexpr double kFieldOfView = 0.7;
constexpr int kSides = 8;
// No multiple of the angle between two views.
constexpr double kTurn = 0.77;
constexpr int kVisibleLevels = 8;

struct PixelSums {
    double difference = 0.0;
    std::size_t covered = 0, different = 0;
};

// Adds the pixels where either picture differs from the one without the object.
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

}  // namespace

Result<ImpostorError> measure_impostor(TerrainRenderer& renderer, const TriangleMesh& mesh,
                                       MeshId mesh_id, ImpostorId impostor, bool has_ring,
                                       std::span<const double> diameters_px, double most_mean) {
    const Aabb box = bounding_box(mesh.positions);
    const Eigen::Vector3d centre = 0.5 * (box.low + box.high);
    double radius = 0.0;
    for (const Eigen::Vector3d& p : mesh.positions) radius = std::max(radius, (p - centre).norm());
    if (!(radius > 0.0))
        return fail(ErrorCode::invalid_argument, "an impostor is measured of a mesh with extent");
    const Image before = renderer.read();
    const int side = std::min(before.width, before.height);

    ImpostorError error;
    bool is_accepted = true;
    std::vector<double> sorted(diameters_px.begin(), diameters_px.end());
    std::sort(sorted.begin(), sorted.end());
    for (const double diameter : sorted) {
        if (!(diameter > 0.0 && diameter <= side)) {
            return fail(ErrorCode::invalid_argument, "a diameter must be above 0 and at most " +
                                                         number_text(side) + " px, got " +
                                                         number_text(diameter));
        }
        const double pixels = 0.5 * before.height / std::tan(0.5 * kFieldOfView);
        const double distance = 2.0 * radius * pixels / diameter;
        PixelSums sums;
        const std::vector<double> elevations =
            has_ring ? std::vector<double>{0.0} : std::vector<double>{0.0, 0.6, 1.3};
        for (const double elevation : elevations) {
            for (int i = 0; i < kSides; ++i) {
                const double azimuth = kTurn * i;
                const double level = std::cos(elevation);
                const Eigen::Vector3d back(level * std::cos(azimuth), level * std::sin(azimuth),
                                           std::sin(elevation));
                const Result<View> view = look_at(centre + distance * back, centre, kFieldOfView,
                                                  before.width, before.height);
                if (!view) return tl::unexpected(view.error());
                ObjectInstance instance;
                const LocalVec offset = to_local(WorldPos::Zero(), view->eye_world);
                instance.offset_eye = {offset.x(), offset.y(), offset.z()};
                const MeshDraw solid = {mesh_id, 0, 0, 1};
                const ImpostorDraw flat = {impostor, 0, 1};
                std::vector<Image> images;
                for (const SceneDraws& draws :
                     {SceneDraws{}, SceneDraws{.instances = {&instance, 1}, .meshes = {&solid, 1}},
                      SceneDraws{.instances = {&instance, 1}, .impostors = {&flat, 1}}}) {
                    if (const Result<void> drawn = renderer.draw({}, *view, {}, draws); !drawn)
                        return tl::unexpected(drawn.error());
                    images.push_back(renderer.read());
                }
                add_pixels(images[1], images[2], images[0], sums);
            }
        }
        const auto covered = static_cast<double>(std::max<std::size_t>(sums.covered, 1));
        const double mean = sums.difference / covered;
        error.sizes.push_back({diameter, mean, static_cast<double>(sums.different) / covered});
        is_accepted = is_accepted && mean <= most_mean;
        if (is_accepted) error.takeover_px = diameter;
    }
    error.error_m = error.takeover_px > 0.0 ? 2.0 * radius / error.takeover_px
                                            : std::numeric_limits<double>::infinity();
    return error;
}

}  // namespace terrane
