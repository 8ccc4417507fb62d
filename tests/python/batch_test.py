# SPDX-License-Identifier: MIT
"""Heights and rays on several threads, and scans: the answers of single calls, bit for bit."""
import unittest

import numpy as np

import terrane
from grounds import SEED, loaded, main, random_rotations, small_fractal
from terrane import NO_BODY, LidarStatus, Shape


class Batches(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.ground = loaded(small_fractal()).frame.ground
        random = np.random.default_rng(SEED)
        cls.x, cls.y = random.uniform(-120, 120, (2, 5000))
        cls.x[::500] = np.nan
        cls.y[1::500] = 1e7

    def check(self, found, wanted):
        for field, ours, theirs in zip(found._fields, found, wanted):
            np.testing.assert_array_equal(ours, theirs, err_msg=f"{field}, seed {SEED}")

    def test_heights_are_those_of_the_ground_with_any_number_of_workers(self):
        wanted = self.ground.heights(self.x, self.y)
        self.assertGreater(len(np.unique(wanted.status)), 2)
        for workers in (1, 3):
            with terrane.GroundBatch(worker_count=workers) as batch:
                self.check(batch.heights(self.ground, self.x, self.y), wanted)
                grid = batch.heights(self.ground, self.x.reshape(50, 100), self.y.reshape(50, 100))
                self.assertEqual((grid.height.shape, grid.normal.shape), ((50, 100), (50, 100, 3)))
                out = batch.heights(self.ground, self.y, self.x)
                self.assertIs(batch.heights(self.ground, self.x, self.y, out=out), out)
                self.check(out, wanted)

    def test_rays_are_those_of_the_ground(self):
        start = np.column_stack([self.x, self.y, np.full(5000, 300.0)])
        end = np.column_stack([self.y, self.x, np.full(5000, -300.0)])
        with terrane.GroundBatch(worker_count=2) as batch:
            self.check(batch.rays(self.ground, start, end), self.ground.rays(start, end))
            self.check(batch.rays(self.ground, (0, 0, 300), end), self.ground.rays((0, 0, 300), end))
            self.check(batch.rays(self.ground, (0, 0, 300), (1, 2, -300)), self.ground.rays((0, 0, 300), (1, 2, -300)))
            self.check(batch.rays(self.ground, start[:0], end[:0]), self.ground.rays(start[:0], end[:0]))

    def test_what_is_out_of_range_or_closed_is_refused(self):
        with self.assertRaisesRegex(ValueError, "worker_count"):
            terrane.GroundBatch(worker_count=0)
        batch = terrane.GroundBatch()
        with self.assertRaisesRegex(ValueError, "same shape"):
            batch.heights(self.ground, self.x, self.y[1:])
        batch.close()
        with self.assertRaisesRegex(ValueError, "this GroundBatch is closed"):
            batch.heights(self.ground, self.x, self.y)


class Scans(unittest.TestCase):
    def test_the_need_of_a_sensor_loads_its_ground(self):
        directions = terrane.lidar_grid(azimuth_count=60, azimuth_step=2 * np.pi / 60, elevation_count=8,
                                        first_elevation=-0.8, elevation_step=0.1)
        source = small_fractal()
        position = np.array([300.0, -400.0, source.heights(300.0, -400.0) + 2.0])
        world = terrane.World()
        world.add(Shape.sphere(1.0), position + (0, 0, 9))
        lidar = terrane.Lidar(directions, max_range=300.0)

        def statuses(needs):
            return lidar.scan(terrane.Terrain(source, worker_count=0).load([], needs, 0.0).ground, position).status

        self.assertIn(int(LidarStatus.not_resident), statuses(world.needs()))
        needs = world.needs() + lidar.need(position, (10, 0, 0))
        self.assertEqual((len(needs), len(world.needs())), (2, 1))
        found = statuses(needs)
        self.assertNotIn(int(LidarStatus.not_resident), found)
        self.assertIn(int(LidarStatus.ground), found)

    def test_a_scan_is_the_rays_of_the_world(self):
        ground = loaded(small_fractal()).frame.ground
        top = float(ground.heights(0.0, 0.0).height)
        world = terrane.World()
        ball = world.add(Shape.sphere(1.0), (5, 0, top + 2), type="static")
        directions = terrane.lidar_grid(azimuth_count=90, azimuth_step=2 * np.pi / 90, elevation_count=12,
                                        first_elevation=-0.8, elevation_step=0.1)
        self.assertEqual(directions.shape, (1080, 3))
        self.assertLess(np.abs(np.linalg.norm(directions, axis=1) - 1).max(), 1e-12)
        _, turns = random_rotations(np.random.default_rng(SEED), 2)
        position = np.array([0.0, 0.0, top + 2.0])
        with terrane.Lidar(directions, min_range=0.5, max_range=60.0, worker_count=2) as lidar:
            self.assertEqual(len(lidar), 1080)
            for turn in (np.eye(3), turns[0]):
                scan = lidar.scan(ground, position, turn, world)
                along = directions @ turn.T
                rays = world.rays(ground, position + 0.5 * along, position + 60.0 * along)
                met = np.isin(scan.status, [LidarStatus.ground, LidarStatus.body])
                np.testing.assert_array_equal(met, rays.hit)
                self.assertTrue(met.any() and not met.all())
                np.testing.assert_array_equal(scan.body, rays.body)
                self.assertLess(np.abs(scan.point_world - rays.point_world)[met].max(), 1e-9)
                self.assertLess(np.abs(scan.range[met] - (0.5 + 59.5 * rays.fraction[met])).max(), 1e-9)
                self.assertTrue(np.isnan(scan.range[~met]).all())
                self.assertIn(ball, scan.body[scan.status == LidarStatus.body])
            alone = lidar.scan(ground, position)
            self.assertTrue((alone.body == NO_BODY).all())
            self.assertNotIn(int(LidarStatus.body), alone.status)
            with self.assertRaisesRegex(ValueError, "one pose"):
                lidar.scan(ground, np.zeros((2, 3)))
        with self.assertRaisesRegex(ValueError, "this Lidar is closed"):
            lidar.scan(ground, position)
        with self.assertRaisesRegex(ValueError, "this Lidar is closed"):
            lidar.need(position)
        with self.assertRaises(ValueError):
            terrane.Lidar(2 * directions)
        with self.assertRaises(ValueError):
            terrane.lidar_grid(azimuth_count=0)


main()
