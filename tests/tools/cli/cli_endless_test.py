#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A seed has ground to 2^31 m: flights, drives, walks, drops and questions near 0, at 1e6 and 1e9 m, over edges of root
squares, while the window of them moves, and at the last border; the same ground wherever a command begins."""

import json
import unittest

from program import Folder, ask, main, run, run_json

FAR = ("0,0", "1e6,-1e6", "999999000,-999998000", "65530,10")  # the last crosses 65536, an edge of root squares
PICTURE = ("--fps", 5, "--size", "160x90", "--budget", 3000, "--threads", 0)


class Endless(Folder):
    def test_the_world_of_a_seed_reaches_everywhere(self):
        for flags, origin, spacing in (((), 0, 1), (("--detail-m", 64), 0, 64),
                                       (("--start-m", "1e9,-1e9"), 15259 * 65536, 1),
                                       (("--detail-m", 0.25, "--start-m", "1e9,-1e9"), 15259 * 65536, 0.25)):
            info = run_json("info", "--seed", 7, *flags)
            self.assertEqual(info["extent_m"], [-2 ** 31, -2 ** 31, 2 ** 31, 2 ** 31], flags)
            self.assertEqual(info["lattice_origin_m"], [origin, -origin], flags)
            self.assertEqual((info["root_size_m"], info["root_window"]), (65536, 4))
            self.assertEqual(info["finest_spacing_m"], spacing)
        # keys of fine chunks do not reach as far
        info = run_json("info", "--seed", 7, "--detail-m", 2 ** -10, "--start-m", "8e8,-8e8")
        west, south, east, north = info["extent_m"]
        for low, high, place in ((west, east, 8e8), (south, north, -8e8)):
            self.assertLess(low, place - 2.67e8)
            self.assertGreater(high, place + 2.67e8)
        info = run_json("info", "--seed", 7, "--world-m", 5000)
        self.assertEqual(info["extent_m"], [-4096, -4096, 4096, 4096])
        self.assertEqual((info["root_size_m"], info["roots"], info["root_window"]), (4096, [2, 2], 0))

    def test_a_flight_crosses_any_number_of_edges(self):
        for start in ("0,0", "1e9,1e9"):
            flight = run_json("fly", "--seed", 7, "--start-m", start, "--path", "straight", "--speed", 80000, "--altitude",
                              2000, "--seconds", 5, *PICTURE, "--verify", "--out", self.path("out"))
            self.assertEqual((flight["late_frames"], flight["holes"]), (0, 0))
            self.assertLessEqual(flight["measured_error_px_max"], flight["error_px_max"])
            with open(self.path("out/frames.csv")) as file:
                names, *rows = (line.split(",") for line in file.read().splitlines())
            place, status = names.index("eye_x_m"), names.index("status")
            self.assertGreater(float(rows[-1][place]) - float(rows[0][place]), 380000)
            self.assertNotIn("not_resident", {row[status] for row in rows})

    def test_flights_are_never_late_and_cross_borders(self):
        for start in FAR:
            for path in ("straight", "canyon"):
                flight = run_json("fly", "--seed", 7, "--start-m", start, "--path", path, "--seconds", 1, *PICTURE,
                                  "--verify", "--out", self.path("out"))
                with self.subTest((start, path)):
                    self.assertEqual(flight["frames"], 5)
                    self.assertEqual(flight["late_frames"], 0)
                    self.assertLessEqual(flight["measured_error_px_max"], flight["error_px_max"])
                    with open(self.path("out/frames.csv")) as file:
                        names, first, *_, last = (line.split(",") for line in file.read().splitlines())
                    eye = names.index("eye_x_m")
                    begin = [float(v) for v in first[eye:eye + 2]]
                    if path == "straight":
                        want = [float(v) for v in start.split(",")]
                        self.assertLess(max(abs(a - b) for a, b in zip(begin, want)), 1e-3)
                        self.assertAlmostEqual(float(last[eye]) - begin[0], 80, delta=1)

    def test_nobody_falls_at_any_place(self):
        for start in FAR:
            with self.subTest(start):
                drop = run_json("drop", "--seed", 7, "--start-m", start, "--shape", "mixed", "--count", 20, "--speed",
                                100, "--seconds", 2)
                self.assertEqual(drop["fell_through"] + drop["left_world"] + drop["parked"], 0)
                drive = run_json("drive", "--seed", 7, "--start-m", start, "--seconds", 2, *PICTURE)
                self.assertEqual(drive["fell_through"] + drive["left_world"] + drive["parked"], 0)
                self.assertGreater(drive["distance_m"], 2)
                walk = run_json("walk", "--seed", 7, "--start-m", start, "--seconds", 6, *PICTURE)
                self.assertEqual(walk["fell_through"] + walk["left_world"] + walk["parked"], 0)
                self.assertGreater(walk["distance_m"], 4)

    def test_fine_ground_far_away(self):
        far = ("--seed", 7, "--start-m", "1e9,1e9", "--detail-m")
        drop = run_json("drop", *far, 0.01, "--shape", "sphere", "--count", 3, "--scale", 0.05, "--seconds", 0.3)
        self.assertEqual(drop["fell_through"] + drop["left_world"] + drop["parked"], 0)
        answer, = ask([*far, 0.001], [{"op": "height", "x": 1e9, "y": 1e9}])
        self.assertEqual(answer["status"], "ok")
        self.assertLess(answer["error_m"], 1e-3)

    def test_the_same_heights_wherever_a_command_begins(self):
        places = [(0, 0), (65536, 65536), (65535.5, -3), (1e6 + 0.25, 1e6), (-1e9, 1e9 + 0.5), (1e9 + 7, 12.125)]
        questions = [{"op": "height", "x": x, "y": y} for x, y in places]
        answers = ask(["--seed", 7], questions)
        self.assertEqual({answer["status"] for answer in answers}, {"ok"})
        for start in FAR:
            self.assertEqual(ask(["--seed", 7, "--start-m", start], questions), answers, start)
        inside = ask(["--seed", 7, "--world-m", 131072], questions[:3])
        self.assertEqual([a["height"] for a in inside], [a["height"] for a in answers[:3]])
        # finer lattices move with the start
        fine = [{"op": "height", "x": 3e6 + k / 64, "y": -3e6} for k in range(4)]
        near = ["--seed", 7, "--detail-m", 2 ** -10, "--start-m"]
        self.assertEqual(ask([*near, "3e6,-3e6"], fine), ask([*near, "3.5e6,-3.5e6"], fine))
        self.assertEqual({a["status"] for a in ask([*near, "0,0"], fine)}, {"outside"})

    def test_a_long_ray_loads_only_the_ground_that_it_may_meet(self):
        rays = [{"op": "ray", "from": [-1e9, -1e9, 1e5], "to": [1e9, 1e9, 1e5]},
                {"op": "ray", "from": [-1e9, -1e9, 1e9], "to": [1e9, 1e9, -1e7]}]
        miss, hit = ask(["--seed", 7], rays, "--memory-mb", 32)
        self.assertEqual((miss["status"], hit["status"]), ("miss", "ok"))
        x, y, z = hit["point"]
        ground, = ask(["--seed", 7], [{"op": "height", "x": x, "y": y}])
        self.assertLess(abs(ground["height"] - z), 1e-3)

    def test_paging_over_the_endless_world(self):
        done = run("page", "--seed", 7, "--start-m", "1e9,1e9", "--path", "straight@250,turns", "--seconds", 2,
                   "--fps", 10, "--budget", 20000, "--memory-mb", 128, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        for line in done.stdout.splitlines():
            row = json.loads(line)
            self.assertEqual((row["late_frames"], row["contact_late"]), (0, 0), row["path"])

    def test_the_last_border_is_refused_or_outside(self):
        for command in ("fly", "drive", "walk", "drop", "page", "mesh", "info"):
            self.assert_refused(run(command, "--seed", 7, "--start-m", "2.2e9,0"), [2], "--start-m", "2147483648",
                                "2200000000")
        self.assert_refused(run("fly", "--seed", 7, "--world-m", 131072, "--start-m", "65537,0"), [2], "--start-m",
                            "65536")
        last = 2 ** 31
        answers = ask(["--seed", 7], [{"op": "height", "x": 2e9, "y": -2e9}, {"op": "height", "x": last, "y": 0}])
        self.assertEqual([a["status"] for a in answers], ["ok", "invalid"])
        self.assertIn("2e9 m", answers[1]["message"])
        # a flight goes on beyond the world, as over every other terrain
        flight = run_json("fly", "--seed", 7, "--start-m", f"{last - 50},0", "--seconds", 1, *PICTURE)
        self.assertEqual(flight["late_frames"], 0)
        # bodies may be 2e9 m from the origin
        for command in ("drive", "walk", "drop"):
            done = run(command, "--seed", 7, "--start-m", f"{last - 50},0", "--seconds", 1)
            self.assert_refused(done, [1, 2], "2e+09")

    def test_bad_values_are_one_line(self):
        for value in ("nan", "0", "-5", "inf", "1e-9", "5e9", "x"):
            self.assert_refused(run("info", "--seed", 7, f"--world-m={value}"), [2], "--world-m")
        for value in ("nan,0", "1", "1,2,3", "x,y", "inf,0", "1e300,0"):
            self.assert_refused(run("info", "--seed", 7, f"--start-m={value}"), [2], "--start-m")
        _, raster = self.hills()
        self.assert_refused(run("info", "--dem", raster, "--world-m", 4096), [2], "--world-m")
        self.assert_refused(run("fly", "--dem", raster, "--start-m", "1e6,0"), [1], "--start-m", "1000000")


if __name__ == "__main__":
    main()
