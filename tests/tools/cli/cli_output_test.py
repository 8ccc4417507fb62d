#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Output files: files of the user are never touched, an interrupted run leaves complete files, a full disk no
incomplete ones. Progress on a terminal."""

import functools
import json
import os
import pty
import resource
import shutil
import signal
import subprocess
import tempfile
import time

from program import PROGRAM, SMALL_WORLD, Folder, main, np, run, start

SMALL = [*SMALL_WORLD, "--fps", 10, "--size", "64x48", "--budget", 1000]
QUICK = [*SMALL, "--seconds", 0.4]
LIST = "terrane-files.txt"


@functools.lru_cache
def draws():
    """Whether an EGL device opens."""
    with tempfile.TemporaryDirectory() as folder:
        return run("fly", *QUICK, "--png", "--out", folder).returncode == 0


class OwnFiles(Folder):
    def put(self, name):
        os.makedirs(self.path("out"), exist_ok=True)
        self.write("out/" + name, "mine\n")

    def content(self, name):
        return self.read("out/" + name)

    def fly(self, *arguments):
        return run("fly", *QUICK, "--out", self.path("out"), *arguments)

    def test_a_clash_is_refused_and_nothing_is_touched(self):
        commands = [(["fly", *QUICK], "frames.csv"), (["fly", *QUICK], "report.html"),
                    (["fly", *QUICK, "--video"], "flight.mp4"), (["fly", *QUICK, "--png"], "frame_000077.png"),
                    (["drive", *QUICK], "frames.csv"), (["page", *QUICK], "frames.csv"),
                    (["drop", *SMALL_WORLD, "--count", 2, "--seconds", 0.2], "report.html"),
                    *((["bodies", "--study", "--most-bodies", 50, "--seconds-a-point", 0.001], name)
                      for name in ("report.html", "study.md"))]
        for command, name in commands:
            with self.subTest(command):
                shutil.rmtree(self.path("out"), ignore_errors=True)
                self.put(name)
                self.assert_refused(run(*command, "--out", self.path("out")), [1], "out/" + name)
                self.assertEqual(os.listdir(self.path("out")), [name])
                self.assertEqual(self.content(name), b"mine\n")

    def test_files_of_other_names_stay(self):
        for name in ("frame_000077.png", "flight.mp4", "notes.txt", "frames.csv.partial"):
            self.put(name)
        self.assertEqual(self.fly().returncode, 0)  # without --png and --video
        self.assertEqual(sorted(os.listdir(self.path("out"))),
                         ["flight.mp4", "frame_000077.png", "frames.csv", "frames.csv.partial", "notes.txt",
                          "report.html", LIST])
        for name in ("frame_000077.png", "flight.mp4", "notes.txt", "frames.csv.partial"):
            self.assertEqual(self.content(name), b"mine\n")

    def test_a_rerun_replaces_what_a_run_wrote(self):
        self.assertEqual(self.fly().returncode, 0)
        first = self.content("frames.csv")
        self.assertEqual(self.fly("--altitude", 150).returncode, 0)
        self.assertNotEqual(self.content("frames.csv"), first)
        self.assertEqual(sorted(os.listdir(self.path("out"))), ["frames.csv", "report.html", LIST])
        lines = self.content(LIST).decode().splitlines()
        self.assertEqual([line.split()[2] for line in lines[1:]], ["frames.csv", "report.html"])
        self.assertEqual(int(lines[1].split()[0]), len(self.content("frames.csv")))
        # files of another subcommand also belong to a run
        done = run("page", *QUICK, "--out", self.path("out"))
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_a_file_that_the_user_changed_is_the_users(self):
        self.assertEqual(self.fly().returncode, 0)
        with open(self.path("out/frames.csv"), "r+b") as file:
            file.seek(100)
            byte = file.read(1)
            file.seek(100)
            file.write(b"x" if byte != b"x" else b"y")  # of the same size
        changed = self.content("frames.csv")
        report = self.content("report.html")
        self.assert_refused(self.fly(), [1], "out/frames.csv")
        self.assertEqual(self.content("frames.csv"), changed)
        self.assertEqual(self.content("report.html"), report)

    def test_a_list_that_is_none_is_refused(self):
        self.put(LIST)
        self.assert_refused(self.fly(), [1], LIST)
        self.assertEqual(self.content(LIST), b"mine\n")

    def test_a_list_leads_to_no_other_folder(self):
        self.assertEqual(self.fly().returncode, 0)
        line = self.content(LIST).decode().splitlines()[1].split()
        shutil.copy(self.path("out/frames.csv"), self.path("precious.csv"))
        with open(self.path("out/" + LIST), "a") as file:
            file.write(f"{line[0]} {line[1]} ../precious.csv\n")
        self.assertEqual(self.fly().returncode, 0)
        self.assertTrue(os.path.exists(self.path("precious.csv")))

    def test_pictures_are_replaced_and_the_users_are_not(self):
        if not draws():
            self.skipTest("nothing draws here")
        self.assertEqual(self.fly("--png").returncode, 0)
        self.assertTrue(os.path.exists(self.path("out/frame_000003.png")))
        self.assertEqual(self.fly("--png", "--seconds=0.2").returncode, 2)  # given twice
        self.put("frame_000900.png")
        self.assert_refused(self.fly("--png"), [1], "frame_000900.png")
        self.assertEqual(self.fly().returncode, 0)  # takes its own pictures away, and no other
        self.assertEqual(sorted(os.listdir(self.path("out"))),
                         ["frame_000900.png", "frames.csv", "report.html", LIST])

    def test_one_run_at_a_time_has_a_folder(self):
        first = start("fly", *SMALL, "--seconds", 60, "--realtime", "--out", self.path("out"))
        self.addCleanup(first.communicate)
        self.addCleanup(first.kill)
        wait_for(lambda: os.path.exists(self.path("out/frames.csv.partial")))
        self.assert_refused(self.fly(), [1], "another run")
        self.assertTrue(os.path.exists(self.path("out/frames.csv.partial")))


def wait_for(condition, seconds=60):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


def size_of(path):
    return os.path.getsize(path) if os.path.exists(path) else 0


class Interrupted(Folder):
    LONG = [*SMALL, "--seconds", 600, "--path", "orbit"]

    def interrupt(self, command, file, number=signal.SIGINT, lead=4096):
        """Runs a command, and signals it when it has written part of a file."""
        process = start(*command)
        self.addCleanup(process.kill)
        wait_for(lambda: size_of(self.path(file)) >= lead or process.poll() is not None)
        process.send_signal(number)
        out, error = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 1, error)
        self.assertEqual(len(error.splitlines()), 1, error)
        return out, error

    def test_a_flight_ends_with_whole_files(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            out, error = self.interrupt(["fly", *self.LONG, "--out", self.path("out"), "--json"],
                                        "out/frames.csv.partial", number)
            summary = json.loads(out)
            self.assertTrue(summary["interrupted"])
            self.assertIn(f"interrupted after {summary['frames']} of 6000 frames", error)
            self.assertEqual(sorted(os.listdir(self.path("out"))), ["frames.csv", "report.html", LIST])
            lines = self.read("out/frames.csv").decode().split("\n")
            self.assertEqual(lines.pop(), "")
            self.assertEqual(len(lines), summary["frames"] + 1)
            self.assertEqual({len(line.split(",")) for line in lines}, {len(lines[0].split(","))})
            self.assertIn(b'"interrupted":true', self.read("out/report.html"))

    def test_a_film_is_shorter_and_plays(self):
        if not draws() or shutil.which("ffprobe") is None:
            self.skipTest("nothing draws here, or no ffmpeg")
        out, _ = self.interrupt(["fly", *self.LONG, "--video", "--out", self.path("out"), "--json"],
                                "out/frames.csv.partial", lead=1)
        frames = subprocess.run(
            ["ffprobe", "-v", "error", "-count_frames", "-select_streams", "v:0", "-show_entries",
             "stream=nb_read_frames", "-of", "csv=p=0", self.path("out/flight.mp4")],
            capture_output=True, text=True)
        self.assertEqual(int(frames.stdout), json.loads(out)["frames"], frames.stderr)
        self.assertEqual(sorted(os.listdir(self.path("out"))), ["flight.mp4", "frames.csv", "report.html", LIST])

    def test_a_drop_keeps_whole_steps(self):
        out, error = self.interrupt(["drop", *SMALL_WORLD, "--count", 5, "--seconds", 100_000, "--no-sleep",
                                     "--trace", self.path("t.csv"), "--json"], "t.csv.partial")
        steps = json.loads(out)["steps"]
        self.assertIn(f"interrupted after {steps} of 6000000 steps", error)
        self.assertEqual(os.listdir(self.folder), ["t.csv"])
        poses = np.loadtxt(self.path("t.csv"), delimiter=",", skiprows=1)
        self.assertEqual(poses.shape, (5 * (steps + 1), 9))

    def test_page_reports_the_flights_that_were_whole(self):
        process = start("page", *self.LONG, "--out", self.path("out"), "--memory-mb", "512,64,32")
        self.addCleanup(process.kill)
        wait_for(lambda: os.path.exists(self.path("out")))
        time.sleep(0.2)
        process.send_signal(signal.SIGINT)
        _, error = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 1)
        self.assertIn("interrupted after 0 of 3 lines", error)
        self.assertEqual(os.listdir(self.path("out")), [])

    def test_the_second_signal_ends_at_once_and_leaves_no_part(self):
        process = start("drop", *SMALL_WORLD, "--count", 1, "--seconds", 1e4, "--trace", self.path("t.csv"))
        self.addCleanup(process.kill)
        wait_for(lambda: os.path.exists(self.path("t.csv.partial")))
        # SIGSTOP, so that it receives both signals before it finishes
        process.send_signal(signal.SIGSTOP)
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGTERM)
        process.send_signal(signal.SIGCONT)
        out, _ = process.communicate(timeout=60)
        self.assertEqual((process.returncode, out), (1, ""))
        self.assertEqual(os.listdir(self.folder), [])


class FullDisk(Folder):
    """A file size limit simulates a full disk: writes fail in the same way."""

    def run_limited(self, *arguments, kilobytes):
        limit = kilobytes << 10
        return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=300,
                              preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))

    def assert_full(self, done, name):
        self.assert_refused(done, [1], name, "File too large")

    def test_no_half_file_is_left(self):
        out = ["--out", self.path("out")]
        self.assert_full(self.run_limited("fly", *SMALL, "--seconds", 30, *out, kilobytes=16), "out/frames.csv")
        self.assertEqual(os.listdir(self.path("out")), [])
        self.assert_full(self.run_limited("mesh", *SMALL_WORLD, "--budget", 5000, "--out", self.path("m.ply"),
                                          kilobytes=16), "m.ply")
        self.assert_full(self.run_limited("drop", *SMALL_WORLD, "--count", 50, "--trace", self.path("t.csv"),
                                          kilobytes=16), "t.csv")
        # frames.csv fits, the report does not
        self.assert_full(self.run_limited("fly", *QUICK, *out, kilobytes=64), "out/report.html")
        self.assertNotIn("report.html", os.listdir(self.path("out")))
        self.assertEqual([name for name in os.listdir(self.path("out")) if "partial" in name], [])

    def test_a_film_that_finds_no_room_is_named(self):
        if not draws() or shutil.which("ffmpeg") is None:
            self.skipTest("nothing draws here, or no ffmpeg")
        done = self.run_limited("fly", *SMALL_WORLD, "--seconds", 2, "--fps", 10, "--size", "320x240", "--video", "--out",
                                self.path("out"), kilobytes=8)
        self.assert_refused(done, [1], "out/")
        self.assertEqual([name for name in os.listdir(self.path("out")) if "partial" in name], [])
        self.assertNotIn("flight.mp4", os.listdir(self.path("out")))


class ShownProgress(Folder):
    def on_a_terminal(self, *arguments):
        """Output of a command on standard error, which is a terminal."""
        ours, theirs = pty.openpty()
        process = subprocess.Popen([PROGRAM, *map(str, arguments)], stdout=subprocess.DEVNULL, stderr=theirs)
        os.close(theirs)
        shown = b""
        while True:
            try:
                piece = os.read(ours, 4096)
            except OSError:
                break
            if not piece:
                break
            shown += piece
        os.close(ours)
        self.assertEqual(process.wait(), 0)
        return shown.decode()

    def test_says_how_much_time_is_left_on_a_terminal_only(self):
        for command, word in (("fly", "flying"), ("drive", "driving")):
            with self.subTest(command):
                arguments = [command, *SMALL, "--seconds", 1.5, "--realtime", "--out"]
                elsewhere = start(*arguments, self.path("elsewhere"))
                shown = self.on_a_terminal(*arguments, self.path("out"))
                self.assertRegex(shown, word + r": \d+ %, \d+ s left")
                self.assertTrue(shown.endswith("\r\x1b[K"), repr(shown[-40:]))
                self.assertEqual(elsewhere.communicate(timeout=60)[1], "")
                self.assertEqual(elsewhere.returncode, 0)


if __name__ == "__main__":
    main()
