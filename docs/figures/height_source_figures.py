# SPDX-License-Identifier: MIT
"""Figure of height_source.md."""
from svg import Figure

SLOPE, CURVATURE = 0.7, 0.01  # as in the page's first example; 1/m
EDGE = 64.0  # metres


def stated_bounds():
    figure = Figure("stated_bounds", 900, 470, "Bounds from a slope and from a curvature",
                    "Sections over an edge and over one half as long: a cone deviates from the edge by slope times length over 2, a paraboloid "
                    "by curvature times length squared over 8. The cone's deviation halves, the paraboloid's falls to a quarter.")
    scale = 5.6
    kinds = (("slope 0.7: a cone", "blue", lambda x, half: SLOPE * (half - abs(x)), lambda l: SLOPE * l / 2),
             ("curvature 0.01 / m: a paraboloid", "violet", lambda x, half: CURVATURE / 2 * (half * half - x * x),
              lambda l: CURVATURE * l * l / 8))
    for column, (name, role, height, bound) in enumerate(kinds):
        middle = 225 + 450 * column
        figure.text((middle - 200, 26), name, role, 15, bold=True)
        for edge, base in ((EDGE, 220.0), (EDGE / 2, 400.0)):
            half = edge / 2
            xs = [half * (k / 40 - 1) for k in range(81)]
            curve = [(middle + scale * x, base - scale * height(x, half)) for x in xs]
            assert abs(max(height(x, half) for x in xs) - bound(edge)) < 1e-9
            figure.polygon([(middle - scale * half, base), *curve, (middle + scale * half, base)], f"wash-{role}")
            figure.polyline(curve, f"line-{role}", 2.5)
            figure.line((middle - scale * half, base), (middle + scale * half, base), "line-ink", 2.5)
            for sign in (-1, 1):
                figure.circle((middle + sign * scale * half, base), 4.5, "fill-ink", 0.0)
            figure.arrow((middle, base), (middle, base - scale * bound(edge)), "red", 2.0, both=True)
            figure.text((middle + 8, base - scale * bound(edge) - 8), f"{bound(edge):.2f} m", "red", 15)
            figure.text((middle, base + 22), f"edge of {edge:g} m", anchor="middle")
    figure.text((450, 454), "black: a triangle's edge between two samples; red: the largest deviation of the true surface", anchor="middle")
    return figure


def figures():
    return [stated_bounds()]
