# SPDX-License-Identifier: MIT
"""What sheets.py draws with: cells, a studio that draws them by the program, and meshes."""
import csv
import dataclasses
import json
import math
import shutil
import subprocess
import sys

import numpy
from PIL import Image, ImageDraw

from draw import DATA, write_track

WIDE, HIGH = 320, 180  # of a cell, pixels; drawn twice as large
VILLAGE = {"dem": "jacksboro.tif", "seed": 7, "detail_m": 0.25}
MEADOW = (2800.0, 200.0)  # a gentle slope
HILL = (7600.0, -11900.0)  # a ridge
SLOPE = (7500.0, -11900.0)  # 25 degrees, down to the west
AVENUE = (15, 22, 34, 55, 90, 150)  # distances of trees, metres
LYING = [0.70710678, 0.70710678, 0, 0]  # a rotation that turns z to -y


@dataclasses.dataclass
class Cell:
    """A scene, and a camera that looks at a target from a distance."""
    label: str
    scene: dict
    at: tuple = MEADOW  # x, y of the target, metres of the world
    height: float = 1.0  # of the target above the ground, metres
    distance: float = 12.0  # of the eye, metres
    azimuth: float = 20.0  # of the view, degrees clockwise from y
    pitch: float = -15.0  # degrees, up
    time: float = 0.0  # seconds after which the picture is taken
    shadows: float = 200.0  # distance, metres
    sun: str = "250,42"  # azimuth and elevation, degrees
    flags: list = dataclasses.field(default_factory=list)
    drive: list = dataclasses.field(default_factory=list)  # a command with flags, which has its own camera
    picture: object = None  # a function of the studio that draws the cell by itself
    needs: str = ""  # file below --data


class Studio:
    """The program, with a folder for scenes and their meshes."""

    def __init__(self, terrane, data, folder):
        self.terrane, self.data, self.folder = terrane, data, folder
        self.count = 0
        for file in DATA.iterdir():
            if file.suffix in (".obj", ".png", ".tif", ".csv"):
                shutil.copy(file, folder)

    def run(self, *command, **more):
        done = subprocess.run([self.terrane, *command], capture_output=True, text=True, **more)
        if done.returncode:
            sys.exit(f"{' '.join(command)}: {done.stderr}")
        return done.stdout

    def write_scene(self, scene):
        self.count += 1
        file = self.folder / f"scene_{self.count:03}.json"
        file.write_text(json.dumps(scene))
        return file

    def ask(self, scene, questions):
        """Answers of `query` about the scene, in the order of the questions."""
        asked = "".join(json.dumps(question) + "\n" for question in questions)
        return [json.loads(line) for line in self.run("query", "--scene", str(self.write_scene(scene)), input=asked).splitlines()]

    def heights(self, scene, places):
        ground = {key: scene[key] for key in ("dem", "seed", "fractal", "detail_m") if key in scene}
        return [answer["height"] for answer in self.ask(ground, [{"op": "height", "x": x, "y": y} for x, y in places])]

    def settle(self, scene, seconds, *flags):
        """The scene with its bodies where they are after some seconds."""
        trace = self.folder / "trace.csv"
        self.run("drop", "--scene", str(self.write_scene(scene)), "--count", "0", "--seconds", str(seconds), "--trace", str(trace), *flags)
        with open(trace, newline="") as lines:
            last = {int(row["body"]): row for row in csv.DictReader(lines)}
        bodies = []
        for i, body in enumerate(scene["bodies"]):
            pose = [float(last[i][key]) for key in ("x", "y", "z", "qw", "qx", "qy", "qz")]
            turn = numpy.array(pose[3:])
            bodies.append({**body, "position": pose[:3], "rotation": list(turn / numpy.linalg.norm(turn))})
            bodies[-1].pop("velocity", None)
        return {**scene, "bodies": bodies}

    def eye(self, cell):
        """Where the camera of a cell is, and where it looks."""
        (z,) = self.heights(cell.scene, [cell.at])
        a, p = math.radians(cell.azimuth), math.radians(cell.pitch)
        ahead = (math.sin(a) * math.cos(p), math.cos(a) * math.cos(p), math.sin(p))
        target = (*cell.at, z + cell.height)
        return [place - cell.distance * step for place, step in zip(target, ahead)], target

    def draw(self, cell):
        if cell.picture:
            return cell.picture(self)
        scene = self.write_scene(cell.scene)
        out = scene.with_suffix("")
        look = [] if "--look" in cell.flags else ["--look", "full"]
        load = [] if cell.drive[:1] == ["drop"] else ["--threads", "0"]
        if load and "--budget" not in cell.flags:
            load += ["--budget", "300000"]
        view = [*look, *load, "--shadows", str(cell.shadows), "--sun-deg", cell.sun, *cell.flags, "--size", f"{2 * WIDE}x{2 * HIGH}",
                "--png", "--out", str(out)]
        if cell.drive:
            self.run(*cell.drive, "--scene", str(scene), "--fps", "10", *view)
        else:
            eye, _ = self.eye(cell)
            track = write_track(scene.with_suffix(".tum"), eye, cell.azimuth, cell.pitch, 1000)
            steps = max(1, math.ceil(cell.time / 10))  # to the picture, the last one
            fps = steps / (cell.time or 0.1)
            self.run("fly", "--scene", str(scene), "--path", str(track), "--fps", f"{fps:.9g}", "--seconds", f"{(steps + 1) / fps:.9g}", *view)
        return Image.open(sorted(out.glob("frame_*.png"))[-1]).convert("RGB")


