"""Simulated recordings."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Optional, Union

from . import _native
from ._recording import Path, Recording


def simulate(
    *,
    unit: str = "mtx",
    programme: str = "full",
    effects: Union[Mapping[str, float], Iterable[str]] = (),
    own_effects: Optional[Path] = None,
    seed: int = 1,
    rate: float = 100.0,
    duration: Optional[float] = None,
    si: bool = False,
    noise: bool = True,
    name: str = "simulated.csv",
) -> Recording:
    """Simulates a recording of a unit on a flight motion simulator, as ``imucal simulate``.

    ``effects`` are ids of ``imucal simulate --list`` with their sizes in multiples of the usual one, such as
    ``{"acc.lever_arm": 2.0}``; ids alone are of size 1. ``own_effects`` is a file of effects in TOML.
    """
    sizes = effects if isinstance(effects, Mapping) else dict.fromkeys(effects, 1.0)
    own = None if own_effects is None else os.fspath(own_effects)
    pairs = [(effect, float(size)) for effect, size in sizes.items()]
    return Recording(
        _native.simulate(name, unit, programme, pairs, own, seed, rate, duration, si, noise)
    )
