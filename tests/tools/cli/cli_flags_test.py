#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Messages and exit codes for unusable command lines: mistyped names, wrong values, flags without effect, limits. Exit
code 2: the command line is invalid, whatever the files hold; 1: everything else."""

import os
import re
import resource
import subprocess

from program import PROGRAM, SMALL_WORLD, Folder, main, run

# Wrong values of flags, by command; a message names the flag and the last item of the value.
WRONG_VALUES = {
    "info --seed 1": {"--detail-m": "0 -1 nan inf wide", "--world-m": "0 -5 nan inf 1e-9 5e9 x",
                      "--start-m": "nan,0 1 1,2,3 x,y inf,0 1e+300,0"},
    "info": {"--seed": "x1 -1"},
    "info --dem none.tif": {"--dem-memory-mb": "0 -1 nan much", "--detail-m": "0", "--height-unit": "stone",
                            "--height-scale": "0 nan x", "--nodata": "x 1,,2 nan", "--encoding": "rgb",
                            "--cell-m": "0 -1 nan", "--project": "utm"},
    "mesh --seed 1": {"--budget": "-5 0 many", "--size": "0x100 100x0 -1x1 100", "--max-error-px": "0 nan",
                      "--fov-deg": "0 180 nan", "--eye": "nan,0,0 1,2", "--look": "1,2,inf", "--memory-mb": "0 -1"},
    "drop --seed 1": {"--count": "0 -1 1.5 two 1e3 99999999999999999999", "--dt": "0 -0.1 10.5 nan", "--seconds": "0 nan",
                      "--substep": "0 1.5 nan", "--speed": "nan", "--spin": "inf", "--shape": "egg", "--scale": "0 nan",
                      "--fps": "0", "--threads": "0 65"},
    "fly --seed 1 --png --out out": {"--samples": "0 -1 1.5 17 many", "--shadows": "-1 nan far", "--look": "nice",
                                        "--sun-deg": "1 1,2,3 nan,1 0,91 361,0",
                                        "--sun-time": "noon 2026-06-21 2026-13-01T00:00Z 2026-06-21T24:00Z "
                                                      "2026-06-21T14:30 2026-06-21T14:30+0200 1899-12-31T23:59Z",
                                        "--light": "1 1,2 1,2,3,0 1,2,3,4,5 nan,0,1 1,2,2e6 1,2,3,2e6",
                                        "--ground": "mars", "--snow-line-m": "nan 1e10 high", "--water-m": "inf deep"},
    "fly --seed 1": {"--latency-ms": "-1", "--bandwidth-mb": "0", "--policy": "x deadline,distance", "--radius": "0",
                     "--path": "zigzag", "--threads": "257"},
    "drive --seed 1": {"--on-roll": "left", "--vehicle": "boat", "--crates": "-1 1.5 10001", "--speed": "0 1e4",
                       "--seconds": "-1"},
    "walk --seed 1": {"--speed": "0 101", "--crates": "-1"},
    "page --seed 1": {"--latency-ms": "-1 5,,20 5, , nan 5;20", "--bandwidth-mb": "0 -10", "--memory-mb": "64,0 64,inf",
                      "--policy": "x deadline, deadline,x", "--path": "zigzag straight, ,straight straight,zigzag",
                      "--speed": "0 50,0", "--radius": "0 1,,2", "--slots": "0 1.5 1025", "--threads": "0 257",
                      "--bodies": "-1 1000000", "--horizon-s": "-1 nan 3601", "--contact-share": "1.1",
                      "--failure-share": "1.5", "--hang-share": "-0.1", "--announce-s": "-1", "--fps": "0",
                      "--seconds": "0", "--max-error-px": "0", "--latency-spread": "-1", "--altitude": "0",
                      "--storage-seed": "-1"},
    "query --seed 1": {"--contact-spacing-m": "-1 nan"},
    "bodies": {"--broadphase": "tree", "--count": "0 10000001", "--detail": "1", "--share": "0.9", "--dt": "nan"},
    "heightmap --seed 1 --out a.png": {"--side": "2 64 16385", "--spacing-m": "0", "--centre-x-m": "1e300",
                                       "--absent-m": "-1e300"},
    "simplify a.obj b.obj": {"--error": "nan -1", "--triangles": "-1 1.5", "--normal-weight": "-1 1001 nan",
                               "--colour-weight": "-1"},
    "trade": {"--dial": "bugdet root,,budget", "--seed": "-1"},
}


class WrongValues(Folder):
    def test_are_refused_by_a_line_that_names_flag_and_value(self):
        for command, flags in WRONG_VALUES.items():
            for flag, values in flags.items():
                for value in values.split(" "):
                    item = value.split(",")[-1] if command.startswith("page") else value
                    number = f"{float(item):.12g}" if re.fullmatch(r"-?\d+e-?\d+", item) else item
                    done = run(*command.split(), f"{flag}={value}", timeout=60)
                    with self.subTest((command, flag, value)):
                        self.assert_refused(done, [2], flag)
                        self.assertTrue(item in done.stderr or number in done.stderr, done.stderr)
        self.assertFalse(os.path.exists("out"))

    def test_imagery_on_the_ground_needs_a_scene_with_imagery(self):
        self.assert_all_refused([([command, "--seed", 1, "--png", "--out", self.path("out"), "--ground", "imagery"],
                                  "--ground imagery", "imagery") for command in ("fly", "drive", "drop")], [1])

    def test_what_goes_not_together_is_refused(self):
        out = ["--out", self.path("out")]
        bake = ["bake", "--dem", self.write_grid("small.asc", [[0.0] * 12] * 12)]
        far = [(command, "--seed", 7, "--start-m", "2.2e9,0")
               for command in ("fly", "drive", "walk", "drop", "page", "mesh", "info")]
        self.assert_all_refused([
            ([], "subcommand"), (["dance"], "dance"), (["--dance"], "--dance"),
            *(([command], "--dem", "--seed") for command in ("info", "mesh", "query", "drop", "page")),
            *(([command, "--seed", 1, "--dance"], "--dance") for command in ("info", "mesh", "query", "drop", "page")),
            *((arguments, "--start-m", "2147483648", "2200000000") for arguments in far),
            (["fly", "--seed", 7, "--world-m", 131072, "--start-m", "65537,0"], "--start-m", "65536"),
            (["info", "--seed", 1, "--dem-memory-mb", 5], "--dem-memory-mb"),
            *((["info", "--seed", 1, *flag], flag[0], "--dem") for flag in (
                ["--height-unit", "ft"], ["--height-scale", 2], ["--nodata", -9999], ["--encoding", "mapbox"],
                ["--cell-m", 5], ["--project", "local"])),
            (["info", "--seed", 5, "--preset", "fast"], "--preset is not a flag of info"),
            (["info", "--dem", self.path("a.tif"), "--world-m", 4096], "--world-m"),
            *(([command, "--seed", 1, *flags], *words) for command in ("fly", "drive", "drop") for flags, *words in (
                (["--samples", 1], "--samples", "--png"), (["--shadows", 100], "--shadows", "--png"),
                (["--look", "full"], "--look", "--png"), (["--sun-deg", "0,10"], "--sun-deg", "--png"),
                (["--sun-time", "2026-06-21T14:30Z"], "--sun-time", "--png"),
                (["--png", "--out", "out", "--sun-deg", "0,10", "--sun-time", "2026-06-21T14:30Z"], "--sun-deg",
                 "exclude"),
                (["--ground", "moon"], "--ground", "--png"), (["--water-m", 0], "--water-m", "--png"),
                (["--png", "--out", "out", "--snow-line-m", 900], "--snow-line-m", "--look full"))),
            (["fly", "--seed", 1, "--frame-ms", 10], "--frame-ms", "--png"),
            (["drop", "--seed", 1, "--video"], "--video", "--out"),
            (["drop", "--seed", 1, "--count", 0], "--count 0", "--scene"),
            (["page", "--seed", 1, "--announce-s", 2], "--announce-s", "teleports"),
            (["page", "--seed", 1, "--failure-share", 0.7, "--hang-share", 0.7], "--failure-share"),
            (["bodies", "--study"], "--out"),
            (["walk", "--seed", 1, "--vehicle", "truck"], "--vehicle is not a flag of walk"),
            (bake, "--out"), (["bake", *out], "--dem"),
            *(([*bake, *out, flag, value], *words) for flag, value, *words in (
                ("--levels", 0, "levels"), ("--levels", 20, "levels", "20"), ("--threads", 1000, "1000"),
                ("--region", "1,2,3", "region"), ("--region", "5,5,1,1", "region"))),
            *((["bake", "--seed", 5, "--detail-m", 0.001, *world, *out], "a store in one file holds at most", "20 levels")
              for world in ([], ["--world-m", 131072])),
            *((["mesh", "--dem", self.path("a.tif"), "--out", self.path(name)], "--out", ".ply, .obj or .glb", name)
              for name in ("m.stl", "m", "m.ply.gz", ".ply")),
            (["mesh", "--seed", 1, "--eye", "1,2,3", "--look", "1,2,3"], "eye"),
            (["heightmap", "--seed", 1, "--out", self.path("a.jpg")], ".png", "a.jpg"),
            (["heightmap", "--seed", 1, "--out", self.path("a.tif"), "--sdf", self.path("a.sdf")], "--sdf"),
            (["heightmap", "--seed", 1, "--sdf", self.path("a.sdf")], "--sdf"),
            (["simplify", "a.obj", "b.obj"], "--triangles", "--error"), (["simplify", "a.obj"], "OUT"),
            (["simplify", "a.obj", "b.stl", "--error", 1], ".ply, .obj or .glb", "b.stl"),
            (["trade", "--compare", "a"], "--compare needs two files, got 1"),
            (["trade", "--compare", "a", "b", "c"], "got 3"),
            (["trade", "--compare", "a", "b", "--quick"], "--quick goes without --compare")], [2])


class Spelling(Folder):
    def test_a_mistyped_name_is_named_with_the_nearest_one(self):
        self.assert_all_refused([
            (["fly", "--bugdet", 5], "--bugdet is not a flag of fly", "did you mean --budget?"),
            (["fly", "--seed", 1, "--bugdet=5"], "--bugdet is not", "--budget?"),
            (["drop", "--seed", 1, "--cuont", 5], "--cuont is not a flag of drop", "--count?"),
            (["mesh", "--size", "5x5", "--fov", 5], "--fov is not a flag of mesh", "did you mean --fov-deg?"),
            (["flyy"], "no subcommand 'flyy'", "did you mean fly?"),
            (["quary", "--seed", 1], "no subcommand 'quary'", "did you mean query?"),
            (["fly", "--policy", "distanse"], "--policy", "distanse", "did you mean distance?"),
            (["page", "--policy", "deadline,orcale"], "--policy", "orcale", "did you mean oracle?"),
            (["fly", "--path", "canyn"], "--path", "canyn", "did you mean canyon?"),
            (["drop", "--shape", "sfere"], "--shape", "sfere", "did you mean sphere?"),
            (["bodies", "--broadphase", "gird"], "--broadphase", "gird", "did you mean grid?"),
            (["drive", "--seed", 1, "--vehicle", "trukc"], "did you mean truck?"),
            (["drive", "--seed", 1, "--on-roll", "rigth"], "did you mean right?"),
            (["fly", "--seed", 1, "--preset", "fats"], "--preset", "'fats'", "did you mean fast?"),
            (["trade", "--dial", "bugdet"], "--dial", "did you mean budget?"),
            (["info", "--seed", 1, "--fractal", "riged"], "--fractal", "did you mean ridged?")], [2])

    def test_what_is_near_nothing_gets_no_guess(self):
        for arguments in (["fly", "--seed", 1, "--xylophone"], ["dance"], ["fly", "--path", "xylophone"]):
            done = run(*arguments)
            self.assert_refused(done, [2], arguments[-1])
            self.assertNotIn("did you mean", done.stderr)

    def test_words_and_values_in_the_wrong_place(self):
        self.assert_all_refused([
            (["fly", "--seed", 1, "--budget"], "--budget needs a value"),
            (["fly", "--seed", 1, "--budget", 5, "--budget", 6], "--budget is given more than once"),
            (["fly", "--seed", 1, "fast"], "'fast' is not expected"),
            (["--seed", 1, "fly"], "--seed stands before the subcommand")], [2])


class FlagsThatDoNothing(Folder):
    def test_are_refused_before_anything_is_read(self):
        # with a terrain that does not exist: the flag is refused before it is opened
        ground = ["--dem", self.path("absent.tif")]
        self.assert_all_refused([
            (["fly", *ground, "--radius", 2], "--radius"),
            (["fly", *ground, "--policy", "oracle", "--radius", 2], "--radius"),
            (["fly", *ground, "--start-s", 2], "--start-s"),
            (["fly", *ground, "--png"], "--png"),
            (["fly", *ground, "--video"], "--video"),
            (["drive", *ground, "--path", "spins"], "--path spins"),
            (["drive", *ground, "--path", "teleports"], "--path teleports"),
            (["drop", *ground, "--fps", 10], "--fps"),
            (["drop", *ground, "--size", "64x48"], "--size"),
            (["drop", *ground, "--fov-deg", 50], "--fov-deg"),
            *((["drop", *ground, "--restore", self.path("w"), name, value], name)
              for name, value in (("--shape", "box"), ("--count", 5), ("--scale", 2), ("--speed", 1), ("--spin", 1))),
            (["drop", *ground, "--restore", self.path("w"), "--no-sleep"], "--no-sleep"),
            (["drop", *ground, "--restore", self.path("w"), "--substep", "1/60"], "--substep"),
            (["walk", *ground, "--path", "spins"], "--path spins"),
            (["walk", *ground, "--png"], "--png"),
            (["page", *ground, "--radius", 2], "--radius"),
            (["page", *ground, "--policy", "distance", "--horizon-s", 2], "--horizon-s"),
            (["page", *ground, "--start-s", 2], "--start-s"),
            (["page", *ground, "--path", "straight@50", "--speed", 2], "--speed"),
            (["page", *ground, "--path", "straight@50:10", "--altitude", 2], "--altitude"),
            (["page", *ground, "--latency-ms", 0, "--latency-spread", 1], "--latency-spread"),
            (["page", *ground, "--storage-seed", 3], "--storage-seed"),
            (["bodies", "--most-bodies", 100], "--most-bodies"),
            (["bodies", "--seconds-a-point", 1], "--seconds-a-point"),
            (["bodies", "--most-seconds-a-point", 1], "--most-seconds-a-point"),
            (["bodies", "--size-power", 2], "--size-power"),
            (["bodies", "--out", self.path("out")], "--out"),
            (["info", *ground, "--fractal", "ridged"], "--fractal"),
            (["info", *ground, "--seed", 3, "--fractal", "ridged"], "--fractal goes with --seed"),
            *((["bodies", "--study", "--out", self.path("out"), name, value], name)
              for name, value in (("--count", 5), ("--detail", 3), ("--detail-deviation", 1), ("--radius", 1),
                                  ("--share", 0.1), ("--speed", 1), ("--spin", 1), ("--size-power", 2), ("--dt", 1),
                                  ("--queries", 5), ("--broadphase", "sap")))], [2])

    def test_the_same_flags_work_where_they_do_something(self):
        quick = [*SMALL_WORLD, "--fps", 5, "--size", "64x48"]
        for arguments in (["fly", *quick, "--seconds", 0.2, "--policy", "distance", "--radius", 2],
                          ["page", *quick, "--seconds", 0.2, "--policy", "distance", "--radius", 2],
                          ["page", *quick, "--seconds", 6, "--path", "teleports", "--announce-s", 2],
                          ["page", *quick, "--seconds", 0.2, "--failure-share", 0.1, "--storage-seed", 3],
                          ["drop", *quick, "--count", 2, "--seconds", 0.2, "--out", self.path("out")]):
            with self.subTest(arguments):
                self.assertEqual(run(*arguments).returncode, 0)


class Limits(Folder):
    def test_limits_are_called_by_their_flags(self):
        world = ["--seed", 1, "--world-m", 131072]
        views = ("fly", "drive", "walk", "mesh", "page")
        self.assert_all_refused([
            *(([command, *world, "--budget", 7], "--budget", "at least 8", "7") for command in views),
            *(([command, *world, "--memory-mb", 0.01], "--memory-mb", "at least 1.072", "0.01")
              for command in (*views, "query", "drop")),
            (["mesh", "--seed", 1, "--budget", 31], "--budget", "at least 32", "31"),
            (["query", "--seed", 1, "--preset", "fast", "--memory-mb", 0.01], "--memory-mb", "0.01"),
            # the root squares of two windows
            (["mesh", "--seed", 1, "--memory-mb", 8], "--memory-mb", "at least 8.57")], [1])
        # the value in the message is enough
        self.assertEqual(run("mesh", *world, "--budget", 8, "--memory-mb", 1.072).returncode, 0)
        self.assertEqual(run("mesh", "--seed", 1, "--budget", 32, "--memory-mb", 8.576).returncode, 0)

    def test_values_that_no_terrain_allows_make_no_sense(self):
        self.assert_all_refused([
            (["fly", "--seed", 1, "--budget", 2_000_000_000], "--budget", "1000000000"),
            (["drop", "--seed", 1, "--count", 10_000_000_000], "--count", "10000000000"),
            (["fly", "--seed", 1, "--policy", "distance", "--radius", 1e9], "--radius"),
            (["query", "--seed", 1, "--contact-spacing-m", 1e12], "--contact-spacing-m"),
            (["fly", "--seed", 1, "--seconds", 1e300], "1e+300 s"),
            (["drive", "--seed", 1, "--seconds", 1e12], "frames"),
            (["walk", "--seed", 1, "--seconds", 1e12], "frames")], [2])

    def test_what_the_world_lacks_is_a_failure(self):
        empty = self.write("empty.csv", "")
        os.mkdir(self.path("folder.csv"))
        small = self.write_grid("small.asc", [[0.0] * 12] * 12, cell=5.0)
        self.assert_all_refused([
            (["fly", "--seed", 1, "--path", self.path("none.csv")], "none.csv", "No such file"),
            (["page", "--seed", 1, "--path", "none.csv"], "none.csv"),
            (["fly", "--seed", 1, "--path", empty], "empty.csv"),
            (["fly", "--seed", 1, "--path", self.path("folder.csv")], "folder.csv", "folder"),
            (["fly", "--dem", small, "--start-m", "1e6,0"], "--start-m", "1000000"),
            (["info", "--scene", self.path("none.json")], "none.json", "No such file"),
            (["info", "--scene", self.folder], "not a file"),
            (["info", "--dem", empty], "empty.csv"),
            (["mesh", *SMALL_WORLD, "--out", self.path("no/a.ply")], "no/a.ply", "No such file"),
            (["heightmap", *SMALL_WORLD, "--side", 3, "--out", self.path("no/a.png")], "no/a.png"),
            (["bake", "--dem", small, "--out", self.path("no/a.terrane")], "no/a.terrane"),
            (["bake", "--dem", small, "--out", self.folder], self.folder),
            (["fly", *SMALL_WORLD, "--out", empty], "cannot make the folder", "empty.csv"),
            (["drop", *SMALL_WORLD, "--trace", self.path("no/t.csv")], "no/t.csv", "No such file"),
            (["drop", *SMALL_WORLD, "--save", self.path("no/w")], "no/w", "No such file"),
            (["drop", *SMALL_WORLD, "--restore", self.path("none")], "cannot restore", "none", "No such file"),
            (["drop", *SMALL_WORLD, "--restore", self.folder], "cannot restore", "not a file"),
            (["drop", *SMALL_WORLD, "--restore", empty], "cannot restore", "empty.csv"),
            (["page", "--seed", 1, "--memory-mb", 0.5], "--memory-mb"),
            (["drive", "--dem", small, "--seconds", 4, "--crates", 5000], "5000 crates", "free ground"),
            (["trade", "--dial", "root", "--dem", self.path("no.tif")], "no.tif"),
            (["trade", "--compare", self.path("no.json"), "b"], "cannot read", "no.json")], [1])

    def test_no_message_is_swamped_by_a_value(self):
        for value in ("9" * 400, "1e300", "-1e300", "1e-300", "x" * 5000):
            for command, flag in (("fly", "--fps"), ("mesh", "--fov-deg"), ("drop", "--dt"), ("fly", "--budget"),
                                  ("info", "--detail-m"), ("fly", "--policy")):
                done = run(command, "--seed", 1, f"{flag}={value}")
                self.assertLess(len(done.stderr), 200, done.stderr)

    def test_too_little_memory_says_what_takes_it(self):
        def limited(*arguments, megabytes):
            return subprocess.run(
                [PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=120,
                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (megabytes << 20, megabytes << 20)))

        enough = [size for size in (400, 1000) if limited("info", "--seed", 1, megabytes=size).returncode == 0]
        if not enough:
            self.skipTest("the program does not start in 1000 MB of addresses")
        done = limited("bodies", "--count", 10_000_000, "--queries", 1, megabytes=enough[0])
        self.assert_refused(done, [1], "out of memory", "--count 10000000")


if __name__ == "__main__":
    main()
