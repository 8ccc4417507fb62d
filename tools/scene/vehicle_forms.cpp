// SPDX-License-Identifier: MIT
#include "scene/vehicle_forms.h"

#include "scene/form_builder.h"
#include "scene/running_gear.h"

#include <terrane/collision/world.h>
#include <terrane/terrain/crease_normals.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <variant>

namespace terrane::tools {
namespace {

using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr FormColour kRed{0.62, 0.13, 0.09};
constexpr FormColour kSand{0.66, 0.58, 0.42};
constexpr FormColour kCream{0.86, 0.83, 0.75};
constexpr FormColour kGlass{0.06, 0.08, 0.10};
constexpr FormColour kWood{0.48, 0.36, 0.23};
constexpr FormColour kWhite{0.95, 0.94, 0.90};
constexpr FormColour kRedLens{0.70, 0.08, 0.06};
constexpr FormColour kAmber{0.92, 0.50, 0.10};

/// Adds a disc about an axis, from its place on: lens, bolt, cap.
void add_disc(FormBuilder& builder, const Vector3d& place, const Vector3d& axis, double radius,
              double height, int segments) {
    builder.set_frame(along_axis(place, axis));
    const std::array profile{RingPoint{0.0, -height}, RingPoint{radius, -height},
                             RingPoint{radius, 0.7 * height}, RingPoint{0.8 * radius, height},
                             RingPoint{0.0, height}};
    builder.add_turned(profile, segments);
    builder.set_frame({});
}

/// Adds a pipe from a place on, closed behind and hollow in front.
void add_pipe(FormBuilder& builder, const Vector3d& from, const Vector3d& to, double radius,
              int segments) {
    const double length = (to - from).norm(), inner = 0.75 * radius;
    builder.set_frame(along_axis(from, to - from));
    const std::array profile{
        RingPoint{0.0, 0.0},      RingPoint{radius, 0.0},         RingPoint{radius, length},
        RingPoint{inner, length}, RingPoint{inner, 0.5 * length}, RingPoint{0.0, 0.5 * length}};
    builder.add_turned(profile, segments);
    builder.set_frame({});
}

/// Adds horizontal bars between two corners of a vertical rectangle that faces +x.
void add_bars(FormBuilder& builder, const Vector3d& low, const Vector3d& high, int count,
              double depth) {
    const double pitch = (high.z() - low.z()) / count;
    for (int k = 0; k < count; ++k) {
        const double z = low.z() + (k + 0.3) * pitch;
        builder.add_box({low.x() - depth, low.y(), z},
                        {low.x() + depth, high.y(), z + 0.4 * pitch});
    }
}

/// Builds the body of a vehicle.
class BodyMaker {
public:
    BodyMaker(const VehicleSettings& settings, const VehicleLayout& layout, VehicleForm& form)
        : settings_(settings), layout_(layout), form_(form), h_(settings.chassis_half_extents) {
        for (std::size_t i = 0; i < settings_.bodywork.size(); ++i) {
            const CompoundPart& part = settings_.bodywork[i];
            if (!std::holds_alternative<Box>(part.shape)) continue;
            if (!cab_ || front_of(part) > front_of(settings_.bodywork[*cab_])) cab_ = i;
        }
        cab_front_ = h_.x() * 0.25;
        cab_back_ = cab_front_;
        if (cab_) {
            const CompoundPart& part = settings_.bodywork[*cab_];
            const double half = std::get<Box>(part.shape).half_extents.x();
            cab_front_ = std::clamp(part.body_from_part.translation.x() + half, -h_.x(), h_.x());
            cab_back_ = std::clamp(part.body_from_part.translation.x() - half, -h_.x(), h_.x());
        }
        has_hood_ = h_.x() - cab_front_ > 0.15 * h_.x();
        has_bed_ = cab_back_ + h_.x() > 0.3 * h_.x();
        lip_ = 0.12 * std::min(h_.z(), h_.y());
        sill_ = -0.72 * h_.z();
    }

    void make() {
        if (settings_.is_tracked) {
            make_hull();
        } else {
            make_wheeled();
        }
        for (std::size_t i = 0; i < settings_.bodywork.size(); ++i) {
            const CompoundPart& part = settings_.bodywork[i];
            builder_.set_frame(part.body_from_part);
            if (cab_ == i) {
                add_cab(std::get<Box>(part.shape).half_extents, part.body_from_part);
            } else {
                std::visit([&](const auto& shape) { add_cargo(shape, part.body_from_part); },
                           part.shape);
            }
        }
        builder_.set_frame({});
        add_exhaust();
        const double low = -h_.z(), span = 2.0 * h_.z();
        const FormColour dust{0.50, 0.44, 0.35};
        form_.body = builder_.finish([&](const Vector3d& p, const Eigen::Vector3f& normal) {
            const double height = std::clamp((p.z() - low) / span, 0.0, 1.0);
            // darker from below, where less of the sky is seen
            const double shade = 1.0 - 0.45 * std::max(0.0f, -normal.z()) - 0.12 * (1.0 - height);
            FormColour tone{};
            for (std::size_t k = 0; k < 3; ++k)
                tone[k] = shade * (1.0 + 0.35 * (1.0 - height) * (1.0 - height) * (dust[k] - 0.4));
            return tone;
        });
    }

private:
    static double front_of(const CompoundPart& part) {
        return part.body_from_part.translation.x() + std::get<Box>(part.shape).half_extents.x();
    }

    FormColour paint() const { return settings_.is_tracked ? kOlive : has_hood_ ? kRed : kSand; }

    // ---- Wheeled vehicles ----

    /// The opening over a wheel: a flattened arch.
    struct Arch {
        double x = 0.0, half = 0.0, top = 0.0;
    };

    void find_arches() {
        const double r = settings_.wheel_radius, b = 0.5 * layout_.wheel_width;
        inner_ = 0.8 * h_.y();
        for (const AxleSettings& axle : settings_.axles) {
            if (axle.track <= 0.0) continue;
            const double inside = 0.5 * axle.track - b;
            const double wheel_top = layout_.rest + r;
            if (inside >= h_.y() || wheel_top < sill_) continue;
            Arch arch;
            arch.x = axle.position;
            arch.half = 1.15 * r + 0.2 * b;
            arch.top = std::min(wheel_top + 0.6 * layout_.rise + 0.05 * r, 0.55 * h_.z());
            const double swing = std::sin(std::min(std::abs(axle.max_steer), 1.5)) * 0.85 * r;
            inner_ = std::min(inner_, inside - swing - 0.1 * b);
            arches_.push_back(arch);
        }
        inner_ = std::clamp(inner_, 0.3 * h_.y(), 0.8 * h_.y());
    }

