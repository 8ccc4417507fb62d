// SPDX-License-Identifier: MIT
// Forms of vehicles, crates and walkers: closed meshes that fill what collides.
#include "scene/vehicle_forms.h"

#include "scene/body_forms.h"
#include "scene/running_gear.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace terrane::tools {
namespace vehicle_forms_test {

using Eigen::Vector3d;

/// [positions] the first vertex at the same place.
std::vector<std::uint32_t> welded(const TriangleMesh& mesh) {
    std::map<std::array<float, 3>, std::uint32_t> firsts;
    std::vector<std::uint32_t> first;
    for (std::uint32_t i = 0; i < mesh.positions.size(); ++i) {
        const Eigen::Vector3f p = mesh.positions[i].cast<float>();
        first.push_back(firsts.try_emplace({p.x(), p.y(), p.z()}, i).first->second);
    }
    return first;
}

Aabb bounds_of(const TriangleMesh& mesh) {
    Aabb box{mesh.positions[0], mesh.positions[0]};
    for (const Vector3d& p : mesh.positions) {
        box.low = box.low.cwiseMin(p);
        box.high = box.high.cwiseMax(p);
    }
    return box;
}

/// Checks attributes, that every edge is traversed as often in one direction as in the other, that no triangle is seen
/// from behind where its normals say it is in front, and that every component has its outside outside.
void expect_sound(const MeshModel& model, const std::string& name) {
    const TriangleMesh& mesh = model.mesh;
    ASSERT_TRUE(mesh.validate()) << name;
    ASSERT_GT(mesh.triangles.size(), 0u) << name;
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size()) << name;
    ASSERT_EQ(mesh.colours.size(), mesh.positions.size()) << name;
    for (const Eigen::Vector3f& normal : mesh.normals)
        ASSERT_NEAR(normal.norm(), 1.0f, 1e-4f) << name;
    for (const std::uint16_t material : mesh.materials)
        ASSERT_LT(material, model.materials.size()) << name;

    const std::vector<std::uint32_t> place = welded(mesh);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    std::vector<std::uint32_t> parent(mesh.positions.size());
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&](std::uint32_t i) {
        while (parent[i] != i) i = parent[i] = parent[parent[i]];
        return i;
    };
    std::size_t backwards = 0;
    const Aabb box = bounds_of(mesh);
    const double least_area = 1e-10 * (box.high - box.low).squaredNorm();
    for (const TriangleMesh::Triangle& t : mesh.triangles) {
        const std::array corners{place[t[0]], place[t[1]], place[t[2]]};
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = corners[k], b = corners[(k + 1) % 3];
            if (a == b) continue;
            edges[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
            parent[root(a)] = root(b);
        }
        const Vector3d& p = mesh.positions[t[0]];
        const Vector3d face = (mesh.positions[t[1]] - p).cross(mesh.positions[t[2]] - p);
        if (face.norm() < least_area) continue;  // a sliver, whose normal is rounding
        for (const std::uint32_t corner : t) {
            if (mesh.normals[corner].cast<double>().dot(face.normalized()) < -0.01) ++backwards;
        }
    }
    const auto open = std::count_if(edges.begin(), edges.end(),
                                    [](const auto& edge) { return edge.second != 0; });
    EXPECT_EQ(open, 0) << name;
    EXPECT_EQ(backwards, 0u) << name;
    std::map<std::uint32_t, double> volumes;
    for (const TriangleMesh::Triangle& t : mesh.triangles) {
        const Vector3d& base = mesh.positions[root(place[t[0]])];
        volumes[root(place[t[0]])] +=
            (mesh.positions[t[0]] - base)
                .dot((mesh.positions[t[1]] - base).cross(mesh.positions[t[2]] - base)) /
            6.0;
    }
    for (const auto& [component, volume] : volumes) {
        const Vector3d& p = mesh.positions[component];
        EXPECT_GT(volume, 0.0) << name << " at " << p.transpose();
    }
}

