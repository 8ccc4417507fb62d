#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The program as a script sees it: flags, keys, exit codes, bad input, heights against the raster.

    cli_test.py PROGRAM [unittest arguments]

Shares no code with the library. Rasters are written here, as ESRI ASCII grids, so that no tool is
needed; what needs GDAL's programs or the real data is skipped with a reason where they are absent.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import unittest

try:
    import numpy as np
except ImportError:
    print("skipped: no numpy for", sys.executable)
    sys.exit(77)

PROGRAM = os.path.abspath(sys.argv[1]) if len(sys.argv) > 1 else "terrane"
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
DATA = os.environ.get("TERRANE_DATA", os.path.join(ROOT, "..", "shared", "data"))
SEED = 20240501


def run(*arguments, stdin=None, timeout=120):
    return subprocess.run([PROGRAM, *map(str, arguments)], input=stdin, capture_output=True,
                          text=True, timeout=timeout)


def run_json(*arguments):
    done = run(*arguments, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def ask(terrain, questions, *arguments):
    text = "".join((q if isinstance(q, str) else json.dumps(q)) + "\n" for q in questions)
    done = run("query", *terrain, *arguments, stdin=text)
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


class Folder(unittest.TestCase):
    """A test with a folder for its files."""

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="terrane_cli_")
        self.addCleanup(shutil.rmtree, self.folder)

    def path(self, name):
        return os.path.join(self.folder, name)

    def write_grid(self, name, heights, cell=10.0, nodata=-9999):
        """Heights row by row from the north, as an ESRI ASCII grid."""
        heights = np.asarray(heights, dtype=float)
        with open(self.path(name), "w") as file:
            file.write(f"ncols {heights.shape[1]}\nnrows {heights.shape[0]}\nxllcorner 500000\n"
                       f"yllcorner 4000000\ncellsize {cell}\nNODATA_value {nodata}\n")
            for row in heights:
                file.write(" ".join(f"{value:.3f}" for value in row) + "\n")
        return self.path(name)

    def hills(self, columns=60, rows=45, cell=10.0):
        random = np.random.default_rng(SEED)
        y, x = np.mgrid[0:rows, 0:columns]
        heights = 500 + 40 * np.sin(x / 5.0) * np.cos(y / 7.0) + random.uniform(0, 5, (rows, columns))
        heights = np.round(heights, 3)
        return heights, self.write_grid("hills.asc", heights, cell)