    double arch_height(double x) const {
        double height = sill_;
        for (const Arch& arch : arches_) {
            const double t = std::abs(x - arch.x) / arch.half;
            if (t < 1.0)
                height = std::max(height, sill_ + (arch.top - sill_) *
                                                      std::pow(1.0 - std::pow(t, 2.6), 1.0 / 2.6));
        }
        return height;
    }

    /// Positions along x between which the lower edge is nearly straight.
    std::vector<double> stations(double from, double to) const {
        std::vector<double> xs{from, to};
        const bool is_fine = arches_.size() <= 4;
        for (const Arch& arch : arches_) {
            for (const double t : {0.0, 0.35, 0.62, 0.82, 0.94, 0.99, 1.0}) {
                if (!is_fine && t != 0.0 && t != 0.62 && t != 0.94 && t != 1.0) continue;
                for (const double x : {arch.x - t * arch.half, arch.x + t * arch.half}) {
                    if (x > from && x < to) xs.push_back(x);
                }
            }
        }
        for (const double share : {0.78, 0.9}) {
            const double x = share * h_.x();
            if (x > from && x < to) xs.push_back(x);
            if (-x > from && -x < to) xs.push_back(-x);
        }
        std::sort(xs.begin(), xs.end());
        const double least = 1e-4 * h_.x();
        std::vector<double> kept{from};
        for (const double x : xs) {
            if (x - kept.back() > least && to - x > least) kept.push_back(x);
        }
        kept.push_back(to);
        return kept;
    }

    /// Half width of the body: it is narrower at nose and tail.
    double half_width(double x) const {
        const double nose = std::clamp((x / h_.x() - 0.78) / 0.22, 0.0, 1.0);
        const double tail = std::clamp((-x / h_.x() - 0.9) / 0.1, 0.0, 1.0);
        return h_.y() * (1.0 - 0.07 * nose * nose - 0.03 * tail * tail);
    }

    /// Upper edge of the hood and the sides.
    double top(double x) const {
        if (!has_hood_ || x <= cab_front_) return h_.z();
        const double share = (x - cab_front_) / std::max(h_.x() - cab_front_, 1e-9);
        return h_.z() * (1.0 - 0.22 * share * share);
    }

    /// Adds a piece of both sides over the arches.
    ///
    /// @param is_outer whether its outer side is the vehicle's, which is rounded
    template <class Inner, class Outer, class Top>
    void add_side(double from, double to, const Inner& inner, const Outer& outer, const Top& upper,
                  bool is_outer) {
        if (to - from < 1e-3 * h_.x()) return;
        const std::size_t first = builder_.vertex_count();
        std::vector<Polygon3> sections;
        for (const double x : stations(from, to)) {
            const double y0 = inner(x), y1 = outer(x), z0 = arch_height(x), z1 = upper(x);
            const double r =
                is_outer ? std::min({0.16 * h_.z(), 0.3 * (z1 - z0), 0.5 * (y1 - y0)}) : 0.0;
            const double c = is_outer ? 0.25 * r : 0.0;
            if (is_outer) {
                sections.push_back({{x, y0, z0},
                                    {x, y1 - c, z0},
                                    {x, y1, z0 + c},
                                    {x, y1, z1 - r},
                                    {x, y1 - 0.30 * r, z1 - 0.30 * r},
                                    {x, y1 - r, z1},
                                    {x, y0, z1}});
            } else {
                sections.push_back({{x, y0, z0}, {x, y1, z0}, {x, y1, z1}, {x, y0, z1}});
            }
        }
        builder_.add_loft(sections);
        builder_.mirror_since(first);
    }

    /// Adds the lips of the arches.
    void add_flares() {
        builder_.set_paint(FormMaterial::matt, kBlack);
        const std::size_t first = builder_.vertex_count();
        for (const Arch& arch : arches_) {
            std::vector<Polygon3> sections;
            const double width = 0.16 * settings_.wheel_radius, out = 0.5 * lip_;
            for (const double t :
                 {-1.0, -0.97, -0.86, -0.66, -0.36, 0.0, 0.36, 0.66, 0.86, 0.97, 1.0}) {
                const double x = arch.x + t * arch.half;
                if (std::abs(x) > h_.x()) continue;
                const double z = arch_height(x), y = half_width(x);
                const Eigen::Vector2d away =
                    Eigen::Vector2d(t / arch.half, (z - sill_ + 0.2 * arch.half) /
                                                       ((arch.top - sill_) * (arch.top - sill_)))
                        .normalized();
                const auto at = [&](double w, double dy) {
                    return Vector3d(x + w * width * away.x(), y + dy,
                                    std::min(z + w * width * away.y(), h_.z()));
                };
                sections.push_back({at(-0.15, -out), at(-0.15, out), at(0.15, 1.4 * out),
                                    at(0.8, 0.9 * out), at(1.0, -out)});
            }
            if (sections.size() > 1) builder_.add_loft(sections);
        }
        builder_.mirror_since(first);
    }

    void make_wheeled() {
        find_arches();
        const auto inner = [&](double) { return inner_; };
        const auto outer = [&](double x) { return half_width(x); };
        const auto upper = [&](double x) { return top(x); };
        const double back = has_bed_ ? cab_back_ : -h_.x();
        const double bevel = 0.10 * h_.z();
        builder_.set_paint(FormMaterial::paint, paint());
        add_side(back, h_.x(), inner, outer, upper, true);
        // hood and engine, between the sides
        const double nose = h_.x(), from = has_hood_ ? cab_front_ : nose;
        if (has_hood_) {
            const double low = top(nose);
            builder_.add_solid(
                std::array{
                    half_space({1, 0, 0}, {nose, 0, 0}), half_space({-1, 0, 0}, {from, 0, 0}),
                    half_space({0, 1, 0}, {0, inner_, 0}), half_space({0, -1, 0}, {0, -inner_, 0}),
                    half_space({h_.z() - low, 0, nose - from}, {from, 0, h_.z()}),
                    half_space({0, 0, -1}, {0, 0, sill_})},
                0.35 * bevel);
            // a bulge on the hood
            const double x0 = from + 0.12 * (nose - from), x1 = nose - 0.06 * (nose - from);
            builder_.add_solid(std::array{half_space({1, 0, 0.5}, {x1, 0, top(x1)}),
                                          half_space({-1, 0, 0.5}, {x0, 0, h_.z()}),
                                          half_space({0, 1, 0.4}, {0, 0.6 * inner_, h_.z()}),
                                          half_space({0, -1, 0.4}, {0, -0.6 * inner_, h_.z()}),
                                          half_space({h_.z() - low, 0, nose - from},
                                                     {from, 0, h_.z() + 0.5 * lip_}),
                                          half_space({0, 0, -1}, {0, 0, low - lip_})},
                               0.3 * bevel);
        }
        builder_.add_box({back, -inner_, sill_}, {from, inner_, h_.z()}, 0.35 * bevel);
        if (has_bed_) add_bed();
        add_flares();
        add_frame();
        add_face();
        add_tail();
        add_doors();
    }

