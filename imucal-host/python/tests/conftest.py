"""Recordings and the program that the tests compare with."""

from __future__ import annotations

import os
import pathlib
import subprocess

import pytest

import imucal

HERE = pathlib.Path(__file__).parent


class Program:
    """The program ``imucal`` of the same source, which ``IMUCAL_PROGRAM`` names."""

    def __init__(self, path: str) -> None:
        self.path = path

    def __call__(self, folder: pathlib.Path, *arguments: object, status: int = 0) -> str:
        words = [self.path, *map(str, arguments)]
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == status, done.stderr
        return done.stdout


@pytest.fixture(scope="session")
def program() -> Program:
    """It must be there: without it nothing shows that both give the same bytes."""
    return Program(os.environ["IMUCAL_PROGRAM"])


@pytest.fixture(autouse=True)
def same_day(monkeypatch: pytest.MonkeyPatch) -> None:
    """The day goes into what is written, and a test may run at midnight."""
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1750000000")


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A folder with the simulated recordings ``rig.csv.gz`` (with a lever arm) and ``still.csv``."""
    folder = tmp_path_factory.mktemp("recordings")
    imucal.simulate(effects={"acc.lever_arm": 3.0}, seed=4).write(folder / "rig.csv.gz")
    imucal.simulate(programme="multi-position", seed=2, rate=50).write(folder / "poses.csv")
    still(folder / "still.csv")
    return folder


def still(path: pathlib.Path) -> None:
    """Ten minutes of a unit at rest."""
    import numpy as np

    random = np.random.default_rng(7)
    t = np.arange(60_000) / 100
    noise = random.normal(size=(len(t), 6)) * [0.01, 0.01, 0.01, 0.001, 0.001, 0.001]
    acc = noise[:, :3] + [0.0, 0.0, 9.8]
    unit = {"serial": "7", "name": "simulated"}
    imucal.Recording.from_arrays(t, acc=acc, gyr=noise[:, 3:], sensor=unit).write(path)


@pytest.fixture(scope="session")
def rig(folder: pathlib.Path) -> imucal.Recording:
    """The recording of the rig."""
    return imucal.read(folder / "rig.csv.gz")


@pytest.fixture(scope="session")
def calibration(rig: imucal.Recording) -> imucal.Calibration:
    """Its calibration."""
    return imucal.calibrate(rig)


@pytest.fixture(scope="session")
def real() -> pathlib.Path:
    """The folder of recordings of real sensors."""
    default = HERE.parents[3] / "shared" / "data"
    real = pathlib.Path(os.environ.get("IMUCAL_DATA", default)) / "real"
    if not real.is_dir():
        assert os.environ.get("CI") != "true", f"no recordings in {real}: set IMUCAL_DATA"
        pytest.skip(f"no recordings in {real}: set IMUCAL_DATA")
    return real
