#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Draws the sheets of the documentation: NAME.jpg in this folder, each a grid of small labelled pictures of one topic.

    sheets.py --terrane build/release/tools/terrane [--data ../shared/data] [--only NAME..] [--out docs/views] [--keep FOLDER]

Each cell is a scene that a function of sheets() writes. With --keep the scenes, and the pictures in full size, stay in a
folder. A cell whose data is absent is grey. Needs Pillow and numpy.
"""
import argparse
import csv
import json
import math
import pathlib
import shutil
import sys
import tempfile

import numpy
from PIL import Image, ImageDraw, ImageFont

sys.dont_write_bytecode = True
from draw import DATA, ROOT  # noqa: E402
from studio import (AVENUE, HIGH, HILL, LYING, MEADOW, SLOPE, VILLAGE, WIDE, Cell, Studio, boxes, rock, torus, write_bricks,  # noqa: E402
                    write_obj)

STRIP = 18  # of a label, pixels
LARGEST = 10_500  # of a cell in a sheet, bytes


# scenes

def near(x, y, z=0.0, **more):
    """A node on the meadow, metres from its middle and above the ground."""
    return {"position": [MEADOW[0] + x, MEADOW[1] + y, z], "on_ground": True, **more}


def fan(distances, azimuth, back):
    """Places on the meadow, spread over the picture of an eye that is so far back of its middle, at distances from the eye."""
    places = []
    for i, distance in enumerate(distances):
        angle = math.radians(azimuth - 32 + 64 * i / (len(distances) - 1))
        places.append((distance * math.sin(angle) - back * math.sin(math.radians(azimuth)),
                       distance * math.cos(angle) - back * math.cos(math.radians(azimuth))))
    return places


def with_nodes(*nodes):
    return {**VILLAGE, "nodes": list(nodes)}


def with_bodies(studio, *bodies):
    """The scene of bodies whose positions are metres from the meadow's middle and above the ground."""
    heights = studio.heights(VILLAGE, [(MEADOW[0] + body["position"][0], MEADOW[1] + body["position"][1]) for body in bodies])
    return {**VILLAGE, "bodies": [
        {**body, "position": [MEADOW[0] + body["position"][0], MEADOW[1] + body["position"][1], z + body["position"][2]]}
        for body, z in zip(bodies, heights)]}


def crate(x, y, z, **more):
    return {"shape": {"box": {"half_extents": [0.5, 0.5, 0.5]}}, "mass": 80, "position": [x, y, z], **more}


def smoke(position, **more):
    return {"position": position, "emitter": {
        "per_s": 9, "life_s": [5, 9], "source_m": 0.15, "velocity": [0, 0, 1.6], "spread_m_s": 0.35, "wind": [1.6, 0.5, 0], "drag_s": 2,
        "acceleration": [0, 0, 0.5], "radius_m": [0.25, 1.9], "colour": [[0.62, 0.62, 0.63, 0.45], [0.82, 0.82, 0.83, 0]], **more}}


def pines(**more):
    return {"scatter": {"mesh": "pine.obj", "per_km2": 4000, "slope_deg": [0, 32], "scale": [0.7, 1.6], "seed": 1, **more}}


def boulders(**more):
    return {"scatter": {"mesh": "boulder.obj", "per_km2": 2500, "slope_deg": [8, 45], "scale": [0.5, 2.5], "seed": 2, **more}}


def surface(studio):
    """Crates in a row on a slope: those on the left are on ice, and have slid."""
    x, y = SLOPE
    places = [(x + 0.6 * k, y + 1.7 * k) for k in range(-4, 4)]
    bodies = [crate(px, py, z + 0.8) for (px, py), z in zip(places, studio.heights(VILLAGE, places))]
    scene = {**VILLAGE, "bodies": bodies, "surface": [{"rect": [x - 100, y - 1, x + 100, y + 100], "friction": 0.1}]}
    return Cell("surface: ice on the left", studio.settle(scene, 1.8), at=SLOPE, height=-1, distance=19, azimuth=109, pitch=-5)


# sheets: functions of the studio that return cells

