# SPDX-License-Identifier: MIT
"""`terrane view` under Xvfb, with keys and mouse by xdotool; facts are read from its --state-log.

    view_window_test.py TERRANE [--minutes M] [--seed S]

With --minutes, random input for so long in place of the cases: nothing may crash, fall, leak or leave the ground.
"""
import argparse
import contextlib
import json
import math
import os
import pathlib
import random
import shlex
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import zlib

PATIENCE = float(os.environ.get("TERRANE_VIEW_PATIENCE", "60"))  # seconds; sanitizers are slow
SIZE = (480, 320)
SMALL = ["--budget", "6000", "--no-help", "--no-vsync"]
HILLS = ["--seed", "7", "--detail-m", "1"]
DATA = pathlib.Path(__file__).resolve().parents[2] / "tools" / "data"
SKIPPED = 77


class View:
    """A running view and its state."""

    def __init__(self, terrane, folder, *flags, terrain=HILLS, size=SIZE):
        self.log = pathlib.Path(folder) / "state.log"
        self.log.unlink(missing_ok=True)
        command = [terrane, "view", *terrain, *SMALL, "--size", "%dx%d" % size, "--out", str(folder), "--state-log", str(self.log),
                   "--json", *flags]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.taken = 0
        self.seen = []  # all states so far
        self.state = None
        self.wait("the first frame", lambda s: True)
        window = subprocess.run(["xdotool", "search", "--sync", "--pid", str(self.process.pid), "--name", "terrane"],
                                stdout=subprocess.PIPE, text=True, check=True).stdout.split()
        self.window = window[0]
        self.tool("windowfocus", "--sync", self.window)
        self.tool("mousemove", size[0] // 2, size[1] * 3 // 4)

    def tool(self, *words):
        subprocess.run(["xdotool", *map(str, words)], check=True)

    def states(self):
        """The states that are new since the last call."""
        if not self.log.exists():
            return []
        lines = self.log.read_text().split("\n")[:-1]
        new = [json.loads(line) for line in lines[self.taken:]]
        self.taken = len(lines)
        self.seen += new
        return new

    def wait(self, what, is_done, patience=PATIENCE):
        """Waits for a state; returns it."""
        end = time.monotonic() + patience
        while time.monotonic() < end:
            for state in self.states():
                self.state = state
                if is_done(state):
                    return state
            if self.process.poll() is not None:
                raise AssertionError(f"{what}: the view ended: {self.process.communicate()}")
            time.sleep(0.02)
        raise AssertionError(f"{what}: not seen in {patience} s; the last state is {self.state}")

    def key(self, *keys):
        self.tool("key", *keys)

    def picture(self):
        """What the window shows without panels."""
        before = self.state["note"]
        self.key("F12")
        note = self.wait("a picture", lambda s: s["note"] != before and s["note"].startswith("wrote "))["note"]
        file = pathlib.Path(note.split(" ", 1)[1])
        return read_png(file)

    def settle(self):
        """Waits until the ground is loaded and has faded in."""
        self.frames(30)
        self.wait("a loaded ground", lambda s: s["late"] == 0)

    def frames(self, count):
        """Waits for so many frames after those that have ended; returns the state after them."""
        self.states()
        last = self.seen[-1]["frame"] + count
        return self.wait(f"frame {last}", lambda s: s["frame"] >= last)

    def drag(self, x, y, to_x, to_y):
        """Drags with the left button; press, motion and release are in different frames."""
        for words in (("mousemove", x, y, "mousedown", 1), ("mousemove", to_x, to_y), ("mouseup", 1)):
            self.tool(*words)
            self.frames(2)

    def step(self, key):
        """Steps the paused timeline; returns the state after it."""
        before = self.state["time"]
        self.key(key)
        return self.wait("a step", lambda s: s["time"] != before)

    def end(self):
        if self.process.poll() is None:
            self.tool("windowfocus", "--sync", self.window)
            self.key("Escape")
        out, err = self.process.communicate(timeout=PATIENCE)
        assert self.process.returncode == 0, (self.process.returncode, out, err)
        return json.loads(out.strip().split("\n")[-1])


def distance(a, b):
    return math.dist(a["eye"], b["eye"])


def read_png(file):
    """Width and rows of a PNG with 8 bits of red, green and blue, not interlaced: bytes for each row."""
    data = pathlib.Path(file).read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", file
    width, height, *kind = struct.unpack(">IIBBBBB", data[16:29])
    assert kind == [8, 2, 0, 0, 0], kind
    packed, at = b"", 8
    while at < len(data):
        length, name = struct.unpack(">I4s", data[at:at + 8])
        packed += data[at + 8:at + 8 + length] if name == b"IDAT" else b""
        at += length + 12
    raw, stride = zlib.decompress(packed), 3 * width
    rows, above = [], bytes(stride)
    for y in range(height):
        line = bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        predict = raw[y * (stride + 1)]
        for i in range(stride if predict else 0):
            left, up, corner = (line[i - 3], above[i], above[i - 3]) if i >= 3 else (0, above[i], 0)
            if predict == 4:  # Paeth
                up = min((left, up, corner), key=lambda value: abs(left + up - corner - value))
            line[i] = (line[i] + (0, left, up, (left + up) // 2, up)[predict]) & 255
        rows.append(bytes(line))
        above = line
    return width, rows


def changed_share(before, after, tolerance=12):
    """Share of the pixels in which two pictures differ by more than a tolerance."""
    (width, rows), (other_width, other_rows) = before, after
    assert width == other_width and len(rows) == len(other_rows)
    count = 0
    for row, other in zip(rows, other_rows):
        if row != other:
            count += sum(max(abs(a - b) for a, b in zip(row[i:i + 3], other[i:i + 3])) > tolerance for i in range(0, len(row), 3))
    return count / (width * len(rows))


def flies_walks_drives_and_throws(terrane, folder):
    view = View(terrane, folder)
    start = view.state
    assert start["being"] == "camera" and start["size"] == list(SIZE), start
    view.tool("keydown", "w")
    view.wait("a flight", lambda s: distance(s, start) > 2.0)
    view.tool("keyup", "w")
    view.key("h")
    view.wait("home", lambda s: distance(s, start) < 0.5)
    view.key("f")
    view.wait("a crate", lambda s: s["bodies"] == 1)
    view.key("Tab")
    view.wait("a walker", lambda s: s["being"] == "walker" and not s["waiting"])
    view.tool("keydown", "w")
    view.wait("a walk", lambda s: s["being"] == "walker" and s.get("body", {}).get("speed", 0.0) > 1.0)
    view.tool("keyup", "w")
    view.key("Tab")
    view.wait("a vehicle", lambda s: s["being"] == "driver" and not s["waiting"])
    view.tool("keydown", "w")
    view.wait("a drive", lambda s: s.get("body", {}).get("speed", 0.0) > 3.0)
    view.tool("keyup", "w")
    view.key("Tab")
    view.wait("the camera again", lambda s: s["being"] == "camera")
    totals = view.end()
    assert totals["fell_through"] == 0 and totals["below_ground"] == 0, totals


def picks_digs_and_undoes(terrane, folder):
    view = View(terrane, folder, "--eye-m", "0,0,20", "--aim-deg", "0,-45")

    def picked():
        before = view.state["clicks"]
        view.tool("click", "1")
        state = view.wait("a pick", lambda s: s["clicks"] > before)
        assert state["picked"][0].startswith("ground "), state["picked"]
        assert any(line.startswith("resident: level ") for line in state["picked"]), state["picked"]
        assert any(line.startswith("drawn: level ") for line in state["picked"]), state["picked"]
        return [float(word.rstrip(",")) for word in state["picked"][0].split()[1:4]]

    view.key("space")
    view.wait("a pause", lambda s: not s["playing"])
    before = picked()
    view.key("x")
    view.wait("a dig", lambda s: s["note"].startswith("dug") and s["waiting_digs"] == 0)
    time.sleep(0.5)
    dug = picked()
    assert math.dist(before, dug) > 1.0, (before, dug)
    view.key("z")
    view.wait("an undo", lambda s: s["note"] == "undone" and s["waiting_digs"] == 0)
    time.sleep(0.5)
    after = picked()
    assert math.dist(before, after) < 0.01, (before, after)
    view.end()


def frees_what_a_fill_covers(terrane, folder):
    view = View(terrane, folder, "--be", "walker")
    view.wait("a walker", lambda s: not s["waiting"])
    time.sleep(1.0)
    before = view.wait("a walker at rest", lambda s: s["body"]["speed"] < 0.1)
    view.tool("mousemove", SIZE[0] // 2 - 25, SIZE[1] * 7 // 10)  # the ground beside its feet
    view.key("c")
    view.wait("a fill", lambda s: s["note"].startswith("filled") and s["waiting_digs"] == 0)
    view.wait("a walker on the fill", lambda s: s["body"]["position"][2] > before["body"]["position"][2] + 0.3)
    totals = view.end()
    assert totals["placed_deep"] > 0 and totals["fell_through"] == 0, totals


def plays_seeks_and_steps(terrane, folder):
    flags = ["--path", "orbit", "--altitude", "60", "--seconds", "20"]
    view = View(terrane, folder, *flags)
    assert not view.state["playing"] and view.state["on_path"], view.state
    view.key("space")
    at = view.wait("two seconds", lambda s: s["time"] > 2.0)
    view.key("space")
    view.wait("a pause", lambda s: not s["playing"])
    # back to the start by single frames of the playback, and forth again: the same times show the same views
    seen = {}
    for key in ["comma"] * 5 + ["period"] * 5:
        state = view.step(key)
        place = (state["eye"], state["forward"])
        time_key = round(state["time"], 6)
        assert seen.setdefault(time_key, place) == place, (time_key, seen[time_key], place)
    assert len(seen) == 6, sorted(seen)
    # the timeline is dragged to its end
    view.key("F2")
    time.sleep(0.5)
    before = view.state["time"]
    y = SIZE[1] - 24
    view.tool("mousemove", SIZE[0] // 2 - 40, y)
    view.tool("mousedown", "1")
    time.sleep(0.3)
    view.tool("mousemove", SIZE[0] // 2 + 60, y)
    view.wait("a seek", lambda s: s["time"] > before + 3.0)
    view.tool("mouseup", "1")
    view.tool("mousemove", SIZE[0] // 2, SIZE[1] // 2)
    view.tool("keydown", "w")
    view.wait("the camera leaves the path", lambda s: not s["on_path"])
    view.tool("keyup", "w")
    view.key("p")
    view.wait("back on the path", lambda s: s["on_path"])
    view.end()


def replays_a_record_and_seeks(terrane, folder):
    record = os.path.join(folder, "drive.run")
    subprocess.run([terrane, "drive", "--seed", "7", "--detail-m", "1", "--crates", "5", "--seconds", "6", "--record", record],
                   check=True, capture_output=True, timeout=PATIENCE)
    view = View(terrane, folder, "--replay", record)
    assert view.state["on_path"] and view.state["bodies"] == 6, view.state
    frame_of = lambda state: math.floor(state["time"] * 30 + 1e-6)
    view.key("space")
    view.wait("the end", lambda s: not s["playing"] and s["time"] > 5)
    played = {frame_of(state): (state["state_hash"], state["eye"]) for state in view.seen}
    assert len({state_hash for state_hash, _ in played.values()}) > 20, len(played)
    view.key("F2")
    time.sleep(0.5)
    largest_gap = max(b - a for a, b in zip(sorted(played), sorted(played)[1:]))
    for x in (-60, 40, -20):  # of the timeline, from the window's middle
        before = view.state["time"]
        view.tool("mousemove", SIZE[0] // 2 + x, SIZE[1] - 24, "click", "1")
        view.wait("a seek", lambda s: s["time"] != before)
        compared = 0
        for _ in range(2 * largest_gap):
            state = view.step("period")
            known = played.get(frame_of(state))
            compared += known is not None
            assert known in (None, (state["state_hash"], state["eye"])), (state, known)
        assert compared > 0, (largest_gap, state)
    view.end()
    other = subprocess.run([terrane, "view", "--seed", "8", "--replay", record], capture_output=True, text=True, timeout=PATIENCE)
    assert other.returncode == 1 and "drive.run" in other.stderr, other.stderr


def rewinds_what_was_driven(terrane, folder):
    view = View(terrane, folder, "--be", "driver")
    view.wait("a vehicle", lambda s: not s["waiting"])
    view.tool("keydown", "w")
    view.wait("a drive", lambda s: s["step"] > 150)
    view.tool("keyup", "w")
    view.key("space")
    end = view.wait("a pause", lambda s: not s["playing"])
    run = {state["step"]: (state["state_hash"], state["eye"]) for state in view.seen}
    view.key("F2")
    time.sleep(0.5)
    frame = view.state["frame"]
    view.tool("mousemove", SIZE[0] // 2 - 60, SIZE[1] - 24, "click", "1")
    past = view.wait("the past", lambda s: s["step"] < end["step"] - 20)
    assert past["steps"] == end["steps"], (past, end)
    view.key("space")
    view.wait("the present", lambda s: s["step"] >= end["steps"])
    again = [state for state in view.seen if state["frame"] > frame and state["step"] in run]
    assert len(again) > 3, len(again)
    for state in again:
        assert run[state["step"]][0] == state["state_hash"], (state, run[state["step"]])
    view.end()


def records_what_is_done(terrane, folder):
    record = os.path.join(folder, "view.run")
    view = View(terrane, folder, "--record", record, "--eye-m", "0,0,20", "--aim-deg", "0,-45")
    view.tool("keydown", "w")
    time.sleep(0.5)
    view.tool("keyup", "w")
    view.key("x")
    view.wait("a dig", lambda s: s["note"].startswith("dug") and s["waiting_digs"] == 0)
    view.key("f")
    view.wait("a crate", lambda s: s["bodies"] == 1)
    for being in ["walker", "driver"]:
        view.key("Tab")
        view.wait(being, lambda s: s["being"] == being and not s["waiting"])
        start = view.state["step"]
        view.tool("keydown", "w", "keydown", "d")
        view.wait("a ride", lambda s: s["step"] > start + 90)
        view.tool("keyup", "w", "keyup", "d")
        view.key("u")
    view.key("z")
    view.wait("an undo", lambda s: s["note"] == "undone" and s["waiting_digs"] == 0)
    # back to the time of the walk, and on from there
    view.key("space")
    view.wait("a pause", lambda s: not s["playing"])
    view.key("F2")
    time.sleep(0.5)
    end = view.state["step"]
    view.tool("mousemove", SIZE[0] // 2 - 40, SIZE[1] - 24, "click", "1")
    view.wait("the past", lambda s: s["step"] < end - 20)
    view.key("f")
    view.wait("forgets the future", lambda s: s["steps"] < end)
    view.key("F2", "space")
    view.wait("the crate", lambda s: s["step"] > s["steps"] - 5 and s["bodies"] >= 2 and s["playing"])
    time.sleep(1.0)
    run, last = {}, -1  # what the timeline holds at the end; the first frame of a step has its camera
    view.states()
    for state in view.seen:
        for later in [step for step in run if step > state["steps"]]:
            del run[later]
        last = min(last, state["steps"])
        if state["step"] > last:
            last = state["step"]
            run[last] = (set(), state["eye"])
        if state["step"] in run:
            run[state["step"]][0].add(state["state_hash"])
    totals = view.end()
    assert totals["record"] == record, totals
    replayed = subprocess.run([terrane, "fly", "--replay", record, "--size", "64x48", "--budget", "500", "--json"],
                              capture_output=True, text=True, timeout=PATIENCE)
    assert replayed.returncode == 0, replayed.stderr
    summary = json.loads(replayed.stdout)
    assert (summary["run"], summary["state_hash"]) == ("view", totals["state_hash"]), (summary, totals)
    again = View(terrane, folder, "--replay", record, terrain=[])
    assert again.state["on_path"], again.state
    again.key("space")
    again.wait("the end", lambda s: not s["playing"] and s["time"] > 1)
    compared = same = 0
    for state in again.seen:
        step = math.floor(state["time"] * 60 + 1e-6)
        if step in run:
            hashes, eye = run[step]
            compared += 1
            # the user may have changed the world after the last frame of the step
            assert state["eye"] == eye, (state, eye)
            same += state["state_hash"] in hashes
    assert compared > 10 and same >= compared - 8, (compared, same)
    again.key("x")
    again.wait("a refusal", lambda s: "cannot be dug" in s["note"])
    again.end()


def stays_in_a_cave(terrane, folder):
    view = View(terrane, folder, "--eye-m", "7618,-11846,425", "--aim-deg", "205,-4", terrain=["--scene", str(DATA / "cave.json")])
    start = view.state
    view.tool("keydown", "w")
    flown = view.wait("a flight", lambda s: distance(s, start) > 5.0)
    view.tool("keyup", "w")
    assert abs(flown["eye"][2] - 425.0) < 10.0, flown
    view.key("Tab")
    walker = view.wait("a walker", lambda s: s["being"] == "walker" and not s["waiting"])
    assert abs(walker["body"]["position"][2] - 425.0) < 10.0, walker
    totals = view.end()
    assert totals["fell_through"] == 0 and totals["below_ground"] == 0, totals


def resizes_pictures_and_copies(terrane, folder):
    view = View(terrane, folder)
    view.tool("windowsize", "--sync", view.window, 400, 260)
    view.wait("another size", lambda s: s["size"] == [400, 260])
    view.key("F12")
    note = view.wait("a picture", lambda s: s["note"].startswith("wrote "))["note"]
    header = pathlib.Path(note.split(" ", 1)[1]).read_bytes()[:24]
    assert header[1:4] == b"PNG", header
    assert int.from_bytes(header[16:20], "big") == 400 and int.from_bytes(header[20:24], "big") == 260
    view.tool("keydown", "a")
    time.sleep(0.3)
    view.tool("keyup", "a")
    time.sleep(1.0)
    view.key("k")
    state = view.wait("a command", lambda s: s["note"].startswith("terrane view "))
    view.end()
    words = shlex.split(state["note"])
    flags = words[words.index("--eye-m"):]
    again = View(terrane, folder, *flags)
    assert distance(again.state, state) < 0.01, (again.state["eye"], state["eye"])
    assert math.dist(again.state["forward"], state["forward"]) < 1e-3, (again.state, state)
    again.end()


def marks_and_panels_work(terrane, folder):
    view = View(terrane, folder, "--be", "driver")
    view.wait("a vehicle", lambda s: not s["waiting"])
    view.key("F1", "F2", "m", "t")
    # Tab is not a key of the panels: it does not edit a dial, which would take the keys after it
    for being in ["camera", "walker", "driver"]:
        view.key("Tab")
        view.wait(being, lambda s: s["being"] == being and not s["waiting"])
    view.tool("keydown", "w")
    view.wait("a drive", lambda s: s["body"]["speed"] > 1.0)
    view.tool("keyup", "w")
    for colours in ["levels", "chunks", "error", "late", "none"]:  # no materials, which the look has not
        view.key("g")
        view.wait(colours, lambda s: s["note"].endswith(": " + colours))
    view.end()


def pictures_return_and_differ(terrane, folder):
    view = View(terrane, folder, "--ground", "alpine", "--eye-m", "0,0,40", "--aim-deg", "0,-20", size=(120, 90))
    view.frames(2)
    home = view.picture()
    view.tool("keydown", "w")
    view.wait("a flight", lambda s: s["eye"][1] > 20.0)
    view.tool("keyup", "w")
    assert changed_share(home, view.picture()) > 0.2
    view.key("h")
    view.wait("home", lambda s: math.dist(s["eye"], (0, 0, 40)) < 0.01)
    view.settle()
    assert changed_share(home, view.picture()) < 0.01
    seen = [home]
    view.key("t")
    view.frames(2)
    seen.append(view.picture())
    view.key("t")
    for colours in ("levels", "materials"):
        while view.state["colours"] != colours:
            before = view.state["colours"]
            view.key("g")
            view.wait("other colours", lambda s: s["colours"] != before)
        seen.append(view.picture())
    for i, picture in enumerate(seen):
        for other in seen[:i]:
            assert changed_share(picture, other) > 0.05, i
    view.end()


def lights_what_is_at_the_cursor(terrane, folder):
    night = ["--sun-deg", "20,-5"]
    view = View(terrane, folder, *night, "--eye-m", "0,0,40", "--aim-deg", "0,-20", size=(120, 90))
    view.settle()
    dark = view.picture()
    view.key("v")
    placed = view.wait("a light", lambda s: len(s["lights"]) == 1)["lights"][0]
    lit = view.picture()
    assert changed_share(dark, lit) > 0.02 and sum(map(sum, lit[1])) > sum(map(sum, dark[1])), changed_share(dark, lit)
    view.key("k")
    words = shlex.split(view.wait("a command", lambda s: s["note"].startswith("terrane view "))["note"])
    for _ in range(8):
        view.key("v")
        view.frames(1)
    view.wait("a refusal", lambda s: s["note"] == "there can be 8 point lights")
    for _ in range(8):
        view.key("i")
        view.frames(1)
    view.wait("no light", lambda s: s["lights"] == [])
    assert changed_share(dark, view.picture()) < 0.01
    view.end()
    again = View(terrane, folder, *night, *words[words.index("--eye-m"):], size=(120, 90))
    assert math.dist(again.state["lights"][0], placed) < 0.01, (again.state["lights"], placed)
    again.settle()
    assert changed_share(lit, again.picture()) < 0.01
    again.end()


def dials_act_at_once(terrane, folder):
    view = View(terrane, folder, "--eye-m", "0,0,40", "--aim-deg", "0,-20", size=(800, 640))
    view.key("F2")
    start = view.wait("the panel", lambda s: s["covered"] > 0.2)
    # storage becomes slow and fast again
    view.drag(100, 515, 140, 515)
    view.drag(100, 535, 60, 535)
    assert view.state["latency_ms"] > 500 and view.state["bandwidth_mb"] < 10, (view.state, "the panel has another layout?")
    view.tool("keydown", "w", "keydown", "Shift_L")
    late = view.wait("late chunks", lambda s: s["late"] > 0)
    view.key("f")
    view.wait("a crate over absent ground", lambda s: s["bodies"] > late["bodies"] and s["late"] > 0)
    view.tool("keyup", "w", "keyup", "Shift_L")
    view.drag(100, 515, 5, 515)
    view.drag(100, 535, 300, 535)
    assert view.state["latency_ms"] == 0 and view.state["bandwidth_mb"] is None, view.state
    assert view.wait("the late chunks", lambda s: s["late"] == 0)["fell_through"] == 0
    view.key("h")
    for name, y, to_x in (("budget", 335, 60), ("ceiling_bytes", 395, 43), ("sun_deg", 415, 60), ("substeps", 475, 140),
                          ("contact_tolerance", 495, 60)):
        view.drag(100, y, to_x, y)
        assert view.state[name] != start[name], (name, "the panel has another layout?")
    end = view.wait("the evictions", lambda s: s["resident_bytes"] <= s["ceiling_bytes"])
    assert end["ceiling_bytes"] < start["resident_bytes"] and end["contact_tolerance"] < start["contact_tolerance"], end
    assert end["substeps"] > start["substeps"], end
    # the sun follows the shadow at the cursor, the camera does not
    view.tool("mousemove", 520, 400, "keydown", "y")
    view.frames(2)
    view.tool("mousemove", 580, 370)
    turned = view.wait("another sun", lambda s: s["sun_deg"] != end["sun_deg"])
    view.tool("keyup", "y")
    assert 1.0 <= turned["sun_deg"][1] <= 90.0 and turned["forward"] == start["forward"], turned
    # the past has its own substeps
    end = view.state
    view.wait("a step with them", lambda s: s["step"] > end["step"] + 10)
    view.key("space")
    view.wait("a pause", lambda s: not s["playing"])
    view.tool("mousemove", 800 // 2 - 130, 640 - 24, "click", "1")
    view.wait("the past", lambda s: s["substeps"] == start["substeps"])
    view.end()


def panels_leave_half_of_the_window(terrane, folder):
    view = View(terrane, folder)
    for size in ((480, 320), (720, 400)):
        view.tool("windowsize", "--sync", view.window, *size)
        view.wait("the size", lambda s: s["size"] == list(size))
        most = 0.0
        open_panel = ["mousemove", 18, 19, "click", 1]  # it is collapsed
        for words in (["key", "F2"], open_panel, ["key", "m"], ["key", "F1"], ["key", "m"], ["key", "F1"], ["key", "F2"]):
            view.tool(*words)
            most = max(most, view.frames(2)["covered"])
            assert most <= 0.51, (size, words, most)
        assert most > 0.4, (size, most)
    if view.state["help"]:
        view.key("Escape")
    view.end()


def refuses_what_cannot_be(terrane, folder):
    def run(flags, environment=None):
        return subprocess.run([terrane, "view", "--seed", "1", *flags], capture_output=True, text=True, timeout=PATIENCE,
                              env=environment)

    def expect(result, code, text):
        assert result.returncode == code, (result.returncode, result.stderr)
        assert text in result.stderr and result.stderr.count("\n") <= 2, result.stderr

    expect(run(["--size", "16385x10"]), 2, "16385")
    expect(run(["--aim-deg", "1,2"]), 2, "--aim-deg goes with --eye-m")
    expect(run(["--vehicle", "truck"]), 2, "--vehicle goes with --be driver")
    expect(run(["--speed", "9"]), 2, "--speed goes with --path")
    expect(run(["--path", "nowhere"]), 2, "nowhere")
    expect(run(["--state-log", "/nowhere/x", "--size", "64x64"]), 1, "/nowhere/x")
    without = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    expect(run([], without), 1, "no window can be opened")
    tiny = run(["--size", "1x1", "--budget", "2000", "--close-after-s", "0.5", "--json"])
    assert tiny.returncode == 0, tiny.stderr


def ends_in_a_line_without_a_display(terrane, folder):
    if shutil.which("Xvfb") is None:
        return
    number = 1000 + os.getpid() % 10000  # none that xvfb-run takes
    server = subprocess.Popen(["Xvfb", f":{number}", "-screen", "0", "640x480x24"], stderr=subprocess.DEVNULL)
    try:
        time.sleep(1.0)
        display = os.environ["DISPLAY"]
        os.environ["DISPLAY"] = f":{number}"
        try:
            view = View(terrane, folder)
            server.kill()
            server.wait()
            out, err = view.process.communicate(timeout=PATIENCE)
        finally:
            os.environ["DISPLAY"] = display
    finally:
        server.kill()
    assert view.process.returncode == 1, (view.process.returncode, out, err)
    assert 1 <= err.count("\n") <= 3 and "terminate" not in err, err


CASES = [flies_walks_drives_and_throws, picks_digs_and_undoes, frees_what_a_fill_covers, plays_seeks_and_steps, replays_a_record_and_seeks, rewinds_what_was_driven, records_what_is_done, stays_in_a_cave,
         resizes_pictures_and_copies, marks_and_panels_work, pictures_return_and_differ, lights_what_is_at_the_cursor,
         dials_act_at_once,
         panels_leave_half_of_the_window, refuses_what_cannot_be, ends_in_a_line_without_a_display]


def resident_bytes(pid):
    with open(f"/proc/{pid}/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def play_at_random(terrane, folder, minutes, seed):
    """Random keys, clicks and drags; returns figures."""
    print("seed", seed, flush=True)
    chance = random.Random(seed)
    view = View(terrane, folder, "--memory-mb", "32")  # caches are full soon
    keys = ["w", "a", "s", "d", "e", "q", "Tab", "f", "x", "c", "z", "space", "F1", "F2", "m", "j", "b", "u", "o", "h", "n", "y",
            "1", "ctrl+1", "comma", "period", "bracketleft", "bracketright", "l", "p", "g", "t", "k", "Shift_L"]
    held, sizes = set(), []
    end = time.monotonic() + 60.0 * minutes
    while time.monotonic() < end:
        what = chance.random()
        if what < 0.35:
            view.key(chance.choice(keys))
        elif what < 0.6:
            key = chance.choice(["w", "a", "s", "d", "e", "q", "Shift_L"])
            view.tool("keyup" if key in held else "keydown", key)
            held ^= {key}
        elif what < 0.85:
            view.tool("mousemove", chance.randrange(SIZE[0]), chance.randrange(SIZE[1]))
        elif what < 0.95:
            view.tool(chance.choice(["mousedown", "mouseup", "click"]), chance.choice(["1", "3", "4", "5"]))
        elif what < 0.97:
            view.tool("windowsize", view.window, chance.randrange(60, 700), chance.randrange(60, 500))
        else:
            time.sleep(0.2)
        view.states()
        if view.process.poll() is not None:
            raise AssertionError(f"seed {seed}: the view ended: {view.process.communicate()}")
        sizes.append((time.monotonic(), resident_bytes(view.process.pid)))
    for key in held:
        view.tool("keyup", key)
    for button in ("1", "3"):
        view.tool("mouseup", button)
    with contextlib.suppress(subprocess.CalledProcessError):
        view.key("Escape")
    totals = view.end()
    middle = sizes[len(sizes) // 2][0]
    halves = [max(size for at, size in sizes if (at < middle) == first) for first in (True, False)]
    totals["resident_growth"] = halves[1] / halves[0] - 1.0
    print(json.dumps(totals))
    assert totals["fell_through"] == 0, totals
    assert totals["below_ground"] == 0, totals
    return totals


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("terrane")
    parser.add_argument("--minutes", type=float)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only")
    options = parser.parse_args()
    if shutil.which("xdotool") is None or "DISPLAY" not in os.environ:
        print("xdotool or a display is absent")
        return SKIPPED
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    with tempfile.TemporaryDirectory() as folder:
        if options.minutes:
            play_at_random(options.terrane, folder, options.minutes, options.seed)
            return 0
        for case in CASES:
            if options.only and options.only not in case.__name__:
                continue
            start = time.monotonic()
            case(options.terrane, folder)
            print(f"{case.__name__}: {time.monotonic() - start:.1f} s", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
