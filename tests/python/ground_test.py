# SPDX-License-Identifier: MIT
"""Heights and rays in batches, against the samples."""
import unittest

import numpy as np

from grounds import SEED, loaded, main, small_fractal, triangle_height
from terrane import QueryStatus


class Ground(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.source = small_fractal()
        cls.terrain = loaded(cls.source)
        cls.ground = cls.terrain.frame.ground
        cls.random = np.random.default_rng(SEED)

    def chunks(self):
        resident = self.terrain.resident
        return [resident.chunk(i) for i in range(len(resident)) if resident.keys[i, 0] == self.terrain.contact_level]

    def test_heights_and_normals_are_those_of_the_samples(self):
        x, y = self.random.uniform(-100, 100, (2, 500))
        answer = self.ground.heights(x, y)
        self.assertTrue((answer.status == QueryStatus.ok).all())
        for i in range(500):
            chunk = next(c for c in self.chunks() if 0 <= x[i] - c.origin[0] < 128 * c.spacing
                         and 0 <= y[i] - c.origin[1] < 128 * c.spacing)
            height, normal = triangle_height(chunk, x[i], y[i])
            self.assertAlmostEqual(answer.height[i], height, delta=1e-9, msg=f"seed {SEED}, place {x[i]}, {y[i]}")
            self.assertLess(np.abs(answer.normal[i] - normal).max(), 1e-9, f"seed {SEED}, place {x[i]}, {y[i]}")

    def test_the_true_surface_is_within_the_error(self):
        x, y = self.random.uniform(-100, 100, (2, 2000))
        answer = self.ground.heights(x, y)
        over = np.abs(answer.height - self.source.heights(x, y)) - answer.error_m
        self.assertLessEqual(over.max(), 1e-9, f"seed {SEED}")
        self.assertGreater(answer.error_m.min(), 0)

    def test_answers_have_the_shape_of_the_question(self):
        x, y = np.meshgrid(np.linspace(-50, 50, 7), np.linspace(-40, 40, 5))
        answer = self.ground.heights(x, y)
        self.assertEqual(answer.height.shape, (5, 7))
        self.assertEqual(answer.normal.shape, (5, 7, 3))
        self.assertEqual(answer.status.dtype, np.int8)
        self.assertEqual(answer.filled.dtype, bool)
        single = self.ground.heights(x[2, 3], y[2, 3])
        self.assertEqual(single.height.shape, ())
        self.assertEqual(float(single.height), answer.height[2, 3])
        empty = self.ground.heights(np.empty(0), np.empty(0))
        self.assertEqual((empty.height.shape, empty.normal.shape), ((0,), (0, 3)))

    def test_absent_ground_is_a_status_and_nan(self):
        x = np.array([0.0, 1e6, 900.0, np.nan, np.inf])
        answer = self.ground.heights(x, np.zeros(5))
        wanted = [QueryStatus.ok, QueryStatus.outside, QueryStatus.not_resident, QueryStatus.invalid,
                  QueryStatus.invalid]
        self.assertEqual(answer.status.tolist(), wanted)
        self.assertTrue(np.isfinite(answer.height[0]))
        for numbers in (answer.height, answer.normal, answer.error_m):
            self.assertTrue(np.isnan(numbers[1:]).all())
        rays = self.ground.rays([[0, 0, 1e3], [1e6, 0, 1e3], [0, 0, np.nan]], [[0, 0, -1e3], [1e6, 0, -1e3], [0, 0, 0]])
        self.assertEqual(rays.status.tolist(), [QueryStatus.ok, QueryStatus.miss, QueryStatus.invalid])
        self.assertTrue(np.isnan(rays.point_world[1:]).all())

    def test_heights_below_are_those_below(self):
        x, y = self.random.uniform(-100, 100, (2, 100))
        top = self.ground.heights(x, y)
        below = self.ground.heights_below(x, y, top.height + 1)
        np.testing.assert_array_equal(below.height, top.height)
        above = self.ground.heights_below(x, y, top.height - 1)
        self.assertTrue((above.status == QueryStatus.miss).all())

    def test_rays_end_where_a_march_over_the_heights_does(self):
        start = np.array([0.0, 0.0, float(self.ground.heights(0.0, 0.0).height) + 30])
        ends = np.column_stack([self.random.uniform(-100, 100, (200, 2)), np.full(200, -200.0)])
        rays = self.ground.rays(start, ends)
        self.assertTrue((rays.status == QueryStatus.ok).all())
        self.assertLess(np.abs(start + rays.fraction[:, None] * (ends - start) - rays.point_world).max(), 1e-9)
        at = self.ground.heights(*np.ascontiguousarray(rays.point_world[:, :2].T))
        self.assertLess(np.abs(at.height - rays.point_world[:, 2]).max(), 1e-6)
        for share in np.linspace(0, 1, 50, endpoint=False):
            p = start + share * rays.fraction[:, None] * (ends - start)
            self.assertTrue((p[:, 2] >= self.ground.heights(p[:, 0], p[:, 1]).height - 1e-9).all(), f"seed {SEED}")

    def test_one_ray_has_no_leading_axis(self):
        ray = self.ground.rays((0, 0, 1e3), (0, 0, -1e3))
        self.assertEqual((ray.fraction.shape, ray.point_world.shape), ((), (3,)))

    def test_a_ground_outlives_its_terrain(self):
        terrain = loaded(self.source)
        ground = terrain.frame.ground
        chunk = terrain.resident.chunk(0)
        heights = chunk.heights
        before = ground.heights(1.0, 2.0).height
        terrain.close()
        del terrain, chunk
        self.assertEqual(ground.heights(1.0, 2.0).height, before)
        self.assertGreater(np.abs(heights).max(), 0)


main()
