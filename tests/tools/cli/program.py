# SPDX-License-Identifier: MIT
"""Shared by the tests of the program: running it, and a folder for the files of a test.

A test script is called as SCRIPT PROGRAM [unittest arguments]. It shares no code with the library. Where
TERRANE_COMMAND_SERVER names the program's server, run() takes that: the same main(), without 0.25 s of loading each time.
Rasters are written here, as ESRI ASCII grids, so that no tool is needed; what needs GDAL's programs or
the real data is skipped with a reason where they are absent.
"""

import atexit
import csv
import json
import os
import pathlib
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest

try:
    import numpy as np
except ImportError:
    print("skipped: no numpy for", sys.executable)
    sys.exit(77)

PROGRAM = os.path.abspath(sys.argv[1]) if len(sys.argv) > 1 else "terrane"
ROOT = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", ".."))
DATA = os.environ.get("TERRANE_DATA", os.path.join(ROOT, "..", "shared", "data"))
SEED = 20240501
# A world that opens in a fifth of the time of a seed's endless one.
SMALL_WORLD = ["--seed", 1, "--world-m", 4096, "--detail-m", 16]

# Each test has its own cache folder.
_CACHE = tempfile.mkdtemp(prefix="terrane_cache_")
atexit.register(shutil.rmtree, _CACHE, ignore_errors=True)
os.environ["XDG_CACHE_HOME"] = _CACHE


class Server:
    """Runs command lines by command_server.cpp, the program loaded once."""

    def __init__(self):
        self.folder = tempfile.mkdtemp(prefix="terrane_server_")
        atexit.register(shutil.rmtree, self.folder, ignore_errors=True)
        self.files = [os.path.join(self.folder, name) for name in ("in", "out", "err")]
        self.process = subprocess.Popen([os.environ["TERRANE_COMMAND_SERVER"]], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, start_new_session=True)
        atexit.register(self.process.communicate)

    def run(self, words, stdin, timeout):
        with open(self.files[0], "w") as file:
            file.write(stdin or "")
        words = [*self.files, *words]
        self.process.stdin.write("".join(word + "\0" for word in [str(len(words)), *words]).encode())
        self.process.stdin.flush()
        if not select.select([self.process.stdout], [], [], timeout)[0]:
            os.killpg(self.process.pid, signal.SIGKILL)
            raise subprocess.TimeoutExpired(words, timeout)
        code = int(self.process.stdout.readline())
        out, error = (pathlib.Path(name).read_text() for name in self.files[1:])
        return subprocess.CompletedProcess(words, code, out, error)


_SERVER = Server() if "TERRANE_COMMAND_SERVER" in os.environ else None


def run(*arguments, stdin=None, timeout=120, alone=False):
    """What a command line does. `alone`: in the program itself."""
    words = [PROGRAM, *map(str, arguments)]
    if _SERVER and not alone:
        return _SERVER.run(words, stdin, timeout)
    return subprocess.run(words, input=stdin, capture_output=True, text=True, timeout=timeout)


def start(*arguments, **options):
    """A running program."""
    return subprocess.Popen([PROGRAM, *map(str, arguments)], stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True, **options)


def run_json(*arguments):
    done = run(*arguments, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def ask(terrain, questions, *arguments):
    text = "".join((q if isinstance(q, str) else json.dumps(q)) + "\n" for q in questions)
    done = run("query", *terrain, *arguments, stdin=text)
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def read_obj(path):
    """Vertices and triangles of an OBJ file, polygons as fans."""
    vertices, faces = [], []
    with open(path) as file:
        for line in file:
            kind, *rest = line.split() or ["#"]
            if kind == "v":
                vertices.append([float(value) for value in rest[:3]])
            elif kind == "f":
                corners = [int(value.split("/")[0]) - 1 for value in rest]
                faces += [[corners[0], *pair] for pair in zip(corners[1:], corners[2:])]
    return np.array(vertices), np.array(faces)


class Folder(unittest.TestCase):
    """A test with a folder for its files."""

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="terrane_cli_")
        self.addCleanup(shutil.rmtree, self.folder)

    def assert_refused(self, done, codes, *words):
        """One line on standard error that holds the words, nothing on standard output, one of the exit codes."""
        self.assertIn(done.returncode, codes, done.stderr + done.stdout)
        lines = done.stderr.splitlines()
        self.assertEqual(len(lines), 1, done.stderr)
        self.assertTrue(lines[0].startswith("terrane: "), lines[0])
        for word in words:
            self.assertIn(str(word), lines[0])
        self.assertEqual(done.stdout, "")

    def assert_all_refused(self, cases, codes):
        """Pairs of a command line and words of its refusal; the test's folder stays as it is."""
        before = sorted(os.listdir(self.folder))
        for arguments, *words in cases:
            with self.subTest(arguments):
                self.assert_refused(run(*arguments, timeout=60), codes, *words)
                self.assertEqual(sorted(os.listdir(self.folder)), before)

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, content):
        with open(self.path(name), "wb" if isinstance(content, bytes) else "w") as file:
            file.write(content)
        return self.path(name)

    def read(self, name):
        with open(self.path(name), "rb") as file:
            return file.read()

    def rows(self, name="out/frames.csv"):
        """The lines of a table by the names of its columns, as text."""
        with open(self.path(name)) as file:
            return list(csv.DictReader(file))

    def columns(self, name="out/frames.csv"):
        """The columns of a table of numbers; what is no number is NaN."""
        return np.atleast_1d(np.genfromtxt(self.path(name), delimiter=",", names=True))

    def scene(self, **content):
        return self.write("scene.json", json.dumps(content))

    def write_grid(self, name, heights, cell=10.0, nodata=-9999):
        """Heights row by row from the north, as an ESRI ASCII grid."""
        heights = np.asarray(heights, dtype=float)
        lines = [f"ncols {heights.shape[1]}\nnrows {heights.shape[0]}\nxllcorner 500000\n"
                 f"yllcorner 4000000\ncellsize {cell}\nNODATA_value {nodata}"]
        lines += [" ".join(f"{value:.3f}" for value in row) for row in heights]
        return self.write(name, "\n".join(lines) + "\n")

    def flat(self, height=0.0):
        """Level ground of 400 m by 200 m around the origin."""
        return self.write_grid("flat.asc", np.full((40, 80), height), cell=5.0)

    def write_block(self, low=(-2, -1, 0), high=(2, 1, 3)):
        """A closed box as block.obj."""
        corners = [(x, y, z) for z in (low[2], high[2]) for y in (low[1], high[1]) for x in (low[0], high[0])]
        quads = [(1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (2, 4, 8, 6), (4, 3, 7, 8), (3, 1, 5, 7)]
        self.write("block.obj", "".join("v {} {} {}\n".format(*corner) for corner in corners) +
                   "".join("f {} {} {} {}\n".format(*quad) for quad in quads))
        return "block.obj"

    def hills(self, columns=60, rows=45, cell=10.0):
        random = np.random.default_rng(SEED)
        y, x = np.mgrid[0:rows, 0:columns]
        heights = 500 + 40 * np.sin(x / 5.0) * np.cos(y / 7.0) + random.uniform(0, 5, (rows, columns))
        heights = np.round(heights, 3)
        return heights, self.write_grid("hills.asc", heights, cell)


def main():
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
