#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`objects` of scenes: shared budget, columns of frames.csv, bad values and files."""

import json
import os

from program import ROOT, Folder, main, np, run, run_json

PINE = os.path.join(ROOT, "tools", "data", "pine.obj")
FLIGHT = ["--path", "straight", "--speed", 30, "--altitude", 40, "--seconds", 1, "--fps", 5, "--size", "320x180"]


class Objects(Folder):
    def scene(self, objects, **more):
        path = self.path("scene.json")
        with open(path, "w") as file:
            json.dump({"seed": 3, "objects": objects, **more}, file)
        return path

    def fly(self, scene, *arguments, flight=FLIGHT):
        out = self.path("out")
        summary = run_json("fly", "--scene", scene, "--out", out, *flight, *arguments)
        rows = np.genfromtxt(os.path.join(out, "frames.csv"), delimiter=",", names=True)
        return summary, rows

    def test_a_forest_shares_the_budget_with_the_ground(self):
        forest = [{"scatter": {"mesh": PINE, "per_km2": 3000, "seed": 2}}]
        for budget in (2000, 20000):
            summary, rows = self.fly(self.scene(forest), "--budget", budget, "--max-error-px", 2)
            self.assertEqual(summary["over_budget_frames"], 0)
            self.assertLessEqual(rows["triangles"].max(), budget)
            self.assertGreater(rows["object_triangles"].min(), 0)
            self.assertGreater(rows["objects_drawn"].min(), 0)
            self.assertGreater(rows["objects_culled"].min(), 0)
            self.assertTrue((rows["objects_ms"] <= rows["update_ms"]).all())
        self.assertGreater(summary["objects_drawn_max"], 50)

    def test_a_small_budget_leaves_objects_out_and_says_how_many(self):
        forest = [{"scatter": {"mesh": PINE, "per_km2": 20000, "seed": 2}}]
        small, _ = self.fly(self.scene(forest), "--budget", 3000)
        large, _ = self.fly(self.scene(forest), "--budget", 200000)
        self.assertGreater(small["objects_left_out_max"], large["objects_left_out_max"])
        self.assertLess(small["objects_drawn_max"], large["objects_drawn_max"])

    def test_the_budget_follows_the_times_of_frames_up_to_its_limit(self):
        forest = [{"scatter": {"mesh": PINE, "per_km2": 3000, "seed": 2}}]
        slow, rows = self.fly(self.scene(forest), "--budget", 50000, "--png", "--frame-ms", 0.1)
        self.assertEqual(slow["over_budget_frames"], 0)
        self.assertEqual(rows["budget"][-1], 2000, "no frame is that fast")
        fast, rows = self.fly(self.scene(forest), "--budget", 50000, "--png", "--frame-ms", 100000)
        self.assertEqual(fast["over_budget_frames"], 0)
        self.assertTrue((np.diff(rows["budget"]) >= 0).all(), "every frame is faster")
        self.assertTrue((rows["draw_ms"] > 0).all())
        done = run("fly", "--seed", 1, "--frame-ms", 10, "--seconds", 1)
        self.assert_refused(done, [2], "--frame-ms", "--png")

    def write_block(self):
        """A closed box, 4 m wide and 2 m high on the origin."""
        corners = [(x, y, z) for z in (0, 2) for y in (-2, 2) for x in (-2, 2)]
        quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6)]
        with open(self.path("block.obj"), "w") as file:
            file.writelines(f"v {x} {y} {z}\n" for x, y, z in corners)
            file.writelines("f {} {} {} {}\n".format(*(i + 1 for i in quad)) for quad in quads)
        return "block.obj"

    def test_bodies_collide_with_static_objects(self):
        self.write_grid("flat.asc", np.zeros((40, 80)), cell=5.0)
        block = {"mesh": self.write_block(), "position": [0, 0, 0]}
        ball = {"shape": {"sphere": {"radius": 0.5}}, "position": [0.3, 0.2, 4]}
        rest = {}
        for is_static in (True, False):
            scene = self.scene([{**block, "static": is_static}], dem="flat.asc", bodies=[ball])
            trace = self.path("trace.csv")
            answer = run_json("drop", "--scene", scene, "--count", 0, "--seconds", 3, "--trace", trace)
            self.assertEqual(answer["fell_through"], 0)
            with open(trace) as file:
                file.readline()
                rows = np.loadtxt(file, delimiter=",")
            rest[is_static] = rows[rows[:, 1] == 0][-1, 4]
        self.assertAlmostEqual(rest[True], 2.5, delta=0.02)
        self.assertAlmostEqual(rest[False], 0.5, delta=0.02)

    def test_a_truck_is_stopped_by_static_objects_on_its_path(self):
        self.write_grid("flat.asc", np.zeros((40, 80)), cell=5.0)
        self.write_block()
        distance = {}
        for is_static in (True, False):
            objects = [{"scatter": {"mesh": "block.obj", "per_km2": 3000, "static": is_static}}]
            answer = run_json("drive", "--scene", self.scene(objects, dem="flat.asc"), "--path", "straight",
                              "--seconds", 8, "--fps", 5, "--size", "64x48", "--budget", 500, "--threads", 0)
            self.assertEqual(answer["fell_through"], 0)
            distance[is_static] = answer["distance_m"]
        self.assertLess(distance[True], distance[False] - 10, distance)

    def test_the_same_flight_has_the_same_objects(self):
        scene = self.scene([{"scatter": {"mesh": PINE, "per_km2": 3000, "seed": 2}},
                            {"mesh": PINE, "position": [0, 30, 100], "scale": 3}])
        first, second = self.fly(scene)[1], self.fly(scene)[1]
        for column in ("objects_culled", "eye_z_m"):
            self.assertTrue(np.array_equal(first[column], second[column]), column)

    def test_the_ground_hides_objects_in_flights_near_it_and_equal_flights_hide_the_same(self):
        forest = [{"scatter": {"mesh": PINE, "per_km2": 3000, "seed": 2}}]
        scene = self.scene(forest)
        common = ["--path", "canyon", "--seconds", 1, "--fps", 5, "--size", "320x180", "--threads", 0]
        low = [*common, "--altitude", 2, "--speed", 20, "--budget", 20000]
        summary, rows = self.fly(scene, flight=low)
        self.assertGreater(rows["objects_occluded"].max(), 300)
        self.assertEqual(summary["objects_occluded_max"], rows["objects_occluded"].max())
        self.assertTrue((rows["objects_ms"] <= rows["update_ms"]).all())
        _, again = self.fly(scene, flight=low)
        for column in rows.dtype.names:
            if not column.endswith("_ms"):
                self.assertTrue(np.array_equal(rows[column], again[column], equal_nan=True), column)
        _, high = self.fly(scene, flight=[*common, "--altitude", 600])
        self.assertEqual(high["objects_occluded"].max(), 0)

    def test_a_scene_without_objects_has_none(self):
        summary, rows = self.fly(self.scene([]))
        self.assertEqual(rows["objects_drawn"].max(), 0)
        self.assertEqual(rows["object_triangles"].max(), 0)
        self.assertEqual(rows["objects_ms"].max(), 0)
        self.assertEqual(rows["objects_occluded"].max(), 0)
        self.assertEqual(summary["over_budget_frames"], 0)

    def test_wrong_objects_are_refused_by_their_path(self):
        scatter = {"mesh": PINE, "per_km2": 100}
        for objects, *words in (
                ({}, "objects must be a list"),
                ([{"mesh": PINE}], "objects[0].position"),
                ([{"position": [0, 0, 0]}], "objects[0].mesh is missing"),
                ([{"mesh": "none.obj", "position": [0, 0, 0]}], "objects[0].mesh", "none.obj"),
                ([{"mesh": PINE, "position": [0, 0, 0], "size": 2}], "objects[0].size", "unknown"),
                ([{"mesh": PINE, "position": [0, 0, 0], "static": 1}], "objects[0].static", "got 1"),
                ([{"mesh": PINE, "position": [0, 0, 0], "static": True, "proxy_error_m": -1}], "proxy_error_m", "-1"),
                ([{"mesh": PINE, "position": [0, 0, 0], "proxy_error_m": 1}], "proxy_error_m goes with static true"),
                ([{"mesh": PINE, "position": [0, 0, 0], "scale": 0}], "objects[0].scale", "got 0"),
                ([{"scatter": {"mesh": PINE}}], "objects[0].scatter.per_km2"),
                ([{"scatter": {**scatter, "per_km2": 1e9}}], "objects[0].scatter.per_km2", "1e+09"),
                ([{"scatter": {**scatter, "slope_deg": [40, 20]}}], "objects[0].scatter.slope_deg", "[40, 20]"),
                ([{"scatter": {**scatter, "seed": -1}}], "objects[0].scatter.seed", "-1"),
                ([{"scatter": {**scatter, "color": 1}}], "objects[0].scatter.color", "unknown")):
            with self.subTest(objects):
                done = run("fly", "--scene", self.scene(objects), *FLIGHT)
                self.assert_refused(done, [1], *words)

    def test_foreign_empty_and_flat_meshes_are_refused_by_their_file(self):
        for text, *words in (("", "no triangle"), ("GIF89a", "no triangle"), ("v 0 0 0\nf 1 1 1\n", "no triangle"),
                             ("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "nan"),
                             ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "point 8 of 3")):
            with self.subTest(text):
                path = self.path("bad.obj")
                with open(path, "w") as file:
                    file.write(text)
                scene = self.scene([{"mesh": "bad.obj", "position": [0, 0, 0]}])
                self.assert_refused(run("fly", "--scene", scene, *FLIGHT), [1], "bad.obj", *words)


if __name__ == "__main__":
    main()
