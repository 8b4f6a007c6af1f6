"""Recordings: read from files, made of arrays, given as arrays."""

from __future__ import annotations

import functools
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Optional, TypedDict, Union
from warnings import warn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._warning import ImucalWarning

Path = Union[str, "os.PathLike[str]"]
#: ``{"acc": ["ax", "ay", "az"]}``, or as the program's option: ``["acc=ax,ay,az"]``.
Map = Union[Mapping[str, Union[str, Sequence[str]]], Iterable[str], str]
#: ``{"acc": "g", "t": "ms"}``, or as the program's option: ``"acc=g,t=ms"``.
Unit = Union[Mapping[str, str], Iterable[str], str]


class Columns(TypedDict):
    """The program's options of reading."""

    map: list[str]
    unit: list[str]
    time: Optional[str]
    topic: list[str]
    max_size: Optional[str]
    max_columns: Optional[int]


#: Beyond it, neighbouring integers are one float64.
_WHOLE = 2**53


class Recording:
    """Samples of an inertial unit, and the manifest that says what they are.

    The samples are in the library's memory. Each array below is copied from there once, when it is first asked for, and
    is the same object from then on; it cannot be written to. ``None`` stands for what was not recorded, NaN for a row in
    which it was not.
    """

    def __init__(self, native: _native.Recording) -> None:
        self._native = native

    @classmethod
    def from_arrays(
        cls,
        t: ArrayLike,
        *,
        acc: Optional[ArrayLike] = None,
        gyr: Optional[ArrayLike] = None,
        mag: Optional[ArrayLike] = None,
        temperature: Optional[ArrayLike] = None,
        gimbal: Optional[ArrayLike] = None,
        reference: Optional[ArrayLike] = None,
        position: Optional[ArrayLike] = None,
        units: Optional[Mapping[str, str]] = None,
        site: Optional[Mapping[str, Any]] = None,
        sensor: Optional[Mapping[str, str]] = None,
        manifest: Optional[Mapping[str, Any]] = None,
        name: str = "arrays.csv",
    ) -> Recording:
        """A recording of arrays: ``t`` of n times, sensors of n × 3, quaternions ``reference`` of n × 4.

        ``units``, ``site``, ``sensor`` and ``manifest`` have the keys of a manifest's TOML; units that are left out are
        SI. Each array is copied once. What a file may not hold, arrays may not: :class:`ReadError`.
        """
        sections = {"units": units, "site": site, "sensor": sensor}
        whole = {**(manifest or {}), **{key: value for key, value in sections.items() if value is not None}}
        times = np.asarray(t)
        if times.dtype.kind in "iu" and times.size and int(np.abs(times).max()) > _WHOLE:
            raise _native.ReadError(
                f"{name}, column `t`: found integers beyond 2^53, expected times that a float64 holds; subtract the "
                "first, or write a file, whose times are read exactly"
            )
        return cls(
            _native.from_arrays(
                name,
                json.dumps(_without_none(whole), default=_plain),
                _array("t", times, 1),
                _given("acc", acc, 2),
                _given("gyr", gyr, 2),
                _given("mag", mag, 2),
                _given("temperature", temperature, 1),
                _given("gimbal", gimbal, 2),
                _given("reference", reference, 2),
                _given("position", position, 2),
            )
        )

    @property
    def name(self) -> str:
        """Name of the samples file."""
        return self._native.name

    @property
    def warnings(self) -> list[str]:
        """What is odd but harmless."""
        return self._native.warnings

    @property
    def epoch_ns(self) -> Optional[int]:
        """Absolute time of ``t`` = 0, ns since 1970 or since the clock's own zero; ``None`` if the file's times are not absolute."""
        return self._native.epoch_ns

    @functools.cached_property
    def manifest(self) -> dict[str, Any]:
        """Units, site, rig and sensor, by the keys of the TOML."""
        found: dict[str, Any] = json.loads(self._native.manifest())
        return found

    @functools.cached_property
    def t(self) -> NDArray[np.float64]:
        """Times, s, strictly increasing; n."""
        return _locked(self._native.times())

    @functools.cached_property
    def acc(self) -> Optional[NDArray[np.float64]]:
        """Specific force, m/s²; n × 3."""
        return self._columns("acc")

    @functools.cached_property
    def gyr(self) -> Optional[NDArray[np.float64]]:
        """Rate, rad/s; n × 3."""
        return self._columns("gyr")

    @functools.cached_property
    def mag(self) -> Optional[NDArray[np.float64]]:
        """Field, µT (for the unit ``a.u.`` as the file has it); n × 3."""
        return self._columns("mag")

    @functools.cached_property
    def temperature(self) -> Optional[NDArray[np.float64]]:
        """Temperature, °C; n."""
        found = self._native.temperatures()
        return None if found is None else _locked(found)

    @functools.cached_property
    def gimbal(self) -> Optional[NDArray[np.float64]]:
        """Encoder angles outer, middle, inner, rad; n × 3."""
        return self._columns("gimbal")

    @functools.cached_property
    def reference(self) -> Optional[NDArray[np.float64]]:
        """Reference attitude, unit quaternions w, x, y, z; n × 4."""
        return self._columns("reference")

    @functools.cached_property
    def position(self) -> Optional[NDArray[np.float64]]:
        """Position of the reference point, m; n × 3."""
        return self._columns("position")

    def write(self, path: Path) -> None:
        """Writes the samples (``.csv``, ``.csv.gz``, ``.parquet``, ``.mcap``) and the manifest, over a former recording of
        this name; :class:`ImucalWarning` where MCAP does not hold all columns."""
        left_out = self._native.write(os.fspath(path))
        if left_out is not None:
            warn(left_out, ImucalWarning, stacklevel=2)

    def __len__(self) -> int:
        return self._native.rows

    def __repr__(self) -> str:
        return f"<imucal.Recording {self.name!r}, {len(self)} rows>"

    def _columns(self, name: str) -> Optional[NDArray[np.float64]]:
        found = self._native.columns(name)
        return None if found is None else _locked(found)