class CommandLine(Folder):
    def assert_refused(self, done, codes, *words):
        self.assertIn(done.returncode, codes, done.stderr + done.stdout)
        lines = done.stderr.splitlines()
        self.assertEqual(len(lines), 1, done.stderr)
        self.assertTrue(lines[0].startswith("terrane: "), lines[0])
        for word in words:
            self.assertIn(str(word), lines[0])
        self.assertEqual(done.stdout, "")

    def test_help_and_version_succeed_everywhere(self):
        self.assertEqual(run("--help").returncode, 0)
        self.assertRegex(run("--version").stdout, r"^terrane \d+\.\d+\.\d+\n$")
        commands = ["info", "mesh", "query", "drop", "page"]
        for command in ("fly", "drive"):
            if f"\n  {command} " in run("--help").stdout:
                commands.append(command)
        for command in commands:
            done = run(command, "--help")
            self.assertEqual(done.returncode, 0, command)
            self.assertIn("Example: ", done.stdout)
            self.assertIn("--dem", done.stdout)

    def test_wrong_flags_are_usage_errors_that_name_them(self):
        self.assert_refused(run(), [2], "subcommand")
        self.assert_refused(run("dance"), [2], "dance")
        self.assert_refused(run("--dance"), [2], "--dance")
        for command in ("info", "mesh", "query", "drop", "page"):
            self.assert_refused(run(command, "--seed", 1, "--dance"), [2], "--dance")
            self.assert_refused(run(command), [2], "--dem", "--seed")
            self.assert_refused(run(command, "--seed", "x1"), [2], "--seed", "x1")
            for value in ("0", "-1", "nan", "inf", "wide"):
                self.assert_refused(run(command, "--seed", 1, "--detail-m", value), [2],
                                    "--detail-m", value)

    def test_wrong_values_of_mesh_are_refused(self):
        out = self.path("a.ply")
        for flag, value in (("--budget", -5), ("--budget", 0), ("--budget", "many"), ("--budget", 3),
                            ("--size", "0x100"), ("--size", "100x0"), ("--size", "-1x1"),
                            ("--size", "100"), ("--max-error-px", 0), ("--max-error-px", "nan"),
                            ("--fov-deg", 0), ("--fov-deg", 180), ("--fov-deg", "nan"),
                            ("--eye", "nan,0,0"), ("--eye", "1,2"), ("--look", "1,2,inf"),
                            ("--memory-mb", 0), ("--memory-mb", -1)):
            done = run("mesh", "--seed", 1, "--out", out, f"{flag}={value}")
            self.assert_refused(done, [1, 2], value)
            self.assertEqual(os.listdir(self.folder), [])
        self.assert_refused(run("mesh", "--seed", 1, "--eye", "1,2,3", "--look", "1,2,3"), [1, 2])

    def test_wrong_values_of_drop_are_usage_errors(self):
        trace = self.path("t.csv")
        for flag, value in (("--count", 0), ("--count", -1), ("--count", 1.5), ("--dt", 0),
                            ("--dt", -0.1), ("--dt", 1.5), ("--dt", "nan"), ("--seconds", 0),
                            ("--seconds", "nan"), ("--speed", "nan"), ("--spin", "inf"),
                            ("--shape", "egg")):
            done = run("drop", "--seed", 1, "--trace", trace, f"{flag}={value}")
            self.assert_refused(done, [2], flag, value)
            self.assertEqual(os.listdir(self.folder), [])

    def test_wrong_values_of_page_are_usage_errors(self):
        out = self.path("out")
        for flag, value in (("--latency-ms", -1), ("--latency-ms", "5,,20"), ("--latency-ms", "5,"),
                            ("--bandwidth-mb", 0), ("--memory-mb", "64,0"), ("--policy", "x"),
                            ("--policy", "deadline,"), ("--path", "zigzag"), ("--path", "straight,"),
                            ("--speed", "50,0"), ("--radius", "0"), ("--slots", 1025),
                            ("--threads", 0), ("--bodies", -1), ("--failure-share", 1.5),
                            ("--horizon-s", "nan"), ("--announce-s", -1), ("--fps", 0)):
            done = run("page", "--seed", 1, "--out", out, f"{flag}={value}")
            self.assert_refused(done, [2], flag, str(value).split(",")[-1])
            self.assertEqual(os.listdir(self.folder), [])
        self.assert_refused(run("page", "--seed", 1, "--memory-mb", 0.5), [1], "memory")
        self.assert_refused(run("page", "--seed", 1, "--path", "none.csv"), [1], "none.csv")

    def test_wrong_values_of_fly_are_usage_errors(self):
        for flag, value in (("--latency-ms", -1), ("--bandwidth-mb", 0), ("--policy", "x"),
                            ("--policy", "deadline,distance"), ("--radius", 0), ("--path", "zigzag")):
            self.assert_refused(run("fly", "--seed", 1, f"{flag}={value}"), [2], flag, value)
        self.assert_refused(run("drive", "--seed", 1, "--path", "teleports"), [1], "teleports")

    def test_bad_rasters_fail_with_a_line_that_names_them(self):
        missing = self.path("missing.tif")
        text = self.path("text.tif")
        with open(text, "w") as file:
            file.write("these are no heights\n" * 50)
        empty = self.path("empty.tif")
        open(empty, "w").close()
        rasters = [missing, text, empty, self.folder, self.write_grid("one.asc", [[5.0]]),
                   self.write_grid("nothing.asc", np.full((20, 20), -9999.0))]
        for raster in rasters:
            for command in (["info"], ["mesh", "--out", self.path("a.ply")], ["query"], ["page"],
                            ["drop", "--count", 3, "--trace", self.path("t.csv")]):
                done = run(*command, "--dem", raster, stdin="")
                self.assert_refused(done, [1], os.path.basename(raster))
        self.assertFalse(os.path.exists(self.path("a.ply")))
        self.assertFalse(os.path.exists(self.path("t.csv")))

    def test_bad_scenes_fail_with_a_line_that_names_them(self):
        def scene(text):
            with open(self.path("scene.json"), "w") as file:
                file.write(text)
            return self.path("scene.json")

        self.assert_refused(run("info", "--scene", self.path("none.json")), [1], "none.json")
        self.assert_refused(run("info", "--scene", scene("{")), [1], "scene.json")
        self.assert_refused(run("info", "--scene", scene('{"seed":1,"moon":2}')), [1], "moon")
        self.assert_refused(run("info", "--scene", scene('{"dem":"none.tif"}')), [1], "none.tif")
        self.assert_refused(run("info", "--scene", scene('{"seed":1}'), "--seed", 2), [2], "--seed")

    def test_a_full_disk_is_a_failure(self):
        if not os.path.exists("/dev/full"):
            self.skipTest("no /dev/full here")
        with open("/dev/full", "w") as full:
            done = subprocess.run([PROGRAM, "info", "--seed", "1"], stdout=full,
                                  stderr=subprocess.PIPE, text=True)
        self.assertEqual(done.returncode, 1)
        self.assertIn("standard output", done.stderr)
        self.assert_refused(run("mesh", "--seed", 1, "--budget", 500, "--out", "/dev/full"), [1],
                            "/dev/full")
        self.assert_refused(run("drop", "--seed", 1, "--count", 50, "--trace", "/dev/full"), [1],
                            "/dev/full")


