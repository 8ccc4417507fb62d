#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Runs `terrane drop` over every shape, speed and step length, on a raster and on a fractal.

  drop_matrix.py --terrane build/release/tools/terrane --dem FILE --seed N [--count 1000] [--seconds 3]

Prints a table; exit code 0 where nothing fell, nothing parked, and no more than 5 % of the time was lost.
"""
import argparse
import itertools
import json
import subprocess
import sys


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--terrane", required=True, help="the program")
    parser.add_argument("--dem", required=True, help="a raster")
    parser.add_argument("--seed", default="1", help="of the fractal")
    parser.add_argument("--count", default="1000")
    parser.add_argument("--seconds", default="3")
    parser.add_argument("--spin", default="20")
    options = parser.parse_args()

    terrains = {"raster": ["--dem", options.dem], "fractal": ["--seed", options.seed]}
    runs = itertools.product(terrains, ("sphere", "capsule", "box", "hull", "compound"), ("0", "300", "3000"), ("1/60", "1/10"))
    print("| terrain | shape | m/s | dt | fell | parked | left | lost | max depth m | step ms median |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    failures = 0
    for terrain, shape, speed, dt in runs:
        command = [options.terrane, "drop", *terrains[terrain], "--shape", shape, "--speed", speed, "--dt", dt,
                   "--count", options.count, "--seconds", options.seconds, "--spin", options.spin, "--json"]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"{' '.join(command)}: exit {done.returncode}: {done.stderr.strip()}")
        r = json.loads(done.stdout.strip().splitlines()[-1])
        is_good = r["fell_through"] == 0 and r["parked"] == 0 and r["lost_time_share"] <= 0.05
        failures += not is_good
        print(f"| {terrain} | {shape} | {speed} | {dt} | {r['fell_through']} | {r['parked']} | {r['left_world']} | "
              f"{r['lost_time_share']:.4f} | {r['max_depth_m']:.4f} | {r['step_ms_median']:.1f} |"
              f"{'' if is_good else ' FAILED'}", flush=True)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