def keys(studio):
    """The keys of a scene."""
    ridge = {"at": (5200.0, -9000.0), "height": 0, "distance": 90.0, "azimuth": 320, "pitch": -16}
    far = {"at": (4000.0, -4000.0), "height": 0, "distance": 2600.0, "azimuth": 330, "pitch": -16, "shadows": 4000}
    fractal = {"at": (0.0, 0.0), "height": 0, "distance": 2600.0, "azimuth": 330, "pitch": -16, "shadows": 4000}
    bodies = with_bodies(studio, crate(-3.2, 0, 0.8), crate(-2, 0.1, 0.8), crate(-2.6, 0, 2.2),
                         {"shape": {"sphere": {"radius": 0.6}}, "position": [0.4, 0, 0.9], "friction": 0.9},
                         {"shape": {"capsule": {"radius": 0.35, "half_height": 0.7}}, "position": [2.2, 0, 0.6], "rotation": LYING})
    tunnel = {"op": "remove", "shape": {"tube": {"path": [[-135, 0, 0], [135, 0, 0]], "radius": 5}}, "position": [7610, -11880, 425],
              "voxel_m": 0.5}
    return [
        Cell("dem", {"dem": "jacksboro.tif"}, **ridge),
        Cell("dem, seed, detail_m", {"dem": "jacksboro.tif", "seed": 7, "detail_m": 0.25}, **ridge),
        Cell("seed", {"seed": 11}, **fractal),
        Cell("fractal", {"seed": 11, "fractal": "ridged"}, **fractal),
        Cell("bodies", studio.settle(bodies, 3), distance=8, height=0.6, azimuth=10),
        surface(studio),
        Cell("volumes", {"dem": "jacksboro.tif", "seed": 7, "volumes": [tunnel]}, at=(7490.0, -11880.0), height=6, distance=24,
             azimuth=80, pitch=6),
        Cell("objects", {"dem": "jacksboro.tif", "seed": 7, "detail_m": 1, "objects": [pines(), boulders()]}, at=HILL, height=4,
             distance=60, azimuth=10, pitch=-12),
        Cell("nodes", with_nodes(near(0, 0, children=[{"mesh": "house.obj"}, smoke([3.0, 1.05, 8.2])])), height=4, distance=24, azimuth=35,
             pitch=-10, time=20),
        Cell("imagery", {
            "dem": str(studio.data / "imagery/olinda_dem_utm25s_90m.tif"), "water": {"level_m": 0},
            "imagery": {"file": str(studio.data / "imagery/landsat7_olinda_28m.tif"), "bands": [3, 2, 1], "percentiles": [1, 99]}},
            at=(0.0, 0.0), height=0, distance=4500, azimuth=30, pitch=-20, shadows=4000, needs="imagery/landsat7_olinda_28m.tif"),
        Cell("materials", {"dem": "jacksboro.tif", "seed": 7, "detail_m": 1, "materials": {"palette": "desert"}}, **far),
        Cell("water", {"seed": 11, "water": {"level_m": 20}}, **fractal),
    ]


def volumes(studio):
    """Operations and shapes of volumes, on a meadow."""
    write_obj(studio.folder / "ring.obj", *torus(5, 1.5, 48, 24))
    (z,) = studio.heights(VILLAGE, [MEADOW])

    def cell(label, *operations, **camera):
        scene = {**VILLAGE, "detail_m": 0.25, "volumes": [
            {"op": op, "shape": shape, "position": [MEADOW[0] + x, MEADOW[1] + y, z + up], "voxel_m": 0.25, **more}
            for op, shape, (x, y, up), more in operations]}
        return Cell(label, scene, **{"height": 1, "distance": 24, "azimuth": 20, "pitch": -24, **camera})

    steep = [math.cos(math.radians(30)), 0, math.sin(math.radians(30)), 0]
    return [
        cell("remove: sphere", ("remove", {"sphere": {"radius": 5}}, (0, 0, 1), {})),
        cell("remove: box", ("remove", {"box": {"half_extents": [6, 3, 2]}}, (0, 0, -1), {})),
        cell("remove: capsule, rotation", ("remove", {"capsule": {"radius": 2.5, "half_height": 12}}, (-8.7, 0, -5), {"rotation": steep}),
             azimuth=300, distance=18),
        cell("remove: tube", ("remove", {"tube": {"path": [[-12, -4, 0], [-4, 3, -1], [4, -3, -1], [12, 4, 0]], "radius": 1.6}}, (0, 0, -0.5), {})),
        cell("add: hull", ("add", {"hull": {"points": [[-5, -4, -2], [5, -4, -2], [5, 4, -2], [-5, 4, -2], [-2, -1, 5], [2, -1, 5], [0, 2, 6]]}},
                           (0, 0, 0), {}), height=2),
        cell("add: tube", ("add", {"tube": {"path": [[9 * math.cos(math.pi * i / 16), 0, 7 * math.sin(math.pi * i / 16)] for i in range(17)],
                                            "radius": 1.2}}, (0, 0, -1), {}), height=3, pitch=-12),
        cell("add: mesh", ("add", {"mesh": "ring.obj"}, (0, 0, 2.5), {"rotation": [0.8, 0.6, 0, 0]}), height=2, pitch=-16, distance=20),
        cell("add, then remove", ("add", {"box": {"half_extents": [6, 4, 4]}}, (0, 0, 0), {}),
             ("remove", {"capsule": {"radius": 2, "half_height": 8}}, (0, 0, 1.5), {"rotation": LYING}),
             ("remove", {"sphere": {"radius": 3}}, (5, -3.5, 4), {}), height=2, distance=22, azimuth=25),
    ]


