# SPDX-License-Identifier: MIT
"""Shared by the tests of the program: running it, and a folder for the files of a test.

A test script is called as SCRIPT PROGRAM [unittest arguments]. It shares no code with the library. Where
TERRANE_COMMAND_SERVER names the program's server, run() takes that: the same main(), without 0.25 s of loading each time.
Rasters are written here, as ESRI ASCII grids, so that no tool is needed; what needs GDAL's programs or
the real data is skipped with a reason where they are absent.
"""

import atexit
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

    def path(self, name):
        return os.path.join(self.folder, name)

    def write_grid(self, name, heights, cell=10.0, nodata=-9999):
        """Heights row by row from the north, as an ESRI ASCII grid."""
        heights = np.asarray(heights, dtype=float)
        with open(self.path(name), "w") as file:
            file.write(f"ncols {heights.shape[1]}\nnrows {heights.shape[0]}\nxllcorner 500000\n"
                       f"yllcorner 4000000\ncellsize {cell}\nNODATA_value {nodata}\n")
            for row in heights:
                file.write(" ".join(f"{value:.3f}" for value in row) + "\n")
        return self.path(name)

    def hills(self, columns=60, rows=45, cell=10.0):
        random = np.random.default_rng(SEED)
        y, x = np.mgrid[0:rows, 0:columns]
        heights = 500 + 40 * np.sin(x / 5.0) * np.cos(y / 7.0) + random.uniform(0, 5, (rows, columns))
        heights = np.round(heights, 3)
        return heights, self.write_grid("hills.asc", heights, cell)


def main():
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
