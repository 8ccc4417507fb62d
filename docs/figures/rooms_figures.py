# SPDX-License-Identifier: MIT
"""Figure of rooms.md, from the components that tests/checks/rooms.py lets include each other."""
import importlib.util
import pathlib

from svg import Figure

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Component: left end, row from the top, width, colour, text.
PLACES = {
    "tools": (30, 0, 370, "ink", ""), "python": (420, 0, 450, "ink", ""),
    "playback": (30, 1, 120, "green", "camera paths"), "render": (170, 1, 160, "green", "OpenGL, shadows"),
    "adapters": (350, 1, 190, "blue", "other physics engines"), "volume": (560, 1, 110, "ground", "caves, digs"),
    "dem": (685, 1, 80, "ground", "rasters"), "remote": (780, 1, 90, "ground", "HTTP"),
    "scene": (170, 2, 160, "green", "objects of a frame"), "collision": (350, 2, 190, "blue", "contact, bodies"),
    "store": (560, 2, 310, "ground", "baked terrains, caches"),
    "terrain": (30, 3, 840, "ground", "heights, chunks, paging, triangulation, ground queries"),
    "base": (30, 4, 840, "ground", "vectors, results, threads"),
}
HIGH, STEP, TOP = 56, 92, 14
PROGRAMS = ("tools", "python")  # which include so many components that arrows would hide the rest


def permitted():
    """{component: other components whose public headers it may include}"""
    spec = importlib.util.spec_from_file_location("rooms_check", ROOT / "tests/checks/rooms.py")
    check = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(check)
    return {name: others - {name} for name, others in check.SEES.items()}


def direct(sees):
    """The pairs of components that no path over a third one connects."""
    for name, others in sees.items():
        for other in sorted(others):
            assert sees[other] <= others, f"{name} may include {other}, but not all that {other} may include"
            if not any(other in sees[third] for third in others):
                yield name, other


def components():
    figure = Figure("components", 900, TOP + 4 * STEP + HIGH + 10, "Components, and which may include which",
                    "Components in five rows, from the program and the Python module down to base. Arrows lead from a component to those "
                    "that it may include.")
    sees = permitted()
    assert set(PLACES) == set(sees)
    for name, other in direct(sees):
        if name in PROGRAMS:
            continue
        (left, row, width, _, _), (low, floor, span, _, _) = PLACES[name], PLACES[other]
        x = (max(left, low) + min(left + width, low + span)) / 2
        assert low < x < low + span
        figure.arrow((x, TOP + row * STEP + HIGH), (x, TOP + floor * STEP))
    for name, (left, row, width, role, text) in PLACES.items():
        top = TOP + row * STEP
        figure.rectangle(left, top, width, HIGH, "fill-page", 0.0, 7.0)
        figure.rectangle(left, top, width, HIGH, f"wash-{role}", 0.0, 7.0)
        figure.rectangle(left, top, width, HIGH, f"line-{role}", 2.0, 7.0)
        figure.text((left + width / 2, top + 23), name, role, 16, "middle", bold=True)
        if name in PROGRAMS:
            others = sorted(set(sees) - sees[name] - {name})
            text = f"may include all but {', '.join(others)}"
        figure.text((left + width / 2, top + 43), text, size=13, anchor="middle")
    return figure


def figures():
    return [components()]
