#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Volumes of scenes in info, query and bake: what they do to the ground, which spacing they get, what is refused."""

import os

from program import DATA, ROOT, SEED, Folder, ask, main, np, read_obj, run, run_json

BALL = {"sphere": {"radius": 6}}
CAVE = os.path.join(ROOT, "tools", "data", "cave.json")


class Volumes(Folder):
    def scene(self, volumes, **content):
        """At height 100, 400 m by 200 m around the origin unless said otherwise."""
        if "dem" not in content and "seed" not in content:
            content["dem"] = self.flat(100.0)
        return super().scene(**content, volumes=volumes)

    def volume(self, shape=None, **content):
        return {"op": "remove", "shape": shape or BALL, "position": [0, 0, 100], **content}

    def heights(self, scene, *places, low=60):
        """All surfaces over each place, from the highest down, as far as they are a metre apart."""
        below = [1e6, *map(float, range(140, low, -1))]
        answers = ask(["--scene", scene], [{"op": "height_below", "x": x, "y": y, "z": z} for x, y in places for z in below])
        self.assertLessEqual({answer["status"] for answer in answers}, {"ok", "miss"})
        heights = [round(answer["height"], 6) if answer["status"] == "ok" else None for answer in answers]
        parts = [heights[i * len(below):(i + 1) * len(below)] for i in range(len(places))]
        return [sorted(set(part) - {None}, reverse=True) for part in parts]

    def test_every_shape_is_cut_out_of_the_ground(self):
        self.write_block((-6, -6, -6), (6, 6, 6))
        octahedron = [[9, 0, 0], [-9, 0, 0], [0, 9, 0], [0, -9, 0], [0, 0, 6], [0, 0, -6]]
        for shape in (BALL, {"capsule": {"radius": 4, "half_height": 2}}, {"box": {"half_extents": [6, 7, 6]}},
                      {"hull": {"points": octahedron}}, {"tube": {"path": [[0, 0, 0], [0, 0, -2]], "radius": 4}},
                      {"mesh": "block.obj"}):
            with self.subTest(shape):
                scene = self.scene([self.volume(shape), self.volume(shape, position=[60, 0, 80]),
                                    self.volume(shape, op="add", position=[-60, 0, 100])])
                pit, beside, cave, hill = self.heights(scene, (0.1, 0.1), (30, 0), (60.1, 0.1), (-59.9, 0.1))
                self.assertEqual((len(pit), beside, len(cave), cave[0]), (1, [100], 3, 100))
                self.assertAlmostEqual(pit[0], 94, delta=0.2)
                self.assertAlmostEqual(cave[2], 74, delta=0.2)
                self.assertGreater(hill[0], 103)

    def test_a_pick_tells_volumes_from_ground(self):
        scene = self.scene([self.volume({"box": {"half_extents": [6, 7, 6]}}),
                            self.volume({"sphere": {"radius": 3}}, op="add", position=[40, 0, 115])])
        down = {"op": "pick", "forward": [0, 0, -1], "size": [64, 36], "pixel": [32, 18]}
        floor, ground, ball = ask(["--scene", scene], [{**down, "eye": [x, 0.1, 150]} for x in (0.1, 20.1, 40.1)])
        self.assertEqual([a["kind"] for a in (floor, ground, ball)], ["volume", "ground", "volume"])
        for answer, z in ((floor, 94), (ground, 100), (ball, 118)):
            self.assertAlmostEqual(answer["point"][2], z, delta=0.2)
            self.assertAlmostEqual(answer["distance"], 150 - answer["point"][2], places=6)
        # the eye is in the pit, and looks at its wall
        wall, = ask(["--scene", scene], [{**down, "eye": [0.1, 0.1, 97], "forward": [1, 0, 0]}])
        self.assertEqual(wall["kind"], "volume")
        self.assertAlmostEqual(wall["point"][0], 6, delta=0.2)

    def test_no_scattered_object_stands_over_a_pit_for_rays_and_meshes_too(self):
        mesh = self.write_block((-0.2, -0.2, 0), (0.2, 0.2, 1))
        scene = self.scene([self.volume({"box": {"half_extents": [6, 7, 6]}})],
                           objects=[{"scatter": {"mesh": mesh, "per_km2": 400_000, "scale": [1, 1]}}])
        places = [(x, y) for x in np.arange(-5, 5, 0.25) for y in np.arange(-6, 6, 0.25)]
        kinds = []
        for east in (0, 20):
            answers = ask(["--scene", scene], [{"op": "ray", "from": [x + east, y, 150], "to": [x + east, y, 50]} for x, y in places])
            kinds.append({answer["kind"] for answer in answers})
        self.assertEqual(kinds, [{"volume"}, {"ground", "object"}])
        summary = run_json("mesh", "--scene", scene, "--eye", "0,-30,130", "--look", "0,0,100", "--budget", 1_000_000,
                           "--out", self.path("m.obj"))
        vertices, faces = read_obj(self.path("m.obj"))
        middles = vertices[faces[summary["ground_triangles"]:]].reshape(-1, 36, 3).mean(axis=1)
        self.assertEqual(len(middles), summary["objects"])
        self.assertGreater(len(middles), 50)
        in_pit = (np.abs(middles[:, 0]) < 5) & (np.abs(middles[:, 1]) < 6)
        self.assertEqual(in_pit.sum(), 0)

    def test_later_volumes_prevail_and_rotations_turn_them(self):
        box = self.volume({"box": {"half_extents": [20, 2, 2]}}, rotation=[np.sqrt(0.5), 0, 0, np.sqrt(0.5)])
        along, across = self.heights(self.scene([box]), (0.1, 15), (15, 0.1))
        self.assertAlmostEqual(along[0], 98, delta=0.2)
        self.assertEqual(across, [100])
        plug = self.volume({"box": {"half_extents": [3, 3, 3]}}, op="add", position=[0, 15, 97])
        along, = self.heights(self.scene([box, plug]), (0.1, 15))
        self.assertAlmostEqual(along[0], 100, delta=0.2)

    def test_info_says_what_volumes_there_are(self):
        scene = self.scene([self.volume(voxel_m=1), self.volume({"tube": {"path": [[0, 0, 0], [50, 0, -20]],
                                                                          "radius": 3}}, op="add", voxel_m=0.7)])
        info = run_json("info", "--scene", scene)
        self.assertEqual(info["finest_spacing_m"], 5 / 8)
        self.assertEqual([(v["op"], v["shape"], v["voxel_m"]) for v in info["volumes"]],
                         [("remove", "sphere", 5 / 8), ("add", "tube", 5 / 8)])
        np.testing.assert_allclose(info["volumes"][0]["bounds_m"], [[-6, -6, 94], [6, 6, 106]])
        np.testing.assert_allclose(info["volumes"][1]["bounds_m"], [[-3, -3, 77], [53, 3, 103]])
        text = run("info", "--scene", scene).stdout
        self.assertRegex(text, r"volumes +2\n")
        self.assertIn("op add, shape tube, voxel_m 0.625", text)
        self.assertNotIn("volumes", run_json("info", "--scene", self.scene([])))

    def test_the_finest_spacing_follows_from_the_finest_voxel(self):
        def spacing(voxels, *flags, **content):
            volumes = [self.volume({"sphere": {"radius": 300}}, voxel_m=voxel) for voxel in voxels]
            return run_json("info", "--scene", self.scene(volumes, **content), *flags)["finest_spacing_m"]

        for voxel, wanted in ((0.5, 0.5), (0.7, 0.5), (0.3, 0.25), (1, 1), (3, 1)):
            self.assertEqual(spacing([7, voxel], seed=1), wanted, voxel)
        self.assertEqual(spacing([0.5], seed=1, detail_m=2), 2)
        self.assertEqual(spacing([0.5], "--detail-m", 4, seed=1), 4)
        # a cell of 5 m is halved until it is at most 1.414 voxels
        for voxel, wanted in ((4, 5), (3.6, 5), (3.5, 2.5), (2, 2.5), (1, 1.25), (0.5, 0.625), (0.4, 0.3125)):
            self.assertEqual(spacing([voxel]), wanted, voxel)
        self.assertEqual(spacing([4], seed=1, dem="flat.asc"), 0.625)  # as without volumes
        self.assertEqual(spacing([0.4], seed=1, dem="flat.asc"), 0.3125)
        # cells that are not square get the voxel itself
        raster = os.path.join(ROOT, "tools", "data", "jacksboro.tif")
        self.assertEqual(spacing([0.5], dem=raster), 0.5)

    def test_a_raster_without_a_seed_gets_no_detail(self):
        heights, raster = self.hills()
        scene = self.scene([self.volume(position=[0, 0, 700], voxel_m=0.5)], dem=raster)
        random = np.random.default_rng(SEED)
        questions = [{"op": "height", "x": x, "y": y} for x, y in random.uniform(-200, 200, (200, 2))]
        for question, fine, plain in zip(questions, ask(["--scene", scene], questions),
                                         ask(["--dem", raster], questions)):
            u, v = question["x"] / 10 + 29.5, 22 - question["y"] / 10
            i, j = int(v), int(u)
            (a, b), (c, d) = heights[i:i + 2, j:j + 2]
            f, g = u - j, v - i
            wanted = (a * (1 - f) + b * f) * (1 - g) + (c * (1 - f) + d * f) * g
            self.assertLessEqual(abs(fine["height"] - wanted), fine["error_m"])
            self.assertLess(fine["error_m"], plain["error_m"] / 10 + 0.001)

    def test_answers_about_a_cave(self):
        """tools/data/cave.json: a tunnel through a hill, and a hall with a shaft to the surface."""
        x, y = 7610, -11880
        info = run_json("info", "--scene", CAVE)
        self.assertEqual(info["finest_spacing_m"], 0.5)
        self.assertEqual(len(info["volumes"]), 5)

        def ray(start, end):
            return {"op": "ray", "from": start, "to": end}

        # memory that holds few chunks is enough
        through, above, shaft, passage, up, top, floor, ceiling, below, *hall = ask(["--scene", CAVE], [
            ray([x - 134, y, 424], [x + 134, y, 424]), ray([x - 134, y, 432], [x + 134, y, 432]),
            ray([x, y + 30, 500], [x, y + 30, 400]), ray([x, y, 423], [x, y + 30, 423]),
            ray([x, y, 424], [x, y, 500]), {"op": "height", "x": x, "y": y},
            {"op": "height_below", "x": x, "y": y, "z": 425}, {"op": "height_below", "x": x, "y": y, "z": 440},
            {"op": "height_below", "x": x, "y": y, "z": 419},
            *({"op": "height_below", "x": x + dx, "y": y, "z": 425} for dx in range(-100, 101, 10))], "--memory-mb", 60)
        self.assertEqual((through["status"], passage["status"], above["status"]), ("miss", "miss", "ok"))
        self.assertAlmostEqual(shaft["point"][2], 420, delta=0.1)
        self.assertAlmostEqual(up["point"][2], 430, delta=0.1)
        self.assertLess(up["normal"][2], -0.9)
        self.assertGreater(top["height"], 450)
        self.assertAlmostEqual(floor["height"], 420, delta=0.1)
        self.assertAlmostEqual(ceiling["height"], 430, delta=0.1)
        self.assertEqual(below, {"status": "miss"})
        self.assertEqual({a["status"] for a in hall}, {"ok"})

    def test_a_tunnel_through_a_mountain(self):
        raster = os.path.join(DATA, "dem", "srtm1_bigtujunga_30m.tif")
        if not os.path.exists(raster):
            self.skipTest(f"no {raster}")
        xs = np.arange(-9000, 9001, 30.0)
        heights = np.array([a["height"] for a in ask(["--dem", raster],
                                                     [{"op": "height", "x": x, "y": 1000.0} for x in xs])])
        # a short tunnel, below a summit
        top = 50 + int(np.argmax(heights[50:-50]))
        level = heights[top] - 20
        low = np.nonzero(heights < level - 8)[0]
        west, east = xs[low[low < top][-1]], xs[low[low > top][0]]
        tube = {"tube": {"path": [[west, 0, 0], [east, 0, 0]], "radius": 6}}
        scene = self.scene([self.volume(tube, position=[0, 1000, level])], dem=raster)
        through, over, floor = ask(["--scene", scene], [
            *({"op": "ray", "from": [west, 1000, z], "to": [east, 1000, z]} for z in (level, level + 10)),
            {"op": "height_below", "x": float(xs[top]), "y": 1000, "z": level}])
        self.assertEqual((through["status"], over["status"]), ("miss", "ok"), (west, east, level))
        self.assertAlmostEqual(floor["height"], level - 6, delta=0.1)

    def test_a_thousand_volumes(self):
        random = np.random.default_rng(SEED)
        volumes = [self.volume({"sphere": {"radius": 2}}, op=["remove", "add"][i % 2], voxel_m=1,
                               position=[*random.uniform(-150, 150, 1), *random.uniform(-80, 80, 1), 100])
                   for i in range(1000)]
        scene = self.scene(volumes)
        self.assertEqual(len(run_json("info", "--scene", scene)["volumes"]), 1000)
        answer, = ask(["--scene", scene], [{"op": "height", "x": 1, "y": 1}])
        self.assertEqual(answer["status"], "ok")
        self.assertLess(abs(answer["height"] - 100), 2.5)

    def test_places_without_ground_have_an_answer(self):
        heights = np.full((40, 80), 100.0)
        heights[:, 60:] = -9999  # nodata connected to the border: x > 100
        raster = self.write_grid("holes.asc", heights, cell=5.0)
        inside = self.volume(position=[150, 0, 100])
        border = self.volume(position=[-200, 0, 100])
        deep = self.volume(position=[0, 50, -500])
        high = self.volume(position=[0, -50, 500])
        scene = self.scene([inside, border, deep, high], dem=raster)
        answers = ask(["--scene", scene], [{"op": "height", "x": x, "y": y}
                                           for x, y in ((150, 0), (-199.9, 0), (0, 50), (0, -50))])
        self.assertEqual([a["status"] for a in answers], ["outside", "ok", "ok", "ok"])
        self.assertAlmostEqual(answers[1]["height"], 94, delta=0.2)
        self.assertEqual([a["height"] for a in answers[2:]], [100, 100])
        self.assertEqual(len(self.heights(scene, (0, 50), low=-520)[0]), 3)

    def test_a_baked_terrain_takes_volumes_and_bakes_none(self):
        scene = self.scene([self.volume(voxel_m=1)])
        summary = run_json("bake", "--scene", scene, "--out", self.path("flat.terrane"))
        self.assertEqual(summary["volumes_left_out"], 1)
        again = self.scene([self.volume(voxel_m=1)], dem="flat.terrane")
        self.assertEqual(run_json("info", "--scene", again)["finest_spacing_m"], 1.25)
        self.assertAlmostEqual(self.heights(again, (0.1, 0.1))[0][0], 94, delta=0.3)
        self.assertNotIn("volumes_left_out", run_json("bake", "--dem", self.path("flat.asc"), "--out",
                                                      self.path("other.terrane")))

    def test_faults_name_the_file_the_key_and_the_value(self):
        self.write_block((-6, -6, -6), (6, 6, 6))
        self.write("open.obj", self.read("block.obj").decode().rsplit("f", 1)[0])
        self.write("foreign.vdb", "no level set " * 100)
        with open(self.path("short.vdb"), "wb") as file:
            file.write(b" BDV\0\0\0\0\xe0\0\0\0")
        self.write("short.ply", "ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\nproperty float y\n"
                                "property float z\nend_header\n1 2")
        v = self.volume
        for volumes, *words in (
                ([v(), v(voxel_m=0)], "volumes[1].voxel_m", "got 0"),
                ([v(voxel_m=None)], "volumes[0].voxel_m", "null"),
                ([v(voxel_m=1e-7)], "voxel_m 1e-07 m is too fine"),
                ([v(voxel_m=3), v({"sphere": {"radius": 0.5}}, voxel_m=3)], "volumes[1]", "1 m thick", "2.5 m"),
                ([v(colour=1)], "unknown key 'volumes[0].colour'"),
                ([v({"tube": {"path": [[0, 0, 0]], "radius": 6, "up": 1}})], "'volumes[0].shape.tube.up'"),
                ([v({"tube": {"path": [[0, 0]], "radius": 6}})], "volumes[0].shape.tube: path[0]", "[0,0]"),
                ([v({"tube": {"path": [], "radius": 6}})], "volumes[0].shape.tube: path"),
                ([v({"sphere": {"radius": 0}})], "volumes[0].shape: radius"),
                ([v({"hull": {"points": [[0, 0, 0], [9, 0, 0], [0, 9, 0]]}})], "hull", "thickness"),
                ([v({"compound": []})], "volumes[0].shape", '"compound"'),
                ([v(op="dig")], "volumes[0].op", '"dig"'),
                ([v(rotation=[1, 1, 0, 0])], "volumes[0].rotation", "length 1.41421"),
                ([{"op": "add", "shape": BALL}], "volumes[0].position is missing"),
                ([{"op": "add", "position": [0, 0, 0]}], "volumes[0].shape is missing"),
                ([v(position=[0, 0, 3e9])], "volumes[0].position", "3000000000"),
                ([v(position=[5000, 0, 0])], "volumes[0]", "outside the world"),
                ([v(position=[207, 0, 100])], "volumes[0]", "is beside the terrain"),
                ([v({"mesh": "open.obj"})], "volumes[0], mesh", "open.obj", "not closed"),
                ([v({"mesh": "none.obj"})], "volumes[0].shape.mesh", "none.obj"),
                ([v({"mesh": "short.ply"})], "short.ply", "ends early"),
                ([v({"mesh": "mesh.txt"})], "mesh.txt", "must be a .ply, .obj, .glb"),
                ([v({"mesh": 7})], "volumes[0].shape.mesh", "got 7"),
                ([v({"vdb": "none.vdb"})], "volumes[0], vdb", "none.vdb"),
                ([v({"vdb": "foreign.vdb"})], "volumes[0], vdb", "foreign.vdb"),
                ([v({"vdb": "short.vdb"})], "volumes[0], vdb", "short.vdb"),
                ([v({"vdb": {"file": "short.vdb", "name": "a"}})], "'volumes[0].shape.vdb.name'"),
                ([v({"vdb": {"grid": "a"}})], "volumes[0].shape.vdb.file is missing"),
                ([7], "volumes[0]", "got 7"),
                ({}, "volumes must be a list, got {}")):
            with self.subTest(str(volumes)[:200]):
                self.assert_refused(run("info", "--scene", self.scene(volumes)), [1], *words)
        with open(self.scene([v()])) as file:
            text = file.read()
        for number in ("1e999", "NaN"):
            scene = self.write("scene.json", text.replace('"position"', f'"voxel_m": {number}, "position"'))
            self.assert_refused(run("info", "--scene", scene), [1], "scene.json")
        for question, word in (({"op": "height_below", "x": 0, "y": 0}, "z is missing"),
                               ({"op": "height_below", "x": 0, "y": 0, "z": "up"}, "z must be a number")):
            answer, = ask(["--scene", self.scene([v()])], [question])
            self.assertEqual(answer["status"], "invalid")
            self.assertIn(word, answer["message"])


if __name__ == "__main__":
    main()