/// Bounds of the boxes, spheres and capsules that collide as chassis and bodywork.
Aabb physical_bounds(const VehicleSettings& settings) {
    Aabb box{-settings.chassis_half_extents, settings.chassis_half_extents};
    for (const CompoundPart& part : settings.bodywork) {
        const Pose& pose = part.body_from_part;
        std::vector<Vector3d> points;
        double radius = 0.0;
        if (const Box* own = std::get_if<Box>(&part.shape)) {
            for (int k = 0; k < 8; ++k)
                points.push_back(own->half_extents.cwiseProduct(
                    Vector3d(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1)));
        } else if (const Sphere* ball = std::get_if<Sphere>(&part.shape)) {
            points.push_back(Vector3d::Zero());
            radius = ball->radius;
        } else if (const Capsule* capsule = std::get_if<Capsule>(&part.shape)) {
            points = {Vector3d(0, 0, capsule->half_height), Vector3d(0, 0, -capsule->half_height)};
            radius = capsule->radius;
        } else {
            const auto corners = std::get<ConvexHull>(part.shape).vertices();
            points.assign(corners.begin(), corners.end());
        }
        for (const Vector3d& p : points) {
            box.low = box.low.cwiseMin(pose * p - Vector3d::Constant(radius));
            box.high = box.high.cwiseMax(pose * p + Vector3d::Constant(radius));
        }
    }
    return box;
}

CompoundPart part_at(const ConvexShape& shape, const Vector3d& place) {
    CompoundPart part{shape, {}};
    part.body_from_part.translation = place;
    return part;
}

struct Case {
    const char* name;
    VehicleSettings settings;
};

std::vector<Case> cases() {
    std::vector<Case> all{
        {"truck", make_truck()}, {"tracked", make_tracked()}, {"six_wheeler", make_six_wheeler()}};
    VehicleSettings bare = make_truck();
    bare.bodywork.clear();
    all.push_back({"without bodywork", bare});
    VehicleSettings tiny;
    tiny.chassis_half_extents = {0.02, 0.01, 0.01};
    tiny.centre_of_mass_height = 0.02;
    tiny.wheel_radius = 0.01;
    tiny.suspension_travel = 0.001;
    tiny.axles = {{.position = 0.015, .track = 0.02}, {.position = -0.015, .track = 0.02}};
    tiny.bodywork = {part_at(Box{{0.005, 0.008, 0.005}}, {0.0, 0.0, 0.015})};
    all.push_back({"tiny", tiny});
    VehicleSettings huge = tiny;
    huge.chassis_half_extents = {1000, 500, 300};
    huge.centre_of_mass_height = 350;
    huge.wheel_radius = 100;
    huge.suspension_travel = 100;
    huge.axles = {{.position = 800, .track = 1000, .max_steer = -1.5},
                  {.position = -800, .track = 1000}};
    huge.bodywork = {part_at(Box{{200, 400, 100}}, {700, 0, 400})};
    all.push_back({"huge", huge});
    VehicleSettings cart = make_truck();
    cart.axles = {{.position = 0.0, .track = 1.8}};
    all.push_back({"one axle", cart});
    VehicleSettings tricycle = make_truck();
    tricycle.axles[0].track = 0.0;
    all.push_back({"one wheel in front", tricycle});
    VehicleSettings many = make_six_wheeler();
    many.chassis_half_extents.x() = 20.0;
    many.axles.clear();
    for (int i = 0; i < 32; ++i)
        many.axles.push_back({.position = 19.0 - 1.2 * i, .track = 2.2, .max_steer = 0.3});
    all.push_back({"32 axles", many});
    VehicleSettings wide = make_truck();
    for (AxleSettings& axle : wide.axles) axle.track = 4.0;
    wide.wheel_radius = 1.2;
    wide.centre_of_mass_height = 1.9;
    all.push_back({"wheels outside", wide});
    VehicleSettings flat = make_truck();
    flat.chassis_half_extents = {3.0, 2.0, 0.02};
    all.push_back({"flat", flat});
    VehicleSettings tall = make_truck();
    tall.chassis_half_extents = {0.5, 0.5, 3.0};
    tall.centre_of_mass_height = 3.2;
    tall.bodywork.clear();
    all.push_back({"tall", tall});
    VehicleSettings loaded = make_six_wheeler();
    const std::array points{Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(0, 1, 0),
                            Vector3d(0, 0, 1)};
    loaded.bodywork.push_back(part_at(Box{{1.0, 1.0, 0.6}}, {-2.0, 0.0, 1.05}));
    loaded.bodywork.push_back(part_at(Sphere{0.4}, {-0.3, 0.0, 0.9}));
    loaded.bodywork.push_back(part_at(Capsule{0.3, 0.4}, {0.4, 0.0, 1.1}));
    loaded.bodywork.push_back(part_at(ConvexHull::create(points).value(), {-2.0, 0.0, 1.65}));
    all.push_back({"loaded", loaded});
    VehicleSettings short_tracks = make_tracked();
    short_tracks.axles.resize(1);
    all.push_back({"tracks on one axle", short_tracks});
    VehicleSettings no_tracks = make_tracked();
    for (AxleSettings& axle : no_tracks.axles) axle.track = 0.0;
    all.push_back({"tracked on single wheels", no_tracks});
    return all;
}