    void add_bed() {
        const double rear = -h_.x(), front = cab_back_;
        const double wall = h_.y() - 0.18 * std::min(h_.z(), h_.y());
        const double floor = has_hood_ ? -0.05 * h_.z() : 0.62 * h_.z();
        const auto inner = [&](double) { return inner_; };
        const auto at_wall = [&](double) { return wall; };
        const auto outer = [&](double x) { return half_width(x); };
        const auto upper = [&](double) { return h_.z(); };
        const auto house = [&](double x) {
            const double arch = arch_height(x);
            return std::max(floor, arch > sill_ ? arch + 0.1 * h_.z() : sill_);
        };
        builder_.set_paint(FormMaterial::paint, paint());
        add_side(rear, front, at_wall, outer, upper, true);
        builder_.set_paint(FormMaterial::paint, mixed(paint(), kBlack, 0.35));
        // behind the tailgate's outer face, which it would otherwise share
        add_side(rear + lip_, front, inner, at_wall, house, false);
        builder_.add_box({rear + lip_, -inner_, sill_}, {front, inner_, floor});
        add_wheel_houses(rear + lip_, front, floor, house);
        // tailgate and front wall
        const double thick = 0.16 * h_.z();
        builder_.set_paint(FormMaterial::paint, paint());
        builder_.add_box({rear, -wall, sill_ + 0.3 * (floor - sill_)}, {rear + thick, wall, h_.z()},
                         0.25 * thick);
        builder_.add_box({front - thick, -wall, floor}, {front, wall, h_.z()}, 0.25 * thick);
        // planks over a dark sheet
        builder_.set_paint(FormMaterial::matt, kBlack);
        builder_.add_box({rear + thick, -0.99 * inner_, floor - 0.02 * h_.z()},
                         {front - thick, 0.99 * inner_, floor + 0.01 * h_.z()});
        const int planks = 7;
        for (int k = 0; k < planks; ++k) {
            const double pitch = 2.0 * inner_ / planks, y = -inner_ + (k + 0.04) * pitch;
            const double tint = 0.08 * ((3 * k) % 4) / 3.0;
            builder_.set_paint(FormMaterial::matt, mixed(kWood, kBlack, 0.15 + tint));
            builder_.add_box({rear + thick, y, floor - 0.02 * h_.z()},
                             {front - thick, y + 0.92 * pitch, floor + 0.05 * h_.z()});
        }
        add_spare_wheel(rear, front, floor + 0.05 * h_.z());
    }

    /// Closes the arches towards the bed, up to the middle of the edge above them.
    template <class House>
    void add_wheel_houses(double from, double to, double floor, const House& house) {
        if (to - from < 1e-3 * h_.x()) return;
        const std::size_t first = builder_.vertex_count();
        std::vector<Polygon3> sections;
        for (const double x : stations(from, to)) {
            const double y0 = inner_ + 0.05 * lip_, y1 = inner_ + 0.15 * lip_;
            const double z0 = floor - 0.2 * h_.z(), z1 = house(x) - 0.05 * h_.z();
            sections.push_back({{x, y0, z0}, {x, y1, z0}, {x, y1, z1}, {x, y0, z1}});
        }
        builder_.add_loft(sections);
        builder_.mirror_since(first);
    }

    /// Adds a spare wheel that lies in the bed, and a tool box, if they fit below its edge.
    void add_spare_wheel(double rear, double front, double floor) {
        const double depth = h_.z() - floor, length = front - rear;
        const double r = settings_.wheel_radius, b = 0.5 * layout_.wheel_width;
        if (depth < 0.5 * h_.z()) return;
        const double box = std::min(0.22 * length, 1.2 * h_.z());
        builder_.set_paint(FormMaterial::steel, kIron);
        builder_.add_box({front - 0.2 * h_.z() - box, -0.92 * inner_, floor},
                         {front - 0.2 * h_.z(), 0.92 * inner_, floor + 0.8 * depth}, 0.06 * h_.z());
        if (inner_ < r || 2.0 * b > 0.9 * depth || length < 2.6 * r + box) return;
        const Vector3d place(front - 0.3 * h_.z() - box - 1.05 * r, 0.0, floor + b);
        Pose lying = along_axis(place, Vector3d::UnitZ());
        builder_.set_frame(lying);
        builder_.set_paint(FormMaterial::matt, kRubber);
        const std::array tyre{RingPoint{0.0, -b},
                              RingPoint{0.80 * r, -b},
                              RingPoint{0.92 * r, -0.9 * b},
                              RingPoint{0.97 * r, -0.6 * b},
                              RingPoint{0.97 * r, 0.6 * b},
                              RingPoint{0.92 * r, 0.9 * b},
                              RingPoint{0.74 * r, b},
                              RingPoint{0.56 * r, 0.74 * b}};
        builder_.add_turned(tyre, 20);
        builder_.set_paint(FormMaterial::steel, kIron);
        const std::array rim{RingPoint{0.56 * r, 0.74 * b}, RingPoint{0.48 * r, 0.3 * b},
                             RingPoint{0.3 * r, 0.5 * b}, RingPoint{0.0, 0.5 * b}};
        builder_.add_turned(rim, 20);
        builder_.set_frame({});
    }

    /// Adds the rails below the body, and a guard before the front axle.
    void add_frame() {
        builder_.set_paint(FormMaterial::matt, kFrame);
        const std::size_t first = builder_.vertex_count();
        const double y = 0.55 * inner_;
        builder_.add_box({-0.96 * h_.x(), y, -h_.z()},
                         {0.96 * h_.x(), y + 0.12 * h_.y(), sill_ + 0.05 * h_.z()});
        // steps below the doors
        if (cab_ && cab_front_ - cab_back_ > 0.1 * h_.x()) {
            const double middle = 0.5 * (cab_front_ + cab_back_);
            const double half = 0.45 * (cab_front_ - cab_back_);
            double from = middle - half, to = middle + half;
            for (const Arch& arch : arches_) {
                if (arch.x > middle) to = std::min(to, arch.x - 1.05 * arch.half);
                if (arch.x <= middle) from = std::max(from, arch.x + 1.05 * arch.half);
            }
            if (to - from > 0.05 * h_.x()) {
                builder_.add_box({from, 0.86 * h_.y(), sill_ - 0.16 * h_.z()},
                                 {to, h_.y() + 0.4 * lip_, sill_ - 0.04 * h_.z()}, 0.04 * h_.z());
            }
        }
        builder_.mirror_since(first);
        // tank and cross members
        for (const double x : {-0.85, -0.3, 0.3, 0.85}) {
            builder_.add_box({x * h_.x() - 0.05 * h_.z(), -y, -0.96 * h_.z()},
                             {x * h_.x() + 0.05 * h_.z(), y, -0.8 * h_.z()});
        }
    }

