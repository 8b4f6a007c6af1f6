"""Samples corrected by the code of the device, in float32."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Union, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._calibration import Calibration
from ._recording import Recording
from ._warning import ImucalWarning


@overload
def apply(samples: Recording, calibration: Calibration, *, other_serial: bool = False) -> Recording: ...


@overload
def apply(
    samples: Mapping[str, ArrayLike], calibration: Calibration, *, other_serial: bool = False
) -> dict[str, NDArray[np.float32]]: ...


def apply(
    samples: Union[Recording, Mapping[str, ArrayLike]],
    calibration: Calibration,
    *,
    other_serial: bool = False,
) -> Union[Recording, dict[str, NDArray[np.float32]]]:
    """Corrects samples as the device does, to its last bit.

    Of a recording, a recording comes out, whose sensors without a calibration are as they were. :class:`MismatchError`
    where the calibration is of another serial number (``other_serial=True`` allows it), of another unit or of no sensor
    that was recorded; :class:`ImucalWarning` where a serial number is missing.

    Of arrays ``{"acc": …, "gyr": …, "mag": …, "temperature": …}`` (raw, n × 3 in the calibration's ``unit_in``; °C),
    arrays of float32 in its ``unit_out`` come out. Float32 in rows one after another is read where it is; the result is
    never copied.
    """
    if isinstance(samples, Recording):
        corrected, remarks = _native.apply(samples._native, calibration._native, other_serial)
        for remark in remarks:
            warnings.warn(remark, ImucalWarning, stacklevel=2)
        return Recording(corrected)
    arrays = {name: np.ascontiguousarray(values, dtype=np.float32) for name, values in samples.items()}
    temperature = arrays.pop("temperature", None)
    if temperature is not None and temperature.ndim != 1:
        raise _native.ReadError(f"temperature: found {temperature.ndim} dimensions, expected 1, one number a sample")
    for name, raw in arrays.items():
        if raw.ndim != 2:
            raise _native.ReadError(f"{name}: found {raw.ndim} dimensions, expected 2, one row a sample")
    native = calibration._native
    return {name: _native.correct(native, name, raw, temperature) for name, raw in arrays.items()}
