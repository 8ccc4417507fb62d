# SPDX-License-Identifier: MIT
"""Figures of the documentation as SVG: shapes, arrows, text and axes, in colours for light and dark pages.

A module NAME_figures.py in this folder makes its figures with this class and returns them from figures(); draw.py writes
them.
Lengths are pixels, x to the right, y down. A style names colours by role: "line-blue" strokes, "fill-blue" fills.
"""
import html
import math

# Role: colour on a light page, on a dark page.
COLOURS = {
    "ink": ("#1f2328", "#e6edf3"),
    "page": ("#ffffff", "#0d1117"),
    "faint": ("#8c959f", "#6e7681"),
    "ground": ("#8a5a1f", "#d3a15f"),
    "blue": ("#0b62c4", "#58a6ff"),
    "red": ("#c02626", "#ff7b72"),
    "green": ("#1a7f37", "#3fb950"),
    "violet": ("#7a45d0", "#bc8cff"),
}
FONT = "font-family:system-ui,'Segoe UI','DejaVu Sans',sans-serif"
WIDEST_LETTER = 0.62  # of the font size: the mean width of DejaVu Sans, the widest of these fonts


def number(value):
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def points_text(points):
    return " ".join(f"{number(x)},{number(y)}" for x, y in points)


def style_sheet():
    def rules(which):
        for role, colours in COLOURS.items():
            yield f".line-{role}{{stroke:{colours[which]};fill:none}}.fill-{role}{{fill:{colours[which]}}}"
            yield f".wash-{role}{{fill:{colours[which]};fill-opacity:.16}}"

    return (f"text{{{FONT}}}" + "".join(rules(0)) + "@media (prefers-color-scheme:dark){" + "".join(rules(1)) + "}")


class Figure:
    """One drawing. Refuses text below 13 px, outside the drawing, or over other text."""

    def __init__(self, name, width, height, title, description):
        self.name, self.width, self.height = name, width, height
        self.title, self.description = title, description
        self.parts, self.text_boxes = [], []

    def add(self, tag, style, **attributes):
        values = "".join(f' {key.replace("_", "-")}="{value if isinstance(value, str) else number(value)}"'
                         for key, value in attributes.items())
        self.parts.append(f'<{tag} class="{style}"{values}/>')

    def line(self, a, b, style="line-ink", width=1.5, dash=""):
        self.polyline([a, b], style, width, dash)

    def polyline(self, points, style="line-ink", width=1.5, dash=""):
        extra = {"stroke_dasharray": dash} if dash else {}
        self.add("polyline", style, points=points_text(points), stroke_width=width, stroke_linejoin="round", **extra)

    def polygon(self, points, style="wash-ground", width=0.0):
        self.add("polygon", style, points=points_text(points), stroke_width=width, stroke_linejoin="round")

    def circle(self, centre, radius, style="line-ink", width=1.5):
        self.add("circle", style, cx=centre[0], cy=centre[1], r=radius, stroke_width=width)

    def rectangle(self, x, y, width, height, style="line-ink", stroke=1.5, radius=0.0):
        self.add("rect", style, x=x, y=y, width=width, height=height, stroke_width=stroke, rx=radius)

    def arc(self, centre, radius, first_deg, last_deg, style="line-ink", width=1.5, dash=""):
        """Part of a circle; angles from the right, counter-clockwise."""
        steps = max(8, int(abs(last_deg - first_deg) / 3))
        angles = [math.radians(first_deg + (last_deg - first_deg) * i / steps) for i in range(steps + 1)]
        points = [(centre[0] + radius * math.cos(a), centre[1] - radius * math.sin(a)) for a in angles]
        self.polyline(points, style, width, dash)

    def arrow(self, a, b, role="ink", width=2.0, both=False, dash=""):
        """From a to b, with a head at b; with `both` at a too."""
        length = math.dist(a, b)
        ux, uy = (b[0] - a[0]) / length, (b[1] - a[1]) / length
        head = min(4.5 * width, 0.45 * length)

        def draw_head(tip, towards):
            base = (tip[0] - towards * head * ux, tip[1] - towards * head * uy)
            side = (0.42 * head * uy, -0.42 * head * ux)
            wings = [(base[0] + sign * side[0], base[1] + sign * side[1]) for sign in (1, -1)]
            self.polygon([tip, *wings], f"fill-{role}")
            return base

        end = draw_head(b, 1)
        start = draw_head(a, -1) if both else a
        self.line(start, end, f"line-{role}", width, dash)

    def text(self, at, text, role="ink", size=14, anchor="start", bold=False):
        """One line of text; `at` is the start, middle or end of its base line."""
        if size < 13:
            raise ValueError(f"{self.name}: text of {size} px is below 13: {text}")
        width = WIDEST_LETTER * size * len(text) * (1.06 if bold else 1.0)
        left = at[0] - {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor] * width
        box = (left, at[1] - 0.8 * size, left + width, at[1] + 0.22 * size, text)
        self.claim(box)
        weight = ' font-weight="600"' if bold else ""
        self.parts.append(f'<text class="fill-{role}" x="{number(at[0])}" y="{number(at[1])}" font-size="{number(size)}"'
                          f' text-anchor="{anchor}"{weight}>{html.escape(text)}</text>')

    def lines(self, at, texts, role="ink", size=14, anchor="start", leading=1.3):
        for i, text in enumerate(texts):
            self.text((at[0], at[1] + i * leading * size), text, role, size, anchor)

    def claim(self, box):
        low_x, low_y, high_x, high_y, text = box
        if low_x < 0 or low_y < 0 or high_x > self.width or high_y > self.height:
            raise ValueError(f"{self.name}: text leaves the drawing: {text}")
        for other in self.text_boxes:
            if low_x < other[2] and other[0] < high_x and low_y < other[3] and other[1] < high_y:
                raise ValueError(f"{self.name}: text over text: {text} / {other[4]}")
        self.text_boxes.append(box)

    def svg(self):
        body = "\n".join(self.parts)
        return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {number(self.width)} {number(self.height)}"'
                f' width="{number(self.width)}" height="{number(self.height)}" role="img">\n'
                f"<title>{html.escape(self.title)}</title>\n<desc>{html.escape(self.description)}</desc>\n"
                f"<style>{style_sheet()}</style>\n{body}\n</svg>\n")


