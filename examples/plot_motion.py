#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Plots what the examples of the adapters write: paths from above, and heights over the ground below them.

    bullet_ground motion.csv && plot_motion.py motion.csv motion.png
"""
import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def read(name):
    """{body: {column: [numbers]}}"""
    bodies = {}
    with open(name, newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            columns = bodies.setdefault(row.pop("body"), {})
            for column, number in row.items():
                columns.setdefault(column, []).append(float(number))
    return bodies


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    bodies = read(sys.argv[1])
    if not bodies:
        sys.exit(f"{sys.argv[1]} has no rows")
    figure, (plan, heights) = plt.subplots(1, 2, figsize=(11, 4.5), layout="constrained")
    for name, of in bodies.items():
        line, = plan.plot(of["x"], of["y"], label=name)
        plan.plot(of["x"][-1], of["y"][-1], "o", color=line.get_color(), markersize=4)
        heights.plot(of["time_s"], of["z"], color=line.get_color(), label=name)
        heights.plot(of["time_s"], of["ground_z"], "--", color=line.get_color(), linewidth=0.8)
    plan.set(xlabel="x, m", ylabel="y, m", title="path from above", aspect="equal", adjustable="datalim")
    heights.set(xlabel="time, s", ylabel="z, m", title="height; dashed: the ground below")
    for axes in (plan, heights):
        axes.grid(alpha=0.3)
    heights.legend(fontsize="small")
    figure.savefig(sys.argv[2], dpi=110)


if __name__ == "__main__":
    main()
