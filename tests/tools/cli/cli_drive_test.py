#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The summary of `terrane drive`: vehicles, crates, rollovers."""

import os

from program import ROOT, Folder, main, np, run, run_json

SMALL = ("--fps", 5, "--size", "64x48", "--budget", 500, "--threads", 0)


class Drive(Folder):
    def cliff(self):
        """A plateau 40 m high that ends in the middle of the terrain."""
        heights = np.zeros((40, 80))
        heights[:, :40] = 40.0
        return self.write_grid("cliff.asc", heights, cell=5.0)

    def test_every_vehicle_takes_the_turns_over_real_ground_on_its_wheels(self):
        raster = os.path.join(ROOT, "tools", "data", "jacksboro.tif")
        for vehicle in ("truck", "tracked", "six-wheeler"):
            with self.subTest(vehicle):
                summary = run_json("drive", "--dem", raster, "--vehicle", vehicle, "--path", "turns", "--seconds", 14,
                                   *SMALL)
                self.assertEqual(summary["vehicle"], vehicle)
                self.assertIs(summary["rolled_over"], False)
                self.assertEqual(summary["rights"], 0)
                self.assertEqual(summary["fell_through"], 0)
                self.assertEqual(summary["crates_touched"], 0)
                self.assertLess(summary["airborne_share"], 0.02)
                self.assertLess(summary["max_depth_m"], 0.01)
                self.assertGreater(summary["distance_m"], 80)
                self.assertEqual(summary["seconds"], 14)

    def test_a_vehicle_drives_into_the_crates_on_its_path(self):
        flat = self.flat()
        arguments = ("drive", "--dem", flat, "--seconds", 12, *SMALL)
        none = run_json(*arguments, "--crates", 0)
        self.assertEqual(none["crates_touched"], 0)
        for vehicle in ("truck", "six-wheeler"):
            some = run_json(*arguments, "--vehicle", vehicle, "--crates", 60)
            self.assertGreaterEqual(some["crates_touched"], 3, vehicle)
            self.assertLessEqual(some["crates_touched"], 60)
            self.assertEqual(some["fell_through"] + some["left_world"] + some["parked"], 0)
            self.assertLess(some["max_depth_m"], 0.01)
            self.assertGreater(some["distance_m"], 20)
        again = run_json(*arguments, "--vehicle", "six-wheeler", "--crates", 60)
        self.assertEqual(again["distance_m"], some["distance_m"])
        self.assertEqual(again["crates_touched"], some["crates_touched"])

    def test_wheels_dig_ruts_that_stay(self):
        flat = self.flat()
        arguments = ("drive", "--dem", flat, "--seconds", 6, *SMALL)
        firm = run_json(*arguments, "--detail-m", 0.25)
        self.assertNotIn("digs", firm)
        ruts = run_json(*arguments, "--ruts")
        self.assertGreater(ruts["digs"], 20)
        self.assertEqual(ruts["fell_through"] + ruts["parked"], 0)
        self.assertGreater(ruts["distance_m"], 0.5 * firm["distance_m"])
        again = run_json(*arguments, "--ruts")
        for key in ("distance_m", "digs", "max_depth_m"):
            self.assertEqual(ruts[key], again[key])
        coarse = run(*arguments, "--ruts", "--detail-m", 5)
        self.assert_refused(coarse, [2], "--ruts need a finest spacing of at most 0.5 m, got 5")

    def test_paths_that_start_or_lead_off_the_ground_are_refused_with_distances(self):
        flat = self.flat()  # -200 to 200 m, -100 to 100 m
        heights = np.zeros((40, 80))
        heights[:, 60:] = -9999
        half = self.write_grid("half.asc", heights, cell=5.0)  # no data in the east of 100 m

        def track(*points):
            return self.write("track.csv", "x_m,y_m\n" + "".join(f"{x},{y}\n" for x, y in points))

        for command in ("drive", "walk"):
            for raster, points, *words in (
                    (flat, [(458150, 5429300), (458200, 5429300)], "track.csv' starts where there is no ground",
                     "at x 458150 m, y 5429300 m, 5.44848e+06 m from the terrain",
                     "x -200 to 200 m and y -100 to 100 m"),
                    # in the units of the raster's CRS
                    (flat, [(500190, 4000100), (500250, 4000100)], "starts where there is no ground",
                     "metres from the raster's centre, which is 500200, 4000100 in its CRS"),
                    (flat, [(-150, 0), (350, 0)], "leaves the ground after 35", "of its 499", "--seconds"),
                    (flat, [(-150, 0), (250, 0), (150, 50)], "leaves the ground after 35"),
                    (half, [(150, 0), (0, 0)], "starts where there is no ground, at x 150 m, y 0 m"),
                    (half, [(0, 0), (180, 0)], "leaves the ground after ", "of its 180", "at x ")):
                with self.subTest((command, points)):
                    arguments = (command, "--dem", raster, "--path", track(*points), "--speed", 20, *SMALL)
                    self.assert_refused(run(*arguments), [1], *words)
        self.assert_refused(run("drive", "--dem", flat, "--seconds", 90, *SMALL), [1],
                            "the path 'straight' leaves the ground after ", " of its 10", "--seconds")
        for points in ([(-190, -90), (190, 90)], [(0, 0), (80, 0)]):
            run_json("walk", "--dem", half if points[0][0] == 0 else flat, "--path", track(*points), "--seconds", 1,
                     *SMALL)

    def test_a_flight_off_the_ground_is_noted_with_distances(self):
        flat = self.flat()
        track = self.write("track.csv", "time_s,x_m,y_m,z_m\n0,0,0,50\n1,100,0,50\n4,400,0,50\n")
        flight = ("fly", "--dem", flat, *SMALL)
        done = run(*flight, "--path", track)
        self.assertEqual(done.returncode, 0)
        self.assertRegex(done.stderr, r"^terrane: the path '.*track.csv' leaves the ground after 20\d(\.\d*)? of its "
                                      r"400 m, at x 20\d.*; (19\d|20\d)(\.\d*)? of its 400 m have no ground\n$")
        self.assertEqual(run(*flight, "--path", track, "--seconds", 1.5).stderr, "")
        jumps = run(*flight, "--path", "teleports", "--seconds", 8, "--speed", 5)  # jumps have no length
        self.assertEqual(jumps.stderr, "")

    def test_what_a_track_lacks_is_filled_and_noted(self):
        lacks = self.write("track.csv", "time_s,x_m,y_m,z_m\n0,0,0,50\n1,50,0,\n2,100,0,50\n")
        out = self.path("out")
        done = run("fly", "--dem", self.flat(), "--path", lacks, *SMALL, "--out", out)
        self.assertEqual((done.returncode, done.stderr.count("\n")), (0, 1))
        self.assertIn("track.csv: 1 of 3 points have no height: filled from those around", done.stderr)
        self.assertLess(np.abs(self.columns()["eye_z_m"] - 50).max(), 1e-9)

    def test_a_drive_along_a_track_with_a_pause_stays_on_it(self):
        track = self.write("stop.csv", "time_s,x_m,y_m,z_m\n0,0,0,500\n1,10,0,495\n601,11,0,495\n602,21,0,495\n")
        run_json("drive", "--dem", self.flat(), "--path", track, "--seconds", 60, *SMALL, "--out", self.path("out"))
        x = self.columns()["body_x_m"]
        self.assertGreater(x.min(), -5)
        self.assertLess(x.max(), 21 + 5)

    def test_many_crates_lie_at_rest(self):
        many = run_json("drive", "--dem", self.flat(), "--seconds", 4, *SMALL, "--crates", 600)
        self.assertEqual(many["fell_through"] + many["left_world"] + many["parked"], 0)

    def test_a_truck_that_rolls_over_ends_the_drive_unless_it_is_to_be_righted(self):
        track = self.write("track.csv", "x_m,y_m\n-180,0\n180,0\n")  # a built-in path would avoid the cliff
        arguments = ("drive", "--dem", self.cliff(), "--path", track, "--speed", 12, "--seconds", 30, *SMALL)
        out = self.path("out")
        stopped = run_json(*arguments, "--out", out)
        self.assertIs(stopped["rolled_over"], True)
        self.assertEqual(stopped["rights"], 0)
        self.assertLess(stopped["seconds"], 30)
        self.assertEqual(run_json(*arguments, "--on-roll", "stop")["seconds"], stopped["seconds"])
        tilts = self.columns()["tilt_deg"]
        self.assertLess(tilts[0], 5)
        self.assertGreater(tilts[-1], 45)

        righted = run_json(*arguments, "--on-roll", "right", "--out", out)
        self.assertIs(righted["rolled_over"], True)
        self.assertGreaterEqual(righted["rights"], 1)
        self.assertEqual(righted["fell_through"], 0)
        self.assertLess(righted["max_depth_m"], 0.01)
        self.assertEqual(righted["left_world"], 0)
        self.assertTrue(righted["arrived"] or righted["seconds"] == 30, righted)
        self.assertGreater(righted["distance_m"], stopped["distance_m"] + 20)
        self.assertLess(self.columns()["tilt_deg"][-1], 30)


if __name__ == "__main__":
    main()
