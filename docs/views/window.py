#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Draws the pictures of docs/view.md: the window of `terrane view` with its panels, and a sheet of what it can show.

    window.py --terrane build/release/tools/terrane [--out docs/views] [--sheet window|modes] [--keep FOLDER]

Each picture is a run of the program under an Xvfb of its own, with keys and mouse by xdotool; what the script waits for is
read from --state-log. Needs Xvfb, xdotool, ffmpeg and Pillow.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

from PIL import Image, ImageDraw

sys.dont_write_bytecode = True
from draw import DATA, ROOT  # noqa: E402
from sheets import STRIP, font  # noqa: E402

WIDE, HIGH = 480, 270  # of a cell, pixels
LARGEST = 150_000  # of a picture, bytes
PATIENCE = 240  # seconds for a state
SCREEN = (1400, 900)
HILLS = ["--seed", "7", "--detail-m", "1"]
RIDGE = ["--eye-m", "0,0,60", "--aim-deg", "0,-9"]
HIGH_UP = ["--eye-m", "0,0,900", "--aim-deg", "0,-22"]
VILLAGE = ["--scene", str(DATA / "village.json")]
RASTER = ["--dem", str(DATA / "jacksboro.tif")]
MEADOW = [*RASTER, "--seed", "7", "--detail-m", "0.5", "--start-m", "2790,190"]
# the boxes of the panel that show marks of bodies, over a raster with a CRS
MARKS = {"contacts": (118, 631), "bounds": (204, 631), "needs": (275, 631)}


