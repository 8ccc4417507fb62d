#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Meshes, drops, and runs over slow storage, with their summaries and files."""

import json
import os

from program import SMALL_WORLD, Folder, main, np, run, run_json, start


def read_ply(path):
    with open(path, "rb") as file:
        content = file.read()
    header, body = content.split(b"end_header\n", 1)
    lines = header.decode().splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"], lines
    counts = {line.split()[1]: int(line.split()[2]) for line in lines if line.startswith("element")}
    assert [line for line in lines if line.startswith("property")] == [
        "property double x", "property double y", "property double z",
        "property list uchar uint vertex_indices"]
    vertices = np.frombuffer(body, "<f8", 3 * counts["vertex"]).reshape(-1, 3)
    faces = np.frombuffer(body, np.dtype([("n", "u1"), ("v", "<u4", 3)]), counts["face"],
                          24 * counts["vertex"])
    assert len(body) == 24 * counts["vertex"] + 13 * counts["face"]
    assert (faces["n"] == 3).all()
    return vertices, faces["v"].astype(np.int64)


class Mesh(Folder):
    def check_mesh(self, terrain, budget, *arguments):
        out = self.path("mesh.ply")
        summary = run_json("mesh", *terrain, "--budget", budget, "--out", out, *arguments)
        vertices, faces = read_ply(out)
        self.assertEqual(summary["triangles"], len(faces))
        self.assertEqual(summary["vertices"], len(vertices))
        self.assertLessEqual(len(faces), budget)
        self.assertGreater(summary["error_px"], 0)
        self.assertIn(summary["status"], ("error_met", "budget_reached"))
        # counter-clockwise from above, with the total area of the root squares
        a, b, c = (vertices[faces[:, k]] for k in range(3))
        area = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
        self.assertGreater(area.min(), 0)
        size = vertices[:, :2].max(axis=0) - vertices[:, :2].min(axis=0)
        self.assertAlmostEqual(area.sum() / (size[0] * size[1]), 1, places=9)
        # each directed edge once; edges without an opposite only on the border
        edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        keys = edges[:, 0] * len(vertices) + edges[:, 1]
        self.assertEqual(len(np.unique(keys)), len(keys))
        single = edges[~np.isin(keys, edges[:, 1] * len(vertices) + edges[:, 0])]
        low, high = vertices[:, :2].min(axis=0), vertices[:, :2].max(axis=0)
        p, q = vertices[single[:, 0], :2], vertices[single[:, 1], :2]
        on_border = (((p == low) & (q == low)) | ((p == high) & (q == high))).any(axis=1)
        self.assertTrue(on_border.all())
        self.assertEqual(len(np.unique(vertices[:, :2], axis=0)), len(vertices))
        return summary

    def test_mesh_of_a_fractal_is_whole_and_within_budget(self):
        for world, budgets in (([], (32, 50_000)), (["--world-m", 131072], (8, 1000))):
            for budget in budgets:
                self.assertEqual(self.check_mesh(["--seed", 5, *world], budget)["status"], "budget_reached")
        summary = self.check_mesh(["--seed", 5], 1_000_000, "--max-error-px", 8)
        self.assertEqual(summary["status"], "error_met")
        self.assertLessEqual(summary["error_px"], 8)

    def test_mesh_of_a_raster_from_a_chosen_eye(self):
        _, raster = self.hills(300, 200)
        self.check_mesh(["--dem", raster], 20_000, "--eye", "-200,-900,700", "--look", "0,0,500",
                        "--fov-deg", 45, "--size", "640x480")

    def test_the_same_view_gives_the_same_bytes(self):
        for name in ("a.ply", "b.ply"):
            run_json("mesh", *SMALL_WORLD, "--budget", 3000, "--out", self.path(name))
        self.assertEqual(self.read("a.ply"), self.read("b.ply"))


