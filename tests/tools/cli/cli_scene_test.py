#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Scene files: bodies and friction by place in drop, drive, walk and query; the summary of walk."""

import os

from program import ROOT, Folder, ask, main, np, run, run_json

SMALL = ("--fps", 5, "--size", "64x48", "--budget", 500, "--threads", 0)
BOX = {"box": {"half_extents": [0.5, 0.5, 0.5]}}


class Scenes(Folder):
    def over_flat(self, **content):
        return self.scene(dem=self.flat(), **content)

    def bridge(self):
        """A valley 8 m deep and 24 m wide under planks that are static bodies."""
        x = np.arange(200) + 0.5 - 100
        depth = np.where(np.abs(x) < 12, 4 + 4 * np.cos(np.pi * x / 12), 0)
        valley = self.write_grid("valley.asc", np.tile(20 - depth, (60, 1)), cell=1.0)
        planks = [{"shape": {"box": {"half_extents": [1, 3, 0.1]}}, "position": [x, 0, 20.05], "type": "static"}
                  for x in range(-13, 14, 2)]
        return self.scene(dem=valley, bodies=planks)

    def write_l(self, name="l.obj", missing=0):
        """A prism over an L, without the last triangles."""
        corners = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
        faces = []
        for a, b, c in ((0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)):
            faces += [(a, c, b), (a + 6, b + 6, c + 6)]
        for i in range(6):
            k = (i + 1) % 6
            faces += [(i, k, k + 6), (i, k + 6, i + 6)]
        lines = [f"v {x} {y} {z}" for z in (0, 1) for x, y in corners]
        lines += ["f {} {} {}".format(*(i + 1 for i in face)) for face in faces[:len(faces) - missing]]
        return self.write(name, "\n".join(lines) + "\n")

    def test_bodies_of_mesh_files_are_dropped(self):
        mesh = self.write_l()
        shape = {"file": "l.obj", "proxy_error_m": 0.05}
        scene = self.over_flat(bodies=[{"shape": shape, "position": [0, 0, 3]}])
        answer = run_json("drop", "--scene", scene, "--count", 4, "--shape", "file:" + mesh, "--proxy-error", 0.05,
                          "--seconds", 3)
        self.assertEqual((answer["bodies"], answer["fell_through"]), (5, 0))
        self.assertLess(answer["max_depth_m"], 0.02)

    def test_mesh_files_that_are_no_bodies_are_one_line(self):
        self.write_l("open.obj", missing=1)
        self.write_l()
        for shape, said in (({"file": "open.obj"}, "not closed"), ({"file": "none.obj"}, "none.obj"),
                            ({"file": "l.obj", "proxy_error_m": 0}, "not convex"),
                            ({"file": "l.obj", "proxy_error_m": -1}, "proxy_error_m"),
                            ({"file": 3}, "shape.file"), ({"file": "l.obj", "error": 1}, "shape.error")):
            scene = self.over_flat(bodies=[{"shape": shape, "position": [0, 0, 3]}])
            self.assert_refused(run("drop", "--scene", scene, "--count", 0, "--seconds", 1), [1], "bodies[0]", said)

    def test_a_drop_plays_every_shape_and_type(self):
        shapes = [{"sphere": {"radius": 0.5}}, {"capsule": {"radius": 0.3, "half_height": 0.5}}, BOX,
                  {"hull": {"points": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]}},
                  {"compound": [{"shape": BOX}, {"shape": BOX, "position": [0.8, 0, 0]}]}]
        bodies = [{"shape": shape, "position": [4 * i, 4 * k, 3], "type": kind, "friction": 0.5, "restitution": 0.1}
                  for i, shape in enumerate(shapes) for k, kind in enumerate(("dynamic", "static", "kinematic"))]
        bodies[0]["velocity"], bodies[0]["spin"], bodies[0]["mass"] = [1, 0, 0], [0, 0, 2], 5
        scene = self.over_flat(bodies=bodies)
        trace = self.path("trace.csv")
        alone = run_json("drop", "--scene", scene, "--count", 0, "--seconds", 3, "--trace", trace)
        self.assertEqual(alone["bodies"], 15)
        self.assertEqual((alone["fell_through"], alone["parked"], alone["left_world"]), (0, 0, 0))
        poses = np.loadtxt(trace, delimiter=",", skiprows=1).reshape(-1, 15, 9)
        drop = poses[0, :, 4] - poses[-1, :, 4]
        self.assertTrue((drop[0::3] > 1.5).all(), drop)  # dynamic ones fall
        self.assertTrue((drop[1::3] == 0).all() and (drop[2::3] == 0).all(), drop)
        more = run_json("drop", "--scene", scene, "--count", 20, "--seconds", 2)
        self.assertEqual((more["bodies"], more["fell_through"]), (35, 0))
        self.assertEqual(run_json("drop", "--scene", scene, "--count", 0, "--seconds", 3)["state_hash"],
                         alone["state_hash"])

    def test_vehicles_and_characters_cross_a_bridge_of_static_bodies(self):
        scene = self.bridge()
        track = self.write("track.csv", "x_m,y_m\n-84,0\n84,0\n")  # built-in paths do not know of bodies
        for vehicle in ("truck", "tracked", "six-wheeler"):
            summary = run_json("drive", "--scene", scene, "--vehicle", vehicle, "--path", track, "--speed", 12, "--seconds", 14,
                               "--out", self.path("out"), *SMALL)
            self.assertEqual(summary["fell_through"], 0)
            rows = self.columns()
            over = rows[np.abs(rows["eye_x_m"]) < 90]
            self.assertGreater(rows["eye_x_m"][-1], 5, vehicle)
            self.assertGreater(over["eye_z_m"].min(), 20, vehicle)
        summary = run_json("walk", "--scene", scene, "--path", track, "--seconds", 40, "--speed", 4, *SMALL)
        self.assertEqual(summary["fell_through"], 0)
        self.assertGreater(summary["distance_m"], 120)

    def test_a_start_in_a_body_is_refused(self):
        for command in ("drive", "walk"):
            run_json(command, "--scene", self.over_flat(), "--seconds", 1, "--out", self.path("out"), *SMALL)
            eye = self.columns()["eye_x_m"][0]
            wall = {"shape": {"box": {"half_extents": [20, 20, 20]}}, "position": [float(eye), 0, 0], "type": "static"}
            self.assert_refused(run(command, "--scene", self.over_flat(bodies=[wall]), "--seconds", 3, *SMALL), [1],
                                "body of the scene", "starts")

    def test_crates_and_dropped_bodies_keep_clear_of_the_scene(self):
        wall = {"shape": {"box": {"half_extents": [30, 1, 30]}}, "position": [0, 4, 0], "type": "static"}
        scene = self.over_flat(bodies=[wall])
        for command in (["drive", "--crates", 30], ["walk", "--crates", 30]):
            summary = run_json(*command, "--scene", scene, "--seconds", 3, *SMALL)
            self.assertEqual(summary["fell_through"], 0)
        summary = run_json("drop", "--scene", scene, "--count", 100, "--seconds", 2)
        self.assertEqual((summary["bodies"], summary["fell_through"]), (101, 0))

    def test_friction_by_place(self):
        """A box slides to rest on rough ground and slides on over ice; query answers the friction."""
        slider = {"shape": BOX, "position": [0, 0, 0.5], "velocity": [6, 0, 0], "mass": 10, "friction": 0.6}
        ice = [{"rect": [-300, -300, 300, 300], "friction": 0.9}, {"rect": [-200, -100, 200, 100], "friction": 0}]
        trace = self.path("t.csv")

        def end(**more):
            run_json("drop", "--scene", self.over_flat(bodies=[slider], **more), "--count", 0, "--seconds", 4,
                     "--trace", trace)
            return np.loadtxt(trace, delimiter=",", skiprows=1)[-1, 2]

        self.assertLess(end(), 5)
        self.assertGreater(end(surface=ice), 20)
        self.write_grid("friction.asc", np.zeros((40, 80)), cell=5.0)
        self.assertGreater(end(surface="friction.asc"), 20)
        self.write_grid("friction.asc", np.full((40, 80), 0.8), cell=5.0)
        self.assertLess(end(surface="friction.asc"), 5)
        def friction(y, **more):
            answer = ask(["--scene", self.over_flat(**more)], [{"id": 1, "op": "height", "x": 0, "y": y}])[0]
            self.assertEqual(answer["status"], "ok")
            return answer.get("friction")

        self.assertEqual(friction(0, surface=ice), 0)
        self.assertEqual(friction(90, surface=ice[:1]), 0.9)
        self.assertEqual(friction(0), None)

    def test_faults_name_the_file_the_key_and_the_value(self):
        body = {"shape": BOX, "position": [0, 0, 1]}
        for content, *words in (
                ({"bodies": [body, {**body, "mass": 0}]}, "scene.json", "bodies[1].mass", "got 0"),
                ({"bodies": [{**body, "mas": 1}]}, "scene.json", "'bodies[0].mas'", "did you mean mass?"),
                ({"surface": [{"rect": [0, 0, 1, 1], "friction": -2}]}, "scene.json", "surface[0].friction", "-2"),
                ({"surface": "none.tif"}, "none.tif"),
                ({"water_m": "high"}, "scene.json", "water_m", '"high"'),
                ({"imagery": "none.png"}, "none.png"),
                ({"boddies": []}, "scene.json", "'boddies'", "did you mean bodies?")):
            scene = ["--scene", self.over_flat(**content)]
            self.assert_all_refused([(["drop", *scene, "--count", 1, "--seconds", 0.1], *words),
                                     (["drive", *scene, *SMALL], *words), (["walk", *scene, *SMALL], *words)], [1])

    def test_a_note_names_the_keys_that_a_command_does_not_use(self):
        self.write("rock.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
        scene = self.over_flat(bodies=[{"shape": BOX, "position": [60, 60, 1], "type": "static"}], water_m=-5,
                               surface=[{"rect": [0, 0, 1, 1], "friction": 0.5}],
                               objects=[{"mesh": "rock.obj", "position": [50, 50, 0]}])
        flight = ("--seconds", 2, *SMALL)
        for arguments, unused in (
                (("info",), "bodies, water_m, surface, objects"), (("mesh",), "bodies, water_m, surface"),
                (("heightmap", "--side", 5), "bodies, water_m, surface, objects"),
                (("bake", "--out", self.path("flat.terrane")), "bodies, water_m, surface, objects"),
                (("fly", *flight), "surface"), (("drive", *flight), None), (("walk", *flight), None),
                (("drop", "--count", 1, "--seconds", 0.1), None), (("query",), "water_m")):
            with self.subTest(arguments):
                done = run(*arguments, "--scene", scene, stdin="")
                self.assertEqual(done.returncode, 0, done.stderr)
                notes = [line for line in done.stderr.splitlines() if "does not use" in line]
                wanted = [f"terrane: {arguments[0]} does not use {unused} of the scene '{scene}'"] if unused else []
                self.assertEqual(notes, wanted)
        empty = run("info", "--scene", self.over_flat(bodies=[], objects=[]))
        self.assertEqual(empty.stderr, "")

    def test_a_query_says_once_that_it_leaves_out_bodies_and_objects(self):
        scene = self.over_flat(bodies=[{"shape": BOX, "position": [0, 0, 1]}])
        height, ray = '{"op":"height","x":0,"y":0}\n', '{"op":"ray","from":[0,0,9],"to":[0,0,-9]}\n'
        find = '{"op":"find","shape":{"sphere":{"radius":1}},"position":[0,0,1]}\n'
        pair = f'{{"op":"test","shape":{{"sphere":{{"radius":1}}}},"position":[0,0,0],"other":{{"shape":{{"sphere":' \
               f'{{"radius":1}}}},"position":[0,0,1]}}}}\n'
        for questions, count in ((height + pair + ray + "no question\n", 0), (height + find + find, 1)):
            done = run("query", "--scene", scene, stdin=questions)
            self.assertEqual(done.stderr.count("are met by ray and pick alone"), count, done.stderr)
        self.assertEqual(run("query", "--scene", self.over_flat(), stdin=find).stderr, "")

    def test_a_flight_shows_the_bodies_of_its_scene(self):
        track = self.write("track.csv", "time_s,x_m,y_m,z_m\n0,-100,0,30\n10,100,0,30\n")
        ball = {"shape": {"sphere": {"radius": 15}}, "position": [0, 0, 30]}
        pictures = []
        node = {"box": {"half_extents": [12, 12, 12]}, "children": [{"emitter": {"radius_m": [5, 8]}}]}
        for bodies in ([], [ball], [{**ball, "type": "static"}], [{**ball, "node": node}]):
            done = run("fly", "--scene", self.over_flat(bodies=bodies), "--path", track, "--seconds", 0.2, *SMALL,
                       "--png", "--out", self.path("out"))
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            pictures.append(self.read("out/frame_000000.png"))
        self.assertEqual(len(set(pictures)), 4)

    def test_a_drop_shows_the_nodes_of_bodies_from_the_start_and_after_a_restore(self):
        world = self.path("world")

        def picture(size, *arguments):
            look = {"box": {"half_extents": [size, size, size]}}
            bodies = [{"shape": BOX, "position": [0, 0, 2]}, {"shape": BOX, "position": [3, 0, 2], "node": look}]
            run_json("drop", "--scene", self.over_flat(bodies=bodies), "--seconds", 0.1, "--fps", 10, "--size", "64x48", "--png",
                     "--out", self.path("out"), *arguments)
            return self.read("out/frame_000000.png")

        start = ("--count", 2, "--shape", "sphere")
        self.assertTrue(picture(0.9, *start, "--save", world) != picture(0.1, *start))
        self.assertTrue(picture(0.9, "--restore", world) != picture(0.1, "--restore", world))

    def test_a_drop_of_nothing_is_refused(self):
        self.assert_refused(run("drop", "--scene", self.over_flat(), "--count", 0), [1], "--count 0", "has no bodies")


class Walk(Folder):
    KEYS = {"distance_m", "max_depth_m", "fell_through", "crates_touched", "airborne_share", "steps", "parked",
            "left_world", "arrived", "seconds"}

    def test_a_character_walks_among_crates_over_real_ground(self):
        raster = os.path.join(ROOT, "tools", "data", "jacksboro.tif")
        arguments = ("walk", "--dem", raster, "--seed", 7, "--seconds", 20, *SMALL)
        summary = run_json(*arguments, "--crates", 40)
        self.assertLessEqual(self.KEYS, set(summary))
        self.assertEqual((summary["fell_through"], summary["parked"], summary["left_world"]), (0, 0, 0))
        self.assertGreaterEqual(summary["crates_touched"], 1)
        self.assertLess(summary["max_depth_m"], 0.01)
        self.assertGreater(summary["distance_m"], 20)
        self.assertLess(summary["airborne_share"], 0.05)
        none = run_json(*arguments)
        self.assertEqual(none["crates_touched"], 0)
        self.assertAlmostEqual(none["distance_m"], 30, delta=4)

    def test_a_wall_is_walked_around(self):
        flat = self.write_grid("flat.asc", np.zeros((40, 80)), cell=2.0)
        wall = {"shape": {"box": {"half_extents": [0.3, 4, 2]}}, "position": [0, 0.5, 0], "type": "static"}
        run_json("walk", "--scene", self.scene(dem=flat, bodies=[wall]), "--seconds", 60, "--speed", 2, "--out",
                 self.path("out"), *SMALL)
        rows = self.columns()
        self.assertGreater(rows["eye_x_m"][-1], 5)
        self.assertTrue((np.abs(rows["eye_y_m"]) > 2).any())


if __name__ == "__main__":
    main()
