#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Makes the meshes and the scene of a village: make_village.py FOLDER writes village.json, its .obj files, the pictures of
its sprites and its smoke, and the path village.csv there; with --check it only compares them with the files of the folder.

All meshes stand on z = 0, z up, in metres, and have a colour for each vertex. The same bytes on every run.
"""
import json
import math
import pathlib
import random
import struct
import sys
import zlib


class Mesh:
    """Triangles and polygons with a colour each; corners are not shared, so that edges stay sharp."""

    def __init__(self):
        self.corners, self.faces = [], []

    def face(self, points, colour):
        first = len(self.corners) + 1
        self.corners += [(*point, *colour) for point in points]
        self.faces.append(range(first, first + len(points)))

    def box(self, low, high, colour, top=None):
        (a, b, c), (d, e, f) = low, high
        sides = [[(a, b, c), (d, b, c), (d, b, f), (a, b, f)], [(d, b, c), (d, e, c), (d, e, f), (d, b, f)],
                 [(d, e, c), (a, e, c), (a, e, f), (d, e, f)], [(a, e, c), (a, b, c), (a, b, f), (a, e, f)]]
        for side in sides:
            self.face(side, colour)
        self.face([(a, b, f), (d, b, f), (d, e, f), (a, e, f)], top or colour)
        self.face([(a, e, c), (d, e, c), (d, b, c), (a, b, c)], colour)

    def text(self, title):
        lines = [f"# {title}"]
        lines += ["v " + " ".join(f"{value:.3f}" for value in corner) for corner in self.corners]
        lines += ["f " + " ".join(str(index) for index in face) for face in self.faces]
        return "\n".join(lines) + "\n"

    def picture(self, width_m, height_m, width_px, height_px):
        """A PNG file of the mesh seen along y, from z = 0 up; transparent around it. Four samples a pixel."""
        wide, high = 2 * width_px, 2 * height_px
        depths, colours = [math.inf] * (wide * high), [None] * (wide * high)
        for face in self.faces:
            corners = [self.corners[i - 1] for i in face]
            for k in range(1, len(corners) - 1):
                fill(depths, colours, wide, high, [((p[0] / width_m + 0.5) * wide, (1 - p[2] / height_m) * high, p[1], p[3:6])
                                                   for p in (corners[0], corners[k], corners[k + 1])])
        pixels = []
        for row in range(height_px):
            for column in range(width_px):
                samples = [colours[(2 * row + i) * wide + 2 * column + k] for i in (0, 1) for k in (0, 1)]
                drawn = [sample for sample in samples if sample]
                mean = [sum(sample[i] for sample in drawn) / len(drawn) if drawn else 0.2 for i in range(3)]
                pixels.append((*mean, len(drawn) / 4))
        return png(width_px, height_px, pixels)


def png(width, height, pixels):
    """A PNG file of red, green, blue and opacity from 0 to 1, row by row from the top."""
    rows = b"".join(b"\0" + bytes(round(255 * value) for pixel in pixels[width * row:width * (row + 1)] for value in pixel)
                    for row in range(height))
    # stored, not compressed: the same bytes with every zlib
    chunks = ((b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)), (b"IDAT", zlib.compress(rows, 0)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks)


def fill(depths, colours, wide, high, corners):
    """Draws a triangle of (x, y, depth, colour) in pixels: those whose middle it covers and that are nearer."""
    (ax, ay, az, colour), (bx, by, bz, _), (cx, cy, cz, _) = corners
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    if area == 0:
        return
    for y in range(max(0, math.floor(min(ay, by, cy))), min(high, math.ceil(max(ay, by, cy)) + 1)):
        for x in range(max(0, math.floor(min(ax, bx, cx))), min(wide, math.ceil(max(ax, bx, cx)) + 1)):
            px, py = x + 0.5, y + 0.5
            b = ((px - ax) * (cy - ay) - (py - ay) * (cx - ax)) / area
            c = ((bx - ax) * (py - ay) - (by - ay) * (px - ax)) / area
            depth = az + b * (bz - az) + c * (cz - az)
            if b >= 0 and c >= 0 and b + c <= 1 and depth < depths[y * wide + x]:
                depths[y * wide + x], colours[y * wide + x] = depth, colour


def house(length, width, eaves, ridge, wall, roof):
    """A house whose ridge runs along x, with a door, windows and a chimney."""
    mesh = Mesh()
    x, y, foot = length / 2, width / 2, -1.5  # the foot reaches into sloping ground
    stone, wood, glass = (0.50, 0.48, 0.45), (0.35, 0.24, 0.16), (0.22, 0.28, 0.34)
    mesh.box((-x - 0.1, -y - 0.1, foot), (x + 0.1, y + 0.1, 0.4), stone)
    for side in (-1, 1):
        across = [(-x, side * y, 0.4), (x, side * y, 0.4), (x, side * y, eaves), (-x, side * y, eaves)]
        mesh.face(across if side < 0 else across[::-1], wall)
        gable = [(side * x, -y, 0.4), (side * x, y, 0.4), (side * x, y, eaves), (side * x, 0, ridge), (side * x, -y, eaves)]
        mesh.face(gable if side > 0 else gable[::-1], wall)
        # a roof of 0.2 m that hangs over by half a metre
        drop, over = 0.5 * (ridge - eaves) / y, 0.5
        low, high = eaves - drop, ridge + 0.2
        upper = [(-x - over, side * (y + over), low + 0.2), (x + over, side * (y + over), low + 0.2),
                 (x + over, 0, high), (-x - over, 0, high)]
        lower = [(px, py, pz - 0.2) for px, py, pz in upper]
        mesh.face(upper if side < 0 else upper[::-1], roof)
        mesh.face(lower[::-1] if side < 0 else lower, wood)
        for i, j in ((0, 1), (1, 2), (3, 0)):
            rim = [lower[i], lower[j], upper[j], upper[i]]
            mesh.face(rim if side < 0 else rim[::-1], wood)
        # windows stand out by 3 cm, so that no two faces are in one plane
        for k in range(-1, 2):
            if side < 0 and k == 0:
                continue
            middle, depth = k * length / 3.2, side * (y + 0.03)
            for low_z, high_z, half, colour in ((1.2, 2.6, 0.62, wood), (1.3, 2.5, 0.52, glass)):
                pane = [(middle - half, depth, low_z), (middle + half, depth, low_z), (middle + half, depth, high_z),
                        (middle - half, depth, high_z)]
                mesh.face(pane if side < 0 else pane[::-1], colour)
                depth += side * 0.02
    mesh.face([(-0.6, -y - 0.03, 0.4), (0.6, -y - 0.03, 0.4), (0.6, -y - 0.03, 2.5), (-0.6, -y - 0.03, 2.5)], wood)
    mesh.box((-0.9, -y - 0.9, -0.5), (0.9, -y - 0.1, 0.35), stone)
    chimney = 0.3 * length
    mesh.box((chimney - 0.45, 0.6, eaves), (chimney + 0.45, 1.5, ridge + 1.0), (0.48, 0.25, 0.20), (0.1, 0.1, 0.1))
    return mesh


def tower(side, height, wall, roof):
    """A tower with a pyramid as its roof, windows on all sides."""
    mesh = Mesh()
    h = side / 2
    mesh.box((-h, -h, -1.5), (h, h, height), wall)
    top, over = height + 1.6 * side, h + 0.4
    rim = [(-over, -over, height - 0.2), (over, -over, height - 0.2), (over, over, height - 0.2), (-over, over, height - 0.2)]
    for i in range(4):
        mesh.face([rim[i], rim[(i + 1) % 4], (0, 0, top)], roof)
    mesh.face(rim[::-1], (0.35, 0.24, 0.16))
    for i in range(4):
        c, s = ((1, 0), (0, 1), (-1, 0), (0, -1))[i]
        for low_z in (0.45 * height, 0.75 * height):
            points = [(-0.4, -h - 0.03, low_z), (0.4, -h - 0.03, low_z), (0.4, -h - 0.03, low_z + 1.6), (-0.4, -h - 0.03, low_z + 1.6)]
            mesh.face([(c * px - s * py, s * px + c * py, pz) for px, py, pz in points], (0.15, 0.16, 0.2))
    return mesh


def linden(segments, rings, seed):
    """A broad tree: a trunk, and crowns of bumpy balls."""
    mesh, noise = Mesh(), random.Random(seed)
    bark, sides = (0.33, 0.26, 0.20), max(4, segments // 2)

    def ring(radius, z, count):
        return [(radius * math.cos(2 * math.pi * i / count), radius * math.sin(2 * math.pi * i / count), z) for i in range(count)]

    stem = [ring(0.45, -0.8, sides), ring(0.28, 1.5, sides), ring(0.2, 3.5, sides)]
    for below, above in zip(stem, stem[1:]):
        for i in range(sides):
            k = (i + 1) % sides
            mesh.face([below[i], below[k], above[k], above[i]], bark)
    for cx, cy, cz, radius in ((0, 0, 5.2, 2.6), (1.4, 0.6, 4.4, 1.6), (-1.2, -0.9, 4.5, 1.7), (-0.4, 1.4, 4.2, 1.5), (0.5, -1.4, 6.0, 1.5)):
        grid = []
        for r in range(rings + 1):
            polar = math.pi * r / rings
            row = []
            for i in range(segments):
                turn = 2 * math.pi * i / segments
                bump = radius * (1 if r in (0, rings) else noise.uniform(0.82, 1.12))
                row.append((cx + bump * math.sin(polar) * math.cos(turn), cy + bump * math.sin(polar) * math.sin(turn), cz + 0.85 * bump * math.cos(polar)))
            grid.append(row)
        for r in range(rings):
            for i in range(segments):
                k = (i + 1) % segments
                shade = noise.uniform(0.85, 1.1) * (1.1 - 0.35 * r / rings)
                colour = (0.20 * shade, 0.30 * shade, 0.13 * shade)
                upper, lower = grid[r], grid[r + 1]
                if r > 0:
                    mesh.face([upper[i], lower[k], upper[k]], colour)
                if r + 1 < rings:
                    mesh.face([upper[i], lower[i], lower[k]], colour)
    return mesh


def fence(length):
    mesh, wood = Mesh(), (0.47, 0.40, 0.33)
    for i in range(int(length / 2) + 1):
        x = 2 * i - length / 2
        mesh.box((x - 0.06, -0.06, -0.8), (x + 0.06, 0.06, 1.1), wood)
    for z in (0.4, 0.85):
        mesh.box((-length / 2, -0.03, z), (length / 2, 0.03, z + 0.12), wood)
    return mesh


def puff(side, seed):
    """A PNG file of a puff of smoke: billows of grey whose edge is frayed by noise."""
    noise, octaves = random.Random(seed), []
    for cells in (4, 8, 16):
        octaves.append((cells, [[noise.random() for _ in range(cells + 1)] for _ in range(cells + 1)]))

    def billows(u, v):
        total = weights = 0
        for i, (cells, values) in enumerate(octaves):
            x, y, weight = u * cells, v * cells, 0.5 ** i
            column, row = min(int(x), cells - 1), min(int(y), cells - 1)
            s, t = x - column, y - row
            s, t = s * s * (3 - 2 * s), t * t * (3 - 2 * t)
            upper = values[row][column] * (1 - s) + values[row][column + 1] * s
            lower = values[row + 1][column] * (1 - s) + values[row + 1][column + 1] * s
            total, weights = total + weight * (upper * (1 - t) + lower * t), weights + weight
        return total / weights

    pixels = []
    for row in range(side):
        for column in range(side):
            u, v = (column + 0.5) / side, (row + 0.5) / side
            x, y, value = 2 * u - 1, 2 * v - 1, billows(u, v)
            squared = x * x + y * y
            # dense where the noise is high, thin towards an uneven edge
            dense = max(0, min(1, 1.75 - 1.5 * squared - 1.6 * (1 - value)))
            opacity = dense * dense * (3 - 2 * dense) * max(0, min(1, 3 * (1 - squared)))
            grey = 0.6 + 0.4 * value
            pixels.append((grey, grey, grey, opacity))
    return png(side, side, pixels)


def quaternion(degrees):
    half = math.radians(degrees) / 2
    return [round(math.cos(half), 9), 0, 0, round(math.sin(half), 9)]


def smoke(place, seed):
    return {"position": place, "emitter": {
        "per_s": 9, "life_s": [5, 9], "source_m": 0.15, "velocity": [0, 0, 1.6], "spread_m_s": 0.35, "wind": [1.6, 0.5, 0],
        "drag_s": 2, "acceleration": [0, 0, 0.5], "radius_m": [0.25, 1.9],
        "colour": [[0.42, 0.47, 0.55, 0.75], [0.58, 0.65, 0.74, 0]], "image": "smoke.png", "most": 120, "seed": seed}}


def village(x, y):
    """Houses along a street that runs east through (x, y), trees and a church."""
    place, nodes = random.Random(11), []
    for i in range(10):
        side = -1 if i % 2 else 1
        at = [round(x - 60 + 13 * i + place.uniform(-2, 2), 1), round(y + side * (15 + place.uniform(0, 4)), 1), 0]
        kind = ("house", "cottage", "barn")[i % 3]
        turn = (180 if side > 0 else 0) + place.uniform(-12, 12)
        children = [{"mesh": f"{kind}.obj"}]
        if kind != "barn" and i % 4 != 3:
            children.append(smoke({"house": [3.0, 1.05, 8.2], "cottage": [2.4, 1.05, 6.2]}[kind], i))
        nodes.append({"position": at, "on_ground": True, "rotation": quaternion(turn), "children": children})
    nodes.append({"position": [x + 88, y + 16, 0], "on_ground": True, "children": [
        {"mesh": "house.obj", "scale": 1.4}, {"mesh": "tower.obj", "position": [-10.5, 0, 0]}]})
    for i in range(24):
        side = -1 if i % 2 else 1
        at = [round(x - 75 + 7.5 * i + place.uniform(-2, 2), 1), round(y + side * (28 + place.uniform(0, 14)), 1), 0]
        nodes.append({"position": at, "on_ground": True, "rotation": quaternion(place.uniform(0, 360)),
                      "scale": round(place.uniform(0.9, 1.5), 2), "switch": {"limits": [90, 220, "always"], "fade_ratio": 1.25},
                      "children": [{"mesh": "linden.obj", "levels": ["linden_far.obj"]}, {"mesh": "linden_far.obj"},
                                   {"sprite": {"image": "linden.png", "size_m": [6.4, 8]}}]})
    for i in range(8):
        nodes.append({"position": [x - 58 + 16 * i, y + (-7 if i % 2 else 7), 0], "on_ground": True, "children": [{"mesh": "fence.obj"}]})
    return nodes


def street_path(x, y, seconds):
    """A track that comes uphill from the west, joins the street through (x, y) in an arc and follows its middle at a steady speed."""
    start, end, cut = (x - 160, y - 60), (x + 80, y), 24
    turn = math.atan2(0.7, 1)  # the street is reached at this angle
    corner = start[0] + (y - start[1]) / 0.7
    radius = cut / math.tan(turn / 2)
    slope, arc = math.hypot(corner - start[0], y - start[1]) - cut, radius * turn
    speed = (slope + arc + end[0] - corner - cut) / seconds
    lines = ["time_s,x_m,y_m"]
    for time in range(seconds + 1):
        way = speed * time
        if way < slope:
            p = start[0] + way * math.cos(turn), start[1] + way * math.sin(turn)
        elif way < slope + arc:
            left = turn - (way - slope) / radius
            p = corner + cut - radius * math.sin(left), y - radius * (1 - math.cos(left))
        else:
            p = corner + cut + way - slope - arc, y
        lines.append(f"{time},{p[0]:.1f},{p[1]:.1f}")
    return "\n".join(lines) + "\n"


def main():
    arguments = sys.argv[1:]
    checks = arguments[:1] == ["--check"]
    if len(arguments) != 1 + checks:
        sys.exit("usage: make_village.py [--check] FOLDER")
    folder = pathlib.Path(arguments[-1])
    meshes = {
        "house": (house(10, 7, 4.0, 7.2, (0.86, 0.82, 0.72), (0.52, 0.22, 0.16)), "A house of 10 x 7 m."),
        "cottage": (house(8, 6, 2.9, 5.2, (0.78, 0.74, 0.70), (0.36, 0.34, 0.33)), "A cottage of 8 x 6 m."),
        "barn": (house(14, 9, 4.6, 8.6, (0.42, 0.28, 0.20), (0.45, 0.42, 0.38)), "A barn of 14 x 9 m."),
        "tower": (tower(5, 14, (0.80, 0.78, 0.74), (0.25, 0.30, 0.32)), "A church's tower of 22 m."),
        "linden": (linden(12, 8, 3), "A broad tree of 8 m."),
        "linden_far": (linden(6, 4, 3), "The same tree, coarse."),
        "fence": (fence(12), "A fence of 12 m."),
    }
    scene = {"dem": "jacksboro.tif", "seed": 7, "detail_m": 1}
    nodes = ",\n".join("        " + json.dumps(node) for node in village(2800, 200))
    files = {f"{name}.obj": mesh.text(title).encode() for name, (mesh, title) in meshes.items()}
    files["linden.png"] = meshes["linden"][0].picture(6.4, 8, 64, 80)
    files["smoke.png"] = puff(64, 5)
    files["village.csv"] = street_path(2800, 200, 16).encode()
    files["village.json"] = ("{\n    " + json.dumps(scene)[1:-1] + ",\n    \"nodes\": [\n" + nodes + "\n    ]\n}\n").encode()
    for name, content in files.items():
        if not checks:
            (folder / name).write_bytes(content)
        elif (folder / name).read_bytes() != content:
            sys.exit(f"make_village.py: {folder / name} is not what this script makes")


if __name__ == "__main__":
    main()
