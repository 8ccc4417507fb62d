#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Baked terrains, and cached bounds of rasters."""

import glob
import os
import signal
import subprocess
import time

from program import PROGRAM, Folder, ask, main, run, run_json

KEYS = ["chunks", "bytes", "max_error_m", "sha", "out"]


class Bake(Folder):
    def bake(self, name, *arguments):
        out = self.path(name)
        return out, run_json("bake", *arguments, "--out", out)

    def mesh(self, terrain, name):
        out = self.path(name)
        # with --eye: the default eye depends on heights between samples, where a store interpolates linearly
        summary = run_json("mesh", *terrain, "--eye=0,-900,900", "--look=0,0,500", "--budget", 30_000,
                           "--max-error-px", 1, "--out", out)
        return self.read(out), summary

    def test_a_baked_raster_gives_the_mesh_and_the_ground_of_the_raster(self):
        _, raster = self.hills(300, 200)
        out, summary = self.bake("hills.terrane", "--dem", raster)
        self.assertEqual(list(summary), KEYS)
        self.assertEqual(summary["bytes"], os.path.getsize(out))
        self.assertGreater(summary["max_error_m"], 0)
        live, live_summary = self.mesh(["--dem", raster], "live.ply")
        stored, stored_summary = self.mesh(["--dem", out], "stored.ply")
        self.assertEqual(live, stored)
        self.assertEqual(live_summary["triangles"], stored_summary["triangles"])
        questions = [{"id": i, "op": "height", "x": 37.1 * i - 800, "y": 11.3 * i - 300} for i in range(40)]
        self.assertEqual(ask(["--dem", raster], questions), ask(["--dem", out], questions))
        info, baked = (run_json("info", "--dem", path) for path in (raster, out))
        for key in ("extent_m", "min_m", "max_m", "levels", "root_size_m", "finest_spacing_m", "crs",
                    "nodata_share", "world_from_crs", "crs_from_world"):
            self.assertEqual(info[key], baked[key], key)
        self.assertEqual(baked["sha"], summary["sha"])

    def test_a_baked_fractal_and_a_raster_with_detail_give_the_meshes_of_both(self):
        _, raster = self.hills(150, 100)
        for terrain in (["--seed", 5, "--detail-m", 256, "--world-m", 131072], ["--dem", raster, "--seed", 3, "--detail-m", 5]):
            out, _ = self.bake("a.terrane", *terrain)
            self.assertEqual(self.mesh(terrain, "live.ply")[0], self.mesh(["--dem", out], "stored.ply")[0])

    def test_the_file_is_the_same_on_any_number_of_threads(self):
        _, raster = self.hills(300, 200)
        results = [self.bake(f"{n}.terrane", "--dem", raster, "--threads", n) for n in (1, 2, 5)]
        self.assertEqual(len({summary["sha"] for _, summary in results}), 1)
        self.assertEqual(len({self.read(path) for path, _ in results}), 1)

    def test_shards_give_the_mesh_and_the_ground_of_the_file(self):
        _, raster = self.hills(300, 200)
        one, summary = self.bake("one.terrane", "--dem", raster)
        shards, sharded = self.bake("shards", "--dem", raster, "--sharded")
        for key in ("chunks", "max_error_m"):
            self.assertEqual(sharded[key], summary[key])
        questions = [{"id": i, "op": "height", "x": 37.1 * i - 800, "y": 11.3 * i - 300} for i in range(40)]
        for terrain in (shards, f"{shards}/terrain.json"):
            self.assertEqual(self.mesh(["--dem", one], "one.ply")[0], self.mesh(["--dem", terrain], "shards.ply")[0])
            self.assertEqual(ask(["--dem", one], questions), ask(["--dem", terrain], questions))
            self.assertEqual(run_json("info", "--dem", terrain)["sha"], sharded["sha"])

    def files(self, folder):
        return {os.path.relpath(path, folder): self.read(path)
                for path in glob.glob(f"{folder}/**", recursive=True) if os.path.isfile(path)}

    def test_shards_are_the_same_from_any_processes_that_may_be_killed(self):
        _, raster = self.hills(900, 300)
        source = ["--dem", raster, "--detail-m", 5]
        whole, summary = self.bake("whole", *source, "--sharded")
        pieces = self.path("pieces")
        shards = run_json("bake", *source, "--out", pieces, "--plan")["shards"]
        self.assertGreater(shards, 1)
        for delay in (0.05, 0.2, 0.4, 0.6):
            process = subprocess.Popen([PROGRAM, "bake", *map(str, source), "--out", pieces, "--sharded"],
                                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(delay)
            process.kill()
            process.wait()
        for shard in reversed(range(shards)):
            done = run_json("bake", *source, "--out", pieces, "--shard", shard, "--threads", 1 + shard % 2)
            self.assertEqual(done["baked"] + done["found"], 1)
        self.assertEqual(run_json("bake", "--out", pieces, "--combine")["sha"], summary["sha"])
        partial = [path for path in self.files(pieces) if ".partial-" in path]
        for path in partial:  # of the killed processes
            os.remove(f"{pieces}/{path}")
        self.assertEqual(self.files(pieces), self.files(whole))

    def test_an_edited_region_is_new_shards(self):
        heights, raster = self.hills(900, 300)
        source = ["--dem", raster, "--detail-m", 5]
        out, before = self.bake("shards", *source, "--sharded")
        old_files = self.files(out)
        old_index = old_files["terrain.json"]
        heights[100:103, 850:853] += 7
        self.write_grid("hills.asc", heights, 10.0)
        for name in ("plan.json", "raster.scan"):
            os.remove(f"{out}/{name}")
        after = run_json("bake", *source, "--out", out, "--sharded")
        self.assertNotEqual(after["sha"], before["sha"])
        new_files = self.files(out)
        shards = {name for name in old_files if name.endswith(".shard")}
        self.assertLessEqual({(name, old_files[name]) for name in shards}, set(new_files.items()))
        added = {name for name in new_files if name.endswith(".shard")} - shards
        self.assertGreater(len(shards), len(added), "shards away from the region are those of before")
        self.assertGreater(len(added), 0)
        alone, summary = self.bake("alone", *source, "--sharded")
        self.assertEqual(summary["sha"], after["sha"])
        self.assertEqual(self.read(f"{alone}/terrain.json"), new_files["terrain.json"])
        # The terrain of before is still in the folder.
        with open(f"{out}/terrain.json", "wb") as file:
            file.write(old_index)
        self.assertEqual(run_json("info", "--dem", out)["sha"], before["sha"])

    def test_a_plan_of_another_raster_and_a_shard_that_is_missing_are_one_line(self):
        _, raster = self.hills(300, 200)
        out = self.path("shards")
        run_json("bake", "--dem", raster, "--out", out, "--plan")
        done = run("bake", "--dem", raster, "--detail-m", 5, "--out", out, "--plan")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1))
        self.assertIn("raster.scan", done.stderr)
        os.remove(f"{out}/raster.scan")
        done = run("bake", "--dem", raster, "--detail-m", 5, "--out", out, "--plan")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1))
        self.assertIn("plan.json", done.stderr)
        os.remove(f"{out}/raster.scan")
        done = run("bake", "--out", out, "--combine")
        self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1))
        self.assertIn("shard 0 of", done.stderr)
        done = run("bake", "--dem", raster, "--out", out, "--shard", 1000)
        self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1))
        self.assertIn("1000", done.stderr)
        done = run("info", "--dem", out)
        self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1))

    def test_every_subcommand_takes_a_baked_terrain(self):
        out, _ = self.bake("a.terrane", "--seed", 5, "--detail-m", 64, "--region", "-4000,-4000,4000,4000")
        terrain = ["--dem", out]
        flight = run_json("fly", *terrain, "--path", "straight", "--seconds", 0.2, "--fps", 10, "--verify",
                          "--size", "160x90", "--budget", 3000)
        self.assertLessEqual(flight["measured_error_px_max"], flight["error_px_max"])
        drop = run_json("drop", *terrain, "--count", 3, "--seconds", 1, "--shape", "sphere", "--speed", 20)
        self.assertEqual(drop["fell_through"], 0)
        self.assertEqual(run_json("page", *terrain, "--path", "straight@50", "--seconds", 1)["frames"] > 0, True)
        self.assertEqual(run_json("drive", *terrain, "--path", "straight", "--seconds", 1)["fell_through"], 0)

    def test_levels_and_regions_are_parts_of_the_world(self):
        whole = run_json("info", "--seed", 5, "--detail-m", 64, "--world-m", 131072)
        out, summary = self.bake("levels.terrane", "--seed", 5, "--world-m", 131072, "--levels", 2)
        info = run_json("info", "--dem", out)
        self.assertEqual(info["levels"], 2)
        self.assertEqual(info["root_size_m"], whole["root_size_m"])
        self.assertEqual(summary["chunks"], 4 + 16)
        out, _ = self.bake("region.terrane", "--seed", 5, "--detail-m", 64, "--region", "-1000,0,3000,2500")
        west, south, east, north = run_json("info", "--dem", out)["extent_m"]
        self.assertTrue(west <= -1000 and south <= 0 and east >= 3000 and north >= 2500)
        self.assertLess((east - west) * (north - south), 2e9)

    def test_a_damaged_store_is_one_line_and_no_crash(self):
        _, raster = self.hills(100, 100)
        out, _ = self.bake("a.terrane", "--dem", raster)
        whole = self.read(out)
        broken = self.path("broken.terrane")
        for at in (20, 100, len(whole) // 2, len(whole) - 5):
            for content in (whole[:at], whole[:at] + bytes([whole[at] ^ 4]) + whole[at + 1:]):
                with open(broken, "wb") as file:
                    file.write(content)
                self.assert_refused(run("mesh", "--dem", broken, "--budget", 2000), [1])
        for flags in (["--seed", 3], ["--detail-m", 2]):
            self.assertEqual(run("info", "--dem", out, *flags).returncode, 2)

    def test_an_interrupt_leaves_no_part_of_a_file(self):
        process = subprocess.Popen([PROGRAM, "bake", "--seed", "5", "--detail-m", "4", "--world-m", "131072", "--out",
                                    self.path("a.terrane")], stderr=subprocess.PIPE, text=True)
        while not os.listdir(self.folder) and process.poll() is None:
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        _, text = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 1)
        self.assertEqual(text.count("\n"), 1, text)
        self.assertEqual(os.listdir(self.folder), [])