class Info(Folder):
    def test_keys_of_a_raster(self):
        heights, raster = self.hills(columns=60, rows=45)
        info = run_json("info", "--dem", raster)
        self.assertEqual(info["extent_m"], [-300, -225, 300, 225])
        self.assertAlmostEqual(info["min_m"], heights.min(), places=3)
        self.assertAlmostEqual(info["max_m"], heights.max(), places=3)
        self.assertEqual(info["finest_spacing_m"], 10)
        self.assertEqual(info["root_size_m"], 10 * 128 * 2 ** (info["levels"] - 1))
        self.assertEqual(info["nodata_share"], 0)
        self.assertIn("crs", info)
        self.assertEqual(info["centre"], [500300, 4000225])

    def test_a_scene_is_the_same_terrain(self):
        _, raster = self.hills()
        with open(self.path("scene.json"), "w") as file:
            json.dump({"dem": os.path.basename(raster), "seed": 3, "detail_m": 2.5}, file)
        of_scene = run_json("info", "--scene", self.path("scene.json"))
        of_flags = run_json("info", "--dem", raster, "--seed", 3, "--detail-m", 2.5)
        of_scene.pop("terrain"), of_flags.pop("terrain")
        self.assertEqual(of_scene, of_flags)
        self.assertLessEqual(of_flags["finest_spacing_m"], 2.5)

    def test_detail_spacing(self):
        self.assertEqual(run_json("info", "--seed", 1)["finest_spacing_m"], 1)
        self.assertEqual(run_json("info", "--seed", 1, "--detail-m", 0.3)["finest_spacing_m"], 0.25)
        _, raster = self.hills()
        self.assertLessEqual(run_json("info", "--dem", raster, "--seed", 1)["finest_spacing_m"], 1)

    def test_nodata_share_counts_samples(self):
        heights, _ = self.hills(40, 40)
        heights[:, :10] = -9999
        info = run_json("info", "--dem", self.write_grid("frame.asc", heights))
        self.assertAlmostEqual(info["nodata_share"], 0.25, places=6)


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
        i = random.integers(0, columns, count)
        j = random.integers(0, rows, count)
        x = (i + 0.5 - columns / 2) * cell
        y = (rows / 2 - j - 0.5) * cell
        answers = ask(terrain, [{"id": k, "op": "height", "x": x[k], "y": y[k]} for k in range(count)])
        self.assertEqual([a["id"] for a in answers], list(range(count)))
        self.assertEqual({a["status"] for a in answers}, {"ok"})
        found = np.array([a["height"] for a in answers])
        self.assertLessEqual(np.abs(found - heights[j, i]).max(), 1e-3, f"seed {SEED}")

        x = random.uniform(-(columns - 1) / 2, (columns - 1) / 2, count) * cell
        y = random.uniform(-(rows - 1) / 2, (rows - 1) / 2, count) * cell
        answers = ask(terrain, [{"op": "height", "x": x[k], "y": y[k]} for k in range(count)])
        self.assertEqual({a["status"] for a in answers}, {"ok"})
        found = np.array([a["height"] for a in answers])
        error = np.array([a["error_m"] for a in answers])
        over = np.abs(found - bilinear(heights, cell, x, y)) - error
        self.assertLessEqual(over.max(), 1e-9, f"seed {SEED}")
        normals = np.array([a["normal"] for a in answers])
        self.assertLess(np.abs(np.linalg.norm(normals, axis=1) - 1).max(), 1e-12)
        self.assertGreater(normals[:, 2].min(), 0)

    def test_heights_of_a_small_raster(self):
        heights, raster = self.hills()
        self.check_heights(["--dem", raster], heights, 10.0, 5000)

    def test_heights_of_real_ground(self):
        raster = os.path.join(DATA, "dem", "sthelens_10m.vrt")
        if not os.path.exists(raster):
            self.skipTest("no " + raster)
        if not shutil.which("gdal_translate"):
            self.skipTest("no gdal_translate to read the raster with")
        raw = self.path("raw.bin")
        # as the band's own type: a VRT that scales rounds to it, and so does the ground
        subprocess.run(["gdal_translate", "-q", "-of", "ENVI", raster, raw], check=True)
        heights = np.fromfile(raw, dtype="<f4").reshape(2000, 2000).astype(float)
        self.check_heights(["--dem", raster], heights, 10.0, 100_000)

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
            if op == "distance":
                self.assertAlmostEqual(answer["distance"], gap, places=12)
                np.testing.assert_allclose(answer["normal"], [1, 0, 0], atol=1e-12)
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
        # exactly flat: every answer is known
        raster = self.write_grid("flat.asc", np.full((40, 40), 100.0))
        sphere = {"shape": {"sphere": {"radius": 2}}}
        box = {"shape": {"box": {"half_extents": [1, 2, 3]}}}
        capsule = {"shape": {"capsule": {"radius": 1, "half_height": 2}}}
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
        ])
        self.assertEqual({a["status"] for a in answers} - {"ok", "miss"}, set(), answers)
        self.assertAlmostEqual(answers[0]["fraction"], 2 / 3, places=9)
        self.assertEqual(answers[0]["normal"], [0, 0, 1])
        self.assertEqual((answers[1]["status"], answers[1]["hit"]), ("miss", False))
        self.assertAlmostEqual(answers[2]["fraction"], 0.5, places=9)
        self.assertTrue(answers[3]["hit"])
        self.assertFalse(answers[4]["hit"])
        for answer, distance in zip(answers[5:10], (10, -1, 1, 2, 4)):
            self.assertAlmostEqual(answer["distance"], distance, places=6)
        self.assertTrue(answers[10]["hit"])
        self.assertEqual(len(answers[10]["contacts"]), 4)
        for contact in answers[10]["contacts"]:
            self.assertAlmostEqual(contact["depth"], 0.5, places=6)
            self.assertAlmostEqual(contact["normal"][2], 1, places=9)
        self.assertAlmostEqual(answers[11]["fraction"], 0.5, delta=1e-6)
        self.assertAlmostEqual(answers[11]["normal"][2], 1, places=6)
        self.assertTrue(answers[11]["contacts"])
        self.assertEqual((answers[12]["status"], answers[12]["hit"]), ("miss", False))