    /// Adds grille, lamps and bumper at the front.
    void add_face() {
        const double x = h_.x(), y = half_width(h_.x()), z = top(x);
        const double s = std::min(h_.z(), h_.y());
        const double grille = 0.52 * y, low = -0.28 * h_.z(),
                     high = std::max(0.62 * z, 0.3 * h_.z());
        builder_.set_paint(FormMaterial::matt, kBlack);
        builder_.add_box({x - 0.1 * s, -grille, low}, {x + 0.02 * s, grille, high}, 0.01 * s);
        builder_.set_paint(FormMaterial::steel, kSteel);
        add_bars(builder_, {x + 0.02 * s, -0.96 * grille, low}, {x + 0.02 * s, 0.96 * grille, high},
                 5, 0.025 * s);
        builder_.add_box({x - 0.1 * s, -1.04 * grille, high},
                         {x + 0.05 * s, 1.04 * grille, high + 0.06 * s}, 0.015 * s);
        const std::size_t first = builder_.vertex_count();
        const double lamp = std::min(0.21 * s, 0.2 * y);
        const Vector3d place(x, 0.76 * y, 0.5 * (low + high) + 0.12 * s);
        add_lamp(place, Vector3d::UnitX(), lamp);
        builder_.set_paint(FormMaterial::indicator, kAmber);
        builder_.add_box({x - 0.05 * s, 0.63 * y, low}, {x + 0.03 * s, 0.90 * y, low + 0.13 * s},
                         0.02 * s);
        // hooks
        builder_.set_paint(FormMaterial::matt, kRed);
        builder_.add_box({x, 0.40 * y, -0.92 * h_.z()}, {x + 1.0 * lip_, 0.46 * y, -0.76 * h_.z()},
                         0.01 * s);
        builder_.mirror_since(first);
        builder_.set_paint(FormMaterial::matt, kFrame);
        builder_.add_box({x - 0.3 * s, -0.99 * h_.y(), -0.74 * h_.z()},
                         {x + lip_, 0.99 * h_.y(), -0.36 * h_.z()}, 0.09 * s);
        builder_.add_solid(std::array{half_space({0, 1, 0}, {0, 0.5 * y, 0}),
                                      half_space({0, -1, 0}, {0, -0.5 * y, 0}),
                                      half_space({0, 0, 1}, {0, 0, -0.6 * h_.z()}),
                                      half_space({0, 0, -1}, {0, 0, -h_.z()}),
                                      half_space({1, 0, -0.6}, {x, 0, -0.7 * h_.z()}),
                                      half_space({-1, 0, 0}, {x - 0.5 * s, 0, 0})},
                           0.03 * s);
        // number plate
        builder_.set_paint(FormMaterial::matt, kWhite);
        const double plate = std::min(0.28 * y, 0.6 * s);
        builder_.add_box({x, -plate, -0.63 * h_.z()},
                         {x + lip_ + 0.02 * s, plate, -0.63 * h_.z() + 0.24 * s}, 0.01 * s);
    }

    void add_lamp(const Vector3d& place, const Vector3d& axis, double radius) {
        const int segments = 14;
        builder_.set_frame(along_axis(place, axis));
        builder_.set_paint(FormMaterial::steel, kSteel);
        const std::array ring{RingPoint{0.0, -0.5 * radius}, RingPoint{radius, -0.5 * radius},
                              RingPoint{radius, 0.12 * radius},
                              RingPoint{0.92 * radius, 0.22 * radius},
                              RingPoint{0.82 * radius, 0.16 * radius}};
        builder_.add_turned(ring, segments);
        builder_.set_paint(FormMaterial::head_lamp, kWhite);
        const std::array lens{RingPoint{0.82 * radius, 0.16 * radius},
                              RingPoint{0.5 * radius, 0.26 * radius},
                              RingPoint{0.0, 0.30 * radius}};
        builder_.add_turned(lens, segments);
        builder_.set_frame({});
    }

    /// Adds lamps, bumper and number plate at the rear.
    void add_tail() {
        const double x = -h_.x(), y = half_width(-h_.x()), s = std::min(h_.z(), h_.y());
        const std::size_t first = builder_.vertex_count();
        const double high = has_hood_ ? 0.7 * h_.z() : 0.3 * h_.z(), low = high - 0.62 * s;
        const double from = 0.86 * y, to = 0.985 * y;
        builder_.set_paint(FormMaterial::tail_lamp, kRedLens);
        builder_.add_box({x - 0.05 * s, from, low + 0.3 * s}, {x + 0.1 * s, to, high}, 0.03 * s);
        builder_.set_paint(FormMaterial::indicator, kAmber);
        builder_.add_box({x - 0.05 * s, from, low + 0.15 * s}, {x + 0.1 * s, to, low + 0.29 * s},
                         0.02 * s);
        builder_.set_paint(FormMaterial::matt, kWhite);
        builder_.add_box({x - 0.05 * s, from, low}, {x + 0.1 * s, to, low + 0.14 * s}, 0.02 * s);
        builder_.mirror_since(first);
        builder_.set_paint(FormMaterial::matt, kFrame);
        builder_.add_box({x - lip_, -0.96 * y, -0.78 * h_.z()},
                         {x + 0.3 * s, 0.96 * y, -0.46 * h_.z()}, 0.07 * s);
        // number plate and handle of the tailgate
        builder_.set_paint(FormMaterial::matt, kWhite);
        const double plate = std::min(0.28 * y, 0.6 * s);
        builder_.add_box({x - lip_ - 0.02 * s, -plate, -0.74 * h_.z()},
                         {x, plate, -0.74 * h_.z() + 0.24 * s}, 0.01 * s);
        builder_.set_paint(FormMaterial::matt, kBlack);
        builder_.add_box({x - 0.05 * s, -0.16 * y, 0.66 * h_.z()}, {x, 0.16 * y, 0.78 * h_.z()},
                         0.03 * s);
    }

