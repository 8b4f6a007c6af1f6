"""Calibrate, correct, diagnose and simulate recordings of inertial and magnetic sensors.

The module runs the code of the program ``imucal``: the same recording gives the same bytes. Values are in SI units (s,
m/s², rad/s, °C, rad, m), fields in µT. A sensor that cannot be calibrated is a result with the status ``refused``;
:class:`ImucalError` is raised for input that cannot be read and for arguments that mean nothing.
"""

from ._calibration import Calibration, Sensor, calibrate
from ._correction import apply
from ._diagnosis import Cause, Diagnosis, diagnose
from ._native import ImucalError, MismatchError, OptionError, ReadError, WriteError
from ._noise import Noise, SensorNoise, noise
from ._recording import Recording, read
from ._simulation import simulate
from ._warning import ImucalWarning

__all__ = [
    "Calibration",
    "Cause",
    "Diagnosis",
    "ImucalError",
    "ImucalWarning",
    "MismatchError",
    "Noise",
    "OptionError",
    "ReadError",
    "Recording",
    "Sensor",
    "SensorNoise",
    "WriteError",
    "apply",
    "calibrate",
    "diagnose",
    "noise",
    "read",
    "simulate",
]
