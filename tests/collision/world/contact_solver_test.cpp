// SPDX-License-Identifier: MIT
#include "world/solver/contact_solver.h"

#include "collision/world/body_cases.h"
#include "support/random.h"
#include "world/island_solver.h"
#include "world/solver/pair_manifolds.h"
#include "world/solver/solver_body.h"

#include <terrane/collision/ground_queries.h>
#include <terrane/collision/shape_pairs.h>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <vector>

namespace terrane::internal::mass_properties_test {

using namespace test;

Pose random_pose(Random& random, double reach) {
    const Eigen::Matrix3d rotation = random.rotation();
    const double distance = random.between(0.0, reach);
    return {rotation, distance * random.direction()};
}

Eigen::Vector3d corner_signs(int i) {
    return {i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0};
}

ConvexHull hull_of_box(const Eigen::Vector3d& half, const Pose& pose) {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 8; ++i) points.push_back(pose * half.cwiseProduct(corner_signs(i)));
    return ConvexHull::create(points).value();
}

Eigen::Vector3d sorted(Eigen::Vector3d v) {
    std::sort(v.begin(), v.end());
    return v;
}

void expect_inertia(const Shape& shape, double mass, const Eigen::Vector3d& wanted,
                    double accuracy) {
    const Eigen::Vector3d inertia = sorted(make_mass_properties(shape, mass).inertia);
    EXPECT_LT((inertia - sorted(wanted)).norm(), accuracy * wanted.norm())
        << inertia.transpose() << " instead of " << sorted(wanted).transpose();
}

/// Inertia tensor about the shape's origin in the body frame, by counting lattice points in the shape.
struct Counted {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    Eigen::Matrix3d about_centre = Eigen::Matrix3d::Zero();  // for 1 kg
};
Counted count_points(const Shape& shape, int steps) {
    const double radius = bounding_radius(shape);
    std::vector<Eigen::Vector3d> inside;
    for (int i = 0; i < steps * steps * steps; ++i) {
        const Eigen::Vector3d cell(i % steps, i / steps % steps, i / steps / steps);
        const Eigen::Vector3d point = radius * (2.0 * (cell.array() + 0.5) / steps - 1.0).matrix();
        const Pose pose{.translation = point};
        if (test_contact(Sphere{0.0}, pose, shape, {}).is_touching) inside.push_back(point);
    }
    const double share = 1.0 / static_cast<double>(inside.size());
    Counted counted;
    for (const Eigen::Vector3d& p : inside) counted.centre += share * p;
    for (const Eigen::Vector3d& p : inside) {
        const Eigen::Vector3d d = p - counted.centre;
        counted.about_centre +=
            share * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
    }
    return counted;
}

TEST(MassProperties, AreThoseOfAllPointsOfTheShape) {
    constexpr double kAccuracy = 0.01;  // with a lattice of 60 points along each axis
    for (const Shape& shape : {Shape(test::make_wedge()), Shape(Capsule{0.4, 0.8})}) {
        const Counted counted = count_points(shape, 60);
        const CentredShape centred = make_centred(shape).value();
        const double size = bounding_radius(shape);
        const Eigen::Matrix3d& axes = centred.body_from_centred.rotation;
        EXPECT_LT((centred.body_from_centred.translation - counted.centre).norm(),
                  kAccuracy * size);
        const MassProperties mass = make_mass_properties(centred.shape, 2.0);
        const Eigen::Matrix3d tensor = axes * mass.inertia.asDiagonal() * axes.transpose();
        EXPECT_LT((tensor - 2.0 * counted.about_centre).norm(), kAccuracy * tensor.norm())
            << name_of(shape);
        EXPECT_GT(axes.determinant(), 0.999);
        EXPECT_EQ(mass.inverse_mass, 0.5);
    }
}

