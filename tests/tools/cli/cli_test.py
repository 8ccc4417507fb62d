#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The contract with scripts: help, keys, bad files; `terrane info`."""

import os
import struct
import subprocess
import zlib

from program import PROGRAM, SMALL_WORLD, Folder, main, np, run, run_json


class CommandLine(Folder):
    def test_help_and_version_succeed_everywhere(self):
        for alone in (False, True):
            self.assertEqual(run("--help", alone=alone).returncode, 0)
            self.assertRegex(run("--version", alone=alone).stdout, r"^terrane \d+\.\d+\.\d+\n$")
        commands = ["info", "mesh", "query", "drop", "page"]
        commands += [command for command in ("fly", "drive") if f"\n  {command} " in run("--help").stdout]
        for command in commands:
            done = run(command, "--help")
            self.assertEqual(done.returncode, 0, command)
            self.assertIn("Example: ", done.stdout)
            self.assertIn("--dem", done.stdout)

    def test_bad_rasters_fail_with_a_line_that_names_them(self):
        pipe = self.path("pipe.tif")
        os.mkfifo(pipe)
        grid = self.write_grid("grid.asc", np.arange(400.0).reshape(20, 20))
        text = self.write("text.tif", "these are no heights\n" * 50)
        rasters = [pipe, self.path("missing.tif"), text, self.write("empty.tif", ""), self.folder,
                   self.write_grid("one.asc", [[5.0]]), self.write_grid("nothing.asc", np.full((20, 20), -9999.0))]
        self.assert_all_refused([
            *((["info", "--dem", raster], os.path.basename(raster)) for raster in rasters),
            *(([*command, "--dem", text], "text.tif")
              for command in (["mesh", "--out", self.path("a.ply")], ["query"], ["page"],
                              ["drop", "--count", 3, "--trace", self.path("t.csv")])),
            (["info", "--dem", grid, "--dem-memory-mb", 1], grid, "20 x 20", "limit is 1 MiB", "--dem-memory-mb")], [1])
        self.assertEqual(run("info", "--dem", grid, "--dem-memory-mb", 200).returncode, 0)
        # as for a fractal, an impossible spacing is a usage error
        self.assert_refused(run("info", "--dem", grid, "--detail-m", 1e-9), [2], "--detail-m", "1e-09")

    def test_bad_scenes_fail_with_a_line_that_names_them(self):
        for text, word in (("{", "scene.json"), ('{"seed":1,"moon":2}', "moon"), ('{"dem":"none.tif"}', "none.tif")):
            self.assert_refused(run("info", "--scene", self.write("scene.json", text)), [1], word)
        self.assert_refused(run("info", "--scene", self.scene(seed=1), "--seed", 2), [2], "--seed")

    def test_a_full_disk_is_a_failure(self):
        if not os.path.exists("/dev/full"):
            self.skipTest("no /dev/full here")
        with open("/dev/full", "w") as full:
            done = subprocess.run([PROGRAM, "info", "--seed", "1"], stdout=full,
                                  stderr=subprocess.PIPE, text=True)
        self.assertEqual(done.returncode, 1)
        self.assertIn("standard output", done.stderr)
        self.assert_all_refused([(["mesh", *SMALL_WORLD, "--budget", 500, "--out", "/dev/full"], "/dev/full"),
                                 (["drop", *SMALL_WORLD, "--count", 50, "--trace", "/dev/full"], "/dev/full")], [1])


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

    def test_what_the_numbers_of_a_raster_mean(self):
        heights = np.full((9, 9), 100.0) + np.arange(9)
        heights[4, 4], heights[4, 5] = -32768, -9999
        raster = self.write_grid("voids.asc", heights, nodata=-1)
        self.assert_refused(run("info", "--dem", raster), [1], "voids.asc", "-32768", "nodata", "--nodata -32768,-9999")
        flags = ["--nodata", "-32768,-9999", "--height-unit", "ft", "--height-scale", 2]
        info = run_json("info", "--dem", raster, *flags)
        self.assertAlmostEqual(info["min_m"], 200 * 0.3048, places=9)
        self.assertAlmostEqual(info["filled_share"], 2 / 81)
        self.assertEqual([info[key] for key in ("height_unit", "vertical_axis", "void", "placement", "notes")],
                         ["foot, as set; times 2, as set", "up, assumed",
                          "-1, declared; -32768, as set; -9999, as set", "a geotransform", []])
        keys = {"nodata": [-32768, -9999], "height_unit": "ft", "height_scale": 2}
        of_scene = run_json("info", "--scene", self.scene(dem="vrt://voids.asc?bands=1", **keys))
        self.assertEqual(of_scene["min_m"], info["min_m"])
        self.assertEqual(run_json("info", "--scene", self.scene(dem="voids.asc", **keys), "--height-unit", "m")["min_m"], 200)
        self.assertEqual(run_json("info", "--dem", raster, "--nodata", "none")["min_m"], -32768)
        self.assert_refused(run("info", "--dem", raster, "--cell-m", 5), [1], "voids.asc", "--cell-m")
        corner = "0,0,3,4"  # metres from the south-west corner of a raster without georeferencing
        self.assertEqual(run_json("info", "--dem", self.picture(), "--crop", corner)["samples"], [4, 5])
        self.assertEqual(run_json("info", "--scene", self.scene(dem="grey.png", crop=[0, 0, 3, 4]))["samples"], [4, 5])
        self.assert_refused(run("info", "--dem", self.picture(), "--crop", "0,0,3"), [2], "--crop", "west,south,east,north", "'0,0,3'")
        self.assert_refused(run("info", "--dem", self.picture(), "--crop", "9,9,12,12"), [1], "grey.png", "extends over 0,0,8,8")
        self.assert_refused(run("info", "--seed", 1, "--crop", corner), [2], "--crop go with a raster")
        done = run("info", "--dem", self.picture())
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertIn("cells of 1 m (--cell-m) and numbers in metres (--height-scale) are assumed", done.stderr)

    def picture(self):
        """A grey PNG of 8 by 8 samples without georeferencing."""
        def part(kind, data):
            return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        rows = b"".join(b"\0" + bytes(range(8 * row, 8 * row + 8)) for row in range(8))
        with open(self.path("grey.png"), "wb") as file:
            file.write(b"\x89PNG\r\n\x1a\n" + part(b"IHDR", struct.pack(">IIBBBBB", 8, 8, 8, 0, 0, 0, 0)) +
                       part(b"IDAT", zlib.compress(rows)) + part(b"IEND", b""))
        return self.path("grey.png")

    def test_a_scene_is_the_same_terrain(self):
        _, raster = self.hills()
        of_scene = run_json("info", "--scene", self.scene(dem=os.path.basename(raster), seed=3, detail_m=2.5))
        of_flags = run_json("info", "--dem", raster, "--seed", 3, "--detail-m", 2.5)
        of_scene.pop("terrain"), of_flags.pop("terrain")
        self.assertEqual(of_scene, of_flags)
        self.assertLessEqual(of_flags["finest_spacing_m"], 2.5)

    def test_detail_spacing(self):
        self.assertEqual(run_json("info", "--seed", 1, "--detail-m", 0.3)["finest_spacing_m"], 0.25)
        _, raster = self.hills()
        self.assertLessEqual(run_json("info", "--dem", raster, "--seed", 1)["finest_spacing_m"], 1)

    def test_nodata_share_counts_samples(self):
        heights, _ = self.hills(40, 40)
        heights[:, :10] = -9999
        info = run_json("info", "--dem", self.write_grid("frame.asc", heights))
        self.assertAlmostEqual(info["nodata_share"], 0.25, places=6)


if __name__ == "__main__":
    main()
