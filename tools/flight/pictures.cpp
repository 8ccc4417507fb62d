// SPDX-License-Identifier: MIT
#include "flight/pictures.h"

#include "frames/flight_log.h"
#include "program/progress.h"

#include <terrane/base/text.h>
#include <terrane/collision/shape_pairs.h>
#include <terrane/dem/georeference.h>
#include <terrane/render/sun_position.h>

#include <Eigen/Geometry>

#include <chrono>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <variant>
#include <vector>

namespace terrane::tools {
namespace {

constexpr float kAsleep = 0.55f;  // brightness of sleeping bodies
constexpr double kBar = 0.08;     // radius of a hull's edges, relative to its bounding radius
constexpr Colour kStatic{0.60f, 0.59f, 0.57f};

/// Appends the solids of a shape, in a given colour or the shape's default, with the brightness multiplied by `share`.
class BodyObjects {
public:
    BodyObjects(const std::optional<Colour>& colour, float share, std::vector<DrawnObject>& objects)
        : colour_(colour), share_(share), out_(objects) {}

    void add(const Sphere& sphere, const Pose& pose) {
        out_.push_back({Form::ellipsoid, pose, Eigen::Vector3d::Constant(sphere.radius),
                        shade({0.90f, 0.45f, 0.10f})});
    }
    void add(const Capsule& capsule, const Pose& pose) {
        const Colour colour = shade({0.15f, 0.45f, 0.85f});
        out_.push_back(
            {Form::cylinder, pose, {capsule.radius, capsule.radius, capsule.half_height}, colour});
        for (const double end : {-capsule.half_height, capsule.half_height}) {
            out_.push_back({Form::ellipsoid,
                            {pose.rotation, pose * Eigen::Vector3d(0.0, 0.0, end)},
                            Eigen::Vector3d::Constant(capsule.radius),
                            colour});
        }
    }
    void add(const Box& box, const Pose& pose) {
        out_.push_back({Form::box, pose, box.half_extents, shade({0.93f, 0.90f, 0.82f})});
    }
    /// Adds the edges as tubes.
    void add(const ConvexHull& hull, const Pose& pose) {
        const std::span<const Eigen::Vector3d> corners = hull.vertices();
        const double thickness = kBar * bounding_radius(hull);
        for (std::size_t i = 0; i < corners.size(); ++i) {
            for (std::size_t j = i + 1; j < corners.size(); ++j) {
                if (is_edge(hull, corners[i], corners[j])) {
                    add_bar(pose * corners[i], pose * corners[j], thickness);
                }
            }
        }
    }
    void add(const Compound& compound, const Pose& pose) {
        for (const CompoundPart& part : compound.parts()) {
            const Pose& own = part.body_from_part;
            const Pose world{pose.rotation * own.rotation, pose * own.translation};
            std::visit([&](const auto& shape) { add(shape, world); }, part.shape);
        }
    }

private:
    using Form = DrawnObject::Form;

    Colour shade(const Colour& of_shape) const {
        const Colour colour = colour_.value_or(of_shape);
        return {share_ * colour.red, share_ * colour.green, share_ * colour.blue};
    }

    /// Whether the segment between two corners is on the surface: tests its midpoint.
    static bool is_edge(const ConvexHull& hull, const Eigen::Vector3d& a,
                        const Eigen::Vector3d& b) {
        constexpr double kOnSurface = 1e-6;  // relative to the hull's bounding radius
        const Pose middle{Eigen::Matrix3d::Identity(), 0.5 * (a + b)};
        return signed_distance(Sphere{0.0}, middle, hull, {}).distance >
               -kOnSurface * bounding_radius(hull);
    }

    void add_bar(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius) {
        const Eigen::Vector3d along = (b - a).normalized();
        const Eigen::Vector3d side = along.unitOrthogonal();
        Pose pose;
        pose.rotation << side, along.cross(side), along;
        pose.translation = 0.5 * (a + b);
        const Colour colour = shade({0.55f, 0.50f, 0.47f});
        out_.push_back({Form::cylinder, pose, {radius, radius, 0.5 * (b - a).norm()}, colour});
        out_.push_back({Form::ellipsoid,
                        {Eigen::Matrix3d::Identity(), a},
                        Eigen::Vector3d::Constant(radius),
                        colour});
    }

