# SPDX-License-Identifier: MIT
"""Figures of heights.md."""
import math

from svg import Axes, Figure

# terrain/source/fractal/noise.h: suprema of noise of wavelength 1.
NOISE_SUP, NOISE_SLOPE, NOISE_CURVATURE = 0.70710678118655, 2.08, 9.3
# terrane/terrain/fractal_heights.h: the defaults of FractalSettings.
OCTAVE_COUNT, AMPLITUDE, WAVELENGTH, GAIN = 12, 800.0, 4096.0, 0.5


def octave(i):
    return AMPLITUDE * GAIN ** i, WAVELENGTH * 0.5 ** i


def octave_terms(i, hypotenuse):
    """By supremum, slope and curvature: terrain/source/fractal/fractal_bounds.cpp."""
    amplitude, wavelength = octave(i)
    radius = 0.5 * hypotenuse / wavelength
    return (2.0 * NOISE_SUP * amplitude, NOISE_SLOPE * radius * amplitude, 0.5 * NOISE_CURVATURE * radius ** 2 * amplitude)


def octave_bound(i, hypotenuse):
    return min(octave_terms(i, hypotenuse))


def bound(hypotenuse):
    return sum(octave_bound(i, hypotenuse) for i in range(OCTAVE_COUNT))


def octave_bounds():
    figure = Figure("octave_bounds", 900, 478, "A-priori bound of a sum of octaves",
                    "How far the default fractal can leave its linear interpolation over a right triangle, against the triangle's hypotenuse, "
                    "with the shares of four of its twelve octaves.")
    axes = Axes(figure, 90, 56, 520, 370, (0.1, 1e5), (1e-4, 1e4), log_x=True, log_y=True)
    axes.frame([(0.1, "0.1"), (1.0, "1"), (10.0, "10"), (100.0, "100"), (1e3, "1000"), (1e4, "10 000"), (1e5, "100 000")],
               [(1e-4, "0.0001"), (1e-2, "0.01"), (1.0, "1"), (100.0, "100"), (1e4, "10 000")],
               "hypotenuse of the triangle, metres", "bound of the deviation, metres")
    lengths = [0.1 * 10.0 ** (6.0 * i / 300) for i in range(301)]
    shown = [0, 4, 8, 11]
    for i in shown:
        inside = [(l, octave_bound(i, l)) for l in lengths if octave_bound(i, l) >= 1e-4]
        figure.polyline([axes.at(*p) for p in inside], "line-violet", 1.5)
        end = axes.at(1e5, octave_bound(i, 1e5))
        figure.text((622, end[1] + 5), f"octave {i}, wavelength {octave(i)[1]:g} m", "violet")
    figure.polyline([axes.at(l, bound(l)) for l in lengths], "line-blue", 3.0)
    total = axes.at(1e5, bound(1e5))
    figure.text((622, total[1] - 8), f"all 12 octaves: {bound(1e5):.0f} m at most", "blue", bold=True)
    figure.text((14, 24), "What a fractal can do between the corners of a triangle, at most", bold=True)

    # The three regimes of the last octave.
    for regime, length in ((2, 0.35), (1, 2.2), (0, 40.0)):
        terms = octave_terms(11, length)
        assert terms[regime] == min(terms)
        figure.circle(axes.at(length, terms[regime]), 4.5, "fill-violet", 0.0)
    figure.lines((622, 320), ["dots, from the left:", "limited by its curvature,", "by its slope,", "by its supremum"], "violet")
    at = axes.at(1.0, bound(1.0))
    figure.circle(at, 4.5, "fill-blue", 0.0)
    figure.text((axes.left + 8, at[1] - 44), f"{bound(1.0):.2f} m at 1 m", "blue")
    return figure


def sampled_bound():
    figure = Figure("sampled_bound", 900, 462, "A bound from samples",
                    "A cross-section of the ground over the edge that a midpoint splits: samples with their radius, the tube that holds the "
                    "true surface, and the bound around the straight edge.")
    axes = Axes(figure, 30, 40, 840, 330, (0.0, 2.0), (-1.65, 1.55))
    pieces = 8  # of s / 4 each

    def head(x):
        return 0.75 * math.sin(2.3 * x + 0.2) + 0.26 * math.sin(5.4 * x + 0.9) + 0.05 * x

    radius = 0.15

    def tail(x):
        return 0.09 * math.sin(31.0 * x + 0.4) + 0.055 * math.sin(53.0 * x)

    fine = [2.0 * i / 800 for i in range(801)]
    step = 2.0 / pieces
    samples = [(k * step, head(k * step)) for k in range(pieces + 1)]

    def interpolated(x):
        k = min(int(x / step), pieces - 1)
        share = x / step - k
        return samples[k][1] + share * (samples[k + 1][1] - samples[k][1])

    bend = 1.02 * max(abs(head(x) - interpolated(x)) for x in fine)
    begin, end = (0.0, head(0.0) + tail(0.0)), (2.0, head(2.0) + tail(2.0))

    def edge(x):
        return begin[1] + 0.5 * x * (end[1] - begin[1])

    certified = max(abs(y - edge(x)) + radius for x, y in samples) + bend
    measured = max(abs(head(x) + tail(x) - edge(x)) for x in fine)
    assert all(abs(head(x) + tail(x) - interpolated(x)) <= radius + bend for x in fine)
    assert measured <= certified

    upper = [axes.at(x, y + radius + bend) for x, y in samples]
    lower = [axes.at(x, y - radius - bend) for x, y in samples]
    figure.polygon(upper + lower[::-1], "wash-violet")
    figure.polyline([axes.at(x, head(x) + tail(x)) for x in fine], "line-ground", 2.5)
    figure.line(axes.at(*begin), axes.at(*end), "line-ink", 2.5)
    for sign in (-1.0, 1.0):
        figure.line(axes.at(0.0, begin[1] + sign * certified), axes.at(2.0, end[1] + sign * certified), "line-red", 2.0, "7 5")
    for x, y in samples:
        at, high, low = axes.at(x, y), axes.at(x, y + radius), axes.at(x, y - radius)
        figure.line(high, low, "line-violet", 2.0)
        for p in (high, low):
            figure.line((p[0] - 5, p[1]), (p[0] + 5, p[1]), "line-violet", 2.0)
        figure.circle(at, 4.0, "fill-violet", 0.0)
    x = 1.62
    figure.arrow(axes.at(x, edge(x)), axes.at(x, edge(x) - certified), "red", 2.0, both=True)
    at = axes.at(x, edge(x) - 0.7 * certified)
    figure.text((at[0] + 12, at[1]), "e(v)", "red", 16)
    figure.text((14, 24), "The bound of a midpoint, from samples four times as close as its own spacing", bold=True)
    figure.lines((30, 402), ["dots and bars: centre C and radius R of the head at samples s / 4 apart",
                             "shaded: the tube C +- (R + F) that holds the true surface (wavy)"], "violet")
    figure.text((30, 446), "dashed: e(v) = max(|C - edge| + R) + F, around the straight edge that the vertex would split", "red")
    return figure


def figures():
    return [octave_bounds(), sampled_bound()]
