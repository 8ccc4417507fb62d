# SPDX-License-Identifier: MIT
"""Figure of measurements.md, from a table of that page."""
import pathlib
import re

from svg import Axes, Figure

PAGE = pathlib.Path(__file__).resolve().parents[1] / "measurements.md"
COLUMNS = (("fast", "green"), ("balanced", "blue"), ("accurate", "violet"), ("Bullet", "red"))
DROPS = ("boxes", "mixed", "capsules", "spheres")


def table():
    """{drop: (milliseconds, millimetres) of each column}"""
    rows = {}
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        found = [re.fullmatch(r"(\d+); ([\d.]+) mm", cell) for cell in cells[1:]]
        if cells[0] in DROPS and len(found) == len(COLUMNS) and all(found):
            rows[cells[0]] = [(float(match[1]), float(match[2])) for match in found]
    assert set(rows) == set(DROPS), f"measurements.md has no such table: {rows}"
    return rows


def preset_drops():
    figure = Figure("preset_drops", 900, 440, "Penetration against time of drops, by preset, and with Bullet",
                    "Four drops with three presets and with Bullet: with all presets the deepest penetration is below 4 mm, with Bullet it is "
                    "150 to 200 mm.")
    axes = Axes(figure, 74, 46, 600, 330, (10.0, 1000.0), (0.4, 400.0), log_x=True, log_y=True)
    axes.frame([(v, f"{v}") for v in (10, 30, 100, 300, 1000)], [(v, f"{v:g}") for v in (1, 10, 100)],
               "milliseconds for a simulated second", "deepest penetration, mm")

    def mark(at, drop, role):
        x, y = at
        if drop == "boxes":
            figure.rectangle(x - 6, y - 6, 12, 12, f"line-{role}", 2.5)
        elif drop == "mixed":
            figure.polyline([(x - 6, y - 6), (x + 6, y + 6)], f"line-{role}", 2.5)
            figure.polyline([(x - 6, y + 6), (x + 6, y - 6)], f"line-{role}", 2.5)
        elif drop == "capsules":
            figure.rectangle(x - 4, y - 8, 8, 16, f"line-{role}", 2.5, 4.0)
        else:
            figure.circle(at, 6.5, f"line-{role}", 2.5)

    for drop, cells in table().items():
        for (_, role), (time, depth) in zip(COLUMNS, cells):
            mark(axes.at(time, depth), drop, role)
    for i, (name, role) in enumerate(COLUMNS):
        figure.text((710, 70 + 24 * i), name, role, 15, bold=True)
    for i, drop in enumerate(DROPS):
        mark((718, 200 + 28 * i), drop, "ink")
        figure.text((740, 205 + 28 * i), drop)
    return figure


def figures():
    return [preset_drops()]
