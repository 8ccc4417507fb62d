#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Records of runs (`--record`), and their replays by `fly --replay`."""

import json
import os
import signal
import time

from program import SMALL_WORLD, Folder, main, np, run, run_json, start

SMALL = ("--fps", 10, "--size", "64x48", "--budget", 500)
PICTURE = ("--size", "64x48", "--budget", 500)
# What the frames of a run and of its replay have in common; the rest depends on flags and loaders.
SAME = ("time_s", "eye_x_m", "eye_y_m", "eye_z_m", "speed_m_s", "depth_m", "body_x_m", "body_y_m", "body_z_m",
        "wheels_on_ground", "tilt_deg", "stands", "awake", "touching_pairs")


class Record(Folder):
    def setUp(self):
        super().setUp()
        self.record = self.path("a.run")

    def frames(self, out):
        return [{key: row[key] for key in SAME if key in row} for row in self.rows(out + "/frames.csv")]

    def check_replay(self, *command):
        """Records a command and replays it: the summary of the replay."""
        done = run_json(*command, "--record", self.record, "--out", self.path("live"))
        self.assertEqual(done["record"], self.record)
        again = run_json("fly", "--replay", self.record, *PICTURE, "--out", self.path("again"))
        self.assertEqual(again["run"], command[0])
        self.assertEqual(again.get("state_hash"), done.get("state_hash"))
        self.assertEqual(again["frames"], done["frames"])
        live = self.frames("live")
        self.assertGreaterEqual(len(live[0]), 4)
        self.assertEqual(self.frames("again"), live)
        return done

    def test_a_replay_has_the_bodies_and_cameras_of_the_run(self):
        flat = self.flat()
        for threads in (0, 2):
            drive = self.check_replay("drive", "--dem", flat, "--seconds", 12, *SMALL, "--crates", 60, "--threads",
                                      threads, "--vehicle", "six-wheeler", "--camera-m", "9,3")
            self.assertGreater(drive["crates_touched"], 0)
        self.check_replay("walk", "--seed", 5, "--seconds", 7, *SMALL, "--crates", 20)
        self.check_replay("fly", *SMALL_WORLD, "--seconds", 3, *SMALL)
        self.check_replay("drop", *SMALL_WORLD, "--count", 30, "--scale", 0.3, "--shape", "mixed", "--seconds", 6,
                          "--fps", 10, "--size", "64x48", "--contact-spacing-m", 2)

    def test_a_righted_vehicle_is_righted_again(self):
        heights = np.zeros((40, 80))
        heights[:, :40] = 40.0
        cliff = self.write_grid("cliff.asc", heights, cell=5.0)
        track = self.write("track.csv", "x_m,y_m\n-180,0\n180,0\n")
        drive = self.check_replay("drive", "--dem", cliff, "--path", track, "--speed", 12, "--seconds", 30, *SMALL,
                                  "--on-roll", "right")
        self.assertGreaterEqual(drive["rights"], 1)

    def test_ruts_are_dug_again_in_the_same_steps(self):
        for threads in (0, 2):
            drive = self.check_replay("drive", "--seed", 7, "--ruts", "--seconds", 12, *SMALL, "--crates", 20,
                                      "--threads", threads)
            self.assertGreater(drive["digs"], 20)
        whole = self.frames("again")
        run_json("fly", "--replay", self.record, *PICTURE, "--start-s", 8.5, "--out", self.path("part"))
        self.assertEqual(self.frames("part"), whole[85:])
        self.assert_refused(run("fly", "--replay", self.record, *PICTURE, "--latency-ms", 1), [1], "--latency-ms",
                            "a.run")

    def test_bodies_and_objects_of_a_scene_are_there_again(self):
        scene = self.scene(
            dem=os.path.basename(self.flat()), detail_m=1,
            bodies=[{"shape": {"sphere": {"radius": 0.6}}, "position": [12 + 4 * i, 0.3 * i, 4], "mass": 30}
                    for i in range(5)],
            objects=[{"scatter": {"mesh": self.write_block(), "per_km2": 3000, "seed": 2, "scale": [0.2, 0.3],
                                  "static": True}}])
        for command in ("drive", "walk", "drop"):
            counts = ("--count", 3, "--scale", 0.5) if command == "drop" else ("--budget", 500)
            self.check_replay(command, "--scene", scene, "--seconds", 6, "--fps", 10, "--size", "64x48", *counts)

    def test_a_part_of_a_replay_has_the_frames_of_the_whole(self):
        self.check_replay("drive", "--dem", self.flat(), "--seconds", 14, *SMALL, "--crates", 20)
        whole = self.frames("again")
        part = run_json("fly", "--replay", self.record, *PICTURE, "--start-s", 11.5, "--seconds", 2, "--out",
                        self.path("part"))
        self.assertEqual(part["frames"], 20)
        self.assertEqual(self.frames("part"), whole[115:135])
        self.check_replay("fly", *SMALL_WORLD, "--seconds", 3, *SMALL)
        run_json("fly", "--replay", self.record, *PICTURE, "--start-s", 1, "--out", self.path("part"))
        self.assertEqual(self.frames("part"), self.frames("again")[10:])

    def test_the_flags_of_a_replay_make_its_frames(self):
        run_json("drive", "--dem", self.flat(), "--seconds", 1, "--fps", 5, *PICTURE, "--record", self.record)
        again = run_json("fly", "--replay", self.record, "--png", "--size", "80x60", "--budget", 900, "--out",
                         self.path("out"))
        self.assertEqual(sum(name.endswith(".png") for name in os.listdir(self.path("out"))), again["frames"])
        self.assertEqual({row["budget"] for row in self.rows()}, {"900"})

    def test_the_terrain_may_have_moved(self):
        flat = self.flat(3.0)
        done = run_json("drive", "--dem", flat, "--seconds", 2, *SMALL, "--record", self.record)
        moved = self.path("moved.asc")
        os.rename(flat, moved)
        self.assert_refused(run("fly", "--replay", self.record, *PICTURE), [1], "flat.asc")
        again = run_json("fly", "--replay", self.record, "--dem", moved, *PICTURE)
        self.assertEqual(again["state_hash"], done["state_hash"])

    def test_bad_records_are_refused_by_a_line(self):
        run_json("drive", "--dem", self.flat(), "--seconds", 2, *SMALL, "--record", self.record)
        data = self.read("a.run")
        damaged = bytearray(data)
        damaged[len(data) // 3] ^= 8
        newer, older = bytearray(data), bytearray(data)
        newer[12] += 1
        older[12] -= 1
        replay = ["fly", "--replay"]
        self.assert_all_refused([
            ([*replay, self.path("none.run")], "none.run", "No such file"),
            ([*replay, self.folder], self.folder, "no regular file"),
            ([*replay, self.write("cut.run", data[:len(data) // 2])], "cut.run", "cut off"),
            ([*replay, self.write("damaged.run", bytes(damaged))], "damaged.run", "damaged"),
            ([*replay, self.write("newer.run", bytes(newer))], "newer.run"),
            ([*replay, self.write("older.run", bytes(older))], "older.run"),
            ([*replay, self.write("foreign.run", "x_m,y_m\n" * 20)], "foreign.run", "is no "),
            ([*replay, self.record, "--seed", 3], "a.run", "another terrain", "flat.asc", "seed 3"),
            ([*replay, self.record, "--start-s", 5], "--start-s 5", "a.run", "1.9 s"),
            (["drive", "--dem", self.flat(), "--seconds", 1, *SMALL, "--record", self.path("no/a.run")], "no/a.run"),
        ], [1])

    def test_flags_that_a_record_has_are_refused(self):
        run_json("fly", *SMALL_WORLD, "--seconds", 1, *SMALL, "--record", self.record)
        replay = ["fly", "--replay", self.record]
        self.assert_all_refused([
            *(([*replay, *flag], flag[0], "--replay") for flag in (
                ["--path", "orbit"], ["--speed", 5], ["--altitude", 50], ["--fps", 30], ["--record", "b.run"],
                ["--detail-m", 2], ["--world-m", 4096], ["--start-m", "5,5"], ["--policy", "oracle"])),
            (["view", "--replay", self.record, "--record", "b.run"], "--record", "--replay"),
            (["fly", "--seed", 1, "--start-s", 1], "--start-s", "--replay"),
            (["drop", "--seed", 1, "--fps", 10], "--fps", "--out", "--record"),
        ], [2])

    def test_an_interrupted_run_keeps_what_it_had(self):
        out = self.path("out")
        process = start("drive", "--dem", self.flat(), "--path", "orbit", "--seconds", 1000, *SMALL, "--record",
                        self.record, "--out", out, "--json")
        self.addCleanup(process.kill)
        frames = os.path.join(out, "frames.csv.partial")
        end = time.monotonic() + 60
        while not (os.path.exists(frames) and os.path.getsize(frames) > 4096) and time.monotonic() < end:
            time.sleep(0.02)
        self.assertFalse(os.path.exists(self.record))
        process.send_signal(signal.SIGINT)
        summary = json.loads(process.communicate(timeout=60)[0])
        self.assertTrue(summary["interrupted"])
        again = run_json("fly", "--replay", self.record, *PICTURE)
        self.assertEqual(again["frames"], summary["frames"])
        self.assertEqual(again["state_hash"], summary["state_hash"])
        self.assertEqual([name for name in os.listdir(self.folder) if "partial" in name], [])


if __name__ == "__main__":
    main()
