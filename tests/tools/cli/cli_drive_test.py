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

    def test_many_crates_lie_at_rest(self):
        many = run_json("drive", "--dem", self.flat(), "--seconds", 4, *SMALL, "--crates", 600)
        self.assertEqual(many["fell_through"] + many["left_world"] + many["parked"], 0)

    def test_a_truck_that_rolls_over_ends_the_drive_unless_it_is_to_be_righted(self):
        arguments = ("drive", "--dem", self.cliff(), "--seconds", 30, *SMALL)
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