def objects(studio):
    """Objects, placed and scattered."""
    avenue = {"height": 4, "distance": 20, "azimuth": 25, "pitch": -4}
    places = fan(AVENUE, 25, 20)
    wood = {"dem": "jacksboro.tif", "seed": 7, "detail_m": 1}
    slope = {"at": HILL, "height": 4, "distance": 240, "azimuth": 10, "pitch": -16, "shadows": 800}
    write_bricks(studio.folder)
    write_obj(studio.folder / "ball.obj", *rock(2), colour=(0.55, 0.5, 0.45))
    (z,) = studio.heights(VILLAGE, [MEADOW])

    def at(x, y, up=0.0):
        return [MEADOW[0] + x, MEADOW[1] + y, z + up]

    steps = [((1.2 * k - 3, -1.5, -1.5), (1.2 * k - 1.8, 1.5, 0.5 + 0.6 * k)) for k in range(5)]
    write_obj(studio.folder / "stairs.obj", *boxes(steps), colour=(0.5, 0.48, 0.45))
    stairs = {"objects": [{"mesh": "stairs.obj", "position": at(0, 0), "static": True, "proxy_error_m": 0.02}]}
    crates = [crate(*at(1.2 * k - 2.4, 0.7 * (-1) ** k, 1.2 + 0.6 * k)) for k in range(5)]
    return [
        Cell("mesh, position", {**VILLAGE, "objects": [{"mesh": "house.obj", "position": at(0, 0)}]}, height=3, distance=20, azimuth=30),
        Cell("rotation, scale", {**VILLAGE, "objects": [
            {"mesh": "cottage.obj", "position": at(10 * k - 10, 0), "scale": 0.6 + 0.4 * k,
             "rotation": [math.cos(0.5 * k), 0, 0, math.sin(0.5 * k)]} for k in range(3)]}, height=2.5, distance=26, azimuth=10),
        Cell("levels", {**VILLAGE, "objects": [
            {"mesh": "linden.obj", "levels": ["linden_far.obj"], "position": [MEADOW[0] + x, MEADOW[1] + y, up]}
            for (x, y), up in zip(places, studio.heights(VILLAGE, [(MEADOW[0] + x, MEADOW[1] + y) for x, y in places]))]}, **avenue),
        Cell("crease_deg: 0, 40, 180", {**VILLAGE, "objects": [
            {"mesh": "ball.obj", "position": at(3.2 * k - 3.2, 0, 0.8), "crease_deg": crease} for k, crease in enumerate((0, 40, 180))]},
            height=0.6, distance=9, azimuth=10),
        Cell("textures of the mesh", {**VILLAGE, "objects": [{"mesh": "bricks.obj", "position": at(0, 0)}]}, height=1.2, distance=9, azimuth=25),
        Cell("scatter", {**wood, "objects": [pines(slope_deg=[0, 90])]}, **slope),
        Cell("scatter: slope_deg", {**wood, "objects": [pines(per_km2=9000, slope_deg=[0, 14]), boulders(slope_deg=[18, 45])]}, **slope),
        Cell("static: bodies meet it", studio.settle({**VILLAGE, **stairs, "bodies": crates}, 2), height=1.5, distance=11, azimuth=20),
    ]


def nodes(studio):
    """Nodes of a scene."""
    def solid(key, shape, colour, up):
        return Cell(f"{key}, colour", with_nodes(near(0, 0, up, **{key: shape, "colour": colour})), height=0.9, distance=7, azimuth=20)

    tree = {"switch": {"limits": [40, 80, "always"]}, "children": [
        {"mesh": "linden.obj"}, {"mesh": "linden_far.obj"}, {"sprite": {"image": "linden.png", "size_m": [6.4, 8]}}]}
    red, green, yellow = [0.8, 0.25, 0.2], [0.3, 0.6, 0.3], [0.9, 0.8, 0.3]
    to_right_and_up = {"children": [{"box": {"half_extents": [1.3, 0.15, 0.05]}, "colour": red},
                                    {"position": [1.3, 0, 0], "box": {"half_extents": [0.25, 0.45, 0.05]}, "colour": red},
                                    {"position": [-0.6, 0.7, 0], "box": {"half_extents": [0.12, 0.7, 0.05]}, "colour": green}]}
    sign = {"children": [{"cylinder": {"radius": 0.08, "half_height": 1.4}, "colour": [0.4, 0.35, 0.3]},
                         {"position": [0.1, 0, 0.9], "box": {"half_extents": [0.03, 1, 0.55]}, "colour": yellow},
                         {"position": [0.15, 0, 0.9], "box": {"half_extents": [0.03, 0.7, 0.1]}, "colour": red}]}
    row = [(3.2 * k - 6.4, 0) for k in range(5)]
    return [
        Cell("mesh", with_nodes(near(0, 0, mesh="house.obj")), height=3, distance=20, azimuth=30),
        solid("sphere", {"radius": 1}, [0.85, 0.35, 0.15], 1),
        solid("box", {"half_extents": [1, 0.7, 0.8]}, [0.3, 0.55, 0.8], 0.8),
        solid("capsule", {"radius": 0.6, "half_height": 0.8}, [0.85, 0.75, 0.25], 1.4),
        solid("cylinder", {"radius": 0.8, "half_height": 0.9}, [0.4, 0.7, 0.35], 0.9),
        Cell("children: a mill", with_nodes(mill()), height=5, distance=22, azimuth=12, pitch=-5),
        Cell("switch: three levels by distance", with_nodes(*(near(x, y, **tree) for x, y in fan(AVENUE, 25, 20))), height=4,
             distance=20, azimuth=25, pitch=-4),
        Cell("sprite", with_nodes(*(near(6 * k - 12, 3 * (k % 2), sprite={"image": "linden.png", "size_m": [6.4, 8]}) for k in range(5))),
             height=4, distance=24, azimuth=0, pitch=-5),
        Cell("billboard: screen", with_nodes(*(near(x, y, 1.4, billboard="screen", **to_right_and_up) for x, y in row)), height=1.2, distance=9,
             azimuth=0, pitch=-40),
        Cell("billboard: up", with_nodes(*(near(x, y, 1.3, billboard="up", **sign) for x, y in row)), height=1.2, distance=8, azimuth=0,
             pitch=-14),
        Cell("emitter: smoke", with_nodes(near(0, 0, children=[{"mesh": "cottage.obj"}, smoke([2.4, 1.05, 6.2])])), height=5,
             distance=20, azimuth=30, pitch=-4, time=20),
        Cell("emitter: a fountain", with_nodes(
            near(0, 0, 0.3, cylinder={"radius": 2.2, "half_height": 0.35}, colour=[0.5, 0.5, 0.5]),
            near(0, 0, 0.9, emitter={"per_s": 700, "life_s": [1.5, 1.7], "source_m": 0.05, "velocity": [0, 0, 8.2], "spread_m_s": 0.8,
                                     "drag_s": 20, "acceleration": [0, 0, -9.8], "radius_m": [0.05, 0.12], "most": 4000,
                                     "colour": [[0.8, 0.88, 0.95, 0.7], [0.9, 0.95, 1, 0.25]]})), height=2, distance=11, azimuth=30, pitch=-8,
            time=20),
    ]


