# SPDX-License-Identifier: MIT
"""What a batch of heights costs through numpy, compared with the same loop in C++ in the same run.

    benchmark.py [--quick] PROGRAM     PROGRAM: python_heights_benchmark
"""
import os
import subprocess
import sys
import tempfile
import time

import numpy as np

import terrane

from grounds import SEED, loaded, small_fractal


def milliseconds(call, rounds):
    spent = []
    for _ in range(rounds):
        begin = time.perf_counter()
        call()
        spent.append(1e3 * (time.perf_counter() - begin))
    return spent


def main():
    quick = "--quick" in sys.argv
    program = sys.argv[-1]
    count, rounds, turns = (10_000, 2, 1) if quick else (1_000_000, 5, 7)
    x, y = np.random.default_rng(SEED).uniform(-99, 99, (2, count))
    ground = loaded(small_fractal()).frame.ground
    out = ground.heights(x, y)
    batch = terrane.GroundBatch(worker_count=1)
    times = {"C++ loop": [], "numpy, out given": [], "numpy, new arrays": [], "numpy, GroundBatch": []}
    with tempfile.TemporaryDirectory() as folder:
        points = os.path.join(folder, "points")
        np.concatenate([x, y]).tofile(points)
        for _ in range(turns):  # in turns, so that all see the same machine
            told = subprocess.run([program, points, str(rounds)], check=True, capture_output=True, text=True)
            times["C++ loop"] += map(float, told.stdout.split())
            times["numpy, out given"] += milliseconds(lambda: ground.heights(x, y, out=out), rounds)
            times["numpy, new arrays"] += milliseconds(lambda: ground.heights(x, y), rounds)
            times["numpy, GroundBatch"] += milliseconds(lambda: batch.heights(ground, x, y, out=out), rounds)
    base = np.median(times["C++ loop"])
    print(f"{count} heights, medians of {turns * rounds}, seed {SEED}")
    for name, spent in times.items():
        median = np.median(spent)
        print(f"{name:18} {median:9.3f} ms  {1e6 * median / count:7.1f} ns a height  {median / base:6.3f} of the C++ loop")


main()
