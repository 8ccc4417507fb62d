# SPDX-License-Identifier: MIT
"""Figures of paging.md."""
from svg import Axes, Figure

# terrain/paging/pager_loads.cpp: chunks to be drawn are loaded so long before their load must begin.
DRAWN_AHEAD_S = 0.8
# A load of the examples, and when the next slot is free, seconds.
LOAD_S = 0.4


def deadlines():
    """Six absent chunks, in the order in which their loads begin: terrain/paging/demand/need.h."""
    figure = Figure("paging_deadlines", 900, 452, "Needs, slack and the order of loads",
                    "Absent chunks against time: when each is needed, when its load must begin at the latest, and what the pager does.")
    axes = Axes(figure, 214, 62, 366, 312, (-0.5, 4.0), (6.5, 0.0))
    # name, what it is, begin and end of the need, what the pager does with it
    rows = [
        ("contact", "a body in 1.2 s", 1.2, 2.6, ("first: contact before drawing", "slack 0.8 s")),
        ("drawn", "in view, error 3.1", 0.0, 4.0, ("second: late, larger error", "slack -0.4 s")),
        ("drawn", "in view, error 1.4", 0.0, 4.0, ("third: late, smaller error", "slack -0.4 s")),
        ("drawn", "in 1.0 s", 1.0, 4.0, ("fourth: least slack of the rest", "slack 0.6 s")),
        ("drawn", "in 2.8 s", 2.8, 4.0, ("waits: slack 2.4 s is above 0.8 s", "unless loads pile up")),
        ("drawn", "passed in 0.3 s", 0.0, 0.3, ("not begun: its need ends", "before it can arrive")),
    ]
    roles = {"contact": "red", "drawn": "blue"}
    for value in (0.0, 1.0, 2.0, 3.0, 4.0):
        figure.line(axes.at(value, 0.0), axes.at(value, 6.5), "line-faint", 1.0, "" if value == 0.0 else "3 4")
        figure.text((axes.at(value, 0)[0], 62 + 312 + 20), "now" if value == 0.0 else f"{value:.0f} s", anchor="middle")
    figure.text((14, 24), "Absent chunk", bold=True)
    figure.text((axes.at(-0.5, 0)[0], 24), "when it is needed", bold=True)
    figure.text((596, 24), "what the pager does", bold=True)
    for i, (kind, what, begin, end, does) in enumerate(rows):
        role = roles[kind]
        low, high = axes.at(begin, i + 0.35), axes.at(end, i + 0.95)
        figure.rectangle(low[0], low[1], high[0] - low[0], high[1] - low[1], f"wash-{role}", 0.0)
        figure.line((low[0], low[1]), (low[0], high[1]), f"line-{role}", 2.5)
        middle = 0.5 * (low[1] + high[1])
        start = axes.at(begin - LOAD_S, i)[0]
        figure.line((start, middle), (low[0], middle), "line-ink", 5.0)
        figure.line((start, middle - 7), (start, middle + 7), "line-ink", 1.5)
        figure.text((14, middle - 4), kind, role, bold=True)
        figure.text((14, middle + 14), what)
        figure.lines((596, middle - 4), does, leading=1.29)
    key = 428
    figure.line((20, key - 5), (56, key - 5), "line-ink", 5.0)
    figure.text((64, key), "load, as long as those of its level took lately")
    figure.rectangle(446, key - 14, 36, 18, "wash-blue", 0.0)
    figure.line((446, key - 14), (446, key + 4), "line-blue", 2.5)
    figure.text((490, key), "time in which it is needed")
    return figure


def ceiling():
    figure = Figure("paging_ceiling", 900, 366, "What the ceiling holds, and what is evicted first",
                    "A bar of bytes: free bytes, resident chunks in the order in which they are evicted, what stays, and claims of loads.")
    left, top, height = 30, 64, 66
    parts = [
        ("free", "free", 96, "faint", ""),
        ("1", "unneeded", 108, "ground", "1"),
        ("2", "speculation", 96, "violet", "2"),
        ("3", "drawn later", 96, "blue", "3"),
        ("4", "drawn now", 190, "blue", "4"),
        ("5", "contact later", 70, "red", "5"),
        ("stays", "contact in use, roots", 108, "red", ""),
        ("claims", "claims of loads", 76, "green", ""),
    ]
    x = left
    places = {}
    for name, _, width, role, number in parts:
        if name == "free":
            figure.rectangle(x, top, width, height, "line-faint", 1.5)
        else:
            figure.rectangle(x, top, width, height, f"wash-{role}", 0.0)
            figure.rectangle(x, top, width, height, f"line-{role}", 1.5)
        if number:
            figure.circle((x + width / 2, top + height / 2), 13.0, "fill-page", 0.0)
            figure.circle((x + width / 2, top + height / 2), 13.0, f"line-{role}", 1.5)
            figure.text((x + width / 2, top + height / 2 + 5), number, role, anchor="middle", bold=True)
        places[name] = (x, width)
        x += width
    figure.line((x, top - 22), (x, top + height + 22), "line-ink", 3.0)
    figure.line((left, top - 22), (left, top + height + 22), "line-ink", 1.5)
    figure.arrow((left + 2, top - 16), (x - 2, top - 16), "ink", 1.5, both=True)
    figure.text((14, 24), "memory_bytes: everything below is inside it, at every moment", bold=True)

    def label(name, text, role):
        start, width = places[name]
        figure.text((start + width / 2, top + height / 2 + 5), text, role, anchor="middle")

    label("free", "free", "faint")
    label("stays", "stays", "red")
    label("claims", "loads", "green")
    start = places["1"][0]
    figure.arrow((start + 4, top + height + 16), (places["stays"][0] - 4, top + height + 16), "ink", 1.5)
    figure.text((start + 4, top + height + 40), "evicted in this order, leaves of the tree only")
    column = [
        ("1  needed by nobody: what would show least if the camera turned", "ground"),
        ("2  speculation: what a camera may need if it turns", "violet"),
        ("3  drawn later: what is needed last", "blue"),
        ("4  drawn now: the smallest error over threshold; the load must be worth 1.25 times as much", "blue"),
        ("5  ground that no body touches yet: for ground that is touched a second sooner", "red"),
        ("   stays: roots, ground that is touched, parents of resident chunks", "red"),
        ("   loads: each claims the most bytes that a chunk can have before it begins", "green"),
    ]
    for i, (text, role) in enumerate(column):
        figure.text((30, 212 + 22 * i), text, role)
    return figure


def figures():
    return [deadlines(), ceiling()]
