# SPDX-License-Identifier: MIT
"""Meshes as arrays; pictures."""
import gc
import threading
import unittest

import numpy as np

import terrane
from grounds import has, main, small_fractal
from terrane import MeshStatus

BUDGET = 20_000


class Scene(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.source = small_fractal()
        cls.view = terrane.look_at((-300, -300, 150), (0, 0, 0), width_px=320, height_px=180)
        cls.camera = terrane.Camera(cls.view)

    def make(self, **settings):
        terrain = terrane.Terrain(self.source, worker_count=0, triangle_budget=BUDGET, **settings)
        return terrain, terrain.load([self.camera], None, 0.0).meshes[0]


class Meshes(Scene):
    def test_a_mesh_is_watertight_within_budget_and_covers_the_world_once(self):
        _, mesh = self.make()
        v, t = mesh.vertices, mesh.triangles
        self.assertEqual((v.dtype, t.dtype, v.shape[1], t.shape[1]), (np.float64, np.uint32, 3, 3))
        self.assertEqual(len(t), mesh.triangle_count)
        self.assertLessEqual(len(t), BUDGET)
        self.assertGreater(len(t), 1000)
        self.assertEqual(np.unique(t).tolist(), list(range(len(v))))
        self.assertEqual(len(np.unique(v[:, :2], axis=0)), len(v))
        edges = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
        unique, count = np.unique(edges, axis=0, return_counts=True)
        self.assertLessEqual(count.max(), 2)
        for edge in v[unique[count == 1]]:  # the world's border
            self.assertTrue((np.abs(edge[:, 0]) == 1024).all() or (np.abs(edge[:, 1]) == 1024).all())
        a, b, c = (v[t[:, i], :2] for i in range(3))
        area = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
        self.assertGreater(area.min(), 0)
        self.assertEqual(area.sum(), 2048.0**2)

    def test_vertices_are_on_the_surface_without_morphing(self):
        _, mesh = self.make(morph_ratio=1.0)
        self.assertIn(mesh.status, (MeshStatus.error_met, MeshStatus.budget_reached))
        error = np.abs(self.source.heights(mesh.vertices[:, 0], mesh.vertices[:, 1]) - mesh.vertices[:, 2])
        self.assertLessEqual(error.max(), self.source.lattice.quantum)
        self.assertGreater(mesh.error_px, 0)

    def test_a_mesh_is_valid_until_the_next_update(self):
        terrain, mesh = self.make()
        vertices, triangles = mesh.vertices, mesh.triangles.copy()
        late = terrain.frame.meshes[0]
        self.assertEqual(late.triangle_count, mesh.triangle_count)
        terrain.update([terrane.Camera(terrane.look_at((300, 300, 100), (0, 0, 0)))], None, 0.1)
        self.assertIs(mesh.vertices, vertices)  # asked for before
        np.testing.assert_array_equal(mesh.triangles, triangles)
        with self.assertRaisesRegex(RuntimeError, "until the next update"):
            late.vertices
        self.assertGreater(late.triangle_count, 0)

    def test_each_camera_has_its_mesh(self):
        other = terrane.Camera(terrane.look_at((300, 300, 100), (0, 0, 0)))
        terrain, _ = self.make()
        one, same, another = terrain.update([self.camera, self.camera, other], None, 0.1).meshes
        np.testing.assert_array_equal(same.triangles, one.triangles)
        np.testing.assert_array_equal(same.vertices, one.vertices)
        self.assertFalse(np.array_equal(another.vertices, one.vertices))
        self.assertEqual(terrain.update([], None, 0.2).meshes, ())

    def test_a_mesh_keeps_what_it_needs_alive(self):
        terrain, mesh = self.make()
        del terrain
        gc.collect()
        self.assertEqual(len(mesh.triangles), mesh.triangle_count)

    def test_a_mesh_of_a_closed_terrain_is_refused(self):
        terrain, mesh = self.make()
        terrain.close()
        with self.assertRaisesRegex(ValueError, "this Terrain is closed"):
            mesh.vertices

    def test_absent_roots_are_a_mesh_without_triangles(self):
        mesh = terrane.Terrain(self.source, worker_count=1).update([self.camera], None, 0.0).meshes[0]
        self.assertEqual(mesh.status, MeshStatus.not_resident)
        self.assertEqual((mesh.vertices.shape, mesh.triangles.shape), ((0, 3), (0, 3)))


@unittest.skipUnless(has("render"), "pictures are not built")
class Pictures(Scene):
    def setUp(self):
        try:
            self.renderer = terrane.Renderer(320, 180)
        except RuntimeError as error:
            self.skipTest(str(error))
        self.addCleanup(self.renderer.close)

    def test_a_picture_shows_sky_above_ground_and_a_red_ball(self):
        _, mesh = self.make()
        picture = self.renderer.draw(mesh, self.view)
        self.assertEqual((picture.shape, picture.dtype), ((180, 320, 3), np.uint8))
        self.assertTrue((picture[0, :, 2] > picture[0, :, 0]).all())  # blue sky
        self.assertFalse((picture[170] == picture[0]).all())
        eye, forward = self.view.eye_world, self.view.forward
        scene = terrane.Scene(self.renderer)
        scene.add_object(scene.add_sphere(2.0, colour=(1.0, 0.0, 0.0)), eye + 20 * forward)
        seen = self.renderer.draw(mesh, self.view, scene)
        changed = (seen != picture).any(axis=2)
        self.assertTrue(changed[85:95, 155:165].all())
        self.assertFalse(changed[:40].any())
        red, green, blue = seen[90, 160].astype(int)
        self.assertGreater(red, 2 * max(green, blue))
        self.assertTrue(self.renderer.device)

    def test_what_does_not_fit_is_refused(self):
        _, mesh = self.make()
        with self.assertRaisesRegex(ValueError, "."):
            self.renderer.draw(mesh, terrane.look_at((0, 0, 100), (1, 1, 0), width_px=64, height_px=64))
        with self.assertRaisesRegex(ValueError, "horizon_colour .* 0 to 1, got 128$"):
            terrane.Renderer(64, 64, horizon_colour=(128, 150, 200))
        with self.assertRaises(ValueError):
            terrane.Renderer(0, 10)
        caught = []

        def draw():
            try:
                self.renderer.draw(mesh, self.view)
            except RuntimeError as error:
                caught.append(str(error))

        thread = threading.Thread(target=draw)
        thread.start()
        thread.join()
        self.assertEqual(caught, ["this Renderer belongs to the thread that made it"])
        self.renderer.close()
        with self.assertRaisesRegex(ValueError, "this Renderer is closed"):
            self.renderer.draw(mesh, self.view)


main()