def read_ply(path):
    with open(path, "rb") as file:
        content = file.read()
    header, body = content.split(b"end_header\n", 1)
    lines = header.decode().splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"], lines
    counts = {line.split()[1]: int(line.split()[2]) for line in lines if line.startswith("element")}
    assert [line for line in lines if line.startswith("property")] == [
        "property double x", "property double y", "property double z",
        "property list uchar uint vertex_indices"]
    vertices = np.frombuffer(body, "<f8", 3 * counts["vertex"]).reshape(-1, 3)
    faces = np.frombuffer(body, np.dtype([("n", "u1"), ("v", "<u4", 3)]), counts["face"],
                          24 * counts["vertex"])
    assert len(body) == 24 * counts["vertex"] + 13 * counts["face"]
    assert (faces["n"] == 3).all()
    return vertices, faces["v"].astype(np.int64)


class Mesh(Folder):
    def check_mesh(self, terrain, budget, *arguments):
        out = self.path("mesh.ply")
        summary = run_json("mesh", *terrain, "--budget", budget, "--out", out, *arguments)
        vertices, faces = read_ply(out)
        self.assertEqual(summary["triangles"], len(faces))
        self.assertEqual(summary["vertices"], len(vertices))
        self.assertLessEqual(len(faces), budget)
        self.assertGreater(summary["error_px"], 0)
        self.assertIn(summary["status"], ("error_met", "budget_reached"))
        # counter-clockwise from above, and together the whole of the root squares
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        area = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
        self.assertGreater(area.min(), 0)
        size = vertices[:, :2].max(axis=0) - vertices[:, :2].min(axis=0)
        self.assertAlmostEqual(area.sum() / (size[0] * size[1]), 1, places=9)
        # each directed edge once; without its opposite only on the border
        edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        keys = edges[:, 0] * len(vertices) + edges[:, 1]
        self.assertEqual(len(np.unique(keys)), len(keys))
        single = edges[~np.isin(keys, edges[:, 1] * len(vertices) + edges[:, 0])]
        low, high = vertices[:, :2].min(axis=0), vertices[:, :2].max(axis=0)
        p, q = vertices[single[:, 0], :2], vertices[single[:, 1], :2]
        on_border = (((p == low) & (q == low)) | ((p == high) & (q == high))).any(axis=1)
        self.assertTrue(on_border.all())
        self.assertEqual(len(np.unique(vertices[:, :2], axis=0)), len(vertices))
        return summary

    def test_mesh_of_a_fractal_is_whole_and_within_budget(self):
        for budget in (8, 1000, 50_000):
            summary = self.check_mesh(["--seed", 5], budget)
            self.assertEqual(summary["status"], "budget_reached")
        summary = self.check_mesh(["--seed", 5], 1_000_000, "--max-error-px", 8)
        self.assertEqual(summary["status"], "error_met")
        self.assertLessEqual(summary["error_px"], 8)

    def test_mesh_of_a_raster_from_a_chosen_eye(self):
        _, raster = self.hills(300, 200)
        self.check_mesh(["--dem", raster], 20_000, "--eye", "-200,-900,700", "--look", "0,0,500",
                        "--fov-deg", 45, "--size", "640x480")

    def test_the_same_view_gives_the_same_bytes(self):
        contents = []
        for name in ("a.ply", "b.ply"):
            run_json("mesh", "--seed", 5, "--budget", 3000, "--out", self.path(name))
            with open(self.path(name), "rb") as file:
                contents.append(file.read())
        self.assertEqual(*contents)

    def test_a_folder_that_is_not_there_leaves_nothing(self):
        done = run("mesh", "--seed", 5, "--budget", 500, "--out", self.path("no/a.ply"))
        self.assertEqual(done.returncode, 1)
        self.assertIn("no/a.ply", done.stderr)


