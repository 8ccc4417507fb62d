# SPDX-License-Identifier: MIT
"""Plots a terrain with shaded relief, drops balls on it, and saves a picture.

    plot_terrain.py [--dem FILE] [--balls 1000] [--seconds 8] [--out terrain.png]
"""
import argparse

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LightSource

import terrane


def open_terrain(path):
    if path is None:
        return terrane.fractal(seed=7, kind="ridged", amplitude=300.0, wavelength_log2=10, root_size_log2=11)
    return terrane.open_dem(path)


def drop_balls(source, region, count, seconds):
    """Drops balls on a region of a source. Returns the ground, and the states before and after."""
    west, south, east, north = region
    with terrane.Terrain(source, worker_count=2) as terrain:
        required = terrain.require(region)
        ground = terrain.load([], None, 0.0).ground
        if not required.is_ready:
            raise SystemExit(f"the ground of the region cannot be loaded: {terrain.last_failure}")
        random = np.random.default_rng(1)
        margin = 0.1 * (east - west)
        x = random.uniform(west + margin, east - margin, count)
        y = random.uniform(south + margin, north - margin, count)
        height = ground.heights(x, y).height
        on_ground = np.isfinite(height)
        world = terrane.World(collide_bodies=True, worker_count=2)
        start = np.column_stack([x, y, height + 10.0])[on_ground]
        world.add(terrane.Shape.sphere(0.5), start, mass=10.0, restitution=0.4, friction=0.2)
        too_deep, step = 0, 1 / 30
        for i in range(int(seconds / step)):
            ground = terrain.update([], world.needs(), i * step).ground
            too_deep += world.step(ground, step).too_deep
        print(f"{on_ground.sum()} balls, {too_deep} steps of a ball too deep in the ground")
        return ground, start, world.states()


def plot(ground, region, start, states, path):
    west, south, east, north = region
    # Row 0 is the north, as pictures have it.
    x, y = np.meshgrid(np.linspace(west, east, 600), np.linspace(north, south, 600))
    height = np.ma.masked_invalid(ground.heights(x, y).height)
    shade = LightSource(azdeg=315, altdeg=40)
    relief = shade.shade(height, cmap=plt.get_cmap("gist_earth"), blend_mode="soft", vert_exag=1.5,
                         dx=(east - west) / 599, dy=(north - south) / 599)
    figure, axes = plt.subplots(figsize=(9, 8), dpi=100)
    axes.imshow(relief, extent=(west, east, south, north))
    end = states.position
    moved = np.linalg.norm(end[:, :2] - start[:, :2], axis=1)
    axes.plot([start[:, 0], end[:, 0]], [start[:, 1], end[:, 1]], color="white", linewidth=0.4, alpha=0.6)
    points = axes.scatter(end[:, 0], end[:, 1], c=moved, s=6, cmap="autumn_r", edgecolors="black", linewidths=0.2)
    figure.colorbar(points, ax=axes, label="rolled, metres")
    axes.set_xlabel("x east, metres")
    axes.set_ylabel("y north, metres")
    axes.set_title(f"{len(end)} balls on the ground")
    axes.set_xlim(west, east)
    axes.set_ylim(south, north)
    figure.tight_layout()
    figure.savefig(path)
    plt.close(figure)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--dem", help="a raster of heights; absent: a fractal")
    parser.add_argument("--balls", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--side", type=float, default=400.0, help="of the region around the middle, metres")
    parser.add_argument("--out", default="terrain.png")
    arguments = parser.parse_args()
    half = arguments.side / 2
    region = (-half, -half, half, half)
    ground, start, states = drop_balls(open_terrain(arguments.dem), region, arguments.balls, arguments.seconds)
    plot(ground, region, start, states, arguments.out)
    print(arguments.out)


if __name__ == "__main__":
    main()