def read(
    path: Path,
    *,
    map: Map = (),
    unit: Unit = (),
    time: Optional[str] = None,
    topic: Unit = (),
    max_size: Union[int, str, None] = None,
    max_columns: Optional[int] = None,
) -> Recording:
    """Reads a recording, with its manifest next to it, or another program's file by ``map``, ``unit`` and ``time``.

    Of a robot's log (``.mcap``, ``.db3``, ``.bag``) ``topic`` chooses topics, such as ``{"imu": "/imu/data", "mag": "none"}``.
    """
    return Recording(_native.read(os.fspath(path), reading(map, unit, time, topic, max_size, max_columns)))


def reading(
    map: Map,
    unit: Unit,
    time: Optional[str],
    topic: Unit,
    max_size: Union[int, str, None],
    max_columns: Optional[int],
) -> Columns:
    """The arguments of reading as the program's options."""
    return {
        "map": options(map),
        "unit": [part for text in options(unit) for part in text.split(",")],
        "time": time,
        "topic": options(topic),
        "max_size": None if max_size is None else str(max_size),
        "max_columns": max_columns,
    }


def options(given: Union[Map, Unit]) -> list[str]:
    """``NAME=VALUE`` of each entry."""
    if isinstance(given, str):
        return [given]
    if isinstance(given, Mapping):
        return [f"{key}={value if isinstance(value, str) else ','.join(value)}" for key, value in given.items()]
    return list(given)


def _given(name: str, value: Optional[ArrayLike], dimensions: int) -> Optional[NDArray[np.float64]]:
    return None if value is None else _array(name, value, dimensions)


def _array(name: str, value: ArrayLike, dimensions: int) -> NDArray[np.float64]:
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as cause:
        raise _native.ReadError(f"{name}: found no array of numbers ({cause}), expected one") from cause
    if array.ndim != dimensions:
        expected = "one number a sample" if dimensions == 1 else "one row a sample"
        raise _native.ReadError(f"{name}: found {array.ndim} dimensions, expected {dimensions}, {expected}; reshape it")
    return array


def _locked(array: NDArray[np.float64]) -> NDArray[np.float64]:
    array.flags.writeable = False
    return array


def _plain(value: Any) -> Any:
    """What JSON does not know: arrays and numbers of numpy."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"{value!r} has no place in a manifest")


def _without_none(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _without_none(entry) for key, entry in value.items() if entry is not None}
    return value
