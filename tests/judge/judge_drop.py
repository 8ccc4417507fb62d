#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Drops bodies on fractal ground with `terrane drop --trace` and judges the trace with trace_judge.

The judge builds the contact surface independently, from heights of `terrane query` at lattice points below the
bodies. Queries at cell centres give the diagonals of the cells.

  judge_drop.py --terrane build/release/tools/terrane --judge build/release/tests/judge/trace_judge \\
                --seed N  [--shape box] [--speed 3000] [--dt 0.1] [--count 1000] [--seconds 3] [--world-m 4096]

Prints one JSON object; exit code 0 where the trace is accepted.
"""
import argparse
import itertools
import json
import math
import os
import subprocess
import sys
import tempfile

SHAPE_REACH_M = 2.5  # reach of the widest shape, with a margin


def run(command, text=""):
    done = subprocess.run(command, input=text, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command[:3])}: exit {done.returncode}: {done.stderr.strip()}")
    return done.stdout.splitlines()


def query_heights(terrane, terrain, points):
    """Heights of the contact surface by point; none where there is no ground."""
    lines = "".join(f'{{"id":{i},"op":"height","x":{x!r},"y":{y!r}}}\n' for i, (x, y) in enumerate(points))
    answers = map(json.loads, run([terrane, "query", *terrain], lines))
    return {points[answer["id"]]: answer["height"] for answer in answers if answer["status"] == "ok"}


def points_of(cell):
    """Its south-western, south-eastern, north-western and north-eastern corner, and its middle."""
    column, row = cell
    return [(column + i, row + j) for i, j in ((0, 0), (1, 0), (0, 1), (1, 1), (0.5, 0.5))]


def find_parity(heights, cells):
    """0 where cells with an even index sum are split from south-west to north-east."""
    votes = [0, 0]
    for cell in cells:
        sw, se, nw, ne, middle = (heights[point] for point in points_of(cell))
        to_north_east, to_north_west = 0.5 * (sw + ne), 0.5 * (se + nw)
        if abs(to_north_east - to_north_west) <= 1e-3:
            continue
        is_north_east = abs(middle - to_north_east) < abs(middle - to_north_west)
        votes[(sum(cell) + (0 if is_north_east else 1)) % 2] += 1
    if min(votes) > 0 or max(votes) == 0:
        sys.exit(f"cells do not alternate: votes {votes}")
    return 0 if votes[0] else 1


def points_under(trace):
    """Lattice points of all cells that may have been below a body."""
    found = set()
    with open(trace, encoding="utf-8") as file:
        next(file)
        places = {tuple(line.split(",")[2:4]) for line in file}
    for place in places:
        found.update(itertools.product(*(range(math.floor(float(v) - SHAPE_REACH_M),
                                               math.floor(float(v) + SHAPE_REACH_M) + 2) for v in place)))
    return sorted(found)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--terrane", required=True)
    parser.add_argument("--judge", required=True)
    parser.add_argument("--seed", required=True)
    parser.add_argument("--shape", default="mixed")
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--speed", default="0")
    parser.add_argument("--spin", default="0")
    parser.add_argument("--dt", default="1/60")
    parser.add_argument("--seconds", default="3")
    parser.add_argument("--world-m", default="4096", help="side of the world: a small one loads faster")
    arguments = parser.parse_args()

    # Cells of 1 m: a lattice point's column and row are its x and y.
    terrain = ["--seed", arguments.seed, "--world-m", arguments.world_m, "--detail-m", "1"]
    with tempfile.TemporaryDirectory() as folder:
        trace, table = os.path.join(folder, "trace.csv"), os.path.join(folder, "heights.txt")
        drop = json.loads(run([arguments.terrane, "drop", *terrain, "--shape", arguments.shape,
                               "--count", str(arguments.count), "--speed", arguments.speed,
                               "--spin", arguments.spin, "--dt", arguments.dt,
                               "--seconds", arguments.seconds, "--trace", trace, "--json"])[-1])
        points = points_under(trace)
        column, row = points[len(points) // 2]
        cells = list(itertools.product(range(column, column + 20), range(row, row + 20)))
        corners = itertools.chain.from_iterable(map(points_of, cells))
        heights = query_heights(arguments.terrane, terrain, sorted({*points, *corners}))
        with open(table, "w", encoding="utf-8") as file:
            file.write(f"1 0 0 {find_parity(heights, cells)}\n")
            file.writelines(f"{c} {r} {heights[c, r]!r}\n" for c, r in points if (c, r) in heights)
        judged = subprocess.run([arguments.judge, "--trace", trace, "--shape", arguments.shape, "--heights", table],
                                capture_output=True, text=True)
    verdict = json.loads(judged.stdout) if judged.stdout else {"error": judged.stderr.strip()}
    holds = (judged.returncode == 0 and drop["fell_through"] == verdict["too_deep"] == 0
             and verdict["bodies"] == arguments.count)
    print(json.dumps({"terrain": arguments.seed, "shape": arguments.shape, "speed": arguments.speed,
                      "dt": arguments.dt, "drop": drop, "judge": verdict, "holds": holds}))
    if judged.stderr:
        print(judged.stderr.strip(), file=sys.stderr)
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())