def mill():
    wood, white = [0.35, 0.24, 0.16], [0.85, 0.84, 0.8]
    sails = [{"rotation": [math.cos(math.pi / 4 * k + 0.2), 0, math.sin(math.pi / 4 * k + 0.2), 0], "children": [
        {"position": [0, 0, 2.6], "box": {"half_extents": [0.08, 0.08, 2.4]}, "colour": wood},
        {"position": [0.5, 0, 3.2], "box": {"half_extents": [0.45, 0.03, 1.7]}, "colour": white}]} for k in range(4)]
    return near(0, 0, children=[
        {"position": [0, 0, 2.5], "cylinder": {"radius": 1.8, "half_height": 4}, "colour": [0.7, 0.62, 0.52]},
        {"position": [0, 0, 6.5], "sphere": {"radius": 1.8}, "colour": wood},
        {"position": [0, -2.1, 6.6], "children": sails}])


def bodies(studio):
    """Shapes of bodies, and what moves by itself."""
    write_obj(studio.folder / "ring.obj", *torus(0.8, 0.3, 36, 18), colour=(0.7, 0.6, 0.4))
    close = {"distance": 6, "height": 0.5, "azimuth": 20}

    def cell(label, *shapes, seconds=3.0, **more):
        scene = with_bodies(studio, *({"mass": 50, **shape} for shape in shapes))
        return Cell(label, studio.settle(scene, seconds), **{**close, **more})

    def body(shape, x=0.0, z=0.9, **more):
        return {"shape": shape, "position": [x, 0, z], **more}

    gem = [[0.9, 0, 0], [-0.5, 0.8, 0], [-0.5, -0.8, 0], [0.1, 0.1, 0.9], [0, 0, -0.7]]
    hammer = [{"shape": {"box": {"half_extents": [0.3, 0.6, 0.3]}}, "position": [0.9, 0, 0]},
              {"shape": {"capsule": {"radius": 0.14, "half_height": 0.9}}, "rotation": [0.70710678, 0, 0.70710678, 0]}]
    wall = [crate(1.05 * (i - 2 + 0.5 * (row % 2)), 0, 0.55 + 1.01 * row) for row in range(4) for i in range(5 - row % 2)]
    track = ["--path", "straight", "--start-m", f"{MEADOW[0]},{MEADOW[1]}"]
    return [
        cell("sphere, capsule", body({"sphere": {"radius": 0.6}}, -1, friction=0.9),
             body({"capsule": {"radius": 0.4, "half_height": 0.6}}, 1, rotation=LYING)),
        cell("box", crate(-0.6, 0, 0.7), crate(0.6, 0, 0.7), crate(0, 0, 1.9)),
        cell("hull", body({"hull": {"points": gem}}, -1.1), body({"hull": {"points": gem}}, 1.1, rotation=LYING)),
        cell("compound", body({"compound": hammer}, 0.2, rotation=LYING)),
        cell("file: a mesh", body({"file": "boulder.obj", "proxy_error_m": 0.1}, -1.4, 1.3),
             body({"file": "ring.obj", "proxy_error_m": 0.06}, 1.4, 1)),
        cell("a wall, hit by a ball", *(wall + [body({"sphere": {"radius": 0.6}}, 0.2, 1.6, mass=400) | {
            "position": [0.3, -8, 1.6], "velocity": [0, 16, 1.5]}]), seconds=1.0, distance=10, height=1.2, azimuth=35),
        Cell("drive --crates 12", VILLAGE, drive=["drive", *track, "--crates", "12", "--camera-m", "6,2.5", "--camera-deg", "55",
                                                   "--seconds", "2.5"]),
        Cell("drive --vehicle tracked", VILLAGE, drive=["drive", *track, "--vehicle", "tracked", "--camera-m", "7,2", "--camera-deg", "70",
                                                       "--seconds", "2.5"]),
        Cell("drive --vehicle six-wheeler, desert", {**VILLAGE, "materials": {"palette": "desert"}},
             drive=["drive", *track, "--vehicle", "six-wheeler", "--speed", "16", "--camera-m", "8,2", "--camera-deg", "70", "--seconds", "4"]),
        Cell("drive --ruts", VILLAGE, drive=["drive", *track, "--ruts", "--camera-m", "8,3", "--camera-deg", "35", "--seconds", "3"]),
        Cell("walk --crates 12", VILLAGE, drive=["walk", *track, "--crates", "12", "--camera-m", "4,1.2", "--camera-deg", "50", "--seconds", "2"]),
        Cell("drop --count 60 --shape mixed", VILLAGE, drive=["drop", "--start-m", f"{MEADOW[0]},{MEADOW[1]}", "--count", "60", "--shape", "mixed",
                                                              "--seconds", "4"]),
    ]