class Axes:
    """A rectangle of a figure with coordinates; logarithmic where asked for."""

    def __init__(self, figure, left, top, width, height, x_range, y_range, log_x=False, log_y=False):
        self.figure, self.left, self.top, self.width, self.height = figure, left, top, width, height
        self.x_scale, self.y_scale = (math.log10 if log else float for log in (log_x, log_y))
        self.x_range = [self.x_scale(v) for v in x_range]
        self.y_range = [self.y_scale(v) for v in y_range]

    def at(self, x, y):
        share_x = (self.x_scale(x) - self.x_range[0]) / (self.x_range[1] - self.x_range[0])
        share_y = (self.y_scale(y) - self.y_range[0]) / (self.y_range[1] - self.y_range[0])
        return (self.left + share_x * self.width, self.top + (1.0 - share_y) * self.height)

    def frame(self, x_ticks, y_ticks, x_title, y_title, size=14):
        """Ticks are pairs of a value and its text."""
        figure, bottom = self.figure, self.top + self.height
        figure.rectangle(self.left, self.top, self.width, self.height, "line-faint", 1.0)
        for value, text in x_ticks:
            x = self.at(value, self.y_value(0.0))[0]
            figure.line((x, bottom), (x, bottom + 5), "line-faint", 1.0)
            figure.text((x, bottom + 6 + size), text, size=size, anchor="middle")
        for value, text in y_ticks:
            y = self.at(self.x_value(0.0), value)[1]
            figure.line((self.left - 5, y), (self.left, y), "line-faint", 1.0)
            figure.text((self.left - 9, y + 0.36 * size), text, size=size, anchor="end")
        figure.text((self.left + 0.5 * self.width, bottom + 14 + 2 * size), x_title, size=size, anchor="middle")
        figure.text((self.left, self.top - 0.7 * size), y_title, size=size)

    def x_value(self, share):
        value = self.x_range[0] + share * (self.x_range[1] - self.x_range[0])
        return 10.0 ** value if self.x_scale is math.log10 else value

    def y_value(self, share):
        value = self.y_range[0] + share * (self.y_range[1] - self.y_range[0])
        return 10.0 ** value if self.y_scale is math.log10 else value
