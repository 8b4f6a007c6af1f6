"""Recordings as arrays."""

from __future__ import annotations

import pathlib
from typing import Any

import numpy as np
import pytest

import imucal


def test_arrays_are_in_si_and_have_one_row_a_sample(rig: imucal.Recording) -> None:
    n = len(rig)
    assert rig.t.shape == (n,) and rig.t.dtype == np.float64 and bool((np.diff(rig.t) > 0).all())
    for values in (rig.acc, rig.gyr, rig.mag, rig.gimbal):
        assert values is not None and values.shape == (n, 3) and values.dtype == np.float64
    assert rig.acc is not None and rig.mag is not None and rig.temperature is not None
    # Not calibrated yet.
    assert np.median(np.linalg.norm(rig.acc, axis=1)) == pytest.approx(9.8, rel=0.1)
    assert rig.temperature.shape == (n,) and rig.reference is None and rig.position is None
    assert rig.manifest["units"]["acc"] == "counts" and rig.manifest["rig"]["axes"] == ["z", "y", "x"]


def test_an_array_is_copied_once_and_cannot_be_written_to(rig: imucal.Recording) -> None:
    for name in ("t", "acc", "gyr", "mag", "temperature", "gimbal"):
        first = getattr(rig, name)
        assert getattr(rig, name) is first, name
        assert first.flags.c_contiguous and not first.flags.writeable, name
        with pytest.raises(ValueError, match="read-only"):
            first[0] = 0.0
    assert rig.acc is not None
    assert owner(rig.acc) == LIBRARY


#: What owns numbers that numpy has taken over from the library without a copy.
LIBRARY = "PySliceContainer"


def owner(array: "np.ndarray[Any, Any]") -> str:
    """Type of what owns an array's numbers."""
    base: Any = array
    while getattr(base, "base", None) is not None:
        base = base.base
    return type(base).__name__


def test_corrected_arrays_are_not_copied(calibration: imucal.Calibration) -> None:
    kind = next(kind for kind, sensor in calibration.sensors.items() if sensor.status == "accepted")
    raw = np.full((5, 3), 32768, dtype=np.float32)
    found = imucal.apply({kind: raw}, calibration)[kind]
    assert owner(found) == LIBRARY and found.flags.c_contiguous and owner(raw) == "ndarray"


def test_arrays_make_the_recording_that_a_file_of_them_is(tmp_path: pathlib.Path) -> None:
    t = np.arange(500) * 10.0
    random = np.random.default_rng(3)
    acc = random.normal(size=(500, 3)) * 0.01 + [0, 0, 1]
    gyr = random.normal(size=(500, 3))
    acc[7] = np.nan
    made = imucal.Recording.from_arrays(
        t,
        acc=acc[:, ::-1][:, ::-1],
        gyr=np.asfortranarray(gyr),
        temperature=np.full(500, 21.5, dtype=np.float32),
        units={"t": "ms", "acc": "g", "gyr": "deg/s"},
        site={"latitude_deg": np.float64(52.5), "height_m": None},
        sensor={"serial": "12"},
        name="made.csv",
    )
    made.write(tmp_path / "made.csv")
    read = imucal.read(tmp_path / "made.csv")
    assert made.acc is not None and made.t[1] == 0.01
    np.testing.assert_allclose(made.acc, acc * 9.80665, rtol=1e-15)
    for name in ("t", "acc", "gyr", "temperature"):
        np.testing.assert_allclose(getattr(read, name), getattr(made, name), rtol=1e-13)
    assert read.manifest == made.manifest and made.manifest["site"] == {"latitude_deg": 52.5}
    assert made.warnings == [] == read.warnings


def test_every_format_holds_the_same_recording(rig: imucal.Recording, tmp_path: pathlib.Path) -> None:
    rig.write(tmp_path / "a.parquet")
    rig.write(tmp_path / "a.csv")
    for name in ("a.parquet", "a.csv"):
        found = imucal.read(tmp_path / name)
        assert found.acc is not None and rig.acc is not None
        np.testing.assert_array_equal(found.acc, rig.acc)


def test_a_log_with_other_names_is_read_by_dicts_and_by_the_program_s_options(tmp_path: pathlib.Path) -> None:
    rows = "\n".join(f"{1000 + 10 * k},{0.01 * (k % 3)},0,1,0,{k % 5},0" for k in range(200))
    log = tmp_path / "log.csv"
    log.write_text("timestamp_ms,ax,ay,az,gx,gy,gz\n" + rows + "\n")
    by_dict = imucal.read(
        log,
        time="timestamp_ms",
        map={"acc": ["ax", "ay", "az"], "gyr": "gx,gy,gz"},
        unit={"acc": "g", "gyr": "deg/s"},
    )
    by_option = imucal.read(
        log, time="timestamp_ms", map=["acc=ax,ay,az", "gyr=gx,gy,gz"], unit="acc=g,gyr=deg/s"
    )
    assert by_dict.acc is not None and by_option.acc is not None
    assert by_dict.acc[0, 2] == 9.80665 and by_dict.t[0] == 1.0
    np.testing.assert_array_equal(by_dict.acc, by_option.acc)


def test_absolute_times_begin_at_zero(tmp_path: pathlib.Path) -> None:
    rows = "".join(f"{1_700_000_000_000_000_000 + 10_000_000 * k},0,0,9.8\n" for k in range(200))
    (tmp_path / "a.csv").write_text("t,acc_x,acc_y,acc_z\n" + rows)
    (tmp_path / "a.toml").write_text('format = "imucal-recording/1"\n[units]\nt = "ns"\nacc = "m/s^2"\n')
    found = imucal.read(tmp_path / "a.csv")
    assert found.epoch_ns == 1_700_000_000_000_000_000 and found.t[1] == 0.01
