"""The noise of a unit at rest."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from typing import Any, Optional, Union

from . import _native
from ._document import Document
from ._recording import Map, Path, Unit, reading


@dataclass(frozen=True, eq=False)
class SensorNoise(Document):
    """The noise of one sensor."""

    #: ``estimated`` or ``refused``.
    status: str
    #: Why it was refused.
    reason: Optional[str]
    detail: Optional[str]
    #: Unit of the values.
    unit: str
    samples: int
    #: Samples a second, Hz.
    rate: Optional[float]
    #: x, y and z with their coefficients and Allan deviations; ``None`` for an axis whose samples are all one value.
    axes: list[Optional[dict[str, Any]]]


@dataclass(frozen=True, eq=False)
class Noise(Document):
    """The noise of a unit."""

    #: Byte for byte what ``imucal noise --json`` writes.
    json: str = field(repr=False)
    #: File name of the recording.
    recording: str
    #: Make and model of the unit, and its serial number; empty where unknown.
    name: str
    serial: str
    #: From the first row to the last, s.
    duration: float
    acc: Optional[SensorNoise]
    gyr: Optional[SensorNoise]
    mag: Optional[SensorNoise]
    warnings: list[str]
    #: With ``html=True`` the page, byte for byte what ``--html`` writes; it has the hash of the recording's file.
    html: Optional[str] = field(repr=False)


def noise(
    path: Path,
    *,
    map: Map = (),
    unit: Unit = (),
    time: Optional[str] = None,
    topic: Unit = (),
    max_size: Union[int, str, None] = None,
    max_columns: Optional[int] = None,
    html: bool = False,
) -> Noise:
    """Estimates the noise of a unit from a recording at rest; the file is read by parts and may be of any length.

    ``html`` makes the page, too.
    """
    text, page = _native.noise(
        os.fspath(path), reading(map, unit, time, topic, max_size, max_columns), html
    )
    found: dict[str, Any] = json.loads(text)
    acc, gyr, mag = (_sensor(found.get(kind)) for kind in ("acc", "gyr", "mag"))
    return Noise(
        found,
        text,
        found["recording"],
        found["name"],
        found["serial"],
        found["duration"],
        acc,
        gyr,
        mag,
        found["warnings"],
        page,
    )


def _sensor(found: Optional[dict[str, Any]]) -> Optional[SensorNoise]:
    if found is None:
        return None
    keys = ("status", "reason", "detail", "unit", "samples", "rate", "axes")
    return SensorNoise(found, *(found[key] for key in keys))