class Cache(Folder):
    def info(self, raster, *arguments, environment=None):
        return subprocess.run([PROGRAM, "info", "--dem", raster, "--json", *arguments], check=True, text=True,
                              capture_output=True, env={**os.environ, **(environment or {})})

    def test_bounds_are_kept_where_they_should_be(self):
        _, raster = self.hills(300, 260)
        own = self.path("own")
        places = (
            (["--cache", self.path("chosen")], {}, self.path("chosen/*")),
            (["--cache", "beside"], {}, raster + ".*.terrane-bounds"),
            ([], {"XDG_CACHE_HOME": own}, own + "/terrane/*"),
            ([], {"XDG_CACHE_HOME": "", "HOME": own}, own + "/.cache/terrane/*"))
        for arguments, environment, pattern in places:
            answers = []
            for _ in range(2):
                done = self.info(raster, *arguments, environment=environment)
                self.assertEqual(done.stderr, "")
                self.assertEqual(len(glob.glob(pattern)), 1, pattern)
                answers.append(done.stdout)
            self.assertEqual(*answers)
        before = sum(len(files) for _, _, files in os.walk(self.folder))
        self.info(raster, "--cache", "off", environment={"XDG_CACHE_HOME": self.path("none")})
        self.assertEqual(sum(len(files) for _, _, files in os.walk(self.folder)), before)

    def test_a_damaged_file_is_one_line_and_replaced(self):
        _, raster = self.hills(300, 260)
        chosen = self.path("chosen")
        expected = self.info(raster, "--cache", chosen).stdout
        kept = glob.glob(chosen + "/*")[0]
        os.truncate(kept, 500)
        done = self.info(raster, "--cache", chosen)
        self.assertEqual(done.stdout, expected)
        self.assertEqual(done.stderr.count("\n"), 1)
        self.assertIn(kept, done.stderr)
        self.assertEqual(self.info(raster, "--cache", chosen).stderr, "")

    def test_programs_that_open_a_raster_at_once_agree(self):
        _, raster = self.hills(300, 260)
        chosen = self.path("chosen")
        programs = [subprocess.Popen([PROGRAM, "info", "--dem", raster, "--json", "--cache", chosen], text=True,
                                     stdout=subprocess.PIPE, stderr=subprocess.PIPE) for _ in range(3)]
        answers = {process.communicate(timeout=60) for process in programs}
        self.assertEqual(len(answers), 1)
        self.assertEqual(answers.pop()[1], "")
        self.assertEqual(len(os.listdir(chosen)), 1)


if __name__ == "__main__":
    main()