def materials(studio):
    """Palettes and settings of the ground's materials."""
    hills = {"dem": "jacksboro.tif", "seed": 7, "detail_m": 1}
    view = {"at": (2000.0, -6500.0), "height": 0, "distance": 900.0, "azimuth": 300, "pitch": -10, "shadows": 3000}
    foot = {"at": HILL, "height": 0.0, "distance": 9.0, "azimuth": 40, "pitch": -14}
    palettes = ("alpine", "temperate", "desert", "moon")
    return [
        *(Cell(f"palette: {name}", {**hills, "materials": {"palette": name}}, **view) for name in palettes),
        *(Cell(f"{name}, near", {**hills, "detail_m": 0.25, "materials": {"palette": name}}, **foot) for name in palettes),
        Cell("snow_line_m: 850", {**hills, "materials": {"palette": "alpine", "snow_line_m": 850}}, **view),
        Cell("rock_slope: 0.3", {**hills, "materials": {"palette": "alpine", "rock_slope": 0.3}}, **view),
        Cell("occlusion: 0", {**hills, "materials": {"palette": "alpine", "occlusion": 0}}, **view),
        Cell("--look plain", hills, **view, flags=["--look", "plain"]),
    ]


def heights(studio):
    """Sources of heights."""
    above = {"at": (0.0, 0.0), "height": 0, "distance": 3500.0, "azimuth": 330, "pitch": -22, "shadows": 6000}
    near_dem = {"at": (5200.0, -9000.0), "height": 0, "distance": 120.0, "azimuth": 320, "pitch": -20}
    return [
        *(Cell(f"--seed 3 --fractal {kind}", {"seed": 3, "fractal": kind}, **above, sun="60,25") for kind in ("fbm", "ridged", "hybrid", "warped")),
        Cell("--dem", {"dem": "jacksboro.tif"}, **near_dem, sun="60,25"),
        Cell("--dem --seed 7 --detail-m 0.25", {"dem": "jacksboro.tif", "seed": 7, "detail_m": 0.25}, **near_dem, sun="60,25"),
    ]


def simplify(studio):
    """A rock of 20,480 triangles, and levels of it."""
    write_obj(studio.folder / "rock.obj", *rock(5), colour=(0.55, 0.5, 0.45))
    cells = []
    for share in (1.0, 0.5, 0.1, 0.01):
        count = round(20480 * share)
        level = studio.folder / f"rock_{count}.ply"
        answer = studio.run("simplify", str(studio.folder / "rock.obj"), str(level), "--triangles", str(count), "--json")
        error = json.loads(answer)["error_m"]
        (z,) = studio.heights(VILLAGE, [MEADOW])
        scene = {**VILLAGE, "objects": [{"mesh": level.name, "crease_deg": 0, "position": [*MEADOW, z + 0.8]}]}
        cells.append(Cell(f"{100 * share:g} %: {count} triangles, {1000 * error:.0f} mm", scene, distance=3.8, height=0.7, azimuth=20,
                          flags=["--max-error-px", "0.05"]))
    return cells


def proxies(studio):
    """Meshes, and the shapes that collide in their place."""
    write_obj(studio.folder / "ring.obj", *torus(1.2, 0.4, 48, 24), colour=(0.7, 0.6, 0.4))
    write_obj(studio.folder / "rock.obj", *rock(3), colour=(0.55, 0.5, 0.45))
    write_obj(studio.folder / "chair.obj", *boxes(CHAIR), colour=(0.45, 0.3, 0.2))
    cells = []
    placed = (("rock", 0.15, 0.9, [1, 0, 0, 0]), ("ring", 0.1, 0.9, [0.8, 0.6, 0, 0]), ("chair", 0.02, 0.1, [0.9, 0, 0, 0.43588989]))
    for flags, label in (([], ""), (["--show-proxies"], ", --show-proxies")):
        for name, error, up, turn in placed:
            body = {"shape": {"file": f"{name}.obj", "proxy_error_m": error}, "position": [0, 0, up], "rotation": turn, "type": "static"}
            cells.append(Cell(f"proxy_error_m: {error}{label}", with_bodies(studio, body), distance=3.4 if name == "chair" else 4.4, height=0.9,
                              azimuth=20, flags=flags))
    return cells


# a seat, legs and a back, as one closed mesh each
CHAIR = [((-0.5, -0.5, 0.9), (0.5, 0.5, 1.0)), ((-0.5, -0.5, 0), (-0.4, -0.4, 0.9)), ((0.4, -0.5, 0), (0.5, -0.4, 0.9)),
         ((-0.5, 0.4, 0), (-0.4, 0.5, 0.9)), ((0.4, 0.4, 0), (0.5, 0.5, 0.9)), ((-0.5, 0.4, 1.0), (0.5, 0.5, 2.0))]