    /// Adds seams and handles of the doors.
    void add_doors() {
        if (!cab_ || cab_front_ - cab_back_ < 0.1 * h_.x()) return;
        const std::size_t first = builder_.vertex_count();
        const double length = cab_front_ - cab_back_, seam = 0.012 * h_.z();
        const double front = cab_front_ - 0.04 * length, back = front - 0.62 * length;
        for (const double x : {front, back}) {
            const double z = arch_height(x) + 0.02 * h_.z(), y = half_width(x);
            if (h_.z() * 0.82 - z < 0.2 * h_.z()) continue;
            builder_.set_paint(FormMaterial::matt, kBlack);
            builder_.add_box({x - seam, y - 0.05 * h_.z(), z},
                             {x + seam, y + 0.3 * seam, 0.83 * h_.z()});
        }
        builder_.set_paint(FormMaterial::matt, kBlack);
        const double y = half_width(back), s = h_.z();
        builder_.add_box({back + 0.10 * s, y - 0.02 * s, 0.52 * s},
                         {back + 0.42 * s, y + 0.05 * s, 0.60 * s}, 0.015 * s);
        // a rubbing strip along the doors
        builder_.add_box({back + 0.03 * length, y - 0.02 * s, 0.08 * s},
                         {front - 0.03 * length, y + 0.03 * s, 0.18 * s}, 0.01 * s);
        builder_.mirror_since(first);
    }

    // ---- Cab and bodywork ----

    /// Adds a window in a face of the cab: a black frame and a pane in it.
    void add_window(const Polygon3& opening, double height) {
        if (opening.size() < 3) return;
        Vector3d middle = Vector3d::Zero();
        for (const Vector3d& p : opening) middle += p / static_cast<double>(opening.size());
        Polygon3 pane;
        for (const Vector3d& p : opening) pane.push_back(middle + 0.93 * (p - middle));
        builder_.set_paint(FormMaterial::matt, kBlack);
        builder_.add_plate(opening, 0.5 * height);
        builder_.set_paint(FormMaterial::glass, kGlass);
        builder_.add_plate(pane, height);
    }

    /// Adds a cab in the frame of its box.
    void add_cab(const Vector3d& c, const Pose& body_from_cab) {
        const double height = 2.0 * c.z(), s = std::min(height, c.y());
        const double rake =
            has_hood_ ? std::min(0.62 * height, 0.8 * c.x()) : std::min(0.14 * height, 0.3 * c.x());
        const double lean = std::min(0.13 * height, 0.2 * c.y());
        const double tail = std::min(0.08 * height, 0.1 * c.x());
        const std::array planes{half_space({height, 0, rake}, {c.x(), 0, -c.z()}),
                                half_space({-height, 0, tail}, {-c.x(), 0, -c.z()}),
                                half_space({0, height, lean}, {0, c.y(), -c.z()}),
                                half_space({0, -height, lean}, {0, -c.y(), -c.z()}),
                                half_space({0, 0, 1}, {0, 0, c.z()}),
                                half_space({0, 0, -1}, {0, 0, -c.z()})};
        builder_.set_paint(FormMaterial::paint, paint());
        builder_.add_solid(planes, 0.11 * s);
        // windows: nearly the whole face over a hood, the upper half without one
        const double margin = 0.13 * s, low = has_hood_ ? -0.72 * c.z() : 0.02 * c.z();
        const double glass = 0.02 * s;
        const HalfSpace above = half_space({0, 0, -1}, {0, 0, low});
        add_window(clipped(face_of(planes, 0, margin), above), glass);
        add_window(clipped(face_of(planes, 1, 1.6 * margin), above), glass);
        const double pillar = c.x() - 0.66 * 2.0 * c.x();
        for (const std::size_t side : {2u, 3u}) {
            const Polygon3 face = clipped(face_of(planes, side, margin), above);
            add_window(clipped(face, half_space({-1, 0, 0}, {pillar, 0, 0})), glass);
            add_window(clipped(face, half_space({1, 0, 0}, {pillar - 0.12 * s, 0, 0})), glass);
        }
        // wipers
        const Vector3d up = Vector3d(-rake, 0.0, height).normalized();
        const Vector3d out = planes[0].normal;
        builder_.set_paint(FormMaterial::matt, kBlack);
        for (const double y : {-0.42, 0.18}) {
            Pose wiper = body_from_cab;
            Pose own;
            own.rotation << Vector3d::UnitY(), up, out;
            own.rotation.col(0) = up.cross(out);
            const double share = (low + c.z()) / height;
            own.translation =
                Vector3d(c.x() - share * rake, y * c.y(), low) + 0.05 * s * up + 0.02 * s * out;
            const double angle = 0.32;
            Eigen::Matrix3d turned;
            turned << std::cos(angle), -std::sin(angle), 0.0, std::sin(angle), std::cos(angle), 0.0,
                0.0, 0.0, 1.0;
            wiper.rotation = body_from_cab.rotation * own.rotation * turned;
            wiper.translation = body_from_cab * own.translation;
            builder_.set_frame(wiper);
            builder_.add_box({0.0, -0.012 * s, 0.0}, {0.62 * c.y(), 0.012 * s, 0.025 * s});
        }
        builder_.set_frame(body_from_cab);
        // lamps on the roof's front edge
        const double roof = c.x() - rake;
        builder_.set_paint(FormMaterial::indicator, kAmber);
        for (const double y : {-0.55, -0.12, 0.0, 0.12, 0.55}) {
            builder_.add_box({roof - 0.26 * s, y * c.y() - 0.045 * s, c.z() - 0.02 * s},
                             {roof - 0.16 * s, y * c.y() + 0.045 * s, c.z() + 0.05 * s}, 0.015 * s);
        }
        // roof rails
        builder_.set_paint(FormMaterial::matt, kFrame);
        for (const double side : {-1.0, 1.0}) {
            const double y = side * (c.y() - lean - 0.16 * s);
            builder_.add_box({-c.x() + tail + 0.2 * s, y - 0.02 * s, c.z()},
                             {roof - 0.4 * s, y + 0.02 * s, c.z() + 0.06 * s}, 0.015 * s);
        }
        // mirrors
        for (const double side : {-1.0, 1.0}) {
            const double z = low + 0.18 * s, share = (z + c.z()) / height;
            const double x = c.x() - share * rake - 0.10 * s, y = side * (c.y() - share * lean);
            const double reach = side * 0.10 * s;
            builder_.set_paint(FormMaterial::matt, kBlack);
            builder_.add_box({x - 0.02 * s, std::min(y - reach, y + reach), z - 0.02 * s},
                             {x + 0.02 * s, std::max(y - reach, y + reach), z + 0.02 * s});
            const double mid = y + 0.9 * reach, tall = has_hood_ ? 0.12 * s : 0.2 * s;
            builder_.add_box({x - 0.05 * s, mid - 0.09 * s, z - 0.5 * tall},
                             {x + 0.05 * s, mid + 0.09 * s, z + 1.1 * tall}, 0.03 * s);
            builder_.set_paint(FormMaterial::glass, kSteel);
            builder_.add_box({x - 0.056 * s, mid - 0.07 * s, z - 0.3 * tall},
                             {x - 0.045 * s, mid + 0.07 * s, z + 0.9 * tall});
        }
        if (has_hood_) return;
        // a cab over the engine: grille and steps below its windows
        builder_.set_paint(FormMaterial::matt, kBlack);
        const HalfSpace below = half_space({0, 0, 1}, {0, 0, low - 0.2 * s});
        builder_.add_plate(clipped(face_of(planes, 0, 1.6 * margin), below), 0.02 * s);
        builder_.set_paint(FormMaterial::steel, kSteel);
        for (int k = 0; k < 4; ++k) {
            const double z = -c.z() + 1.8 * margin + k * 0.12 * s, share = (z + c.z()) / height;
            if (z > low - 0.3 * s) break;
            const double x = c.x() - share * rake;
            builder_.add_box({x - 0.03 * s, -0.7 * c.y(), z},
                             {x + 0.035 * s, 0.7 * c.y(), z + 0.04 * s}, 0.01 * s);
        }
        builder_.set_paint(FormMaterial::matt, kBlack);
        for (const double side : {-1.0, 1.0}) {  // handles
            const double share = (low + c.z()) / height,
                         y = side * (c.y() - share * lean + 0.02 * s);
            builder_.add_box({pillar + 0.06 * s, y - 0.03 * s, low - 0.22 * s},
                             {pillar + 0.28 * s, y + 0.03 * s, low - 0.16 * s}, 0.02 * s);
        }
    }

