#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Drops bodies with `terrane drop --trace` and judges the trace with trace_judge.

The judge builds the contact surface independently: from the samples of a raster (read through GDAL), or, for
fractal ground, from heights of `terrane query` at lattice points below the bodies. Queries at cell centres give the
diagonals of the cells.

  judge_drop.py --terrane build/release/tools/terrane --judge build/release/tests/judge/trace_judge \\
                --dem FILE | --seed N  [--shape box] [--speed 3000] [--dt 0.1] [--count 1000] [--seconds 3]

Prints one JSON object a run; exit code 0 where every trace is accepted.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile

import numpy

SHAPE_REACH_M = 2.5  # reach of the widest shape, with a margin


def run_json(command, stdin=None):
    done = subprocess.run(command, input=stdin, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command[:3])}: exit {done.returncode}: {done.stderr.strip()}")
    return json.loads(done.stdout.strip().splitlines()[-1])


def query_heights(terrane, terrain, points):
    """Heights of the contact surface; NaN where there is none."""
    lines = "".join(f'{{"id":{i},"op":"height","x":{x!r},"y":{y!r}}}\n' for i, (x, y) in enumerate(points))
    done = subprocess.run([terrane, "query", *terrain], input=lines, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"terrane query: exit {done.returncode}: {done.stderr.strip()}")
    heights = numpy.full(len(points), numpy.nan)
    for line in done.stdout.splitlines():
        answer = json.loads(line)
        if answer["status"] == "ok":
            heights[answer["id"]] = answer["height"]
    return heights


def raster_size(path):
    done = subprocess.run(["gdalinfo", "-json", path], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"gdalinfo {path}: {done.stderr.strip()}")
    return json.loads(done.stdout)["size"]


def find_parity(terrane, terrain, spacing, west, south, columns):
    """0 where cells with an even index sum are split from south-west to north-east."""
    points = []
    for column, row in columns:
        x, y = west + column * spacing, south + row * spacing
        points += [(float(x + dx * spacing), float(y + dy * spacing))
                   for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1), (0.5, 0.5))]
    heights = query_heights(terrane, terrain, points).reshape(-1, 5)
    votes = [0, 0]
    for (column, row), (sw, se, nw, ne, middle) in zip(columns, heights):
        to_north_east, to_north_west = 0.5 * (sw + ne), 0.5 * (se + nw)
        if not abs(to_north_east - to_north_west) > 1e-3:
            continue
        is_north_east = abs(middle - to_north_east) < abs(middle - to_north_west)
        votes[(int(column + row) + (0 if is_north_east else 1)) % 2] += 1
    if min(votes) > 0 or max(votes) == 0:
        sys.exit(f"cells do not alternate: votes {votes}")
    return 0 if votes[0] else 1


def points_under(trace, spacing, west, south):
    """Lattice points of all cells that may have been below a body."""
    poses = numpy.loadtxt(trace, delimiter=",", skiprows=1, usecols=(2, 3), ndmin=2)
    poses = numpy.unique(poses, axis=0)
    low = numpy.floor((poses - SHAPE_REACH_M - (west, south)) / spacing).astype(numpy.int64)
    high = numpy.floor((poses + SHAPE_REACH_M - (west, south)) / spacing).astype(numpy.int64) + 1
    found = set()
    for (c0, r0), (c1, r1) in set(zip(map(tuple, low), map(tuple, high))):
        found.update((c, r) for c in range(c0, c1 + 1) for r in range(r0, r1 + 1))
    return numpy.array(sorted(found), dtype=numpy.int64)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--terrane", required=True)
    parser.add_argument("--judge", required=True)
    ground = parser.add_mutually_exclusive_group(required=True)
    ground.add_argument("--dem", help="a projected raster with square cells")
    ground.add_argument("--seed", type=int)
    parser.add_argument("--shape", default="mixed")
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--speed", type=float, default=0.0)
    parser.add_argument("--spin", type=float, default=0.0)
    parser.add_argument("--dt", type=float, default=1.0 / 60.0)
    parser.add_argument("--seconds", type=float, default=3.0)
    parser.add_argument("--by-query", action="store_true", help="heights of a raster through queries, too")
    arguments = parser.parse_args()

    terrain = ["--dem", arguments.dem] if arguments.dem else ["--seed", str(arguments.seed)]
    info = run_json([arguments.terrane, "info", *terrain, "--json"])
    with tempfile.TemporaryDirectory() as folder:
        trace = os.path.join(folder, "trace.csv")
        drop = run_json([arguments.terrane, "drop", *terrain, "--shape", arguments.shape,
                         "--count", str(arguments.count), "--speed", repr(arguments.speed),
                         "--spin", repr(arguments.spin), "--dt", repr(arguments.dt),
                         "--seconds", repr(arguments.seconds), "--trace", trace, "--json"])
        judge = [arguments.judge, "--trace", trace, "--shape", arguments.shape, "--allow-unjudged"]
        spacing = info["finest_spacing_m"]
        west, south = 0.0, 0.0
        if arguments.dem:
            columns, rows = raster_size(arguments.dem)
            west, south = (0.5 - 0.5 * columns) * spacing, (0.5 - 0.5 * rows) * spacing
        if arguments.dem and not arguments.by_query:
            cells = [(columns // 2 + i % 20, rows // 2 + i // 20) for i in range(400)]
            parity = find_parity(arguments.terrane, terrain, spacing, west, south, cells)
            judge += ["--dem", arguments.dem, "--parity", str(parity), "--slack", "0.0005"]
        else:
            points = points_under(trace, spacing, west, south)
            middle = points[len(points) // 2]
            cells = [(middle[0] + i % 20, middle[1] + i // 20) for i in range(400)]
            parity = find_parity(arguments.terrane, terrain, spacing, west, south, cells)
            places = [(float(west + c * spacing), float(south + r * spacing)) for c, r in points]
            heights = query_heights(arguments.terrane, terrain, places)
            table = os.path.join(folder, "heights.txt")
            with open(table, "w", encoding="utf-8") as file:
                file.write(f"{spacing!r} {west!r} {south!r} {parity}\n")
                file.writelines(f"{c} {r} {z!r}\n" for (c, r), z in zip(points.tolist(), heights.tolist())
                                if z == z)
            judge += ["--heights", table]
        judged = subprocess.run(judge, capture_output=True, text=True)
        verdict = json.loads(judged.stdout) if judged.stdout else {"error": judged.stderr.strip()}
    holds = judged.returncode == 0 and drop["fell_through"] == verdict["too_deep"] == 0
    print(json.dumps({"terrain": terrain[1], "shape": arguments.shape, "speed": arguments.speed,
                      "dt": arguments.dt, "drop": drop, "judge": verdict, "holds": holds}))
    if judged.stderr:
        print(judged.stderr.strip(), file=sys.stderr)
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())
