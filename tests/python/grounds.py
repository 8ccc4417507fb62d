# SPDX-License-Identifier: MIT
"""Grounds that the tests stand on."""
import os
import unittest

import numpy as np

import terrane

SEED = 20261126


def has(component):
    return component in terrane.components


def loaded(source, region=(-100.0, -100.0, 100.0, 100.0), **settings):
    """The terrain of a source with all ground of a region resident, west, south, east, north."""
    terrain = terrane.Terrain(source, worker_count=0, **settings)
    terrain.require(region)
    terrain.load([], None, 0.0)
    return terrain


def small_fractal(**settings):
    """A world of 2 x 2 km."""
    wanted = {"seed": 7, "amplitude": 60.0, "wavelength_log2": 9, "octave_count": 8, "root_size_log2": 10}
    return terrane.fractal(**{**wanted, **settings})


def write_raster(path, heights, cell):
    """An ESRI ASCII grid: rows from the north."""
    rows, columns = heights.shape
    with open(path, "w", encoding="ascii") as file:
        file.write(f"ncols {columns}\nnrows {rows}\nxllcorner 0\nyllcorner 0\ncellsize {cell}\nNODATA_value -9999\n")
        for row in heights:
            file.write(" ".join(f"{h:.6f}" for h in row) + "\n")


def hills(rows=64, columns=80):
    """Heights that a 32-bit float holds, rows from the north."""
    y, x = np.mgrid[0:rows, 0:columns]
    return np.float32(np.round(40 * np.sin(x / 9.0) * np.cos(y / 7.0) + 200, 2))


def bilinear(heights, cell, x, y):
    """The bilinear surface through the samples' centres; world (0, 0) is the middle of the raster."""
    rows, columns = heights.shape
    u = np.clip(x / cell + columns / 2 - 0.5, 0, columns - 1)
    v = np.clip(rows / 2 - 0.5 - y / cell, 0, rows - 1)
    i = np.minimum(u.astype(int), columns - 2)
    j = np.minimum(v.astype(int), rows - 2)
    s, t = u - i, v - j
    h = heights.astype(float)
    return ((h[j, i] * (1 - s) + h[j, i + 1] * s) * (1 - t) + (h[j + 1, i] * (1 - s) + h[j + 1, i + 1] * s) * t)


def triangle_height(chunk, x, y):
    """The contact surface of a chunk at a place, from its samples: the oracle of heights and normals."""
    west, south = chunk.origin
    u, v = (x - west) / chunk.spacing, (y - south) / chunk.spacing
    column, row = min(int(u), 127), min(int(v), 127)
    s, t = u - column, v - row
    h = chunk.heights[row:row + 2, column:column + 2].astype(float) * chunk.quantum
    sw, se, nw, ne = h[0, 0], h[0, 1], h[1, 0], h[1, 1]
    # The cell's own column and row, counted from lattice point (0, 0).
    level_column = round(west / chunk.spacing) + column
    level_row = round(south / chunk.spacing) + row
    if (level_column + level_row) % 2 == 0:
        dx, dy = (se - sw, ne - se) if s >= t else (ne - nw, nw - sw)
        height = sw + dx * s + dy * t
    elif s + t <= 1:
        dx, dy = se - sw, nw - sw
        height = sw + dx * s + dy * t
    else:
        dx, dy = ne - nw, ne - se
        height = ne - dx * (1 - s) - dy * (1 - t)
    normal = np.array([-dx / chunk.spacing, -dy / chunk.spacing, 1.0])
    return height, normal / np.linalg.norm(normal)


def random_rotations(random, count):
    """Unit quaternions w, x, y, z, and their matrices by Rodrigues' formula."""
    q = random.normal(size=(count, 4))
    q /= np.linalg.norm(q, axis=1)[:, None]
    angle = 2 * np.arctan2(np.linalg.norm(q[:, 1:], axis=1), q[:, 0])
    axis = q[:, 1:] / np.linalg.norm(q[:, 1:], axis=1)[:, None]
    matrices = []
    for a, (x, y, z) in zip(angle, axis):
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        matrices.append(np.eye(3) + np.sin(a) * cross + (1 - np.cos(a)) * cross @ cross)
    return q, np.array(matrices)


PROGRAM = os.environ.get("TERRANE_PROGRAM", "")
main = unittest.main