    /// A box of the bodywork: a body with ribs.
    void add_cargo(const Box& box, const Pose&) {
        const Vector3d& e = box.half_extents;
        const double s = e.minCoeff();
        builder_.set_paint(FormMaterial::paint, kCream);
        builder_.add_box(-e, e, 0.06 * s);
        const int ribs = std::clamp(static_cast<int>(std::lround(e.x() / s)) + 2, 2, 10);
        builder_.set_paint(FormMaterial::paint, mixed(kCream, kBlack, 0.2));
        for (int k = 0; k <= ribs; ++k) {
            const double x = -0.94 * e.x() + 1.88 * e.x() * k / ribs;
            for (const double side : {-1.0, 1.0}) {
                const double y = side * e.y();
                builder_.add_box({x - 0.03 * s, y - 0.02 * s, -0.92 * e.z()},
                                 {x + 0.03 * s, y + 0.02 * s, 0.92 * e.z()});
            }
        }
    }
    void add_cargo(const Sphere& sphere, const Pose&) { add_tank(sphere.radius, 0.0); }
    void add_cargo(const Capsule& capsule, const Pose&) {
        add_tank(capsule.radius, capsule.half_height);
    }
    void add_cargo(const ConvexHull& hull, const Pose&) {
        TriangleMesh mesh;
        mesh.positions.assign(hull.vertices().begin(), hull.vertices().end());
        for (std::size_t i = 0; i < hull.face_count(); ++i) {
            const std::span<const std::uint32_t> face = hull.face(i);
            for (std::size_t k = 2; k < face.size(); ++k)
                mesh.triangles.push_back({face[0], face[k - 1], face[k]});
        }
        if (mesh.triangles.empty()) return;
        builder_.set_paint(FormMaterial::paint, kCream);
        builder_.add_mesh(with_crease_normals(mesh, 0.766));
    }

    /// A tank about z with round ends.
    void add_tank(double radius, double half_height) {
        constexpr int kArc = 6;
        std::vector<RingPoint> profile;
        for (const double side : {-1.0, 1.0}) {
            for (int k = 0; k <= kArc; ++k) {
                const double angle = 0.5 * kPi * (side < 0.0 ? k - kArc : k) / kArc;
                const bool is_pole = k == (side < 0.0 ? 0 : kArc);
                profile.push_back({is_pole ? 0.0 : radius * std::cos(angle),
                                   side * half_height + radius * std::sin(angle)});
            }
            if (half_height <= 0.0 && side < 0.0) profile.pop_back();
        }
        builder_.set_paint(FormMaterial::steel, kSteel);
        builder_.add_turned(profile, 24);
    }

    // ---- Tracked vehicles ----

