"""A refusal is a result; what cannot be read or means nothing is an exception that says what to do."""

from __future__ import annotations

import pathlib

import numpy as np
import pytest

import imucal


def few() -> imucal.Recording:
    """A unit that lies on one face."""
    random = np.random.default_rng(1)
    t = np.arange(3000) / 100
    acc = random.normal(size=(3000, 3)) * 0.01 + [0, 0, 9.8]
    return imucal.Recording.from_arrays(t, acc=acc, site={"gravity": 9.8})


def test_a_sensor_that_cannot_be_calibrated_is_refused_with_reason_and_advice(tmp_path: pathlib.Path) -> None:
    found = imucal.calibrate(few())
    acc = found.acc
    assert acc is not None and acc.status == "refused" and not found.ok
    assert acc.reason == acc["reason"] and acc.reason in ("too-few-observations", "poor-coverage", "no-motion")
    assert acc.advice and acc.detail
    with pytest.raises(imucal.WriteError, match="no sensor was accepted"):
        found.write_toml(tmp_path / "cal.toml")
    assert not (tmp_path / "cal.toml").exists()
    with pytest.raises(imucal.MismatchError):
        imucal.apply(few(), found)


def test_a_recording_replaces_another_but_no_calibration(tmp_path: pathlib.Path) -> None:
    few().write(tmp_path / "a.csv")
    few().write(tmp_path / "a.csv")
    (tmp_path / "cal.toml").write_text('format = "imucal-calibration/1"\n')
    with pytest.raises(imucal.WriteError, match="cal.toml: found a file that is no manifest"):
        few().write(tmp_path / "cal.csv")
    assert not (tmp_path / "cal.csv").exists() and "calibration" in (tmp_path / "cal.toml").read_text()


def test_a_recording_that_cannot_be_diagnosed_says_why() -> None:
    found = imucal.diagnose(few())
    assert found.verdict == "not-testable" and found.remarks[0] and found.causes == []


def test_files_that_cannot_be_read_say_why(tmp_path: pathlib.Path) -> None:
    with pytest.raises(imucal.ReadError, match="absent.csv"):
        imucal.read(tmp_path / "absent.csv")
    log = tmp_path / "log.csv"
    log.write_text("timestamp_ms,ax,ay,az\n" + "".join(f"{k * 10},0,0,9.8\n" for k in range(100)))
    with pytest.raises(imucal.ReadError) as error:
        imucal.read(log)
    text = str(error.value)
    assert "probably" in text and 'map=["acc=ax,ay,az"]' in text and 'time="timestamp_ms"' in text
    with pytest.raises(imucal.ReadError, match="no column `aw`"):
        imucal.read(log, time="timestamp_ms", map={"acc": ["ax", "ay", "aw"]}, unit={"acc": "m/s^2"})
    with pytest.raises(imucal.ReadError, match="1000 bytes"):
        imucal.read(log, time="timestamp_ms", map={"acc": ["ax", "ay", "az"]}, max_size=1000)
    with pytest.raises(imucal.ReadError, match="cannot be read"):
        imucal.Calibration.load(tmp_path / "absent.toml")


@pytest.mark.parametrize(
    ("arrays", "says"),
    [
        ({"acc": np.zeros((3, 10))}, "acc: found an array of 3 × 10, expected 3 columns"),
        ({"acc": np.zeros(10)}, "acc: found 1 dimensions, expected 2"),
        ({"acc": np.zeros((9, 3))}, "column `acc_x`: found 9 rows, expected 10"),
        ({"temperature": np.zeros(9)}, "column `temp`: found 9 rows"),
        ({"reference": np.zeros((10, 3))}, "expected 4 columns"),
        ({"acc": np.full((10, 3), np.inf)}, "row 1, column `acc_x`: found the infinite value"),
        ({"acc": [["a", "b", "c"]]}, "acc: found no array of numbers"),
        ({"units": {"acc": "furlong"}}, "furlong"),
        ({"site": {"latitude_deg": 100.0}}, "latitude_deg"),
        ({"units": {"acc": "counts"}, "acc": np.zeros((10, 3))}, "counts"),
    ],
)
def test_arrays_that_are_no_recording_say_why(arrays: dict[str, object], says: str) -> None:
    with pytest.raises(imucal.ReadError) as error:
        imucal.Recording.from_arrays(np.arange(10) / 100, **arrays)  # type: ignore[arg-type]
    assert says in str(error.value)


def test_times_that_a_float64_cannot_hold_are_refused() -> None:
    with pytest.raises(imucal.ReadError, match="2\\^53"):
        imucal.Recording.from_arrays(np.arange(10) + 1_700_000_000_000_000_000, units={"t": "ns"})
    with pytest.raises(imucal.ReadError, match="strictly increasing"):
        imucal.Recording.from_arrays([0.0, 0.01, 0.01])


def test_arguments_that_mean_nothing_say_what_would(rig: imucal.Recording) -> None:
    with pytest.raises(imucal.OptionError, match="expected acc=T9 or acc=T6"):
        imucal.calibrate(rig, models={"acc": "T10"})
    with pytest.raises(imucal.OptionError, match="needs a rig"):
        imucal.calibrate(few(), models={"acc": "I14"})
    with pytest.raises(imucal.OptionError, match="threshold"):
        imucal.calibrate(rig, threshold=-1)
    with pytest.raises(imucal.OptionError, match="did you mean `acc.lever_arm`"):
        imucal.simulate(effects=["acc.leverarm"])
    with pytest.raises(imucal.OptionError, match="no unit `mtz`"):
        imucal.simulate(unit="mtz")
    with pytest.raises(imucal.OptionError, match="without"):
        imucal.diagnose(rig, without=["acc.nothing"])
    with pytest.raises(imucal.OptionError, match="max_size"):
        imucal.read("a.csv", max_size="big")


def test_a_calibration_of_another_unit_is_not_applied(rig: imucal.Recording, calibration: imucal.Calibration) -> None:
    counts = rig.manifest["counts"]
    other = imucal.Recording.from_arrays(
        rig.t[:100], acc=np.zeros((100, 3)) + 40000, units={"acc": "counts"},
        manifest={"counts": {"acc": counts["acc"]}}, sensor={"serial": "another"},
    )  # fmt: skip
    with pytest.raises(imucal.MismatchError, match="another"):
        imucal.apply(other, calibration)
    with pytest.warns(imucal.ImucalWarning, match="another"):
        imucal.apply(other, calibration, other_serial=True)
    with pytest.raises(imucal.ReadError, match="3 columns"):
        imucal.apply({"acc": np.zeros((2, 4))}, calibration)
    with pytest.raises(imucal.ReadError, match="found 5 rows, expected 2"):
        imucal.apply({"acc": np.zeros((2, 3)), "temperature": np.zeros(5)}, calibration)
    with pytest.raises(imucal.OptionError, match="expected acc, gyr or mag"):
        imucal.apply({"baro": np.zeros((2, 3))}, calibration)


def test_every_exception_is_an_imucal_error() -> None:
    for kind in (imucal.ReadError, imucal.WriteError, imucal.OptionError, imucal.MismatchError):
        assert issubclass(kind, imucal.ImucalError)
