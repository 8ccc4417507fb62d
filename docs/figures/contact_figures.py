# SPDX-License-Identifier: MIT
"""Figures of contact.md."""
import math
import pathlib
import re

import recordings as kept
from svg import Axes, Figure

STEP = pathlib.Path(__file__).resolve().parents[2] / "collision/world/solver"


def constant(file, name):
    """A constant of the code: a number, or a quotient of two."""
    found = re.search(rf"constexpr \w+ {name} = ([\d.]+)(?: / ([\d.]+))?;", (STEP / file).read_text())
    if not found:
        raise ValueError(f"{file} has no constant {name}")
    return float(found[1]) / float(found[2] or 1.0)


# Heights of the offset surfaces below the contact surface, and gaps, in tolerances.
FIRST_OFFSET = constant("ground_contact_cache.h", "kFirstOffset")
OFFSET_RATIO = constant("ground_contact_cache.cpp", "kOffsetRatio")
OFFSET_COUNT = int(constant("ground_contact_cache.h", "kOffsetCount"))
STOP_GAP = constant("ground_contact_cache.h", "kStopGap")
SEPARATION_GAP = 0.5 * FIRST_OFFSET
OFFSETS = [1.0 - (1.0 - FIRST_OFFSET) * OFFSET_RATIO ** i for i in range(OFFSET_COUNT)]


def closest_on_segment(p, a, b):
    ux, uy = b[0] - a[0], b[1] - a[1]
    share = ((p[0] - a[0]) * ux + (p[1] - a[1]) * uy) / (ux * ux + uy * uy)
    share = min(1.0, max(0.0, share))
    return (a[0] + share * ux, a[1] + share * uy)


def unit_normal(a, b):
    """Of a profile from west to east: up."""
    length = math.dist(a, b)
    return ((a[1] - b[1]) / length, (b[0] - a[0]) / length)


