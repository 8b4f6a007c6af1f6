"""Types of the compiled part."""

from typing import Optional, final

import numpy as np
from numpy.typing import NDArray

from ._recording import Columns

__all__ = [
    "Calibration",
    "ImucalError",
    "MismatchError",
    "OptionError",
    "ReadError",
    "Recording",
    "WriteError",
    "apply",
    "calibrate",
    "correct",
    "diagnose",
    "from_arrays",
    "load",
    "noise",
    "read",
    "read_stream",
    "simulate",
]

class ImucalError(Exception): ...
class ReadError(ImucalError): ...
class OptionError(ImucalError): ...
class MismatchError(ImucalError): ...
class WriteError(ImucalError): ...

@final
class Recording:
    @property
    def name(self) -> str: ...
    @property
    def rows(self) -> int: ...
    @property
    def epoch_ns(self) -> Optional[int]: ...
    @property
    def warnings(self) -> list[str]: ...
    def manifest(self) -> str: ...
    def times(self) -> NDArray[np.float64]: ...
    def temperatures(self) -> Optional[NDArray[np.float64]]: ...
    def columns(self, name: str) -> Optional[NDArray[np.float64]]: ...
    def write(self, path: str) -> str | None: ...

@final
class Calibration:
    def json(self) -> str: ...
    @property
    def ok(self) -> bool: ...
    @property
    def html(self) -> Optional[str]: ...
    def write_toml(self, path: str) -> None: ...
    def write_record(self, path: str) -> None: ...

def read(path: str, columns: Columns) -> Recording: ...
def read_stream(path: str, topic: Optional[str]) -> tuple[Recording, Optional[str]]: ...
def from_arrays(
    name: str,
    manifest: str,
    t: NDArray[np.float64],
    acc: Optional[NDArray[np.float64]],
    gyr: Optional[NDArray[np.float64]],
    mag: Optional[NDArray[np.float64]],
    temperature: Optional[NDArray[np.float64]],
    gimbal: Optional[NDArray[np.float64]],
    reference: Optional[NDArray[np.float64]],
    position: Optional[NDArray[np.float64]],
) -> Recording: ...
def calibrate(
    recording: Recording,
    models: list[str],
    compare: bool,
    temperature: bool,
    threshold: Optional[float],
    accept_suspect: bool,
    html: bool,
) -> Calibration: ...
def load(path: str) -> Calibration: ...
def apply(
    recording: Recording, calibration: Calibration, other_serial: bool
) -> tuple[Recording, list[str]]: ...
def correct(
    calibration: Calibration,
    kind: str,
    raw: NDArray[np.float32],
    temperature: Optional[NDArray[np.float32]],
) -> NDArray[np.float32]: ...
def diagnose(
    recording: Recording,
    sim: Optional[Recording],
    sim_topic: Optional[str],
    model: Optional[Calibration],
    without: list[str],
    effects: Optional[str],
    frozen: bool,
    watch: Optional[str],
    html: bool,
) -> tuple[str, str, Optional[str]]: ...
def simulate(
    name: str,
    unit: str,
    programme: str,
    effects: list[tuple[str, float]],
    own_effects: Optional[str],
    seed: int,
    rate: float,
    duration: Optional[float],
    si: bool,
    noise: bool,
) -> Recording: ...
def noise(path: str, columns: Columns, html: bool) -> tuple[str, Optional[str]]: ...