/// The state with wheels at given compressions, on a pose that is neither upright nor at the origin.
VehicleState state_of(const VehicleSettings& settings, double spin, double unevenness) {
    VehicleState state;
    state.chassis.pose.rotation =
        (Eigen::AngleAxisd(0.7, Vector3d::UnitZ()) * Eigen::AngleAxisd(-0.2, Vector3d::UnitX()))
            .toRotationMatrix();
    state.chassis.pose.translation = {1000.0, -500.0, 90.0};
    int i = 0;
    for (const AxleSettings& axle : settings.axles) {
        for (int side = 0; side < (axle.track > 0.0 ? 2 : 1); ++side) {
            WheelState wheel;
            const Vector3d place(axle.position, (side == 0 ? 0.5 : -0.5) * axle.track,
                                 settings.wheel_radius - settings.centre_of_mass_height +
                                     unevenness * std::sin(3.0 * i++));
            wheel.centre_world = state.chassis.pose * place;
            wheel.spin = spin;
            state.wheels.push_back(wheel);
        }
    }
    return state;
}

TEST(VehicleForms, AreClosedAndFaceOutwards) {
    for (const auto& [name, settings] : cases()) {
        const auto form = make_vehicle_form(settings);
        ASSERT_TRUE(form) << name << ": " << form.error().message;
        expect_sound(form->body, std::string(name) + ": body");
        expect_sound(form->wheel, std::string(name) + ": wheel");
        EXPECT_EQ(form->link.has_value(), form->sprocket.has_value()) << name;
        if (form->link) expect_sound(*form->link, std::string(name) + ": link");
        if (form->sprocket) expect_sound(*form->sprocket, std::string(name) + ": sprocket");
        EXPECT_NEAR(form->exhaust_direction.norm(), 1.0, 1e-9) << name;
    }
}

TEST(VehicleForms, FillWhatCollidesAndExceedItByLittle) {
    for (const auto& [name, settings] : cases()) {
        const VehicleForm form = make_vehicle_form(settings).value();
        const Aabb drawn = bounds_of(form.body.mesh), physical = physical_bounds(settings);
        double most = 0.4 * settings.chassis_half_extents.z();
        for (const CompoundPart& part : settings.bodywork) {
            if (const Box* box = std::get_if<Box>(&part.shape)) {
                most = std::max(most, 0.2 * box->half_extents.z());
            }
        }
        const Vector3d size = physical.high - physical.low;
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_GE(drawn.low[axis], physical.low[axis] - most) << name << " axis " << axis;
            EXPECT_LE(drawn.high[axis], physical.high[axis] + most) << name << " axis " << axis;
            EXPECT_LE(drawn.low[axis], physical.low[axis] + 0.06 * size[axis])
                << name << " axis " << axis;
            EXPECT_GE(drawn.high[axis], physical.high[axis] - 0.06 * size[axis])
                << name << " axis " << axis;
        }
        EXPECT_TRUE((form.exhaust.array() >= drawn.low.array() - most).all()) << name;
        EXPECT_TRUE((form.exhaust.array() <= drawn.high.array() + most).all()) << name;
    }
}

TEST(VehicleForms, OfThePresetsHaveFewTriangles) {
    for (const VehicleSettings& settings : {make_truck(), make_tracked(), make_six_wheeler()}) {
        const VehicleForm form = make_vehicle_form(settings).value();
        EXPECT_LT(form.body.mesh.triangles.size(), 6500u);
        EXPECT_LE(form.wheel.mesh.triangles.size(), 600u);
        if (form.link) {
            EXPECT_LT(form.link->mesh.triangles.size(), 200u);
        }
    }
}

