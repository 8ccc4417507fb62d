#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Runs `terrane drive` with every vehicle along every built-in path over nine grounds.

  drives.py --terrane build/release/tools/terrane [--data ../shared/data] [--seed 3] [--only PATTERN] [--jobs 2]

The grounds are the four kinds of fractal, the raster of tools/data alone, with detail, in its forest and over its
cave, and a raster of Mount St. Helens below --data. A row whose file is absent is skipped.

Prints a row for each drive, then the shares by ground and by vehicle. A drive is "never stuck" if its `stuck_s` is 0;
it is "on wheels" if it never rolled over. Exit code 1 where a share is below its limit, 2 where a drive failed.
"""
import argparse
import concurrent.futures
import itertools
import json
import os
import re
import subprocess
import sys

VEHICLES = ("truck", "tracked", "six-wheeler")
PATHS = ("straight", "orbit", "canyon", "turns")
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def find_grounds(seed, data):
    """The flags of each ground, by name, and the file that it needs, if any."""
    own = os.path.join(ROOT, "tools", "data")
    raster = os.path.join(own, "jacksboro.tif")
    grounds = {kind: (["--fractal", kind, "--seed", seed], None) for kind in ("fbm", "ridged", "hybrid", "warped")}
    grounds["jacksboro"] = (["--dem", raster], raster)
    grounds["detailed"] = (["--dem", raster, "--seed", "7"], raster)
    for name in ("forest", "cave"):
        scene = os.path.join(own, name + ".json")
        grounds[name] = (["--scene", scene], scene)
    helens = os.path.join(data, "dem", "sthelens_10m.vrt")
    grounds["helens"] = (["--dem", helens], helens)
    return grounds


def drive(terrane, flags, vehicle, path, seconds):
    """The summary of one drive, or the message of its error."""
    done = subprocess.run([terrane, "drive", *flags, "--vehicle", vehicle, "--path", path, "--seconds", seconds,
                           "--fps", "5", "--size", "64x48", "--budget", "500", "--threads", "0", "--json"],
                          capture_output=True, text=True)
    lines = done.stdout.strip().splitlines()
    if not lines or not lines[-1].startswith("{"):
        return f"exit {done.returncode}: {done.stderr.strip()}"
    return json.loads(lines[-1])


def row(ground, vehicle, path, result):
    if isinstance(result, str):
        return f"| {ground} | {vehicle} | {path} | FAILED: {result} |"
    stuck_at = result.get("stuck_at")
    place = "" if not stuck_at else " ".join(f"{float(v):.0f}" for v in stuck_at)
    return (f"| {ground} | {vehicle} | {path} | {result['path_share']:.2f} | {result['distance_m']:.0f} | "
            f"{result['stuck_s']:.1f} | {place} | {'rolled over' if result['rolled_over'] else ''} |")


def share_line(name, results):
    never = sum(r["stuck_s"] == 0 for r in results)
    upright = sum(not r["rolled_over"] for r in results)
    return f"| {name} | {len(results)} | {never} | {upright} |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--terrane", required=True, help="the program")
    parser.add_argument("--data", default=os.path.join(ROOT, "..", "shared", "data"), help="folder of further rasters")
    parser.add_argument("--seed", default="3", help="of the fractals")
    parser.add_argument("--seconds", default="60", help="of each drive")
    parser.add_argument("--only", default="", help="a regular expression; drives whose 'ground vehicle path' has it")
    parser.add_argument("--jobs", type=int, default=2, help="drives at once")
    parser.add_argument("--least-never-stuck", type=float, default=0.9, help="limit of this share")
    parser.add_argument("--least-on-wheels", type=float, default=1.0, help="limit of this share")
    options = parser.parse_args()

    grounds = find_grounds(options.seed, options.data)
    for name, (_, file) in list(grounds.items()):
        if file and not os.path.exists(file):
            print(f"{name} is skipped: there is no {file}")
            del grounds[name]
    drives = [each for each in itertools.product(grounds, VEHICLES, PATHS)
              if re.search(options.only, " ".join(each))]
    if not drives:
        sys.exit(f"no drive matches '{options.only}'")
    print("| ground | vehicle | path | share | distance m | stuck s | stuck at | |")
    print("|---|---|---|---|---|---|---|---|", flush=True)
    results = {}
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        def run(each):
            ground, vehicle, path = each
            return drive(options.terrane, grounds[ground][0], vehicle, path, options.seconds)
        for each, result in zip(drives, pool.map(run, drives)):
            print(row(*each, result), flush=True)
            results[each] = result
    failed = sum(isinstance(r, str) for r in results.values())
    good = {each: r for each, r in results.items() if not isinstance(r, str)}
    print("\n| | drives | never stuck | on wheels |\n|---|---|---|---|")
    for index, names in ((0, grounds), (1, VEHICLES), (2, PATHS)):
        for name in names:
            some = [r for each, r in good.items() if each[index] == name]
            if some:
                print(share_line(name, some))
    print(share_line("all", list(good.values())))
    if failed:
        print(f"{failed} drives failed")
        return 2
    never = sum(r["stuck_s"] == 0 for r in good.values()) / len(good)
    upright = sum(not r["rolled_over"] for r in good.values()) / len(good)
    print(f"never stuck {100 * never:.0f} %, on wheels {100 * upright:.0f} %")
    return 0 if never >= options.least_never_stuck and upright >= options.least_on_wheels else 1


if __name__ == "__main__":
    sys.exit(main())