    void make_hull() {
        const double s = std::min(h_.z(), h_.y());
        const double belt_top =
            layout_.link_count == 0
                ? -0.2 * h_.z()
                : std::max(layout_.rest + settings_.wheel_radius + 0.5 * layout_.rise,
                           layout_.front_sprocket.y() + layout_.sprocket_radius +
                               1.5 * layout_.belt_thickness);
        const double shelf = std::clamp(belt_top + 0.08 * h_.z(), -0.6 * h_.z(), 0.5 * h_.z());
        const double inside =
            std::clamp(layout_.track_side - 0.55 * layout_.belt_width, 0.4 * h_.y(), 0.9 * h_.y());
        const double bevel = 0.05 * s;
        const double x = h_.x(), z = h_.z(), glacis = std::min(1.5 * (z - shelf), 0.5 * x);
        builder_.set_paint(FormMaterial::paint, kOlive);
        // lower hull
        builder_.add_solid(std::array{half_space({1, 0, -0.8}, {x, 0, shelf}),
                                      half_space({-1, 0, -0.5}, {-x, 0, shelf}),
                                      half_space({0, 1, 0}, {0, inside, 0}),
                                      half_space({0, -1, 0}, {0, -inside, 0}),
                                      half_space({0, 0, 1}, {0, 0, shelf + 0.05 * s}),
                                      half_space({0, 0, -1}, {0, 0, -z})},
                           bevel);
        // upper hull with sloped front
        const Vector3d front = Vector3d(z - shelf, 0.0, glacis).normalized();
        const std::array hull{half_space(front, {x - 0.04 * x, 0, shelf + 0.15 * (z - shelf)}),
                              half_space({-1, 0, 0.12}, {-x, 0, shelf}),
                              half_space({0, 1, 0.10}, {0, h_.y(), shelf}),
                              half_space({0, -1, 0.10}, {0, -h_.y(), shelf}),
                              half_space({0, 0, 1}, {0, 0, z}),
                              half_space({0, 0, -1}, {0, 0, shelf}),
                              half_space({1, 0, 0}, {x, 0, 0})};
        builder_.add_solid(hull, bevel);
        // mudguards over the ends of the tracks
        const std::size_t first = builder_.vertex_count();
        builder_.set_paint(FormMaterial::matt, kFrame);
        builder_.add_box({0.86 * x, inside, shelf - 0.06 * s},
                         {x + lip_, h_.y() + 0.4 * lip_, shelf + 0.02 * s}, 0.02 * s);
        builder_.add_box({-x - lip_, inside, shelf - 0.06 * s},
                         {-0.86 * x, h_.y() + 0.4 * lip_, shelf + 0.02 * s}, 0.02 * s);
        builder_.add_box({-x - lip_, inside, shelf - 0.35 * s},
                         {-x - 0.7 * lip_, h_.y() + 0.4 * lip_, shelf}, 0.01 * s);
        builder_.set_paint(FormMaterial::paint, mixed(kOlive, kBlack, 0.12));
        // a skirt's rail and stowage along the sponsons
        builder_.add_box({-0.84 * x, h_.y() - 0.05 * s, shelf + 0.02 * s},
                         {0.8 * x, h_.y() + 0.35 * lip_, shelf + 0.12 * s}, 0.02 * s);
        const double up = 0.5 * (shelf + z);
        for (int k = 0; k < 3; ++k) {
            const double from = (-0.72 + 0.44 * k) * x;
            builder_.add_box({from, h_.y() - 0.25 * s, shelf + 0.2 * (z - shelf)},
                             {from + 0.36 * x, h_.y() + 0.1 * lip_, up + 0.25 * (z - shelf)},
                             0.03 * s);
        }
        // lamps on the glacis, with a guard
        const double lamp = 0.13 * s, share = 0.30;
        const Vector3d lamp_place(x - 0.04 * x - share * glacis, 0.72 * h_.y(),
                                  shelf + (0.15 + share) * (z - shelf));
        add_lamp(lamp_place + 0.10 * s * front + Vector3d(0.03 * s, 0, 0), Vector3d::UnitX(), lamp);
        builder_.set_paint(FormMaterial::indicator, kAmber);
        builder_.add_box(lamp_place + Vector3d(-0.05 * s, 0.13 * h_.y(), 0.02 * s),
                         lamp_place + Vector3d(0.13 * s, 0.19 * h_.y(), 0.16 * s), 0.02 * s);
        builder_.set_paint(FormMaterial::matt, kFrame);
        for (const double y : {0.88, 1.12}) {
            builder_.add_box(
                lamp_place + Vector3d(-0.05 * s, (y - 1.0) * 0.72 * h_.y() * 1.6, 0.0),
                lamp_place +
                    Vector3d(0.18 * s, (y - 1.0) * 0.72 * h_.y() * 1.6 + 0.02 * s, 0.30 * s),
                0.0);
        }
        // lamps at the rear, hooks
        builder_.set_paint(FormMaterial::tail_lamp, kRedLens);
        builder_.add_box({-x - 0.03 * s, 0.78 * h_.y(), up},
                         {-x + 0.1 * s, 0.90 * h_.y(), up + 0.18 * s}, 0.02 * s);
        builder_.set_paint(FormMaterial::steel, kIron);
        for (const double side : {-1.0, 1.0}) {
            builder_.add_box(
                {side > 0 ? 0.9 * x - 0.4 * z : -x - 0.8 * lip_, 0.55 * inside, -0.35 * z},
                {side > 0 ? x - 0.2 * z : -0.9 * x + 0.4 * z, 0.62 * inside, -0.18 * z}, 0.03 * s);
        }
        builder_.mirror_since(first);
        add_hull_details(hull, front, up, shelf, s);
    }

    void add_hull_details(std::span<const HalfSpace> hull, const Vector3d& front, double up,
                          double shelf, double s) {
        const double x = h_.x(), z = h_.z();
        // trim vane on the glacis, spare links on it
        const Polygon3 glacis = face_of(hull, 0, 0.12 * s);
        builder_.set_paint(FormMaterial::paint, mixed(kOlive, kBlack, 0.1));
        Polygon3 vane = clipped(glacis, half_space({0, 1, 0}, {0, 0.52 * h_.y(), 0}));
        vane = clipped(vane, half_space({0, -1, 0}, {0, -0.52 * h_.y(), 0}));
        builder_.add_plate(vane, 0.05 * s, 0.02 * s);
        builder_.set_paint(FormMaterial::steel, kIron);
        for (int k = 0; k < 5 && vane.size() >= 3; ++k) {
            Vector3d middle = Vector3d::Zero();
            for (const Vector3d& p : vane) middle += p / static_cast<double>(vane.size());
            Pose link =
                along_axis(middle + 0.06 * s * front + Vector3d(0, (k - 2) * 0.19 * s, 0), front);
            link.rotation << front.cross(Vector3d::UnitY()), -Vector3d::UnitY(), front;
            link.rotation.col(1) = link.rotation.col(2).cross(link.rotation.col(0));
            builder_.set_frame(link);
            builder_.add_box({-0.2 * s, -0.08 * s, -0.04 * s}, {0.2 * s, 0.08 * s, 0.04 * s},
                             0.02 * s);
        }
        builder_.set_frame({});
        // roof: driver's hatch with periscopes, cupola, cargo hatch, grille of the engine
        const double roof_front = x - 0.04 * x - 0.85 * std::min(1.5 * (z - shelf), 0.5 * x);
        const auto hatch = [&](double px, double py, double radius, double height) {
            builder_.set_frame(along_axis({px, py, z}, Vector3d::UnitZ()));
            const std::array lid{RingPoint{0.0, -0.05 * s},
                                 RingPoint{radius, -0.05 * s},
                                 RingPoint{radius, 0.4 * height},
                                 RingPoint{0.92 * radius, 0.6 * height},
                                 RingPoint{0.80 * radius, 0.6 * height},
                                 RingPoint{0.76 * radius, height},
                                 RingPoint{0.0, 1.15 * height}};
            builder_.add_turned(lid, 20);
            builder_.set_frame({});
        };
        const double tall = 0.6 * lip_;
        builder_.set_paint(FormMaterial::paint, mixed(kOlive, kBlack, 0.08));
        const double hatch_x = roof_front - 0.55 * s;
        hatch(hatch_x, 0.45 * h_.y(), 0.30 * s, tall);
        hatch(hatch_x - 1.3 * s, 0.0, 0.44 * s, 1.4 * tall);
        builder_.add_box({-0.75 * x, -0.5 * h_.y(), z - 0.02 * s},
                         {hatch_x - 1.95 * s, 0.5 * h_.y(), z + 0.5 * tall}, 0.03 * s);
        for (int k = 0; k < 5; ++k) {
            const double angle = (k - 2) * 0.5;
            const Vector3d place(hatch_x + 0.42 * s * std::cos(angle),
                                 0.45 * h_.y() + 0.42 * s * std::sin(angle), z);
            Pose block;
            block.rotation << std::cos(angle), -std::sin(angle), 0.0, std::sin(angle),
                std::cos(angle), 0.0, 0.0, 0.0, 1.0;
            block.translation = place;
            builder_.set_frame(block);
            builder_.set_paint(FormMaterial::paint, kOlive);
            builder_.add_box({-0.05 * s, -0.08 * s, -0.02 * s}, {0.05 * s, 0.08 * s, 0.9 * tall},
                             0.01 * s);
            builder_.set_paint(FormMaterial::glass, kGlass);
            builder_.add_box({0.03 * s, -0.06 * s, 0.25 * tall},
                             {0.056 * s, 0.06 * s, 0.75 * tall});
        }
        builder_.set_frame({});
        builder_.set_paint(FormMaterial::matt, kBlack);
        const double gx = hatch_x - 0.35 * s, gy = -0.45 * h_.y();
        builder_.add_box({gx - 0.45 * s, gy - 0.35 * s, z - 0.02 * s},
                         {gx + 0.45 * s, gy + 0.35 * s, z + 0.02 * s});
        builder_.set_paint(FormMaterial::paint, kOlive);
        for (int k = 0; k < 7; ++k) {
            const double px = gx + (-0.42 + 0.13 * k) * s;
            builder_.add_box({px, gy - 0.35 * s, z}, {px + 0.05 * s, gy + 0.35 * s, z + 0.06 * s});
        }
        // the ramp at the rear, with a door in it
        const Polygon3 rear = face_of(hull, 1, 0.10 * s);
        Polygon3 ramp = clipped(rear, half_space({0, 1, 0}, {0, 0.68 * h_.y(), 0}));
        ramp = clipped(ramp, half_space({0, -1, 0}, {0, -0.68 * h_.y(), 0}));
        builder_.set_paint(FormMaterial::paint, mixed(kOlive, kBlack, 0.06));
        builder_.add_plate(ramp, 0.05 * s, 0.02 * s);
        builder_.add_box({-0.99 * x + 0.25 * z, -0.68 * h_.y(), -0.6 * z},
                         {-0.9 * x, 0.68 * h_.y(), shelf}, 0.02 * s);
        builder_.set_paint(FormMaterial::paint, mixed(kOlive, kBlack, 0.18));
        Polygon3 door =
            clipped(face_of(hull, 1, 0.22 * s), half_space({0, 1, 0}, {0, 0.1 * h_.y(), 0}));
        door = clipped(door, half_space({0, -1, 0}, {0, -0.55 * h_.y(), 0}));
        builder_.add_plate(door, 0.07 * s, 0.02 * s);
        // cans in racks beside the ramp
        for (const double side : {-1.0, 1.0}) {
            const double y = side * 0.84 * h_.y();
            builder_.set_paint(FormMaterial::matt, mixed(kOlive, kSand, 0.3));
            builder_.add_box({-x - 0.9 * lip_, y - 0.10 * h_.y(), shelf + 0.06 * s},
                             {-x + 0.1 * s, y + 0.10 * h_.y(), up - 0.05 * s}, 0.04 * s);
        }
    }

