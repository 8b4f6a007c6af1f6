"""The recipe for many recordings: results as of one process, though a worker is killed and a file is broken."""

from __future__ import annotations

import os
import pathlib
import subprocess
import sys

import pytest

import imucal

RECIPES = pathlib.Path(__file__).parents[1] / "recipes"

#: Kills the worker of the second recording the first time it is asked for.
KILLED = """
import json, os, pathlib, signal, sys
import ray, ray_batch

marker = pathlib.Path(sys.argv[1])

def fragile(path):
    if path.endswith("1.csv") and not marker.exists():
        marker.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return ray_batch.rows_of(path)

ray.init(include_dashboard=False, num_cpus=2)
rows = ray_batch.run(sys.argv[3:], fragile)
ray_batch.write(rows, pathlib.Path(sys.argv[2]))
"""


def test_ray_calibrates_all_recordings_though_a_worker_is_killed(tmp_path: pathlib.Path) -> None:
    pytest.importorskip("ray", reason="*** SKIPPED: ray is not installed ***")
    paths = []
    for seed in range(4):
        path = tmp_path / f"unit-{seed}.csv"
        imucal.simulate(programme="multi-position", rate=20, seed=seed + 1).write(path)
        paths.append(str(path))
    broken = tmp_path / "broken.csv"
    broken.write_text("no recording\n")
    marker, out = tmp_path / "killed", tmp_path / "rows.jsonl"
    words = [sys.executable, "-c", KILLED, marker, out, *paths, broken]
    environment = {**os.environ, "PYTHONPATH": str(RECIPES), "RAY_DISABLE_IMPORT_WARNING": "1"}
    done = subprocess.run(list(map(str, words)), env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert marker.exists()
    ask(out, paths)


def ask(out: pathlib.Path, paths: list[str]) -> None:
    """DuckDB finds the rows that one process gives, and the broken file."""
    duckdb = pytest.importorskip("duckdb", reason="*** SKIPPED: duckdb is not installed ***")
    found = duckdb.execute(
        "select recording, sensor, status, rms from read_json_auto($rows) order by all", {"rows": str(out)}
    ).fetchall()
    expected = [
        (path, sensor.sensor, sensor.status, sensor.rms)
        for path in paths
        for sensor in imucal.calibrate(imucal.read(path)).sensors.values()
    ]
    broken = [row for row in found if row[2] == "unreadable"]
    assert sorted(row for row in found if row[2] != "unreadable") == sorted(expected) and len(broken) == 1
    assert broken[0][0].endswith("broken.csv")
    source = (RECIPES / "ray_batch.py").read_text()
    question = source.split('QUESTION = """')[1].split('"""')[0]
    answer = duckdb.execute(question, {"rows": str(out)}).fetchall()
    assert sum(row[2] for row in answer) == len(expected) + 1
