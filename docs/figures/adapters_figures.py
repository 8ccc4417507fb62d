# SPDX-License-Identifier: MIT
"""Figure of adapters.md."""
import math

import recordings as kept
from svg import Figure

# A section of the ground of seed 7 along y = 0, on a row of samples, where the surface is straight between samples.
WEST, EAST = -22, 2
BALL, BOX = 0.9, [1.5, 0.3, 0.6]
BALL_AT, BOX_AT, TYRE_AT, PLANE_AT = -20.0, -16.5, -3.4, -0.2
WINDOW = (-13, -8)  # of samples
OVERLAP = 0.1  # of ball and box, metres


def section(program):
    """Samples; positions and contacts of a ball and a box; answers below a tyre and an aircraft."""
    flags = ["--seed", "7"]
    shapes = [{"sphere": {"radius": BALL}}, {"box": {"half_extents": BOX}}]
    asked = kept.ask(program, flags, [{"op": "height", "x": x, "y": 0} for x in [*range(WEST, EAST + 1), TYRE_AT, PLANE_AT]])
    casts = kept.ask(program, flags, [{"op": "cast", "shape": shape, "position": [x, 0, 30], "to": [x, 0, 10]}
                                      for shape, x in zip(shapes, (BALL_AT, BOX_AT))])
    positions = [[x, 0, 30 - 20 * cast["fraction"] - OVERLAP] for x, cast in zip((BALL_AT, BOX_AT), casts)]
    found = kept.ask(program, flags, [{"op": "find", "shape": shape, "position": position} for shape, position in zip(shapes, positions)])
    return {"samples": [answer["height"] for answer in asked[:-2]], "positions": positions, "contacts": [answer["contacts"] for answer in found],
            "below": [{key: answer[key] for key in ("height", "normal")} for answer in asked[-2:]]}


def adapters():
    answers = kept.load("section")
    figure = Figure("adapters", 900, 400, "What each engine gets from the ground",
                    "A section of the ground with a ball and a box at their contacts, a window of samples, a tyre with the height and the "
                    "normal below it, and an aircraft with its height above the ground.")
    scale, lowest = 36.0, 9.0

    def px(x, z):
        return (18 + (x - WEST) * scale, 385 - (z - lowest) * scale)

    surface = [(x, z) for x, z in zip(range(WEST, EAST + 1), answers["samples"])]
    figure.polygon([px(*p) for p in surface] + [px(EAST, lowest), px(WEST, lowest)], "wash-ground")
    figure.polyline([px(*p) for p in surface], "line-ground", 2.5)
    for p in surface:
        figure.circle(px(*p), 2.5, "fill-ground", 0.0)

    # Contacts of Bullet and ODE.
    (x, _, z), (u, _, w) = answers["positions"]
    figure.circle(px(x, z), BALL * scale, "line-blue", 2.0)
    figure.polyline([px(u + a * BOX[0], w + b * BOX[2]) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))], "line-blue", 2.0)
    for contact in [contact for contacts in answers["contacts"] for contact in contacts]:
        foot, n = contact["point"], contact["normal"]
        figure.arrow(px(foot[0], foot[2]), px(foot[0] + 1.6 * n[0], foot[2] + 1.6 * n[2]), "red", 2.0)
        figure.circle(px(foot[0], foot[2]), 3.5, "fill-red", 0.0)
    figure.lines((18, 24), ["Bullet, ODE:", "triangles, contacts"], "blue")

    # The height field of MuJoCo and DART, over its lowest ground.
    heights = dict(surface)
    low = min(heights[x] for x in range(WINDOW[0], WINDOW[1] + 1))
    for x in range(WINDOW[0], WINDOW[1] + 1):
        figure.line(px(x, low), px(x, heights[x]), "line-violet", 2.0)
        figure.circle(px(x, heights[x]), 4.5, "fill-violet", 0.0)
    figure.line(px(WINDOW[0], low), px(WINDOW[1], low), "line-violet", 2.0, "5 4")
    figure.lines((px(WINDOW[0], 0)[0] - 6, 92), ["MuJoCo, DART:", "a window of heights", "over its lowest one"], "violet")

    tyre, plane = answers["below"]
    n = tyre["normal"]
    radius = 0.7
    centre = (TYRE_AT + 0.1, tyre["height"] + radius + 0.25)
    figure.circle(px(*centre), radius * scale, "line-green", 3.0)
    figure.circle(px(*centre), 4.0, "fill-green", 0.0)
    figure.line(px(*centre), px(TYRE_AT, tyre["height"]), "line-green", 1.5, "4 3")
    figure.arrow(px(TYRE_AT, tyre["height"]), px(TYRE_AT + 1.8 * n[0], tyre["height"] + 1.8 * n[2]), "green", 2.0)
    figure.lines((px(TYRE_AT, 0)[0] - 80, 162), ["Chrono:", "height, normal", "below a wheel"], "green")

    z = 15.6
    at = px(PLANE_AT, z)
    figure.polygon([(at[0] - 34, at[1] + 5), (at[0] - 34, at[1] - 12), (at[0] - 24, at[1] - 3), (at[0] + 26, at[1] - 3), (at[0] + 34, at[1] + 5)],
                   "fill-ink")
    figure.arrow((at[0], at[1] + 6), px(PLANE_AT, plane["height"]), "ink", 2.0, both=True)
    figure.text((at[0] + 6, at[1] + 60), f"{z - plane['height']:.1f} m", "ink")
    figure.lines((at[0] - 90, at[1] - 52), ["JSBSim, X-Plane:", "height above ground"], "ink")
    return figure


def recordings():
    return {"section": section}


def figures():
    return [adapters()]
