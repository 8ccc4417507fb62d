// SPDX-License-Identifier: MIT
#include "world/solver/contact_solver.h"

#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace terrane::internal {
namespace contact_solver_test {

constexpr std::uint32_t kCount = 7;  // bodies; the first has infinite mass and moves
constexpr int kSweeps = 5;

struct Scene {
    std::vector<SolverBody> bodies;
    std::vector<SolverContact> contacts;
    std::vector<std::uint32_t> members;
};

/// @param heaviest mass of every other body, kilograms, and the fixed body is at rest; 0: all weigh 0.5 to 4 kg
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
        SolverContact contact;
        contact.a = static_cast<std::uint32_t>(random.below(kCount));
        contact.b = (contact.a + 1 + static_cast<std::uint32_t>(random.below(kCount - 1))) % kCount;
        const Eigen::Vector3d middle = 0.5 * (scene.bodies[contact.a].pose().translation +
                                              scene.bodies[contact.b].pose().translation);
        contact.point_a = contact.point_b = middle + 0.2 * random.direction();
        contact.normal = random.direction();
        contact.friction = random.between(0.0, 1.0);
        // With an impulse to begin with, all contacts are solved from the first sweep on.
        contact.initial_impulse = 0.1 * contact.normal;
        scene.contacts.push_back(contact);
    }
    return scene;
}

/// Impulses on one contact after the other, in world coordinates.
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
    double speed(const SolverContact& contact, const Eigen::Vector3d& direction) const {
        const Twist &a = velocities[contact.a], &b = velocities[contact.b];
        return dot(direction, a.linear + cross(a.angular, arm(contact.a, contact.point_a)) -
                                  b.linear - cross(b.angular, arm(contact.b, contact.point_b)));
    }
    double mass(const SolverContact& contact, const Eigen::Vector3d& direction) const {
        const Twist a = response(contact.a, contact.point_a, direction);
        const Twist b = response(contact.b, contact.point_b, direction);
        return 1.0 /
               dot(direction, a.linear + cross(a.angular, arm(contact.a, contact.point_a)) +
                                  b.linear + cross(b.angular, arm(contact.b, contact.point_b)));
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

TEST(ContactSolver, GivesWhatImpulsesOneAfterTheOtherGive) {
    constexpr std::uint64_t kSeed = 6;
    for (std::uint64_t run = 0; run < 50; ++run) {
        SCOPED_TRACE("seed " + std::to_string(kSeed) + ", run " + std::to_string(run));
        test::Random random(kSeed + run);
        Scene scene = make_scene(random);
        Oracle oracle(scene);
        for (int sweep = 0; sweep < kSweeps; ++sweep) oracle.sweep(sweep % 2 == 0);

        std::vector<ContactRows> room(scene.contacts.size());
        ContactSolver solver(scene.bodies, room);
        for (const SolverContact& contact : scene.contacts) solver.add(contact);
        double removed = 0.0;
        ASSERT_TRUE(solver.solve_plastic(scene.members, 1.0 / 120.0,
                                         {.iterations = kSweeps, .tolerance = 0.0}, removed));
        for (std::uint32_t i = 0; i < kCount; ++i) {
            const Twist &ours = scene.bodies[i].velocity, &theirs = oracle.velocities[i];
            EXPECT_LT((ours.linear - theirs.linear).norm(), 1e-11) << i;
            EXPECT_LT((ours.angular - theirs.angular).norm(), 1e-11) << i;
        }
    }
}

/// Largest difference of velocities from an oracle's, m/s and rad/s, after so many sweeps without friction.
double error_after(Scene scene, int sweeps, bool is_conjugate, const Oracle& oracle) {
    std::vector<ContactRows> room(scene.contacts.size());
    std::vector<ContactDirection> directions(scene.contacts.size());
    ContactSolver solver(scene.bodies, room);
    for (const SolverContact& contact : scene.contacts) solver.add(contact);
    if (is_conjugate) solver.use_conjugate_directions(scene.members, directions);
    double removed = 0.0;
    solver.solve_plastic(scene.members, 1.0 / 120.0, {.iterations = sweeps, .tolerance = 0.0},
                         removed);
    double worst = 0.0;
    for (const std::uint32_t i : scene.members) {
        const Twist &ours = scene.bodies[i].velocity, &theirs = oracle.velocities[i];
        worst = std::max(
            {worst, (ours.linear - theirs.linear).norm(), (ours.angular - theirs.angular).norm()});
    }
    return worst;
}

TEST(ContactSolver, WithConjugateDirectionsEndsWhereManySweepsEnd) {
    constexpr std::uint64_t kSeed = 60;
    constexpr int kManySweeps = 40'000, kFewSweeps = 400, kRuns = 5;
    for (const double heaviest : {1.0, 300.0}) {
        int converged = 0;
        for (std::uint64_t run = 0; run < kRuns; ++run) {
            SCOPED_TRACE(testing::Message() << "seed " << kSeed + run << ", heaviest " << heaviest);
            test::Random random(kSeed + run);
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

}  // namespace contact_solver_test
}  // namespace terrane::internal