def definitions():
    figure = Figure("contact_definitions", 900, 440, "Gap, lift, penetration depth and normal cone",
                    "A cross-section of the ground as vertical columns: a ball above it, a box that overlaps a slope, "
                    "and the normal cone at a ridge.")
    scale, bottom = 62.0, 430.0
    profile = [(0.0, 2.1), (1.1, 1.9), (3.9, 1.5), (7.9, 4.2), (9.0, 4.3), (10.7, 4.75), (12.3, 2.5), (14.6, 2.9)]

    def px(p):
        return (p[0] * scale, bottom - p[1] * scale)

    for i, (a, b) in enumerate(zip(profile, profile[1:])):
        figure.polygon([px(a), px(b), (px(b)[0], bottom), (px(a)[0], bottom)], "wash-blue" if i == 2 else "wash-ground")
        if i > 0:
            figure.line(px(a), (px(a)[0], bottom), "line-ground", 1.0, "3 4")
    figure.polyline([px(p) for p in profile], "line-ground", 3.0)

    # A ball apart: the gap to its nearest point.
    centre, radius = (2.0, 3.7), 0.8
    feet = [closest_on_segment(centre, a, b) for a, b in zip(profile, profile[1:])]
    nearest = min(feet, key=lambda q: math.dist(q, centre))
    to_ground = [(nearest[k] - centre[k]) / math.dist(nearest, centre) for k in range(2)]
    low = (centre[0] + radius * to_ground[0], centre[1] + radius * to_ground[1])
    assert math.dist(nearest, centre) > radius
    figure.circle(px(centre), radius * scale, "line-ink", 2.0)
    figure.arrow(px(low), px(nearest), "green", both=True)
    figure.text((px(low)[0] + 16, 0.5 * (px(low)[1] + px(nearest)[1]) + 5), "gap", "green", 15)

    # A box in a slope: lift straight up, depth along the normal.
    a, b = profile[2], profile[3]
    n = unit_normal(a, b)
    turn = math.radians(-12.0)
    middle, half = (5.5, 3.15), (1.5, 0.75)
    corners = [(middle[0] + sx * half[0] * math.cos(turn) - sy * half[1] * math.sin(turn),
                middle[1] + sx * half[0] * math.sin(turn) + sy * half[1] * math.cos(turn))
               for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    deepest = min(corners, key=lambda p: n[0] * (p[0] - a[0]) + n[1] * (p[1] - a[1]))
    depth = -(n[0] * (deepest[0] - a[0]) + n[1] * (deepest[1] - a[1]))
    lift = depth / n[1]
    assert 0.0 < depth < lift
    figure.polyline([px(p) for p in corners + corners[:1]], "line-ink", 2.0)
    freed = [(p[0] + depth * n[0], p[1] + depth * n[1]) for p in corners]
    figure.polyline([px(p) for p in freed + freed[:1]], "line-blue", 1.5, "5 4")
    figure.arrow(px(deepest), px((deepest[0], deepest[1] + lift)), "red", 2.5)
    foot = (deepest[0] + depth * n[0], deepest[1] + depth * n[1])
    figure.arrow(px(deepest), px(foot), "blue", 2.5)
    figure.text((px(deepest)[0] + 12, px(deepest)[1] - 20), "lift", "red", 15)
    figure.text((px(deepest)[0] - 22, px(deepest)[1] + 20), "penetration depth", "blue", 15, "middle")
    figure.text((px(freed[3])[0] + 4, px(freed[3])[1] - 14), "after the minimum translation", "blue")

    # The normal cone of a ridge.
    top = profile[5]
    left, right = unit_normal(profile[4], top), unit_normal(top, profile[6])
    reach = 1.35
    first = math.degrees(math.atan2(right[1], right[0]))
    last = math.degrees(math.atan2(left[1], left[0]))
    angles = [math.radians(first + (last - first) * i / 12) for i in range(13)]
    rim = [px((top[0] + reach * math.cos(t), top[1] + reach * math.sin(t))) for t in angles]
    figure.polygon([px(top), *rim], "wash-violet")
    for n in (left, right):
        figure.arrow(px(top), px((top[0] + reach * n[0], top[1] + reach * n[1])), "violet")
    figure.text((px(top)[0] + 20, px(top)[1] - reach * scale - 14), "normal cone of a ridge", "violet", 15, "middle")
    figure.text((px((12.05, 3.1))[0], px((12.05, 3.1))[1]), "contact surface", "ground", 15)

    figure.lines((px(a)[0] + 12, 386), ["one column: everything", "on or below one triangle"], "blue", 14)
    figure.lines((px(profile[1])[0] + 8, 386), ["solid: all columns,", "no bottom, no sides"], "ground", 14)
    return figure


def offset_surfaces():
    figure = Figure("offset_surfaces", 900, 540, "Offset surfaces",
                    "Left: the contact surface and copies of it that are lowered by parts of the tolerance. Right: the "
                    "lowest part of a body over time: it stops above one offset surface, goes on above the next one, is "
                    "separated and rests.")
    low, high = -1.06, 0.42
    ladder = Axes(figure, 70, 50, 200, 370, (0.0, 1.0), (low, high))
    graph = Axes(figure, 440, 50, 440, 370, (0.0, 10.0), (low, high))

    for axes in (ladder, graph):
        ends = [axes.x_value(0.0), axes.x_value(1.0)]
        corners = [(ends[0], 0.0), (ends[1], 0.0), (ends[1], low), (ends[0], low)]
        figure.polygon([axes.at(x, y) for x, y in corners], "wash-ground")
        for offset in OFFSETS:
            figure.line(axes.at(ends[0], -offset), axes.at(ends[1], -offset), "line-blue", 1.0 if offset < 0.9 else 0.5)
        figure.line(axes.at(ends[0], 0.0), axes.at(ends[1], 0.0), "line-ground", 3.0)
        figure.line(axes.at(ends[0], -1.0), axes.at(ends[1], -1.0), "line-red", 2.5)

    for height in (0.0, -OFFSETS[0], -OFFSETS[1], -OFFSETS[2], -1.0):
        figure.text((62, ladder.at(0, height)[1] + 5), f"{height:.4g}", anchor="end")
    for height, text, role in ((0.0, "contact surface", "ground"), (-OFFSETS[0], "offset surface 0", "blue"),
                               (-OFFSETS[1], "1", "blue"), (-OFFSETS[2], "2", "blue"),
                               (-OFFSETS[9], "and so on, to 47", "blue"), (-1.0, "tolerance", "red")):
        figure.text((280, ladder.at(0, height)[1] + 5), text, role)
    figure.text((14, 24), "Height, in tolerances", bold=True)
    figure.text((440, 24), "Lowest part of a body over a few substeps", bold=True)

    # A large ball, of which only the lowest part is seen: where the cast stops it, and before.
    radius = 330.0
    bottom = ladder.at(0.5, -OFFSETS[0] + STOP_GAP)
    figure.arc((bottom[0], bottom[1] - radius), radius, 254.0, 286.0, "line-ink", 2.5)
    figure.arc((bottom[0], bottom[1] - radius - 92.0), radius, 254.0, 286.0, "line-faint", 1.5, "4 4")
    figure.arrow((bottom[0], bottom[1] - 88), (bottom[0], bottom[1] - 4), "ink")

    # It falls, is stopped, goes on, is stopped at a higher place of the ground, is separated, rests.
    stop0, stop1 = -OFFSETS[0] + STOP_GAP, -OFFSETS[1] + STOP_GAP
    path = [(0.0, 0.42), (1.5, stop0), (3.6, stop1), (5.2, stop1 + 0.01), (7.8, -SEPARATION_GAP),
            (10.0, -SEPARATION_GAP)]
    figure.polyline([graph.at(x, y) for x, y in path], "line-ink", 2.5)

    def badge(at, text):
        figure.circle(at, 11.0, "fill-page", 0.0)
        figure.circle(at, 11.0, "line-ink", 1.5)
        figure.text((at[0], at[1] + 5), text, anchor="middle")

    marks = [graph.at(1.5, stop0), graph.at(2.75, 0.5 * (stop0 + stop1)), graph.at(3.6, stop1), graph.at(6.5, -0.235)]
    for i, at in enumerate(marks):
        side = 22.0 if i in (0, 2) else -22.0
        badge((at[0] - (6.0 if i == 0 else 0.0), at[1] + side), str(i + 1))
    for at in (marks[0], marks[2]):
        figure.circle(at, 4.5, "fill-red", 0.0)
    legend = ["1  A cast against surface 0 stops the body at most 1/256 of a tolerance above it.",
              "2  The motion that is left is proved clear of surface 1, which the body is above by then.",
              "3  Stopped above surface 1: surface 2 is next.",
              "4  What is deeper than 1/8 is undone at 0.5 m/s at most, by motions proved in the same way."]
    figure.lines((14, 452), legend, leading=1.6)
    return figure


# Of the picture of manifolds: columns and rows of samples, and two bodies that overlap the ground by 0.2 m.
PATCH = ((-23, -8), (-5, 2))
HALF = math.sqrt(0.5)
BOX, CAPSULE = [2.0, 1.0, 0.6], {"radius": 0.5, "half_height": 1.1}
PLACED = [{"shape": {"box": {"half_extents": BOX}}, "position": [-19, -1, 0], "rotation": [1, 0, 0, 0]},
          {"shape": {"capsule": CAPSULE}, "position": [-12.5, -0.5, 0], "rotation": [HALF, -0.5, -0.5, 0]}]
AXIS = (-HALF, HALF, 0)  # of the capsule


def manifolds(program):
    """Samples of the ground, and of each body its position and contacts. The body is lowered by 0.2 m after it touches."""
    (west, east), (south, north) = PATCH
    flags = ["--seed", "7"]
    corners = [(x, y) for y in range(south, north + 1) for x in range(west, east + 1)]
    middles = [(x + 0.5, y + 0.5) for y in range(south, north) for x in range(west, east)]
    asked = kept.ask(program, flags, [{"op": "height", "x": x, "y": y} for x, y in corners + middles])
    casts = kept.ask(program, flags, [{"op": "cast", "shape": body["shape"], "rotation": body["rotation"],
                                       "position": [*body["position"][:2], 30], "to": [*body["position"][:2], 10]} for body in PLACED])
    positions = [[*body["position"][:2], 30 - 20 * cast["fraction"] - 0.2] for body, cast in zip(PLACED, casts)]
    found = kept.ask(program, flags, [{**body, "op": "find", "position": position} for body, position in zip(PLACED, positions)])
    heights = [answer["height"] for answer in asked]
    return {"samples": heights[:len(corners)], "middles": heights[len(corners):], "positions": positions,
            "contacts": [answer["contacts"] for answer in found]}


def contact_manifolds():
    figure = Figure("contact_manifolds", 900, 445, "The contacts of a box and of a capsule",
                    "Triangles of the ground, seen at an angle, with a box and a capsule that overlap it. Each contact has an arrow along "
                    "its normal; a list gives its depth and the angle of its normal to the vertical.")
    answers = kept.load("manifolds")
    (west, east), (south, north) = PATCH
    columns = east - west + 1
    turn, pitch, scale = math.radians(12), math.radians(32), 52.0

    def px(p):
        x, y, z = p[0] + 15.6, p[1] + 1.5, p[2] - 16.4
        right, ahead = x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn)
        return (450 + scale * right, 145 - scale * (ahead * math.sin(pitch) + z * math.cos(pitch)))

    def sample(i, j):
        return (west + i, south + j, answers["samples"][j * columns + i])

    for j in reversed(range(north - south)):
        for i in range(columns - 1):
            a, b, c, d = sample(i, j), sample(i + 1, j), sample(i + 1, j + 1), sample(i, j + 1)
            middle = answers["middles"][j * (columns - 1) + i]
            rising = abs(0.5 * (a[2] + c[2]) - middle) <= abs(0.5 * (b[2] + d[2]) - middle)  # along which diagonal the cell is cut
            for triangle in ((a, b, c), (a, c, d)) if rising else ((a, b, d), (b, c, d)):
                (ux, uy, uz), (vx, vy, vz) = ([q[k] - triangle[0][k] for k in range(3)] for q in triangle[1:])
                n = (uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx)
                light = (-0.55 * n[0] + 0.2 * n[1] + 0.8 * n[2]) / math.dist(n, (0, 0, 0))
                corners = [px(p) for p in triangle]
                figure.polygon(corners, "fill-page")
                figure.add("polygon", "fill-ground", points=" ".join(f"{x:.1f},{y:.1f}" for x, y in corners),
                           fill_opacity=0.08 + 0.5 * max(0.0, 1.0 - light) ** 0.8)
                figure.polyline([*corners, corners[0]], "line-ground", 0.7)

    x, y, z = answers["positions"][0]
    corners = [px((x + BOX[0] * (1 - 2 * (k & 1)), y + BOX[1] * (1 - (k & 2)), z + BOX[2] * (1 - (k & 4) / 2))) for k in range(8)]
    for side in ((0, 1, 3, 2), (2, 3, 7, 6), (1, 3, 7, 5)):
        figure.polygon([corners[k] for k in side], "wash-blue")
    for a in range(8):
        for bit in (1, 2, 4):
            if not a & bit:
                hidden = 4 in (a, a | bit)
                figure.line(corners[a], corners[a | bit], "line-blue", 1.0 if hidden else 2.0, "4 4" if hidden else "")
    x, y, z = answers["positions"][1]
    ends = [px([p + sign * CAPSULE["half_height"] * d for p, d in zip((x, y, z), AXIS)]) for sign in (-1, 1)]
    radius = CAPSULE["radius"] * scale
    along = math.degrees(math.atan2(ends[0][1] - ends[1][1], ends[1][0] - ends[0][0]))
    outline = []
    for end, first in ((ends[0], along + 90), (ends[1], along - 90)):
        outline += [(end[0] + radius * math.cos(math.radians(first + 6 * k)), end[1] - radius * math.sin(math.radians(first + 6 * k)))
                    for k in range(31)]
    figure.polygon(outline, "wash-blue")
    figure.polyline([*outline, outline[0]], "line-blue", 2.0)

    number = 0
    for body, (contacts, left, name) in enumerate(zip(answers["contacts"], (40, 500), ("box", "capsule"))):
        figure.text((left, 354), f"{name}, {len(contacts)} contacts", "blue", bold=True)
        for row, contact in enumerate(contacts):
            number += 1
            foot = px(contact["point"])
            tip = px([contact["point"][k] + 1.3 * contact["normal"][k] for k in range(3)])
            out = px([contact["point"][k] + contact["depth"] * contact["normal"][k] for k in range(3)])
            figure.arrow(foot, tip, "red", 2.0)
            figure.line(foot, out, "line-red", 6.0)
            figure.circle(foot, 4.0, "fill-red", 0.0)
            figure.text((tip[0], tip[1] - 6), str(number), "red", 15, "middle", bold=True)
            (kind, _), = contact["feature"].items()
            angle = math.degrees(math.acos(min(1.0, contact["normal"][2])))
            figure.text((left, 376 + 19 * row), f"{number}: {100 * contact['depth']:.1f} cm deep, {kind}, normal {angle:.0f} degrees off up",
                        size=13)
    return figure


def recordings():
    return {"manifolds": manifolds}


def figures():
    return [definitions(), offset_surfaces(), contact_manifolds()]
