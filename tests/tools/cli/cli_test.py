#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The contract with scripts: flags, keys, exit codes, bad input; `terrane info`."""

import json
import os
import subprocess

from program import PROGRAM, Folder, main, np, run, run_json


class CommandLine(Folder):
    def test_help_and_version_succeed_everywhere(self):
        for alone in (False, True):
            self.assertEqual(run("--help", alone=alone).returncode, 0)
            self.assertRegex(run("--version", alone=alone).stdout, r"^terrane \d+\.\d+\.\d+\n$")
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

    def test_rasters_that_cannot_be_opened_are_refused_by_name(self):
        pipe = self.path("pipe.tif")
        os.mkfifo(pipe)
        self.assert_refused(run("info", "--dem", pipe), [1], pipe, "pipe")
        self.assert_refused(run("info", "--dem", self.path("none.tif")), [1], "none.tif")
        grid = self.write_grid("grid.asc", np.arange(400.0).reshape(20, 20))
        self.assert_refused(run("info", "--dem", grid, "--dem-memory-mb", 1), [1], grid, "20 x 20",
                            "limit is 1 MiB", "--dem-memory-mb")
        self.assertEqual(run("info", "--dem", grid, "--dem-memory-mb", 200).returncode, 0)
        for value in ("0", "-1", "nan", "much"):
            self.assert_refused(run("info", "--dem", grid, "--dem-memory-mb", value), [2],
                                "--dem-memory-mb", value)
        self.assert_refused(run("info", "--seed", 1, "--dem-memory-mb", 5), [2], "--dem-memory-mb")
        # as for a fractal, an impossible spacing is a usage error
        self.assert_refused(run("info", "--dem", grid, "--detail-m", 1e-9), [2], "--detail-m", "1e-09")

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
                            ("--dt", -0.1), ("--dt", 10.5), ("--dt", "nan"), ("--seconds", 0),
                            ("--substep", 0), ("--substep", 1.5), ("--substep", "nan"),
                            ("--seconds", "nan"), ("--speed", "nan"), ("--spin", "inf"),
                            ("--shape", "egg"), ("--scale", 0), ("--scale", "nan"), ("--fps", 0),
                            ("--threads", 0), ("--threads", 65)):
            done = run("drop", "--seed", 1, "--trace", trace, f"{flag}={value}")
            self.assert_refused(done, [2], flag, value)
            self.assertEqual(os.listdir(self.folder), [])
        self.assert_refused(run("drop", "--seed", 1, "--video"), [2], "--video", "--out")

    def test_wrong_numbers_of_samples_are_usage_errors(self):
        out = self.path("out")
        for command in ("fly", "drive", "drop"):
            for value in (0, -1, 1.5, 17, "many"):
                done = run(command, "--seed", 1, "--png", "--out", out, f"--samples={value}")
                self.assert_refused(done, [2], "--samples", value)
            for value in (-1, "nan", "far"):
                done = run(command, "--seed", 1, "--png", "--out", out, f"--shadows={value}")
                self.assert_refused(done, [2], "--shadows", value)
            self.assert_refused(run(command, "--seed", 1, "--shadows", 100), [2], "--shadows", "--png")
            # --samples without pictures
            self.assert_refused(run(command, "--seed", 1, "--samples", 1), [2], "--samples", "--png")
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
        self.assert_refused(run("page", "--seed", 1, "--memory-mb", 0.5), [1], "--memory-mb")
        self.assert_refused(run("page", "--seed", 1, "--path", "none.csv"), [1], "none.csv")

    def test_wrong_values_of_fly_are_usage_errors(self):
        for flag, value in (("--latency-ms", -1), ("--bandwidth-mb", 0), ("--policy", "x"),
                            ("--policy", "deadline,distance"), ("--radius", 0), ("--path", "zigzag")):
            self.assert_refused(run("fly", "--seed", 1, f"{flag}={value}"), [2], flag, value)
        for path in ("teleports", "spins"):
            self.assert_refused(run("drive", "--seed", 1, "--path", path), [2], "--path", path)

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


if __name__ == "__main__":
    main()
