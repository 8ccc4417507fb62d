#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`terrane query`: heights against the raster, rays and shapes, bad lines."""

import json
import os
import shutil
import subprocess
import threading

from program import DATA, PROGRAM, SEED, Folder, ask, main, np, run_json


def bilinear(heights, cell, x, y):
    """The bilinear surface through the samples' centres."""
    rows, columns = heights.shape
    u = np.clip(x / cell + columns / 2 - 0.5, 0, columns - 1)
    v = np.clip(rows / 2 - 0.5 - y / cell, 0, rows - 1)
    i = np.minimum(u.astype(int), columns - 2)
    j = np.minimum(v.astype(int), rows - 2)
    s, t = u - i, v - j
    return ((heights[j, i] * (1 - s) + heights[j, i + 1] * s) * (1 - t) +
            (heights[j + 1, i] * (1 - s) + heights[j + 1, i + 1] * s) * t)


class Query(Folder):
    def check_heights(self, terrain, heights, cell, count):
        rows, columns = heights.shape
        random = np.random.default_rng(SEED)
        i, j = random.integers(0, columns, count), random.integers(0, rows, count)
        # on samples, then anywhere
        x = np.concatenate([i + 0.5 - columns / 2, random.uniform(-(columns - 1) / 2, (columns - 1) / 2, count)]) * cell
        y = np.concatenate([rows / 2 - j - 0.5, random.uniform(-(rows - 1) / 2, (rows - 1) / 2, count)]) * cell
        answers = ask(terrain, [{"id": k, "op": "height", "x": x[k], "y": y[k]} for k in range(2 * count)])
        self.assertEqual([a["id"] for a in answers], list(range(2 * count)))
        self.assertEqual({a["status"] for a in answers}, {"ok"})
        found, error, normals = (np.array([a[key] for a in answers]) for key in ("height", "error_m", "normal"))
        self.assertLessEqual(np.abs(found[:count] - heights[j, i]).max(), 1e-3, f"seed {SEED}")
        over = np.abs(found - bilinear(heights, cell, x, y)) - error
        self.assertLessEqual(over[count:].max(), 1e-9, f"seed {SEED}")
        self.assertLess(np.abs(np.linalg.norm(normals, axis=1) - 1).max(), 1e-12)
        self.assertGreater(normals[:, 2].min(), 0)

    def test_heights_of_a_small_raster(self):
        heights, raster = self.hills()
        self.check_heights(["--dem", raster], heights, 10.0, 2000)

    def test_heights_of_real_ground(self):
        raster = os.path.join(DATA, "dem", "sthelens_10m.vrt")
        if not os.path.exists(raster):
            self.skipTest("no " + raster)
        if not shutil.which("gdal_translate"):
            self.skipTest("no gdal_translate to read the raster with")
        raw = self.path("raw.bin")
        # rounded to the type of the band, as a scaling VRT and the ground are
        subprocess.run(["gdal_translate", "-q", "-of", "ENVI", raster, raw], check=True)
        heights = np.fromfile(raw, dtype="<f4").reshape(2000, 2000).astype(float)
        self.check_heights(["--dem", raster], heights, 10.0, 10_000)

    def test_nodata_at_the_border_is_outside_and_a_void_is_filled(self):
        heights, _ = self.hills(40, 40)
        heights[:, :10] = -9999
        heights[18:22, 24:28] = -9999
        raster = self.write_grid("voids.asc", heights)
        outside, beyond, void, ground = ask(["--dem", raster], [
            {"op": "height", "x": -150, "y": 0}, {"op": "height", "x": 900, "y": 0},
            {"op": "height", "x": 60, "y": 0}, {"op": "height", "x": 155, "y": 105}])
        self.assertEqual(outside, {"status": "outside"})
        self.assertEqual(beyond, {"status": "outside"})
        self.assertEqual((void["status"], void["filled"]), ("ok", True))
        self.assertEqual(ground["status"], "ok")
        self.assertNotIn("filled", ground)

    def test_every_answer_ends_at_the_extent(self):
        raster = self.write_grid("flat.asc", np.full((4, 4), 5.0))
        _, _, east, north = run_json("info", "--dem", raster)["extent_m"]
        ball = {"shape": {"sphere": {"radius": 0.5}}}
        for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1)):
            def place(beyond, z):
                return [x * (east + beyond), y * (north + beyond), z]

            def answers(beyond):
                high, low = place(beyond, 5.2), place(beyond, 0.0)
                return ask(["--dem", raster], [
                    {"op": "height", "x": high[0], "y": high[1]}, {"op": "ray", "from": high, "to": low},
                    {"op": "test", **ball, "position": high},
                    {"op": "cast", **ball, "position": place(beyond, 9.0), "to": low},
                    {"op": "distance", **ball, "position": place(beyond, 5.5)}])
            height, ray, test, cast, distance = answers(4.0)
            self.assertEqual((height["status"], ray["hit"], test["hit"], cast["hit"]), ("outside", False, False, False))
            self.assertAlmostEqual(distance["distance"], np.hypot(4.0 * np.hypot(x, y), 0.5) - 0.5, places=6)
            height, ray, test, cast, distance = answers(-1.0)
            self.assertEqual((height["height"], ray["hit"], test["hit"], cast["hit"]), (5.0, True, True, True))
            self.assertAlmostEqual(distance["distance"], 0.0, places=6)

    def test_bad_lines_get_invalid_and_the_next_is_answered(self):
        _, raster = self.hills()
        good = {"id": "good", "op": "height", "x": 1.0, "y": 2.0}
        bad = ["", "no json", "[]", "{}", '{"op":"fly"}', '{"op":"height","x":1}',
               '{"op":"height","x":NaN,"y":1}', '{"op":"height","x":1e999,"y":0}',
               '{"op":"height","x":"1","y":0}', '{"op":"ray","from":[0,0,1]}',
               '{"op":"test","shape":{"sphere":{"radius":-1}},"position":[0,0,0]}',
               '{"op":"test","shape":{"sphere":{"radius":1}},"position":[0,0]}',
               '{"op":"test","shape":{"sphere":{"radius":1}},"position":[0,0,0],"rotation":[1,0.1,0,0]}',
               '{"op":"test","shape":{"hull":{"points":[]}},"position":[0,0,0]}',
               '{"op":"test","shape":{"hull":{"points":[[0,0,0],[1,"2",3]]}},"position":[0,0,0]}',
               '{"op":"test","shape":{"compound":[]},"position":[0,0,0]}',
               '{"op":"test","shape":{"sphere":{"radius":1}},"position":[0,0,0],"other":{}}',
               '{"op":"test","shape":{"sphere":{"radius":1}},"position":[0,0,0],"other":{"shape":'
               '{"sphere":{"radius":1}},"position":[0,0,NaN]}}',
               '{"op":"cast","shape":{"sphere":{"radius":1}},"position":[0,0,0]}',
               "[" * 100000]
        lines = [line for text in bad for line in (text, good)]
        answers = ask(["--dem", raster], lines)
        self.assertEqual(len(answers), 2 * len(bad))
        for text, refused, answered in zip(bad, answers[0::2], answers[1::2]):
            self.assertEqual(refused["status"], "invalid", text[:80])
            self.assertTrue(refused["message"], text[:80])
            self.assertEqual(answered, answers[1])
        self.assertEqual((answers[1]["id"], answers[1]["status"]), ("good", "ok"))

    def test_shape_against_shape(self):
        _, raster = self.hills()
        corners = [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
        shapes = {"sphere": {"radius": 1}, "capsule": {"radius": 1, "half_height": 0},
                  "box": {"half_extents": [1, 1, 1]}, "hull": {"points": corners}}
        shapes = [{kind: sizes} for kind, sizes in shapes.items()]
        shapes.append({"compound": [{"shape": shapes[2]},
                                    {"shape": shapes[0], "position": [0, 0, 3]}]})
        questions = []
        for a in shapes:
            for b in shapes:
                for gap in (0.5, -0.25):
                    pair = {"shape": a, "position": [2 + gap, 0, 0],
                            "other": {"shape": b, "position": [0, 0, 0]}}
                    for op in ("test", "find", "distance", "pseudodistance"):
                        questions.append({"id": [op, gap], "op": op, **pair})
                questions.append({"id": ["cast", 0.5], "op": "cast", "to": [2, 0, 0], "shape": a,
                                  "position": [42, 0, 0],
                                  "other": {"shape": b, "position": [0, 0, 0]}})
        questions.append({"id": ["ray", 0.5], "op": "ray", "from": [41, 0, 0], "to": [-39, 0, 0],
                          "other": {"shape": shapes[4], "position": [0, 0, 0]}})
        for question, answer in zip(questions, ask(["--dem", raster], questions), strict=True):
            op, gap = question["id"]
            self.assertEqual(answer["status"], "ok", (question, answer))
            if op in ("test", "find"):
                self.assertEqual(answer["hit"], gap < 0, (question, answer))
            if op == "find":
                self.assertEqual(bool(answer["contacts"]), gap < 0)
            if op == "find" and gap < 0:
                contact = answer["contacts"][0]
                self.assertAlmostEqual(contact["depth"], -gap, places=12)
                np.testing.assert_allclose(contact["normal"], [1, 0, 0], atol=1e-12)
                self.assertEqual((contact["other_part"], "feature" in contact), (0, True))
            if op == "distance":
                self.assertAlmostEqual(answer["distance"], gap, places=12)
                np.testing.assert_allclose(answer["normal"], [1, 0, 0], atol=1e-12)
                self.assertAlmostEqual(answer["point"][0], 1 + gap, places=12)
                self.assertAlmostEqual(answer["other_point"][0], 1, places=12)
            if op == "pseudodistance":
                self.assertEqual(answer["distance"] < 0, gap < 0)
            if op == "cast":
                self.assertAlmostEqual(answer["fraction"], 1, places=5)
            if op == "ray":
                self.assertAlmostEqual(answer["fraction"], 0.5, places=12)

    def test_each_answer_comes_before_the_next_question(self):
        _, raster = self.hills()
        program = subprocess.Popen([PROGRAM, "query", "--dem", raster], stdin=subprocess.PIPE,
                                   stdout=subprocess.PIPE, text=True)
        watchdog = threading.Timer(60, program.kill)
        watchdog.start()
        try:
            for k in range(5):
                program.stdin.write(json.dumps({"id": k, "op": "height", "x": 10 * k, "y": 0}) + "\n")
                program.stdin.flush()
                self.assertEqual(json.loads(program.stdout.readline())["id"], k)
        finally:
            watchdog.cancel()
            program.stdin.close()
            program.stdout.close()
            self.assertEqual(program.wait(60), 0)

    def test_rays_and_shapes_over_a_plane(self):
        # exactly flat, so that every answer is known
        raster = self.flat(100.0)
        sphere = {"shape": {"sphere": {"radius": 2}}}
        box = {"shape": {"box": {"half_extents": [1, 2, 3]}}}
        capsule = {"shape": {"capsule": {"radius": 1, "half_height": 2}}}
        corners = [[x, y, z] for x in (-1, 1) for y in (-2, 2) for z in (-3, 3)]
        half = {"shape": {"box": {"half_extents": [1, 2, 1.5]}}}
        same = [{"shape": {"hull": {"points": corners}}},  # as the box
                {"shape": {"compound": [{**half, "position": [0, 0, z]} for z in (-1.5, 1.5)]}}]
        flat = {"rotation": [np.sqrt(0.5), np.sqrt(0.5), 0, 0]}  # the axis lies down
        answers = ask(["--dem", raster], [
            {"op": "ray", "from": [3, 4, 300], "to": [3, 4, 0]},
            {"op": "ray", "from": [3, 4, 300], "to": [30, 4, 101]},
            {"op": "ray", "from": [3, 4, 50], "to": [3, 4, 150]},
            {"op": "test", **sphere, "position": [0, 0, 101.9]},
            {"op": "test", **sphere, "position": [0, 0, 102.1]},
            {"op": "distance", **sphere, "position": [0, 0, 112]},
            {"op": "distance", **sphere, "position": [0, 0, 101]},
            {"op": "pseudodistance", **box, "position": [0, 0, 104]},
            {"op": "distance", **capsule, "position": [0, 0, 105]},
            {"op": "distance", **capsule, **flat, "position": [0, 0, 105]},
            {"op": "find", **box, "position": [0, 0, 102.5]},
            {"op": "cast", **box, "position": [0, 0, 203], "to": [0, 0, 3]},
            {"op": "cast", **sphere, "position": [0, 0, 203], "to": [50, 0, 203]},
            *({"op": op, **shape, "position": [0, 0, 104], "to": [0, 0, 4]}
              for shape in (box, *same) for op in ("test", "find", "distance", "pseudodistance", "cast")),
        ])
        self.assertEqual({a["status"] for a in answers} - {"ok", "miss"}, set(), answers)
        self.assertGreater(min(answer["error_m"] for answer in answers[3:11]), 0)
        self.assertAlmostEqual(answers[0]["fraction"], 2 / 3, places=9)
        self.assertEqual(answers[0]["normal"], [0, 0, 1])
        self.assertEqual((answers[1]["status"], answers[1]["hit"]), ("miss", False))
        self.assertAlmostEqual(answers[2]["fraction"], 0.5, places=9)
        self.assertTrue(answers[3]["hit"])
        self.assertFalse(answers[4]["hit"])
        for answer, distance in zip(answers[5:10], (10, -1, 1, 2, 4)):
            self.assertAlmostEqual(answer["distance"], distance, places=6)
        # A certified lower bound of the length of the distance; only of op distance.
        for i, length in ((5, 10), (6, 1), (8, 2), (9, 4)):
            self.assertAlmostEqual(answers[i]["distance_lower_bound"], length, places=6)
            self.assertLessEqual(answers[i]["distance_lower_bound"], abs(answers[i]["distance"]))
        self.assertNotIn("distance_lower_bound", answers[7])
        self.assertTrue(answers[10]["hit"])
        self.assertEqual(len(answers[10]["contacts"]), 4)
        for contact in answers[10]["contacts"]:
            self.assertAlmostEqual(contact["depth"], 0.5, places=6)
            self.assertAlmostEqual(contact["normal"][2], 1, places=9)
        self.assertAlmostEqual(answers[11]["fraction"], 0.5, delta=1e-6)
        self.assertAlmostEqual(answers[11]["normal"][2], 1, places=6)
        self.assertTrue(answers[11]["contacts"])
        self.assertEqual((answers[12]["status"], answers[12]["hit"]), ("miss", False))
        for test, find, distance, pseudodistance, cast in zip(*[iter(answers[13:])] * 5):
            self.assertEqual((test["hit"], find["hit"], find["contacts"]), (False, False, []))
            self.assertAlmostEqual(distance["distance"], 1, places=6)
            self.assertAlmostEqual(pseudodistance["distance"], 1, places=6)
            self.assertAlmostEqual(cast["fraction"], 0.01, delta=1e-6)


if __name__ == "__main__":
    main()
