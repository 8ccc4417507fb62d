# SPDX-License-Identifier: MIT
"""Scenes: objects, smoke and their levels of detail in pictures, under the triangle budget of the ground."""
import gc
import math
import pathlib
import tempfile
import threading
import unittest

import numpy as np

import terrane
from grounds import has, main, small_fractal

BUDGET = 20_000
WIDTH, HEIGHT = 320, 180
ROOF = ([(-5, -4, 0), (5, -4, 0), (5, 4, 0), (-5, 4, 0), (-5, 0, 3), (5, 0, 3)],
        [(0, 1, 5), (0, 5, 4), (2, 3, 4), (2, 4, 5), (0, 4, 3), (1, 2, 5), (0, 3, 2), (0, 2, 1)])


def pixel(view, p_world):
    """Column and row of a point, by hand."""
    to = np.asarray(p_world) - view.eye_world
    depth = to @ view.forward
    half = math.tan(view.vertical_fov / 2) * depth
    right = np.cross(view.forward, view.up)
    return (int(WIDTH / 2 + HEIGHT / 2 * (to @ right) / half), int(HEIGHT / 2 * (1 - (to @ view.up) / half)))


def differ(a, b):
    return np.abs(a.astype(int) - b.astype(int)).max(axis=2) > 4


def matrix_about_z(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


@unittest.skipUnless(has("render"), "pictures are not built")
class Scenes(unittest.TestCase):
    def setUp(self):
        try:
            self.renderer = terrane.Renderer(WIDTH, HEIGHT)
        except RuntimeError as error:
            self.skipTest(str(error))
        self.addCleanup(self.renderer.close)
        source = small_fractal()
        self.foot = np.array([0, 0, float(source.heights(0, 0))])
        self.view = terrane.look_at(self.foot + (-28, -30, 12), self.foot + (0, 0, 8), width_px=WIDTH, height_px=HEIGHT)
        self.camera = terrane.Camera(self.view)
        self.terrain = terrane.Terrain(source, worker_count=0, triangle_budget=BUDGET)
        self.mesh = self.terrain.load([self.camera], None, 0.0).meshes[0]
        self.scene = terrane.Scene(self.renderer)

    def draw(self, mesh=None):
        return self.renderer.draw(mesh or self.mesh, self.view, scene=self.scene)

    def load(self):
        self.mesh = self.terrain.load([self.camera], None, 0.0, scene=self.scene).meshes[0]
        return self.mesh

    def add_cottage(self, **smoke):
        """House, walls, chimney and smoke."""
        scene = self.scene
        house = scene.add_group(self.foot)
        walls = scene.add_object(scene.add_box((5, 4, 3), colour=(0.9, 0.1, 0.1)), (0, 0, 3), parent=house)
        scene.add_object(scene.add_model(*ROOF, colour=(0.2, 0.2, 0.8)), (0, 0, 6), parent=house)
        chimney = scene.add_object(scene.add_cylinder(0.5, 1.5, colour=(0.1, 0.8, 0.1)), (-3, -2, 8.5), parent=house)
        emitter = scene.add_emitter((0, 0, 1.5), parent=chimney, rate=40, velocity=(0, 0, 2), radius=(0.4, 1.5),
                                    colours=((0, 0, 0, 1), (0, 0, 0, 0.8)), drag_time=1e3, **smoke)
        return house, walls, chimney, emitter

    def test_a_cottage_with_a_smoking_chimney_is_drawn_where_it_stands(self):
        empty = self.renderer.draw(self.mesh, self.view)
        self.assertFalse(differ(empty, self.draw()).any())
        self.add_cottage()
        self.load()
        self.scene.set_time(10.0)
        ground = self.renderer.draw(self.mesh, self.view)
        picture = self.draw()
        changed = differ(ground, picture)
        for place, colour in (((-4.9, -4, 3), 0), ((0, -2, 7.5), 2), ((-3.3, -2.4, 9.6), 1)):
            x, y = pixel(self.view, self.foot + place)
            self.assertTrue(changed[y, x], place)
            self.assertEqual(picture[y, x].argmax(), colour, place)
        x, y = pixel(self.view, self.foot + (-3, -2, 12.5))
        self.assertTrue(changed[y, x])
        self.assertLess(int(picture[y, x].sum()), int(ground[y, x].sum()))  # black smoke before the sky
        self.assertFalse(changed[:, :60].any() or changed[:, -60:].any())
        self.assertGreater(self.scene.counts.particles, 50)

    def test_smoke_is_a_function_of_the_time_and_of_the_seed(self):
        emitter = self.add_cottage(seed=3)[3]
        pictures = []
        for time_s in (20.0, 7.0, 20.0):
            self.scene.set_time(time_s)
            pictures.append(self.draw())
        self.assertTrue(differ(pictures[0], pictures[1]).any())
        np.testing.assert_array_equal(pictures[0], pictures[2])
        emitter.remove()
        self.scene.add_emitter(start=30.0)
        self.scene.set_time(29.0)
        self.draw()
        self.assertEqual(self.scene.counts.particles, 0)
        with self.assertRaisesRegex(ValueError, "time_s must be finite, got nan"):
            self.scene.set_time(math.nan)

    def test_smoke_may_have_an_image_that_emitters_share(self):
        self.scene.set_time(20.0)
        self.add_cottage(seed=3)
        discs = self.draw()
        green = np.full((64, 64, 4), (0, 255, 0, 128), np.uint8)
        self.scene.add_emitter(self.foot + (-3, -2, 10), rate=40, velocity=(0, 0, 2), radius=(0.4, 1.5), drag_time=1e3,
                               colours=((1, 1, 1, 1), (1, 1, 1, 0.8)), image=green)
        self.scene.add_emitter(self.foot - (0, 0, 50), image=green.copy())
        changed = differ(discs, self.draw())
        self.assertGreater(changed.sum(), 50)
        self.assertTrue((self.draw()[changed].argmax(axis=1) == 1).mean() > 0.8)
        with self.assertRaisesRegex(ValueError, r"image must have the shape \(height, width, 4\), sides 1 to 16384, got \(2, 2\)"):
            self.scene.add_emitter(image=np.zeros((2, 2), np.uint8))

    def test_the_strength_of_an_emitter_is_that_of_its_next_particles(self):
        house, _, chimney, emitter = self.add_cottage()
        self.scene.set_time(0.0)
        emitter.set_strength(0.0)
        self.scene.set_time(0.1)
        self.scene.set_time(60.0)  # all particles were born since
        without = self.draw()
        emitter.set_strength(1.0)
        self.scene.set_time(60.1)
        self.scene.set_time(120.0)
        self.assertGreater(differ(without, self.draw()).sum(), 50)
        with self.assertRaisesRegex(ValueError, "strength must be 0 to 1, got 2"):
            emitter.set_strength(2.0)
        with self.assertRaisesRegex(ValueError, "this Node is not an emitter"):
            chimney.set_strength(1.0)

    def test_ground_and_objects_share_one_budget(self):
        random = np.random.default_rng(4)
        place = np.column_stack([random.uniform(-150, 150, (2000, 2)), np.full(2000, self.foot[2])])
        model = self.scene.add_sphere(3.0)
        self.draw()
        self.assertEqual(self.scene.counts.triangles, 0)
        self.scene.add_instances(model, place)
        self.draw()  # of an update() without the scene
        self.assertLessEqual(self.mesh.triangle_count + self.scene.counts.triangles, BUDGET)
        drawn_before, ground_before = self.scene.counts.triangles, self.mesh.triangle_count
        self.load()
        self.draw()
        self.assertLessEqual(self.mesh.triangle_count + self.scene.counts.triangles, BUDGET)
        self.assertGreater(self.scene.counts.triangles, drawn_before)
        self.assertLess(self.mesh.triangle_count, ground_before)
        self.scene.add_instances(model, place + (0, 0, 5))  # after the update
        self.draw()
        self.assertLessEqual(self.mesh.triangle_count + self.scene.counts.triangles, BUDGET)
        self.assertEqual(self.scene.object_count, 4000)
        one, two = self.terrain.update([self.camera, self.camera], None, 0.1, scene=self.scene).meshes
        self.assertEqual(one.triangle_count, two.triangle_count)

    def test_a_ray_hits_the_first_object_with_its_node(self):
        house, walls, _, _ = self.add_cottage()
        west = self.foot + (-50, 1, 3)
        hit = self.scene.ray(west, west + (100, 0, 0))
        self.assertEqual(hit.node, walls)
        self.assertNotEqual(hit.node, house)
        self.assertEqual(len({hit.node, walls, house}), 2)
        np.testing.assert_allclose(hit.point_world, self.foot + (-5, 1, 3), atol=1e-9)
        np.testing.assert_allclose(hit.normal, (-1, 0, 0), atol=1e-12)
        self.assertAlmostEqual(hit.fraction, 0.45)
        house.set_place(self.foot + (10, 0, 0), matrix_about_z(math.pi / 2))
        np.testing.assert_allclose(self.scene.ray(west, west + (100, 0, 0)).point_world, self.foot + (6, 1, 3), atol=1e-9)
        low, high = house.bounds_world
        np.testing.assert_allclose(low, self.foot + (6, -5, 0), atol=1e-9)
        np.testing.assert_allclose(high, self.foot + (14, 5, 10), atol=1e-9)
        house.remove()
        house.remove()
        self.assertIsNone(self.scene.ray(west, west + (100, 0, 0)))
        self.assertIsNone(house.bounds_world)
        self.assertEqual((self.scene.node_count, self.scene.root.bounds_world), (1, None))
        with self.assertRaisesRegex(ValueError, "the scene has no node"):
            house.set_place((0, 0, 0))
        with self.assertRaisesRegex(ValueError, "the scene has no node"):
            self.scene.add_group(parent=walls)
        with self.assertRaisesRegex(ValueError, "to_world must be finite"):
            self.scene.ray((0, 0, 0), (math.inf, 0, 0))

    def test_instances_have_places_rotations_and_scales_of_their_own(self):
        model = self.scene.add_box((1, 2, 3))
        quaternion = (math.cos(math.pi / 4), 0, 0, math.sin(math.pi / 4))
        rotations = np.array([(1, 0, 0, 0), quaternion, quaternion], float)
        node = self.scene.add_instances(model, [(0, 0, 0), (20, 0, 0), (40, 0, 0)], rotations, scales=[1, 1, 2],
                                        tints=np.eye(3), position=(0, 0, 500), scale=0.5)
        for index, half in enumerate((1, 2, 4)):
            x = 10 * index
            hit = self.scene.ray((x - 4, 0, 500), (x + 4, 0, 500))
            self.assertEqual((hit.object, hit.node), (index, node))
            self.assertAlmostEqual(hit.point_world[0], x - half / 2, places=5)
        matrices = np.array([np.eye(3), matrix_about_z(math.pi / 2), matrix_about_z(math.pi / 2)])
        same = self.scene.add_instances(model, [(0, 0, 0), (20, 0, 0), (40, 0, 0)], matrices, scales=[1, 1, 2],
                                        position=(0, 0, 500), scale=0.5)
        np.testing.assert_allclose(same.bounds_world, node.bounds_world, atol=1e-5)
        self.assertEqual(self.scene.add_instances(model, np.zeros((0, 3))).bounds_world, None)

    def test_a_texture_and_vertex_colours_are_drawn(self):
        texture = np.zeros((16, 16, 4), np.uint8)
        texture[:, :8] = (255, 0, 0, 255)
        texture[:8, 8:] = (0, 255, 0, 255)
        texture[8:, 8:] = (0, 0, 255, 255)
        corners, faces = [(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)], [(0, 1, 2), (0, 2, 3)]
        up = np.array([(0, 0, 1)] * 4, float)
        textured = self.scene.add_model(corners, faces, normals=up, texture=texture, colour=(1, 1, 1),
                                        texture_coordinates=[(0, 0), (1, 0), (1, 1), (0, 1)], impostor=False)
        coloured = self.scene.add_model(corners, faces, colours=np.array([(0, 255, 0)] * 4, np.uint8), two_sided=True)
        eye = self.view.eye_world + 20 * self.view.forward
        right = np.cross(self.view.forward, self.view.up)
        billboard = self.scene.add_billboard("screen", eye - 4 * right)
        self.scene.add_object(textured, parent=billboard)
        other = self.scene.add_billboard(position=eye + 4 * right)
        self.scene.add_object(coloured, parent=other)
        picture = self.draw()
        for across, above, channel in ((-2, 2, 0), (-2, -2, 0), (2, 2, 1), (2, -2, 2)):
            x, y = pixel(self.view, eye + (across - 4) * right + above * self.view.up)
            self.assertEqual(picture[y, x].argmax(), channel, (across, above))
        x, y = pixel(self.view, eye + 4 * right)
        self.assertEqual(picture[y, x].argmax(), 1)

    def test_triangles_meet_at_a_crease_or_smoothly(self):
        # a ridge of two sides towards the viewer, one lit more than the other
        vertices, triangles = [(0, -3, 0), (0, 3, 0), (-3, -3, -3), (-3, 3, -3), (3, -3, -3), (3, 3, -3)], \
            [(0, 1, 3), (0, 3, 2), (0, 4, 5), (0, 5, 1)]
        eye = self.view.eye_world + 20 * self.view.forward
        right = np.cross(self.view.forward, self.view.up)
        steps = []
        for crease in (0.5, math.pi):
            model = self.scene.add_model(vertices, triangles, crease=crease, impostor=False)
            billboard = self.scene.add_billboard(position=eye)
            self.scene.add_object(model, parent=billboard)
            picture = self.draw().astype(int)
            levels = []
            for across in (-0.3, 0.3):
                x, y = pixel(self.view, eye + across * right)
                levels.append(picture[y, x].sum())
            steps.append(abs(levels[0] - levels[1]))
            billboard.remove()
        self.assertGreater(steps[0], 3 * steps[1])
        with self.assertRaisesRegex(ValueError, "crease must be 0 to pi, got 4"):
            self.scene.add_model(vertices, triangles, crease=4.0)

    def test_a_switch_draws_the_level_of_its_distance(self):
        red, blue = self.scene.add_sphere(2, colour=(1, 0, 0)), self.scene.add_sphere(2, colour=(0, 0, 1))
        levels = self.scene.add_switch("centre", (30, 60))
        self.scene.add_object(red, parent=levels)
        self.scene.add_object(blue, parent=levels)
        for distance, channel in ((20, 0), (50, 2)):
            levels.set_place(self.view.eye_world + distance * self.view.forward)
            self.assertEqual(self.draw()[HEIGHT // 2, WIDTH // 2].argmax(), channel)
        levels.set_place(self.view.eye_world + 100 * self.view.forward)
        self.assertFalse(differ(self.draw(), self.renderer.draw(self.mesh, self.view)).any())

    def test_what_is_out_of_range_is_refused_by_name(self):
        scene, (vertices, triangles) = self.scene, ROOF
        box, n = scene.add_box((1, 1, 1)), len(ROOF[0])
        texture = np.zeros((4, 4, 4), np.uint8)
        refused = (
            (lambda: scene.add_model(np.zeros((4, 2)), triangles), r"vertices must have the shape \(n, 3\), got \(4, 2\)"),
            (lambda: scene.add_model(vertices, [(0, 1, n)]), rf"triangles\[0\] has the index {n}, and there are {n} vertices"),
            (lambda: scene.add_model(vertices, np.zeros((2, 4), int)), r"triangles must have the shape \(m, 3\), got \(2, 4\)"),
            (lambda: scene.add_model(np.zeros((3, 3)), [(0, 1, 2)]), "an object must have triangles and an extent"),
            (lambda: scene.add_model(np.full((3, 3), math.nan), [(0, 1, 2)]), "vertex 0"),
            (lambda: scene.add_model(vertices, triangles, normals=[(0, 0, 1)]), f"normals has 1 rows, and there are {n}"),
            (lambda: scene.add_model(vertices, triangles, colours=np.zeros((n, 2), np.uint8)),
             r"colours must have the shape \(n, 3\) or \(n, 4\), got"),
            (lambda: scene.add_model(vertices, triangles, texture=texture), "a texture needs texture_coordinates"),
            (lambda: scene.add_model(vertices, triangles, texture_coordinates=np.zeros((n, 2)), texture=texture[:, :, :3]),
             r"texture must have the shape \(height, width, 4\), sides 1 to 16384, got \(4, 4, 3\)"),
            (lambda: scene.add_model(vertices, triangles, texture_coordinates=np.zeros((n, 3))),
             r"texture_coordinates must have the shape \(n, 2\), got"),
            (lambda: scene.add_model(vertices, triangles, roughness=2.0), "roughness .*2"),
            (lambda: scene.add_box((1, -1, 1)), ".*-1"),
            (lambda: scene.add_box((1, 1)), r"half_extents must have the shape \(3,\), got \(2,\)"),
            (lambda: scene.add_sphere(math.nan), "nan"),
            (lambda: scene.add_box((1, 1, 1), colour=(0, 0, 255)), "colour must have parts from 0 to 1, got 255"),
            (lambda: scene.add_object(box, (0, 0, math.inf)), "translation"),
            (lambda: scene.add_object(box, scale=-1.0), "scale must be .*-1"),
            (lambda: scene.add_object(box, rotation=np.diag((1.0, 1.0, -1.0))), "rotation must be orthonormal"),
            (lambda: scene.add_object(box, tint=(math.nan, 1, 1)), "tint must be finite"),
            (lambda: scene.add_instances(box, np.zeros((3, 3)), scales=[1, 2]), "positions has 3 rows, scales has 2"),
            (lambda: scene.add_instances(box, np.zeros((2, 3)), scales=[1, 0]), "scale must be .* got 0 of object 1"),
            (lambda: scene.add_instances(box, np.zeros((2, 3)), 2 * np.eye(3)), r"rotations\[0\] must be orthonormal"),
            (lambda: scene.add_switch("size", (1,)), "by must be one of distance, centre, error, got \"size\""),
            (lambda: scene.add_switch("error", ()), "a switch needs at least one limit"),
            (lambda: scene.add_switch("error", (2, 1)), "limits must not decrease"),
            (lambda: scene.add_billboard("right"), "axis must be one of screen, up"),
            (lambda: scene.add_emitter(rate=1e9), "rate must be .*1e\\+?09|rate must be .*1000000000"),
            (lambda: scene.add_emitter(life=(3, 2)), "life"),
            (lambda: scene.add_emitter(velocity=(0, 0)), r"velocity must have the shape \(3,\)"),
            (lambda: scene.add_emitter(parent=scene.add_billboard()), "cannot be below a switch or a billboard"),
            (lambda: terrane.Scene(self.renderer, fade_ratio=3.0), "fade_ratio must be 1 to 2, got 3"),
            (lambda: terrane.Scene(self.renderer, cull_test="none"), "cull_test must be one of planes, exact"),
        )
        for call, said in refused:
            with self.subTest(said), self.assertRaisesRegex(ValueError, said):
                call()
        with self.assertRaisesRegex(TypeError, "texture must be an array of uint8, got an array of float64"):
            scene.add_model(vertices, triangles, texture_coordinates=np.zeros((n, 2)), texture=np.zeros((4, 4, 4)))
        with self.assertRaisesRegex(TypeError, "scene must be a Scene, got a int"):
            self.terrain.update([self.camera], None, 0.1, scene=7)
        self.assertEqual(scene.object_count, 0)
        self.assertTrue(self.draw().any())

    def test_models_and_nodes_belong_to_their_scene_and_renderer(self):
        other = terrane.Scene(self.renderer)
        box = other.add_box((1, 1, 1))
        with self.assertRaisesRegex(ValueError, "model is a model of another Scene"):
            self.scene.add_object(box)
        with self.assertRaisesRegex(ValueError, "parent is a node of another Scene"):
            self.scene.add_group(parent=other.add_group())
        with terrane.Renderer(WIDTH, HEIGHT) as renderer:
            with self.assertRaisesRegex(ValueError, "scene is a Scene of another Renderer"):
                renderer.draw(self.mesh, self.view, self.scene)
            mine = terrane.Scene(renderer)
            place = mine.add_object(mine.add_box((1, 1, 1)), self.foot)
            self.assertTrue(renderer.draw(self.mesh, self.view, mine).any())
        with self.assertRaisesRegex(ValueError, "this Renderer is closed"):
            mine.add_sphere(1.0)
        with self.assertRaisesRegex(ValueError, "this Renderer is closed"):
            terrane.Scene(renderer)
        with self.assertRaisesRegex(ValueError, "this Renderer is closed"):
            renderer.draw(self.mesh, self.view, mine)
        self.assertEqual(mine.ray(self.foot + (0, 0, 9), self.foot).node, place)  # a scene without its device
        del renderer, mine
        gc.collect()
        place.set_place((0, 0, 0))  # a node keeps its scene

    def test_a_closed_scene_is_refused_and_frees_its_models(self):
        with terrane.Scene(self.renderer) as scene:
            model = scene.add_box((1, 1, 1))
            self.assertFalse(scene.closed)
        self.assertTrue(scene.closed)
        scene.close()
        for call in (lambda: scene.add_object(model), lambda: scene.counts,
                     lambda: self.renderer.draw(self.mesh, self.view, scene),
                     lambda: self.terrain.update([self.camera], None, 0.1, scene=scene)):
            with self.assertRaisesRegex(ValueError, "this Scene is closed"):
                call()
        for _ in range(3):  # of 4 GiB of textures if they stayed
            with terrane.Scene(self.renderer) as scene:
                scene.add_box((1, 1, 1))
        self.assertTrue(self.draw().any())

    def test_models_are_added_on_the_thread_of_the_renderer(self):
        said = []

        def add():
            self.scene.add_group()  # nodes may be added by any thread
            try:
                self.scene.add_box((1, 1, 1))
            except RuntimeError as error:
                said.append(str(error))

        thread = threading.Thread(target=add)
        thread.start()
        thread.join()
        self.assertEqual(said, ["this Renderer belongs to the thread that made it"])
        self.assertEqual(self.scene.node_count, 2)

    def test_objects_cast_shadows(self):
        with terrane.Renderer(WIDTH, HEIGHT, shadow_distance=200.0, sun_direction=(0, 0, 1)) as renderer:
            scene = terrane.Scene(renderer)
            roof = scene.add_object(scene.add_box((6, 6, 0.2)), self.foot + (0, 0, 14))
            x, y = pixel(self.view, self.foot)
            dark = int(renderer.draw(self.mesh, self.view, scene)[y, x].sum())
            roof.remove()
            self.assertLess(dark, 0.9 * int(renderer.draw(self.mesh, self.view, scene)[y, x].sum()))


@unittest.skipUnless(has("render"), "pictures are not built")
class Settings(unittest.TestCase):
    def make(self, **settings):
        try:
            renderer = terrane.Renderer(WIDTH, HEIGHT, sample_count=1, **settings)
        except RuntimeError as error:
            self.skipTest(str(error))
        self.addCleanup(renderer.close)
        return renderer

    def test_ground_in_materials_and_moving_water_differ_from_tints_and_still_water(self):
        source = small_fractal()
        water = float(source.heights(0, 0)) + 5.0
        view = terrane.look_at((-60, -60, water + 25), (60, 60, water), width_px=WIDTH, height_px=HEIGHT)
        terrain = terrane.Terrain(source, worker_count=0, triangle_budget=BUDGET)
        mesh = terrain.load([terrane.Camera(view)], None, 0.0).meshes[0]
        plain = self.make(water_level=water).draw(mesh, view)
        moon = self.make(water_level=water, ground_look="moon", occlusion=0.5).draw(mesh, view)
        self.assertGreater(differ(plain, moon).mean(), 0.05)
        waves = self.make(water_level=water, has_waves=True, texture_bytes=1 << 20)
        pictures = []
        for seconds in (1.0, 2.5, 1.0):
            waves.set_time(seconds)
            pictures.append(waves.draw(mesh, view))
        self.assertTrue((pictures[0] != pictures[1]).any())
        np.testing.assert_array_equal(pictures[0], pictures[2])
        with self.assertRaisesRegex(ValueError, "nan"):
            waves.set_time(math.nan)

    @unittest.skipUnless(has("dem"), "rasters are not built")
    def test_imagery_covers_the_ground_where_the_raster_is(self):
        picture = np.zeros((40, 60, 3), np.uint8)
        picture[:, :30, 0] = picture[:, 30:, 2] = 255  # red in the west, blue in the east
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "two.ppm"
            path.write_bytes(b"P6 60 40 255\n" + picture.tobytes())
            path.with_suffix(".wld").write_text("2\n0\n0\n-2\n1\n-1\n")  # texels of 2 m
            imagery = terrane.open_imagery(path)
            self.assertEqual((imagery.rect, imagery.texel_size), ((-60.0, -40.0, 60.0, 40.0), 2.0))
            with self.assertRaisesRegex(ValueError, "aligned_with must be a HeightSource of open_dem"):
                terrane.open_imagery(path, aligned_with=small_fractal())
            with self.assertRaises(OSError):
                terrane.open_imagery(path.with_name("none.ppm"))
            source = small_fractal()
            height = float(source.heights(0, 0))
            view = terrane.look_at((0, 0, height + 200), (0, 0, height), width_px=WIDTH, height_px=HEIGHT)
            mesh = terrane.Terrain(source, worker_count=0).load([terrane.Camera(view)], None, 0.0).meshes[0]
            seen = self.make(imagery=imagery, imagery_waits=True).draw(mesh, view).astype(int)
        for x, channel in ((-30, 0), (30, 2)):
            column, row = pixel(view, (x, 0, float(source.heights(x, 0))))
            self.assertEqual(seen[row, column].argmax(), channel)
            self.assertGreater(seen[row, column].max(), 3 * seen[row, column, 2 - channel])

    def test_settings_of_the_ground_are_checked(self):
        self.make()
        for settings, said in ((dict(ground_look="mars"), "ground_look must be one of alpine, .*, got \"mars\""),
                               (dict(snow_line=100.0), "snow_line and rock_slope need a ground_look"),
                               (dict(ground_look="moon", rock_slope=-1.0), "rock_slope must be 0 to 100, got -1"),
                               (dict(ground_look="moon", occlusion=2.0), "occlusion must be 0 to 1, got 2"),
                               (dict(ground_look="moon", anisotropy=0), "anisotropy must be 1 to 16, got 0")):
            with self.assertRaisesRegex(ValueError, said):
                self.make(**settings)


main()
