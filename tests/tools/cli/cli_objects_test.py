#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`objects` of scenes: shared budget, columns of frames.csv, bad values and files."""

import os
import struct
import zlib

from program import ROOT, Folder, main, np, run, run_json

PINE = os.path.join(ROOT, "tools", "data", "pine.obj")
FOREST = [{"scatter": {"mesh": PINE, "per_km2": 3000, "seed": 2}}]
FLIGHT = ["--path", "straight", "--speed", 30, "--altitude", 40, "--seconds", 0.6, "--fps", 5, "--size", "160x90"]


def png(rows):
    """The bytes of a PNG of rows of (red, green, blue)."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 2, 0, 0, 0)
    pixels = b"".join(b"\0" + bytes(sum(map(list, row), [])) for row in rows)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(pixels)) + chunk(b"IEND", b"")


def read_png(content):
    """[rows, columns, 3] of a PNG of 8 bits a colour without interlacing or opacity."""
    width, height, depth, kind = struct.unpack(">IIBB", content[16:26])
    assert (depth, kind) == (8, 2)
    data, at = b"", 8
    while at < len(content):
        size, = struct.unpack(">I", content[at:at + 4])
        if content[at + 4:at + 8] == b"IDAT":
            data += content[at + 8:at + 8 + size]
        at += 12 + size
    rows = np.frombuffer(zlib.decompress(data), np.uint8).reshape(height, 1 + 3 * width).astype(int)
    pixels = np.zeros((height + 1, width + 1, 3), int)  # with a row above and a column on the left
    for y, (kind, row) in enumerate(zip(rows[:, 0], rows[:, 1:].reshape(height, width, 3)), 1):
        for x in range(1, width + 1):
            left, above, corner = pixels[y, x - 1], pixels[y - 1, x], pixels[y - 1, x - 1]
            near = [abs(above - corner), abs(left - corner), abs(left + above - 2 * corner)]
            paeth = np.where((near[0] <= near[1]) & (near[0] <= near[2]), left,
                             np.where(near[1] <= near[2], above, corner))
            pixels[y, x] = (row[x - 1] + [0, left, above, (left + above) // 2, paeth][kind]) % 256
    return pixels[1:, 1:]


class Objects(Folder):
    def scene(self, objects, **more):
        return super().scene(**{"seed": 3, "objects": objects, **more})

    def fly(self, scene, *arguments, flight=FLIGHT):
        summary = run_json("fly", "--scene", scene, "--world-m", 8192, "--out", self.path("out"), *flight, *arguments)
        return summary, self.columns()

    def test_triangles_from_the_device_are_those_of_the_cpu(self):
        scene = self.scene(FOREST)
        columns, pictures = [], []
        for triangulator in ("cpu", "gpu"):
            summary, rows = self.fly(scene, "--budget", 20000, "--threads", 0, "--png", "--triangulator", triangulator)
            self.assertEqual(summary.get("gpu_frames", 0), 3 if triangulator == "gpu" else 0)
            # reported late for the drawing of the first picture
            self.assertGreater(rows["gpu_ms"][-1], 0)
            self.assertGreater(summary["gpu_ms_median"], 0)
            columns.append({name: rows[name] for name in rows.dtype.names if not name.endswith("_ms")})
            pictures.append(read_png(self.read("out/frame_000002.png")))
        self.assertEqual(columns[0].keys(), columns[1].keys())
        for name, values in columns[0].items():
            if name == "error_px":  # the device's is an upper bound
                np.testing.assert_array_less(values * (1 - 1e-12), columns[1][name])
                np.testing.assert_allclose(columns[1][name], values, rtol=1e-3)
            else:
                np.testing.assert_array_equal(columns[1][name], values, name)
        # where triangles meet at one depth, a picture depends on their order
        self.assertLessEqual(np.count_nonzero(np.abs(pictures[0] - pictures[1]).max(axis=2)), 10)
        # the triangles of volumes are the CPU's
        cave = [{"op": "remove", "shape": {"sphere": {"radius": 20}}, "position": [0, 0, 100]}]
        summary = run_json("fly", "--scene", super().scene(dem=self.flat(100.0), volumes=cave), *FLIGHT, "--png", "--triangulator", "gpu",
                           "--out", self.path("cave"))
        self.assertEqual((summary["gpu_frames"], summary["frames"]), (3, 3))
        self.assertGreater(self.columns("cave/frames.csv")["solid_triangles"].min(), 0)
        self.assert_refused(run("fly", "--seed", 3, *FLIGHT, "--triangulator", "gpu"), {2}, "--triangulator is for pictures")

    def test_a_forest_shares_the_budget_with_the_ground(self):
        scene = self.scene(FOREST)
        summaries = []
        for budget in (2000, 20000):
            summary, rows = self.fly(scene, "--budget", budget, "--max-error-px", 1)
            self.assertEqual(summary["over_budget_frames"], 0)
            self.assertLessEqual(rows["triangles"].max(), budget)
            self.assertGreater(rows["object_triangles"].min(), 0)
            self.assertGreater(rows["objects_drawn"].min(), 0)
            self.assertGreater(rows["objects_culled"].min(), 0)
            self.assertTrue((rows["objects_ms"] <= rows["update_ms"]).all())
            summaries.append(summary)
        small, large = summaries
        self.assertGreater(large["objects_drawn_max"], 50)
        # a small budget leaves objects out
        self.assertGreater(small["objects_left_out_max"], large["objects_left_out_max"])
        self.assertLess(small["objects_drawn_max"], large["objects_drawn_max"])

    def test_the_budget_follows_the_times_of_frames_up_to_its_limit(self):
        slow, rows = self.fly(self.scene(FOREST), "--budget", 50000, "--png", "--frame-ms", 0.1)
        self.assertEqual(slow["over_budget_frames"], 0)
        self.assertEqual(rows["budget"][-1], 2000, "no frame is that fast")
        fast, rows = self.fly(self.scene(FOREST), "--budget", 50000, "--png", "--frame-ms", 100000)
        self.assertEqual(fast["over_budget_frames"], 0)
        self.assertTrue((np.diff(rows["budget"]) >= 0).all(), "every frame is faster")
        self.assertTrue((rows["draw_ms"] > 0).all())

    def test_bodies_collide_with_static_objects(self):
        block = {"mesh": self.write_block((-2, -2, 0), (2, 2, 2)), "position": [0, 0, 0]}
        ball = {"shape": {"sphere": {"radius": 0.5}}, "position": [0.3, 0.2, 4]}
        for is_static, rest in ((True, 2.5), (False, 0.5)):
            scene = self.scene([{**block, "static": is_static}], dem=self.flat(), bodies=[ball])
            trace = self.path("trace.csv")
            answer = run_json("drop", "--scene", scene, "--count", 0, "--seconds", 3, "--trace", trace)
            self.assertEqual(answer["fell_through"], 0)
            rows = np.loadtxt(trace, delimiter=",", skiprows=1)
            self.assertAlmostEqual(rows[rows[:, 1] == 0][-1, 4], rest, delta=0.02)

    def test_a_truck_is_stopped_by_static_objects_on_its_path(self):
        mesh = self.write_block((-2, -2, 0), (2, 2, 2))
        distance = {}
        for is_static in (True, False):
            objects = [{"scatter": {"mesh": mesh, "per_km2": 3000, "static": is_static}}]
            answer = run_json("drive", "--scene", self.scene(objects, dem=self.flat()), "--path", "straight",
                              "--seconds", 8, "--fps", 5, "--size", "64x48", "--budget", 500, "--threads", 0)
            self.assertEqual(answer["fell_through"], 0)
            distance[is_static] = answer["distance_m"]
        self.assertLess(distance[True], distance[False] - 10, distance)

    def test_the_ground_hides_objects_in_flights_near_it_and_equal_flights_hide_the_same(self):
        scene = self.scene([*FOREST, {"mesh": PINE, "position": [0, 30, 100], "scale": 3}])
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
        for column in ("objects_drawn", "object_triangles", "objects_ms", "objects_occluded"):
            self.assertEqual(rows[column].max(), 0, column)
        self.assertEqual(summary["over_budget_frames"], 0)

    def test_wrong_objects_are_refused_by_their_path(self):
        scatter = {"mesh": PINE, "per_km2": 100}
        placed = {"mesh": PINE, "position": [0, 0, 0]}
        for objects, *words in (
                ({}, "objects must be a list"),
                ([{"mesh": PINE}], "objects[0].position"),
                ([{"position": [0, 0, 0]}], "objects[0].mesh is missing"),
                ([{**placed, "mesh": "none.obj"}], "objects[0].mesh", "none.obj"),
                ([{**placed, "size": 2}], "objects[0].size", "unknown"),
                ([{**placed, "static": 1}], "objects[0].static", "got 1"),
                ([{**placed, "static": True, "proxy_error_m": -1}], "proxy_error_m", "-1"),
                ([{**placed, "proxy_error_m": 1}], "proxy_error_m goes with static true"),
                ([{**placed, "scale": 0}], "objects[0].scale", "got 0"),
                ([{**placed, "crease_deg": 181}], "objects[0].crease_deg", "got 181"),
                ([{"scatter": {"mesh": PINE}}], "objects[0].scatter.per_km2"),
                ([{"scatter": {**scatter, "per_km2": 1e9}}], "objects[0].scatter.per_km2", "1e+09"),
                ([{"scatter": {**scatter, "slope_deg": [40, 20]}}], "objects[0].scatter.slope_deg", "[40, 20]"),
                ([{"scatter": {**scatter, "seed": -1}}], "objects[0].scatter.seed", "-1"),
                ([{"scatter": {**scatter, "color": 1}}], "objects[0].scatter.color", "unknown")):
            with self.subTest(objects):
                self.assert_refused(run("fly", "--scene", self.scene(objects), *FLIGHT), [1], *words)

    def test_foreign_empty_and_flat_meshes_are_refused_by_their_file(self):
        scene = self.scene([{"mesh": "bad.obj", "position": [0, 0, 0]}])
        for text, word in (("", "no triangle"), ("GIF89a", "no triangle"), ("v 0 0 0\nf 1 1 1\n", "no triangle"),
                           ("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "nan"),
                           ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "point 8 of 3")):
            with self.subTest(text):
                self.write("bad.obj", text)
                self.assert_refused(run("fly", "--scene", scene, *FLIGHT), [1], "bad.obj", word)

    def test_a_flight_shows_the_texture_of_a_mesh_or_names_the_image_that_it_cannot_read(self):
        # a wall across the way north, red on the left and blue on the right
        self.write("wall.png", png([[(255, 0, 0), (0, 0, 255)]] * 2))
        self.write("wall.mtl", "newmtl paint\nKd 1 1 1\nmap_Kd wall.png\n")
        self.write("wall.obj", "mtllib wall.mtl\nusemtl paint\nv -9 0 0\nv 9 0 0\nv 9 0 9\nv -9 0 9\n"
                               "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n")
        path = self.write("path.csv", "time_s,x_m,y_m,z_m\n0,0,-30,4\n1,0,-25,4\n")
        scene = self.scene([{"mesh": "wall.obj", "position": [0, 0, 0]}], dem=self.flat())
        flight = ["fly", "--scene", scene, "--path", path, "--seconds", 0.2, "--fps", 5, "--size", "96x64", "--png",
                  "--out", self.path("out")]

        def sides():
            colours = read_png(self.read("out/frame_000000.png"))
            return colours[18, 34:42].mean(axis=0), colours[18, 54:62].mean(axis=0)

        answer = run(*flight)
        self.assertEqual((answer.returncode, answer.stderr), (0, ""))
        left, right = sides()
        self.assertGreater(left[0], right[0] + 60)
        self.assertGreater(right[2], left[2] + 60)
        os.remove(self.path("wall.png"))
        answer = run(*flight)
        self.assertEqual(answer.returncode, 0)
        self.assertIn("texture 'wall.png': No such file or directory: drawn in plain colour", answer.stderr)
        left, right = sides()
        self.assertLess(abs(left - right).max(), 12)


if __name__ == "__main__":
    main()
