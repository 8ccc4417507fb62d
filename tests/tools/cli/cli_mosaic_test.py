#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A mosaic of real rasters, baked on Dask and flown over from nginx as from the folder. Run with the label long."""

import hashlib
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import unittest

os.environ["no_proxy"] = "127.0.0.1"  # before the program's server starts
import nginx
from program import DATA, PROGRAM, Folder, run, run_json

RAINIER = os.path.join(DATA, "dem/srtm3_rainier_1201_voids.tif")
ST_HELENS = os.path.join(DATA, "dem/usgs_sthelens_30m.dem.gz")
MODULE = os.environ.get("PYTHONPATH") or os.path.join(os.path.dirname(PROGRAM), "../python")
FLIGHT = ["--path", "straight", "--speed", 400, "--seconds", 15, "--fps", 4, "--budget", 60_000, "--size", "480x270"]


def missing():
    """Why the tests cannot run; "" if they can."""
    for path in (RAINIER, ST_HELENS):
        if not os.path.exists(path):
            return f"{path} is absent"
    for program in ("gdalwarp", "gdal_translate", "gdalbuildvrt"):
        if not shutil.which(program):
            return f"{program} is not installed"
    if not nginx.NGINX:
        return "nginx is not installed"
    if not importlib.util.find_spec("distributed"):
        return "python3-distributed is not installed"
    if not os.path.isdir(os.path.join(MODULE, "terrane")):
        return "the Python module is not built"
    return ""


@unittest.skipIf(missing(), missing())
class Mosaic(Folder):
    def setUp(self):
        super().setUp()
        self.build_mosaic()
        done = subprocess.run([sys.executable, "-B", "-m", "terrane.bake", self.path("mosaic.vrt"), self.path("store"), "--workers", "2",
                               "--threads", "1", "--detail-m", "40", "--seed", "7", "--json"],
                              env=os.environ | {"PYTHONPATH": MODULE}, capture_output=True, text=True, timeout=1000)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.baked = json.loads(done.stdout)
        self.address = f"http://127.0.0.1:{nginx.serve(self)}/store/"

    def build_mosaic(self):
        """Nine tiles of Mount Rainier at 3", some of half the resolution, and Mount St. Helens from 30 m in UTM of NAD 27."""
        def call(*words):
            subprocess.run([str(word) for word in words], check=True, capture_output=True)

        tiles = []
        for row in range(3):
            for column in range(3):
                size = 401 if max(row, column) == 2 else 400
                window = [400 * column, 400 * row, 401 if column == 2 else 400, 401 if row == 2 else 400]
                tiles.append(self.path(f"rainier_{row}{column}.tif"))
                coarse = ["-outsize", "50%", "50%", "-r", "average"] if (row + column) % 2 and size == 400 else []
                call("gdal_translate", "-q", "-srcwin", *window, *coarse, RAINIER, tiles[-1])
        tiles.append(self.path("helens.tif"))
        call("gdalwarp", "-q", "-t_srs", "EPSG:4326", "-tr", 1 / 1200, 1 / 1200, "-tap", "-r", "bilinear", "-dstnodata", -32768,
             "/vsigzip/" + ST_HELENS, tiles[-1])
        call("gdalbuildvrt", "-q", "-resolution", "highest", "-r", "bilinear", self.path("mosaic.vrt"), *tiles)

    def fly(self, name, *terrain, pictures=()):
        out = self.path(name)
        summary = run_json("fly", *terrain, *FLIGHT, "--threads", 0, *pictures, "--out", out)
        rows = [{key: row[key] for key in ("eye_x_m", "eye_y_m", "eye_z_m", "triangles", "error_px")} for row in self.rows(f"{name}/frames.csv")]
        films = {file: hashlib.sha256(self.read(f"{name}/{file}")).hexdigest() for file in sorted(os.listdir(out)) if file.endswith(".png")}
        return summary, rows, films

    def test_a_film_from_the_server_is_that_of_the_folder(self):
        self.assertGreater(self.baked["shards"], 1)
        pictures = ["--png"] if run("fly", "--seed", 1, "--seconds", 0.1, "--fps", 10, "--png", "--out", self.path("probe"),
                                    "--size", "64x64").returncode == 0 else []
        cache = ["--http-cache", self.path("cache")]
        local, rows, film = self.fly("local", "--dem", self.path("store"), pictures=pictures)
        self.assertEqual(len(rows), 60)
        self.assertEqual(len(film), 60 if pictures else 0)
        self.assertEqual(len(set(film.values())), len(film))  # the camera moves
        for name in ("cold", "warm"):
            remote, remote_rows, remote_film = self.fly(name, "--dem", self.address, *cache, pictures=pictures)
            self.assertEqual(remote_rows, rows)
            self.assertEqual(remote_film, film)
            self.assertEqual(remote["http"]["failures"], {})
            print(name, len(rows), "frames,", len(film), "pictures,", local["chunks_loaded"], "chunks,", remote["http"])
        self.assertEqual(remote["http"]["requests"], 1)  # terrain.json

    def test_meshes_of_the_server_are_those_of_the_folder(self):
        for i, place in enumerate(("0,0,6000", "20000,9000,5000", "-40000,-20000,6000")):
            files = []
            for terrain in (["--dem", self.path("store")], ["--dem", self.address, "--http-cache", "off"]):
                run_json("mesh", *terrain, f"--eye={place}", "--look=0,5000,1500", "--budget", 80_000, "--out", self.path("view.ply"))
                files.append(self.read("view.ply"))
            self.assertGreater(len(files[0]), 100_000, place)
            self.assertEqual(files[0], files[1], place)


if __name__ == "__main__":
    result = unittest.main(argv=[sys.argv[0], *sys.argv[2:]], exit=False).result
    if result.testsRun == len(result.skipped):
        sys.exit(77)
    sys.exit(0 if result.wasSuccessful() else 1)