class Display:
    """An Xvfb."""

    def __init__(self):
        self.server = subprocess.Popen(["Xvfb", "-displayfd", "1", "-screen", "0", "{}x{}x24".format(*SCREEN), "-nolisten", "tcp",
                                        "-noreset"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.name = ":" + self.server.stdout.readline().strip()

    def close(self):
        self.server.terminate()
        self.server.wait()


class Window:
    """A running `terrane view`."""

    def __init__(self, terrane, display, folder, size, *flags):
        self.environment = {**os.environ, "DISPLAY": display.name}
        self.log = folder / "state.log"
        self.log.unlink(missing_ok=True)
        self.size = size
        self.process = subprocess.Popen([terrane, "view", "--size", "{}x{}".format(*size), "--state-log", str(self.log), *flags],
                                        env=self.environment, stdout=subprocess.DEVNULL)
        self.wait("the first frames", lambda s: s["frame"] > 2)
        found = subprocess.run(["xdotool", "search", "--sync", "--onlyvisible", "--name", "terrane"], env=self.environment, check=True,
                               capture_output=True, text=True)
        self.window = found.stdout.split()[0]
        self.tool("windowfocus", "--sync", self.window)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()

    def tool(self, *words):
        subprocess.run(["xdotool", *map(str, words)], env=self.environment, check=True)

    def key(self, *keys):
        for key in keys:
            self.tool("key", key)
            self.frames(1)

    def click(self, x, y):
        """A click that the panels see: moved, pressed and released in different frames."""
        for words in (("mousemove", x, y), ("mousedown", 1), ("mouseup", 1)):
            self.tool(*words)
            self.frames(2)

    def state(self):
        lines = self.log.read_text().split("\n")[:-1] if self.log.exists() else []
        return json.loads(lines[-1]) if lines else None

    def wait(self, what, is_done):
        """Waits for a state; returns it."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            state = self.state()
            if state and is_done(state):
                return state
            if self.process.poll() is not None:
                sys.exit(f"{what}: the view ended with {self.process.returncode}")
            time.sleep(0.02)
        sys.exit(f"{what}: not seen in {PATIENCE} s; the last state is {self.state()}")

    def frames(self, count):
        """Waits until so many frames more were shown, besides the one that may have begun before."""
        last = self.state()["frame"] + count + 1
        return self.wait(f"frame {last}", lambda s: s["frame"] >= last)

    def seconds(self, duration):
        """Waits until the simulation advanced."""
        end = self.state()["time"] + duration
        return self.wait(f"{duration} s", lambda s: s["time"] >= end)

    def resize(self, size):
        self.size = size
        self.tool("windowsize", "--sync", self.window, *size)
        self.wait("the size", lambda s: s["size"] == list(size))

    def picture(self):
        """What the window shows."""
        self.frames(2)
        wide, high = self.size
        raw = subprocess.run(["ffmpeg", "-loglevel", "error", "-f", "x11grab", "-draw_mouse", "0", "-video_size", f"{wide}x{high}", "-i",
                              self.environment["DISPLAY"], "-frames:v", "1", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
                             env=self.environment, check=True, capture_output=True).stdout
        return Image.frombytes("RGB", (wide, high), raw)


class Sheets:
    """Opens windows, and makes pictures of them."""

    def __init__(self, terrane, display, folder):
        self.terrane, self.display, self.folder = terrane, display, folder

    def open(self, size, *flags):
        return Window(self.terrane, self.display, self.folder, size, *flags)

    def colours(self, presses, *flags):
        """The ground in colours, the ones after so many presses of G."""
        with self.open((WIDE, HIGH), *flags, "--no-help") as window:
            window.key(*["g"] * presses)
            window.frames(20)
            return window.picture()

    def wireframe(self):
        with self.open((WIDE, HIGH), *HILLS, *RIDGE, "--no-help", "--budget", "2500") as window:
            window.key("t")
            return window.picture()

    def marks(self):
        """A truck among crates, with their contacts, boxes and needs."""
        with self.open((1280, 720), *MEADOW, "--be", "driver", "--budget", "30000", "--shadows", "60") as window:
            window.wait("the truck", lambda s: not s["waiting"])
            window.tool("keydown", "b")
            for place in MARKS.values():
                before = window.picture()
                window.click(*place)
                window.tool("mousemove", 640, 200)
                if window.picture().getpixel(place) == before.getpixel(place):
                    sys.exit(f"nothing changed at {place}: the panel has another layout")
            window.key("F1", "F1", "F2")
            for x, y in ((480, 640), (800, 640), (440, 560), (840, 560), (520, 690), (760, 690), (480, 640), (800, 640), (500, 600), (790, 590)):
                window.tool("mousemove", x, y)
                window.frames(1)
                window.key("f")
            window.resize((960, 540))
            window.seconds(2.5)
            window.key("space")
            picture = window.picture()
            window.tool("keyup", "b")
            return picture.crop((160, 120, 800, 480))

    def map(self):
        with self.open((720, 405), *HILLS, "--path", "orbit", "--altitude", "60", "--seconds", "60", "--speed", "60", "--no-help",
                       "--budget", "30000") as window:
            window.key("m", "space")
            window.seconds(6)
            window.key("space")
            return window.picture()

    def dig(self):
        with self.open((640, 360), *HILLS, "--eye-m", "0,0,16", "--aim-deg", "0,-32", "--no-help", "--shadows", "60") as window:
            for x, y in ((320, 230), (320, 230), (390, 235), (390, 235), (250, 230), (250, 230)):
                window.tool("mousemove", x, y)
                window.frames(1)
                window.key("x")
                window.wait("a dig", lambda s: s["note"].startswith("dug") and s["waiting_digs"] == 0)
                window.frames(10)
            window.tool("mousemove", 320, 60)
            return window.picture()

    def modes(self):
        """Labels and pictures of the cells."""
        return [("G: levels", self.colours(1, *HILLS, *RIDGE)), ("G: chunks", self.colours(2, *HILLS, *RIDGE)),
                ("G: error, on a raster at its finest spacing", self.colours(3, *RASTER, "--start-m", "7600,-11900")),
                ("G: late, --memory-mb 16", self.colours(4, *HILLS, *HIGH_UP, "--memory-mb", "16")),
                ("T: wireframe, --budget 2500", self.wireframe()), ("contacts, bounds, needs", self.marks()),
                ("M: map, with --path orbit", self.map()), ("X: digs", self.dig())]

    def window(self):
        """The window with first-run help, panel and timeline, in a village."""
        flags = [*VILLAGE, "--path", str(DATA / "village.csv"), "--altitude", "7", "--look", "full", "--budget", "200000"]
        with self.open((1280, 720), *flags) as window:
            window.key("space")
            window.wait("the village", lambda s: s["time"] > 5.0)
            window.key("space")
            window.frames(4)
            return window.picture()


def save(picture, file):
    """At the best quality that is small enough."""
    for quality in range(90, 40, -3):
        picture.save(file, quality=quality, optimize=True)
        if file.stat().st_size <= LARGEST:
            break
    print(f"{file.name}: {picture.width}x{picture.height}, {file.stat().st_size} bytes", flush=True)


def grid(cells, columns=2):
    sheet = Image.new("RGB", (columns * WIDE, -(-len(cells) // columns) * (HIGH + STRIP)), (24, 26, 30))
    pen = ImageDraw.Draw(sheet)
    for i, (label, picture) in enumerate(cells):
        x, y = i % columns * WIDE, i // columns * (HIGH + STRIP)
        sheet.paste(picture.resize((WIDE - 2, HIGH - 1), Image.LANCZOS), (x + 1, y + 1))
        pen.text((x + 5, y + HIGH + 2), label, fill=(235, 235, 235), font=font())
    return sheet


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--terrane", required=True)
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "docs" / "views")
    parser.add_argument("--sheet", choices=["window", "modes"])
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the pictures of the cells, in full size")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    display = Display()
    try:
        with tempfile.TemporaryDirectory() as folder:
            sheets = Sheets(options.terrane, display, pathlib.Path(folder))
            if options.sheet != "modes":
                save(sheets.window(), options.out / "window.jpg")
            if options.sheet != "window":
                cells = sheets.modes()
                if options.keep:
                    options.keep.mkdir(parents=True, exist_ok=True)
                    for i, (_, picture) in enumerate(cells):
                        picture.save(options.keep / f"modes_{i + 1}.png")
                save(grid(cells), options.out / "modes.jpg")
    finally:
        display.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
