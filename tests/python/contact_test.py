# SPDX-License-Identifier: MIT
"""Contacts, distances and casts of shapes in batches, against numpy and the program."""
import json
import os
import subprocess
import unittest

import numpy as np

import terrane
from grounds import PROGRAM, SEED, loaded, main, random_rotations, small_fractal
from terrane import QueryStatus, Shape


class OnGround(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.ground = loaded(small_fractal()).frame.ground
        random = np.random.default_rng(SEED)
        xy = random.uniform(-80, 80, (40, 2))
        height = cls.ground.heights(*np.ascontiguousarray(xy.T)).height
        cls.places = np.column_stack([xy, height + random.uniform(-0.3, 3.0, 40)])

    def nearest(self, centre, reach):
        """Distance of a point from the surface, from a fine grid of places, and how far off that may be."""
        step = np.linspace(-reach, reach, 601)
        x, y = np.meshgrid(centre[0] + step, centre[1] + step)
        p = np.stack([x, y, self.ground.heights(x, y).height], axis=-1)
        return np.linalg.norm(p - centre, axis=-1).min()

    def test_distances_of_spheres_are_those_of_a_search(self):
        high = self.places[self.places[:, 2] > self.ground.heights(
            self.places[:, 0], self.places[:, 1]).height + 0.5][:12]
        answer = self.ground.distances(Shape.sphere(0.25), high)
        self.assertTrue((answer.status == QueryStatus.ok).all())
        for centre, distance, lower in zip(high, answer.distance, answer.lower_bound):
            found = self.nearest(centre, 4.0) - 0.25
            self.assertLessEqual(distance, found + 1e-9, f"seed {SEED}")
            self.assertGreater(distance, found - 0.03, f"seed {SEED}")
            self.assertEqual(lower, distance)
        along = high - answer.normal * (0.25 + answer.distance)[:, None]
        at = self.ground.heights(*np.ascontiguousarray(along[:, :2].T))
        self.assertLess(np.abs(at.height - along[:, 2]).max(), 1e-6)

    def test_contacts_of_a_pose_are_those_of_the_pose_alone(self):
        shape = Shape.box((0.5, 0.4, 0.3))
        quaternions, matrices = random_rotations(np.random.default_rng(SEED), 40)
        all_ = self.ground.contacts(shape, self.places, quaternions, margin=0.2)
        same = self.ground.contacts(shape, self.places, matrices, margin=0.2)
        self.assertEqual((all_.first[0], all_.first[-1]), (0, len(all_.depth)))
        self.assertGreater(len(all_.depth), 10)
        self.assertLess(np.abs(all_.depth - same.depth).max(), 1e-9)
        for i in range(40):
            one = self.ground.contacts(shape, self.places[i], quaternions[i], margin=0.2)
            part = slice(all_.first[i], all_.first[i + 1])
            np.testing.assert_array_equal(all_.depth[part], one.depth)
            np.testing.assert_array_equal(all_.point_world[part], one.point_world)
            self.assertEqual(all_.lift[i], one.lift[0])
            self.assertTrue((np.diff(all_.depth[part]) <= 0).all())

    def test_too_many_contacts_are_truncated_and_said_so(self):
        flat = terrane.fractal(amplitude=0.0, root_size_log2=10, root_count=(1, 1), first_root=(0, 0))
        ground = loaded(flat, (10, 10, 90, 90)).frame.ground
        box = Shape.box((0.5, 0.5, 0.5))
        answer = ground.contacts(box, (50.3, 50.2, 0.49), max_contacts=2)
        self.assertEqual((answer.status[0], len(answer.depth)), (QueryStatus.truncated, 2))
        answer = ground.contacts(box, (50.3, 50.2, 0.49))
        self.assertEqual(answer.status[0], QueryStatus.ok)
        np.testing.assert_allclose(answer.depth, 0.01, atol=1e-9)
        np.testing.assert_allclose(answer.normal, [[0, 0, 1]] * 4, atol=1e-12)

    def test_casts_stop_where_the_shape_touches(self):
        shape = Shape.sphere(0.3)
        start = self.places + (0, 0, 20)
        casts = self.ground.casts(shape, start, (3.0, 1.0, -40.0))
        self.assertTrue(casts.hit.all())
        at = start + casts.fraction[:, None] * np.array([3.0, 1.0, -40.0])
        gap = self.ground.distances(shape, at).distance
        self.assertLess(np.abs(gap).max(), 2e-4)
        away = self.ground.casts(shape, start, (0.0, 0.0, 5.0))
        self.assertFalse(away.hit.any())
        self.assertTrue(np.isnan(away.point_world).all() and (away.fraction == 1).all())
        turned = self.ground.casts(Shape.capsule(0.2, 1.0), start, (0, 0, -40.0), rotation_vector=(1.5, 0, 0))
        self.assertTrue(turned.hit.all())

    def test_bad_poses_are_a_status_and_bad_arguments_an_error(self):
        shape = Shape.sphere(0.3)
        top = float(self.ground.heights(0.0, 0.0).height)
        answer = self.ground.distances(shape, [[0, 0, np.nan], [0, 0, top + 20.0], [1e7, 0, 0], [900.0, 900.0, 0]],
                                       max_distance=60.0)
        self.assertEqual(answer.status.tolist(), [QueryStatus.invalid, QueryStatus.ok, QueryStatus.ok,
                                                  QueryStatus.not_resident])
        self.assertEqual(answer.has_ground.tolist()[:3], [False, True, False])
        self.assertTrue(np.isnan(answer.distance[[0, 2]]).all())
        skewed = np.eye(3)
        skewed[0, 1] = 0.1
        self.assertEqual(self.ground.contacts(shape, (0, 0, 0), skewed).status[0], QueryStatus.invalid)
        for call, words in ((lambda: self.ground.contacts(shape, np.zeros((2, 3)), (2, 0, 0, 0)), "unit length"),
                            (lambda: self.ground.contacts(shape, np.zeros((2, 3)), np.zeros((3, 4)) + 0.5), "rows"),
                            (lambda: self.ground.contacts(shape, np.zeros((2, 3)), np.zeros((2, 3))), r"\(n, 3, 3\)"),
                            (lambda: self.ground.contacts(shape, np.zeros((2, 3)), margin=-1), "margin"),
                            (lambda: self.ground.contacts(shape, np.zeros((2, 3)), max_contacts=0), "max_contacts"),
                            (lambda: Shape.compound([]), "part"),
                            (lambda: Shape.from_triangles(np.eye(3), [[0, 1, 3]]), r"triangles\[0\].* 3"),
                            (lambda: Shape.box((1, -1, 1)), "half_extents")):
            with self.assertRaisesRegex(ValueError, words):
                call()
        with self.assertRaises(TypeError):
            self.ground.contacts("a ball", (0, 0, 0))
        with self.assertRaises(TypeError):
            Shape.from_triangles(np.eye(3), [[0.5, 1, 2]])
        empty = self.ground.contacts(shape, np.zeros((0, 3)))
        self.assertEqual((empty.first.tolist(), len(empty.status)), ([0], 0))

    @unittest.skipUnless(os.path.exists(PROGRAM), "the program is not built")
    def test_answers_are_those_of_the_program(self):
        ground = loaded(terrane.fractal(seed=5)).frame.ground
        random = np.random.default_rng(SEED)
        xy = random.uniform(-60, 60, (30, 2))
        height = ground.heights(*np.ascontiguousarray(xy.T)).height
        places = np.column_stack([xy, height + random.uniform(-0.5, 1.5, 30)])
        quaternions, _ = random_rotations(random, 30)
        shape = {"box": {"half_extents": [0.6, 0.5, 0.4]}}
        lines = []
        for place, turn in zip(places.tolist(), quaternions.tolist()):
            for op in ("distance", "find"):
                lines.append({"op": op, "shape": shape, "position": place, "rotation": turn})
        told = subprocess.run([PROGRAM, "query", "--seed", "5"], input="\n".join(map(json.dumps, lines)),
                              capture_output=True, text=True, check=True)
        told = [json.loads(line) for line in told.stdout.splitlines()]
        box = Shape.box((0.6, 0.5, 0.4))
        distance = ground.distances(box, places, quaternions).distance
        contacts = ground.contacts(box, places, quaternions)
        self.assertLess(np.abs(distance - [a["distance"] for a in told[::2]]).max(), 1e-9)
        for i, answer in enumerate(told[1::2]):
            depth = contacts.depth[contacts.first[i]:contacts.first[i + 1]]
            np.testing.assert_allclose(depth, [c["depth"] for c in answer["contacts"]], atol=1e-9)


class Pairs(unittest.TestCase):
    def test_distances_of_spheres_and_boxes_are_those_of_geometry(self):
        random = np.random.default_rng(SEED)
        a, b = random.normal(size=(2, 200, 3))
        answer = terrane.pair_distances(Shape.sphere(0.3), a, Shape.sphere(0.5), b)
        np.testing.assert_allclose(answer.distance, np.linalg.norm(a - b, axis=1) - 0.8, atol=1e-12)
        np.testing.assert_allclose(answer.normal, (a - b) / np.linalg.norm(a - b, axis=1)[:, None], atol=1e-9)
        box = terrane.pair_distances(Shape.sphere(0.1), 3 * a, Shape.box((1, 1, 1)), (0, 0, 0))
        outside = np.linalg.norm(np.maximum(np.abs(3 * a) - 1, 0), axis=1)
        np.testing.assert_allclose(box.distance[outside > 0], outside[outside > 0] - 0.1, atol=1e-12)

    def test_casts_and_contacts_of_boxes_that_meet(self):
        box = Shape.box((1, 1, 1))
        casts = terrane.pair_casts(box, [[-5, 0, 0], [-5, 9, 0]], (10, 0, 0), box, (0, 0, 0), (0, 0, 0))
        self.assertEqual(casts.hit.tolist(), [True, False])
        self.assertAlmostEqual(casts.fraction[0], 0.3, delta=1e-4)
        contacts = terrane.pair_contacts(box, (1.99, 0, 0), box, (0, 0, 0))
        self.assertEqual(len(contacts.depth), 4)
        np.testing.assert_allclose(contacts.depth, 0.01, atol=1e-12)
        np.testing.assert_allclose(contacts.normal, [[1, 0, 0]] * 4, atol=1e-12)
        with self.assertRaisesRegex(ValueError, "2 rows.* 3"):
            terrane.pair_casts(box, np.zeros((2, 3)), (1, 0, 0), box, np.zeros((3, 3)), (0, 0, 0))

    def test_shapes_tell_what_they_are(self):
        hull = Shape.hull(np.random.default_rng(SEED).normal(size=(50, 3)))
        dumbbell = Shape.compound([(Shape.sphere(0.5), (1, 0, 0), None), (hull, (-1, 0, 0), (1, 0, 0, 0))])
        self.assertEqual([s.kind for s in (hull, dumbbell)], ["hull", "compound"])
        self.assertAlmostEqual(hull.bounding_radius, np.linalg.norm(hull.vertices, axis=1).max())
        self.assertAlmostEqual(Shape.box((0.3, 0.2, 0.1)).smallest_half_extent, 0.1)
        self.assertAlmostEqual(Shape.sphere(0.05).contact_tolerance, 0.005)
        with self.assertRaises(TypeError):
            dumbbell.vertices
        with self.assertRaisesRegex(ValueError, "convex"):
            Shape.compound([(dumbbell, (0, 0, 0), None)])
        flat = Shape.from_triangles(np.eye(3), np.array([[0, 1, 2]], np.uint8))
        self.assertEqual(flat.kind, "compound")


main()