class Drop(Folder):
    KEYS = {"bodies", "fell_through", "parked", "left_world", "lost_time_share", "awake_body_steps",
            "max_depth_m", "step_ms_median", "step_ms_p99", "state_hash"}

    def test_keys_and_trace(self):
        _, raster = self.hills()
        trace = self.path("trace.csv")
        summary = run_json("drop", "--dem", raster, "--shape", "mixed", "--count", 30, "--speed", 20,
                           "--spin", 2, "--dt", "1/60", "--seconds", 1, "--no-sleep", "--trace", trace)
        self.assertLessEqual(self.KEYS, set(summary))
        self.assertEqual(summary["bodies"], 30)
        self.assertEqual(summary["awake_body_steps"], 30 * 60)
        self.assertEqual((summary["fell_through"], summary["parked"], summary["left_world"]), (0, 0, 0))
        self.assertRegex(summary["state_hash"], "^[0-9a-f]{16}$")
        with open(trace) as file:
            self.assertEqual(file.readline(), "step,body,x,y,z,qw,qx,qy,qz\n")
            poses = np.loadtxt(file, delimiter=",")
        self.assertEqual(poses.shape, (30 * 61, 9))
        self.assertTrue((poses[:, 0] == np.repeat(np.arange(61), 30)).all())
        self.assertTrue((poses[:, 1] == np.tile(np.arange(30), 61)).all())
        self.assertLess(np.abs(np.linalg.norm(poses[:, 5:], axis=1) - 1).max(), 1e-12)
        start, first = poses[:30], poses[30:60]
        self.assertTrue((first[:, 4] < start[:, 4]).all())

    def test_the_same_drop_gives_the_same_states_and_another_seed_does_not(self):
        def state(seed):
            return run_json("drop", "--seed", seed, "--count", 10, "--seconds", 0.5)["state_hash"]

        self.assertEqual(state(3), state(3))
        self.assertNotEqual(state(3), state(4))