TEST(MassProperties, OfAHullOfABoxAreTheBoxesHoweverItIsPlaced) {
    SeededRandom random(31);
    for (int run = 0; run < 200; ++run) {
        Eigen::Vector3d half;
        for (int axis = 0; axis < 3; ++axis) half[axis] = random.between(0.01, 3.0);
        const Pose pose = random_pose(random, run % 2 == 0 ? 0.0 : 50.0);
        const ConvexHull hull = hull_of_box(half, pose);
        const CentredShape centred = make_centred(hull).value();
        expect_inertia(centred.shape, 7.0, make_mass_properties(Box{half}, 7.0).inertia, 1e-9);
        EXPECT_LT((centred.body_from_centred.translation - pose.translation).norm(), 1e-11);
        // The same point set in the world frame.
        const Pose world = random_pose(random, 1000.0);
        const Pose inner = to_centred(world, centred.body_from_centred);
        const auto distance = [&](const Shape& shape, Pose shifted) {
            shifted.translation.x() += 200.0;
            return signed_distance(hull, world, shape, shifted).distance;
        };
        EXPECT_NEAR(distance(centred.shape, inner), distance(hull, world), 1e-9);
        const Pose back = from_centred(inner, centred.body_from_centred);
        EXPECT_LT((back.rotation - world.rotation).norm(), 1e-12);
        EXPECT_LT((back.translation - world.translation).norm(), 1e-10);
    }
}

TEST(MassProperties, OfPartsThatMakeABoxAreTheBoxes) {
    const Eigen::Vector3d half(0.5, 1.0, 2.0);
    SeededRandom random(32);
    for (int run = 0; run < 50; ++run) {
        const Pose whole = random_pose(random, 3.0);
        std::vector<CompoundPart> parts;
        for (int i = 0; i < 8; ++i) {
            const Eigen::Vector3d place = 0.5 * half.cwiseProduct(corner_signs(i));
            const Pose pose{whole.rotation, whole * place};
            if (i % 2 == 0) {
                parts.push_back({Box{0.5 * half}, pose});
            } else {
                parts.push_back({hull_of_box(0.5 * half, pose), {}});
            }
        }
        // A plate beside solid parts has no mass.
        parts.push_back({Box{{4.0, 4.0, 0.0}}, whole});
        const CentredShape centred = make_centred(Compound::create(parts).value()).value();
        expect_inertia(centred.shape, 3.0, make_mass_properties(Box{half}, 3.0).inertia, 1e-9);
        EXPECT_LT((centred.body_from_centred.translation - whole.translation).norm(), 1e-12);
    }
}

