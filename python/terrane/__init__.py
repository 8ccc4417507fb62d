# SPDX-License-Identifier: MIT
"""Terrane: ground to see and ground to stand on, for simulators.

Metres, seconds, radians, kilograms; x east, y north, z up. Batches take and give numpy arrays: a C-contiguous float64 array
is read in place, others are copied once. Errors are ValueError, OSError, MemoryError, TimeoutError or RuntimeError with
one line that names the thing and the value.

    import terrane
    source = terrane.fractal(seed=7)
    with terrane.Pager(source, worker_count=0) as pager:
        pager.require((-60, -60, 60, 60))
        pager.update(0.0)
        pager.finish()
        print(pager.ground().heights(0.0, 0.0))
"""
from . import answers as _answers
from .answers import *  # noqa: F401,F403
from . import _terrane
from ._terrane import *  # noqa: F401,F403
from ._terrane import __version__, components

__all__ = sorted(_answers.__all__ + [name for name in dir(_terrane) if not name.startswith("_")])

_OPTIONAL = {"open_store": "store", "bake": "store", "open_dem": "dem", "Renderer": "render"}


def __getattr__(name):
    if name in _OPTIONAL:
        raise AttributeError(f"terrane.{name}: this Terrane was built without the component '{_OPTIONAL[name]}'")
    raise AttributeError(f"module 'terrane' has no attribute '{name}'")