def paths(studio):
    """Paths of cameras, as beads."""
    for tone in range(6):
        write_obj(studio.folder / f"bead_{tone}.obj", *rock(1), colour=(0.95, 0.25 + 0.12 * tone, 0.1))
    cells = []
    ground = {"dem": "jacksboro.tif", "seed": 7}
    for name, seconds, speed in (("straight", 60, 200), ("orbit", 120, 200), ("canyon", 60, 110), ("turns", 60, 100)):
        scene = dict(ground)
        out = studio.folder / f"path_{name}"
        studio.run("fly", "--scene", str(studio.write_scene(scene)), "--path", name, "--altitude", "150", "--speed", str(speed), "--seconds",
                   str(seconds), "--fps", "10", "--budget", "2000", "--out", str(out))
        with open(out / "frames.csv", newline="") as lines:
            eyes = numpy.array([[float(row[f"eye_{axis}_m"]) for axis in "xyz"] for row in csv.DictReader(lines)])
        size = float(numpy.ptp(eyes[:, :2], axis=0).max())
        along = numpy.concatenate([[0], numpy.cumsum(numpy.linalg.norm(numpy.diff(eyes, axis=0), axis=1))])
        radius = size / 110
        count = int(numpy.clip(along[-1] / (2.2 * radius), 40, 400))
        beads = [[float(numpy.interp(d, along, eyes[:, k])) for k in range(3)] for d in numpy.linspace(0, along[-1], count)]
        scene["nodes"] = [{"position": bead, "mesh": f"bead_{6 * i // count}.obj", "scale": radius / 1.3} for i, bead in enumerate(beads)]
        middle = (eyes.min(axis=0) + eyes.max(axis=0)) / 2
        cells.append(Cell(f"--path {name}", scene, at=(float(middle[0]), float(middle[1])), height=0, distance=1.15 * size, azimuth=20, pitch=-35,
                          shadows=3 * size))
    return cells


def meshes(studio):
    """Triangles of one view, with three budgets."""
    eye, look = (5200, -9300, 720), (4700, -8000, 480)
    cells = []
    for budget in (1000, 4000, 16000):
        file = studio.folder / f"ground_{budget}.obj"
        error = json.loads(studio.run("mesh", "--dem", str(DATA / "jacksboro.tif"), "--seed", "7", "--eye", ",".join(map(str, eye)), "--look",
                                      ",".join(map(str, look)), "--size", f"{2 * WIDE}x{2 * HIGH}", "--budget", str(budget), "--out", str(file),
                                      "--json"))["error_px"]
        cells.append(Cell(f"--budget {budget}: within {error:.1f} px", {}, picture=lambda studio, file=file: draw_edges(file, eye, look)))
    return cells


def budgets(studio):
    """One view of a forest, with three triangle budgets."""
    forest = json.loads((DATA / "forest.json").read_text())
    return [Cell(f"--budget {budget}", forest, at=HILL, height=4, distance=60, azimuth=10, pitch=-8, shadows=400,
                 flags=["--budget", str(budget)]) for budget in (10000, 30000, 300000)]


def gpu(studio):
    """One view of a forest, with triangles from the CPU and from the device."""
    forest = json.loads((DATA / "forest.json").read_text())
    return [Cell(f"--triangulator {name}", forest, at=HILL, height=4, distance=60, azimuth=10, pitch=-8, shadows=400,
                 flags=["--triangulator", name]) for name in ("cpu", "gpu")]


def lights(studio):
    """Point lights at night."""
    x, y = MEADOW
    street = [arg for east, north in ((-9, 6), (12, 14)) for arg in ("--light", f"{x + east},{y + north},3.2,60")]
    village = {**VILLAGE, "nodes": [near(-16, 12, children=[{"mesh": "house.obj"}]), near(4, 22, children=[{"mesh": "cottage.obj"}]),
                                    near(20, 8, children=[{"mesh": "linden.obj"}]), near(-4, 3, children=[{"mesh": "linden.obj"}])]}
    view = {"at": (x, y + 10), "height": 1.5, "distance": 34, "azimuth": 5, "pitch": -9, "sun": "330,-9"}
    forest = json.loads((DATA / "forest.json").read_text())
    wood = {"at": HILL, "height": 4, "distance": 60, "azimuth": 10, "pitch": -8, "sun": "60,-8"}
    lamps = [arg for east, north in ((-12, -12), (10, 6)) for arg in ("--light", f"{HILL[0] + east},{HILL[1] + north},5,250")]
    return [Cell("--light X,Y,3.2,60 twice", village, **view, flags=street), Cell("without lights", village, **view),
            Cell("--light X,Y,5,250 twice", forest, **wood, flags=lamps),
            Cell("the same, --look plain", forest, **wood, flags=[*lamps, "--look", "plain"])]


def loop(studio):
    """The truck and the ten balls of examples/simulator_loop.cpp; a path driver stands for its throttle."""
    scene = {"seed": 7}
    places = [(20 + 3 * i, 0) for i in range(10)]
    scene["bodies"] = [{"shape": {"sphere": {"radius": 0.4}}, "mass": 30, "position": [x, y, z + 5]}
                       for (x, y), z in zip(places, studio.heights(scene, places))]
    return [Cell(f"{seconds} s", scene, drive=[
        "drive", "--vehicle", "truck", "--path", "straight", "--start-m", "0,0", "--speed", "12", "--camera-m", "12,6", "--seconds",
        str(seconds)]) for seconds in (0.5, 1.5, 5.0)]


def arrays(studio):
    """The arrays of the second program of python.md, of 300 x 300 heights."""
    step = 180 / 299
    places = [(-90 + step * i, -90 + step * j) for j in range(300) for i in range(300)]
    answers = studio.ask({"seed": 7}, [{"op": "height", "x": x, "y": y} for x, y in places])
    shape = (300, 300)
    height = numpy.array([answer["height"] for answer in answers]).reshape(shape)
    normal = numpy.array([answer["normal"] for answer in answers]).reshape(*shape, 3)
    error = numpy.array([answer["error_m"] for answer in answers]).reshape(shape)
    light = numpy.clip(normal @ numpy.array((-0.6, 0.5, 0.62)), 0, 1)

    def cell(label, values, name, stops):
        low, high = float(values.min()), float(values.max())
        colours = ramp((values - low) / (high - low), stops)
        return Cell(label, {}, picture=lambda studio: draw_array(colours, stops, f"{low:.3g}{name}", f"{high:.3g}{name}"))

    return [cell("answer.height", height, " m", GROUND), cell("answer.normal, as light from the north-west", light, "", GREY),
            cell("answer.error_m", error, " m", RANGE)]


