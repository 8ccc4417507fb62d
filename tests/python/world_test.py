# SPDX-License-Identifier: MIT
"""Worlds: bodies, vehicles, characters; what is refused."""
import unittest

import numpy as np

import terrane
from grounds import SEED, loaded, main, small_fractal
from terrane import NO_BODY, BodyCondition, ContactPhase, Shape


class World(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.ground = loaded(small_fractal()).frame.ground

    def above(self, xy, clearance):
        return np.column_stack([xy, self.ground.heights(xy[:, 0], xy[:, 1]).height + clearance])

    def test_a_ball_falls_freely_and_then_lies_on_the_ground(self):
        world = terrane.World(gravity=(0, 0, -10))
        ball = world.add(Shape.sphere(0.5), self.above(np.zeros((1, 2)), 100.0)[0])
        self.assertIsInstance(ball, int)
        before = world.state(ball).position[2]
        for _ in range(60):
            world.step(self.ground, 1 / 60)
        state = world.state(ball)
        self.assertAlmostEqual(state.velocity[2], -10.0, delta=1e-6)
        self.assertAlmostEqual(before - state.position[2], 5.0, delta=0.1)
        for _ in range(900):
            report = world.step(self.ground, 1 / 60)
            self.assertEqual(report.too_deep, 0)
        gap = self.ground.distances(Shape.sphere(0.5), world.state(ball).position).distance
        self.assertLess(abs(gap), 0.02)

    def test_no_body_is_deeper_than_its_tolerance(self):
        random = np.random.default_rng(SEED)
        world = terrane.World()
        shape = Shape.box((0.4, 0.3, 0.2))
        bodies = world.add(shape, self.above(random.uniform(-60, 60, (100, 2)), 5.0),
                           velocity=random.normal(0, 20, (100, 3)), mass=5.0)
        self.assertEqual((bodies.shape, bodies.dtype), ((100,), np.uint64))
        for _ in range(120):
            report = world.step(self.ground, 1 / 60)
            self.assertEqual((report.too_deep, report.lost_time), (0, 0.0))
            self.assertLessEqual(report.max_depth_m, shape.contact_tolerance)
        states = world.states()
        np.testing.assert_array_equal(states.body, bodies)
        depth = self.ground.distances(shape, states.position, states.rotation).distance
        self.assertGreater(np.nanmin(depth), -shape.contact_tolerance - 1e-9)

    def test_the_same_calls_give_the_same_bits_and_a_saved_world_goes_on(self):
        def run(world, steps):
            for _ in range(steps):
                world.step(self.ground, 1 / 60)
            return world.state_hash

        def make(workers):
            world = terrane.World(worker_count=workers)
            xy = np.random.default_rng(SEED).uniform(-20, 20, (50, 2))
            world.add(Shape.capsule(0.3, 0.4), self.above(xy, 2.0))
            return world

        world = make(1)
        run(world, 30)
        saved = world.save()
        end = run(world, 30)
        self.assertEqual(run(make(2), 60), end)
        self.assertEqual(run(terrane.World.load(saved), 30), end)
        for bad in (b"", saved[:-1], b"x" * 100):
            with self.assertRaises(ValueError):
                terrane.World.load(bad)
        with self.assertRaises(TypeError):
            terrane.World.load("text")

    def test_numbers_of_removed_and_unknown_bodies_are_refused(self):
        world = terrane.World()
        a = world.add(Shape.sphere(0.5), (0, 0, 500))
        world.remove(a)
        b = world.add(Shape.sphere(0.5), (0, 0, 500))
        self.assertNotEqual(a, b)
        self.assertFalse(world.contains(a))
        self.assertTrue(world.contains(b))
        for bad in (a, NO_BODY, 77):
            for call in (world.remove, world.wake, lambda body: world.set_velocity(body, (0, 0, 1)),
                         lambda body: world.teleport(body, (0, 0, 0)), lambda body: world.add_force(body, (0, 0, 1)),
                         world.state, world.settings, world.vehicle, world.character):
                with self.assertRaises(ValueError):
                    call(bad)
        with self.assertRaises(TypeError):
            world.remove(-1)

    def test_a_body_is_read_by_its_number(self):
        world = terrane.World()
        arguments = {"type": "kinematic", "mass": 3.0, "friction": 0.1, "restitution": 0.5, "contact_tolerance": 0.02,
                     "layers": 2, "collides_with": 5, "is_sensor": True, "rotates": False}
        world.add(Shape.sphere(0.5), (0, 0, 500))
        box = world.add(Shape.box((1, 2, 3)), (7, 8, 900), (0, 0, 0, 1), velocity=(1, 2, 3), angular_velocity=(4, 5, 6),
                        **{**arguments, "rotates": True})
        state = world.state(box)
        for found, wanted in zip(state[:4], ((7, 8, 900), np.diag([-1, -1, 1]), (1, 2, 3), (4, 5, 6))):
            np.testing.assert_array_equal(found, wanted)
        self.assertEqual(state.condition, BodyCondition.awake)
        settings = world.settings(box)
        wanted = Shape.box((1, 2, 3))
        self.assertEqual((settings.shape.kind, settings.shape.bounding_radius, settings.shape.smallest_half_extent),
                         (wanted.kind, wanted.bounding_radius, wanted.smallest_half_extent))
        self.assertEqual(settings._asdict(), {**arguments, "rotates": True, "shape": settings.shape})
        other = world.add(position=(0, 0, 600), **settings._replace(rotates=False)._asdict())
        self.assertFalse(world.settings(other).rotates)

    def test_bodies_are_added_all_or_none(self):
        world = terrane.World()
        with self.assertRaisesRegex(ValueError, "translation.*nan"):
            world.add(Shape.sphere(0.5), [[0, 0, 500], [0, 0, np.nan]])
        self.assertTrue((world.states().condition == BodyCondition.removed).all())
        for settings, words in (({"mass": -1.0}, "mass"), ({"type": "solid"}, "type .*solid"),
                                ({"friction": np.nan}, "friction"), ({"type": "dynamic", "is_sensor": True}, "sensor")):
            with self.assertRaisesRegex(ValueError, words):
                world.add(Shape.sphere(0.5), (0, 0, 500), **settings)
        self.assertEqual(world.add(Shape.sphere(0.5), np.zeros((0, 3))).shape, (0,))

    def test_forces_impulses_and_teleports_move_a_body(self):
        world = terrane.World(gravity=(0, 0, 0))
        ball = world.add(Shape.sphere(0.5), (0, 0, 500), mass=2.0)
        world.apply_impulse(ball, (4, 0, 0), (0, 0, 500))
        np.testing.assert_allclose(world.state(ball).velocity, (2, 0, 0), atol=1e-12)
        world.add_force(ball, (0, 120, 0))
        world.add_torque(ball, (0, 0, 1))
        world.step(self.ground, 1 / 60)
        np.testing.assert_allclose(world.state(ball).velocity, (2, 1, 0), atol=1e-9)
        self.assertGreater(world.state(ball).angular_velocity[2], 0)
        world.teleport(ball, (5, 6, 700), (0, 0, 0, 1), velocity=(0, 0, 3))
        np.testing.assert_array_equal(world.state(ball).position, (5, 6, 700))
        np.testing.assert_array_equal(world.state(ball).rotation, np.diag([-1, -1, 1]))
        lift = world.add(Shape.box((1, 1, 0.1)), (0, 0, 600), type="kinematic")
        world.move_kinematic(lift, (0, 0, 601), dt=0.1)
        world.step(self.ground, 0.1)
        self.assertAlmostEqual(world.state(lift).position[2], 601.0)

    def test_rays_meet_bodies_before_ground(self):
        world = terrane.World()
        top = float(self.ground.heights(0.0, 0.0).height)
        ball = world.add(Shape.sphere(0.5), (0, 0, top + 50), type="static")
        answer = world.rays(self.ground, [[0, 0, top + 100], [20, 0, top + 100], [0, 0, top + 100]],
                            [[0, 0, top - 100], [20, 0, top - 100], [0, 0, top + 99]])
        self.assertEqual(answer.hit.tolist(), [True, True, False])
        self.assertEqual(answer.body.tolist(), [ball, NO_BODY, NO_BODY])
        self.assertAlmostEqual(answer.point_world[0, 2], top + 50.5)
        seen = world.rays(self.ground, (0, 0, top + 100), (0, 0, top - 100), except_body=ball)
        self.assertEqual(int(seen.body), NO_BODY)
        self.assertAlmostEqual(float(seen.point_world[2]), top, delta=1e-6)

    def test_contacts_are_reported(self):
        world = terrane.World(report_contacts=True)
        ball = world.add(Shape.sphere(0.5), self.above(np.zeros((1, 2)), 0.6)[0])
        phases = []
        for _ in range(60):
            world.step(self.ground, 1 / 60)
            events = world.contact_events()
            phases += events.phase.tolist()
            self.assertTrue((events.a == ball).all() and (events.b == NO_BODY).all())
        self.assertEqual(phases[0], ContactPhase.began)
        self.assertIn(ContactPhase.stayed, phases)

    def test_bodies_without_ground_are_parked(self):
        terrain = terrane.Terrain(small_fractal(), worker_count=0)
        terrain.update([], None, 0.0)
        world = terrane.World()
        ball = world.add(Shape.sphere(0.5), (300, 300, 0))
        self.assertEqual(world.step(terrain.frame.ground, 1 / 60).parked, 1)
        self.assertEqual(world.state(ball).condition, BodyCondition.parked)
        frame = terrain.load([], world.needs(), 0.1)
        self.assertEqual((frame.groundless_bodies, world.step(frame.ground, 1 / 60).parked), (0, 0))

    def test_bad_steps_and_closed_worlds_are_an_error(self):
        world = terrane.World()
        for dt in (0.0, -1.0, 20.0, np.nan):
            with self.assertRaisesRegex(ValueError, "dt"):
                world.step(self.ground, dt)
        with self.assertRaises(TypeError):
            world.step(None, 0.1)
        with world:
            pass
        for call in (world.states, world.save, lambda: world.step(self.ground, 0.1), world.needs):
            with self.assertRaisesRegex(ValueError, "this World is closed"):
                call()


class Journeys(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.ground = loaded(small_fractal(amplitude=5.0)).frame.ground

    def test_a_truck_follows_a_path_to_its_end(self):
        world = terrane.World()
        top = float(self.ground.heights(-40.0, 0.0).height)
        truck = world.add_vehicle(terrane.make_truck(), (-40, 0, top + 1.2))
        driver = terrane.PathDriver([[-40, 0], [0, 0], [30, 10]], cruise_speed=10.0)
        for _ in range(60 * 15):
            driver.drive(world, truck, 1 / 60)
            world.step(self.ground, 1 / 60)
        vehicle = world.vehicle(truck)
        self.assertEqual(driver.status, terrane.DriverStatus.finished)
        self.assertEqual((driver.path_share, driver.stuck_time, driver.stuck_place), (1.0, 0.0, None))
        self.assertFalse(vehicle.is_rolled_over)
        self.assertLess(np.linalg.norm(vehicle.position[:2] - (30, 10)), 8)
        self.assertEqual((vehicle.wheel_centre.shape, vehicle.load.shape), ((4, 3), (4,)))
        self.assertTrue(vehicle.in_contact.any())
        self.assertAlmostEqual(vehicle.load.sum() / (3500 * 9.81), 1.0, delta=0.3)

    def test_settings_of_vehicles_are_checked_and_used(self):
        settings = terrane.make_six_wheeler()
        self.assertEqual(len(settings.axles), 3)
        settings.mass = 1000.0
        settings.chassis_half_extents = (2, 1, 0.5)
        settings.axles = [(1.5, 1.8, 0.5, True, 0.0), (-1.5, 1.8, 0.0, True, 0.0)]
        world = terrane.World()
        car = world.add_vehicle(settings, (0, 0, 100))
        self.assertEqual(len(world.vehicle(car).load), 4)
        world.set_controls(car, throttle=1.0, steer=-0.5)
        settings.wheel_radius = -1.0
        with self.assertRaisesRegex(ValueError, "wheel_radius"):
            world.add_vehicle(settings, (0, 0, 100))
        with self.assertRaises(TypeError):
            settings.axles = [(1, 2)]
        with self.assertRaises(ValueError):
            world.set_controls(123)
        with self.assertRaises(ValueError):
            terrane.PathDriver([[0, 0]])
        self.assertEqual(len(terrane.make_tracked().axles), 5)

    def test_a_character_walks(self):
        world = terrane.World()
        top = float(self.ground.heights(0.0, 0.0).height)
        walker = world.add_character((0, 0, top + 1.0))
        for _ in range(180):
            world.walk(walker, (2.0, 0.0))
            world.step(self.ground, 1 / 60)
        state = world.character(walker)
        self.assertTrue(state.stands)
        self.assertGreater(state.position[0], 3.0)
        self.assertEqual(state.support, NO_BODY)
        with self.assertRaises(ValueError):
            world.add_character((0, 0, np.nan))


main()
