# SPDX-License-Identifier: MIT
"""Terrane: ground to see and ground to stand on, for simulators.

Metres, seconds, radians, kilograms; x east, y north, z up. Batches take and give numpy arrays: a C-contiguous float64 array
is read in place, others are copied once. Errors are ValueError, OSError, MemoryError, TimeoutError or RuntimeError with
one line that names the thing and the value.

    import terrane
    terrain = terrane.Terrain(terrane.fractal(seed=7))
    world = terrane.World()
    ball = world.add(terrane.Shape.sphere(0.5), (0, 0, 800), mass=10)
    camera = terrane.Camera(terrane.look_at((0, -30, 800), (0, 0, 780)))
    terrain.load([camera], world.needs(), 0.0)                          # blocks; update() does not
    for i in range(1, 120):
        frame = terrain.update([camera], world.needs(), i / 60)
        world.step(frame.ground, 1 / 60)                                # draw frame.meshes[0]
    print(world.state(ball).position, frame.meshes[0].triangles.shape)
"""
from . import answers as _answers
from .answers import *  # noqa: F401,F403
from . import _terrane
from ._terrane import *  # noqa: F401,F403
from ._terrane import __version__, components

__all__ = sorted(_answers.__all__ + [name for name in dir(_terrane) if not name.startswith("_")])

_OPTIONAL = {"open_store": "store", "open_http": "remote", "bake": "store", "ShardBaker": "store", "open_dem": "dem", "open_imagery": "dem", "Renderer": "render",
             "Scene": "render", "Model": "render", "Node": "render"}
_ONLY_IN_CPP = {"read_track": "playback", "Track": "playback", "CameraPath": "playback",
                "ChunkNodes": "scene", "VolumeEditor": "volume"}


def __getattr__(name):
    if name in _OPTIONAL:
        raise AttributeError(f"terrane.{name}: this Terrane was built without the component '{_OPTIONAL[name]}'")
    if name in _ONLY_IN_CPP:
        raise AttributeError(f"terrane.{name} is in C++ only: the component '{_ONLY_IN_CPP[name]}' has no Python functions")
    raise AttributeError(f"module 'terrane' has no attribute '{name}'")
