#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`terrane trade`: a few dials, the form of trade.json, its fronts, two runs side by side, what is refused; --preset."""

import json
import os
import re

from program import SMALL_WORLD, Folder, ask, main, run, run_json

SHORT = ("trade", "--quick", "--dial", "root,pair-measure,swept-measure,extremes")


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
        self.assertEqual([table["key"] for table in document["tables"]], ["pair-measure", "swept-measure", "root", "extremes"])
        self.assertEqual({table["terrain"] for table in document["tables"]}, {""})
        pair, swept, root, extremes = document["tables"]
        disorder = {row["label"]: row["figures"]["disorder"]["median"] for row in pair["rows"]}
        self.assertEqual(disorder["distance"], 0)
        self.assertGreater(disorder["test"], disorder["pseudodistance"])
        disorder = {row["label"]: row["figures"]["disorder"]["median"] for row in swept["rows"]}
        self.assertEqual(len(disorder), 3 * 4)
        for shapes in ("two spheres", "sphere and capsule", "two capsules"):
            self.assertEqual(disorder[shapes + ", pseudodistance"], 0)
            self.assertGreater(disorder[shapes + ", test"], 0)
        self.assertEqual([row["figures"]["unlike_pairs"]["median"] for row in root["rows"]], [0, 0])
        self.assertEqual(len(extremes["findings"]), 1)
        self.assertEqual(root["findings"], ["No value of this dial changes the pairs ordered unlike the squares here: 0."])
        self.assertEqual(pair["findings"], [])
        self.assertEqual(sorted(os.listdir(out)), ["report.html", "terrane-files.txt", "trade.json"])
        self.assertEqual(json.loads(self.read("out/trade.json")), document)
        page = self.read("out/report.html").decode()
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

    def test_two_runs_side_by_side(self):
        good = self.path("a/trade.json")
        document = run_json("trade", "--quick", "--dial", "root", "--out", self.path("a"))
        text = self.read("a/trade.json").decode()
        for row in document["tables"][0]["rows"]:
            row["figures"]["ns"]["median"] *= 3
            row["figures"]["ns"]["ratio"] *= 2
        paths = [good, self.write("b.json", json.dumps(document))]
        compared = run_json("trade", "--compare", *paths)
        self.assertAlmostEqual(compared["times_b_over_a"], 3)
        self.assertAlmostEqual(compared["ratios_b_over_a"], 2)
        self.assertEqual(compared["figures_in_both"], len(compared["figures"]))
        self.assertEqual({figure["dial"] for figure in compared["figures"]}, {"root"})
        done = run("trade", "--compare", *paths, "--out", self.path("both"))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("b/a", done.stdout)
        self.assertIn("report.html", os.listdir(self.path("both")))

        for name, content, word in (
                ("empty.json", "", "no JSON"), ("list.json", "[]", "format"), ("other.json", '{"format":"page"}', "format"),
                ("cut.json", text[:len(text) // 2], "no JSON"),
                ("version.json", text.replace('"format_version":1', '"format_version":2'), "format_version"),
                ("rows.json", text.replace('"rows":', '"lines":'), "rows"),
                ("words.json", text.replace('"median":', '"middle":'), "reference_loop_ms"),
                ("figure.json", '"middle":'.join(text.rsplit('"median":', 1)), "no number 'median'")):
            with self.subTest(name):
                self.assert_refused(run("trade", "--compare", good, self.write(name, content)), [1], name,
                                    "is no trade.json", word)


class Presets(Folder):
    def test_a_preset_is_its_flags_and_a_given_flag_prevails(self):
        def figures(*arguments):
            summary = run_json("fly", *SMALL_WORLD, "--seconds", 0.1, "--fps", 10, "--threads", 0, *arguments)
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
        answer, = ask(["--dem", raster, "--preset", "fast"], [{"op": "height", "x": 0, "y": 0}])
        self.assertEqual(answer["status"], "ok")


if __name__ == "__main__":
    main()
