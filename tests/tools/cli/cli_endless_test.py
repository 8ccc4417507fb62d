#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A seed has ground to 2^31 m: flights, drives, walks, drops and questions near 0, at 1e6 and 1e9 m, over edges of root
squares, while the window of them moves, and at the last border; the same ground wherever a command begins."""

import json

from program import Folder, ask, main, run, run_json

FAR = ("0,0", "1e6,-1e6", "999999000,-999998000", "65530,10")  # the last crosses 65536, an edge of root squares
PICTURE = ("--size", "160x90", "--budget", 3000, "--threads", 0)


class Endless(Folder):
    def test_the_world_of_a_seed_reaches_everywhere(self):
        root = 65536
        for flags, spacing, origin in (
                ("", 1, (0, 0)), ("--detail-m 300", 256, (0, 0)), ("--detail-m 1.999", 1, (0, 0)),
                ("--start-m 1e9,-2e9", 1, (15259 * root, -30518 * root)),
                ("--detail-m 0.25 --start-m 1e9,-1e8", 0.25, (15259 * root, -1526 * root))):
            info = run_json("info", "--seed", 7, *flags.split())
            self.assertEqual(info["extent_m"], [-2 ** 31, -2 ** 31, 2 ** 31, 2 ** 31], flags)
            self.assertEqual(info["lattice_origin_m"], list(origin), flags)
            self.assertEqual((info["root_size_m"], info["root_window"], info["finest_spacing_m"]), (root, 4, spacing))
        # keys of fine chunks do not reach as far
        info = run_json("info", "--seed", 7, "--detail-m", 0.001, "--start-m", "-1073741824,1073741824")
        self.assertEqual(info["lattice_origin_m"], [root - 2 ** 30, 2 ** 30 - root])
        info = run_json("info", "--seed", 7, "--detail-m", 0.001, "--start-m", "8e8,-8e8")
        west, south, east, north = info["extent_m"]
        for low, high, place in ((west, east, 8e8), (south, north, -8e8)):
            self.assertLess(low, place - 2.67e8)
            self.assertGreater(high, place + 2.67e8)
        for flags, spacing, side in (("--world-m 131071 --detail-m 0.001", 2 ** -10, 65536), ("--world-m 256", 1, 128),
                                     ("--world-m 5000", 1, 4096)):
            info = run_json("info", "--seed", 7, *flags.split())
            self.assertEqual(info["extent_m"], [-side, -side, side, side])
            self.assertEqual((info["root_size_m"], info["roots"], info["root_window"], info["finest_spacing_m"]),
                             (side, [2, 2], 0, spacing))

    def test_a_flight_crosses_any_number_of_edges(self):
        flight = run_json("fly", "--seed", 7, "--start-m", "1e9,1e9", "--path", "straight", "--speed", 80000, "--altitude",
                          2000, "--seconds", 5, *PICTURE, "--fps", 2, "--verify", "--out", self.path("out"))
        self.assertEqual((flight["late_frames"], flight["holes"]), (0, 0))
        self.assertLessEqual(flight["measured_error_px_max"], flight["error_px_max"])
        rows = self.rows()
        self.assertGreater(float(rows[-1]["eye_x_m"]) - float(rows[0]["eye_x_m"]), 350000)
        self.assertNotIn("not_resident", {row["status"] for row in rows})

    def test_flights_are_never_late_and_cross_borders(self):
        for start, path, *verify in ((FAR[0], "straight"), (FAR[1], "canyon"), (FAR[2], "straight", "--verify"),
                                     (FAR[3], "straight", "--verify")):
            flight = run_json("fly", "--seed", 7, "--start-m", start, "--path", path, "--seconds", 1, *PICTURE, "--fps", 3,
                              *verify, "--out", self.path("out"))
            with self.subTest((start, path)):
                self.assertEqual((flight["frames"], flight["late_frames"]), (3, 0))
                if verify:
                    self.assertLessEqual(flight["measured_error_px_max"], flight["error_px_max"])
                if path == "straight":
                    first, *_, last = self.rows()
                    for axis, wanted in zip("xy", start.split(",")):
                        self.assertAlmostEqual(float(first[f"eye_{axis}_m"]), float(wanted), delta=1e-3)
                    self.assertAlmostEqual(float(last["eye_x_m"]) - float(first["eye_x_m"]), 67, delta=1)

    def test_nobody_falls_at_any_place(self):
        for start, seconds in zip(FAR, (0, 0, 3, 3)):
            with self.subTest(start):
                drop = run_json("drop", "--seed", 7, "--start-m", start, "--shape", "mixed", "--count", 20, "--speed",
                                100, "--seconds", 2)
                self.assertEqual(drop["fell_through"] + drop["left_world"] + drop["parked"], 0)
                for command in ("drive", "walk") if seconds else ():
                    summary = run_json(command, "--seed", 7, "--start-m", start, "--seconds", seconds, *PICTURE)
                    self.assertEqual(summary["fell_through"] + summary["left_world"] + summary["parked"], 0)
                    self.assertGreater(summary["distance_m"], 2)

    def test_fine_ground_far_away(self):
        far = ("--seed", 7, "--start-m", "1e9,1e9", "--detail-m")
        drop = run_json("drop", *far, 0.05, "--shape", "sphere", "--count", 1, "--scale", 0.05, "--seconds", 0.2)
        self.assertEqual(drop["fell_through"] + drop["left_world"] + drop["parked"], 0)
        answer, = ask([*far, 0.001], [{"op": "height", "x": 1e9, "y": 1e9}])
        self.assertEqual(answer["status"], "ok")
        self.assertLess(answer["error_m"], 1e-3)

    def test_the_same_heights_wherever_a_command_begins(self):
        places = [(0, 0), (65535.5, -3), (-1e9, 1e9 + 0.5)]
        questions = [{"op": "height", "x": x, "y": y} for x, y in places]
        answers = ask(["--seed", 7], questions)
        self.assertEqual({answer["status"] for answer in answers}, {"ok"})
        self.assertEqual(ask(["--seed", 7, "--start-m", FAR[2]], questions), answers)
        inside = ask(["--seed", 7, "--world-m", 131072], questions[:2])
        self.assertEqual([a["height"] for a in inside], [a["height"] for a in answers[:2]])
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

    def test_the_last_border_is_outside(self):
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


if __name__ == "__main__":
    main()