    std::optional<Colour> colour_;
    float share_;
    std::vector<DrawnObject>& out_;
};

}  // namespace

void add_objects(const Shape& shape, const BodyState& state, std::vector<DrawnObject>& objects) {
    const std::optional<Colour> colour =
        state.condition == BodyCondition::fixed ? std::optional(kStatic) : std::nullopt;
    BodyObjects all(colour, state.condition == BodyCondition::asleep ? kAsleep : 1.0f, objects);
    std::visit([&](const auto& each) { all.add(each, state.pose); }, shape);
}

void add_objects(const Shape& shape, const Pose& pose, const Colour& colour,
                 std::vector<DrawnObject>& objects) {
    BodyObjects all(colour, 1.0f, objects);
    std::visit([&](const auto& each) { all.add(each, pose); }, shape);
}

namespace {

constexpr Colour kChassis{0.78f, 0.22f, 0.12f};
constexpr Colour kTrackedChassis{0.42f, 0.46f, 0.30f};
constexpr Colour kBodywork{0.85f, 0.80f, 0.72f};
constexpr Colour kTyre{0.15f, 0.15f, 0.15f};
constexpr Colour kSpokes{0.55f, 0.55f, 0.56f};
constexpr double kBeltWidth = 0.18;  // half width, metres
constexpr double kBeltHalf = 0.03;   // half thickness, metres

/// Adds a wheel: its collision sphere, and a bar through the sphere that shows the wheel's spin.
void add_wheel(const Eigen::Matrix3d& world_from_body, const WheelState& wheel, double radius,
               std::vector<DrawnObject>& objects) {
    Eigen::Matrix3d steered, spun;
    steered << std::cos(wheel.steer), -std::sin(wheel.steer), 0.0,  //
        std::sin(wheel.steer), std::cos(wheel.steer), 0.0,          //
        0.0, 0.0, 1.0;
    spun << std::cos(wheel.spin), 0.0, std::sin(wheel.spin),  //
        0.0, 1.0, 0.0,                                        //
        -std::sin(wheel.spin), 0.0, std::cos(wheel.spin);
    const Pose pose{world_from_body * steered * spun, wheel.centre_world};
    objects.push_back(
        {DrawnObject::Form::ellipsoid, pose, Eigen::Vector3d::Constant(radius), kTyre});
    objects.push_back({DrawnObject::Form::box, pose,
                       Eigen::Vector3d(0.5 * radius, 0.9 * radius, 0.12 * radius), kSpokes});
}

/// Adds a piece of belt between two wheels, above or below them.
void add_belt(const Pose& chassis, const WheelState& front, const WheelState& rear, double offset,
              std::vector<DrawnObject>& objects) {
    const Eigen::Vector3d left = chassis.rotation.col(1);
    const Eigen::Vector3d from = rear.centre_world + offset * chassis.rotation.col(2);
    const Eigen::Vector3d to = front.centre_world + offset * chassis.rotation.col(2);
    const Eigen::Vector3d along = (to - from).normalized();
    Pose pose;
    pose.rotation << along, left, along.cross(left);
    pose.translation = 0.5 * (from + to);
    objects.push_back({DrawnObject::Form::box, pose,
                       Eigen::Vector3d(0.5 * (to - from).norm() + kBeltHalf, kBeltWidth, kBeltHalf),
                       kTyre});
}

}  // namespace

void add_vehicle_objects(const VehicleSettings& settings, const VehicleState& state,
                         std::vector<DrawnObject>& objects) {
    const Pose& chassis = state.chassis.pose;
    objects.push_back({DrawnObject::Form::box, chassis, settings.chassis_half_extents,
                       settings.is_tracked ? kTrackedChassis : kChassis});
    for (const CompoundPart& part : settings.bodywork) {
        const Pose& own = part.body_from_part;
        const Pose world{chassis.rotation * own.rotation, chassis * own.translation};
        std::visit([&](const auto& shape) { add_objects(shape, world, kBodywork, objects); },
                   part.shape);
    }
    for (const WheelState& wheel : state.wheels) {
        add_wheel(chassis.rotation, wheel, settings.wheel_radius, objects);
    }
    if (!settings.is_tracked) return;
    const double offset = settings.wheel_radius - kBeltHalf;
    for (std::size_t i = 0; i + 2 < state.wheels.size(); ++i) {  // left and right wheels alternate
        add_belt(chassis, state.wheels[i], state.wheels[i + 2], offset, objects);
        add_belt(chassis, state.wheels[i], state.wheels[i + 2], -offset, objects);
    }
}

namespace {

constexpr double kSunRadius = 0.00465;  // angular, radians
constexpr double kLeastRelief =
    1500.0;  // least height difference of lowest and highest tint, metres

// Fits the tint range to the 2nd to 98th percentile of the heights.
void fit_tints(const Terrain& terrain, RendererSettings& settings) {
    constexpr int kProbes = 48;
    const HeightSource& source = *terrain.source;
    const WorldRect extent = work_region(terrain);
    std::vector<double> heights;
    for (int i = 0; i < kProbes * kProbes; ++i) {
        const int column = i % kProbes, row = i / kProbes;
        const double x = extent.west + (extent.east - extent.west) * (column + 0.5) / kProbes;
        const double y = extent.south + (extent.north - extent.south) * (row + 0.5) / kProbes;
        const double height = source.height(x, y);
        if (std::isfinite(height)) heights.push_back(height);
    }
    settings.tint_low = percentile(heights, 0.02);
    // no snow tint on low hills
    settings.tint_high = std::max(percentile(heights, 0.98), settings.tint_low + kLeastRelief);
}

// Direction to the sun that the options ask for; the renderer's default without one. Fails as georeference_of(), and
// with invalid_argument for a place without longitude.
Result<Eigen::Vector3d> sun_of(const FlightOptions& options, const Terrain& terrain) {
    if (options.sun_deg) {
        const double degree = std::numbers::pi / 180.0;
        return direction_to_sun({options.sun_deg->x() * degree, options.sun_deg->y() * degree});
    }
    const std::optional<double> time = parse_time(options.sun_time);
    if (!time) return RendererSettings().sun_direction;
    const Result<Georeference> georeference = georeference_of(terrain);
    if (!georeference) {
        return fail(ErrorCode::invalid_argument,
                    "--sun-time needs a raster with a CRS: " + georeference.error().message);
    }
    const WorldVec2 place = start_of(terrain);
    const Eigen::Vector3d lonlat = georeference->lonlat_from_world({place.x(), place.y(), 0.0});
    const double convergence = georeference->scale_at(place.x(), place.y()).convergence;
    if (!std::isfinite(lonlat.x()) || !std::isfinite(lonlat.y()) || !std::isfinite(convergence)) {
        return fail(ErrorCode::invalid_argument, "--sun-time: the place at " +
                                                     number_text(place.x()) + ", " +
                                                     number_text(place.y()) + " has no longitude");
    }
    return direction_to_sun(sun_position(*time, lonlat.x(), lonlat.y()), convergence);
}

}  // namespace

FlightPictures::FlightPictures(EglContext context, TerrainRenderer renderer, double fps)
    : context_(std::move(context)), renderer_(std::move(renderer)), fps_(fps) {}

Result<FlightPictures> FlightPictures::create(const FlightOptions& options, const Terrain& terrain,
                                              const std::shared_ptr<OutputFolder>& folder) {
    TERRANE_TRY(EglContext context, EglContext::create());
    RendererSettings settings;
    fit_tints(terrain, settings);
    settings.sample_count = options.samples > 0     ? static_cast<int>(options.samples)
                            : context.is_software() ? 1
                                                    : settings.sample_count;
    settings.shadow_distance = options.shadows;
    TERRANE_TRY(settings.sun_direction, sun_of(options, terrain));
    if (options.look == Look::full) {
        settings.atmosphere = true;
        settings.smooth_edges = true;
        settings.sun_radius = kSunRadius;
    }
    settings.water_level = std::isnan(options.water_m) ? terrain.water_m : options.water_m;
    settings.has_waves = options.look == Look::full;
    if (options.has_materials()) {
        const GroundPalette usual =
            terrain.imagery == nullptr ? GroundPalette::alpine : GroundPalette::imagery;
        settings.ground_look = {.palette = options.ground.value_or(usual),
                                .snow_line = given(options.snow_line)};
    }
    settings.imagery = terrain.imagery;
    settings.imagery_waits = !options.waits_for_clock();  // films need not keep real time
    TERRANE_TRY(
        TerrainRenderer renderer,
        TerrainRenderer::create(context, options.size.width_px, options.size.height_px, settings));
    FlightPictures pictures(std::move(context), std::move(renderer), options.fps);
    if (options.png) pictures.picture_folder_ = folder;
    if (options.video) {
        TERRANE_TRY(Film film, Film::create(OutputPlace(folder, kFilmName), options.size.width_px,
                                            options.size.height_px, options.fps));
        pictures.film_.emplace(std::move(film));
    }
    if (options.window) {
        TERRANE_TRY(Window window,
                    Window::create("terrane", options.size.width_px, options.size.height_px));
        pictures.window_.emplace(std::move(window));
        pictures.context_.make_current();
    }
    return pictures;
}

Result<double> FlightPictures::add(std::size_t frame, const MadeFrame& made, const View& view,
                                   std::span<const DrawnObject> objects) {
    const auto start = std::chrono::steady_clock::now();
    TERRANE_TRY(renderer_.set_time(static_cast<double>(frame) / fps_));
    TERRANE_TRY(renderer_.draw(made.mesh, view, objects, made.draws));
    const Image image = renderer_.read();
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - start;
    if (window_) {
        window_->show(image);
        context_.make_current();
    }
    if (picture_folder_ != nullptr) {
        const std::string name = frame_name(frame);
        const std::string path = picture_folder_->path_of(name);
        const RemovedIfKilled part(path + ".part");  // the name that write_png() uses
        TERRANE_TRY(write_png(image, path));
        TERRANE_TRY(picture_folder_->record(path, name));
    }
    if (film_) {
        TERRANE_TRY(film_->add(image));
    }
    return taken.count();
}

Result<void> FlightPictures::finish() { return film_ ? film_->finish() : Result<void>{}; }

}  // namespace terrane::tools