# meshes

def write_obj(file, points, faces, colour=(0.7, 0.7, 0.7)):
    lines = ["v " + " ".join(f"{value:.5f}" for value in (*point, *colour)) for point in points]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in faces]
    file.write_text("\n".join(lines) + "\n")


def boxes(parts):
    """Points and faces of boxes, each by its low and its high corner."""
    points, faces = [], []
    for low, high in parts:
        first = len(points)
        points += [tuple((low, high)[i >> k & 1][k] for k in range(3)) for i in range(8)]
        faces += [[first + i for i in side] for side in ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))]
    return points, faces


def torus(radius, thickness, around, across):
    points, faces = [], []
    for i in range(around):
        a = 2 * math.pi * i / around
        for k in range(across):
            b = 2 * math.pi * k / across
            r = radius + thickness * math.cos(b)
            points.append((r * math.cos(a), r * math.sin(a), thickness * math.sin(b)))
            j, m = (i + 1) % around, (k + 1) % across
            faces.append((i * across + k, j * across + k, j * across + m, i * across + m))
    return points, faces


def rock(halvings):
    """A ball of 20 * 4^halvings triangles with bumps."""
    g = (1 + math.sqrt(5)) / 2
    points = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g), (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1),
              (-g, 0, -1), (-g, 0, 1)]
    points = [numpy.array(p) / math.sqrt(1 + g * g) for p in points]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4),
             (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(halvings):
        middles, halves = {}, []

        def middle(a, b):
            key = (min(a, b), max(a, b))
            if key not in middles:
                middles[key] = len(points)
                between = points[a] + points[b]
                points.append(between / numpy.linalg.norm(between))
            return middles[key]

        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            halves += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = halves
    p = numpy.array(points)
    bump = numpy.zeros(len(p))
    random = numpy.random.default_rng(4)
    for octave in range(4):
        for _ in range(6):
            wave = random.normal(size=3)
            wave *= 2.5 * 2 ** octave / numpy.linalg.norm(wave)
            bump += 0.055 * 0.55 ** octave * numpy.sin(p @ wave + random.uniform(0, 6))
    return p * (1 + bump)[:, None] * (1.5, 1.2, 1.0), faces


def write_bricks(folder):
    """A wall whose texture comes by its material."""
    picture = Image.new("RGB", (128, 128), (150, 145, 135))
    pen = ImageDraw.Draw(picture)
    random = numpy.random.default_rng(1)
    for row in range(8):
        for column in range(-1, 4):
            x, y, tone = 32 * column + 16 * (row % 2), 16 * row, random.uniform(0.8, 1.1)
            pen.rectangle((x + 1, y + 1, x + 29, y + 13), fill=tuple(int(tone * value) for value in (150, 70, 52)))
    picture.save(folder / "bricks.png")
    (folder / "bricks.mtl").write_text("newmtl bricks\nmap_Kd bricks.png\n")
    points, faces = boxes([((-2, -1, -1), (2, 1, 3))])
    lines = ["mtllib bricks.mtl", "usemtl bricks"] + ["v {} {} {}".format(*point) for point in points]
    for face in faces:
        corners = [points[i] for i in face]
        across = 0 if len({corner[0] for corner in corners}) > 1 else 1
        up = 2 if len({corner[2] for corner in corners}) > 1 else 1
        lines += [f"vt {corner[across] / 2} {corner[up] / 2}" for corner in corners]
        lines.append("f " + " ".join(f"{i + 1}/{k - 4}" for k, i in enumerate(face)))
    (folder / "bricks.obj").write_text("\n".join(lines) + "\n")
