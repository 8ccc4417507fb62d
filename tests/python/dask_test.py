# SPDX-License-Identifier: MIT
"""terrane.bake: the command and the graph that bake a raster in shards on Dask, beside the function of the same name."""
import hashlib
import importlib.util
import json
import os
import pathlib
import pty
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import types
import unittest
from unittest import mock

import terrane
from grounds import PROGRAM, has, hills, main, small_fractal, write_raster

HAS_DASK = importlib.util.find_spec("distributed") is not None
COMMAND = [sys.executable, "-B", "-m", "terrane.bake"]


def files(folder):
    """Hashes of the files of a folder by their names, without those of killed processes."""
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(pathlib.Path(folder).rglob("*"))
            if path.is_file() and ".partial-" not in path.name}


def children(pid):
    """Numbers of the processes that a process has started."""
    found = []
    for path in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = int(path.read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue  # it has ended
        if parent == pid:
            found.append(int(path.parent.name))
    return found


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        # Children keep to the folder: nothing is left in the user's cache.
        patch = mock.patch.dict(os.environ, {"XDG_CACHE_HOME": self.path("cache")})
        patch.start()
        self.addCleanup(patch.stop)

    def path(self, name):
        return os.path.join(self.folder, name)

    def raster(self, columns=500, rows=150):
        """A raster that has several shards with `DETAIL`."""
        write_raster(self.path("hills.asc"), hills(rows, columns), 10.0)
        return self.path("hills.asc")

    def bake(self, *arguments, **options):
        return subprocess.run([*COMMAND, *map(str, arguments)], capture_output=True, text=True, timeout=200, **options)

    def bake_by_program(self, name, *arguments):
        subprocess.run([PROGRAM, "bake", "--dem", *map(str, arguments), "--sharded", "--out", self.path(name)], check=True,
                       capture_output=True)
        return files(self.path(name))

    def assert_refused(self, done, code, *words):
        self.assertEqual((done.returncode, done.stderr.count("\n"), done.stdout), (code, 1, ""), done.stderr)
        self.assertTrue(done.stderr.startswith("terrane.bake: "), done.stderr)
        for word in words:
            self.assertIn(str(word), done.stderr)


DETAIL = ["--detail-m", 2.5]


@unittest.skipUnless(has("store"), "stores are not built")
class Function(Folder):
    def test_it_bakes_however_the_module_is_imported(self):
        for lines in ("import terrane\nbake = terrane.bake", "import terrane.bake\nbake = terrane.bake",
                      "from terrane import bake", "import terrane.bake\nfrom terrane import bake",
                      "from terrane import bake as first\nimport terrane.bake\nfirst(ground, 'first')\nbake = terrane.bake",
                      "from terrane import *\nimport terrane.bake", "import terrane.bake as bake"):
            code = ("import terrane as t\nground = t.fractal(seed=7, root_size_log2=8, root_count=(1, 1), first_root=(0, 0))\n"
                    f"{lines}\nprint(bake(ground, 'ground', worker_count=1, note=b'a').sha)\n")
            done = subprocess.run([sys.executable, "-B", "-c", code], capture_output=True, text=True, cwd=self.folder)
            self.assertEqual((done.returncode, len(done.stdout)), (0, 65), lines + done.stderr)

    def test_its_errors_are_those_of_the_function(self):
        import terrane.bake
        with self.assertRaises(TypeError):
            terrane.bake(small_fractal())
        with self.assertRaisesRegex(ValueError, "level_count"):
            terrane.bake(small_fractal(), self.path("a"), level_count=99)


class Progress(unittest.TestCase):
    def test_the_line_has_the_share_and_the_time_left(self):
        import terrane.bake
        line = terrane.bake.format_progress
        self.assertEqual(line("baking", 1, 8, 0, 10), "baking: 12 %")
        self.assertEqual(line("baking", 2, 8, 2, 10.0), "baking: 25 %, 30 s left")
        # 4 were complete
        self.assertEqual(line("baking", 6, 8, 2, 80.0), "baking: 75 %, 1 min 20 s left")
        self.assertEqual(line("baking", 8, 8, 8, 80.0), "baking: 100 %")
        self.assertEqual(line("baking", 1, 100, 1, 100.0), "baking: 1 %, 2 h 45 min left")


class BadInput(Folder):
    def test_is_one_line_that_names_the_thing(self):
        for words, *parts in (
                (["a"], "DEST"), (["a", "b", "c"], "c"), (["a", "b", "--frob"], "--frob"), (["a", "b", "--worker", 2], "--worker"),
                (["a", "b", "--workers", 0], "--workers must be", "'0'"), (["a", "b", "--threads", "x"], "--threads must be", "'x'"),
                (["a", "b", "--levels", 0], "--levels must be", "'0'"), (["a", "b", "--detail-m", "nan"], "--detail-m must be", "'nan'"),
                (["a", "b", "--region", "-1,-2,3"], "--region must be", "'-1,-2,3'"), (["a", "b", "--seed", -1], "--seed must be"),
                (["a", "b", "--nodata", "1,,2"], "--nodata must be"), (["a", "b", "--height-scale", 0], "--height-scale must be"),
                (["a", "b", "--encoding", "rgb"], "--encoding", "rgb"), (["a", "b", "--retries", -1], "--retries must be"),
                (["a", "b", "--scheduler", "tcp://x:1", "--workers", 2], "--workers", "--scheduler")):
            with self.subTest(words):
                self.assert_refused(self.bake(*words, cwd=self.folder), 2, *parts)

    def test_the_package_that_is_missing_is_named(self):
        pathlib.Path(self.path("distributed.py")).write_text("raise ImportError('not here')\n")
        path = self.folder + os.pathsep + os.environ.get("PYTHONPATH", "")
        done = self.bake("a.tif", self.path("out"), env={**os.environ, "PYTHONPATH": path})
        if not {"dem", "store"} <= set(terrane.components):
            return self.assert_refused(done, 1, "component")
        self.assert_refused(done, 1, "python3-distributed")


@unittest.skipUnless(has("dem") and has("store"), "rasters or stores are not built")
@unittest.skipUnless(HAS_DASK, "Dask distributed, Debian's python3-distributed, was not found")
class Dask(Folder):
    def cluster(self, **options):
        import distributed
        cluster = distributed.LocalCluster(threads_per_worker=1, dashboard_address=None, silence_logs=60,
                                           local_directory=self.path("dask"), **options)
        self.addCleanup(cluster.close)
        client = distributed.Client(cluster)
        self.addCleanup(client.close)
        return cluster, client

    @unittest.skipUnless(PROGRAM, "the program is not built")
    def test_the_bytes_are_those_of_the_program_with_any_number_of_workers(self):
        heights = hills(150, 500)
        heights[20:24, 30:34] = -7
        write_raster(self.path("hills.asc"), heights, 10.0)
        raster = self.path("hills.asc")
        settings = [*DETAIL, "--seed", 3, "--levels", 2, "--region", "-2500,-750,-200,700", "--nodata", "-7", "--height-scale", 2]
        wanted = self.bake_by_program("program", raster, *settings)
        for workers, threads in ((1, 2), (2, 1)):
            out = f"out{workers}"
            done = self.bake("hills.asc", out, *settings, "--workers", workers, "--threads", threads, "--json", cwd=self.folder)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            summary = json.loads(done.stdout)
            self.assertGreater(summary["shards"], 2)
            self.assertEqual((summary["baked"], summary["found"]), (summary["shards"], 0))
            self.assertEqual(terrane.open_store(self.path(out)).info.sha, summary["sha"])
            self.assertEqual(files(self.path(out)), wanted)
        done = self.bake(raster, self.path("out2"), *settings, "--workers", 1)
        self.assertRegex(done.stdout, r"\nbaked 0\nfound \d+\n")
        self.assertEqual(files(self.path("out2")), wanted)

    def test_a_worker_that_is_killed_loses_nothing(self):
        import terrane.bake
        write_raster(self.path("hills.asc"), hills(300, 900), 10.0)
        raster = self.path("hills.asc")
        terrane.bake.main([raster, self.path("whole"), "--workers", "1", "--detail-m", "2.5", "--json"])
        cluster, client = self.cluster(n_workers=2, host="127.0.0.1")
        pids = client.run(os.getpid)
        process = subprocess.Popen([*COMMAND, raster, self.path("out"), "--scheduler", cluster.scheduler_address, "--detail-m", "2.5"],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        # One is killed in the middle of its first shard.
        deadline = time.monotonic() + 60
        while not list(pathlib.Path(self.path("out")).glob("*.partial-*")) and time.monotonic() < deadline:
            time.sleep(0.005)
        busy = [pid for name, pid in pids.items() if client.processing().get(name)]
        self.assertTrue(busy)
        os.kill(busy[0], signal.SIGKILL)
        out, error = process.communicate(timeout=200)
        self.assertEqual((process.returncode, error), (0, ""))
        self.assertIn("sha ", out)
        self.assertNotEqual(set(client.run(os.getpid).values()), set(pids.values()))
        self.assertEqual(files(self.path("out")), files(self.path("whole")))

    def test_a_shard_that_kills_its_workers_is_named(self):
        import distributed
        import terrane.bake
        error = distributed.scheduler.KilledWorker("bake_shard-7", types.SimpleNamespace(address="tcp://127.0.0.1:1"), 3)
        explained = terrane.bake._explain(error)
        self.assertIsInstance(explained, terrane.bake.Failure)
        self.assertRegex(str(explained), "^bake_shard-7 .* 3 workers")

    def test_tasks_that_fail_are_repeated_and_a_raster_that_changes_is_noticed(self):
        import terrane.bake as module
        raster = self.raster()
        _, client = self.cluster(n_workers=1, processes=False)
        opened, failures = module._open, []

        def fail_at_times(job, is_new):
            if not is_new and len(failures) < 2:
                failures.append(job)
                raise OSError("the disk is away")
            return opened(job, is_new)

        with mock.patch.object(module, "_open", fail_at_times):
            info = module.submit(client, raster, self.path("a"), finest_spacing=2.5).store.result()
            self.assertEqual(len(failures), 2)
            self.assertEqual(terrane.open_store(self.path("a")).info, info)
            failures.clear()
            with self.assertRaisesRegex(OSError, "the disk is away"):
                module.submit(client, raster, self.path("b"), finest_spacing=2.5, retries=0).store.result()
        # The process holds the source for the next shard, but not if its file changes; changed samples are refused.
        with mock.patch.object(terrane._terrane, "open_dem", side_effect=terrane._terrane.open_dem) as open_dem:
            module.submit(client, raster, self.path("c"), finest_spacing=2.5).store.result()
            self.assertEqual(open_dem.call_count, 1)
            write_raster(raster, hills(150, 500) + 1, 10.0)
            for pieces in pathlib.Path(self.path("c")).glob("pieces-*"):
                shutil.rmtree(pieces)
            with self.assertRaisesRegex(ValueError, "hills.asc"):
                module.submit(client, raster, self.path("c"), finest_spacing=2.5).store.result()
            self.assertEqual(open_dem.call_count, 2)

    def test_an_interrupt_leaves_no_process_and_the_same_command_continues(self):
        write_raster(self.path("hills.asc"), hills(300, 900), 10.0)
        command = [*COMMAND, self.path("hills.asc"), self.path("out"), "--workers", "2", "--detail-m", "2.5"]
        for number in (signal.SIGINT, signal.SIGTERM):
            main_end, terminal = pty.openpty()
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=terminal)
            os.close(terminal)
            text = b""
            while b" left" not in text:
                part = os.read(main_end, 1000)
                self.assertTrue(part, text)
                text += part
            started = children(process.pid)
            self.assertTrue(started)
            process.send_signal(number)
            try:
                while part := os.read(main_end, 1000):
                    text += part
            except OSError:
                pass  # the end, of a terminal
            os.close(main_end)
            self.assertEqual(process.wait(60), 1)
            self.assertRegex(text.decode(), r"\r\x1b\[Kbaking: \d+ %, \d+ s left")
            self.assertEqual(text.decode().rpartition("\x1b[K")[2], "terrane.bake: given up; the same command continues\r\n")
            deadline = time.monotonic() + 20
            while started and time.monotonic() < deadline:
                time.sleep(0.02)
                started = [pid for pid in started if os.path.exists(f"/proc/{pid}")]
            self.assertEqual(started, [])
        done = subprocess.run(command, capture_output=True, text=True, timeout=200)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertRegex(done.stdout, r"\nfound [1-9]")

    def test_what_the_world_lacks_is_one_line(self):
        pathlib.Path(self.path("words.txt")).write_text("no raster\n")
        raster = self.raster()
        for words, code, *parts in (
                ([self.path("words.txt"), self.path("out"), "--workers", 1], 1, "words.txt"),
                ([self.path("none.tif"), self.path("out"), "--workers", 1], 1, "none.tif"),
                ([raster, raster, "--workers", 1], 1, "hills.asc"),
                ([raster, self.path("out"), "--workers", 1, "--levels", 99], 2, "--levels", "99"),
                ([raster, self.path("out"), "--scheduler", "tcp://127.0.0.1:1"], 1, "tcp://127.0.0.1:1", "does not answer"),
                ([raster, self.path("out"), "--scheduler", "post://127.0.0.1:1"], 2, "--scheduler", "post://127.0.0.1:1")):
            with self.subTest(words):
                self.assert_refused(self.bake(*words), code, *parts)


if __name__ == "__main__":  # workers import this file
    main()
