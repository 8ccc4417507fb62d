# SPDX-License-Identifier: MIT
"""Prints a table: what the same flight and drop cost in each scene.

    table.py BUILD_DIR [ROUNDS [FRAMES]]

Each scene is played by the program that links only what it needs, and the plane also by the one that links every component.
Programs take turns, so that a busy machine slows all of them; times are medians over the rounds, as ratios to the plane.
"""
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

ROWS = [("plane", "plain"), ("dem", "dem"), ("dem_detail", "dem"), ("objects", "objects"), ("volumes", "volumes"),
        ("bodies", "plain"), ("all", "scene"), ("plane", "scene")]
NAMES = {"plane": "a plane", "dem": "a DEM", "dem_detail": "the DEM with detail", "objects": "the plane with 20,000 trees",
         "volumes": "the plane with a pit and a tunnel", "bodies": "the plane with 1000 bodies",
         "all": "the DEM with detail, trees, pit, tunnel and 1000 bodies"}
MIB = 1 << 20


def libraries(program):
    """Paths of the shared libraries that a program loads, without the loader and the kernel's."""
    listed = subprocess.run(["ldd", program], capture_output=True, text=True, check=True).stdout
    return [pathlib.Path(line.split(" => ")[1].split()[0]).resolve() for line in listed.splitlines() if " => /" in line]


def stripped_bytes(program):
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "stripped"
        subprocess.run(["strip", "-o", out, program], check=True)
        return out.stat().st_size


def play(program, scene, frames):
    run = subprocess.run([program, scene, str(frames)], capture_output=True, text=True, check=True)
    return json.loads(run.stdout)


def main():
    folder = pathlib.Path(sys.argv[1]) / "tests/cost"
    rounds = int(sys.argv[2]) if len(sys.argv) > 2 else 5
    frames = int(sys.argv[3]) if len(sys.argv) > 3 else 300
    program_of = {row: folder / f"{row[1]}_cost" for row in ROWS}
    runs = {row: [] for row in ROWS}
    for _ in range(rounds):
        for row in ROWS:
            runs[row].append(play(program_of[row], row[0], frames))

    first = runs[ROWS[0]]
    print("| scene | program | flight and drop | setup, ms | triangles a frame | allocated, MiB | peak, MiB | threads | "
          "libraries | of them, MiB | program, kB |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for row in ROWS:
        scene, program = row
        played = runs[row]
        # Against the plane of the same round.
        ratio = statistics.median(run["play_ms"] / plane["play_ms"] for run, plane in zip(played, first))
        setup = statistics.median(run["setup_ms"] for run in played)
        last = played[-1]
        triangles = (last["ground_triangles"] + last["object_triangles"]) // frames
        loaded = libraries(program_of[row])
        print(f"| {NAMES[scene]} | `{program}_cost` | {ratio:.3g} | {setup:.0f} | {triangles} "
              f"| {last['allocated_bytes'] / MIB:.1f} | {last['peak_bytes'] / MIB:.0f} | {last['threads']} "
              f"| {len(loaded)} | {sum(path.stat().st_size for path in loaded) / MIB:.0f} "
              f"| {stripped_bytes(program_of[row]) / 1000:.0f} |")
    plane_ms = statistics.median(run["play_ms"] for run in first)
    print(f"\nThe plane takes {plane_ms / frames:.3g} ms a frame and step; {rounds} rounds of {frames} frames.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
