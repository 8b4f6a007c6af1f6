"""What the module gives is what the program writes, byte for byte."""

from __future__ import annotations

import json
import pathlib
import pickle

import numpy as np
import pytest

import imucal

from conftest import HERE, Program


def assert_same(path: pathlib.Path, other: pathlib.Path) -> None:
    assert path.read_bytes() == other.read_bytes(), f"{path} and {other} differ"


def same_calibration(program: Program, path: pathlib.Path, out: pathlib.Path, accept_suspect: bool) -> None:
    """JSON, TOML, record and corrected samples of both."""
    names = ["--out", out / "a.toml", "--record", out / "a.bin", "--json", out / "a.json"]
    flags = ["--accept-suspect"] if accept_suspect else []
    program(out, "calibrate", path, *names, "--html", out / "a.html", *flags)
    recording = imucal.read(path)
    found = imucal.calibrate(recording, accept_suspect=accept_suspect, html=True)
    assert found.html == (out / "a.html").read_text()
    assert imucal.Calibration.load(out / "a.toml").html is None
    assert found.json == (out / "a.json").read_text()
    assert found.to_dict() == json.loads(found.json) and found.ok
    found.write_toml(out / "b.toml")
    found.write_record(out / "b.bin")
    assert_same(out / "a.toml", out / "b.toml")
    assert_same(out / "a.bin", out / "b.bin")
    program(out, "apply", path, "--calibration", out / "a.bin", "--out", out / "by-program.csv")
    for name, calibration in [("made", found), ("loaded", imucal.Calibration.load(out / "a.toml"))]:
        imucal.apply(recording, calibration).write(out / f"{name}.csv")
        assert_same(out / "by-program.csv", out / f"{name}.csv")


def test_a_simulated_recording_is_the_program_s(program: Program, folder: pathlib.Path, tmp_path: pathlib.Path) -> None:
    program(tmp_path, "simulate", "--out", "rig.csv.gz", "--effect", "acc.lever_arm=3", "--seed", "4")
    assert_same(tmp_path / "rig.csv.gz", folder / "rig.csv.gz")
    assert_same(tmp_path / "rig.toml", folder / "rig.toml")


@pytest.mark.parametrize("log", ["rosbag2.mcap", "iron.db3", "none.bag"])
def test_a_log_is_the_recording_that_the_program_imports(program: Program, log: str, tmp_path: pathlib.Path) -> None:
    path = HERE.parents[1] / "logs" / "tests" / "fixtures" / log
    program(tmp_path, "import", path, "--topic", "mag=none", "--out", "a.csv")
    imucal.read(path, topic={"mag": "none"}).write(tmp_path / "b.csv")
    assert_same(tmp_path / "a.csv", tmp_path / "b.csv")
    with pytest.raises(imucal.ReadError, match="/nowhere"):
        imucal.read(path, topic={"imu": "/nowhere"})


def test_a_calibration_of_a_rig_is_the_program_s(
    program: Program, folder: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    same_calibration(program, folder / "rig.csv.gz", tmp_path, accept_suspect=True)


@pytest.mark.filterwarnings("ignore::imucal.ImucalWarning")
def test_a_calibration_of_a_real_sensor_is_the_program_s(
    program: Program, real: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    same_calibration(program, real / "xsens-mti.csv.gz", tmp_path, accept_suspect=False)


def test_models_and_comparison_are_the_program_s(
    program: Program, folder: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    path = folder / "poses.csv"
    options = ["--model", "acc=T9", "--compare", "--no-temperature", "--threshold", "4"]
    program(tmp_path, "calibrate", path, *options, "--json", tmp_path / "a.json", "--accept-suspect")
    found = imucal.calibrate(
        imucal.read(path), models={"acc": "T9"}, compare=True, temperature=False, threshold=4, accept_suspect=True
    )
    assert found.json == (tmp_path / "a.json").read_text()
    assert found["compare"] and found.acc is not None and found.acc.model == "T9"


def test_arrays_are_corrected_to_the_bits_of_the_corrected_recording(
    rig: imucal.Recording, calibration: imucal.Calibration
) -> None:
    corrected = imucal.apply(rig, calibration)
    for kind, sensor in calibration.sensors.items():
        if sensor.status != "accepted":
            continue
        counts = rig.manifest["counts"][kind]
        values = getattr(rig, kind)
        raw = (counts["offset"] + counts["per_unit"] * values).astype(np.float32)
        assert rig.temperature is not None
        found = imucal.apply({kind: raw, "temperature": rig.temperature}, calibration)[kind]
        assert found.dtype == np.float32
        per_unit = 1.0 if sensor.unit_out != "counts" else counts["per_unit"]
        np.testing.assert_array_equal(found.astype(np.float64) / per_unit, getattr(corrected, kind))


def test_a_diagnosis_is_the_program_s(
    program: Program, folder: pathlib.Path, rig: imucal.Recording, tmp_path: pathlib.Path
) -> None:
    found = imucal.diagnose(rig, html=True)
    assert found.json == program(folder, "diagnose", "rig.csv.gz", "--json", "-", "--html", tmp_path / "gap.html")
    assert found.html == (tmp_path / "gap.html").read_text()
    assert pickle.loads(pickle.dumps(found)).verdict == found.verdict
    assert found.to_dict() == json.loads(found.json)
    assert found.verdict == "explained" and "acc.lever_arm" in [cause.effect for cause in found.causes]
    assert found.causes[0]["probability"] == found.causes[0].probability


def test_a_page_is_of_a_recording_that_has_a_file(rig: imucal.Recording, calibration: imucal.Calibration) -> None:
    made = imucal.apply(rig, calibration)
    for make in (imucal.calibrate, imucal.diagnose):
        with pytest.raises(imucal.OptionError, match="made in memory"):
            make(made, html=True)


def test_a_diagnosis_along_a_simulator_is_the_program_s(program: Program, tmp_path: pathlib.Path) -> None:
    robot = ["--robot", "wheeled", "--duration", "40", "--si", "--effect", "clk.time_offset=2"]
    program(tmp_path, "simulate", "--out", "walk.csv", *robot)
    text = program(tmp_path, "diagnose", "walk-real.csv", "--sim", "walk-sim.csv", "--json", "-")
    found = imucal.diagnose(imucal.read(tmp_path / "walk-real.csv"), sim=tmp_path / "walk-sim.csv")
    assert found.json == text and found["reference"] == "simulator"


def test_the_noise_of_a_unit_is_the_program_s(
    program: Program, folder: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    found = imucal.noise(folder / "still.csv", html=True)
    assert found.json == program(folder, "noise", "still.csv", "--json", "-", "--html", tmp_path / "noise.html")
    assert found.html == (tmp_path / "noise.html").read_text()
    assert imucal.noise(folder / "still.csv").html is None
    assert found.to_dict() == json.loads(found.json)
    assert found.gyr is not None and found.gyr.status == "estimated" and found.serial == "7"
    white = found.gyr["axes"][0]["white"]["value"]
    assert white == pytest.approx(0.001 / 100**0.5, rel=0.05)