GREY = ((20, 20, 24), (240, 240, 236))
GROUND = ((52, 84, 62), (122, 140, 84), (190, 172, 122), (158, 122, 92), (236, 232, 226))
RANGE = ((255, 236, 150), (122, 209, 81), (34, 160, 134), (49, 104, 142), (84, 60, 140))


def ramp(shares, stops):
    """Colours of shares from 0 to 1."""
    at = numpy.linspace(0, 1, len(stops))
    return numpy.stack([numpy.interp(shares, at, [stop[k] for stop in stops]) for k in range(3)], axis=-1).astype(numpy.uint8)


def draw_array(colours, stops, low, high):
    """An array as a square, row 0 below, with the scale of its colours."""
    picture = Image.new("RGB", (2 * WIDE, 2 * HIGH), (24, 26, 30))
    side = 2 * HIGH - 20
    picture.paste(Image.fromarray(colours[::-1]).resize((side, side), Image.LANCZOS), (100, 10))
    scale = ramp(numpy.linspace(1, 0, side)[:, None].repeat(24, axis=1), stops)
    picture.paste(Image.fromarray(scale), (100 + side + 24, 10))
    pen = ImageDraw.Draw(picture)
    pen.text((100 + side + 58, 10), high, fill=(235, 235, 235), font=font(22))
    pen.text((100 + side + 58, side - 14), low, fill=(235, 235, 235), font=font(22))
    return picture


def lidar(studio):
    """A scan over a meadow with bodies: the beams of make_lidar_grid(), as rays of `query`."""
    bodies = with_bodies(
        studio, *(crate(*place, 0.8) for place in ((-7, 3), (-5.9, 3.3), (4, 7), (10, -4), (-12, 12))), crate(-6.4, 3.1, 2.2),
        {"shape": {"sphere": {"radius": 1}}, "position": [6, 1, 1.2], "friction": 0.9},
        {"shape": {"box": {"half_extents": [2.4, 1, 0.9]}}, "mass": 1500, "position": [0, 12, 1.3]},
        {"shape": {"box": {"half_extents": [0.3, 5, 1.2]}}, "mass": 3000, "position": [14, 8, 1.5]},
        {"shape": {"capsule": {"radius": 0.4, "half_height": 0.6}}, "position": [-2, 5, 0.9], "type": "static"})
    scene = studio.settle(bodies, 3)
    (z,) = studio.heights(VILLAGE, [MEADOW])
    sensor = numpy.array([*MEADOW, z + 2.0])
    azimuths = -math.pi + 2 * math.pi / 1024 * numpy.arange(1024)
    elevations = -0.5 + 0.02 * numpy.arange(32)
    a, e = (grid.ravel() for grid in numpy.meshgrid(azimuths, elevations))
    directions = numpy.stack([numpy.cos(e) * numpy.cos(a), numpy.cos(e) * numpy.sin(a), numpy.sin(e)], axis=1)
    answers = studio.ask(scene, [{"op": "ray", "from": list(sensor + 0.1 * d), "to": list(sensor + 100 * d)} for d in directions])
    hits = [answer for answer in answers if answer["status"] == "ok"]
    points = numpy.array([answer["point"] for answer in hits])
    on_body = numpy.array([answer["kind"] == "body" for answer in hits])
    ranges = numpy.linalg.norm(points - sensor, axis=1)
    colours = ramp(numpy.clip(numpy.log(ranges / 4) / math.log(25), 0, 1), RANGE)
    colours[on_body] = (255, 110, 60)
    view = Cell("the scene", scene, height=1.0, distance=21, azimuth=10, pitch=-22)
    eye, look = studio.eye(view)
    above = [sensor[0], sensor[1] - 0.5, sensor[2] + 52]
    return [view, Cell("points, by range; bodies red", {}, picture=lambda studio: draw_points(points, colours, sensor, eye, look)),
            Cell("the same from above", {}, picture=lambda studio: draw_points(points, colours, sensor, above, sensor))]


def draw_points(points, colours, sensor, eye, look):
    """Points as discs from far to near, and a white cross at the sensor."""
    wide, high = 4 * WIDE, 4 * HIGH
    picture = Image.new("RGB", (wide, high), (16, 18, 22))
    pen = ImageDraw.Draw(picture)
    seen = to_picture(points, eye, look)
    for i in numpy.argsort(-seen[:, 2]):
        x, y, depth = seen[i]
        if depth > 0.5:
            r = min(6.0, max(2.2, 110 / depth))
            pen.ellipse((x - r, y - r, x + r, y + r), fill=tuple(int(value) for value in colours[i]))
    (x, y, _), = to_picture(sensor[None, :], eye, look)
    for dx, dy in ((14, 0), (0, 14)):
        pen.line((x - dx, y - dy, x + dx, y + dy), fill=(255, 255, 255), width=5)
    return picture