    // ---- Exhaust ----

    void add_exhaust() {
        const double radius = 0.09 * std::min(h_.z(), h_.y());
        builder_.set_paint(FormMaterial::steel, kIron);
        if (settings_.is_tracked) {
            const Vector3d from(0.42 * h_.x(), -0.80 * h_.y(), h_.z() - 0.2 * radius);
            form_.exhaust_direction = Vector3d(-0.8, -0.3, 0.5).normalized();
            form_.exhaust = from + 3.0 * radius * form_.exhaust_direction;
            add_pipe(builder_, from - 2.0 * radius * form_.exhaust_direction, form_.exhaust, radius,
                     12);
        } else if (!has_hood_ && cab_ && has_bed_) {
            const CompoundPart& part = settings_.bodywork[*cab_];
            const double roof =
                part.body_from_part.translation.z() + std::get<Box>(part.shape).half_extents.z();
            const Vector3d foot(cab_back_ - 2.5 * radius, -0.82 * h_.y(), 0.5 * h_.z());
            form_.exhaust_direction = Vector3d(-0.5, 0.0, 1.0).normalized();
            const double high = std::max(roof, h_.z() + 2.0 * radius);
            const Vector3d bend(foot.x(), foot.y(), high - 1.5 * radius);
            add_pipe(builder_, foot, bend, radius, 12);
            add_disc(builder_, {foot.x(), foot.y(), 0.55 * (foot.z() + bend.z())},
                     Vector3d::UnitZ(), 1.7 * radius, 0.28 * (bend.z() - foot.z()), 12);
            form_.exhaust = bend + 1.7 * radius * form_.exhaust_direction;
            add_pipe(builder_, bend - 0.3 * radius * form_.exhaust_direction, form_.exhaust, radius,
                     12);
        } else {
            const Vector3d from(-0.7 * h_.x(), -0.42 * h_.y(), -0.88 * h_.z());
            form_.exhaust = Vector3d(-h_.x() - 0.8 * lip_, from.y(), from.z());
            form_.exhaust_direction = -Vector3d::UnitX();
            add_pipe(builder_, from, form_.exhaust, radius, 12);
        }
    }

    const VehicleSettings& settings_;
    const VehicleLayout& layout_;
    VehicleForm& form_;
    Vector3d h_;                      // half extents of the chassis
    std::optional<std::size_t> cab_;  // index of the bodywork
    double cab_front_ = 0.0, cab_back_ = 0.0;
    bool has_hood_ = false, has_bed_ = false;
    double lip_ = 0.0;    // how far small parts stand out
    double sill_ = 0.0;   // lower edge of the sides
    double inner_ = 0.0;  // half width between the wheels
    std::vector<Arch> arches_;
    FormBuilder builder_;
};

/// Fails as World::add_vehicle().
Result<void> check(const VehicleSettings& settings) {
    TERRANE_TRY(World world, World::create({}));
    TERRANE_TRY(world.add_vehicle(settings, {}));
    return {};
}

}  // namespace

Result<VehicleForm> make_vehicle_form(const VehicleSettings& settings) {
    TERRANE_TRY(check(settings));
    const VehicleLayout layout(settings);
    VehicleForm form;
    BodyMaker(settings, layout, form).make();
    if (layout.link_count > 0) {
        form.wheel = make_road_wheel(settings, layout);
        form.link = make_link(layout);
        form.sprocket = make_sprocket(layout);
    } else {
        form.wheel = make_tyre_wheel(settings, layout);
    }
    return form;
}

}  // namespace terrane::tools
