#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`terrane heightmap`: the image, the GeoTIFF and the SDF model, read by code of their own, against `terrane query`."""

import os
import struct
import xml.etree.ElementTree
import zlib

from program import Folder, ask, main, np, run, run_json


def read_png(path):
    """[rows, columns] of a grey PNG of 16 bits without interlacing; checks its sums."""
    with open(path, "rb") as file:
        content = file.read()
    assert content[:8] == b"\x89PNG\r\n\x1a\n"
    at, data = 8, b""
    while at < len(content):
        size, kind = struct.unpack_from(">I4s", content, at)
        body = content[at + 8:at + 8 + size]
        assert zlib.crc32(kind + body) == struct.unpack_from(">I", content, at + 8 + size)[0]
        if kind == b"IHDR":
            width, height, *rest = struct.unpack(">IIBBBBB", body)
            assert rest == [16, 0, 0, 0, 0], rest
        elif kind == b"IDAT":
            data += body
        at += 12 + size
    lines = np.frombuffer(zlib.decompress(data), np.uint8).reshape(height, 1 + 2 * width)
    pixels = np.zeros((height, 2 * width), np.uint8)
    for row in range(height):
        kind, line = int(lines[row, 0]), lines[row, 1:].astype(int)
        above = pixels[row - 1].astype(int) if row > 0 else np.zeros(2 * width, int)
        for i in range(2 * width):
            left = int(pixels[row, i - 2]) if i >= 2 else 0
            corner = int(above[i - 2]) if i >= 2 else 0
            guess = left + above[i] - corner
            paeth = min((left, above[i], corner), key=lambda value: abs(guess - value))
            pixels[row, i] = (line[i] + (0, left, above[i], (left + above[i]) // 2, paeth)[kind]) % 256
    return pixels.view(">u2").astype(int)


def read_tiff(path):
    """[rows, columns] of an uncompressed little-endian TIFF of floats, and its tags."""
    with open(path, "rb") as file:
        content = file.read()
    mark, version, at = struct.unpack_from("<2sHI", content)
    assert (mark, version) == (b"II", 42)
    sizes = {1: ("B", 1), 2: ("B", 1), 3: ("H", 2), 4: ("I", 4), 12: ("d", 8)}
    tags = {}
    for k in range(struct.unpack_from("<H", content, at)[0]):
        tag, kind, count = struct.unpack_from("<HHI", content, at + 2 + 12 * k)
        letter, size = sizes[kind]
        place = at + 10 + 12 * k
        if count * size > 4:
            place = struct.unpack_from("<I", content, place)[0]
        tags[tag] = struct.unpack_from(f"<{count}{letter}", content, place)
    assert tags[259] == (1,) and tags[258] == (32,) and tags[339] == (3,)
    data = b"".join(content[start:start + size] for start, size in zip(tags[273], tags[279]))
    return np.frombuffer(data, "<f4").reshape(tags[257][0], tags[256][0]), tags


class Heightmap(Folder):
    terrain = ["--seed", 3, "--detail-m", 2, "--world-m", 8192]

    def queried(self, summary, rows, columns):
        places = [(summary["west_m"] + summary["spacing_m"] * c, summary["north_m"] - summary["spacing_m"] * r)
                  for r, c in zip(rows, columns)]
        answers = ask(self.terrain, [{"op": "height", "x": x, "y": y} for x, y in places])
        return np.array([a["height"] for a in answers]), np.array([a["error_m"] for a in answers])

    def test_the_image_and_the_model_hold_the_heights_of_the_terrain(self):
        png, sdf = self.path("ground.png"), self.path("ground.sdf")
        summary = run_json("heightmap", *self.terrain, "--side", 65, "--centre-x-m", 300, "--centre-y-m", -500,
                           "--out", png, "--sdf", sdf)
        pixels = read_png(png)
        self.assertEqual(pixels.shape, (65, 65))
        self.assertEqual((pixels.min(), pixels.max()), (0, 65535))
        model = xml.etree.ElementTree.parse(sdf).getroot()
        for part in ("collision", "visual"):
            [shape] = model.findall(f"./model/link/{part}/geometry/heightmap")
            self.assertEqual(shape.find("uri").text, "ground.png")
            size = [float(word) for word in shape.find("size").text.split()]
            place = [float(word) for word in shape.find("pos").text.split()]
        # as Gazebo has it: the centre of the square at pos, 0 at pos z, the brightest pixel size z above
        self.assertEqual(size[:2], [128, 128])
        self.assertEqual([place[0] - 64, place[1] + 64], [summary["west_m"], summary["north_m"]])
        heights = place[2] + pixels / 65535 * size[2]
        random = np.random.default_rng(5)
        rows, columns = random.integers(0, 65, 200), random.integers(0, 65, 200)
        found, error = self.queried(summary, rows, columns)
        over = np.abs(heights[rows, columns] - found) - summary["quantisation_error_m"] - error
        self.assertLessEqual(over.max(), 0)
        self.assertAlmostEqual(summary["quantisation_error_m"], size[2] / 65535 / 2, places=9)

    def test_the_geotiff_has_the_heights_as_floats_in_their_place(self):
        tif = self.path("ground.tif")
        summary = run_json("heightmap", *self.terrain, "--side", 33, "--spacing-m", 8, "--out", tif)
        heights, tags = read_tiff(tif)
        self.assertEqual(summary["spacing_m"], 8)
        random = np.random.default_rng(7)
        rows, columns = random.integers(0, 33, 100), random.integers(0, 33, 100)
        found, error = self.queried(summary, rows, columns)
        self.assertLessEqual((np.abs(heights[rows, columns] - found) - error).max(), 1e-4)
        self.assertEqual(tags[33550][:2], (8, 8))  # the size of a pixel
        self.assertEqual(tags[33922][3:5], (summary["west_m"] - 4, summary["north_m"] + 4))

    def test_holes_are_refused_or_filled_with_what_was_said(self):
        heights, raster = self.hills()
        done = run("heightmap", "--dem", raster, "--side", 65, "--out", self.path("a.png"))
        self.assert_refused(done, [1], "a heightmap has no holes", "--absent-m")
        self.assertFalse(os.path.exists(self.path("a.png")))
        tif = self.path("a.tif")
        summary = run_json("heightmap", "--dem", raster, "--side", 65, "--absent-m", 123, "--out", tif)
        found, _ = read_tiff(tif)
        x = summary["west_m"] + 10 * np.arange(65)
        y = summary["north_m"] - 10 * np.arange(65)
        absent = (np.abs(x)[None, :] > 300) | (np.abs(y)[:, None] > 225)
        self.assertEqual(np.count_nonzero(found == 123), np.count_nonzero(absent))
        self.assertEqual(summary["absent"], np.count_nonzero(absent))
        i, j = np.round(x / 10 + 29.5).astype(int), np.round(22 - y / 10).astype(int)
        if np.allclose(x / 10 + 29.5, i) and np.allclose(22 - y / 10, j):
            inside = [(r, c) for r in range(65) for c in range(65) if 0 <= i[c] < 60 and 0 <= j[r] < 45]
            self.assertLess(max(abs(found[r, c] - heights[j[r], i[c]]) for r, c in inside), 1e-3)


if __name__ == "__main__":
    main()
