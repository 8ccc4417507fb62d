#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The summary of `terrane drive` with and without a rollover."""

import csv
import os

from program import ROOT, Folder, main, np, run, run_json

SMALL = ("--fps", 5, "--size", "64x48", "--budget", 500, "--threads", 0)


class Drive(Folder):
    def cliff(self):
        """A plateau 40 m high that ends in the middle of the terrain."""
        heights = np.zeros((40, 80))
        heights[:, :40] = 40.0
        return self.write_grid("cliff.asc", heights, cell=5.0)

    def test_the_stock_truck_takes_the_turns_over_real_ground_on_its_wheels(self):
        raster = os.path.join(ROOT, "tools", "data", "jacksboro.tif")
        summary = run_json("drive", "--dem", raster, "--path", "turns", "--seconds", 14, *SMALL)
        self.assertIs(summary["rolled_over"], False)
        self.assertEqual(summary["rights"], 0)
        self.assertLess(summary["airborne_share"], 0.02)
        self.assertLess(summary["max_depth_m"], 0.01)
        self.assertEqual(summary["seconds"], 14)
        text = run("drive", "--dem", raster, "--seconds", 1, *SMALL).stdout
        self.assertRegex(text, r"(?m)^rolled_over +false$")

    def test_a_truck_that_rolls_over_ends_the_drive_unless_it_is_to_be_righted(self):
        arguments = ("drive", "--dem", self.cliff(), "--seconds", 30, *SMALL)
        out = self.path("out")
        stopped = run_json(*arguments, "--out", out)
        self.assertIs(stopped["rolled_over"], True)
        self.assertEqual(stopped["rights"], 0)
        self.assertLess(stopped["seconds"], 30)
        self.assertEqual(run_json(*arguments, "--on-roll", "stop")["seconds"], stopped["seconds"])
        with open(os.path.join(out, "frames.csv")) as file:
            tilts = [float(row["tilt_deg"]) for row in csv.DictReader(file)]
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
        with open(os.path.join(out, "frames.csv")) as file:
            self.assertLess(float(list(csv.DictReader(file))[-1]["tilt_deg"]), 30)

    def test_wrong_values_are_usage_errors_that_name_the_flag_or_the_value(self):
        for flag, value, said in (("--on-roll", "left", "--on-roll"), ("--speed", 0, "--speed"),
                                  ("--speed", 1e4, "--speed"), ("--seconds", -1, "--seconds"),
                                  ("--seconds", 1e12, "frames")):
            done = run("drive", "--seed", 1, f"{flag}={value}", timeout=60)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(said, done.stderr)
            self.assertEqual(done.stdout, "")
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)


if __name__ == "__main__":
    main()