def to_picture(points, eye, look):
    """x and y in a picture of 4 * WIDE x 4 * HIGH pixels, 60 degrees high, and depth."""
    eye = numpy.array(eye, dtype=float)
    ahead = numpy.array(look, dtype=float) - eye
    ahead /= numpy.linalg.norm(ahead)
    right = numpy.cross(ahead, (0, 0, 1))
    right /= numpy.linalg.norm(right)
    seen = (numpy.asarray(points) - eye) @ numpy.array([right, -numpy.cross(right, ahead), ahead]).T
    scale = 2 * HIGH / math.tan(math.radians(30))
    depth = numpy.where(seen[:, 2] > 0.5, seen[:, 2], 1.0)
    return numpy.stack([2 * WIDE + scale * seen[:, 0] / depth, 2 * HIGH + scale * seen[:, 1] / depth, seen[:, 2]], axis=1)


def draw_edges(file, eye, look):
    """The triangles of an .obj file with their edges, from far to near."""
    points, faces = [], []
    for line in file.read_text().splitlines():
        if line.startswith("v "):
            points.append([float(word) for word in line.split()[1:4]])
        elif line.startswith("f "):
            faces.append([int(word.split("/")[0]) - 1 for word in line.split()[1:4]])
    points, faces, eye = numpy.array(points), numpy.array(faces), numpy.array(eye, dtype=float)
    ahead = numpy.array(look, dtype=float) - eye
    ahead /= numpy.linalg.norm(ahead)
    right = numpy.cross(ahead, (0, 0, 1))
    right /= numpy.linalg.norm(right)
    axes = numpy.array([right, -numpy.cross(right, ahead), ahead])
    seen = (points - eye) @ axes.T
    wide, high = 4 * WIDE, 4 * HIGH
    scale = 0.5 * high / math.tan(math.radians(30))
    picture = Image.new("RGB", (wide, high), (200, 215, 232))
    pen = ImageDraw.Draw(picture)
    corners = seen[faces]
    order = numpy.argsort(-corners[:, :, 2].mean(axis=1))
    a, b, c = (points[faces[:, k]] for k in range(3))
    normals = numpy.cross(b - a, c - a)
    light = numpy.clip(normals @ numpy.array((-0.5, 0.4, 0.77)) / numpy.linalg.norm(normals, axis=1), 0, 1)
    for i in order:
        if corners[i, :, 2].min() < 1:
            continue
        flat = [(0.5 * wide + scale * x / z, 0.5 * high + scale * y / z) for x, y, z in corners[i]]
        shade = 0.35 + 0.65 * light[i]
        pen.polygon(flat, fill=tuple(int(shade * value) for value in (168, 176, 132)), outline=(30, 34, 28))
    return picture


def sheets():
    return {"keys": (keys, 4), "volumes": (volumes, 4), "objects": (objects, 4), "nodes": (nodes, 4), "bodies": (bodies, 4),
            "materials": (materials, 4), "heights": (heights, 3), "simplify": (simplify, 4), "proxies": (proxies, 3), "paths": (paths, 4),
            "meshes": (meshes, 3), "budgets": (budgets, 3), "gpu": (gpu, 2), "lights": (lights, 2), "loop": (loop, 3), "arrays": (arrays, 3), "lidar": (lidar, 3)}


def font(size=11):
    try:
        return ImageFont.truetype("DejaVuSans.ttf", size)
    except OSError:
        return ImageFont.load_default()


def write_sheet(labels, pictures, columns, file):
    """A grid of pictures, each with a strip for its label below."""
    sheet = Image.new("RGB", (columns * WIDE, -(-len(pictures) // columns) * (HIGH + STRIP)), (24, 26, 30))
    pen = ImageDraw.Draw(sheet)
    for i, (label, picture) in enumerate(zip(labels, pictures)):
        x, y = i % columns * WIDE, i // columns * (HIGH + STRIP)
        sheet.paste(picture.resize((WIDE - 2, HIGH - 1), Image.LANCZOS), (x + 1, y + 1))
        pen.text((x + 5, y + HIGH + 2), label, fill=(235, 235, 235), font=font())
    for quality in range(88, 50, -3):
        sheet.save(file, quality=quality, optimize=True)
        if file.stat().st_size <= LARGEST * len(pictures):
            break
    return file.stat().st_size


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--terrane", required=True)
    parser.add_argument("--data", type=pathlib.Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "docs" / "views")
    parser.add_argument("--keep", type=pathlib.Path)
    options = parser.parse_args()
    unknown = set(options.only) - set(sheets())
    if unknown:
        parser.error(f"no sheet {', '.join(sorted(unknown))}; known are {', '.join(sheets())}")
    options.out.mkdir(parents=True, exist_ok=True)
    for name, (cells_of, columns) in sheets().items():
        if options.only and name not in options.only:
            continue
        with tempfile.TemporaryDirectory() as temporary:
            folder = pathlib.Path(temporary)
            studio = Studio(options.terrane, options.data.resolve(), folder)
            labels, pictures = [], []
            for cell in cells_of(studio):
                labels.append(cell.label)
                if cell.needs and not (options.data / cell.needs).exists():
                    print(f"{name}: {cell.label}: skipped, {options.data / cell.needs} is absent")
                    pictures.append(Image.new("RGB", (WIDE, HIGH), (90, 90, 90)))
                else:
                    pictures.append(studio.draw(cell))
                if options.keep:
                    options.keep.mkdir(parents=True, exist_ok=True)
                    pictures[-1].save(options.keep / f"{name}_{len(pictures):02}.png")
            size = write_sheet(labels, pictures, columns, options.out / f"{name}.jpg")
            print(f"{name}.jpg: {len(pictures)} pictures, {size} bytes", flush=True)
            if options.keep:
                shutil.copytree(folder, options.keep / name, dirs_exist_ok=True, ignore=shutil.ignore_patterns("*.tif"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
