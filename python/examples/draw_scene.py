# SPDX-License-Identifier: MIT
"""Drops crates around a cottage with a smoking chimney, and saves pictures: bodies of a World as nodes of a Scene.

    draw_scene.py [--seconds 4] [--pictures 5] [--out scene.png]      scene_0.png, scene_1.png, ...
"""
import argparse
import pathlib
import struct
import zlib

import numpy as np

import terrane

SIZE = (640, 360)
STEP = 1 / 60


def write_png(path, picture):
    height, width, _ = picture.shape
    rows = np.concatenate([np.zeros((height, 1), np.uint8), picture.reshape(height, -1)], axis=1)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n")
        for kind, data in ((b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)),
                           (b"IDAT", zlib.compress(rows.tobytes())), (b"IEND", b"")):
            file.write(struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)))


def add_cottage(scene, foot):
    house = scene.add_group(foot)
    scene.add_object(scene.add_box((5, 4, 3), colour=(0.9, 0.85, 0.75)), (0, 0, 2), parent=house)
    roof = scene.add_model([(-6, -5, 0), (6, -5, 0), (6, 5, 0), (-6, 5, 0), (-6, 0, 4), (6, 0, 4)],
                           [(0, 1, 5), (0, 5, 4), (2, 3, 4), (2, 4, 5), (0, 4, 3), (1, 2, 5), (0, 3, 2), (0, 2, 1)],
                           colour=(0.55, 0.2, 0.15))
    scene.add_object(roof, (0, 0, 5), parent=house)
    chimney = scene.add_object(scene.add_box((0.5, 0.5, 2), colour=(0.4, 0.3, 0.3)), (3, -2, 8), parent=house)
    scene.add_emitter((0, 0, 2), parent=chimney, rate=20, life=(3, 6), velocity=(0, 0, 2), wind=(1.5, 0.5, 0), drag_time=3,
                      radius=(0.4, 2), colours=((0.8, 0.8, 0.8, 0.6), (0.9, 0.9, 0.9, 0)))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--pictures", type=int, default=5)
    parser.add_argument("--out", type=pathlib.Path, default="scene.png")
    arguments = parser.parse_args()

    source = terrane.fractal(seed=7, amplitude=60.0, wavelength_log2=9, root_size_log2=10)
    foot = np.array([0, 0, float(source.heights(0, 0))])
    view = terrane.look_at(foot + (-26, -32, 14), foot + (0, 0, 5), 1.0, *SIZE)
    with terrane.Renderer(*SIZE, ground_look="alpine", shadow_distance=300.0) as renderer, terrane.World() as world, \
            terrane.Terrain(source) as terrain:
        scene = terrane.Scene(renderer)
        add_cottage(scene, foot)
        half_extents = (0.8, 0.5, 0.5)
        random = np.random.default_rng(2)
        angle = random.uniform(0, 2 * np.pi, 40)
        above = foot + np.column_stack([12 * np.cos(angle), 12 * np.sin(angle), 6 + 0.3 * np.arange(40)])
        bodies = world.add(terrane.Shape.box(half_extents), above, mass=50.0)
        crate = scene.add_box(half_extents, colour=(0.6, 0.4, 0.2))
        nodes = [scene.add_object(crate, place, tint=random.uniform(0.6, 1.4, 3)) for place in above]
        cameras = [terrane.Camera(view)]
        terrain.load(cameras, world.needs(), 0.0, scene=scene)
        frames = max(int(arguments.seconds / STEP), 1)
        drawn = np.linspace(frames, 0, arguments.pictures, endpoint=False).astype(int)[::-1]
        for i in range(1, frames + 1):
            frame = terrain.update(cameras, world.needs(), i * STEP, scene=scene)
            world.step(frame.ground, STEP)
            if i not in drawn:
                continue
            for body, node in zip(bodies, nodes):
                state = world.state(int(body))
                node.set_place(state.position, state.rotation)
            scene.set_time(i * STEP)
            path = arguments.out.with_stem(f"{arguments.out.stem}_{np.searchsorted(drawn, i)}")
            write_png(path, renderer.draw(frame.meshes[0], view, scene=scene))
            print(f"{path}: {frame.meshes[0].triangle_count} triangles of ground, {scene.counts.triangles} of objects and smoke")


if __name__ == "__main__":
    main()
