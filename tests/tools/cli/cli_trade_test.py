#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`terrane trade`: a few dials, the form of trade.json, its fronts, two runs side by side, what is refused; --preset."""

import json
import os
import re

from program import Folder, ask, main, run, run_json

SHORT = ("trade", "--quick", "--dial", "root,pair-measure,extremes")


def front_of(table):
    """The labels of rows that no other row beats, by comparing all pairs."""
    figures = [(row["label"], row["figures"][table["cost"]]["median"], row["figures"][table["loss"]]["median"])
               for row in table["rows"]]
    return {label for label, cost, loss in figures
            if not any(c <= cost and l <= loss and (c, l) != (cost, loss) for _, c, l in figures)}


class Trade(Folder):
    def check_document(self, document):
        self.assertEqual((document["format"], document["format_version"]), ("terrane trade", 1))
        self.assertLessEqual({"processor", "threads", "compiler", "build", "version"}, set(document["machine"]))
        self.assertGreater(document["reference_loop_ms"]["median"], 0)
        self.assertEqual([preset["name"] for preset in document["presets"]], ["fast", "balanced", "accurate"])
        for table in document["tables"]:
            columns = {column["key"]: column["unit"] for column in table["columns"]}
            self.assertGreaterEqual(len(table["rows"]), 1)
            for row in table["rows"]:
                self.assertTrue(row["command"].startswith("terrane "), row["command"])
                self.assertLessEqual(set(row["figures"]), set(columns))
                for key, figure in row["figures"].items():
                    self.assertLessEqual(figure["low"], figure["median"])
                    self.assertLessEqual(figure["median"], figure["high"])
                    self.assertGreaterEqual(figure["repetitions"], 1)
                    self.assertEqual("ratio" in figure, columns[key] in ("ms", "ns"))
            if table["cost"]:
                self.assertEqual({row["label"] for row in table["rows"] if row["on_front"]}, front_of(table))

    def test_dials_without_a_terrain_and_their_files(self):
        out = self.path("out")
        document = run_json(*SHORT, "--out", out)
        self.check_document(document)
        self.assertEqual([table["key"] for table in document["tables"]], ["pair-measure", "root", "extremes"])
        self.assertEqual({table["terrain"] for table in document["tables"]}, {""})
        pair, root, extremes = document["tables"]
        disorder = {row["label"]: row["figures"]["disorder"]["median"] for row in pair["rows"]}
        self.assertEqual(disorder["distance"], 0)
        self.assertGreater(disorder["test"], disorder["pseudodistance"])
        self.assertEqual([row["figures"]["unlike_pairs"]["median"] for row in root["rows"]], [0, 0])
        self.assertEqual(len(extremes["findings"]), 1)
        self.assertEqual(root["findings"], ["No value of this dial changes the pairs ordered unlike the squares here: 0."])
        self.assertEqual(pair["findings"], [])
        self.assertEqual(sorted(os.listdir(out)), ["report.html", "terrane-files.txt", "trade.json"])
        with open(os.path.join(out, "trade.json")) as file:
            self.assertEqual(json.load(file), document)
        with open(os.path.join(out, "report.html")) as file:
            page = file.read()
        self.assertIn("Chart.js v3", page)
        self.assertNotRegex(page, "https?:")
        self.assertNotIn("{{", page)
        embedded = re.search(r'<script id="data" type="application/json">(.*?)</script>', page, re.S).group(1)
        self.assertEqual(json.loads(embedded)["documents"], [document])

    def test_a_raster_is_measured_beside_the_fractal(self):
        _, raster = self.hills()  # so small that it has one level
        document = run_json("trade", "--quick", "--dial", "contact-spacing", "--seed", 3, "--dem", raster)
        self.check_document(document)
        fractal, dem = document["tables"]
        self.assertEqual(dem["terrain"], "hills.asc")
        self.assertIn("--seed 3", fractal["rows"][0]["command"])
        self.assertIn("--dem " + raster, dem["rows"][0]["command"])
        for table in (fractal, dem):
            for row in table["rows"]:
                figures = row["figures"]
                self.assertLessEqual(figures["depth_error_m"]["median"], figures["error_m"]["median"] * (1 + 1e-9) + 1e-9)
            errors = [row["figures"]["error_m"]["median"] for row in table["rows"]]
            self.assertEqual(errors, sorted(errors))
            spacings = [row["value"] for row in table["rows"]]
            self.assertEqual(spacings, [spacings[0] * 2 ** i for i in range(len(spacings))])
        self.assertEqual([len(table["rows"]) for table in (fractal, dem)], [4, 1])

    def test_a_dial_without_effect_over_a_terrain_is_named(self):
        _, raster = self.hills()  # one level: all of it is resident
        document = run_json("trade", "--quick", "--dial", "memory", "--seed", 3, "--dem", raster)
        self.check_document(document)
        self.assertEqual([table["terrain"] for table in document["tables"]], ["seed 3"])
        self.assertEqual([(dial["key"], dial["terrain"]) for dial in document["idle_dials"]], [("memory", "hills.asc")])
        text = run("trade", "--quick", "--dial", "memory", "--seed", 3, "--dem", raster).stdout
        self.assertRegex(text, r"memory \(hills.asc\) +not measured: all chunks are root squares")

    def test_two_runs_side_by_side(self):
        paths = []
        for name in ("a", "b"):
            run_json("trade", "--quick", "--dial", "root", "--out", self.path(name))
            paths.append(os.path.join(self.path(name), "trade.json"))
        with open(paths[0]) as file:
            document = json.load(file)
        for row in document["tables"][0]["rows"]:
            row["figures"]["ns"]["median"] *= 3
            row["figures"]["ns"]["ratio"] *= 2
        with open(paths[1], "w") as file:
            json.dump(document, file)
        compared = run_json("trade", "--compare", *paths)
        self.assertAlmostEqual(compared["times_b_over_a"], 3)
        self.assertAlmostEqual(compared["ratios_b_over_a"], 2)
        self.assertEqual(compared["figures_in_both"], len(compared["figures"]))
        self.assertEqual({figure["dial"] for figure in compared["figures"]}, {"root"})
        text = run("trade", "--compare", *paths, "--out", self.path("both"))
        self.assertEqual(text.returncode, 0, text.stderr)
        self.assertIn("b/a", text.stdout)
        self.assertIn("report.html", os.listdir(self.path("both")))

    def test_what_makes_no_sense_is_refused(self):
        self.assert_refused(run("trade", "--dial", "bugdet"), [2], "--dial: must be", "'bugdet'", "did you mean budget?")
        self.assert_refused(run("trade", "--dial", "root,,budget"), [2], "--dial: must be names", "'root,,budget'")
        self.assert_refused(run("trade", "--seed", -1), [2], "--seed", "-1")
        self.assert_refused(run("trade", "--dial", "root", "--dem", self.path("no.tif")), [1], "no.tif")
        self.assert_refused(run("trade", "--compare", "a.json"), [2], "--compare needs two files, got 1")
        self.assert_refused(run("trade", "--compare", "a.json", "b.json", "c.json"), [2], "got 3")
        self.assert_refused(run("trade", "--compare", "a", "b", "--quick"), [2], "--quick goes without --compare")
        self.assert_refused(run("trade", "--compare", self.path("no.json"), "b"), [1], "cannot read", "no.json")
        good = self.path("good")
        run_json("trade", "--quick", "--dial", "root", "--out", good)
        with open(os.path.join(good, "trade.json")) as file:
            text = file.read()
        foreign = {"empty.json": ("", "no JSON"), "list.json": ("[]", "format"), "other.json": ('{"format":"page"}', "format"),
                   "cut.json": (text[:len(text) // 2], "no JSON"),
                   "version.json": (text.replace('"format_version":1', '"format_version":2'), "format_version"),
                   "rows.json": (text.replace('"rows":', '"lines":'), "rows"),
                   "words.json": (text.replace('"median":', '"middle":'), "reference_loop_ms"),
                   "figure.json": ('"middle":'.join(text.rsplit('"median":', 1)), "no number 'median'")}
        for name, (content, word) in foreign.items():
            with self.subTest(name):
                with open(self.path(name), "w") as file:
                    file.write(content)
                self.assert_refused(run("trade", "--compare", os.path.join(good, "trade.json"), self.path(name)), [1],
                                    name, "is no trade.json", word)


class Presets(Folder):
    FLY = ("fly", "--seed", 5, "--seconds", 0.1, "--fps", 10)

    def test_a_preset_is_its_flags_and_a_given_flag_prevails(self):
        def figures(*arguments):
            summary = run_json(*self.FLY, "--threads", 0, *arguments)
            return {key: summary[key] for key in ("triangles_max", "error_px_max", "memory_bytes")}

        document = run_json("trade", "--quick", "--dial", "root")
        flags = {preset["name"]: preset["flags"] for preset in document["presets"]}
        own = {"--budget", "--max-error-px", "--memory-mb"}
        spelled = [word for flag, value in flags["fast"].items() if flag in own for word in (flag, value)]
        self.assertEqual(figures("--preset", "fast"), figures(*spelled))
        self.assertNotEqual(figures("--preset", "fast"), figures())
        for order in (("--budget", 2000, "--preset", "fast"), ("--preset", "fast", "--budget", 2000)):
            self.assertLessEqual(figures(*order)["triangles_max"], 2000)

    def test_commands_take_presets(self):
        _, raster = self.hills()
        drop = ("drop", "--dem", raster, "--count", 3, "--seconds", 0.5)
        drops = {name: run_json(*drop, "--preset", name) for name in ("fast", "balanced", "accurate")}
        self.assertEqual([drops[name]["steps"] for name in drops], [15, 30, 150])
        hashes = {name: figures["state_hash"] for name, figures in drops.items()}
        self.assertEqual(hashes["fast"], run_json(*drop, "--dt", "1/30", "--substep", "1/60")["state_hash"])
        self.assertNotEqual(hashes["fast"], run_json(*drop, "--dt", "1/30")["state_hash"])
        for command in (("drive", "--seconds", 0.2), ("walk", "--seconds", 2), ("page", "--seconds", 0.2),
                        ("mesh", "--out", self.path("a.ply"))):
            with self.subTest(command[0]):
                run_json(*command, "--dem", raster, "--preset", "fast")
        # a preset's memory, which a flag replaces
        height = [{"op": "height", "x": 0, "y": 0}]
        answer, = ask(["--dem", raster, "--preset", "fast"], height)
        self.assertEqual(answer["status"], "ok")
        done = run("query", "--dem", raster, "--preset", "fast", "--memory-mb", 0.01)
        self.assert_refused(done, [1], "--memory-mb", "0.01")

    def test_another_name_is_refused(self):
        self.assert_refused(run(*self.FLY, "--preset", "fats"), [2], "--preset: must be fast, balanced or accurate", "'fats'",
                            "did you mean fast?")
        self.assert_refused(run("info", "--seed", 5, "--preset", "fast"), [2], "--preset is not a flag of info")


if __name__ == "__main__":
    main()
