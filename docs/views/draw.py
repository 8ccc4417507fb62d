#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Draws the reference views: twelve pictures of the full look, from 2 m above the ground to orbit.

    draw.py --terrane build/release/tools/terrane [--data ../shared/data] [--out out/views] [--only NAME..]
            [--size 960x540] [--sheet FILE] [--measure]

Writes NAME.png for each view, and prints its median time of drawing; --sheet also writes all of them as one picture. A view whose data is absent is skipped with the
reason. With --measure it also prints the picture's energy at wavelengths of 1 to 8 pixels near the camera and in the
middle distance: the standard deviation of the brightness without its mean over 8 pixels, over the mean brightness.
"""
import argparse
import csv
import dataclasses
import json
import math
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = ROOT / "tools" / "data"
FRAMES = 3  # of which the last one is kept, so that its time is that of a running flight
LIGHT = ["--look", "full"]


@dataclasses.dataclass
class View:
    """A camera over a terrain."""
    name: str
    terrain: list  # flags
    place: tuple  # x, y, metres of the world
    height: float  # of the eye above the ground, metres; above 0 m if is_altitude
    azimuth: float  # of the view, degrees clockwise from y
    pitch: float  # degrees, up
    flags: list = dataclasses.field(default_factory=list)
    is_altitude: bool = False
    needs: str = ""  # file below --data
    has_foreground: bool = False  # whether ground is near at the lower edge and far in the middle
    drive: list = dataclasses.field(default_factory=list)  # flags of a drive from the place, instead of a still camera


def find_views(data):
    jacksboro = ["--dem", str(DATA / "jacksboro.tif"), "--seed", "7", "--detail-m", "0.25"]
    shore = ["--seed", "11", "--water-m", "20"]
    return [
        View("near", jacksboro, (7600, -11900), 2.0, 40, -14, ["--shadows", "300"], has_foreground=True),
        View("middle", jacksboro, (5200, -9000), 60.0, 320, -10, ["--shadows", "2000"]),
        View("far", jacksboro, (0, 0), 700.0, 220, -8, ["--shadows", "8000"]),
        View("cliff", ["--dem", f"{data}/dem/sthelens_10m.vrt", "--seed", "3", "--detail-m", "1"], (700, 1000), 40.0, 195, 4,
             ["--shadows", "3000"], needs="dem/sthelens_10m.vrt"),
        View("shore", shore, (0, 0), 3.0, 60, -6, ["--shadows", "400", "--sun-deg", "100,24"], has_foreground=True),
        View("forest", ["--scene", str(DATA / "forest.json")], (7600, -11900), 12.0, 10, -8, ["--shadows", "400"]),
        View("cave", ["--scene", str(DATA / "cave.json")], (7618, -11846), 425.0, 205, -4, ["--shadows", "200"], is_altitude=True),
        View("evening", jacksboro, (2600, 150), 40.0, 250, -3, ["--shadows", "3000", "--sun-deg", "285,6"]),
        View("imagery", [], (0, 0), 900.0, 30, -18, ["--shadows", "4000"], needs="imagery/landsat7_olinda_28m.tif"),
        View("village", ["--scene", str(DATA / "village.json")], (2716, 198), 4.5, 84, -3, ["--shadows", "400"]),
        View("wheel", jacksboro[:4], (7600, -11900), 0, 0, 0, ["--shadows", "60", "--detail-m", "0.5"],
             drive=["--vehicle", "truck", "--camera-m", "4,0", "--camera-deg", "75", "--crates", "12", "--path", "straight"]),
        View("orbit", ["--dem", f"{data}/dem/srtm3_sierra_nevada_3601x2401.tif"], (-30000, -90000), 60000.0, 20, -24, [],
             is_altitude=True, needs="dem/srtm3_sierra_nevada_3601x2401.tif"),
    ]


def imagery_scene(data, folder):
    """Olinda's satellite image over its heights."""
    scene = folder / "imagery.json"
    scene.write_text(json.dumps({
        "dem": str(data / "imagery/olinda_dem_utm25s_90m.tif"),
        "imagery": {"file": str(data / "imagery/landsat7_olinda_28m.tif"), "bands": [3, 2, 1], "percentiles": [1, 99]},
        "water": {"level_m": 0}}))
    return ["--scene", str(scene)]


def quaternion(azimuth, pitch):
    """x, y, z, w: from camera axes, x right, y down and z ahead, to the world's."""
    a, p = math.radians(azimuth), math.radians(pitch)
    ahead = (math.sin(a) * math.cos(p), math.cos(a) * math.cos(p), math.sin(p))
    right = (math.cos(a), -math.sin(a), 0.0)
    down = (ahead[1] * right[2] - ahead[2] * right[1], ahead[2] * right[0] - ahead[0] * right[2],
            ahead[0] * right[1] - ahead[1] * right[0])
    m = list(zip(right, down, ahead))  # columns are the axes
    w = 0.5 * math.sqrt(max(0.0, 1 + m[0][0] + m[1][1] + m[2][2]))
    if w > 1e-3:
        return ((m[2][1] - m[1][2]) / (4 * w), (m[0][2] - m[2][0]) / (4 * w), (m[1][0] - m[0][1]) / (4 * w), w)
    x = 0.5 * math.sqrt(max(0.0, 1 + m[0][0] - m[1][1] - m[2][2]))
    y = math.copysign(0.5 * math.sqrt(max(0.0, 1 - m[0][0] + m[1][1] - m[2][2])), m[0][1] + m[1][0])
    z = math.copysign(0.5 * math.sqrt(max(0.0, 1 - m[0][0] - m[1][1] + m[2][2])), m[0][2] + m[2][0])
    return (x, y, z, w)


