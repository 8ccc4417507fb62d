# SPDX-License-Identifier: MIT
"""Figures of promises.md."""
from svg import Figure


def promise_map():
    figure = Figure("promise_map", 900, 365, "Where each promise is kept",
                    "Data flow from a height source through the pager to the triangulator and the renderer, and to ground "
                    "queries and bodies; each stage is marked with the promises that it keeps.")

    def stage(x, y, width, title, text, promises, role):
        figure.rectangle(x, y, width, 96, f"line-{role}", 2.0, 8.0)
        figure.text((x + 14, y + 25), title, role, 15, bold=True)
        figure.text((x + 14, y + 49), text)
        figure.text((x + 14, y + 79), promises, "red", 15, bold=True)

    stage(20, 130, 170, "height source", "heights, bounds", "P3", "ground")
    stage(240, 130, 200, "pager", "chunks in memory", "P4 P5 P6", "ground")
    stage(500, 40, 190, "triangulator", "one frame's mesh", "P1 P2 P3 P4", "green")
    stage(740, 40, 140, "renderer", "a picture", "P2", "green")
    stage(500, 220, 190, "ground", "one contact level", "P3 P7", "blue")
    stage(740, 220, 140, "bodies", "poses", "P8", "blue")
    for a, b in (((190, 178), (240, 178)), ((440, 160), (500, 100)), ((440, 196), (500, 256)), ((690, 88), (740, 88)),
                 ((690, 268), (740, 268))):
        figure.arrow(a, b)
    everywhere = "All stages: P9 same bits, P10 counted faults, P11 pay for what you use, P12 one dial"
    figure.text((20, 340), everywhere, "red", 15)
    return figure


def figures():
    return [promise_map()]
