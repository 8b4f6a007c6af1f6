"""Calibrations: of a recording, or of a file."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._document import Document
from ._native import Calibration as Native
from ._recording import Path, Recording, options

_SENSORS = ("acc", "gyr", "mag")


@dataclass(frozen=True, eq=False)
class Sensor(Document):
    """One sensor's calibration: ``calibrated = gain @ (raw - bias)``. A field is ``None`` where there is no fit."""

    #: ``acc``, ``gyr`` or ``mag``.
    sensor: str
    #: ``accepted``, ``suspect`` or ``refused``; ``stored`` where it comes from a file.
    status: str
    #: T9, K9, E9, …
    model: str
    #: 3 × 3, ``unit_out`` per ``unit_in``.
    gain: Optional[NDArray[np.float64]]
    #: 3, ``unit_in``.
    bias: Optional[NDArray[np.float64]]
    #: Standard errors of the gain; 0 for an entry that is not estimated.
    gain_std: Optional[NDArray[np.float64]]
    #: Standard errors of the bias.
    bias_std: Optional[NDArray[np.float64]]
    unit_in: Optional[str]
    unit_out: Optional[str]
    #: Rms of the residuals, and of observations that no fit has seen.
    rms: Optional[float]
    held_out_rms: Optional[float]
    observations: Optional[int]
    parameters: Optional[int]
    condition: Optional[float]
    coverage: Optional[float]
    #: Why it was refused, with the figures, and what to do.
    reason: Optional[str]
    detail: Optional[str]
    advice: Optional[str]
    #: What speaks against a suspect sensor.
    suspicions: list[str]

    @classmethod
    def _of(cls, sensor: str, document: dict[str, Any]) -> Sensor:
        get = document.get
        return cls(
            document,
            sensor,
            get("status", "stored"),
            document["model"],
            _array(get("gain")),
            _array(get("bias")),
            _array(get("gain_std")),
            _array(get("bias_std")),
            get("unit_in"),
            get("unit_out"),
            get("rms"),
            get("held_out_rms"),
            get("observations"),
            get("parameters"),
            get("condition"),
            get("coverage"),
            get("reason"),
            get("detail"),
            get("advice"),
            list(get("suspicions", [])),
        )


@dataclass(frozen=True, eq=False)
class Calibration(Document):
    """A calibration. Of a recording, its keys are those of ``imucal calibrate --json``; of a file, the file's."""

    #: Text of the JSON; of a recording, byte for byte what ``imucal calibrate --json`` writes.
    json: str = field(repr=False)
    #: File name of the recording.
    recording: str
    #: Each sensor of the recording.
    sensors: dict[str, Sensor]
    #: What the user should know.
    warnings: list[str]
    #: Whether something was accepted, every sensor that was named in ``models`` too, and nothing is suspect that may not be.
    ok: bool
    #: With ``html=True`` the page, byte for byte what ``--html`` writes; it has the hash of the recording's file.
    html: Optional[str] = field(repr=False)
    _native: Native = field(repr=False)

    @classmethod
    def _of(cls, native: Native) -> Calibration:
        text = native.json()
        document: dict[str, Any] = json.loads(text)
        found = document["sensors"] if "sensors" in document else document
        sensors = {kind: Sensor._of(kind, found[kind]) for kind in _SENSORS if found.get(kind) is not None}
        return cls(
            document,
            text,
            document.get("recording", ""),
            sensors,
            document.get("warnings", []),
            native.ok,
            native.html,
            native,
        )

    @classmethod
    def load(cls, path: Path) -> Calibration:
        """Loads the TOML or the record that ``imucal calibrate`` has written; its sensors have the status ``stored``."""
        return cls._of(_native.load(os.fspath(path)))

    @property
    def acc(self) -> Optional[Sensor]:
        """The accelerometer."""
        return self.sensors.get("acc")

    @property
    def gyr(self) -> Optional[Sensor]:
        """The gyroscope."""
        return self.sensors.get("gyr")

    @property
    def mag(self) -> Optional[Sensor]:
        """The magnetometer."""
        return self.sensors.get("mag")

    def write_toml(self, path: Path) -> None:
        """Writes the calibration for people, over a former file. :class:`WriteError` if no sensor was accepted."""
        self._native.write_toml(os.fspath(path))

    def write_record(self, path: Path) -> None:
        """Writes the record for the device, over a former file. :class:`WriteError` if no sensor was accepted."""
        self._native.write_record(os.fspath(path))


def calibrate(
    recording: Recording,
    *,
    models: Union[Mapping[str, str], Iterable[str]] = (),
    compare: bool = False,
    temperature: bool = True,
    threshold: Optional[float] = None,
    accept_suspect: bool = False,
    html: bool = False,
) -> Calibration:
    """Fits all models that the recording supports, and refuses what it does not determine.

    ``models`` names models by sensor, such as ``{"acc": "T9"}``; ``compare`` fits every model and recommends one;
    ``temperature`` estimates how bias and scale follow the temperature; ``threshold`` is the only multiple of the first
    rest's variance to try; ``accept_suspect`` lets suspect sensors into what is written and applied;
    ``html`` makes the page, too.
    """
    native = recording._native
    return Calibration._of(
        _native.calibrate(native, options(models), compare, temperature, threshold, accept_suspect, html)
    )


def _array(value: Any) -> Optional[NDArray[np.float64]]:
    return None if value is None else np.array(value, dtype=np.float64)