TEST(VehicleForms, OfTrucksHaveOneFaceAtEachPlaceOfTheirTailgate) {
    for (const VehicleSettings& settings : {make_truck(), make_six_wheeler()}) {
        const TriangleMesh mesh = make_vehicle_form(settings).value().body.mesh;
        const Vector3d h = settings.chassis_half_extents;
        // seen from behind, in the rear plane of the chassis
        std::vector<std::array<Vector3d, 3>> faces;
        for (const TriangleMesh::Triangle& t : mesh.triangles) {
            const std::array p{mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
            const auto is_rear = [&](const Vector3d& q) { return std::abs(q.x() + h.x()) < 1e-6; };
            const double front = (p[1] - p[0]).cross(p[2] - p[0]).x();
            if (std::ranges::all_of(p, is_rear) && front < 0.0) faces.push_back(p);
        }
        const auto covers = [](const std::array<Vector3d, 3>& p, const Vector3d& q) {
            for (std::size_t i = 0; i < 3; ++i) {
                if ((p[(i + 1) % 3] - p[i]).cross(q - p[i]).x() >= 0.0) return false;
            }
            return true;
        };
        EXPECT_GT(faces.size(), 0u);
        for (double y = -0.997; y < 1.0; y += 0.01) {
            for (double z = -0.997; z < 1.0; z += 0.01) {
                const Vector3d q(-h.x(), y * h.y(), z * h.z());
                ASSERT_LE(std::ranges::count_if(faces, [&](const auto& p) { return covers(p, q); }),
                          1)
                    << y << " " << z;
            }
        }
    }
}

TEST(VehicleForms, HaveWheelsOfTheirRadius) {
    for (const auto& [name, settings] : cases()) {
        const VehicleForm form = make_vehicle_form(settings).value();
        double radius = 0.0;
        for (const Vector3d& p : form.wheel.mesh.positions)
            radius = std::max(radius, std::hypot(p.x(), p.z()));
        // a track's belt is between its wheels and the ground
        const double belt = form.link ? VehicleLayout(settings).belt_thickness : 0.0;
        EXPECT_NEAR(radius, settings.wheel_radius - belt, 1e-3 * settings.wheel_radius) << name;
    }
}

TEST(VehicleForms, TurnTheirWheelsAsTheyRoll) {
    const VehicleSettings settings = make_truck();
    VehicleState state = state_of(settings, 0.0, 0.0);
    state.wheels[0].steer = state.wheels[1].steer = 0.3;
    const Eigen::Matrix3d& chassis = state.chassis.pose.rotation;
    for (std::size_t i = 0; i < 4; ++i) {
        const Vector3d outer = chassis.transpose() * wheel_pose(settings, state, i).rotation.col(1);
        EXPECT_GT(outer.y() * (i % 2 == 0 ? 1.0 : -1.0), 0.9) << i;
        EXPECT_NEAR(std::abs(outer.x()), i < 2 ? std::sin(0.3) : 0.0, 1e-9) << i;
        // the lowest point of a wheel that rolls forward moves backward
        const Pose before = wheel_pose(settings, state, i);
        const Vector3d lowest = before.rotation.transpose() * (-chassis.col(2));
        state.wheels[i].spin = 0.1;
        const Vector3d moved = wheel_pose(settings, state, i).rotation * lowest + chassis.col(2);
        EXPECT_LT((chassis.transpose() * moved).x(), -0.09) << i;
    }
}

TEST(TrackLinks, LieOnTheHullOfWheelsAndSprockets) {
    const VehicleSettings settings = make_tracked();
    const VehicleLayout layout(settings);
    std::size_t count = 0;
    for (const double unevenness : {0.0, 0.1, 0.18}) {
        const VehicleState state = state_of(settings, 0.4, unevenness);
        const std::vector<Pose> links = track_link_poses(settings, state);
        const std::vector<Pose> sprockets = sprocket_poses(settings, state);
        ASSERT_EQ(sprockets.size(), 4u);
        if (count == 0) count = links.size();
        ASSERT_EQ(links.size(), count);
        ASSERT_GT(count, 60u);
        const Pose& chassis = state.chassis.pose;
        for (std::size_t k = 0; k < links.size(); ++k) {
            const std::size_t side = k < count / 2 ? 0 : 1;
            const Vector3d out = links[k].rotation.col(2), p = links[k].translation;
            EXPECT_NEAR(
                (links[k].rotation.transpose() * links[k].rotation - Eigen::Matrix3d::Identity())
                    .norm(),
                0.0, 1e-9);
            EXPECT_NEAR(links[k].rotation.determinant(), 1.0, 1e-9);
            double support = -std::numeric_limits<double>::infinity();
            for (std::size_t i = side; i < state.wheels.size(); i += 2)
                support =
                    std::max(support, out.dot(state.wheels[i].centre_world) +
                                          settings.wheel_radius - 0.5 * layout.belt_thickness);
            for (std::size_t i = side; i < 4; i += 2)
                support =
                    std::max(support, out.dot(sprockets[i].translation) + layout.sprocket_radius +
                                          0.5 * layout.belt_thickness);
            // the middle of a link is the middle of a chord
            EXPECT_LE(out.dot(p), support + 1e-9) << k;
            EXPECT_GE(out.dot(p), support - 0.02) << k;
            EXPECT_NEAR((chassis.rotation.transpose() * (p - chassis.translation)).y(),
                        side == 0 ? 1.1 : -1.1, 1e-9);
            const std::size_t next = side * (count / 2) + (k + 1) % (count / 2);
            const double gap = (links[next].translation - p).norm();
            EXPECT_NEAR(gap, layout.link_length, 0.07 * layout.link_length) << k;
        }
    }
}

TEST(TrackLinks, MoveWithTheirWheels) {
    const VehicleSettings settings = make_tracked();
    constexpr double kSpin = 1e-3;
    for (const double spin : {0.0, 12.3, -4567.8}) {
        const VehicleState before = state_of(settings, spin, 0.1),
                           after = state_of(settings, spin + kSpin, 0.1);
        const std::vector<Pose> from = track_link_poses(settings, before),
                                to = track_link_poses(settings, after);
        double sum = 0.0;
        for (std::size_t k = 0; k < from.size(); ++k) {
            const Vector3d moved = to[k].translation - from[k].translation;
            EXPECT_NEAR(moved.norm(), kSpin * settings.wheel_radius,
                        0.05 * kSpin * settings.wheel_radius)
                << k;
            // links below move backward, those above forward
            const Vector3d forward = before.chassis.pose.rotation.col(0),
                           up = before.chassis.pose.rotation.col(2);
            const double height = from[k].rotation.col(2).dot(up);
            if (std::abs(height) > 0.9) {
                EXPECT_GT(moved.dot(forward) * height, 0.0) << k;
            }
            sum += moved.dot(forward);
        }
        EXPECT_NEAR(sum, 0.0, 0.05);
    }
}

TEST(TrackLinks, AreAbsentWithoutTracks) {
    const VehicleSettings truck = make_truck();
    EXPECT_TRUE(track_link_poses(truck, state_of(truck, 0.0, 0.0)).empty());
    EXPECT_TRUE(sprocket_poses(truck, state_of(truck, 0.0, 0.0)).empty());
}

TEST(VehicleForms, RefuseWhatAWorldRefuses) {
    VehicleSettings settings = make_truck();
    settings.wheel_radius = std::nan("");
    const auto form = make_vehicle_form(settings);
    ASSERT_FALSE(form);
    EXPECT_EQ(form.error().code, ErrorCode::invalid_argument);
    EXPECT_NE(form.error().message.find("wheel_radius"), std::string::npos) << form.error().message;
}

TEST(CrateForms, AreClosedBoxesThatShareTheirTexture) {
    const MeshModel cube = make_crate_form({0.5, 0.5, 0.5});
    for (const Vector3d& half : {Vector3d(0.5, 0.3, 0.2), Vector3d(0.01, 50.0, 2.0)}) {
        const MeshModel crate = make_crate_form(half);
        expect_sound(crate, "crate");
        const Aabb box = bounds_of(crate.mesh);
        EXPECT_NEAR((box.high - half).norm() + (box.low + half).norm(), 0.0, 1e-12);
        EXPECT_EQ(crate.mesh.triangles.size(), 156u);
        EXPECT_EQ(crate.materials[0].colour_texture.image, cube.materials[0].colour_texture.image);
        for (const Eigen::Vector2f& place : crate.mesh.texture_coordinates) {
            EXPECT_GE(place.minCoeff(), 0.0f);
            EXPECT_LE(place.maxCoeff(), 1.0f);
        }
    }
}

TEST(CharacterForms, StandOnTheirCapsulesEndInAllSteps) {
    CharacterSettings child;
    child.radius = 0.12;
    child.half_height = 0.4;
    for (const CharacterSettings& settings : {CharacterSettings{}, child}) {
        const CharacterForm form = make_character_form(settings);
        for (const MeshModel& part : form.parts) expect_sound(part, "character");
        const double half = settings.radius + settings.half_height;
        for (const double speed : {0.0, 0.6, 3.0}) {
            for (int step = 0; step < 24; ++step) {
                const std::vector<Pose> poses =
                    character_part_poses(settings, {}, 0.13 * step, speed);
                ASSERT_EQ(poses.size(), form.parts.size());
                double low = 1e9, high = -1e9, wide = 0.0;
                for (std::size_t i = 0; i < poses.size(); ++i) {
                    for (const Vector3d& p : form.parts[i].mesh.positions) {
                        const Vector3d q = poses[i] * p;
                        low = std::min(low, q.z());
                        high = std::max(high, q.z());
                        wide = std::max(wide, std::abs(q.y()));
                    }
                }
                EXPECT_GT(low, -1.001 * half) << speed << " " << step;
                EXPECT_LT(low, -0.99 * half) << speed << " " << step;
                EXPECT_LT(high, 1.01 * half);  // on tiptoe
                EXPECT_GT(high, 0.93 * half);
                EXPECT_LT(wide, settings.radius);
            }
        }
    }
}

}  // namespace vehicle_forms_test
}  // namespace terrane::tools