class Page(Folder):
    KEYS = {"frames", "late_frames", "late_share", "excess_error_px_s", "bytes_loaded",
            "bytes_wasted", "peak_bytes", "contact_late", "path", "speed", "policy", "radius",
            "latency_ms", "bandwidth_mb", "memory_mb", "wasted_share", "error_px_max", "reloads",
            "cancelled", "failed", "hard_evictions"}
    QUICK = ["--seconds", 2, "--fps", 10, "--size", "320x180", "--budget", 50_000, "--bodies", 2]

    def play(self, *arguments):
        done = run("page", "--seed", 5, *self.QUICK, *arguments, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        return [json.loads(line) for line in done.stdout.splitlines()]

    def test_every_combination_is_one_line(self):
        rows = self.play("--path", "straight@300,spins", "--policy", "deadline,distance,oracle",
                         "--latency-ms", "5,50", "--radius", "0.5,2", "--threads", 2)
        self.assertEqual([(r["path"], r["latency_ms"], r["policy"]) for r in rows],
                         [(path, latency, policy) for path in ("straight", "spins")
                          for latency in (5, 50) for policy in ("deadline", "distance", "oracle")])
        for row in rows:
            self.assertLessEqual(self.KEYS, set(row))
            self.assertEqual(row["frames"], 20)
            self.assertEqual(row["late_share"], row["late_frames"] / 20)
            self.assertLessEqual(row["peak_bytes"], row["memory_mb"] * 2**20)
            self.assertLessEqual(row["bytes_wasted"], row["bytes_loaded"])
            self.assertEqual(row["radius"] is not None, row["policy"] == "distance")
            self.assertEqual(row["speed"], 300 if row["path"] == "straight" else None)

    def test_the_best_radius_is_kept(self):
        arguments = ["--path", "straight@300", "--policy", "distance", "--latency-ms", 50,
                     "--bandwidth-mb", 5]
        alone = [self.play(*arguments, "--radius", radius)[0] for radius in (0.25, 1, 4)]
        best = min(alone, key=lambda r: (r["late_frames"], r["excess_error_px_s"]))
        self.assertEqual(self.play(*arguments, "--radius", "0.25,1,4"), [best])

    def test_figures_do_not_depend_on_threads_nor_on_the_cache(self):
        arguments = ["--path", "teleports@200,turns@300", "--policy", "deadline,oracle",
                     "--bandwidth-mb", 10, "--latency-spread", 1, "--failure-share", 0.05]
        self.assertEqual(self.play(*arguments),
                         self.play(*arguments, "--threads", 3, "--cache-mb", 1))

    def test_slower_storage_is_later_and_files_say_the_same(self):
        arguments = ["--path", "straight@300", "--policy", "distance"]
        quick = self.play(*arguments, "--bandwidth-mb", 1000)[0]
        out = self.path("out")
        slow = self.play(*arguments, "--latency-ms", 500, "--bandwidth-mb", 0.5, "--out", out)[0]
        self.assertGreater(slow["late_frames"], quick["late_frames"])
        self.assertEqual(sorted(os.listdir(out)), ["frames.csv", "report.html"])
        with open(os.path.join(out, "frames.csv")) as file:
            header = file.readline().strip().split(",")
            frames = [dict(zip(header, line.strip().split(","))) for line in file]
        self.assertLessEqual({"time_s", "error_px", "late", "resident_bytes", "in_flight_bytes",
                              "late_chunks", "contact_late"}, set(header))
        errors = np.array([float(frame["error_px"]) for frame in frames])
        late = [frame["status"] == "not_resident" and float(frame["error_px"]) > 2
                for frame in frames]
        self.assertEqual([frame["late"] == "1" for frame in frames], late)
        self.assertEqual(slow["late_frames"], sum(late))
        self.assertAlmostEqual(slow["excess_error_px_s"], np.maximum(errors - 2, 0).sum() / 10)
        self.assertEqual(slow["contact_late"], sum(int(f["contact_late"]) for f in frames))
        with open(os.path.join(out, "report.html")) as file:
            self.assertIn('"late_frames":%d' % slow["late_frames"], file.read())

    def test_storage_that_never_answers_rightly_is_a_failure(self):
        done = run("page", "--seed", 5, *self.QUICK, "--failure-share", 1)
        self.assertEqual((done.returncode, len(done.stderr.splitlines())), (1, 1), done.stderr)
        self.assertIn("root squares", done.stderr)

    def test_people_read_a_table_or_one_list(self):
        one = run("page", "--seed", 5, *self.QUICK)
        self.assertRegex(one.stdout, r"(?m)^late_frames +\d+$")
        several = run("page", "--seed", 5, *self.QUICK, "--policy", "deadline,oracle")
        self.assertEqual(len(several.stdout.splitlines()), 3)


class Fly(Folder):
    def test_slow_storage_in_real_time(self):
        out = self.path("out")
        flight = ["--path", "teleports", "--seconds", 6, "--fps", 10, "--size", "320x180",
                  "--budget", 20_000, "--max-error-px", 4, "--realtime", "--out", out]
        for policy in ("deadline", "distance", "oracle"):
            summary = run_json("fly", "--seed", 5, *flight, "--latency-ms", 5, "--bandwidth-mb", 50,
                               "--threads", 4, "--policy", policy)
            with open(os.path.join(out, "frames.csv")) as file:
                header = file.readline().strip().split(",")
                frames = [dict(zip(header, line.strip().split(","))) for line in file]
            late = [f["status"] == "not_resident" and float(f["error_px"]) > 4 for f in frames]
            self.assertEqual([f["late"] == "1" for f in frames], late)
            self.assertEqual(summary["late_frames"], sum(late))
            excess = sum(max(0.0, float(f["error_px"]) - 4) for f in frames) / 10
            self.assertAlmostEqual(summary["excess_error_px_s"], excess)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