class Drop(Folder):
    KEYS = {"bodies", "fell_through", "parked", "left_world", "lost_time_share", "awake_body_steps",
            "max_depth_m", "step_ms_median", "step_ms_p99", "state_hash"}
    DROP = ("drop", *SMALL_WORLD)

    def test_keys_and_trace(self):
        _, raster = self.hills()
        trace = self.path("trace.csv")
        summary = run_json("drop", "--dem", raster, "--shape", "mixed", "--count", 30, "--speed", 20,
                           "--spin", 2, "--dt", "1/60", "--seconds", 1, "--no-sleep", "--trace", trace)
        self.assertLessEqual(self.KEYS, set(summary))
        self.assertEqual(summary["bodies"], 30)
        self.assertEqual(summary["awake_body_steps"], 30 * 60)
        self.assertEqual((summary["fell_through"], summary["parked"], summary["left_world"]), (0, 0, 0))
        self.assertRegex(summary["state_hash"], "^[0-9a-f]{16}$")
        with open(trace) as file:
            self.assertEqual(file.readline(), "step,body,x,y,z,qw,qx,qy,qz\n")
            poses = np.loadtxt(file, delimiter=",")
        self.assertEqual(poses.shape, (30 * 61, 9))
        self.assertTrue((poses[:, 0] == np.repeat(np.arange(61), 30)).all())
        self.assertTrue((poses[:, 1] == np.tile(np.arange(30), 61)).all())
        self.assertLess(np.abs(np.linalg.norm(poses[:, 5:], axis=1) - 1).max(), 1e-12)
        start, first = poses[:30], poses[30:60]
        self.assertTrue((first[:, 4] < start[:, 4]).all())

    def test_states_follow_from_the_seed_and_from_no_number_of_threads(self):
        def state(seed, threads):
            return run_json("drop", "--seed", seed, *SMALL_WORLD[2:], "--shape", "mixed", "--count", 64, "--scale", 0.5,
                            "--seconds", 2, "--threads", threads)["state_hash"]

        states = {state(3, threads) for threads in (1, 2, 5)}
        self.assertEqual(len(states), 1)
        self.assertNotIn(state(4, 1), states)

    def test_a_saved_world_goes_on_with_the_same_bits(self):
        world = self.path("world")
        layout = ("--scale", 0.5, "--shape", "mixed", "--count", 40, "--speed", 5)
        whole = run_json(*self.DROP, *layout, "--seconds", 4)
        half = run_json(*self.DROP, *layout, "--seconds", 2, "--save", world)
        self.assertNotEqual(half["state_hash"], whole["state_hash"])
        for threads in (1, 2):
            rest = run_json(*self.DROP, "--restore", world, "--seconds", 2, "--threads", threads)
            self.assertEqual(rest["state_hash"], whole["state_hash"])
            self.assertEqual(rest["bodies"], 40)
        again = run_json(*self.DROP, "--restore", world, "--seconds", 1, "--save", world)
        self.assertEqual(again["steps"], 60)
        self.assertEqual(run_json(*self.DROP, "--restore", world, "--seconds", 1)["state_hash"], whole["state_hash"])
        data = bytearray(self.read("world"))
        data[len(data) // 2] ^= 1
        with open(world, "wb") as file:
            file.write(data)
        self.assert_refused(run(*self.DROP, "--restore", world, "--seconds", 1), [1], "cannot restore", world)

    def test_frames_are_written_and_change_nothing(self):
        command = (*self.DROP, "--shape", "mixed", "--count", 10, "--scale", 0.2, "--seconds", 0.5)
        out = self.path("out")
        summary = run_json(*command, "--out", out, "--fps", 20, "--size", "160x90")
        self.assertEqual(summary["state_hash"], run_json(*command)["state_hash"])
        self.assertNotEqual(summary["state_hash"], run_json(*command[:-1], 0.1)["state_hash"])
        self.assertEqual(sorted(os.listdir(out)), ["frames.csv", "report.html", "terrane-files.txt"])
        frames = self.columns()
        self.assertEqual((len(frames), summary["frames"]), (11, 11))  # the start, and one every 0.05 s
        self.assertTrue((frames["awake"] == 10).all())
        report = self.read("out/report.html").decode()
        for key in ("triangles_max", "error_px_median", "update_ms_p99", "memory_bytes", "fell_through"):
            self.assertIn(f'"{key}":', report)
        self.assertLess(np.abs(frames["time_s"] - 0.05 * np.arange(11)).max(), 1e-9)


class Bodies(Folder):
    KEYS = {"queries", "query_ms", "positive_queries", "positive_ms", "update_ms", "pairs"}

    def test_says_the_same_whatever_the_broadphase(self):
        answers = []
        for kind in ("sap", "grid", "two-scene", "brute", "hashed", "dense", "centroid"):
            summary = run_json("bodies", "--count", 100, "--queries", 30, "--share", 0.2, "--dt", 0.2,
                               "--size-spread", 50, "--size-power", 2.5, "--broadphase", kind)
            self.assertLessEqual(self.KEYS, set(summary))
            self.assertEqual((summary["queries"], summary["broadphase"]), (30, kind))
            self.assertGreater(summary["positive_queries"], 0)
            self.assertGreater(summary["query_ms"], 0)
            self.assertLessEqual(summary["pairs"], summary["candidates"])
            answers.append([summary[key] for key in ("touching", "positive_queries", "pairs")])
        pairs_of_spheres = answers[-1].pop()
        self.assertEqual(answers[:-1], answers[:1] * 6)
        self.assertEqual(answers[-1], answers[0][:2])
        self.assertGreaterEqual(pairs_of_spheres, answers[0][0])

    def test_the_study_says_how_much_sooner_it_answers(self):
        summary = run_json("bodies", "--study", "--out", self.path("study"), "--most-bodies", 50,
                           "--seconds-a-point", 0.002)
        for key in ("count", "detail", "radius", "equal"):
            self.assertGreater(summary[key + "_least_speedup"], 0)
        self.assertIsNotNone(summary["count_slopes"]["sap"]["without_fixed_cost"])
        self.assertTrue(any("hashed grid" in line for line in summary["equal_findings"]))
        self.assertIn(b'"published_query_ms":0.167', self.read("study/report.html"))
        with open(self.path("study/study.md")) as file:
            rows = [line.split(" | ") for line in file if line.startswith(("| query, ", "| update, "))]
        self.assertEqual(len(rows), 11 + 2 + 7 + 5 + 6)  # of count, detail, radius and equal size
        for what, published, ours, ratio, reason in rows:
            self.assertAlmostEqual(float(published) / float(ours) / float(ratio), 1, delta=0.02)
            self.assertTrue(reason.endswith(". |\n"), reason)


class Page(Folder):
    KEYS = {"frames", "late_frames", "late_share", "excess_error_px_s", "late_excess_error_px_s", "bytes_loaded",
            "bytes_wasted", "peak_bytes", "contact_late", "path", "speed", "policy", "radius",
            "latency_ms", "bandwidth_mb", "memory_mb", "wasted_share", "error_px_max", "reloads",
            "cancelled", "failed", "hard_evictions"}
    QUICK = ["--seconds", 2, "--fps", 10, "--size", "320x180", "--budget", 50_000, "--bodies", 2]

    def play(self, *arguments):
        done = run("page", "--seed", 5, "--world-m", 16384, *self.QUICK, *arguments, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        return [json.loads(line) for line in done.stdout.splitlines()]

    def test_every_combination_is_one_line(self):
        rows = self.play("--path", "straight@300,spins", "--policy", "deadline,distance,oracle",
                         "--latency-ms", "5,50", "--radius", "0.5,1", "--threads", 2)
        self.assertEqual([(r["path"], r["latency_ms"], r["policy"]) for r in rows],
                         [(path, latency, policy) for path in ("straight", "spins")
                          for latency in (5, 50) for policy in ("deadline", "distance", "oracle")])
        for row in rows:
            self.assertLessEqual(self.KEYS, set(row))
            self.assertEqual(row["frames"], 20)
            self.assertEqual(row["late_share"], row["late_frames"] / 20)
            self.assertLessEqual(row["peak_bytes"], row["memory_mb"] * 2**20)
            self.assertLessEqual(row["bytes_wasted"], row["bytes_loaded"])
            self.assertEqual(row["radius"] is not None, row["policy"] == "distance")
            self.assertEqual(row["speed"], 300 if row["path"] == "straight" else None)

    def test_the_best_radius_is_kept(self):
        arguments = ["--path", "straight@300", "--policy", "distance", "--latency-ms", 50,
                     "--bandwidth-mb", 5]
        alone = [self.play(*arguments, "--radius", radius)[0] for radius in (0.25, 1)]
        best = min(alone, key=lambda r: (r["late_frames"], r["late_excess_error_px_s"]))
        self.assertEqual(self.play(*arguments, "--radius", "0.25,1"), [best])

    def test_slower_storage_is_later_and_files_say_the_same(self):
        arguments = ["--path", "straight@300", "--policy", "distance"]
        quick = self.play(*arguments, "--bandwidth-mb", 1000)[0]
        out = self.path("out")
        slow = self.play(*arguments, "--latency-ms", 500, "--bandwidth-mb", 0.5, "--out", out)[0]
        self.assertGreater(slow["late_frames"], quick["late_frames"])
        self.assertEqual(sorted(os.listdir(out)), ["frames.csv", "report.html", "terrane-files.txt"])
        frames = self.rows()
        self.assertLessEqual({"time_s", "error_px", "late", "resident_bytes", "in_flight_bytes",
                              "late_chunks", "contact_late"}, set(frames[0]))
        errors = np.array([float(frame["error_px"]) for frame in frames])
        late = [frame["status"] == "not_resident" and float(frame["error_px"]) > 2
                for frame in frames]
        self.assertEqual([frame["late"] == "1" for frame in frames], late)
        self.assertEqual(slow["late_frames"], sum(late))
        self.assertEqual(slow["error_px_max"], errors.max())
        self.assertAlmostEqual(slow["excess_error_px_s"], np.maximum(errors - 2, 0).sum() / 10)
        self.assertAlmostEqual(slow["late_excess_error_px_s"], (errors - 2)[late].sum() / 10)
        self.assertEqual(slow["contact_late"], sum(int(f["contact_late"]) for f in frames))
        # what the bandwidth allows during the flight
        self.assertLessEqual(slow["bytes_loaded"], 0.5e6 * 2)
        for frame in frames:
            self.assertLessEqual(int(frame["resident_bytes"]) + int(frame["in_flight_bytes"]), slow["memory_mb"] * 2**20)
        self.assertIn(b'"late_frames":%d' % slow["late_frames"], self.read("out/report.html"))

    def test_storage_that_never_answers_rightly_is_a_failure(self):
        done = run("page", *SMALL_WORLD, *self.QUICK, "--failure-share", 1)
        self.assert_refused(done, [1], "root squares")

    def test_people_read_a_table_or_one_list(self):
        one = run("page", *SMALL_WORLD, *self.QUICK)
        self.assertRegex(one.stdout, r"(?m)^late_frames +\d+$")
        several = run("page", *SMALL_WORLD, *self.QUICK, "--policy", "deadline,oracle")
        self.assertEqual(len(several.stdout.splitlines()), 3)


class Fly(Folder):
    def test_slow_storage_in_real_time(self):
        flight = ["--seed", 5, "--world-m", 16384, "--path", "straight", "--speed", 1000, "--seconds", 1.5, "--fps", 10,
                  "--size", "320x180", "--budget", 20_000, "--max-error-px", 2, "--realtime", "--threads", 4]
        flights = {policy: start("fly", *flight, "--latency-ms", 5, "--bandwidth-mb", 2, "--policy", policy, "--json",
                                 "--out", self.path(policy)) for policy in ("deadline", "distance", "oracle")}
        late_frames = 0
        for policy, process in flights.items():
            out, error = process.communicate(timeout=60)
            self.assertEqual(process.returncode, 0, error)
            summary, frames = json.loads(out), self.rows(policy + "/frames.csv")
            late = [f["status"] == "not_resident" and float(f["error_px"]) > 2 for f in frames]
            self.assertEqual([f["late"] == "1" for f in frames], late)
            self.assertEqual(summary["late_frames"], sum(late))
            excess = sum(max(0.0, float(f["error_px"]) - 2) for f in frames) / 10
            self.assertAlmostEqual(summary["excess_error_px_s"], excess)
            excess = sum(float(f["error_px"]) - 2 for f, is_late in zip(frames, late) if is_late) / 10
            self.assertAlmostEqual(summary["late_excess_error_px_s"], excess)
            late_frames += sum(late)
        self.assertGreater(late_frames, 0)


if __name__ == "__main__":
    main()
