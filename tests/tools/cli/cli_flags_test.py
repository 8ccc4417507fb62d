#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Messages and exit codes for unusable command lines: mistyped names, flags without effect, limits. Exit code 2: the
command line is invalid, whatever the files hold; 1: everything else."""

import os
import resource
import subprocess

from program import PROGRAM, Folder, main, run


class Spelling(Folder):
    def test_a_mistyped_name_is_named_with_the_nearest_one(self):
        for arguments, words in (
                (["fly", "--bugdet", 5], ["--bugdet is not a flag of fly", "did you mean --budget?"]),
                (["fly", "--seed", 1, "--bugdet=5"], ["--bugdet is not", "--budget?"]),
                (["drop", "--seed", 1, "--cuont", 5], ["--cuont is not a flag of drop", "--count?"]),
                (["mesh", "--size", "5x5", "--fov", 5], ["--fov is not a flag of mesh", "did you mean --fov-deg?"]),
                (["flyy"], ["no subcommand 'flyy'", "did you mean fly?"]),
                (["quary", "--seed", 1], ["no subcommand 'quary'", "did you mean query?"]),
                (["fly", "--policy", "distanse"], ["--policy", "distanse", "did you mean distance?"]),
                (["page", "--policy", "deadline,orcale"], ["--policy", "orcale", "did you mean oracle?"]),
                (["fly", "--path", "canyn"], ["--path", "canyn", "did you mean canyon?"]),
                (["drop", "--shape", "sfere"], ["--shape", "sfere", "did you mean sphere?"]),
                (["bodies", "--broadphase", "gird"], ["--broadphase", "gird", "did you mean grid?"]),
                (["info", "--seed", 1, "--fractal", "riged"], ["--fractal", "did you mean ridged?"])):
            with self.subTest(arguments):
                self.assert_refused(run(*arguments), [2], *words)

    def test_what_is_near_nothing_gets_no_guess(self):
        for arguments in (["fly", "--seed", 1, "--xylophone"], ["dance"], ["fly", "--path", "xylophone"]):
            done = run(*arguments)
            self.assert_refused(done, [2], arguments[-1])
            self.assertNotIn("did you mean", done.stderr)

    def test_words_and_values_in_the_wrong_place(self):
        for arguments, words in ((["fly", "--seed", 1, "--budget"], ["--budget needs a value"]),
                                 (["fly", "--seed", 1, "--budget", 5, "--budget", 6],
                                  ["--budget is given more than once"]),
                                 (["fly", "--seed", 1, "fast"], ["'fast' is not expected"]),
                                 (["--seed", 1, "fly"], ["--seed stands before the subcommand"])):
            with self.subTest(arguments):
                self.assert_refused(run(*arguments), [2], *words)


class FlagsThatDoNothing(Folder):
    def test_are_refused_before_anything_is_read(self):
        # with a terrain that does not exist: the flag is refused before it is opened
        ground = ["--dem", self.path("absent.tif")]
        for arguments, flag in (
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
                *((["bodies", "--study", "--out", self.path("out"), name, value], name)
                  for name, value in (("--count", 5), ("--detail", 3), ("--detail-deviation", 1),
                                      ("--radius", 1), ("--share", 0.1), ("--speed", 1), ("--spin", 1),
                                      ("--size-power", 2), ("--dt", 1), ("--queries", 5), ("--broadphase", "sap")))):
            with self.subTest(arguments):
                self.assert_refused(run(*arguments), [2], flag)
                self.assertEqual(os.listdir(self.folder), [])

    def test_an_announcement_needs_a_path_that_jumps(self):
        self.assert_refused(run("page", "--seed", 1, "--announce-s", 2), [2], "--announce-s", "teleports")

    def test_the_same_flags_work_where_they_do_something(self):
        quick = ["--seconds", 0.2, "--fps", 5, "--size", "64x48", "--budget", 1000]
        for arguments in (["fly", "--seed", 1, *quick, "--policy", "distance", "--radius", 2],
                          ["page", "--seed", 1, *quick, "--policy", "distance", "--radius", 2],
                          ["page", "--seed", 1, *quick[2:], "--seconds", 6, "--path", "teleports", "--announce-s", 2],
                          ["page", "--seed", 1, *quick, "--failure-share", 0.1, "--storage-seed", 3],
                          ["drop", "--seed", 1, "--count", 2, "--seconds", 0.2, "--fps", 5, "--size", "64x48",
                           "--out", self.path("out")]):
            with self.subTest(arguments):
                self.assertEqual(run(*arguments).returncode, 0)


class Limits(Folder):
    def test_limits_are_called_by_their_flags(self):
        for command in ("fly", "drive", "walk", "mesh", "page"):
            self.assert_refused(run(command, "--seed", 1, "--world-m", 131072, "--budget", 7), [1], "--budget",
                                "at least 8", "7")
            self.assert_refused(run(command, "--seed", 1, "--budget", 31), [1], "--budget", "at least 32", "31")
        for command in ("fly", "drive", "walk", "mesh", "page", "query", "drop"):
            self.assert_refused(run(command, "--seed", 1, "--world-m", 131072, "--memory-mb", 0.01), [1], "--memory-mb",
                                "at least 1.072", "0.01")
        # the value in the message is enough
        self.assertEqual(run("mesh", "--seed", 1, "--world-m", 131072, "--budget", 8, "--memory-mb", 1.072).returncode, 0)
        # the root squares of two windows
        self.assert_refused(run("mesh", "--seed", 1, "--memory-mb", 8), [1], "--memory-mb", "at least 8.57")
        self.assertEqual(run("mesh", "--seed", 1, "--budget", 32, "--memory-mb", 8.576).returncode, 0)

    def test_values_that_no_terrain_allows_make_no_sense(self):
        for arguments, words in (
                (["fly", "--seed", 1, "--budget", 2_000_000_000], ["--budget", "1000000000"]),
                (["fly", "--seed", 1, "--threads", 257], ["--threads", "256"]),
                (["drop", "--seed", 1, "--count", 10_000_000_000], ["--count", "10000000000"]),
                (["drop", "--seed", 1, "--threads", 65], ["--threads", "64"]),
                (["bodies", "--count", 10_000_001], ["--count", "10000000"]),
                (["page", "--seed", 1, "--horizon-s", 3601], ["--horizon-s", "3600"]),
                (["page", "--seed", 1, "--failure-share", 0.7, "--hang-share", 0.7], ["--failure-share"]),
                (["fly", "--seed", 1, "--policy", "distance", "--radius", 1e9], ["--radius"]),
                (["query", "--seed", 1, "--contact-spacing-m", 1e12], ["--contact-spacing-m"]),
                (["fly", "--seed", 1, "--seconds", 1e300], ["1e+300 s"]),
                (["mesh", "--seed", 1, "--eye", "1,2,3", "--look", "1,2,3"], ["eye"])):
            with self.subTest(arguments):
                self.assert_refused(run(*arguments, timeout=10), [2], *words)

    def test_what_the_world_lacks_is_a_failure(self):
        open(self.path("empty.csv"), "w").close()
        os.mkdir(self.path("folder.csv"))
        for arguments, words in (
                (["fly", "--seed", 1, "--path", self.path("none.csv")], ["none.csv", "No such file"]),
                (["fly", "--seed", 1, "--path", self.path("empty.csv")], ["empty.csv"]),
                (["fly", "--seed", 1, "--path", self.path("folder.csv")], ["folder.csv", "folder"]),
                (["info", "--scene", self.path("none.json")], ["none.json", "No such file"]),
                (["info", "--scene", self.folder], ["not a file"]),
                (["info", "--dem", self.path("empty.csv")], ["empty.csv"]),
                (["mesh", "--seed", 1, "--budget", 500, "--out", self.path("no/a.ply")],
                 ["no/a.ply", "No such file"]),
                (["fly", "--seed", 1, "--out", self.path("empty.csv")], ["cannot make the folder", "empty.csv"]),
                (["drop", "--seed", 1, "--trace", self.path("no/t.csv")], ["no/t.csv", "No such file"]),
                (["drop", "--seed", 1, "--save", self.path("no/w")], ["no/w", "No such file"]),
                (["drop", "--seed", 1, "--restore", self.path("none")], ["cannot restore", "none", "No such file"]),
                (["drop", "--seed", 1, "--restore", self.folder], ["cannot restore", "not a file"]),
                (["drop", "--seed", 1, "--restore", self.path("empty.csv")], ["cannot restore", "empty.csv"])):
            with self.subTest(arguments):
                self.assert_refused(run(*arguments), [1], *words)

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

        if limited("info", "--seed", 1, megabytes=1000).returncode != 0:
            self.skipTest("the program does not start in 1000 MB of addresses")
        done = limited("bodies", "--count", 10_000_000, "--queries", 1, megabytes=1000)
        self.assert_refused(done, [1], "out of memory", "--count 10000000")


if __name__ == "__main__":
    main()
