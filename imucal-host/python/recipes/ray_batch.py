"""Many recordings on many cores or machines: Ray calibrates, DuckDB answers questions about the results.

    python ray_batch.py results.jsonl RECORDING...

Each recording is a task. Where its worker is killed, Ray runs the task again on another one. A file that cannot be read
is a row with the status ``unreadable``, and stops nothing.
"""

from __future__ import annotations

import json
import pathlib
import sys
from collections.abc import Callable, Iterable
from typing import Any

import ray

import imucal

Rows = list[dict[str, Any]]

#: How often a task is begun again after its worker has died.
RETRIES = 3


def rows_of(path: str) -> Rows:
    """A row for each sensor of a recording: its status, and how good the fit is."""
    try:
        found = imucal.calibrate(imucal.read(path))
    except imucal.ImucalError as error:
        return [{"recording": path, "sensor": None, "status": "unreadable", "why": str(error)}]
    unit = found["sensor"]["serial"]
    return [
        {
            "recording": path,
            "unit": unit,
            "sensor": sensor.sensor,
            "status": sensor.status,
            "model": sensor.model,
            "rms": sensor.rms,
            "bias": None if sensor.bias is None else sensor.bias.tolist(),
            "why": sensor.detail,
        }
        for sensor in found.sensors.values()
    ]


def run(paths: Iterable[str], work: Callable[[str], Rows] = rows_of) -> Rows:
    """The rows of all recordings, in the order of the paths; Ray is running."""
    task = ray.remote(max_retries=RETRIES)(work)
    return [row for rows in ray.get([task.remote(path) for path in paths]) for row in rows]


def write(rows: Rows, out: pathlib.Path) -> None:
    """A line of JSON for each row, as DuckDB, pandas and others read it."""
    out.write_text("".join(json.dumps(row) + "\n" for row in rows))


#: Sensors by status, and of each the largest residual.
QUESTION = """
select sensor, status, count(*) as sensors, max(rms) as largest_rms
from read_json_auto($rows)
group by all order by all
"""


def main(out: str, *paths: str) -> None:
    """Calibrates, writes the rows, and prints the answer."""
    import duckdb

    ray.init(include_dashboard=False)
    write(run(paths), pathlib.Path(out))
    print(duckdb.execute(QUESTION, {"rows": out}).fetchall())


if __name__ == "__main__":
    main(*sys.argv[1:])
