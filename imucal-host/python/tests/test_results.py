"""Results as fields, as keys, and as the JSON."""

from __future__ import annotations

import json
import pathlib

import numpy as np
import pytest

import imucal


def test_fields_are_the_figures_of_the_json(calibration: imucal.Calibration) -> None:
    document = json.loads(calibration.json)
    assert calibration.to_dict() == document and calibration["sensors"] == document["sensors"]
    assert set(calibration.sensors) == {"acc", "gyr", "mag"}
    for kind, sensor in calibration.sensors.items():
        said = document["sensors"][kind]
        assert sensor.sensor == kind and sensor.to_dict() == said
        for name in ("status", "model", "unit_in", "unit_out", "rms", "observations", "coverage", "suspicions"):
            assert getattr(sensor, name) == said[name] == sensor[name], name
        for name in ("gain", "bias", "gain_std", "bias_std"):
            np.testing.assert_array_equal(getattr(sensor, name), said[name])
    with pytest.raises(KeyError):
        calibration["nothing"]
    assert "sensors" in calibration


def test_what_a_result_gives_away_does_not_change_it(calibration: imucal.Calibration) -> None:
    calibration.to_dict()["sensors"].clear()
    calibration["sensors"].clear()
    assert calibration.to_dict() == json.loads(calibration.json)
    with pytest.raises(AttributeError):
        calibration.ok = False  # type: ignore[misc]


def test_a_stored_calibration_has_the_figures_that_were_written(
    calibration: imucal.Calibration, tmp_path: pathlib.Path
) -> None:
    calibration.write_toml(tmp_path / "cal.toml")
    stored = imucal.Calibration.load(tmp_path / "cal.toml")
    accepted = {kind for kind, sensor in calibration.sensors.items() if sensor.status == "accepted"}
    assert set(stored.sensors) == accepted and accepted and stored.ok
    for kind, sensor in stored.sensors.items():
        assert sensor.status == "stored" and sensor.model == calibration.sensors[kind].model
        np.testing.assert_array_equal(sensor.gain, calibration.sensors[kind].gain)
    stored.write_toml(tmp_path / "again.toml")
    assert (tmp_path / "again.toml").read_bytes() == (tmp_path / "cal.toml").read_bytes()


def test_equal_results_are_equal(rig: imucal.Recording, calibration: imucal.Calibration) -> None:
    assert imucal.calibrate(rig) == calibration != imucal.calibrate(rig, temperature=False)