def write_track(file, eye, azimuth, pitch, seconds):
    """A still camera, as a track."""
    pose = " ".join(f"{value:.9f}" for value in (*eye, *quaternion(azimuth, pitch)))
    file.write_text(f"0 {pose}\n{seconds} {pose}\n")
    return file


def ground_height(terrane, terrain, place):
    question = json.dumps({"id": 1, "op": "height", "x": place[0], "y": place[1]})
    done = subprocess.run([terrane, "query", *terrain], input=question + "\n", capture_output=True, text=True, check=True)
    answer = json.loads(done.stdout)
    if answer["status"] != "ok":
        sys.exit(f"no ground at {place}: {answer}")
    return answer["height"]


def draw(view, options, folder):
    """Milliseconds of drawing; the picture is written to --out."""
    terrain = view.terrain or imagery_scene(options.data, folder)
    flags = [flag for flag in terrain if flag not in ("--water-m", "20")]
    out = folder / view.name
    if view.drive:
        return play(view, options, out, ["drive", *terrain, *view.drive, "--start-m", f"{view.place[0]},{view.place[1]}"], 25)
    z = view.height + (0.0 if view.is_altitude else ground_height(options.terrane, flags, view.place))
    if "--water-m" in terrain:
        z = max(z, float(terrain[terrain.index("--water-m") + 1]) + view.height)
    track = write_track(folder / f"{view.name}.tum", (*view.place, z), view.azimuth, view.pitch, 1)
    return play(view, options, out, ["fly", *terrain, "--path", str(track)], FRAMES)


def play(view, options, out, command, frames):
    subprocess.run([options.terrane, *command, *LIGHT, *view.flags, "--size", options.size, "--fps", "10", "--seconds",
                    str(frames / 10), "--threads", "0", "--budget", "200000", "--png", "--out", str(out), "--json"],
                   check=True, stdout=subprocess.DEVNULL)
    frames = sorted(out.glob("frame_*.png"))
    shutil.copy(frames[-1], options.out / f"{view.name}.png")
    with open(out / "frames.csv", newline="") as lines:
        return statistics.median(float(row["draw_ms"]) for row in csv.DictReader(lines))


def energy(picture, rows):
    """The share of the brightness that changes within 8 pixels, in some rows of a picture."""
    import numpy
    grey = picture[rows[0]:rows[1]].mean(axis=2)
    tiles = grey[:grey.shape[0] // 8 * 8, :grey.shape[1] // 8 * 8].reshape(grey.shape[0] // 8, 8, grey.shape[1] // 8, 8)
    rest = tiles - tiles.mean(axis=(1, 3), keepdims=True)
    return float(numpy.sqrt((rest ** 2).mean()) / grey.mean())


def write_sheet(pictures, file):
    """Three pictures a row, each 480 pixels wide; a view that was skipped stays black."""
    from PIL import Image
    wide, high, columns = 480, 270, 3
    sheet = Image.new("RGB", (columns * wide, -(-len(pictures) // columns) * high))
    for i, picture in enumerate(pictures):
        if picture.exists():
            small = Image.open(picture).convert("RGB").resize((wide, high), Image.LANCZOS)
            sheet.paste(small, (i % columns * wide, i // columns * high))
    sheet.save(file, quality=88)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--terrane", required=True)
    parser.add_argument("--data", type=pathlib.Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "out" / "views")
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--size", default="960x540")
    parser.add_argument("--sheet", type=pathlib.Path)
    parser.add_argument("--measure", action="store_true")
    options = parser.parse_args()
    options.data = options.data.resolve()  # scenes in other folders name its files
    options.out.mkdir(parents=True, exist_ok=True)
    views = find_views(options.data)
    unknown = set(options.only) - {view.name for view in views}
    if unknown:
        parser.error(f"no view {', '.join(sorted(unknown))}; known are {', '.join(view.name for view in views)}")
    with tempfile.TemporaryDirectory() as name:
        for view in views:
            if options.only and view.name not in options.only:
                continue
            if view.needs and not (options.data / view.needs).exists():
                print(f"{view.name}: skipped, {options.data / view.needs} is absent")
                continue
            line = f"{view.name}: {draw(view, options, pathlib.Path(name)):.0f} ms"
            if options.measure and view.has_foreground:
                from matplotlib import image
                picture = image.imread(options.out / f"{view.name}.png")[:, :, :3]
                side = picture.shape[0]
                near = energy(picture, (int(0.80 * side), side))
                middle = energy(picture, (int(0.45 * side), int(0.65 * side)))
                line += f", energy {near:.3f} near, {middle:.3f} in the middle distance"
            print(line, flush=True)
    if options.sheet:
        write_sheet([options.out / f"{view.name}.png" for view in views], options.sheet)
    return 0


if __name__ == "__main__":
    sys.exit(main())
