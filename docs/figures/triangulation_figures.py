# SPDX-License-Identifier: MIT
"""Figures of triangulation.md."""
import math

from svg import Axes, Figure


# The 4-8 mesh of one root square of SIDE cells, by the definitions of terrane/terrain/height_source.h.
SIDE = 64


def spacing_of(vertex):
    """The largest power of two that divides both coordinates."""
    low = vertex[0] | vertex[1]
    return low & -low


def is_centre(vertex):
    s = spacing_of(vertex)
    return (vertex[0] // s) % 2 == 1 and (vertex[1] // s) % 2 == 1


def ends_and_parents(vertex):
    (x, y), s = vertex, spacing_of(vertex)
    if not is_centre(vertex):
        along, across = [(x - s, y), (x + s, y)], [(x, y - s), (x, y + s)]
        return (along, across) if (x // s) % 2 == 1 else (across, along)
    corners = [(x + i * s, y + j * s) for i in (-1, 1) for j in (-1, 1)]
    even = [c for c in corners if (c[0] // (2 * s) + c[1] // (2 * s)) % 2 == 0]
    return even, [c for c in corners if c not in even]


def in_world(vertex):
    return 0 <= vertex[0] <= SIDE and 0 <= vertex[1] <= SIDE


def real_parents(vertex):
    """Without corners of the root square, which are always there, and places beyond the world."""
    return [p for p in ends_and_parents(vertex)[1] if in_world(p) and spacing_of(p) < SIDE]


def ancestors(vertex):
    found, open_ = set(), [vertex]
    while open_:
        for parent in real_parents(open_.pop()):
            if parent not in found:
                found.add(parent)
                open_.append(parent)
    return found


def priorities(eye, is_resident):
    """Bound over distance, lowered to the parents'; 0 where the vertex or a parent is not resident."""
    found = {}
    vertices = [(x, y) for x in range(SIDE + 1) for y in range(SIDE + 1) if (x, y) != (0, 0) and spacing_of((x, y)) < SIDE]
    for vertex in sorted(vertices, key=lambda v: (-spacing_of(v), not is_centre(v), v)):
        s = spacing_of(vertex)
        reach = (3 if is_centre(vertex) else 2) * s
        gap = math.hypot(*(max(abs(vertex[k] - eye[k]) - reach, 0) for k in range(2)))
        own = s ** 1.6 / max(gap, 2.0) if is_resident(vertex) else 0.0
        found[vertex] = min([own] + [found[p] for p in real_parents(vertex)])
    return found


def weight(vertex):
    return 1 if vertex[0] in (0, SIDE) or vertex[1] in (0, SIDE) else 2


def select(keys, budget):
    """The most vertices, by priority, whose triangles fit; ties are in or out together."""
    threshold, used = 0.0, 2
    for value in sorted({k for k in keys.values() if k > 0}, reverse=True):
        used += sum(weight(v) for v, k in keys.items() if k == value)
        if used > budget:
            break
        threshold = value
    return {v for v, k in keys.items() if k >= threshold > 0}


def triangles(active):
    """By bisection of the two root triangles: right-angled corner, ends of the hypotenuse."""
    found = []

    def split(apex, a, b):
        middle = ((a[0] + b[0]) // 2, (a[1] + b[1]) // 2)
        if middle in active:
            split(middle, apex, a)
            split(middle, b, apex)
        else:
            found.append((apex, a, b))

    split((SIDE, 0), (0, 0), (SIDE, SIDE))
    split((0, SIDE), (SIDE, SIDE), (0, 0))
    return found


def check(active, mesh, budget):
    for vertex in active:
        assert all(p in active for p in real_parents(vertex)), "the set is closed"
    assert len(mesh) == 2 + sum(weight(v) for v in active) <= budget
    edges = {}
    for t in mesh:
        for i in range(3):
            edge = frozenset((t[i], t[(i + 1) % 3]))
            edges[edge] = edges.get(edge, 0) + 1
    for edge, count in edges.items():
        a, b = edge
        on_border = any(a[k] == b[k] and a[k] in (0, SIDE) for k in range(2))
        assert count == (1 if on_border else 2), "every inner edge has two triangles"


def draw_mesh(figure, left, top, size, eye, is_resident, budget, shows_ancestors=False):
    scale = size / SIDE

    def px(p):
        return (left + p[0] * scale, top + size - p[1] * scale)

    active = select(priorities(eye, is_resident), budget)
    mesh = triangles(active)
    check(active, mesh, budget)
    for t in mesh:
        figure.polyline([px(t[0]), px(t[1]), px(t[2]), px(t[0])], "line-ground", 1.0)
    figure.circle(px(eye), 5.5, "fill-green", 0.0)
    if shows_ancestors:
        # of a vertex of the finest spacing there is, as far from the eye as they come
        finest = min(spacing_of(v) for v in active)
        watched = max((v for v in active if spacing_of(v) == finest and is_centre(v)), key=lambda v: (math.dist(v, eye), v))
        for vertex in ancestors(watched):
            figure.circle(px(vertex), 3.6, "fill-violet", 0.0)
        figure.circle(px(watched), 4.8, "fill-red", 0.0)
    return len(mesh)


def bisection():
    figure = Figure("bisection", 900, 470, "Vertices, closure and watertight meshes",
                    "Left: the split edge, ends and parents of a centre and of a midpoint. Middle: the mesh of a set of vertices that "
                    "is closed under parents. Right: the same view without a quarter of the data.")
    # A centre: its square, and the diagonal between the corners of even index sum.
    left, top, side = 34, 62, 140
    sw, se, ne, nw = (left, top + side), (left + side, top + side), (left + side, top), (left, top)
    mid = (left + side / 2, top + side / 2)
    figure.polygon([sw, se, ne, nw], "wash-blue")
    figure.polyline([sw, se, ne, nw, sw], "line-ink", 1.5)
    figure.line(sw, ne, "line-blue", 2.5)
    for p in (sw, ne):
        figure.circle(p, 5.0, "fill-blue", 0.0)
    for p in (se, nw):
        figure.circle(p, 5.0, "fill-violet", 0.0)
    figure.circle(mid, 6.0, "fill-red", 0.0)
    figure.text((mid[0] + 12, mid[1] + 5), "vertex", "red")
    figure.text((14, 24), "Centre of a square", bold=True)
    figure.text((left + side + 12, top + 5), "end", "blue")
    figure.text((left + side + 12, top + side + 5), "parent", "violet")

    # A midpoint: an edge of such a square, and the centres on both sides.
    left, top = 34, 300
    west, east = (left, top + side / 2), (left + side, top + side / 2)
    north, south = (left + side / 2, top), (left + side / 2, top + side)
    figure.polygon([west, north, east, south], "wash-blue")
    figure.polyline([west, north, east, south, west], "line-ink", 1.5)
    figure.line(west, east, "line-blue", 2.5)
    for p in (west, east):
        figure.circle(p, 5.0, "fill-blue", 0.0)
    for p in (north, south):
        figure.circle(p, 5.0, "fill-violet", 0.0)
    figure.circle((left + side / 2, top + side / 2), 6.0, "fill-red", 0.0)
    figure.text((left + side / 2, top + side / 2 + 22), "vertex", "red", anchor="middle")
    figure.text((14, 262), "Midpoint of an edge", bold=True)
    figure.text((left + side + 12, top + side / 2 + 5), "end", "blue")
    figure.text((left + side / 2 + 14, top + 6), "parent", "violet")

    eye, size, budget = (21, 15), 290, 180
    count = draw_mesh(figure, 270, 62, size, eye, lambda v: True, budget, True)
    figure.text((270, 24), "Everything resident", bold=True)
    figure.text((270, 46), f"budget {budget}, {count} triangles", size=14)

    # The chunk that covers the south-east quarter and everything below it is absent: no vertex of half its spacing.
    def is_resident(vertex):
        return not (vertex[0] > SIDE // 2 and vertex[1] < SIDE // 2 and spacing_of(vertex) < 8)

    draw_mesh(figure, 592, 62, size, eye, is_resident, budget)
    figure.polyline([(592 + size / 2, 62 + size / 2), (592 + size, 62 + size / 2), (592 + size, 62 + size),
                     (592 + size / 2, 62 + size), (592 + size / 2, 62 + size / 2)], "line-violet", 2.5, "6 4")
    figure.text((592, 24), "A chunk is absent", bold=True)
    figure.text((592, 46), "coarser there, and watertight", size=14)
    figure.circle((280, 382), 5.5, "fill-green", 0.0)
    figure.text((292, 387), "eye")
    figure.circle((280, 408), 4.8, "fill-red", 0.0)
    figure.text((292, 413), "an active vertex")
    figure.circle((280, 434), 3.6, "fill-violet", 0.0)
    figure.text((292, 439), "its parents, their parents, ...")
    figure.lines((592, 387), ["dashed: no samples finer than", "an eighth of the square's side"], "violet")
    return figure


# The default morph ratio: terrane/terrain/resident_set.h.
RATIO = 1.3
FULL = RATIO ** 2 / (RATIO ** 2 - 1.0)


def share(priority):
    """Of a vertex, its priority in thresholds: lod/morph.cpp."""
    return min(max(FULL * (1.0 - 1.0 / priority ** 2), 0.0), 1.0)


def priority_at(share_value):
    return 1.0 / math.sqrt(1.0 - share_value / FULL)


def certificate():
    figure = Figure("certificate", 900, 464, "Morph share and the certificate",
                    "Left: the share by which a vertex has moved to its height, against its priority. Right: the priority of the vertex that "
                    "would split the triangle next, against the share; its area is the bound of the error.")
    left = Axes(figure, 70, 62, 320, 300, (0.8, 1.6), (0.0, 1.1))
    left.frame([(0.8, "0.8"), (1.0, "1"), (1.3, "1.3"), (1.6, "1.6")], [(0.0, "0"), (0.5, "0.5"), (1.0, "1")],
               "priority p, in thresholds", "share s(p)")
    points = [0.8 + 0.8 * i / 160 for i in range(161)]
    figure.polyline([left.at(p, share(p)) for p in points], "line-blue", 2.5)
    for p in (1.0, RATIO):
        figure.line(left.at(p, 0.0), left.at(p, 1.1), "line-faint", 1.0, "3 4")
    figure.text((left.at(0.82, 0.0)[0], left.at(0, 0.09)[1]), "not active", "faint")
    figure.text((left.at(1.33, 0.0)[0], left.at(0, 0.09)[1]), "at its height", "faint")
    figure.text((left.at(1.02, 0.0)[0], left.at(0, 0.75)[1]), "morphs", "blue")
    figure.text((14, 24), "A vertex moves in by its priority alone", bold=True)

    right = Axes(figure, 500, 62, 380, 300, (0.0, 1.0), (0.8, 1.4))
    right.frame([(0.0, "0"), (0.5, "0.5"), (1.0, "1")], [(0.8, "0.8"), (1.0, "1"), (1.13, "1.13"), (1.3, "1.3")],
                "share", "priority of the next vertex, in thresholds")
    curve = [i / 200 for i in range(201)]
    figure.polyline([right.at(t, priority_at(t)) for t in curve], "line-blue", 2.5)
    # A chain of vertices over one point, from coarse to fine: the last is not active.
    chain = [1.285, 1.21, 1.12, 1.045, 0.9]
    limits = [1.0] + [share(p) for p in chain]
    total = 0.0
    for k, p in enumerate(chain):
        high, low = limits[k], limits[k + 1]
        total += (high - low) * p
        figure.polygon([right.at(low, 0.8), right.at(high, 0.8), right.at(high, p), right.at(low, p)], "wash-ground")
        figure.line(right.at(low, p), right.at(high, p), "line-ground", 3.0)
        assert p <= priority_at(0.5 * (low + high)), "below the curve"
    mean = 2.0 * RATIO / (RATIO + 1.0)
    steps = 2000
    integral = sum(priority_at((i + 0.5) / steps) for i in range(steps)) / steps
    assert abs(integral - mean) < 1e-6
    figure.line(right.at(0.0, mean), right.at(1.0, mean), "line-red", 1.5, "6 4")
    figure.text((right.at(0.02, 0)[0], right.at(0, mean)[1] - 8), "mean: 2r / (r + 1)", "red")
    figure.text((right.at(0.36, 0)[0], right.at(0, 0.84)[1]), f"this chain: {total:.3f}", "ground")
    figure.text((right.at(0.97, 0)[0], right.at(0, 1.335)[1]), "largest possible", "blue", anchor="end")
    figure.text((444, 24), "The error is the mean over all shares", bold=True)
    figure.lines((14, 432), ["r = morph_ratio = 1.3. Right: each step is a vertex over the same point of the ground, coarse to fine",
                             "from the right: as wide as its share is below that of the one before, as high as its priority."])
    return figure


def figures():
    return [bisection(), certificate()]
