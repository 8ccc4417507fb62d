# SPDX-License-Identifier: MIT
"""Figures of numerics.md."""
import math

from svg import Axes, Figure

LOCAL_CELLS = 64  # how far from the origin of its frame a cast looks at ground: collision/ground/heightfield


def spacing_of_numbers(value, bits):
    """Between neighbours of a floating-point number with so many bits after the first."""
    return 2.0 ** (math.floor(math.log2(value)) - bits)


def steps(axes, bits, low, high):
    """The spacing as a staircase: it doubles at every power of two."""
    points = []
    for exponent in range(int(math.log2(low)), int(math.ceil(math.log2(high)))):
        for value in (2.0 ** exponent, min(high, 2.0 ** (exponent + 1))):
            points.append(axes.at(value, spacing_of_numbers(2.0 ** exponent, bits)))
    return points


def power(exponent):
    return "1" if exponent == 0 else f"1e{exponent}"


def number_spacing():
    figure = Figure("number_spacing", 900, 525, "Spacing of numbers against distance from the origin",
                    "Spacing of float and double over the distance from the origin, with the quantum of heights, the stop "
                    "gap of casts, the lift that counts as none, and the spacing of doubles in a contact's local frame.")
    most = 1e12
    axes = Axes(figure, 74, 46, 560, 420, (1.0, most), (1e-17, 1e5), log_x=True, log_y=True)
    axes.frame([(10.0 ** e, power(e)) for e in range(0, 13, 2)], [(10.0 ** e, power(e)) for e in range(-16, 5, 4)],
               "distance from the origin, m", "spacing between neighbouring numbers, m")
    figure.polyline(steps(axes, 23, 1.0, most), "line-red", 2.0)
    figure.polyline(steps(axes, 52, 1.0, most), "line-blue", 2.0)
    beside = axes.left + axes.width + 10
    figure.text((axes.at(2e3, 1.0)[0], axes.at(1.0, 0.3)[1]), "float (24 bits)", "red")
    figure.text((axes.at(3e6, 1.0)[0], axes.at(1.0, 1e-12)[1]), "double (53 bits)", "blue")
    local = spacing_of_numbers(LOCAL_CELLS, 52)
    for value, texts, role in ((2.0 ** -12, ["quantum of heights: 2^-12"], "ground"),
                               (0.01 / 256.0, ["", "stop gap of 1 cm tolerance"], "green"),
                               (1e-10, ["lift that counts as none"], "violet"),
                               (local, ["double in a local frame,", "64 cells of 1 m"], "blue")):
        y = axes.at(1.0, value)[1]
        figure.line((axes.left, y), (axes.left + axes.width, y), f"line-{role}", 1.5, "6 4")
        for i, text in enumerate(texts):
            if text:
                figure.text((beside, y + 5 + 17 * i - (9 if texts[0] and value == 2.0 ** -12 else 0)), text, role)
    for value, text in ((1e7, "tests: 1e7"), (2e9, "bodies: 2e9"), (2.0 ** 38, "worlds: 2^38")):
        x = axes.at(value, 1.0)[0]
        figure.line((x, axes.top), (x, axes.top + axes.height), "line-faint", 1.0, "2 4")
        figure.text((x - 5, axes.top + axes.height - (32 if value == 2e9 else 12)), text, anchor="end")
    return figure


def exact_differences():
    figure = Figure("exact_differences", 900, 360, "Integers are subtracted before anything becomes a length",
                    "Integers of the lattice minus integers near the query become small doubles for contact; minus those "
                    "of the eye, small floats for drawing.")

    def box(x, y, width, height, title, lines, role):
        figure.rectangle(x, y, width, height, f"line-{role}", 2.0, 8.0)
        figure.text((x + 14, y + 24), title, role, 15, bold=True)
        figure.lines((x + 14, y + 47), lines)

    box(20, 108, 240, 144, "a sample of the ground",
        ["column, row: 64 bits", "of the finest lattice", "height: 32 bits,", "in quanta", "the same in every chunk"],
        "ground")
    box(330, 16, 270, 144, "contact, casts, depth",
        ["- column, row, height of a", "lattice point near the query", "x spacing, x quantum:", "double, near 0",
         "exact, or one rounding"], "blue")
    box(330, 200, 270, 144, "drawing",
        ["- column, row, height of the", "lattice point next to the eye", "x spacing, x quantum,",
         "- the rest of the eye:", "float, near 0"], "green")
    box(670, 16, 210, 144, "the answer",
        ["normal, depth, lift,", "fraction: the same bits", "whole chunks away", "points: + origin,",
         "one rounding"], "blue")
    box(670, 200, 210, 144, "the picture",
        ["the same position from", "chunks of all levels:", "no cracks, no jitter", "far from the origin"], "green")
    for start, end in (((260, 150), (330, 100)), ((260, 210), (330, 260)), ((600, 88), (670, 88)),
                       ((600, 272), (670, 272))):
        figure.arrow(start, end, "ink", 2.0)
    return figure


def figures():
    return [number_spacing(), exact_differences()]