TEST(MassProperties, OfPlatesRodsAndPointsAreFinite) {
    SeededRandom random(33);
    const Pose turned = random_pose(random, 2.0);
    const CentredShape plate = make_centred(hull_of_box({1.0, 2.0, 0.0}, turned)).value();
    expect_inertia(plate.shape, 3.0, make_mass_properties(Box{{1.0, 2.0, 0.0}}, 3.0).inertia, 1e-9);
    const CentredShape rod = make_centred(hull_of_box({0.0, 2.0, 0.0}, turned)).value();
    const MassProperties of_rod = make_mass_properties(rod.shape, 3.0);
    expect_inertia(rod.shape, 3.0, {4.0, 4.0, 0.0}, 1e-9);
    EXPECT_EQ(of_rod.inverse_inertia.minCoeff(), 0.0);
    EXPECT_LT(of_rod.inverse_inertia.maxCoeff(), 1.0);
    const CentredShape point = make_centred(hull_of_box({0.0, 0.0, 0.0}, turned)).value();
    EXPECT_EQ(make_mass_properties(point.shape, 3.0).inverse_inertia.norm(), 0.0);
    EXPECT_LT((point.body_from_centred.translation - turned.translation).norm(), 1e-12);
    // The triangles of a closed mesh have the mass of a shell.
    const double third = 1.0 / 3.0;
    const std::vector<Eigen::Vector3d> corners{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    const std::vector<std::array<std::uint32_t, 3>> faces{
        {0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
    const Compound shell = Compound::from_triangles(corners, faces).value();
    const CentredShape centred = make_centred(shell).value();
    EXPECT_LT(centred.body_from_centred.translation.norm(), 1e-15);
    // Per face: its centre at distance 1/sqrt(3), and its own second moment of 8/12 along its sides.
    const double spread = third * (third + 8.0 / 12.0);
    EXPECT_NEAR(make_mass_properties(centred.shape, 1.0).inertia[0], 2.0 * spread, 1e-12);
}

TEST(MassProperties, ShareWhatIsCentredAlready) {
    const ConvexHull hull = hull_of_box({1.0, 2.0, 0.5}, {});
    const CentredShape centred = make_centred(hull).value();
    EXPECT_EQ(std::get<ConvexHull>(centred.shape).vertices().data(), hull.vertices().data());
    for (const Shape& shape : all_shapes()) {
        const CentredShape once = make_centred(shape).value();
        const CentredShape twice = make_centred(once.shape).value();
        EXPECT_TRUE(twice.body_from_centred.translation.isZero(1e-12)) << name_of(shape);
    }
    SeededRandom random(34);
    const Pose world = random_pose(random, 10.0);
    const Pose same = to_centred(world, make_centred(Sphere{1.0}).value().body_from_centred);
    EXPECT_EQ(same.rotation, world.rotation);
    EXPECT_EQ(same.translation, world.translation);
}

}  // namespace terrane::internal::mass_properties_test

namespace terrane::internal::contact_solver_test {

constexpr std::uint32_t kCount = 7;  // bodies; the first moves and has infinite mass
constexpr int kSweeps = 5;

struct Scene {
    std::vector<SolverBody> bodies;
    std::vector<SolverContact> contacts;
    std::vector<std::uint32_t> members;
};

/// @param heaviest mass of every other body, kilograms, with the fixed body at rest; 0: all masses are 0.5 to 4 kg
Scene make_scene(test::Random& random, double heaviest = 0.0) {
    Scene scene;
    scene.bodies.resize(kCount);
    for (std::uint32_t i = 0; i < kCount; ++i) {
        const Pose pose{random.rotation(), 3.0 * random.direction()};
        const Twist velocity{random.direction(), random.direction()};
        if (i == 0) {
            scene.bodies[i].set_fixed(pose, heaviest > 0.0 ? Twist{} : velocity);
            continue;
        }
        const Box box{{random.between(0.2, 1.0), random.between(0.2, 1.0), 0.5}};
        double mass = random.between(0.5, 4.0);
        if (heaviest > 0.0 && i % 2 == 0) mass = heaviest;
        scene.bodies[i].set(make_mass_properties(box, mass), pose, velocity);
        scene.members.push_back(i);
    }
    for (int i = 0; i < 20; ++i) {
        SolverContact contact{.a = static_cast<std::uint32_t>(random.below(kCount))};
        contact.b = (contact.a + 1 + static_cast<std::uint32_t>(random.below(kCount - 1))) % kCount;
        const Eigen::Vector3d middle = 0.5 * (scene.bodies[contact.a].pose().translation +
                                              scene.bodies[contact.b].pose().translation);
        contact.point_a = contact.point_b = middle + 0.2 * random.direction();
        contact.normal = random.direction();
        contact.friction = random.between(0.0, 1.0);
        // A non-zero initial impulse activates every contact from the first sweep on.
        contact.initial_impulse = 0.1 * contact.normal;
        scene.contacts.push_back(contact);
    }
    return scene;
}

/// Reference solver: impulses contact by contact, in world coordinates.
class Oracle {
public:
    explicit Oracle(const Scene& scene) : scene_(scene) {
        for (const SolverBody& body : scene.bodies) velocities.push_back(body.velocity);
        for (const bool is_pair : {true, false}) {
            for (const SolverContact& contact : scene.contacts) {
                if ((contact.a != 0 && contact.b != 0) == is_pair)
                    contacts_.push_back({contact, {}, {}});
            }
        }
        for (Contact& contact : contacts_) {
            const Eigen::Vector3d normal = contact.is.normal, tangent = any_tangent(normal);
            contact.directions = {normal, tangent, cross(normal, tangent)};
            contact.impulses = {0.1, 0.0, 0.0};
            push(contact.is, 0.1 * normal);
        }
    }

    void sweep(bool is_forward) {
        for (const bool is_normal : {false, true}) {
            for (std::size_t i = 0; i < contacts_.size(); ++i) {
                Contact& contact = contacts_[is_forward ? i : contacts_.size() - 1 - i];
                is_normal ? solve_normal(contact) : solve_friction(contact);
            }
        }
    }

    std::vector<Twist> velocities;

private:
    struct Contact {
        SolverContact is;
        std::array<Eigen::Vector3d, 3> directions;
        std::array<double, 3> impulses;
    };

    Eigen::Vector3d arm(std::uint32_t body, const Eigen::Vector3d& point) const {
        return point - scene_.bodies[body].pose().translation;
    }
    Twist response(std::uint32_t i, const Eigen::Vector3d& point,
                   const Eigen::Vector3d& impulse) const {
        const SolverBody& body = scene_.bodies[i];
        return {body.mass().inverse_mass * impulse,
                apply_tensor(body.pose().rotation, body.mass().inverse_inertia,
                             cross(arm(i, point), impulse))};
    }
    void push(const SolverContact& contact, const Eigen::Vector3d& impulse) {
        const Twist a = response(contact.a, contact.point_a, impulse);
        const Twist b = response(contact.b, contact.point_b, impulse);
        velocities[contact.a].linear += a.linear;
        velocities[contact.a].angular += a.angular;
        velocities[contact.b].linear -= b.linear;
        velocities[contact.b].angular -= b.angular;
    }
    Eigen::Vector3d velocity_at(std::uint32_t i, const Eigen::Vector3d& point,
                                const Twist& velocity) const {
        return velocity.linear + cross(velocity.angular, arm(i, point));
    }
    double speed(const SolverContact& contact, const Eigen::Vector3d& direction) const {
        return dot(direction, velocity_at(contact.a, contact.point_a, velocities[contact.a]) -
                                  velocity_at(contact.b, contact.point_b, velocities[contact.b]));
    }
    double mass(const SolverContact& contact, const Eigen::Vector3d& direction) const {
        const Twist a = response(contact.a, contact.point_a, direction);
        const Twist b = response(contact.b, contact.point_b, direction);
        return 1.0 / dot(direction, velocity_at(contact.a, contact.point_a, a) +
                                        velocity_at(contact.b, contact.point_b, b));
    }
    void solve_normal(Contact& contact) {
        const Eigen::Vector3d& normal = contact.directions[0];
        const double before = contact.impulses[0];
        contact.impulses[0] =
            std::max(0.0, before - mass(contact.is, normal) * speed(contact.is, normal));
        push(contact.is, (contact.impulses[0] - before) * normal);
    }
    void solve_friction(Contact& contact) {
        const Eigen::Vector3d &u = contact.directions[1], &v = contact.directions[2];
        const double speed_u = speed(contact.is, u), speed_v = speed(contact.is, v);
        const double mass_u = mass(contact.is, u), mass_v = mass(contact.is, v);
        const double limit = contact.is.friction * contact.impulses[0];
        Eigen::Vector2d before(contact.impulses[1], contact.impulses[2]);
        Eigen::Vector2d wanted = before - Eigen::Vector2d(mass_u * speed_u, mass_v * speed_v);
        if (wanted.norm() > limit) {
            wanted = before - std::min(mass_u, mass_v) * Eigen::Vector2d(speed_u, speed_v);
            if (wanted.norm() > limit) wanted *= limit / wanted.norm();
        }
        contact.impulses[1] = wanted.x();
        contact.impulses[2] = wanted.y();
        push(contact.is, (wanted - before).x() * u + (wanted - before).y() * v);
    }

    const Scene& scene_;
    std::vector<Contact> contacts_;
};

/// Largest difference from the oracle's velocities, m/s and rad/s, after a number of sweeps.
double error_after(Scene scene, int sweeps, bool is_conjugate, const Oracle& oracle) {
    std::vector<ContactRows> room(scene.contacts.size());
    std::vector<ContactDirection> directions(scene.contacts.size());
    ContactSolver solver(scene.bodies, room);
    for (const SolverContact& contact : scene.contacts) solver.add(contact);
    if (is_conjugate) solver.use_conjugate_directions(scene.members, directions);
    double removed = 0.0;
    EXPECT_TRUE(solver.solve_plastic(scene.members, 1.0 / 120.0,
                                     {.iterations = sweeps, .tolerance = 0.0}, removed));
    double worst = 0.0;
    for (std::uint32_t i = 0; i < kCount; ++i) {
        const Twist &ours = scene.bodies[i].velocity, &theirs = oracle.velocities[i];
        worst = std::max(
            {worst, (ours.linear - theirs.linear).norm(), (ours.angular - theirs.angular).norm()});
    }
    return worst;
}

TEST(ContactSolver, GivesWhatImpulsesOneAfterTheOtherGive) {
    constexpr std::uint64_t kSeed = 6;
    for (std::uint64_t run = 0; run < 50; ++run) {
        test::SeededRandom random(kSeed + run);
        const Scene scene = make_scene(random);
        Oracle oracle(scene);
        for (int sweep = 0; sweep < kSweeps; ++sweep) oracle.sweep(sweep % 2 == 0);
        EXPECT_LT(error_after(scene, kSweeps, false, oracle), 1e-11);
    }
}

TEST(ContactSolver, WithConjugateDirectionsEndsWhereManySweepsEnd) {
    constexpr std::uint64_t kSeed = 60;
    constexpr int kManySweeps = 40'000, kFewSweeps = 400, kRuns = 5;
    for (const double heaviest : {1.0, 300.0}) {
        int converged = 0;
        for (std::uint64_t run = 0; run < kRuns; ++run) {
            SCOPED_TRACE(testing::Message() << "heaviest " << heaviest);
            test::SeededRandom random(kSeed + run);
            Scene scene = make_scene(random, heaviest);
            for (SolverContact& contact : scene.contacts) contact.friction = 0.0;
            Oracle oracle(scene);
            for (int sweep = 0; sweep < kManySweeps; ++sweep) oracle.sweep(sweep % 2 == 0);
            const double error = error_after(scene, kFewSweeps, true, oracle);
            EXPECT_LE(error, std::max(1e-6, 0.5 * error_after(scene, kFewSweeps, false, oracle)));
            if (error < 1e-6) ++converged;
        }
        EXPECT_GE(converged, kRuns - 2) << "heaviest " << heaviest;
    }
}

}  // namespace terrane::internal::contact_solver_test

namespace terrane::internal::separated_pairs_test {

TEST(SeparatedPairs, AreFartherApartThanTheReachWhileTheyAreClear) {
    constexpr std::uint32_t kCount = 12;
    test::SeededRandom random(8);
    const std::array<Shape, 3> shapes{Sphere{0.5}, Capsule{0.4, 0.8}, Box{{0.6, 1.0, 0.3}}};
    std::vector<RigidBody> bodies(kCount);
    for (std::uint32_t i = 0; i < kCount; ++i) {
        bodies[i].shape = &shapes[i % shapes.size()];
        bodies[i].radius = bounding_radius(shapes[i % shapes.size()]);
        bodies[i].pose.translation = 3.0 * random.direction();
        bodies[i].pose.rotation = random.rotation();
    }
    SeparatedPairs separated;
    int clear_count = 0, asked_count = 0;
    for (int step = 0; step < 200; ++step) {
        SCOPED_TRACE("step " + std::to_string(step));
        separated.begin(bodies);
        for (std::uint32_t a = 0; a < kCount; ++a) {
            for (std::uint32_t b = a + 1; b < kCount; ++b) {
                const double distance = signed_distance(*bodies[a].shape, bodies[a].pose,
                                                        *bodies[b].shape, bodies[b].pose)
                                            .distance;
                const double reach = random.between(0.0, 0.3);
                ++asked_count;
                if (separated.is_clear({a, b}, reach)) {
                    ++clear_count;
                    EXPECT_GT(distance, reach) << a << ", " << b;
                } else if (distance > reach) {
                    separated.add({a, b}, distance);
                }
            }
        }
        separated.end();
        for (RigidBody& body : bodies) {
            const bool is_placed = random.below(50) == 0;
            const double size = is_placed ? 3.0 : 0.01;
            const Motion motion{body.pose, size * random.direction(), 0.01 * random.direction()};
            body.pose = motion.at(1.0);
        }
    }
    EXPECT_GT(2 * clear_count, asked_count);
}

}  // namespace terrane::internal::separated_pairs_test

namespace terrane::internal::islands_test {

// Flood fill: the lowest body connected to each body.
std::vector<std::uint32_t> flood(std::span<const BodyPair> links,
                                 std::span<const std::uint8_t> moves) {
    std::vector<std::uint32_t> lowest(moves.size());
    for (std::uint32_t i = 0; i < lowest.size(); ++i) lowest[i] = i;
    for (bool changed = true; changed;) {
        changed = false;
        for (const BodyPair& link : links) {
            if (moves[link.a] == 0 || moves[link.b] == 0) continue;
            const std::uint32_t least = std::min(lowest[link.a], lowest[link.b]);
            changed = changed || lowest[link.a] != least || lowest[link.b] != least;
            lowest[link.a] = lowest[link.b] = least;
        }
    }
    return lowest;
}

TEST(Islands, AreWhatTouchesThroughBodiesThatMove) {
    test::SeededRandom random(4);
    Islands islands;  // reused: a build must not affect the next
    for (int run = 0; run < 2000; ++run) {
        SCOPED_TRACE("run " + std::to_string(run));
        const int count = 1 + random.below(30);
        std::vector<std::uint8_t> moves;
        for (int i = 0; i < count; ++i) moves.push_back(random.below(5) != 0);
        std::vector<BodyPair> links;
        for (std::uint32_t a = 0; a < moves.size(); ++a) {
            for (std::uint32_t b = a + 1; b < moves.size(); ++b) {
                const bool some_moves = moves[a] != 0 || moves[b] != 0;
                if (some_moves && random.below(count + 5) < 2) links.push_back({a, b});
            }
        }
        islands.build(links, moves);

        // By the lowest body of their island.
        std::map<std::uint32_t, std::vector<std::uint32_t>> expected_bodies, expected_links;
        const std::vector<std::uint32_t> lowest = flood(links, moves);
        for (std::uint32_t i = 0; i < moves.size(); ++i) {
            if (moves[i] != 0) expected_bodies[lowest[i]].push_back(i);
        }
        for (std::uint32_t i = 0; i < links.size(); ++i) {
            const std::uint32_t mover = moves[links[i].a] != 0 ? links[i].a : links[i].b;
            expected_links[lowest[mover]].push_back(i);
        }
        ASSERT_EQ(islands.count(), expected_bodies.size());
        std::size_t island = 0;
        for (const auto& [least, members] : expected_bodies) {
            EXPECT_TRUE(std::ranges::equal(islands.bodies(island), members));
            EXPECT_TRUE(std::ranges::is_permutation(islands.links(island), expected_links[least]));
            ++island;
        }
    }
}

}  // namespace terrane::internal::islands_test
