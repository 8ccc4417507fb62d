# SPDX-License-Identifier: MIT
"""The example plot_terrain.py as a user runs it, with a raster; the programs of docs/python.md.

    example_test.py OUT_DIR
"""
import importlib.util
import pathlib
import re
import subprocess
import sys
import unittest

import numpy as np

import terrane
from grounds import has, hills, write_raster

OUT = pathlib.Path(sys.argv.pop(1))
SOURCE = pathlib.Path(__file__).parents[2]
SCRIPT = SOURCE / "python/examples/plot_terrain.py"


def can_draw():
    if not has("render"):
        return False
    try:
        terrane.Renderer(16, 16).close()
    except RuntimeError:
        return False
    return True


@unittest.skipUnless(has("dem"), "rasters are not built")
@unittest.skipUnless(importlib.util.find_spec("matplotlib"), "matplotlib is not installed")
class Example(unittest.TestCase):
    def test_a_raster_is_plotted_with_its_balls(self):
        OUT.mkdir(parents=True, exist_ok=True)
        y, x = np.mgrid[0:100, 0:120]
        heights = 60 * np.exp(-((x - 60)**2 + (y - 50)**2) / 500) + 8 * np.sin(x / 5) * np.cos(y / 6) + 100
        write_raster(OUT / "hill.asc", heights, 4.0)
        picture = OUT / "terrain.png"
        picture.unlink(missing_ok=True)
        done = subprocess.run([sys.executable, "-B", SCRIPT, "--dem", OUT / "hill.asc", "--out", picture, "--seconds", "0.4",
                               "--side", "380", "--balls", "200"], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, r"^200 balls, 0 steps of a ball too deep")
        from matplotlib.image import imread
        pixels = imread(picture)
        self.assertEqual(pixels.shape, (800, 900, 4))
        shades = np.unique((pixels[100:700, 100:600, :3] * 15).astype(int).reshape(-1, 3), axis=0)
        self.assertGreater(len(shades), 100)  # relief and balls, no blank picture

    def test_a_missing_raster_is_one_line_that_names_it(self):
        done = subprocess.run([sys.executable, "-B", SCRIPT, "--dem", "/nowhere.tif"], capture_output=True, text=True,
                              check=False)
        self.assertNotEqual(done.returncode, 0)
        self.assertTrue(re.search(r"^OSError: .*nowhere\.tif", done.stderr, re.M), done.stderr)


class Scene(unittest.TestCase):
    def test_crates_fall_in_the_pictures_of_a_cottage(self):
        if not can_draw():
            self.skipTest("pictures cannot be drawn")
        OUT.mkdir(parents=True, exist_ok=True)
        done = subprocess.run([sys.executable, "-B", SCRIPT.with_name("draw_scene.py"), "--seconds", "0.5", "--pictures", "2",
                               "--out", OUT / "scene.png"], capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(len(re.findall(r"scene_[01]\.png: \d+ triangles of ground, [1-9]\d+ of objects", done.stdout)), 2)
        first, second = ((OUT / f"scene_{i}.png").read_bytes() for i in (0, 1))
        self.assertNotEqual(first, second)


class Manual(unittest.TestCase):
    def test_the_programs_run(self):
        programs = re.findall(r"^```python\n(.*?)^```", (SOURCE / "docs/python.md").read_text(), re.M | re.S)
        self.assertEqual(len(programs), 4)
        OUT.mkdir(parents=True, exist_ok=True)
        write_raster(OUT / "hills.tif", hills(), 10.0)
        for program in programs:
            if "Renderer" in program and not can_draw():
                continue
            if "distributed" in program and not (has("dem") and has("store") and importlib.util.find_spec("distributed")):
                continue
            # Dask with workers of its own, in place of a scheduler
            program = program.replace('"tcp://head:8786"', "n_workers=1, dashboard_address=None, local_directory='dask'")
            program = program.replace("/data/", str(OUT) + "/")
            program = program.replace("range(1, 301)", "range(1, 31)")  # of its steps, the first
            done = subprocess.run([sys.executable, "-B", "-c", program], capture_output=True, text=True, check=False, cwd=OUT)
            self.assertEqual((done.returncode, done.stderr), (0, ""), program)
            self.assertTrue(done.stdout, program)


unittest.main()
